#pragma once

#include <squeal/eigen/block_krylov.h>

namespace squeal
{
  /// Adds the left vectors to modes: those of the transposed problem, out of a block Krylov space
  /// and polished. Left vectors of equal eigenvalues are chosen biorthogonal to the right ones.
  /// Throws SolverError if they do not converge. @p transposed solves with the transposed
  /// factorisation.
  void add_left_vectors(const QuadraticEigenproblem &problem, const ShiftInvert &transposed,
                        double radius, const EigensolverOptions &options, Modes &modes);

  /// The same by a block Krylov search of the transposed problem.
  void search_left_vectors(const QuadraticEigenproblem &problem, const ShiftInvert &transposed,
                           const BlockSearchOptions &search, const EigensolverOptions &options,
                           Modes &modes);

  /// The transposed problem.
  QuadraticEigenproblem adjoint_of(const QuadraticEigenproblem &problem);

  /// Adds left vectors, given as Q(l)^T y = 0 in the order of the modes, and their backward errors.
  void attach_left_vectors(const QuadraticEigenproblem &problem, Pairs transposed_pairs,
                           std::vector<double> errors, Modes &modes);

  /// The same by one Rayleigh-Ritz step of the transposed problem on a basis of the whole space.
  void add_left_vectors(const QuadraticEigenproblem &problem, const MultiVector &basis,
                        double shift, double radius, Modes &modes);
} // namespace squeal
