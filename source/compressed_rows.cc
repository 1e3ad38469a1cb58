#include <squeal/compressed_rows.h>

namespace squeal
{
  Matrix make_matrix(const RowRange &range, const CompressedRows &rows)
  {
    const PetscInt n = range.n_local(), n_global = range.size;
    int n_ranks = 0;
    MPI_Comm_size(range.comm, &n_ranks);
    Mat mat = nullptr;
    if (n_ranks > 1)
    {
      SQUEAL_PETSC(MatCreate(range.comm, &mat));
      Matrix result(mat);
      SQUEAL_PETSC(MatSetSizes(mat, n, n, n_global, n_global));
      SQUEAL_PETSC(MatSetType(mat, MATAIJ));
      SQUEAL_PETSC(MatMPIAIJSetPreallocationCSR(mat, rows.begins.data(), rows.columns.data(),
                                                rows.values.data()));
      return result;
    }
    // PETSc's own way from compressed rows inserts entry by entry.
    std::vector<PetscInt> lengths(n);
    for (PetscInt i = 0; i < n; ++i)
      lengths[i] = rows.begins[i + 1] - rows.begins[i];
    SQUEAL_PETSC(MatCreateSeqAIJ(range.comm, n, n, 0, lengths.data(), &mat));
    Matrix result(mat);
    SQUEAL_PETSC(MatSeqAIJSetColumnIndices(mat, const_cast<PetscInt *>(rows.columns.data())));
    PetscScalar *values = nullptr;
    SQUEAL_PETSC(MatSeqAIJGetArray(mat, &values));
    std::copy(rows.values.begin(), rows.values.end(), values);
    SQUEAL_PETSC(MatSeqAIJRestoreArray(mat, &values));
    compress(result);
    return result;
  }

  namespace
  {
    /// Entries that this rank stores of a matrix.
    std::size_t n_local_entries(const Mat matrix)
    {
      MatInfo info{};
      SQUEAL_PETSC(MatGetInfo(matrix, MAT_LOCAL, &info));
      return static_cast<std::size_t>(info.nz_used);
    }
  } // namespace

  Matrix sum_of(const RowRange &rows, const std::vector<Summand> &given)
  {
    std::vector<Summand> summands;
    std::vector<Matrix> transposes;
    for (const Summand &s : given)
      if (s.matrix && s.coefficient != 0)
      {
        summands.push_back(s);
        if (s.transposed_too)
        {
          Mat transpose = nullptr;
          SQUEAL_PETSC(MatTranspose(s.matrix, MAT_INITIAL_MATRIX, &transpose));
          transposes.emplace_back(transpose);
          summands.push_back({s.coefficient, transpose});
        }
      }
    if (summands.empty())
      return {};

    std::size_t n_entries = 0;
    for (const Summand &s : summands)
      n_entries += n_local_entries(s.matrix);
    CompressedRows result;
    result.reserve(n_entries); // pages that are not written to take no memory
    RowSums sums(rows.size, 1);
    for (PetscInt row = rows.begin; row < PetscInt(rows.end); ++row)
    {
      for (const Summand &s : summands)
      {
        PetscInt n                = 0;
        const PetscInt *columns   = nullptr;
        const PetscScalar *values = nullptr;
        SQUEAL_PETSC(MatGetRow(s.matrix, row, &n, &columns, &values));
        for (PetscInt k = 0; k < n; ++k)
          *sums.at(columns[k]) += s.coefficient * values[k];
        SQUEAL_PETSC(MatRestoreRow(s.matrix, row, &n, &columns, &values));
      }
      sums.take([&](const unsigned int column, const double *value)
                { result.add(column, *value); });
      result.end_row();
    }
    return make_matrix(rows, result);
  }
} // namespace squeal
