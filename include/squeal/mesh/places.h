#pragma once

#include <squeal/linalg/multi_vector.h>
#include <squeal/parameters/parameters.h>

#include <string>
#include <vector>

namespace squeal
{
  template <int dim>
  class FiniteElementSpace;

  /// Gives each place and direction d a column e with e^T u = d . u(x); for a surface, its mean
  ///
  ///     e^T u = 1/|A| int_A d . u da,
  ///
  /// and for a point of joints d . r_t. So F e is the load of a force F d, of a surface spread
  /// evenly. A point may lie beside the mesh by a hundredth of the cell that is nearest. @p key
  /// names the list in errors. Throws InputError for a place that there is not, and for a point
  /// that several bodies have if none is named. Collective.
  template <int dim>
  MultiVector motions_at(const FiniteElementSpace<dim> &spaces,
                         const std::vector<Parameters::Response::Place> &places,
                         const std::string &key);
} // namespace squeal
