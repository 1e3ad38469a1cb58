#pragma once

#include <squeal/projection/constraint_projection.h>
#include <squeal/projection/eigenpairs.h>

#include <functional>

namespace squeal
{
  /// The eigenproblem as block_davidson() sees it: nothing of it needs a matrix of the bodies.
  struct DavidsonProblem
  {
    QuadraticEigenproblem equations; ///< products with M, P, Q are all that is used
    ConstraintProjection constraints;
    /// Forces to displacements, any number of columns, by a fixed symmetric positive definite
    /// matrix B that is near to the inverse of Q's symmetric part with the constraints added; zero
    /// in the rows of multipliers.
    std::function<MultiVector(const MultiVector &)> precondition;
    /// Whether M and Q are symmetric, P skew: eigenvalues are imaginary, and the left vectors are
    /// the right ones.
    bool is_conservative = false;
  };

  /// The modes with |l| <= search_radius(options.max_imaginary) and |Im l| <= max_imaginary, right
  /// and left vectors, out of approximate ones: generalised Davidson's method (Morgan and Scott
  /// 1986; Crouzeix, Philippe and Sadkane 1994) in blocks and in real arithmetic. @p start spans
  /// the approximate vectors, right and left together: there is one basis U for both.
  ///
  /// Vectors of U satisfy the constraints of right vectors, and those of Z = Pi U the ones of left
  /// vectors, Pi being the projection of ConstraintProjection. One step:
  ///
  /// 1. Pairs Z^T Q(l) U c = 0, d^T Z^T Q(l) U = 0. The contact pressures drop out.
  /// 2. Residuals r = Q(l) x of x = U c and s = Q(l)^T y of y = Z d, with the pressures that take
  ///    most from them.
  /// 3. -B r and -B s, of each the longer one of its two real directions, enlarge U.
  ///
  /// An eigenvalue's error is of the second order, a product of both vectors' errors. It is
  /// accurate once
  ///     2 f e <= options.tolerance,   e = sqrt((r^H B r) (s^H B s)) / (2 |l|^2 |x|_M |y|_M),
  /// where f >= 1 is the factor by which e was too small in the step before: the error was the
  /// change of l divided by 1 - q, q being the ratio of both e. So this is an estimate of its
  /// relative error. *Backward errors*, which the modes have, too, are of the first order and
  /// larger. Once U is large, the pairs of the last two steps make a new one.
  ///
  /// Nothing counts the modes: the proof is left empty. Those that @p start has are
  /// found, and others that emerge in the window, too. Throws SolverError if the pairs do not
  /// converge, and before anything is computed if the vectors will not fit into memory. Collective.
  EigenSolution block_davidson(const DavidsonProblem &problem, MultiVector start,
                               const EigensolverOptions &options);
} // namespace squeal
