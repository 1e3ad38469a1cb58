#pragma once

#include <squeal/mesh_files/mesh_file.h>
#include <squeal/parameters/parameters.h>

namespace squeal
{
  /// The mesh of the section Mesh as hexahedra: nodes in metres, axis z. Throws InputError.
  MeshFile read_placed_mesh(const Parameters::All &parameters);
} // namespace squeal
