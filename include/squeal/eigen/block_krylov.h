#pragma once

#include <squeal/projection/search_region.h>
#include <squeal/projection/shift_invert.h>

namespace squeal
{
  struct BlockSearchOptions
  {
    SearchRegion region;             ///< every eigenvalue of it is looked for
    double max_imaginary    = 0;     ///< those with Im l <= max_imaginary to the tolerance ...
    double tolerance        = 1e-11; ///< ... a relative residual of S, others to its root
    unsigned int n_expected = 0;     ///< pairs of the region, as far as known: when to look first
    unsigned int seed       = 0;
    double reach = 1; ///< return pairs up to this distance(), those beyond the rim as they are

    /// The search ends with so many vectors and gives the pairs that have converged, others as
    /// proof.ritz_values_beyond; 0: it fails with more than n_expected and block_size make likely.
    unsigned int most_vectors = 0;

    /// Larger blocks make a right-hand side cheaper and need more of them: 4 to 8 are equally fast,
    /// 16 takes 1.4 times as long (a brake of 52 300 unknowns, 25 pairs).
    unsigned int block_size = 6;
  };

  /// Block Krylov search of (l^2 M + l P + Q) x = 0 with shift-invert at the real shift s, in
  /// real arithmetic. With l = s + c/theta, theta is an eigenvalue of
  ///     S (a, b) = (-Q(s)^{-1} (c Q'(s) a + c^2 M b), a),      a = theta b, x = b,
  /// and, without a velocity term, of S b = c^2 F^{-1} M b, F = Q + t M, l^2 = t - c^2/theta, where
  /// t = s^2 or any other real number, the centre of the region for instance. Each step
  /// is one solve with a block of right-hand sides, which costs a fraction of as many single
  /// solves.
  ///
  /// The Krylov vectors are kept as (U g_1, U g_2) with one orthonormal basis U of vectors of the
  /// problem's size and small orthonormal (g_1, g_2) (two-level orthogonal Arnoldi: Lu, Su and Bai,
  /// 2016), half of the memory and of the work of vectors of twice that size.
  ///
  /// Gives all converged right pairs with Im l >= 0 in the region and up to `reach`, U as what may
  /// be reused, the number of right-hand sides, and of a disc what it shows of those outside
  /// (proof.ritz_values_beyond).
  ///
  /// S does not see the contact pressures. The eigenvectors returned are images S v, with the
  /// pressures that belong to them. Throws SolverError if the space grows too large.
  EigenSolution block_krylov_search(const QuadraticEigenproblem &problem,
                                    const ShiftInvert &shift_invert,
                                    const BlockSearchOptions &options,
                                    const std::function<void(const std::string &)> &progress);
} // namespace squeal
