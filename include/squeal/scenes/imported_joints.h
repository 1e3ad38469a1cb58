#pragma once

#include <squeal/mesh_files/joined_surfaces.h>
#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/scenes/imported_bodies.h>

#include <vector>

namespace squeal
{
  /// Takes from the first surfaces of ties that may be covered partly (Joints/Ties, : partly) the
  /// faces of which the second one covers less than half. Throws InputError where none is left.
  void leave_out_uncovered_faces(const Parameters::Joints &joints, ImportedMesh &mesh,
                                 const ImportedBodies &bodies);

  /// Adds pads in contact, ties, and contacts that do not slide, to a geometry whose boundaries
  /// have their names. Throws InputError for surfaces that do not lie on each other and for joints
  /// that share a surface.
  class ImportedJoints
  {
  public:
    ImportedJoints(const Parameters::All &prm, const ImportedMesh &mesh,
                   const ImportedBodies &bodies, Geometry<3> &geometry);

    std::vector<ContactPairMeasures> pairs;
    std::vector<JointMeasures> surfaces; ///< ties and contacts

  private:
    void check_pairs();
    /// Surfaces of the file that are the rotor's alone.
    std::map<std::string, Box> boxes_on_rotor() const;
    /// Middle nodes must not bend a sliding surface; its corners are checked with the pair.
    void check_middle_nodes(const std::string &name) const;
    void check_ties();
    /// Each pressure belongs to one pair of surfaces.
    void check_contacts();

    const Parameters::All &prm;
    const ImportedMesh &mesh;
    const ImportedBodies &bodies;
    Geometry<3> &geometry;
  };
} // namespace squeal
