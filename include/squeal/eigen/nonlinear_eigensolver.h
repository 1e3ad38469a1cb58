#pragma once

#include <squeal/eigen/eigensolvers.h>

#include <memory>

namespace squeal
{
  /// Finds the modes of a problem with frozen terms,
  ///     T(l) x = (l^2 M + l P + Q + sum h(l) A) x = 0,
  /// from those of the quadratic one, h = 0, which another solver finds and counts:
  ///
  /// 1. On the real spans V, W of the quadratic problem's right and left vectors, of all modes of
  ///    its disc, the problem is W^T T(l) V: each mode is followed from h = 0 to h
  ///    (follow_to_exact()).
  /// 2. Inverse iteration with the quadratic problem's real factors F,
  ///        x := x - F^{-1} T(l) x,   y := y - F^{-T} T(l)^T y,
  ///    whose results enlarge V and W: a two-sided block Davidson method in real arithmetic, until
  ///    the backward errors of the exact problem are below the tolerance. In the larger spaces the
  ///    pairs are corrected, or followed once more where they would move too far.
  /// 3. Eigenvalues of given matrices by their own digits (use_given_matrices()).
  ///
  /// What is proven: the number of the quadratic problem's modes in the disc, as its solver proves
  /// it; and that there is one mode, no two the same, of the exact problem for each of them. That
  /// none comes into the window from outside of the disc is concluded from those near its end, an
  /// error where they move far. Eigenvalues of relaxation, which are real or nearly so, are no
  /// modes and not searched.
  class NonlinearEigensolver : public Eigensolver
  {
  public:
    /// @p quadratic is block_krylov or dense.
    explicit NonlinearEigensolver(std::unique_ptr<Eigensolver> quadratic)
        : quadratic(std::move(quadratic))
    {
    }
    EigenSolution solve(const QuadraticEigenproblem &problem, const EigensolverOptions &options,
                        const Counting &counting = {}) const override;

  private:
    std::unique_ptr<Eigensolver> quadratic;
  };
} // namespace squeal
