#include <squeal/mesh_files/element_file.h>
#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/scenes/placed_mesh.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <iterator>
#include <set>

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
          if (capitals(group) == capitals(name))
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
  } // namespace

  MeshFile read_placed_mesh(const Parameters::All &prm)
  {
    ElementFile file = read_mesh_file(prm.mesh.file);
    if (prm.mesh.others == OtherVolumes::left_out)
      leave_out_others(prm, file);
    place_nodes(prm.mesh, file);
    const std::vector<bool> circles = on_circles(prm, file);
    return divide(file, [&](const unsigned int e) { return circles[e]; });
  }
} // namespace squeal
