#pragma once

#include <squeal/projection/small_problem.h>

namespace squeal
{
  /// Follows pairs, right and left, of the quadratic problem to the exact one, in steps of s from 0
  /// to 1 along
  ///     t = s + i s (1 - s) / 5,
  /// a way around those t at which two eigenvalues become one defective one: real problems have
  /// them on the real axis, and by chance none are on another curve. In each step close pairs are
  /// corrected together, so that none is lost to its neighbour:
  ///     V = T(l)^{-1} T'(l) X,   W = T(l)^{-T} T'(l)^T Y   at their mean l,
  ///     W^T T(l) V v = theta W^T T'(l) V v:   l - theta, V v,
  /// and then each by itself. A step in which an eigenvalue moves by more than half of the way to
  /// another that is not close is halved. Where steps become too short because a pair meets the
  /// real axis or another one there, the pair has become overdamped and is left out. Divergent
  /// ones, with l real and positive, stay on the real axis with t = s: there is no hysteresis.
  /// Throws SolverError if steps become too short for another reason, or if two pairs have become
  /// one.
  struct Followed
  {
    unsigned int n_steps = 0;
    std::vector<unsigned int> kept; ///< numbers of the pairs, of those before, that are left
  };
  Followed follow_to_exact(const SmallProblem &problem, SmallPairs &pairs);

  /// The damping ratio above which a pair is left out that cannot be followed further.
  constexpr double nearly_overdamped = 0.9;

  /// Corrects approximate pairs of the exact problem. Returns false, and leaves the pairs, if they
  /// move too far or two become one.
  bool correct_exact(const SmallProblem &problem, SmallPairs &pairs);
} // namespace squeal
