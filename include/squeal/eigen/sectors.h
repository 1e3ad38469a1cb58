#pragma once

#include <squeal/eigen/eigensolvers.h>
#include <squeal/equations/sector.h>

namespace squeal
{
  /// The modes of a problem that is its own mirror image are symmetric, S x = x, or antisymmetric,
  /// S x = -x: two problems of half the size,
  ///     V^T (l^2 M + l P + Q) V y = 0,   x = V y,
  /// are solved one after the other: together in half of the time, with a third of the memory for
  /// factors at a time (tests/benchmark/mirror.py). With several ranks, half of them solves each
  /// half at the same time, unless factors are to be kept; those of the symmetric half, which has
  /// fewer modes, count the reference modes of both. The whole problem's matrices are not summed.
  /// Collective.
  /// Backward errors are those of the halves: by how much matrices that stay symmetric would have
  /// to change.
  ///
  /// If the whole is the only sector, or the matrices do not keep to the others, the whole problem
  /// is solved, and no mode's parity is known.
  EigenSolution solve_by_symmetry(const Eigensolver &solver, const EquationsOfMotion &equations,
                                  const EigensolverOptions &options, const Sectors &sectors);

  /// Every mode of the window, exact also with relaxation: the quadratic problem's solver, or a
  /// NonlinearEigensolver with moduli frozen at the window's end, below which modes are counted.
  EigenSolution find_modes(ModeSolver solver, const EquationsOfMotion &equations,
                           const EigensolverOptions &options, const Sectors &sectors);
} // namespace squeal
