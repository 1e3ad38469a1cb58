#pragma once

#include <squeal/eigen/eigenpairs.h>

#include <complex>
#include <vector>

namespace squeal
{
  struct ErrorBounds
  {
    /// What one polynomial degree more would change, coupling of the modes included: l_j plus this
    /// is the corrected value.
    std::vector<std::complex<double>> correction;
    /// Bounds of the whole error of Re l and Im l, 1/s.
    std::vector<double> growth_rate, imaginary;
  };

  /// Bounds of the discretisation's error from its first-order effect @p f (column-major, as large
  /// as the number of modes squared) on the eigenvalues: with one degree more they are those of
  /// diag(l_i) + F. @p growth_rate_parts are sums of the moduli of the cells' parts of Re F_jj.
  ///
  /// One degree more does not see the whole error where the solution is singular: there the error
  /// of the eigenvalue falls like p^(-4a), r^a being the displacement, and a >= 1/2 at edges of
  /// contact and clamps. So the bounds take the part that is seen for 1 - (p/(p+1))^2 of the whole,
  /// with a margin of one fifth. Modes that are close to each other may have different parts: each
  /// one's is varied between what is seen and the whole, the others' held at either. Parts of a
  /// growth rate cancel over the mesh; a fiftieth of their moduli is added for those that are not
  /// seen and may cancel less.
  ///
  /// Modes of different @p parity (one for each mode, or empty) cannot couple: each parity has its
  /// own small matrix. An eigenvalue of it belongs to the mode that its vector is nearest to.
  ///
  /// @p alternatives are effects like @p f that may be so or not and belong to no correction: of
  /// each group of them, which exclude each other, the larger change is added.
  ErrorBounds bound_errors(
      const std::vector<std::complex<double>> &lambda, const std::vector<Parity> &parity,
      const std::vector<std::complex<double>> &f, const std::vector<double> &growth_rate_parts,
      unsigned int degree,
      const std::vector<std::vector<std::vector<std::complex<double>>>> &alternatives = {});
} // namespace squeal
