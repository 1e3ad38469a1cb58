#pragma once

#include <squeal/scenes/imported_bodies.h>

namespace squeal
{
  /// Gives the faces of the boundary ids: one for each combination of supports, load, points and
  /// superelements that a face has, and one for each surface in contact or tied. Adds supports,
  /// loads and pads in contact to @p geometry; its points and superelements, which must be there
  /// already, get their boundaries. Throws InputError for uses that do not go together.
  void name_faces(const Parameters::All &prm, ImportedMesh &mesh, const ImportedBodies &bodies,
                  Geometry<3> &geometry);
} // namespace squeal
