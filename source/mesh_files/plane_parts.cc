#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/mesh_files/plane_parts.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// The middle of the element that has a face, for those of a surface.
    std::map<ElementFile::Face, Point<3>>
    middles_behind(const ElementFile &file, const std::vector<ElementFile::Face> &surface)
    {
      std::map<ElementFile::Face, Point<3>> middles;
      for (const ElementFile::Face &face : surface)
        middles[ElementFile::ascending(face)];
      for (const ElementFile::Element &element : file.elements)
      {
        const unsigned int n = ElementFile::n_corners(element.shape);
        Point<3> middle;
        for (unsigned int v = 0; v < n; ++v)
          middle += file.nodes[element.nodes[v]] / double(n);
        for (unsigned int f = 0; f < ElementFile::faces(element.shape).size(); ++f)
          if (const auto known = middles.find(ElementFile::ascending(file.face(element, f)));
              known != middles.end())
            known->second = middle;
      }
      return middles;
    }
  } // namespace

  std::vector<PlanePart> plane_parts(const ElementFile &file,
                                     const std::vector<ElementFile::Face> &surface,
                                     const unsigned int axis)
  {
    Box box;
    for (const ElementFile::Face &face : surface)
      for (const unsigned int node : face)
        if (node != ElementFile::none)
          box.add(file.nodes[node]);
    const double tolerance = plane_tolerance * box.low.distance(box.high);
    const auto middles     = middles_behind(file, surface);
    std::vector<PlanePart> faces; // each a part of its own
    for (const ElementFile::Face &face : surface)
    {
      double low = INFINITY, high = -INFINITY;
      for (const unsigned int node : face)
        if (node != ElementFile::none)
        {
          low  = std::min(low, file.nodes[node][axis]);
          high = std::max(high, file.nodes[node][axis]);
        }
      const double place = (low + high) / 2;
      if (high - low <= tolerance)
        faces.push_back({place, middles.at(ElementFile::ascending(face))[axis] < place, {face}});
    }
    std::stable_sort(faces.begin(), faces.end(),
                     [](const PlanePart &a, const PlanePart &b) { return a.place < b.place; });
    std::vector<PlanePart> parts;
    double last            = -INFINITY;
    std::size_t first_here = 0; // of the parts at this place
    for (const PlanePart &face : faces)
    {
      if (face.place - last > tolerance)
        first_here = parts.size();
      last = face.place;
      const auto part =
          std::find_if(parts.begin() + first_here, parts.end(),
                       [&](const PlanePart &p) { return p.looks_up == face.looks_up; });
      if (part != parts.end())
        part->faces.push_back(face.faces[0]);
      else if (face.looks_up)
        parts.push_back(face);
      else
        parts.insert(parts.begin() + first_here, face);
    }
    return parts;
  }

  std::string name_of_part(const std::string &surface, const std::size_t k)
  {
    return surface + "(" + std::to_string(k + 1) + ")";
  }

  void add_plane_parts(ElementFile &file, const std::vector<std::string> &names,
                       const unsigned int axis)
  {
    for (const std::string &name : names)
    {
      const std::size_t bracket = name.rfind('(');
      if (bracket == std::string::npos || name.back() != ')' || file.surfaces.count(name) > 0)
        continue;
      const auto surface  = file.surfaces.find(name.substr(0, bracket));
      const std::size_t k = std::strtoul(name.c_str() + bracket + 1, nullptr, 10);
      if (surface == file.surfaces.end())
        continue;
      const std::vector<PlanePart> parts = plane_parts(file, surface->second, axis);
      if (k >= 1 && k <= parts.size() && name == name_of_part(surface->first, k - 1))
        file.surfaces[name] = parts[k - 1].faces;
    }
  }
} // namespace squeal
