#include <squeal/base/memory.h>
#include <squeal/base/signals.h>
#include <squeal/base/text.h>
#include <squeal/linalg/dense.h>
#include <squeal/linalg/linear_algebra.h>

#include <petscsys.h>

#include <petscblaslapack.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace squeal
{
  void check_petsc(const PetscErrorCode code, const char *call)
  {
    if (code == 0)
      return;
    const char *text = nullptr;
    char *specific   = nullptr;
    PetscErrorMessage(code, &text, &specific);
    std::string message = std::string("PETSc error ") + std::to_string(code);
    // Where it cannot allocate, PETSc may return the line of the call instead of a code.
    message += std::string(" (") + (text ? text : "probably out of memory") + ")";
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

  void MultiVector::append(const MultiVector &other)
  {
    data_.insert(data_.end(), other.data_.begin(), other.data_.end());
    n_columns_ += other.n_columns_;
  }

  MultiVector &MultiVector::operator*=(const double factor)
  {
    for (double &value : data_)
      value *= factor;
    return *this;
  }

  MultiVector &MultiVector::add(const double factor, const MultiVector &other)
  {
    for (std::size_t k = 0; k < data_.size(); ++k)
      data_[k] += factor * other.data_[k];
    return *this;
  }

  MultiVector MultiVector::columns(const unsigned int first, const unsigned int n) const
  {
    MultiVector result(rows, n);
    std::copy_n(column(first), std::size_t(n_local()) * n, result.data());
    return result;
  }

  namespace
  {
    /// A PETSc dense matrix that borrows the memory of a block.
    Matrix view(const MultiVector &block)
    {
      Mat mat              = nullptr;
      const RowRange &rows = block.row_range();
      SQUEAL_PETSC(MatCreateDense(rows.comm, rows.n_local(), PETSC_DECIDE, rows.size,
                                  block.n_columns(), const_cast<double *>(block.data()), &mat));
      return Matrix(mat);
    }

    void sum_over_ranks(const MPI_Comm comm, std::vector<double> &values)
    {
      MPI_Allreduce(MPI_IN_PLACE, values.data(), values.size(), MPI_DOUBLE, MPI_SUM, comm);
    }
  } // namespace

  MultiVector sum_entries(const RowRange &rows, const std::vector<PetscInt> &entry_rows,
                          const std::vector<PetscScalar> &values)
  {
    Vec vector = nullptr;
    SQUEAL_PETSC(VecCreateMPI(rows.comm, rows.n_local(), rows.size, &vector));
    SQUEAL_PETSC(VecSetOption(vector, VEC_IGNORE_NEGATIVE_INDICES, PETSC_TRUE));
    SQUEAL_PETSC(VecSetValues(vector, values.size(), entry_rows.data(), values.data(), ADD_VALUES));
    SQUEAL_PETSC(VecAssemblyBegin(vector));
    SQUEAL_PETSC(VecAssemblyEnd(vector));
    MultiVector result(rows, 1);
    const PetscScalar *array = nullptr;
    SQUEAL_PETSC(VecGetArrayRead(vector, &array));
    std::copy(array, array + rows.n_local(), result.data());
    SQUEAL_PETSC(VecRestoreArrayRead(vector, &array));
    SQUEAL_PETSC(VecDestroy(&vector));
    return result;
  }

  std::vector<double> replicate(const MultiVector &column)
  {
    const RowRange &range = column.row_range();
    int n_ranks = 0, n_local = range.n_local(), begin = range.begin;
    MPI_Comm_size(range.comm, &n_ranks);
    std::vector<int> counts(n_ranks), offsets(n_ranks);
    MPI_Allgather(&n_local, 1, MPI_INT, counts.data(), 1, MPI_INT, range.comm);
    MPI_Allgather(&begin, 1, MPI_INT, offsets.data(), 1, MPI_INT, range.comm);
    std::vector<double> all(range.size);
    MPI_Allgatherv(column.data(), n_local, MPI_DOUBLE, all.data(), counts.data(), offsets.data(),
                   MPI_DOUBLE, range.comm);
    return all;
  }

  MultiVector difference(MultiVector a, const MultiVector &b)
  {
    a -= b;
    return a;
  }

  double length_of(const MultiVector &column)
  {
    return std::sqrt(inner_products(column, column)[0]);
  }

  double largest_entry(const MultiVector &block)
  {
    double largest = 0;
    for (std::size_t k = 0; k < std::size_t(block.n_local()) * block.n_columns(); ++k)
      largest = std::max(largest, std::abs(block.data()[k]));
    MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, block.row_range().comm);
    return largest;
  }

  std::vector<double> inner_products(const MultiVector &a, const MultiVector &b)
  {
    return inner_products(a, 0, a.n_columns(), b, 0, b.n_columns());
  }

  std::vector<double> inner_products(const MultiVector &a, const unsigned int first_a,
                                     const unsigned int n_a, const MultiVector &b,
                                     const unsigned int first_b, const unsigned int n_b)
  {
    const PetscBLASInt m = n_a, n = n_b, k = a.n_local(), ld = std::max(1, k);
    std::vector<double> result(std::size_t(m) * n);
    const double one = 1, zero = 0;
    if (k > 0 && m > 0 && n > 0)
      BLASgemm_("T", "N", &m, &n, &k, &one, a.column(first_a), &ld, b.column(first_b), &ld, &zero,
                result.data(), &m);
    sum_over_ranks(a.row_range().comm, result);
    return result;
  }

  MultiVector combine(const MultiVector &a, const std::vector<double> &coefficients,
                      const unsigned int n_columns)
  {
    MultiVector result(a.row_range(), n_columns);
    const PetscBLASInt m = a.n_local(), n = n_columns, k = a.n_columns(), ld = std::max(1, m);
    const double one = 1, zero = 0;
    if (k > 0 && m > 0 && n > 0)
      BLASgemm_("N", "N", &m, &n, &k, &one, a.data(), &ld, coefficients.data(), &k, &zero,
                result.data(), &ld);
    return result;
  }

  void subtract_combination(MultiVector &b, const MultiVector &a,
                            const std::vector<double> &coefficients)
  {
    const PetscBLASInt m = a.n_local(), n = b.n_columns(), k = a.n_columns(), ld = std::max(1, m);
    const double minus_one = -1, one = 1;
    if (m > 0 && n > 0 && k > 0)
      BLASgemm_("N", "N", &m, &n, &k, &minus_one, a.data(), &ld, coefficients.data(), &k, &one,
                b.data(), &ld);
  }

  namespace
  {
    DenseMatrix gram_matrix(const MultiVector &block)
    {
      return {block.n_columns(), block.n_columns(), inner_products(block, block)};
    }

    /// Scales the columns to unit length and leaves out those that are zero.
    MultiVector normalized_columns(const MultiVector &block)
    {
      const DenseMatrix gram = gram_matrix(block);
      std::vector<double> coefficients;
      unsigned int n_kept = 0;
      for (unsigned int j = 0; j < block.n_columns(); ++j)
        if (const double length = std::sqrt(gram(j, j)); length > 0)
        {
          coefficients.resize(std::size_t(block.n_columns()) * ++n_kept);
          coefficients[std::size_t(block.n_columns()) * (n_kept - 1) + j] = 1 / length;
        }
      return combine(block, coefficients, n_kept);
    }

    /// block -= basis basis^T block
    void project_out(const MultiVector &basis, MultiVector &block)
    {
      if (basis.n_columns() == 0)
        return;
      subtract_combination(block, basis, inner_products(basis, block));
    }
  } // namespace

  MultiVector orthonormalize(MultiVector block)
  {
    // Gram eigenvalues below this hold directions of length 1e-4, whose relative rounding error is
    // 1e-12.
    constexpr double resolved = 1e-8;
    constexpr double rounding = 1e-14;

    // Long directions first: what is left is short, and known to rounding of the original columns.
    // It must not be scaled before longer ones, which it contains by accident, are taken out.
    MultiVector basis(block.row_range(), 0);
    block = normalized_columns(block);
    while (block.n_columns() > 0)
    {
      project_out(basis, block);
      project_out(basis, block);
      const unsigned int n                  = block.n_columns();
      DenseMatrix vectors                   = gram_matrix(block);
      const std::vector<double> eigenvalues = symmetric_eigen(vectors);
      if (!(eigenvalues.back() > rounding * rounding))
        break;
      std::vector<double> kept, left;
      for (unsigned int j = 0; j < n; ++j)
      {
        const bool keep = eigenvalues[j] > resolved * eigenvalues.back();
        const double c  = keep ? 1 / std::sqrt(eigenvalues[j]) : 1;
        for (unsigned int i = 0; i < n; ++i)
          (keep ? kept : left).push_back(c * vectors(i, j));
      }
      MultiVector next = combine(block, kept, kept.size() / n);
      project_out(basis, next);
      basis.append(next);
      block = combine(block, left, left.size() / n);
    }

    // Loss of orthogonality by rounding is small by now: one more pass removes it.
    if (basis.n_columns() == 0)
      return basis;
    DenseMatrix vectors                   = gram_matrix(basis);
    const std::vector<double> eigenvalues = symmetric_eigen(vectors);
    for (unsigned int j = 0; j < basis.n_columns(); ++j)
      for (unsigned int i = 0; i < basis.n_columns(); ++i)
        vectors(i, j) /= std::sqrt(eigenvalues[j]);
    return combine(basis, vectors.values, basis.n_columns());
  }

  Factorization::Factorization(const Matrix &matrix, const Kind kind, const std::string &what)
      : lu(kind == Kind::lu), what(what)
  {
    prepare(matrix);
    SQUEAL_PETSC(MatFactorInfoInitialize(&info));
    SQUEAL_PETSC(
        MatGetFactor(matrix, MATSOLVERMUMPS, lu ? MAT_FACTOR_LU : MAT_FACTOR_CHOLESKY, &mat));
    try
    {
      // A pivot is at least this times what it eliminates. With MUMPS' own 0.01 solutions with
      // large models lose digits (relative errors of 1e-9, and the modes had to be refined); the
      // factors are as large and take as long.
      if (lu)
        SQUEAL_PETSC(MatMumpsSetCntl(mat, 1, 0.1));
      else
        SQUEAL_PETSC(MatMumpsSetIcntl(mat, 24, 1)); // null pivots are counted, as an inertia needs
      check_interruption();
      analyse(matrix);
      factorise(matrix);
    }
    catch (...)
    {
      MatDestroy(&mat);
      throw;
    }
  }

  void Factorization::renew(const Matrix &matrix)
  {
    prepare(matrix);
    check_interruption();
    factorise(matrix);
  }

  void Factorization::prepare(const Matrix &matrix) const
  {
    if (!lu)
      SQUEAL_PETSC(MatSetOption(matrix, MAT_SYMMETRIC, PETSC_TRUE));
    // MUMPS takes other numbers for a lack of memory. The sum of squares finds what is no number,
    // but may be infinite where all numbers are finite.
    PetscReal squares = 0;
    SQUEAL_PETSC(MatNorm(matrix, NORM_FROBENIUS, &squares));
    if (std::isnan(squares) || !std::isfinite(matrix.infinity_norm()))
      throw SolverError("Cannot factorise " + what + ": its numbers are too large to compute with.",
                        {Failure::numbers_too_large});
  }

  void Factorization::analyse(const Matrix &matrix)
  {
    if (lu)
      SQUEAL_PETSC(MatLUFactorSymbolic(mat, matrix, nullptr, nullptr, &info));
    else
      SQUEAL_PETSC(MatCholeskyFactorSymbolic(mat, matrix, nullptr, &info));
    MPI_Comm comm = MPI_COMM_NULL;
    SQUEAL_PETSC(PetscObjectGetComm(PetscObject(Mat(matrix)), &comm));
    check_memory(comm);
    // Room for delayed pivots, percent. It is reserved but rarely used, so that the prediction is
    // made without.
    SQUEAL_PETSC(MatMumpsSetIcntl(mat, 14, 50));
  }

  void Factorization::factorise(const Matrix &matrix)
  {
    if (lu)
      SQUEAL_PETSC(MatLUFactorNumeric(mat, matrix, &info));
    else
      SQUEAL_PETSC(MatCholeskyFactorNumeric(mat, matrix, &info));
    MatFactorError error;
    SQUEAL_PETSC(MatFactorGetError(mat, &error));
    if (error == MAT_FACTOR_NOERROR)
      return;
    PetscInt code = 0, detail = 0;
    MatMumpsGetInfog(mat, 1, &code);
    MatMumpsGetInfog(mat, 2, &detail);
    const std::string message = text_of("MUMPS cannot factorise ", what, " (INFOG(1) = ", code,
                                        ", INFOG(2) = ", detail, "): ");
    if (error == MAT_FACTOR_NUMERIC_ZEROPIVOT)
      throw SingularMatrix(message + "the matrix is singular", {Failure::singular_factors});
    throw SolverError(message +
                      (error == MAT_FACTOR_OUTMEMORY
                           ? "out of memory: use a coarser mesh or a machine with more memory."
                           : "see the MUMPS manual."));
  }

  void Factorization::check_memory(const MPI_Comm comm)
  {
    constexpr double mib = 1e6 / (1024. * 1024.);
    PetscInt of_rank = 0, of_all = 0;
    SQUEAL_PETSC(MatMumpsGetInfo(mat, 15, &of_rank)); // predicted, 10^6 bytes
    SQUEAL_PETSC(MatMumpsGetInfog(mat, 17, &of_all));
    predicted_mib     = of_all * mib;
    const double load = memory_load(of_rank * mib, comm);
    if (load > 1)
    {
      std::ostringstream message;
      message.precision(3);
      message << "The factorisation of " << what << " needs about " << predicted_mib / 1024
              << " GiB, " << load << " times what is available.";
      throw SolverError(message.str(), {Failure::factors_too_large});
    }
  }

  Factorization::~Factorization()
  {
    if (mat)
      MatDestroy(&mat);
  }

  MultiVector Factorization::solve(const MultiVector &right_hand_sides) const
  {
    MultiVector solution(right_hand_sides.row_range(), right_hand_sides.n_columns());
    if (right_hand_sides.n_columns() == 0)
      return solution;
    check_interruption();
    const Matrix b = view(right_hand_sides), x = view(solution);
    SQUEAL_PETSC(MatMatSolve(mat, b, x));
    for (std::size_t i = 0; i < std::size_t(solution.n_local()) * solution.n_columns(); ++i)
      if (!std::isfinite(solution.data()[i]))
        throw SolverError("A solve with the factors of " + what + " gave a non-finite number.");
    return solution;
  }

  MultiVector Factorization::solve_transposed(const MultiVector &right_hand_sides) const
  {
    // PETSc has no transposed solve of a block with MUMPS; MUMPS itself has.
    SQUEAL_PETSC(MatMumpsSetIcntl(mat, 9, 2));
    MultiVector solution = solve(right_hand_sides);
    SQUEAL_PETSC(MatMumpsSetIcntl(mat, 9, 1));
    return solution;
  }

  Factorization::Inertia Factorization::inertia() const
  {
    PetscInt negative = 0, zero = 0, positive = 0;
    SQUEAL_PETSC(MatGetInertia(mat, &negative, &zero, &positive));
    return {unsigned(negative), unsigned(zero), unsigned(positive)};
  }

  double Factorization::memory_mib() const
  {
    PetscInt megabytes = 0;
    SQUEAL_PETSC(MatMumpsGetInfog(mat, 22, &megabytes)); // memory used, sum over ranks, 10^6 bytes
    return megabytes * 1e6 / (1024. * 1024.);
  }
} // namespace squeal
