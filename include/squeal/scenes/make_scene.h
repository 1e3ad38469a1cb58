#pragma once

#include <squeal/mesh/geometry.h>
#include <squeal/parameters/parameters.h>

namespace squeal
{
  /// Makes the scene that the parameters name: in three dimensions the built-in brake or that of a
  /// mesh file, in two the strip. Throws InputError.
  template <int dim>
  Geometry<dim> make_scene(const Parameters::All &parameters);

  /// Makes an annular rotor about the z axis with mid-plane z = 0 and up to two sector pads on its
  /// plane faces (brake_scene.cc).
  Geometry<3> make_brake(const Parameters::All &parameters);

  /// Makes rotor and pads of a mesh file (imported_scene.cc). Groups of the file by name become
  /// bodies, materials, supports, loads and contact pairs as the section Mesh says; the geometry's
  /// report has the mesh's measures. Throws InputError for everything that cannot work: what,
  /// where, what is allowed.
  Geometry<3> make_imported_scene(const Parameters::All &parameters);

  /// Makes an elastic layer y in [-thickness, 0], periodic in x and fixed below, under a block on
  /// y in [0, ...] (strip_scene.cc).
  Geometry<2> make_strip(const Parameters::All &parameters);

  template <>
  inline Geometry<3> make_scene<3>(const Parameters::All &parameters)
  {
    return parameters.scene == Scene::mesh ? make_imported_scene(parameters)
                                           : make_brake(parameters);
  }
  template <>
  inline Geometry<2> make_scene<2>(const Parameters::All &parameters)
  {
    return make_strip(parameters);
  }
} // namespace squeal
