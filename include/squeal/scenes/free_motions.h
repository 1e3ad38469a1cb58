#pragma once

#include <squeal/mesh/geometry.h>
#include <squeal/parameters/parameters.h>

namespace squeal
{
  /// Adds the free motions of a pad whose back face lies at @p height above the rotor's coordinates
  /// (z, in the strip y) and is guided. Throws InputError where worn pads need others.
  template <int dim>
  void add_motions_of_pad(const Parameters::All &parameters, Body pad, double height,
                          Geometry<dim> &geometry);

  /// Throws InputError where a pad of worn ones has no free motion towards the rotor. @p name names
  /// the pad of an interface.
  void check_free_motions(const Geometry<3> &geometry);
} // namespace squeal
