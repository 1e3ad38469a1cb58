#include <squeal/mesh/nearest_point.h>

#include <algorithm>
#include <limits>

namespace squeal
{
  using namespace dealii;

  NearestPoint nearest_point(const FaceElement<3> &element,
                             const std::vector<SurfaceFace<3>> &faces, const Point<3> &x)
  {
    NearestPoint best;
    best.distance = std::numeric_limits<double>::infinity();
    for (unsigned int f = 0; f < faces.size(); ++f)
    {
      // No point of the face is nearer than that to x: it bulges little beyond its nodes.
      const Point<3> &first = faces[f].nodes.front();
      double size           = 0;
      for (const Point<3> &node : faces[f].nodes)
        size = std::max(size, first.distance(node));
      if (first.distance(x) - 1.5 * size >= best.distance)
        continue;
      Point<2> xi = element.project(faces[f], x);
      for (unsigned int d = 0; d < 2; ++d)
        xi[d] = std::min(1., std::max(0., xi[d]));
      const double distance = element.frame(faces[f], xi).x.distance(x);
      // Rounding does not choose among faces that share the point.
      if (best.face == static_cast<unsigned int>(-1) || distance < best.distance - 1e-10 * size)
        best = {f, xi, distance};
    }
    return best;
  }
} // namespace squeal
