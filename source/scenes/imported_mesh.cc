#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh_files/element_file.h>
#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/mesh_files/plane_parts.h>
#include <squeal/parameters/entries.h>
#include <squeal/scenes/imported_mesh.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <set>
#include <sstream>

// From a mesh file to hexahedra in metres: what is left out goes first, nodes are placed, surfaces
// are divided by planes where a parameter file names such parts, elements are refined, then they
// become hexahedra (element_division.cc). ImportedMesh finds groups by name, the cells of each
// face, and the shapes of surfaces.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    void place_nodes(const Parameters::Mesh &mesh, ElementFile &file)
    {
      const std::array<double, 3> origin = mesh.origin();
      const unsigned int axis            = static_cast<unsigned int>(mesh.axis);
      for (Point<3> &x : file.nodes)
      {
        Point<3> placed;
        for (unsigned int d = 0; d < 3; ++d)
          placed[d] = mesh.scale * (x[(axis + 1 + d) % 3] - origin[(axis + 1 + d) % 3]);
        check_distance(file.name, x, placed);
        x = placed;
      }
    }

    /// All surfaces that a parameter file names, and other words of its lists.
    std::vector<std::string> named_surfaces(const Parameters::All &prm)
    {
      std::vector<std::string> names;
      for (const std::string &list :
           {prm.mesh.contact_pairs, prm.mesh.pressure_on, prm.mesh.pressures, prm.mesh.clamped,
            prm.mesh.guided, prm.mesh.fixed[0], prm.mesh.fixed[1], prm.mesh.fixed[2],
            prm.joints.ties, prm.joints.contacts, prm.joints.points})
        for (const std::vector<std::string> &entry : Parameters::entries_of(list))
          names.insert(names.end(), entry.begin(), entry.end());
      return names;
    }

    /// Calls function(element) for those of the volumes of a material. Groups that do not exist are
    /// refused when materials are assigned.
    template <typename Function>
    void for_elements_of(const Parameters::BodyMaterial &material, const ElementFile &file,
                         const Function &function)
    {
      if (material.volumes.empty())
        return;
      for (const std::string &name : Utilities::split_string_list(material.volumes, ','))
        for (const auto &[group, elements] : file.volumes)
          if (plain_capitals(group) == plain_capitals(name))
            for (const unsigned int e : elements)
              function(e);
    }

    /// Elements of bodies whose cells follow circles about the axis.
    std::vector<bool> on_circles(const Parameters::All &prm, const ElementFile &file)
    {
      std::vector<bool> result(file.elements.size(), prm.mesh.curved == CurvedBodies::all);
      if (prm.mesh.curved != CurvedBodies::rotor)
        return result;
      for (const Parameters::BodyMaterial &material : prm.materials())
        if (material.of_rotor)
          for_elements_of(material, file, [&](const unsigned int e) { result[e] = true; });
      return result;
    }

    /// Removes the elements without a material, and the faces of none of the others. Where all
    /// would go everything stays, so that the names are refused that no group has.
    void leave_out_others(const Parameters::All &prm, ElementFile &file)
    {
      std::vector<bool> stays(file.elements.size());
      for (const Parameters::BodyMaterial &material : prm.materials())
        for_elements_of(material, file, [&](const unsigned int e) { stays[e] = true; });
      if (std::count(stays.begin(), stays.end(), true) == 0)
        return;

      std::vector<unsigned int> number(file.elements.size());
      std::vector<ElementFile::Element> elements;
      std::set<ElementFile::Face> faces;
      for (unsigned int e = 0; e < file.elements.size(); ++e)
        if (stays[e])
        {
          const ElementFile::Element &element = file.elements[e];
          for (unsigned int f = 0; f < ElementFile::faces(element.shape).size(); ++f)
            faces.insert(ElementFile::ascending(file.face(element, f)));
          number[e] = elements.size();
          elements.push_back(element);
        }
      file.elements = std::move(elements);

      for (auto group = file.volumes.begin(); group != file.volumes.end();)
      {
        std::vector<unsigned int> kept;
        for (const unsigned int e : group->second)
          if (stays[e])
            kept.push_back(number[e]);
        group->second = std::move(kept);
        group         = group->second.empty() ? file.volumes.erase(group) : std::next(group);
      }
      for (auto group = file.surfaces.begin(); group != file.surfaces.end();)
      {
        std::vector<ElementFile::Face> &all = group->second;
        all.erase(std::remove_if(all.begin(), all.end(),
                                 [&](const auto &face)
                                 { return faces.count(ElementFile::ascending(face)) == 0; }),
                  all.end());
        group = all.empty() ? file.surfaces.erase(group) : std::next(group);
      }
    }

    /// Numbers of nodes and cells have 32 bits, and memory ends before.
    void check_refined_size(const unsigned int levels, const ElementFile &file)
    {
      constexpr double most = 2e7;
      const double n        = file.elements.size() * std::pow(8., levels);
      if (levels > 0 && n > most)
        throw InputError(text_of("Mesh/Refinements = ", levels, ": ", file.name, " has ",
                                 file.elements.size(), " elements, which would become ", n,
                                 "; allowed are ", most, "."));
    }

    /// The mesh of the section Mesh as hexahedra: nodes in metres, axis z.
    MeshFile read_placed_mesh(const Parameters::All &prm)
    {
      ElementFile file = read_mesh_file(prm.mesh.file);
      if (prm.mesh.others == OtherVolumes::left_out)
        leave_out_others(prm, file);
      place_nodes(prm.mesh, file);
      add_plane_parts(file, named_surfaces(prm), 2);
      check_refined_size(prm.mesh.refinements, file);
      for (unsigned int level = 0; level < prm.mesh.refinements; ++level)
      {
        const std::vector<bool> circles = on_circles(prm, file);
        file = refine(file, [&](const unsigned int e) { return circles[e]; });
      }
      const std::vector<bool> circles = on_circles(prm, file);
      return divide(
          file, [&](const unsigned int e) { return circles[e]; },
          prm.mesh.divided == DividedElements::own);
    }
  } // namespace

  std::string axes_in_file(const Parameters::Mesh &mesh)
  {
    const std::string axes  = "xyz";
    const unsigned int axis = static_cast<unsigned int>(mesh.axis);
    return {axes[(axis + 1) % 3], axes[(axis + 2) % 3], axes[axis]};
  }

  std::string plain_capitals(const std::string &name)
  {
    std::string text = plain_name(name);
    std::transform(text.begin(), text.end(), text.begin(),
                   [](const unsigned char c) { return std::toupper(c); });
    return text;
  }

  ImportedMesh::ImportedMesh(const Parameters::All &prm) : file(read_placed_mesh(prm)) {}

  void ImportedMesh::fail(const std::string &key, const std::string &message) const
  {
    throw InputError((key.find('/') < key.size() && key.find("Part") != 0 ? "" : "Mesh/") + key +
                     ": " + file.name + ": " + message);
  }

  std::string ImportedMesh::element(const unsigned int cell) const
  {
    Point<3> centre;
    for (const unsigned int node : file.cells[cell].nodes)
      centre += file.nodes[node] / 8.;
    return "element " + std::to_string(file.cells[cell].number) + " at " + text_of(centre);
  }

  template <typename T>
  const std::pair<const std::string, T> &
  ImportedMesh::find_group(const std::map<std::string, T> &groups, const std::string &name,
                           const std::string &key, const std::string &kind) const
  {
    const auto exact = groups.find(name);
    if (exact != groups.end())
      return *exact;
    std::string known;
    for (const auto &group : groups)
    {
      if (plain_capitals(group.first) == plain_capitals(name))
        return group;
      known += (known.empty() ? "" : ", ") + group.first;
    }
    fail(key, "there is no " + kind + " group '" + name + "'. Allowed are: " +
                  (known.empty() ? "none, the file has no " + kind + " groups" : known) +
                  (key == "Rotor" ? "; or nothing, where parts are studied alone." : "."));
  }

  const std::pair<const std::string, std::vector<unsigned int>> &
  ImportedMesh::volume(const std::string &name, const std::string &key) const
  {
    return find_group(file.volumes, name, key, "volume");
  }

  const std::pair<const std::string, std::vector<ImportedMesh::Face>> &
  ImportedMesh::surface(const std::string &name, const std::string &key) const
  {
    return find_group(file.surfaces, name, key, "surface");
  }

  void ImportedMesh::connect_cells()
  {
    turn_cells();
    find_neighbours();
  }

  void ImportedMesh::turn_cells()
  {
    for (unsigned int c = 0; c < file.cells.size(); ++c)
    {
      auto &nodes            = file.cells[c].nodes;
      const auto jacobian    = corner_jacobians(file, file.cells[c]);
      const auto [low, high] = std::minmax_element(jacobian.begin(), jacobian.end());
      if (*high < 0)
      {
        for (unsigned int v = 0; v < 4; ++v)
          std::swap(nodes[v], nodes[v + 4]);
        ++n_turned;
      }
      else if (!(*low > 0))
      {
        std::ostringstream message;
        message << element(c) << " has the scaled Jacobian " << *low << " at a corner and " << *high
                << " at another: it is folded or flat. All must be positive.";
        fail("File", message.str());
      }
    }
  }

  void ImportedMesh::find_neighbours()
  {
    const auto turning = [&](const CellFace &at)
    {
      std::array<unsigned int, 4> corners;
      for (unsigned int v = 0; v < 4; ++v)
        corners[v] = file.cells[at.cell].nodes[MeshFile::cell_faces[at.face][v]];
      return corners;
    };
    for (unsigned int c = 0; c < file.cells.size(); ++c)
      for (unsigned int f = 0; f < 6; ++f)
      {
        std::vector<CellFace> &cells = faces[file.face(c, f)];
        cells.push_back({c, f});
        if (cells.size() > 2)
          fail("File", element(c) +
                           " has a face that two other cells share already, among "
                           "them " +
                           element(cells[0].cell) + ".");
        if (cells.size() < 2)
          continue;
        const auto a = turning(cells[0]), b = turning(cells[1]);
        const unsigned int at = std::find(b.begin(), b.end(), a[0]) - b.begin();
        if (b[(at + 1) % 4] != a[3] || b[(at + 2) % 4] != a[2])
          fail("File", element(c) + " and " + element(cells[0].cell) +
                           " lie on the same side of the face that they share: one is inside "
                           "out.");
      }
  }

  ImportedMesh::CellFace ImportedMesh::boundary_cell(const Face &face, const std::string &name,
                                                     const std::string &key) const
  {
    const auto cells = faces.find(face);
    if (cells == faces.end())
      fail(key, "the surface group '" + name +
                    "' has a face that is no cell's, with a corner "
                    "at " +
                    text_of(file.nodes[face[0]]) + ".");
    if (cells->second.size() != 1)
      fail(key, "the surface group '" + name + "' has a face inside of a body, at " +
                    element(cells->second[0].cell) + "; only faces of the boundary are allowed.");
    return cells->second[0];
  }

  SurfaceFace<3> ImportedMesh::patch(const Face &face) const
  {
    const CellFace at = faces.at(face)[0];
    const auto &local = MeshFile::cell_faces[at.face];
    const auto &nodes = file.cells[at.cell].nodes;
    SurfaceFace<3> result;
    // Corners are cyclic, seen from inside counter-clockwise.
    for (const unsigned int v : {0u, 1u, 3u, 2u})
      result.nodes.push_back(file.nodes[nodes[local[v]]]);
    result.orientation = -1;
    return result;
  }

  std::vector<Point<3>> ImportedMesh::bent_patch(const Face &face) const
  {
    const auto centre = file.quadratic.faces.find(face);
    if (centre == file.quadratic.faces.end())
      return {};
    const CellFace at = faces.at(face)[0];
    std::array<unsigned int, 4> nodes; // as in patch()
    for (unsigned int v = 0; v < 4; ++v)
      nodes[v] = file.cells[at.cell].nodes[MeshFile::cell_faces[at.face][lexicographic_corners[v]]];
    const auto corner  = [&](const unsigned int v) { return file.nodes[nodes[v]]; };
    const auto between = [&](const unsigned int a, const unsigned int b) {
      return file.quadratic.edges.at(
          {{std::min(nodes[a], nodes[b]), std::max(nodes[a], nodes[b])}});
    };
    return {corner(0),     between(0, 1), corner(1),     between(0, 2), centre->second,
            between(1, 3), corner(2),     between(2, 3), corner(3)};
  }

  std::vector<SurfaceFace<3>> ImportedMesh::patches(const std::string &name) const
  {
    std::vector<SurfaceFace<3>> result;
    for (const Face &face : file.surfaces.at(name))
      result.push_back(patch(face));
    return result;
  }
} // namespace squeal
