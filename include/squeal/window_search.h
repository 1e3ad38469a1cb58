#pragma once

#include <squeal/search_region.h>
#include <squeal/subspace_iteration.h>

namespace squeal
{
  struct WindowSearchOptions
  {
    SearchRegion region;          ///< every eigenvalue of it is looked for
    double min_imaginary = 0;     ///< those with min <= Im l <= max, 1/s, ...
    double max_imaginary = 0;
    double tolerance     = 1e-9;  ///< ... to this backward error, right and left
    unsigned int n_expected = 0;  ///< pairs of the region, as far as known
    unsigned int seed       = 0;
  };

  /// What a search found: all eigenvalues with Im l > 0 in the region, and of the wanted ones the
  /// right vectors and, in the same order, the left ones as pairs Q(l)^T y = 0.
  struct WindowSearch
  {
    std::vector<std::complex<double>> lambda;
    Pairs right, left;
    std::vector<double> backward_error, left_backward_error;
    unsigned int n_solves = 0; ///< right-hand sides
  };

  /// All modes of a region around i w, far from zero, right and left ones together, in real
  /// arithmetic with one real factorisation F = Q - w^2 M (@p factorization, w^2 = -region.square).
  ///
  /// 1. Block Krylov spaces of F^{-1} M and F^{-T} M, whose eigenvectors are those without the
  ///    velocity terms P.
  /// 2. P is weak but not negligible: two-sided Rayleigh-Ritz Z^T Q(l) U c = 0, d^T Z^T Q(l) U = 0
  ///    with the whole problem, and the corrected vectors
  ///        x - F^{-1} Q(l) x = -F^{-1} ((l^2 + w^2) M + l P) x,   x = U c,
  ///    and likewise y = Z d with F^T, enlarge U and Z until they are no news (two-sided block
  ///    Davidson; Hochstenbach and Sleijpen, 2003). What P couples to outside of the region is
  ///    damped by about |l P| / |F| in each step; eigenvalues are right to the square of that.
  ///
  /// Contact pressures are no part of U and Z: F^{-1} makes displacements that satisfy the
  /// constraints, so that pressures drop out of Z^T Q U. Vectors returned have theirs.
  ///
  /// Throws SolverError if the corrections do not converge.
  WindowSearch window_search(const QuadraticEigenproblem &problem,
                             const Factorization &factorization,
                             const WindowSearchOptions &options,
                             const std::function<void(const std::string &)> &progress);
} // namespace squeal
