#pragma once

#include <squeal/model/brake_model.h>

#include <string>

namespace squeal
{
  /// Writes the superelement that Output/Superelement asks for: superelement-K.mtx, -M.mtx, if the
  /// part has damping -D.mtx, and -nodes.csv, which Joints/Superelements reads. Returns a line for
  /// the log. Throws SolverError and as write_file(). Collective.
  template <int dim>
  std::string export_superelement(const BrakeModel<dim> &model, const EquationsOfMotion &equations,
                                  const std::string &directory);
} // namespace squeal
