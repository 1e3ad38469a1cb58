#include <squeal/linalg/compressed_rows.h>
#include <squeal/linalg/multi_vector.h>

#include <petscsys.h>

#include <algorithm>
#include <cmath>
#include <new>

namespace squeal
{
  void check_petsc(const PetscErrorCode code, const char *call)
  {
    if (code == 0)
      return;
    const char *text = nullptr;
    char *specific   = nullptr;
    PetscErrorMessage(code, &text, &specific);
    // Where it cannot allocate, PETSc may return the line of the call instead of a code.
    if (code == PETSC_ERR_MEM || !text)
      throw std::bad_alloc();
    std::string message = std::string("PETSc error ") + std::to_string(code) + " (" + text + ")";
    if (specific && *specific)
      message += std::string(": ") + specific;
    throw SolverError(message + " in " + call);
  }

  Matrix::~Matrix()
  {
    if (mat)
      MatDestroy(&mat);
  }

  namespace
  {
    /// What a shell of PETSc holds.
    struct MatrixFree
    {
      RowRange rows;
      std::function<MultiVector(const MultiVector &, bool transposed)> product;
    };

    PetscErrorCode destroy_matrix_free(Mat mat)
    {
      MatrixFree *held = nullptr;
      PetscCall(MatShellGetContext(mat, &held));
      delete held;
      return 0;
    }

    const MatrixFree *find_matrix_free(Mat mat)
    {
      PetscBool is_shell = PETSC_FALSE;
      MatrixFree *held   = nullptr;
      if (mat)
        SQUEAL_PETSC(
            PetscObjectTypeCompare(reinterpret_cast<PetscObject>(mat), MATSHELL, &is_shell));
      if (is_shell)
        SQUEAL_PETSC(MatShellGetContext(mat, &held));
      return held;
    }

    /// The row of the number of a column that is largest in modulus.
    unsigned int row_of_largest(const MultiVector &column)
    {
      struct
      {
        double value;
        int row;
      } largest{-1, 0};
      for (unsigned int i = 0; i < column.n_local(); ++i)
        if (const double value = std::abs(column.data()[i]); value > largest.value)
          largest = {value, int(column.row_range().begin + i)};
      MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE_INT, MPI_MAXLOC, column.row_range().comm);
      return largest.row;
    }

    /// Hager's method (1984) for |A^T|_1 = |A|_inf: the convex function |A^T x|_1 of |x|_1 <= 1 has
    /// its maximum at a unit vector, and climbs along its gradient A sign(A^T x).
    double estimate_infinity_norm(const MatrixFree &matrix, const bool transposed)
    {
      constexpr unsigned int most_steps = 5;
      MultiVector x(matrix.rows, 1);
      std::fill_n(x.data(), x.n_local(), 1. / matrix.rows.size);
      double norm = 0;
      for (unsigned int step = 0; step < most_steps; ++step)
      {
        MultiVector signs = matrix.product(x, !transposed);
        double sum        = 0;
        for (unsigned int i = 0; i < signs.n_local(); ++i)
        {
          sum += std::abs(signs.data()[i]);
          signs.data()[i] = signs.data()[i] < 0 ? -1 : 1;
        }
        MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, matrix.rows.comm);
        if (sum <= norm)
          break;
        norm                       = sum;
        const MultiVector gradient = matrix.product(signs, transposed);
        const unsigned int best    = row_of_largest(gradient);
        std::fill_n(x.data(), x.n_local(), 0.);
        if (matrix.rows.contains(best))
          x.data()[best - matrix.rows.begin] = 1;
      }
      return norm;
    }
  } // namespace

  Matrix make_matrix_free(const RowRange &rows,
                          std::function<MultiVector(const MultiVector &, bool transposed)> product)
  {
    Mat mat          = nullptr;
    const PetscInt n = rows.n_local(), n_global = rows.size;
    SQUEAL_PETSC(MatCreateShell(rows.comm, n, n, n_global, n_global,
                                new MatrixFree{rows, std::move(product)}, &mat));
    Matrix matrix(mat);
    SQUEAL_PETSC(MatShellSetOperation(mat, MATOP_DESTROY,
                                      reinterpret_cast<void (*)()>(destroy_matrix_free)));
    return matrix;
  }

  const std::function<MultiVector(const MultiVector &, bool transposed)> *
  product_of(const Matrix &matrix)
  {
    const MatrixFree *held = find_matrix_free(matrix.stored());
    return held ? &held->product : nullptr;
  }

  double Matrix::infinity_norm() const
  {
    if (const MatrixFree *held = find_matrix_free(mat))
      return estimate_infinity_norm(*held, transposes);
    PetscReal norm = 0;
    if (mat)
      SQUEAL_PETSC(MatNorm(mat, transposes ? NORM_1 : NORM_INFINITY, &norm));
    return norm;
  }

  Matrix Matrix::view(const bool transposed) const
  {
    if (mat)
      SQUEAL_PETSC(PetscObjectReference(reinterpret_cast<PetscObject>(mat)));
    Matrix result(mat);
    result.transposes = transposes != transposed;
    return result;
  }

  Matrix::operator Mat() const
  {
    if (transposes)
      throw std::logic_error("A transposed view of a matrix is for products only.");
    return mat;
  }

  std::uint64_t Matrix::n_nonzeros() const
  {
    MatInfo info{};
    if (mat)
      SQUEAL_PETSC(MatGetInfo(mat, MAT_GLOBAL_SUM, &info));
    return static_cast<std::uint64_t>(info.nz_used);
  }

  Matrix make_matrix(const RowRange &rows, const std::vector<PetscInt> &diagonal,
                     const std::vector<PetscInt> &off_diagonal)
  {
    Mat mat          = nullptr;
    const PetscInt n = rows.n_local(), n_global = rows.size;
    SQUEAL_PETSC(MatCreateAIJ(rows.comm, n, n, n_global, n_global, 0, diagonal.data(), 0,
                              off_diagonal.data(), &mat));
    Matrix matrix(mat);
    SQUEAL_PETSC(MatSetOption(mat, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_TRUE));
    return matrix;
  }

  void compress(const Matrix &matrix)
  {
    SQUEAL_PETSC(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
    SQUEAL_PETSC(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
  }

  Matrix symmetric_part(const RowRange &rows, const Matrix &matrix)
  {
    return sum_of(rows, {{0.5, matrix, true}});
  }

  Matrix to_matrix(const DenseMatrix &a)
  {
    if (a.values.empty())
      return {};
    CompressedRows rows;
    rows.reserve(a.values.size());
    for (unsigned int i = 0; i < a.n_rows; ++i)
    {
      for (unsigned int j = 0; j < a.n_columns; ++j)
        rows.add(j, a(i, j));
      rows.end_row();
    }
    return make_matrix(small_rows(a.n_rows), std::move(rows));
  }
} // namespace squeal
