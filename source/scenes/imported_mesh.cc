#include <squeal/base/errors.h>
#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/scenes/imported_mesh.h>
#include <squeal/scenes/placed_mesh.h>

#include <algorithm>
#include <cctype>
#include <sstream>

namespace squeal
{
  using namespace dealii;

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
    const auto capitals = [](std::string text)
    {
      std::transform(text.begin(), text.end(), text.begin(),
                     [](const unsigned char c) { return std::toupper(c); });
      return text;
    };
    std::string known;
    for (const auto &group : groups)
    {
      if (capitals(group.first) == capitals(name))
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
