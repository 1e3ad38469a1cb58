#pragma once

#include <squeal/mesh/geometry.h>
#include <squeal/mesh_files/joined_surfaces.h>
#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/mesh_files/mesh_file.h>
#include <squeal/parameters/parameters.h>

#include <map>
#include <string>
#include <vector>

namespace squeal
{
  /// What is known of a mesh besides its geometry.
  struct MeshFacts
  {
    const MeshFile &file;                     ///< nodes in metres, axis z
    std::vector<std::string> bodies;          ///< names, by Body
    unsigned int n_turned = 0;                ///< cells numbered inside out in the file
    std::map<std::string, std::string> roles; ///< of volume and surface groups

    std::vector<ContactPairMeasures> pairs;
    std::vector<JointMeasures> joints;      ///< ties and contacts
    std::vector<std::string> points;        ///< a line for each
    std::vector<std::string> superelements; ///< likewise
  };

  /// Fills report and report_table of @p geometry: volumes, masses, areas, boxes, Jacobians of the
  /// cells as they will be computed with, of degree Discretization/Degree. Throws InputError where
  /// one is not positive.
  void report_mesh(const Parameters::All &parameters, const MeshFacts &facts,
                   Geometry<3> &geometry);
} // namespace squeal
