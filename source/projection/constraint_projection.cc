#include <squeal/linalg/petsc_vector_view.h>
#include <squeal/projection/constraint_projection.h>

#include <algorithm>

namespace squeal
{
  namespace
  {
    /// Owns a PETSc index set.
    struct IndexRange
    {
      IndexRange(const MPI_Comm comm, const unsigned int begin, const unsigned int n)
      {
        SQUEAL_PETSC(ISCreateStride(comm, n, begin, 1, &is));
      }
      ~IndexRange()
      {
        ISDestroy(&is);
      }
      IndexRange(const IndexRange &)            = delete;
      IndexRange &operator=(const IndexRange &) = delete;
      IS is                                     = nullptr;
    };

    Matrix submatrix(const Matrix &matrix, const IndexRange &rows, const IndexRange &columns)
    {
      Mat part = nullptr;
      SQUEAL_PETSC(MatCreateSubMatrix(matrix, rows.is, columns.is, MAT_INITIAL_MATRIX, &part));
      return Matrix(part);
    }
  } // namespace

  ConstraintProjection::ConstraintProjection(const RowRange &rows, const unsigned int n_local,
                                             const Matrix &coupling, const MultiVector &stiffness)
      : rows(rows), multipliers{rows.comm, 0, 0, 0}, weights(rows.n_local(), 0.)
  {
    MPI_Allreduce(&n_local, &multipliers.size, 1, MPI_UNSIGNED, MPI_SUM, rows.comm);
    MPI_Scan(&n_local, &multipliers.end, 1, MPI_UNSIGNED, MPI_SUM, rows.comm);
    multipliers.begin = multipliers.end - n_local;
    if (multipliers.size == 0)
      return;
    contact = coupling.view(false);
    for (unsigned int i = 0; i + n_local < rows.n_local(); ++i)
      weights[i] = stiffness.data()[i] > 0 ? 1 / stiffness.data()[i] : 0;

    // S = (N^T W) (N + mu T); W leaves C out
    const IndexRange of_all(rows.comm, rows.begin, rows.n_local()),
        of_multipliers(rows.comm, rows.end - n_local, n_local);
    const Matrix constraints = submatrix(coupling, of_multipliers, of_all),
                 tractions   = submatrix(coupling, of_all, of_multipliers);
    MultiVector scaling(rows, 1);
    std::copy(weights.begin(), weights.end(), scaling.data());
    SQUEAL_PETSC(MatDiagonalScale(constraints, nullptr, PetscVectorView(scaling)));
    Mat raw = nullptr;
    SQUEAL_PETSC(MatMatMult(constraints, tractions, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &raw));
    const Matrix product(raw);
    // Released multipliers have empty rows and columns.
    MultiVector diagonal(multipliers, 1);
    SQUEAL_PETSC(MatGetDiagonal(product, PetscVectorView(multipliers, diagonal.data())));
    EntryList released;
    for (unsigned int i = 0; i < diagonal.n_local(); ++i)
      if (diagonal.data()[i] == 0)
        released.add(multipliers.begin + i, multipliers.begin + i, 1.);
    const Matrix identity = released.make_matrix(multipliers);
    schur                 = std::make_unique<const Factorization>(
        sum_of(multipliers, {{1., product}, {1., identity}}), Factorization::Kind::lu,
        "the Schur complement of the contact constraints");
  }

  void ConstraintProjection::weigh(MultiVector &x) const
  {
    for (unsigned int k = 0; k < x.n_columns(); ++k)
      for (unsigned int i = 0; i < x.n_local(); ++i)
        x.column(k)[i] *= weights[i];
  }

  MultiVector ConstraintProjection::couple(const MultiVector &x, const bool transposed) const
  {
    return transposed ? multiply_transposed(contact, x) : multiply(contact, x);
  }

  MultiVector ConstraintProjection::solve(const MultiVector &rows_of_multipliers,
                                          const bool transposed) const
  {
    const unsigned int n = multipliers.n_local(), n_columns = rows_of_multipliers.n_columns(),
                       first = rows.n_local() - n;
    MultiVector right(multipliers, n_columns), result(rows, n_columns);
    for (unsigned int k = 0; k < n_columns; ++k)
      std::copy_n(rows_of_multipliers.column(k) + first, n, right.column(k));
    const MultiVector solution = transposed ? schur->solve_transposed(right) : schur->solve(right);
    for (unsigned int k = 0; k < n_columns; ++k)
      std::copy_n(solution.column(k), n, result.column(k) + first);
    return result;
  }

  void ConstraintProjection::satisfy(MultiVector &x, const bool left) const
  {
    if (!schur || x.n_columns() == 0)
      return;
    // The rows of released multipliers say that these are zero, which they are.
    MultiVector moved = couple(solve(couple(x, left), left), left);
    weigh(moved);
    x = difference(std::move(x), moved);
  }

  MultiVector ConstraintProjection::relieve(MultiVector &residual, const bool left) const
  {
    if (!schur || residual.n_columns() == 0)
      return MultiVector(rows, residual.n_columns());
    MultiVector weighted = residual;
    weigh(weighted);
    const MultiVector pressures = solve(couple(weighted, left), left);
    residual                    = difference(std::move(residual), couple(pressures, left));
    return difference(MultiVector(rows, residual.n_columns()), pressures);
  }
} // namespace squeal
