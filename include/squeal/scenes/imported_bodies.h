#pragma once

#include <squeal/mesh/geometry.h>
#include <squeal/scenes/imported_pieces.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  /// The bodies of a mesh: one rotor, in one piece or several that are tied, pads with a contact
  /// pair, and others that hang on joints.
  class ImportedBodies
  {
  public:
    ImportedBodies(const Parameters::All &prm, ImportedMesh &mesh);

    /// The body of a face of the boundary.
    Body of(const ImportedMesh::Face &face) const;
    /// The faces of a surface as patches of degree 2, which follow middle nodes, or circles about
    /// the axis where their body does.
    std::vector<SurfaceFace<3>> curved_patches(const std::string &surface) const;

    ImportedPieces pieces;
    std::vector<std::string> names = {"rotor"}; ///< by Body
    std::map<Body, std::string> others;         ///< neither rotor nor pads
    std::vector<Body> cluster;                  ///< by Body: one of those that are tied to it
    std::vector<Part> parts;                    ///< one for each body and material
    std::vector<unsigned int> part_of_cell;
    /// Pad and rotor surfaces in contact, names as in the file.
    std::vector<std::pair<std::string, std::string>> pairs;
    std::vector<Body> pad_of_pair;

  private:
    void add_pads(std::map<unsigned int, Body> &body_of_piece);
    void add_others(std::map<unsigned int, Body> &body_of_piece);
    void number_parts(CurvedBodies curved, const std::map<unsigned int, Body> &body_of_piece);
    /// The name of a volume group in which a cell of the piece is; two pieces of one group differ
    /// by a number.
    std::string name_of_piece(unsigned int cell) const;

    const ImportedMesh &mesh;
  };

  /// Whether material flows through the rotor's mesh, so that it must be a body of revolution.
  bool needs_revolution(const Parameters::All &prm);
} // namespace squeal
