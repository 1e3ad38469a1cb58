#pragma once

#include <squeal/projection/shift_invert.h>

namespace squeal
{
  /// Solves a small problem by LAPACK, all of it on every rank: the pairs that are wanted, right
  /// and left, as accurate as eigenvalues of the size of the radius are. Collective.
  EigenPairs dense_eigenpairs(const QuadraticEigenproblem &problem, double radius, double shift,
                              const std::function<bool(const std::complex<double> &)> &is_wanted);

  /// An orthonormal basis of the block Krylov space of Q(s)^{-1} M from a fixed start block. The
  /// velocity terms, weak in a brake, are left to refine_eigenpairs(). Multipliers are cleared.
  MultiVector krylov_basis(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                           unsigned int n_columns, unsigned int seed);

  /// Improves approximate eigenvectors until their backward errors and the last relative changes
  /// of their eigenvalues are below the tolerance. Each step is Rayleigh-Ritz and one inverse
  /// iteration, whose result enlarges the next subspace: block Davidson with the factorisation at
  /// the shift as preconditioner, in real arithmetic.
  ///
  /// The displacements satisfy N^T u = 0, and test vectors must satisfy (N + mu T)^T z = 0 for
  /// the contact pressures to drop out. U does so neither with friction nor, after
  /// orthonormalisation of almost dependent columns, to rounding; Z = Q(s)^{-T} M U does, and is
  /// smooth.
  ///
  /// @p start spans the approximate vectors, @p previous holds their eigenvalues inside the
  /// radius but real ones that decay, which are left out. Ritz values without a small residual are
  /// no eigenvalues and are left out; fewer pairs than given are a SolverError. If the eigenvalues
  /// are @p known, exactly theirs are looked for.
  EigenSolution refine_eigenpairs(const QuadraticEigenproblem &problem,
                                  const ShiftInvert &shift_invert, MultiVector start,
                                  std::vector<std::complex<double>> previous, double radius,
                                  bool known, const EigensolverOptions &options);
} // namespace squeal
