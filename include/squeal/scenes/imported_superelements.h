#pragma once

#include <squeal/mesh_files/rigid_motions.h>
#include <squeal/mesh_files/superelement_files.h>
#include <squeal/scenes/imported_bodies.h>

#include <functional>
#include <string>
#include <vector>

namespace squeal
{
  inline const std::string exported_key = "Output/Superelement";

  /// The superelements of Joints/Superelements and the surfaces of a mesh that hold their nodes.
  class ImportedSuperelements
  {
  public:
    ImportedSuperelements(const Parameters::All &prm, const ImportedMesh &mesh,
                          const ImportedBodies &bodies);

    /// Connects them with the bodies that hold them; they are bodies from @p first on. Positions
    /// are given to motions as @p scaled.
    void hold(unsigned int first,
              const std::function<dealii::Point<3>(const dealii::Point<3> &)> &scaled,
              RigidMotions &motions) const;

    std::vector<PlacedSuperelement> placed;

  private:
    const Parameters::All &prm;
    const ImportedMesh &mesh;
    const ImportedBodies &bodies;
  };

  /// The body of Output/Superelement, which has all faces of the surfaces there.
  Body exported_body(const Parameters::All &prm, const ImportedMesh &mesh,
                     const ImportedBodies &bodies);
} // namespace squeal
