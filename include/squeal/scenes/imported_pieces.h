#pragma once

#include <squeal/mesh_files/joined_surfaces.h>
#include <squeal/scenes/imported_mesh.h>

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  /// The names of a list with commas.
  std::vector<std::string> names_of(const std::string &list);

  /// What hangs together in a mesh: pieces are cells that share nodes; joints connect pieces.
  /// Throws InputError for cells without a material and for joints between what they cannot join.
  class ImportedPieces
  {
  public:
    /// Gives the cells of @p mesh their materials and connects them.
    ImportedPieces(const Parameters::All &prm, ImportedMesh &mesh);

    /// The piece of a cell, and those of a surface whose name a key has.
    unsigned int of_cell(unsigned int cell) const;
    std::set<unsigned int> of_surface(const std::string &name, const std::string &key) const;
    /// Whether a joint has the piece.
    bool is_joined(const unsigned int piece) const
    {
      return joined.count(piece) > 0;
    }
    /// A piece that stands for all that are tied, or stick, to this one.
    unsigned int cluster_of(const unsigned int piece) const
    {
      return tied.of(piece);
    }

    std::vector<bool> of_rotor; ///< by material
    std::vector<unsigned int> material_of_cell;
    std::map<unsigned int, unsigned int> rotor, others; ///< pieces, and a cell of each
    /// Surfaces by their names in the file.
    std::vector<std::pair<std::string, std::string>> ties;
    std::vector<Parameters::Joints::Contact> contacts; ///< that do not slide

  private:
    void assign_materials(const std::vector<Parameters::BodyMaterial> &materials);
    void find_pieces();
    void take_points(const Parameters::Joints &joints);
    void take_superelements(const Parameters::Joints &joints);
    void take_ties();
    /// Each surface of a contact is on one body that does not turn.
    void take_contact(Parameters::Joints::Contact &contact);

    ImportedMesh &mesh;
    Groups pieces, tied; ///< of nodes
    std::set<unsigned int> joined;
  };
} // namespace squeal
