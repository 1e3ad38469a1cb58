#pragma once

#include <squeal/linalg/multi_vector.h>

#include <memory>
#include <string>
#include <vector>

namespace squeal
{
  /// A sparse LU or LDL^T factorisation by MUMPS.
  class Factorization
  {
  public:
    enum class Kind
    {
      lu,
      ldlt
    };
    /// Throws SolverError if the matrix is singular, and if the memory that the analysis of its
    /// pattern predicts is not there, before any of it is taken.
    Factorization(const Matrix &matrix, Kind kind, const std::string &what);
    ~Factorization();
    Factorization(const Factorization &)            = delete;
    Factorization &operator=(const Factorization &) = delete;

    /// Becomes that of another matrix with the same pattern, whose analysis serves again.
    void renew(const Matrix &matrix);

    /// A^{-1} B.
    MultiVector solve(const MultiVector &right_hand_sides) const;
    /// A^{-T} B.
    MultiVector solve_transposed(const MultiVector &right_hand_sides) const;

    struct Inertia
    {
      unsigned int negative, zero, positive;
    };
    /// Signs of the eigenvalues of a symmetric matrix (Sylvester's law). Kind ldlt only.
    Inertia inertia() const;

    double memory_mib() const; ///< used, all ranks together
    double predicted_memory_mib() const
    {
      return predicted_mib;
    }
    Mat factor() const
    {
      return mat;
    }

  private:
    /// Marks it as symmetric if that is what is factorised. Throws SolverError if there are numbers
    /// too large to compute with.
    void prepare(const Matrix &matrix) const;
    void analyse(const Matrix &matrix);
    /// Where the room for delayed pivots is not enough, once more with more of it.
    void factorise(const Matrix &matrix);
    /// Throws SolverError if the machine lacks the memory that the analysis predicts.
    void check_memory(MPI_Comm comm);

    Mat mat = nullptr;
    MatFactorInfo info{};
    const bool lu;
    const std::string what;
    double predicted_mib = 0;
    PetscInt room        = 50; ///< for delayed pivots, percent of the prediction
  };

  /// Factors of what is left of a matrix while some unknowns are held, x_i = 0 in place of their
  /// equations. Unknowns that are coupled with held ones alone are held, too, as what ties them to
  /// each other.
  class PartialFactorization
  {
  public:
    /// @p held has an entry for each row of all ranks, set where it is known. Collective; throws
    /// SolverError.
    PartialFactorization(const RowRange &rows, const Matrix &A, std::vector<char> held,
                         Factorization::Kind kind, const std::string &what);
    /// A^{-1} B on what is not held, zero elsewhere. Collective; throws SolverError.
    MultiVector solve(const MultiVector &right_hand_sides) const;

  private:
    RowRange part;
    std::vector<PetscInt> kept; ///< rows of this rank that are not held
    std::unique_ptr<Factorization> factors;
  };

  /// x of A x = b beside held unknowns, one column. Collective; throws SolverError.
  MultiVector solve_beside_held(const Matrix &A, std::vector<char> held, const MultiVector &b,
                                const std::string &what);
} // namespace squeal
