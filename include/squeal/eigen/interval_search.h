#pragma once

#include <squeal/projection/eigenpairs.h>
#include <squeal/projection/search_region.h>

namespace squeal
{
  struct IntervalSearchOptions
  {
    SearchRegion region;         ///< every eigenvalue of it is looked for
    double min_imaginary    = 0; ///< those with min <= Im l <= max, 1/s, ...
    double max_imaginary    = 0;
    double tolerance        = 1e-9; ///< ... to this backward error, right and left
    unsigned int n_expected = 0;    ///< pairs of the region, as far as known
    unsigned int seed       = 0;
    bool only_count         = false; ///< find the eigenvalues' places, no vectors
  };

  /// All modes of a region around i w, far from zero, in real arithmetic with one real
  /// factorisation F = Q - w^2 M (@p factorization, w^2 = -region.square).
  ///
  /// 1. A block Krylov space of F^{-1} M: the eigenvectors without the velocity terms P.
  /// 2. P is weak but not negligible: Rayleigh-Ritz with the whole problem, Z^T Q(l) U c = 0, and
  ///    the corrections
  ///        t = -F^{-1} Q(l) x,   x = U c,
  ///    enlarge U until they are short (block Davidson). With Z = F^{-T} M U this is Galerkin's
  ///    method for F^{-1} Q(l), which unlike one for Q(l) has no spurious eigenvalues near w.
  ///    Left vectors likewise with F^T, from the left vectors Z d of the projected problem. Each
  ///    step gains a factor 10 or more: what P couples to outside of the space is damped by about
  ///    |l P| / |F|.
  /// 3. The root of y^T (l^2 M + l P + Q) x = 0 is accurate to the product of both vectors' errors.
  ///
  /// Contact pressures are no part of U: F^{-1} makes displacements that satisfy the constraints,
  /// and Z makes pressures drop out. A correction is solved for by itself, so that it satisfies the
  /// constraints to its own rounding. Vectors returned have pressures.
  ///
  /// Gives the wanted modes, right and left vectors, all eigenvalues of the region, and the number
  /// of right-hand sides. Throws SolverError if the corrections do not converge.
  EigenSolution interval_search(const QuadraticEigenproblem &problem,
                                const Factorization &factorization,
                                const IntervalSearchOptions &options,
                                const std::function<void(const std::string &)> &progress);
} // namespace squeal
