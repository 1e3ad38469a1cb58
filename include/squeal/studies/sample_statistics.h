#pragma once

#include <vector>

namespace squeal
{
  /// Points of Sobol's sequence in the open unit cube, the first of which is its centre. Source:
  /// Joe and Kuo, SIAM J. Sci. Comput. 30 (2008), by Boost.
  std::vector<std::vector<double>> sobol_points(unsigned int n_points, unsigned int dimension);

  /// A share of samples and the half of its interval of 95 %.
  struct Share
  {
    double value = 0, error = 0;
  };
  /// Wilson's interval around n_hits / n, as of random samples: quasi-random ones are at least as
  /// good. It is not zero where no sample, or each one, is a hit.
  Share share_of(unsigned int n_hits, unsigned int n);

  /// How much of the variance of a function one of its numbers makes: alone, and with all others.
  struct SensitivityIndices
  {
    Share first_order, total;
  };
  /// From values at points A, B and at A with that number from B, by the estimators of Jansen
  /// (Comput. Phys. Commun. 117 (1999)):
  ///     S_1 = 1 - sum (f_B - f_AB)^2 / (2 n V),   S_T = sum (f_A - f_AB)^2 / (2 n V).
  /// Points where a value is not finite are left out.
  SensitivityIndices sensitivity_indices(const std::vector<double> &at_a,
                                         const std::vector<double> &at_b,
                                         const std::vector<double> &at_ab);

  /// The value that a share of the numbers do not exceed, interpolated; not a number if there are
  /// none.
  double quantile_of(std::vector<double> numbers, double share);
} // namespace squeal
