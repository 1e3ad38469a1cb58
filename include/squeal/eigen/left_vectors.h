#pragma once

#include <squeal/eigen/block_krylov.h>

namespace squeal
{
  /// Adds the left vectors to the modes: those of the transposed problem, out of a block Krylov
  /// space and refined. Left vectors of equal eigenvalues are chosen biorthogonal to the right
  /// ones. Throws SolverError if they do not converge. @p transposed solves with the transposed
  /// factorisation.
  void add_left_vectors(const QuadraticEigenproblem &problem, const ShiftInvert &transposed,
                        double radius, const EigensolverOptions &options, EigenSolution &solution);

  /// Adds left vectors out of a block Krylov search of the transposed problem; refines them if they
  /// are not accurate.
  void search_left_vectors(const QuadraticEigenproblem &problem, const ShiftInvert &transposed,
                           const BlockSearchOptions &search, const EigensolverOptions &options,
                           EigenSolution &solution);

  /// The transposed problem.
  QuadraticEigenproblem adjoint_of(const QuadraticEigenproblem &problem);

  /// Adds left vectors and their backward errors, given as the right ones of the transposed problem
  /// in the order of the modes: Q(l)^T y = 0, z = conj(y).
  void attach_left_vectors(const QuadraticEigenproblem &problem, EigenPairs transposed_pairs,
                           EigenPairs &modes);

  /// Completes modes that have left vectors already, as LAPACK gives them: their backward errors,
  /// and biorthogonality.
  void complete_left_vectors(const QuadraticEigenproblem &problem, EigenPairs &modes);
} // namespace squeal
