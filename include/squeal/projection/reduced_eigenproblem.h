#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/projection/eigensolver_options.h>

#include <array>
#include <complex>
#include <vector>

namespace squeal
{
  /// Eigenpairs in coordinates.
  struct ReducedPairs
  {
    std::vector<std::complex<double>> lambda;
    DenseMatrix re, im;
    std::vector<double> errors; ///< bounds of backward errors

    /// The pairs of the given numbers, without their errors.
    ReducedPairs select(const std::vector<unsigned int> &which) const;
  };

  /// The small problem (l^2 M + l P + Q) c = 0 of a projection, and its right and left pairs in the
  /// disc. Coordinates whose vectors violate constraints are left out: c = Z b, Z orthonormal.
  class ReducedEigenproblem
  {
  public:
    ReducedEigenproblem(const double max_imaginary, const double tolerance)
        : max_imaginary(max_imaginary), radius(search_radius(max_imaginary)), tolerance(tolerance)
    {
    }

    /// Vectors of gaps that are closed now leave the problem. @p violations has by row, of a unit
    /// vector, what it must be moved by.
    void set_violations(const DenseMatrix &violations);
    /// Sets Q, P and M by their orders, Q first; P may be empty.
    void set_terms(unsigned int order, const DenseMatrix &projected);

    /// All right and left pairs of the disc but overdamped ones, in the same order, by LAPACK.
    /// Throws SingularMatrix where an eigenvalue is zero.
    void solve_densely(ReducedPairs &x, ReducedPairs &y) const;
    /// The pairs near given ones, of this or a smaller dimension, by two-sided Rayleigh quotient
    /// iteration; false if some do not converge, leave the disc or become overdamped.
    bool improve(ReducedPairs &x, ReducedPairs &y) const;

  private:
    using Complex = std::complex<double>;

    /// Z^T A Z.
    DenseMatrix in_kernel(const DenseMatrix &a) const;
    /// Unit coordinates of Z v.
    void set_column(ReducedPairs &pairs, unsigned int k, const std::vector<Complex> &vector) const;

    double max_imaginary, radius, tolerance;
    unsigned int dimension = 0;
    DenseMatrix kernel;                       ///< Z; empty: all coordinates
    std::array<DenseMatrix, 3> small_problem; ///< Z^T A Z by order
  };
} // namespace squeal
