#include <squeal/scenes/imported_bodies.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  ImportedBodies::ImportedBodies(const Parameters::All &prm, ImportedMesh &mesh)
      : pieces(prm, mesh), pairs(prm.mesh.pairs()), mesh(mesh)
  {
    std::map<unsigned int, Body> body_of_piece;
    for (const auto &rotor_piece : pieces.rotor)
      body_of_piece[rotor_piece.first] = rotor_body;
    add_pads(body_of_piece);
    add_others(body_of_piece);
    // Bodies that are tied hold each other.
    cluster.resize(names.size());
    for (const auto &[piece, body] : body_of_piece)
      cluster[body] = body_of_piece.at(pieces.cluster_of(piece));
    number_parts(prm.mesh.curved, body_of_piece);
  }

  void ImportedBodies::add_pads(std::map<unsigned int, Body> &body_of_piece)
  {
    for (auto &[pad_name, rotor_name] : pairs)
    {
      // The names as in the file
      pad_name                                = mesh.surface(pad_name, "Contact pairs").first;
      rotor_name                              = mesh.surface(rotor_name, "Contact pairs").first;
      const std::set<unsigned int> pad_pieces = pieces.of_surface(pad_name, "Contact pairs");
      for (const unsigned int piece : pieces.of_surface(rotor_name, "Contact pairs"))
        if (pieces.rotor.count(piece) == 0)
          mesh.fail("Contact pairs", "'" + rotor_name +
                                         "' is not on the rotor; allowed is pad "
                                         "surface : rotor surface.");
      if (pad_pieces.size() != 1 || pieces.others.count(*pad_pieces.begin()) == 0)
        mesh.fail("Contact pairs", "'" + pad_name +
                                       "' is not on one pad; allowed is pad surface : "
                                       "rotor surface.");
      if (body_of_piece.emplace(*pad_pieces.begin(), Body(names.size())).second)
        names.push_back(pad_name);
      pad_of_pair.push_back(body_of_piece.at(*pad_pieces.begin()));
    }
  }

  void ImportedBodies::add_others(std::map<unsigned int, Body> &body_of_piece)
  {
    for (const auto &[piece, cell] : pieces.others)
    {
      if (body_of_piece.count(piece))
        continue;
      // Without anything that slides or is joined, parts are studied alone.
      if (!pieces.is_joined(piece) && !pairs.empty())
        mesh.fail(
            "Contact pairs",
            "the piece with " + mesh.element(cell) +
                " has no contact pair and no joint (Joints/Ties, Contacts, Points), and shares no "
                "nodes with a pad that has a contact pair. Common surfaces of volumes need common "
                "nodes (in Gmsh: Coherence).");
      const Body body = Body(names.size());
      body_of_piece.emplace(piece, body);
      names.push_back(name_of_piece(cell));
      others[body] = names.back();
    }
  }

  void ImportedBodies::number_parts(const CurvedBodies curved,
                                    const std::map<unsigned int, Body> &body_of_piece)
  {
    std::map<std::pair<Body, unsigned int>, unsigned int> ids;
    for (unsigned int c = 0; c < mesh.file.cells.size(); ++c)
    {
      const Body body             = body_of_piece.at(pieces.of_cell(c));
      const unsigned int material = pieces.material_of_cell[c];
      const auto [id, is_new]     = ids.emplace(std::make_pair(body, material), ids.size());
      if (is_new)
        parts.push_back(
            {body, material,
             curved == CurvedBodies::all || (curved == CurvedBodies::rotor && body == rotor_body)});
      part_of_cell.push_back(id->second);
    }
  }

  std::string ImportedBodies::name_of_piece(const unsigned int cell) const
  {
    std::string name = "part";
    for (const auto &[group, cells] : mesh.file.volumes)
      if (std::binary_search(cells.begin(), cells.end(), cell))
        name = group;
    std::string result = name;
    for (unsigned int k = 2; std::count(names.begin(), names.end(), result) > 0; ++k)
      result = name + " " + std::to_string(k);
    return result;
  }

  Body ImportedBodies::of(const ImportedMesh::Face &face) const
  {
    return parts[part_of_cell[mesh.faces.at(face)[0].cell]].body;
  }

  std::vector<SurfaceFace<3>> ImportedBodies::curved_patches(const std::string &name) const
  {
    std::vector<SurfaceFace<3>> result;
    for (const ImportedMesh::Face &face : mesh.file.surfaces.at(name))
    {
      const SurfaceFace<3> flat = mesh.patch(face);
      const bool is_curved      = parts[part_of_cell[mesh.faces.at(face)[0].cell]].curved;
      const auto between        = [&](const Point<3> &a, const Point<3> &b)
      {
        Point<3> middle       = a + 0.5 * (b - a);
        const double r        = (std::hypot(a[0], a[1]) + std::hypot(b[0], b[1])) / 2,
                     straight = std::hypot(middle[0], middle[1]);
        if (is_curved && straight > 0)
          for (unsigned int d = 0; d < 2; ++d)
            middle[d] *= r / straight;
        return middle;
      };
      SurfaceFace<3> curved;
      curved.orientation = flat.orientation;
      curved.nodes       = mesh.bent_patch(face);
      if (!curved.nodes.empty())
      {
        result.push_back(curved);
        continue;
      }
      const std::array<Point<3>, 4> ends = {
          {flat.nodes[0], flat.nodes[1], flat.nodes[2], flat.nodes[3]}};
      const Point<3> left = between(ends[0], ends[2]), right = between(ends[1], ends[3]);
      for (const auto &[a, b] :
           {std::make_pair(ends[0], ends[1]), {left, right}, {ends[2], ends[3]}})
        for (const Point<3> &x : {a, between(a, b), b})
          curved.nodes.push_back(x);
      result.push_back(curved);
    }
    return result;
  }

  bool needs_revolution(const Parameters::All &prm)
  {
    return prm.terms().transport && !prm.mesh.rotor.empty() && prm.operation.angular_velocity != 0;
  }
} // namespace squeal
