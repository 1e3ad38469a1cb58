#include <squeal/base/memory.h>
#include <squeal/base/signals.h>
#include <squeal/base/text.h>
#include <squeal/linalg/factorization.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <sstream>

namespace squeal
{
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
  } // namespace

  Factorization::Factorization(const Matrix &matrix, const Kind kind, const std::string &what)
      : lu(kind == Kind::lu), what(what)
  {
    prepare(matrix);
    SQUEAL_PETSC(MatFactorInfoInitialize(&info));
    try
    {
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
    const double largest_sum = matrix.infinity_norm();
    if (std::isnan(squares) || !std::isfinite(largest_sum))
      throw SolverError("Cannot factorise " + what + ": its numbers are too large to compute with.",
                        {Failure::numbers_too_large});
    // MUMPS wants at least one entry.
    if (largest_sum == 0)
      throw SingularMatrix("Cannot factorise " + what + ": all its entries are zero.");
  }

  void Factorization::analyse(const Matrix &matrix)
  {
    SQUEAL_PETSC(MatDestroy(&mat));
    SQUEAL_PETSC(
        MatGetFactor(matrix, MATSOLVERMUMPS, lu ? MAT_FACTOR_LU : MAT_FACTOR_CHOLESKY, &mat));
    // A pivot is at least this times what it eliminates. With MUMPS' own 0.01 solutions with
    // large models lose digits (relative errors of 1e-9, and the modes had to be refined); the
    // factors are as large and take as long.
    if (lu)
      SQUEAL_PETSC(MatMumpsSetCntl(mat, 1, 0.1));
    else
      SQUEAL_PETSC(MatMumpsSetIcntl(mat, 24, 1)); // null pivots are counted, as an inertia needs
    if (lu)
      SQUEAL_PETSC(MatLUFactorSymbolic(mat, matrix, nullptr, nullptr, &info));
    else
      SQUEAL_PETSC(MatCholeskyFactorSymbolic(mat, matrix, nullptr, &info));
    MPI_Comm comm = MPI_COMM_NULL;
    SQUEAL_PETSC(PetscObjectGetComm(PetscObject(Mat(matrix)), &comm));
    check_memory(comm);
    // It is reserved but rarely used, so that the prediction is made without.
    SQUEAL_PETSC(MatMumpsSetIcntl(mat, 14, room));
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
    // Many constraints delay many pivots, more than the analysis of the pattern knows of: work
    // arrays (-8, -9) and buffers between ranks (-17, -20) are too small.
    constexpr PetscInt most_room = 1000;
    if ((code == -8 || code == -9 || code == -17 || code == -20) && room < most_room)
    {
      room *= 5;
      analyse(matrix);
      factorise(matrix);
      return;
    }
    const std::string message = text_of("MUMPS cannot factorise ", what, " (INFOG(1) = ", code,
                                        ", INFOG(2) = ", detail, "): ");
    // Codes that mean a lack of memory (MUMPS' manual, section 8); PETSc knows some of them.
    constexpr std::array<PetscInt, 6> of_memory = {{-5, -7, -8, -9, -13, -19}};
    if (error == MAT_FACTOR_OUTMEMORY ||
        std::find(of_memory.begin(), of_memory.end(), code) != of_memory.end())
      throw std::bad_alloc();
    if (error == MAT_FACTOR_NUMERIC_ZEROPIVOT)
      throw SingularMatrix(message + "the matrix is singular", {Failure::singular_factors});
    throw SolverError(message + "see the MUMPS manual.");
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
        throw SolverError("A solve with the factors of " + what + " gave a non-finite number.",
                          {Failure::numbers_too_large});
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

  PartialFactorization::PartialFactorization(const RowRange &rows, const Matrix &A,
                                             std::vector<char> held, const Factorization::Kind kind,
                                             const std::string &what)
  {
    const auto combine = [&rows](std::vector<char> &flags)
    { MPI_Allreduce(MPI_IN_PLACE, flags.data(), flags.size(), MPI_CHAR, MPI_MAX, rows.comm); };
    combine(held);
    std::vector<char> is_free(rows.size);
    for_entries(A, [&](const PetscInt row, const PetscInt column, double)
                { is_free[row] |= !held[row] && !held[column]; });
    combine(is_free);
    for (unsigned int row = rows.begin; row < rows.end; ++row)
      if (is_free[row])
        kept.push_back(row);
    part = {rows.comm, 0, 0, unsigned(std::count(is_free.begin(), is_free.end(), 1))};
    for (unsigned int row = 0; row < rows.begin; ++row)
      part.begin += is_free[row];
    part.end = part.begin + kept.size();
    IS set   = nullptr;
    SQUEAL_PETSC(ISCreateGeneral(rows.comm, kept.size(), kept.data(), PETSC_USE_POINTER, &set));
    Mat submatrix = nullptr;
    SQUEAL_PETSC(MatCreateSubMatrix(A, set, set, MAT_INITIAL_MATRIX, &submatrix));
    SQUEAL_PETSC(ISDestroy(&set));
    factors = std::make_unique<Factorization>(Matrix(submatrix), kind, what);
  }

  MultiVector PartialFactorization::solve(const MultiVector &right_hand_sides) const
  {
    const RowRange &rows = right_hand_sides.row_range();
    MultiVector restricted(part, right_hand_sides.n_columns()),
        x(rows, right_hand_sides.n_columns());
    for (unsigned int j = 0; j < x.n_columns(); ++j)
      for (unsigned int i = 0; i < kept.size(); ++i)
        restricted.column(j)[i] = right_hand_sides.column(j)[kept[i] - rows.begin];
    restricted = factors->solve(restricted);
    for (unsigned int j = 0; j < x.n_columns(); ++j)
      for (unsigned int i = 0; i < kept.size(); ++i)
        x.column(j)[kept[i] - rows.begin] = restricted.column(j)[i];
    return x;
  }

  MultiVector solve_beside_held(const Matrix &A, std::vector<char> held, const MultiVector &b,
                                const std::string &what)
  {
    return PartialFactorization(b.row_range(), A, std::move(held), Factorization::Kind::lu, what)
        .solve(b);
  }
} // namespace squeal
