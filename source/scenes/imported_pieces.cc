#include <squeal/mesh_files/superelement_files.h>
#include <squeal/scenes/imported_pieces.h>

#include <deal.II/base/utilities.h>

#include <algorithm>

namespace squeal
{
  using namespace dealii;

  std::vector<std::string> names_of(const std::string &list)
  {
    return list.empty() ? std::vector<std::string>() : Utilities::split_string_list(list, ',');
  }

  ImportedPieces::ImportedPieces(const Parameters::All &prm, ImportedMesh &mesh)
      : ties(prm.joints.tied_surfaces()), contacts(prm.joints.list_of_contacts()), mesh(mesh),
        pieces(mesh.file.nodes.size()), tied(0)
  {
    assign_materials(prm.materials());
    mesh.connect_cells();
    find_pieces();
    if (rotor.empty() && !prm.mesh.rotor.empty())
      mesh.fail("Rotor", "the rotor has no cells.");
    tied = pieces;
    take_points(prm.joints);
    take_superelements(prm.joints);
    take_ties();
    for (Parameters::Joints::Contact &contact : contacts)
      take_contact(contact);
    for (const auto &[piece, cell] : rotor)
      if (tied.of(piece) != tied.of(rotor.begin()->first))
        mesh.fail("Rotor", "the rotor is in " + std::to_string(rotor.size()) +
                               " pieces that share no nodes, among them " +
                               mesh.element(rotor.begin()->second) + " and " + mesh.element(cell) +
                               ". Common surfaces of volumes need common nodes (in Gmsh: "
                               "Coherence), or a joint (Joints/Ties).");
  }

  void ImportedPieces::assign_materials(const std::vector<Parameters::BodyMaterial> &materials)
  {
    constexpr unsigned int none = -1;
    material_of_cell.assign(mesh.file.cells.size(), none);
    std::vector<std::string> named(mesh.file.cells.size());
    for (unsigned int m = 0; m < materials.size(); ++m)
    {
      of_rotor.push_back(materials[m].of_rotor);
      const std::string key = m == 0   ? "Rotor"
                              : m == 1 ? "Pads"
                                       : materials[m].section.substr(5) + "/Volumes";
      for (const std::string &text : names_of(materials[m].volumes))
      {
        const auto &[name, cells] = mesh.volume(text, key);
        mesh.roles[name]          = key;
        for (const unsigned int c : cells)
        {
          if (material_of_cell[c] != none && material_of_cell[c] != m)
            mesh.fail(key, mesh.element(c) + " is in the volumes '" + named[c] + "' and '" + name +
                               "' of two materials.");
          material_of_cell[c] = m;
          named[c]            = name;
        }
      }
    }
    const auto lost = std::find(material_of_cell.begin(), material_of_cell.end(), none);
    if (lost == material_of_cell.end())
      return;
    const unsigned int c = lost - material_of_cell.begin();
    std::string groups;
    for (const auto &[name, cells] : mesh.file.volumes)
      if (std::binary_search(cells.begin(), cells.end(), c))
        groups += (groups.empty() ? "'" : "', '") + name;
    mesh.fail("Rotor",
              std::to_string(std::count(lost, material_of_cell.end(), none)) +
                  " cells have no material, first " + mesh.element(c) + ", " +
                  (groups.empty() ? "in no volume group" : "in the volume group " + groups + "'") +
                  ". Every cell must be in a volume of Mesh/Rotor, Mesh/Pads or a "
                  "Mesh/Part's Volumes, or Mesh/Other volumes = left_out.");
  }

  void ImportedPieces::find_pieces()
  {
    for (const MeshFile::Cell &cell : mesh.file.cells)
      for (const unsigned int node : cell.nodes)
        pieces.join(node, cell.nodes[0]);
    for (unsigned int c = 0; c < mesh.file.cells.size(); ++c)
      (of_rotor[material_of_cell[c]] ? rotor : others).emplace(of_cell(c), c);
    for (const auto &[piece, cell] : rotor)
      if (const auto other = others.find(piece); other != others.end())
        mesh.fail("Contact pairs", "rotor and pad hang together by common nodes, " +
                                       mesh.element(cell) + " and " + mesh.element(other->second) +
                                       ". Surfaces in contact need nodes of their own.");
  }

  unsigned int ImportedPieces::of_cell(const unsigned int cell) const
  {
    return pieces.of(mesh.file.cells[cell].nodes[0]);
  }

  std::set<unsigned int> ImportedPieces::of_surface(const std::string &name,
                                                    const std::string &key) const
  {
    std::set<unsigned int> result;
    for (const ImportedMesh::Face &face : mesh.surface(name, key).second)
      result.insert(of_cell(mesh.boundary_cell(face, name, key).cell));
    return result;
  }

  void ImportedPieces::take_points(const Parameters::Joints &joints)
  {
    for (const Parameters::Joints::Point &point : joints.list_of_points())
      if (!point.surface.empty())
      {
        const std::set<unsigned int> of_point = of_surface(point.surface, "Joints/Points");
        if (of_point.size() > 1)
          mesh.fail("Joints/Points", "the surface '" + point.surface + "' of the point '" +
                                         point.name + "' is on " + std::to_string(of_point.size()) +
                                         " bodies; allowed is one.");
        joined.insert(of_point.begin(), of_point.end());
      }
  }

  void ImportedPieces::take_superelements(const Parameters::Joints &joints)
  {
    for (const auto &superelement : joints.list_of_superelements())
      for (const std::string &name : superelement.surfaces)
      {
        const std::set<unsigned int> of_element = of_surface(name, superelements_key);
        joined.insert(of_element.begin(), of_element.end());
      }
  }

  void ImportedPieces::take_ties()
  {
    for (auto &tie : ties)
    {
      std::set<bool> turns;
      unsigned int last = numbers::invalid_unsigned_int;
      for (std::string *name : {&tie.first, &tie.second})
      {
        *name = mesh.surface(*name, "Joints/Ties").first;
        for (const unsigned int piece : of_surface(*name, "Joints/Ties"))
        {
          turns.insert(rotor.count(piece) > 0);
          joined.insert(piece);
          if (last != numbers::invalid_unsigned_int)
            tied.join(piece, last);
          last = piece;
        }
      }
      if (turns.size() > 1)
        mesh.fail("Joints/Ties", "'" + tie.first + "' and '" + tie.second +
                                     "' are a tie across the sliding surface: one is on the rotor, "
                                     "the other is not. Both must turn or both must not.");
    }
  }

  void ImportedPieces::take_contact(Parameters::Joints::Contact &contact)
  {
    const std::string key = "Joints/Contacts";
    std::vector<unsigned int> found;
    for (std::string *name : {&contact.first, &contact.second})
    {
      *name                                = mesh.surface(*name, key).first;
      const std::set<unsigned int> of_name = of_surface(*name, key);
      if (of_name.size() > 1)
        mesh.fail(key, "the surface '" + *name + "' is on " + std::to_string(of_name.size()) +
                           " bodies; allowed is one.");
      if (rotor.count(*of_name.begin()))
        mesh.fail(key,
                  "the surface '" + *name +
                      "' is on the rotor, which turns. What slides on it is a pad (Mesh/Contact "
                      "pairs); pieces of the rotor are joined by Joints/Ties.");
      found.push_back(*of_name.begin());
    }
    if (found[0] == found[1])
      mesh.fail(key, "'" + contact.first + "' and '" + contact.second +
                         "' are on the same body; allowed are two bodies.");
    joined.insert(found.begin(), found.end());
    if (contact.sticks)
      tied.join(found[0], found[1]);
  }
} // namespace squeal
