#pragma once

#include <squeal/mesh_files/element_file.h>

#include <string>
#include <vector>

namespace squeal
{
  /// The faces of a surface that lie in one plane across a coordinate and look to one side.
  struct PlanePart
  {
    double place; ///< along the coordinate
    bool looks_up;
    std::vector<ElementFile::Face> faces;
  };

  /// Divides the faces of a surface by planes across a coordinate: in ascending order of place, at
  /// one place those that look down first. Faces that are oblique or bent, a rim, are in no part.
  std::vector<PlanePart> plane_parts(const ElementFile &file,
                                     const std::vector<ElementFile::Face> &surface,
                                     unsigned int axis);

  /// Returns the name of part @p k, from 0 on: NAME(1), NAME(2), ...
  std::string name_of_part(const std::string &surface, std::size_t k);

  /// Adds to the surfaces of a file those parts NAME(k) of them that @p names ask for.
  void add_plane_parts(ElementFile &file, const std::vector<std::string> &names, unsigned int axis);
} // namespace squeal
