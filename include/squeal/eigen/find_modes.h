#pragma once

#include <squeal/parameters/choices.h>
#include <squeal/projection/eigenpairs.h>

namespace squeal
{
  class Sectors;

  /// Finds every mode of a window by sectors. Collective.
  ///
  /// The modes of a problem that is its own mirror image are symmetric, S x = x, or antisymmetric,
  /// S x = -x: two problems of half the size,
  ///     V^T (l^2 M + l P + Q) V y = 0,   x = V y.
  /// One after the other they take half of the time, with a third of the memory for factors at a
  /// time (tests/benchmark/mirror.py). With several ranks each half is solved by half of the ranks,
  /// at the same time, unless factors are kept. (Measured on two ranks, default brake: 25 processor
  /// seconds; with all ranks on one half after the other 34.) The symmetric half has fewer modes,
  /// so its ranks also count the reference modes of the other. The whole problem's matrices are not
  /// summed. Backward errors are those of the halves: by how much matrices that stay symmetric
  /// would have to change.
  ///
  /// If the whole is the only sector, or the matrices do not keep to the others, the whole problem
  /// is solved, and no mode's parity is known.
  ///
  /// With relaxation modes are exact, too: NonlinearEigensolver follows them from moduli frozen at
  /// the window's end, below which modes are counted.
  EigenSolution find_modes(ModeSolver solver, const EquationsOfMotion &equations,
                           const EigensolverOptions &options, const Sectors &sectors);
} // namespace squeal
