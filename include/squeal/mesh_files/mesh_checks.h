#pragma once

#include <squeal/mesh/mortar.h>
#include <squeal/mesh_files/mesh_file.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace squeal
{
  /// The smallest box with edges along the axes around some points.
  struct Box
  {
    dealii::Point<3> low  = dealii::Point<3>(1e300, 1e300, 1e300);
    dealii::Point<3> high = dealii::Point<3>(-1e300, -1e300, -1e300);
    void add(const dealii::Point<3> &x);
  };

  /// A position for messages: "(x, y, z) m".
  std::string text_of(const dealii::Point<3> &x);

  /// The corners of a file's cell in the order of deal.II.
  constexpr std::array<unsigned int, 8> lexicographic_corners = {{0, 1, 3, 2, 4, 5, 7, 6}};

  /// Refuses a node that is so far away, or not finite, that volumes and inertias, powers of
  /// lengths, would not be finite.
  void check_distance(const std::string &filename, const dealii::Point<3> &in_file,
                      const dealii::Point<3> &placed);

  /// At each corner of a cell the determinant of its three edges over the product of their lengths:
  /// 1 for a brick, negative where the cell is folded, 0 where it is flat.
  std::array<double, 8> corner_jacobians(const MeshFile &file, const MeshFile::Cell &cell);

  /// The area of a plane convex quadrilateral with corners in any order, m^2.
  double area_of(const std::array<dealii::Point<3>, 4> &corners);

  /// By how much a contact surface may miss a plane: of the pad's surface's size.
  constexpr double plane_tolerance = 1e-4;

  /// How two contact surfaces lie to each other.
  struct ContactPairMeasures
  {
    std::string name;
    double gap;         ///< along the rotor's normal, m; negative: the bodies overlap
    double overlap;     ///< common area, m^2
    double pad_area;    ///< m^2
    double least_cover; ///< the smallest part of a face of the pad that lies on the rotor, -
  };

  /// What a message about two contact surfaces goes by beside them.
  struct PairSurroundings
  {
    std::string axes = "xyz"; ///< what the file calls x, y and z
    /// The boxes of other surfaces of the rotor, by name. Asked for where there is a fault.
    std::function<std::map<std::string, Box>()> rotor_surfaces;
  };

  /// Contact surfaces must be plane, across the z axis, in a common plane, face each other, and the
  /// rotor's must cover the pad's. Their distance is at most @p tolerance, m, or where that is zero
  /// a part of the pad's size. Patches are of degree 1 with outward normals. Throws InputError,
  /// @p where being the beginning of its message.
  ContactPairMeasures check_contact_pair(const std::string &where, const std::string &pad_name,
                                         const std::vector<SurfaceFace<3>> &pad_faces,
                                         const std::string &rotor_name,
                                         const std::vector<SurfaceFace<3>> &rotor_faces,
                                         double tolerance,
                                         const PairSurroundings &surroundings = {});

  /// By how much the corners of a face miss a line of the half plane (r, z), which circles about
  /// the z axis sweep to a plane, cylinder or cone; m.
  double distance_from_revolution(const std::array<dealii::Point<3>, 4> &corners);
} // namespace squeal
