#pragma once

#include <squeal/mesh/mortar.h>

namespace squeal
{
  /// The point of a surface that is nearest to another one.
  struct NearestPoint
  {
    unsigned int face = -1; ///< that has it; -1: the surface has no faces
    dealii::Point<2> xi;    ///< its reference coordinates there
    double distance = 0;    ///< m
  };

  /// The point of a surface of faces of one degree that is nearest to @p x. Of faces that have it
  /// in common the first is given.
  NearestPoint nearest_point(const FaceElement<3> &element,
                             const std::vector<SurfaceFace<3>> &faces, const dealii::Point<3> &x);
} // namespace squeal
