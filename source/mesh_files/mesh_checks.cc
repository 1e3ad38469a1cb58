#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh_files/mesh_checks.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <tuple>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    constexpr double least_cover = 0.5; ///< of a pad's face by the rotor

    Box box_of(const std::vector<SurfaceFace<3>> &surface)
    {
      Box result;
      for (const SurfaceFace<3> &face : surface)
        for (const Point<3> &x : face.nodes)
          result.add(x);
      return result;
    }

    /// What a surface that reaches along z may be instead: plane across another axis, or tilted.
    std::string advice_on_plane(const std::vector<SurfaceFace<3>> &surface, const double allowed,
                                const std::string &axes)
    {
      const Box box = box_of(surface);
      for (unsigned int d = 0; d < 2; ++d)
        if (box.high[d] - box.low[d] <= allowed)
          return text_of(". It is plane across ", axes[d], " of the file: Mesh/Axis = ", axes[d],
                         "?");
      const FaceElement<3> element(1);
      Tensor<1, 3> normal;
      for (const SurfaceFace<3> &face : surface)
        normal += element.frame(face, Point<2>(0.5, 0.5)).normal;
      normal /= std::max(normal.norm(), 1e-300);
      double least = 1e300, most = -1e300;
      for (const SurfaceFace<3> &face : surface)
        for (const Point<3> &x : face.nodes)
        {
          least = std::min(least, normal * x);
          most  = std::max(most, normal * x);
        }
      if (most - least > allowed)
        return ".";
      return text_of(". It is plane, but tilted by ",
                     number(std::acos(std::min(std::abs(normal[2]), 1.)) * 180 / M_PI, 3),
                     " degrees against the axis ", axes[2],
                     " of the file: is that the axis of the disc (Mesh/Axis)?");
    }

    /// What may be meant where the pad's surface is not in the rotor's plane.
    std::string advice_on_gap(const std::string &pad_name, const Box &pad, const double gap,
                              const double allowed, const PairSurroundings &surroundings)
    {
      constexpr double small = 0.01; // of the pad's size
      if (surroundings.rotor_surfaces)
        for (const auto &[name, box] : surroundings.rotor_surfaces())
          if (box.high[2] - box.low[2] <= allowed &&
              std::abs(box.low[2] + box.high[2] - pad.low[2] - pad.high[2]) <= 2 * allowed)
            return text_of(". '", pad_name, "' lies in the plane of '", name, "': swap the pairs?");
      if (std::abs(gap) > small * pad.low.distance(pad.high))
        return ". That is no inaccuracy of a mesh: are the bodies where they belong, and are these "
               "the surfaces that touch?";
      return ". Mesh/Contact tolerance = " + formatted("%.2g", 1.1 * std::abs(gap)) +
             " takes them as touching, without moving nodes. A gap that the load is to close "
             "belongs into Contact/Initial gap, on surfaces that touch in the mesh.";
    }
  } // namespace

  void Box::add(const Point<3> &x)
  {
    for (unsigned int d = 0; d < 3; ++d)
    {
      low[d]  = std::min(low[d], x[d]);
      high[d] = std::max(high[d], x[d]);
    }
  }

  std::string text_of(const Point<3> &x)
  {
    std::ostringstream text;
    text << "(" << x[0] << ", " << x[1] << ", " << x[2] << ") m";
    return text.str();
  }

  void check_distance(const std::string &filename, const Point<3> &in_file, const Point<3> &placed)
  {
    constexpr double largest = 1e50;
    if (placed.norm() <= largest)
      return;
    std::ostringstream message;
    message << "Mesh/File: " << filename << ": the node (" << in_file << ") of the file is at "
            << text_of(placed) << " after Mesh/Scale and Mesh/Origin; allowed are distances of "
            << largest << " m.";
    throw InputError(message.str());
  }

  std::array<double, 8> corner_jacobians(const MeshFile &file, const MeshFile::Cell &cell)
  {
    std::array<double, 8> result;
    for (unsigned int v = 0; v < 8; ++v)
    {
      // In lexicographic order the neighbours of corner v differ in one bit.
      std::array<Tensor<1, 3>, 3> edges;
      double lengths = 1;
      for (unsigned int d = 0; d < 3; ++d)
      {
        const unsigned int low = v & ~(1u << d), high = v | (1u << d);
        edges[d] = file.nodes[cell.nodes[lexicographic_corners[high]]] -
                   file.nodes[cell.nodes[lexicographic_corners[low]]];
        lengths *= edges[d].norm();
      }
      result[v] = lengths > 0 ? edges[0] * cross_product_3d(edges[1], edges[2]) / lengths : 0;
    }
    return result;
  }

  double area_of(const std::array<Point<3>, 4> &x)
  {
    // Half the cross product of the diagonals, which is that of two sides where pairs are wrong:
    // the largest is right.
    return std::max({cross_product_3d(x[3] - x[0], x[2] - x[1]).norm(),
                     cross_product_3d(x[2] - x[0], x[3] - x[1]).norm(),
                     cross_product_3d(x[1] - x[0], x[3] - x[2]).norm()}) /
           2;
  }

  ContactPairMeasures check_contact_pair(const std::string &where, const std::string &pad_name,
                                         const std::vector<SurfaceFace<3>> &pad_faces,
                                         const std::string &rotor_name,
                                         const std::vector<SurfaceFace<3>> &rotor_faces,
                                         const double tolerance,
                                         const PairSurroundings &surroundings)
  {
    const std::string pair = "'" + pad_name + "' and '" + rotor_name + "'";
    const FaceElement<3> element(1);
    const Point<2> middle(0.5, 0.5);
    std::ostringstream message;
    message << where;
    const auto fail = [&]() { throw InputError(message.str()); };

    const Box pad = box_of(pad_faces), rotor = box_of(rotor_faces);
    const double allowed = plane_tolerance * pad.low.distance(pad.high);
    for (const auto &[name, faces] : {std::tie(pad_name, pad_faces), {rotor_name, rotor_faces}})
      if (const Box box = box_of(faces); box.high[2] - box.low[2] > allowed)
      {
        message << "'" << name << "' reaches from z = " << box.low[2] << " to " << box.high[2]
                << " m; contact surfaces must be plane, across the axis z"
                << advice_on_plane(faces, allowed, surroundings.axes);
        fail();
      }
    const double up  = element.frame(rotor_faces[0], middle).normal[2] > 0 ? 1. : -1.;
    const double gap = up * ((pad.low[2] + pad.high[2]) - (rotor.low[2] + rotor.high[2])) / 2;
    const double allowed_gap = std::max(tolerance, allowed);
    if (std::abs(gap) > allowed_gap)
    {
      message << pair << " do not lie in a common plane: z = " << pad.low[2] << " and "
              << rotor.low[2] << " m, " << (gap > 0 ? "a gap of " : "an overlap of ")
              << std::abs(gap) << " m, allowed " << allowed_gap << " m"
              << advice_on_gap(pad_name, pad, gap, allowed_gap, surroundings);
      fail();
    }
    for (const SurfaceFace<3> &face : pad_faces)
      if (element.frame(face, middle).normal[2] * up > 0)
      {
        message << pair << " look in the same direction; they must face each other.";
        fail();
      }

    std::vector<double> areas, covered(pad_faces.size());
    for (const SurfaceFace<3> &face : pad_faces)
      areas.push_back(
          cross_product_3d(face.nodes[3] - face.nodes[0], face.nodes[2] - face.nodes[1]).norm() /
          2);
    for (const FacePair<3> &common : pair_surfaces(element, pad_faces, rotor_faces, allowed_gap))
      for (const PairedPoint<3> &point : common.points)
        covered[common.pad_face] += point.weight;
    ContactPairMeasures result = {pad_name + " : " + rotor_name, gap,
                                  std::accumulate(covered.begin(), covered.end(), 0.),
                                  std::accumulate(areas.begin(), areas.end(), 0.), 1};
    for (unsigned int f = 0; f < pad_faces.size(); ++f)
    {
      const double part  = std::max(0., covered[f] / areas[f]);
      result.least_cover = std::min(result.least_cover, part);
      if (part < least_cover)
      {
        message << pair << " do not overlap everywhere: " << std::lround(100 * part)
                << " % of the pad's face at " << text_of(element.frame(pad_faces[f], middle).x)
                << " lie on the rotor's surface. The whole pad must.";
        fail();
      }
    }
    return result;
  }

  double distance_from_revolution(const std::array<Point<3>, 4> &corners)
  {
    std::array<Point<2>, 4> x;
    for (unsigned int v = 0; v < 4; ++v)
      x[v] = Point<2>(std::hypot(corners[v][0], corners[v][1]), corners[v][2]);
    // The line through the two points that are furthest apart
    Tensor<1, 2> line;
    Point<2> start;
    for (unsigned int v = 0; v < 4; ++v)
      for (unsigned int w = 0; w < v; ++w)
        if ((x[v] - x[w]).norm() > line.norm())
        {
          line  = x[v] - x[w];
          start = x[w];
        }
    double distance = 0;
    for (const Point<2> &point : x)
      if (line.norm() > 0)
        distance = std::max(distance,
                            std::abs(line[0] * (point - start)[1] - line[1] * (point - start)[0]) /
                                line.norm());
    return distance;
  }
} // namespace squeal
