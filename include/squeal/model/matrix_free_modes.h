#pragma once

#include <squeal/eigen/eigensolvers.h>
#include <squeal/model/brake_model.h>

namespace squeal
{
  /// The modes of a brake without factors of its matrices and without most of these: those of
  /// elements of one degree less on the same mesh are found with factors (solver block_krylov),
  /// which proves their number, and are corrected by block_davidson(). More modes than are wanted
  /// are taken along, so many that those which the degree moves into the window are among them.
  ///
  /// @p model is one of degree 2 or more with Eigenproblem/Solver = block_davidson. Throws
  /// SolverError. Collective.
  template <int dim>
  EigenSolution find_modes_without_factors(const BrakeModel<dim> &model,
                                           const EigensolverOptions &options);
} // namespace squeal
