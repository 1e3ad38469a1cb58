#pragma once

#include <squeal/scenes/imported_superelements.h>

#include <string>
#include <vector>

namespace squeal
{
  /// Adds points, with masses, springs and links, to @p geometry. Their surfaces get ids with the
  /// faces.
  void add_points(const Parameters::Joints &list, Geometry<3> &geometry);

  /// Whether supports, contact and joints hold every body, point and superelement: throws
  /// InputError where a static state needs it, names what moves and how. Gives a line about each
  /// point.
  std::vector<std::string> check_supports(const Parameters::All &prm, const ImportedMesh &mesh,
                                          const ImportedBodies &bodies,
                                          const ImportedSuperelements &superelements,
                                          Geometry<3> &geometry);
} // namespace squeal
