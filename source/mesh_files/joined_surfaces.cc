#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh_files/joined_surfaces.h>
#include <squeal/mesh_files/mesh_checks.h>

#include <deal.II/base/quadrature_lib.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    constexpr unsigned int degree = 2; ///< of the patches

    /// The longest distance of two corners along an edge.
    double longest_edge(const std::vector<SurfaceFace<3>> &faces)
    {
      double longest = 0;
      for (const SurfaceFace<3> &face : faces)
        for (const auto &[a, b] : {std::make_pair(0, 2), {2, 8}, {8, 6}, {6, 0}})
          longest = std::max(longest, face.nodes[a].distance(face.nodes[b]));
      return longest;
    }

    double area_of(const FaceElement<3> &element, const SurfaceFace<3> &face)
    {
      const QGauss<2> rule(degree + 2);
      double area = 0;
      for (unsigned int q = 0; q < rule.size(); ++q)
        area += rule.weight(q) * element.frame(face, rule.point(q)).measure;
      return area;
    }
  } // namespace

  double allowed_distance(const double given, const std::vector<SurfaceFace<3>> &first,
                          const std::vector<SurfaceFace<3>> &second)
  {
    // Polygons about one circle need not meet at their ends.
    constexpr double part_of_edge = 0.05;
    return given > 0 ? given : part_of_edge * std::max(longest_edge(first), longest_edge(second));
  }

  std::vector<double> covered_parts(const std::vector<SurfaceFace<3>> &first,
                                    const std::vector<SurfaceFace<3>> &second,
                                    const double distance)
  {
    const FaceElement<3> element(degree);
    std::vector<double> parts(first.size());
    for (const FacePair<3> &pair :
         pair_facing_surfaces(element, first, second, allowed_distance(distance, first, second)))
      for (const PairedPoint<3> &point : pair.points)
        parts[pair.pad_face] += point.weight;
    for (unsigned int f = 0; f < first.size(); ++f)
      parts[f] /= area_of(element, first[f]);
    return parts;
  }

  JointMeasures check_joint(const std::string &where, const std::string &first_name,
                            const std::vector<SurfaceFace<3>> &first,
                            const std::string &second_name,
                            const std::vector<SurfaceFace<3>> &second, const double distance,
                            const double least_cover)
  {
    const FaceElement<3> element(degree);
    const Point<2> middle(0.5, 0.5);
    JointMeasures result = {first_name + " : " + second_name,
                            allowed_distance(distance, first, second), 0., 0., 0.};
    std::vector<double> covered(first.size());
    for (const FacePair<3> &pair : pair_facing_surfaces(element, first, second, result.distance))
      for (const PairedPoint<3> &point : pair.points)
      {
        covered[pair.pad_face] += point.weight;
        result.gap = std::max(
            result.gap, element.frame(first[pair.pad_face], point.xi_pad)
                            .x.distance(element.frame(second[pair.rotor_face], point.xi_rotor).x));
      }
    double least          = 1;
    unsigned int least_at = 0;
    for (unsigned int f = 0; f < first.size(); ++f)
    {
      const double area = area_of(element, first[f]);
      result.area += area;
      result.overlap += covered[f];
      if (covered[f] / area < least)
      {
        least    = covered[f] / area;
        least_at = f;
      }
    }
    if (!(result.overlap >= least_cover * result.area))
      throw InputError(text_of(
          where, "only ", std::lround(100 * result.overlap / result.area), " % of '", first_name,
          "' (", result.area, " m^2) face '", second_name, "' at a distance of at most ",
          result.distance, " m (Joints/Position tolerance), least at ",
          text_of(element.frame(first[least_at], middle).x), ". At least ",
          std::lround(100 * least_cover),
          " % must; name the smaller surface first. A tie with : partly leaves "
          "free what is not covered."));
    return result;
  }
} // namespace squeal
