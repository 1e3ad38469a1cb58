#pragma once

#include <squeal/projection/small_problem.h>

namespace squeal
{
  /// The small problem (l^2 M + l P + Q) c = 0 of a projection, and its right and left pairs in the
  /// disc. Coordinates whose vectors violate constraints are left out: c = Z b, Z orthonormal.
  class ReducedEigenproblem
  {
  public:
    ReducedEigenproblem(const double max_imaginary, const double tolerance)
        : accuracy{max_imaginary, tolerance}
    {
    }

    /// Vectors of gaps that are closed now leave the problem. @p violations has by row, of a unit
    /// vector, what it must be moved by.
    void set_violations(const DenseMatrix &violations);
    /// Sets Q, P and M by their orders, Q first; P may be empty.
    void set_terms(unsigned int order, const DenseMatrix &projected);

    /// All pairs of the disc but overdamped ones, unit vectors, by LAPACK. Throws SingularMatrix
    /// where an eigenvalue is zero.
    SmallPairs solve() const;
    /// Corrects pairs that are near, of this or a smaller dimension (SmallProblem::improve).
    bool improve(SmallPairs &pairs) const;

  private:
    SmallProblem::Accuracy accuracy;
    unsigned int dimension = 0;
    DenseMatrix kernel;   ///< Z; empty: all coordinates
    SmallProblem problem; ///< Z^T A Z
  };
} // namespace squeal
