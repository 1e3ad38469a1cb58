#pragma once

#include <squeal/linalg/multi_vector.h>

namespace squeal
{
  /// How much friction amplifies the contact pressure.
  struct SelfLocking
  {
    double gain        = 0; ///< largest real eigenvalue of the feedback; 0: none is positive
    double error       = 0; ///< bound of its residual
    unsigned int steps = 0; ///< of Arnoldi's method
    bool locks() const
    {
      return gain >= 1;
    }
  };

  /// The feedback of friction on the contact pressure that causes it: friction forces B x of the
  /// pressures in x change the frictionless equilibrium A_0 by -A_0^{-1} B x, and with that the
  /// pressures. If a pattern of pressure comes back multiplied by a real gain g, it is amplified to
  /// 1/(1 - g): for 0 < g < 1 the brake is self-energising, at g = 1 the static tangent A_0 + B is
  /// singular, and beyond no steady sliding with these contacts is reached from zero friction: the
  /// brake is self-locking. With constant mu the gain is proportional to mu, so that mu/g is the
  /// critical coefficient, and a sweep over mu finds its divergence det Q = 0 there, as long as the
  /// contacts stay closed and Omega does not matter.
  ///
  /// Why not the positive definiteness of the stiffness' symmetric part: on N^T u = 0 the friction
  /// mu T Lambda is no function of the displacement; with a penalty k_C the form
  ///     u^T K u + k_C int (n^2 + mu n e),   n = [[u]].n,  e = [[u]].e,
  /// is negative for n = -mu e/2 as soon as k_C is large, which tells the penalty, not the brake;
  /// and the flexibility of the contact, N^T K^{-1} (N + mu T), loses it at any mu > 0 for a pad
  /// that may tilt about its back face. Each is a sufficient condition for uniqueness that brakes
  /// never meet.
  ///
  /// @p tangent is symmetric and regular; one LDL^T factorisation, then Arnoldi's method. Throws
  /// SolverError.
  SelfLocking self_locking(const RowRange &rows, const Matrix &tangent, const Matrix &friction);
} // namespace squeal
