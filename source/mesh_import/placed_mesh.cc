#include <squeal/mesh_import/element_file.h>
#include <squeal/mesh_import/mesh_checks.h>
#include <squeal/mesh_import/placed_mesh.h>

#include <deal.II/base/utilities.h>

#include <algorithm>

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

    std::string capitals(std::string text)
    {
      std::transform(text.begin(), text.end(), text.begin(),
                     [](const unsigned char c) { return std::toupper(c); });
      return text;
    }

    /// Elements of bodies whose cells follow circles about the axis. Groups that do not exist are
    /// refused when materials are assigned.
    std::vector<bool> on_circles(const Parameters::All &prm, const ElementFile &file)
    {
      std::vector<bool> result(file.elements.size(), prm.mesh.curved == CurvedBodies::all);
      if (prm.mesh.curved != CurvedBodies::rotor)
        return result;
      for (const Parameters::BodyMaterial &material : prm.materials())
        if (material.of_rotor && !material.volumes.empty())
          for (const std::string &name : Utilities::split_string_list(material.volumes, ','))
            for (const auto &[group, elements] : file.volumes)
              if (capitals(group) == capitals(name))
                for (const unsigned int e : elements)
                  result[e] = true;
      return result;
    }
  } // namespace

  MeshFile read_placed_mesh(const Parameters::All &prm)
  {
    ElementFile file = read_mesh_file(prm.mesh.file);
    place_nodes(prm.mesh, file);
    const std::vector<bool> circles = on_circles(prm, file);
    return divide(file, [&](const unsigned int e) { return circles[e]; });
  }
} // namespace squeal
