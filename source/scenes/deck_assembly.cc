#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh_files/deck_lines.h>
#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/mesh_files/plane_parts.h>
#include <squeal/scenes/deck_assembly.h>

#include <algorithm>
#include <cmath>
#include <tuple>

// What a deck says and its mesh together: DeckAssembly decides which units the deck has, what
// turns, which contacts slide, where the axis is, and divides contact surfaces that lie on both
// faces of the disc. It answers questions about surfaces, their bodies, areas and nodes, and keeps
// the list of what cannot be read. Files deck_*.cc make lines of a parameter file of it, subject by
// subject (deck_sections.h); deck_parameters.cc writes them.

namespace squeal
{
  using namespace dealii;

  namespace deck_text
  {
    std::string digits(const double value)
    {
      return formatted("%.15g", value);
    }

    void append(std::string &list, const std::string &item)
    {
      list += (list.empty() ? "" : ", ") + item;
    }

    std::string list_of(const std::set<std::string> &names)
    {
      std::string list;
      for (const std::string &name : names)
        append(list, name);
      return list;
    }
  } // namespace deck_text

  using namespace deck_text;

  DeckAssembly::DeckAssembly(const ElementFile &mesh, DeckModel &&deck, const DeckOptions &options)
      : mesh(mesh), deck(std::move(deck)), options(options)
  {
    for (unsigned int e = 0; e < mesh.elements.size(); ++e)
      for (unsigned int f = 0; f < ElementFile::faces(mesh.elements[e].shape).size(); ++f)
        element_of_face.emplace(ElementFile::ascending(mesh.face(mesh.elements[e], f)), e);
    choose_units();
    choose_rotor(options.rotor);
    sort_contacts();
    choose_axis();
    divide_pairs();
  }

  void DeckAssembly::fail(const std::string &message) const
  {
    throw InputError("--from-deck " + mesh.name + ": " + message);
  }

  void DeckAssembly::leave_out(const DeckMeaning meaning, const std::string &what)
  {
    unread.emplace_back(meaning, what);
  }

  void DeckAssembly::choose_units()
  {
    for (const DeckSection &of : deck.sections)
    {
      const auto material = deck.materials.find(of.material);
      if (material == deck.materials.end())
        fail("there is no *MATERIAL " + of.material + ", which the section of " + of.volume +
             " has.");
      if (!material->second.problem.empty())
        fail(material->second.problem);
      if (mesh.volumes.count(of.volume) == 0)
        fail("the set " + of.volume +
             " of a *SOLID SECTION has no solid elements. Put them into the set, or take the "
             "section out of the deck.");
      if (material->second.elastic.empty() || !(material->second.density > 0))
        fail("the material " + of.material +
             " needs *ELASTIC and a *DENSITY above zero: without mass there "
             "are no modes. Write both under *MATERIAL, NAME=" +
             of.material + ".");
    }
    if (deck.sections.empty())
      fail("there is no *SOLID SECTION: nothing has a material.");
    std::set<bool> is_in_mm;
    for (const DeckSection &of : deck.sections)
      is_in_mm.insert(deck.materials.at(of.material).density < 1e-3);
    if (is_in_mm.size() > 1)
      fail("some densities are in kg/m^3, others in t/mm^3, as it seems; a deck has one system "
           "of units.");
    length = *is_in_mm.begin() ? 1e-3 : 1;
    doubt_units();
  }

  /// Solids have 5e-7 to 2.5e-5 kg/mm^3, a thousand times their t/mm^3.
  void DeckAssembly::doubt_units()
  {
    constexpr double largest = 1e-7; // t/mm^3
    for (const DeckSection &of : deck.sections)
      if (const double density = deck.materials.at(of.material).density;
          length != 1 && density > largest)
      {
        units_doubt =
            text_of("Warning, units: the density ", density, " of ", of.material,
                    " is one in kg/mm^3, not in t/mm^3. Of a deck in kg, mm, ms, kN, GPa densities "
                    "become a thousand times too large here, moduli and pressures a thousand times "
                    "too small, and frequencies kHz: convert it to mm, t, s, N, MPa.");
        return;
      }
  }

  std::set<std::string> DeckAssembly::volumes() const
  {
    std::set<std::string> result;
    for (const DeckSection &of : deck.sections)
      result.insert(of.volume);
    return result;
  }

  void DeckAssembly::choose_rotor(const std::string &names)
  {
    const std::set<std::string> known = volumes();
    if (deck_label(names) == "NONE" && known.count("NONE") == 0)
      return; // parts alone
    if (names.empty())
    {
      // DISC_PAD and the like are what presses on a disc.
      const auto has_one_of = [](const std::string &volume, const std::vector<std::string> &words)
      {
        return std::any_of(words.begin(), words.end(),
                           [&](const std::string &word)
                           { return volume.find(word) != std::string::npos; });
      };
      for (const std::string &volume : known)
        if (has_one_of(volume, {"ROTOR", "DISC", "DISK"}) &&
            !has_one_of(volume, {"PAD", "LINING", "SHIM", "BACKING", "BACKPLATE", "BACK_PLATE",
                                 "CALIPER", "PISTON", "BRACKET", "CARRIER", "HOLDER"}))
          rotor.insert(volume);
    }
    else
      for (const std::string &name : deck_fields(names))
      {
        if (known.count(deck_label(name)) == 0)
          fail("--rotor: there is no section '" + name + "'. Allowed are: " + list_of(known) + ".");
        rotor.insert(deck_label(name));
      }
    if (rotor.empty())
      fail("no section has a name like rotor, disc or disk. Say which turns: --rotor NAME, of " +
           list_of(known) + "; or --rotor none: the parts are studied alone.");
  }

  const std::vector<ElementFile::Face> &DeckAssembly::faces_of(const std::string &surface) const
  {
    if (const auto part = parts_of_surfaces.find(surface); part != parts_of_surfaces.end())
      return part->second;
    const auto faces = mesh.surfaces.find(surface);
    if (faces == mesh.surfaces.end() || faces->second.empty())
      fail("there is no surface " + surface +
           " with faces of solid elements. Write *SURFACE, NAME=" + surface +
           ", TYPE=ELEMENT with elements and their faces S1 to S6; nodes (TYPE=NODE) have none.");
    return faces->second;
  }

  std::set<std::string> DeckAssembly::volumes_at(const ElementFile::Face &face) const
  {
    std::set<std::string> result;
    const auto element = element_of_face.find(ElementFile::ascending(face));
    if (element != element_of_face.end())
      for (const std::string &volume : volumes())
        if (const auto group = mesh.volumes.find(volume);
            group != mesh.volumes.end() &&
            std::binary_search(group->second.begin(), group->second.end(), element->second))
          result.insert(volume);
    return result;
  }

  std::set<std::string> DeckAssembly::volumes_of(const std::string &surface) const
  {
    std::set<std::string> result;
    for (const ElementFile::Face &face : faces_of(surface))
      result.merge(volumes_at(face));
    if (result.empty())
      fail("the surface " + surface +
           " is on no section's elements. Give those below it a *SOLID SECTION; shells have none: "
           "mesh what they stand for with solids.");
    return result;
  }

  bool DeckAssembly::is_on_rotor(const std::string &surface) const
  {
    const std::set<std::string> of = volumes_of(surface);
    return std::any_of(of.begin(), of.end(),
                       [&](const std::string &volume) { return rotor.count(volume) > 0; });
  }

  double DeckAssembly::area_of(const std::string &surface) const
  {
    double area = 0;
    for (const ElementFile::Face &face : faces_of(surface))
    {
      // Half the product of the diagonals; a triangle's fourth corner is the first again.
      const Point<3> &fourth = mesh.nodes[face[3] == ElementFile::none ? face[0] : face[3]];
      area +=
          cross_product_3d(mesh.nodes[face[2]] - mesh.nodes[face[0]], fourth - mesh.nodes[face[1]])
              .norm() /
          2;
    }
    return area;
  }

  std::pair<Tensor<1, 3>, Point<3>> DeckAssembly::area_vector_of(const std::string &surface) const
  {
    Tensor<1, 3> sum;
    Point<3> centre;
    double area = 0;
    for (const ElementFile::Face &face : faces_of(surface))
    {
      const bool is_triangle = face[3] == ElementFile::none;
      const Point<3> &fourth = mesh.nodes[is_triangle ? face[0] : face[3]];
      Tensor<1, 3> normal    = cross_product_3d(mesh.nodes[face[2]] - mesh.nodes[face[0]],
                                                fourth - mesh.nodes[face[1]]) /
                            2.;
      Point<3> middle, inside;
      for (unsigned int v = 0; v < (is_triangle ? 3 : 4); ++v)
        middle += mesh.nodes[face[v]] / (is_triangle ? 3. : 4.);
      const auto known = element_of_face.find(ElementFile::ascending(face));
      if (known == element_of_face.end())
        fail("the surface " + surface + " is on no solid elements.");
      const ElementFile::Element &element = mesh.elements[known->second];
      const unsigned int n                = ElementFile::n_corners(element.shape);
      for (unsigned int v = 0; v < n; ++v)
        inside += mesh.nodes[element.nodes[v]] / double(n);
      if (normal * (middle - inside) < 0)
        normal = -normal;
      sum += normal;
      centre += normal.norm() * middle;
      area += normal.norm();
    }
    return {sum, centre / area};
  }

  std::string DeckAssembly::coupled_surface(const std::string &node) const
  {
    std::string surface;
    const auto coupled = [&](const std::string &name)
    {
      const auto found = deck.surface_of_node.find(name);
      if (found != deck.surface_of_node.end())
        surface = found->second;
    };
    coupled(node);
    for (const auto &[set, member] : deck.node_of_set)
      if (member == node)
        coupled(set);
      else if (set == node)
        coupled(member);
    return surface;
  }

  const DeckInteraction &DeckAssembly::interaction_of(const DeckContact &contact) const
  {
    static const DeckInteraction none;
    const auto found = deck.interactions.find(contact.interaction);
    return found == deck.interactions.end() ? none : found->second;
  }

  double DeckAssembly::friction_of(const DeckContact &contact) const
  {
    const DeckInteraction &of = interaction_of(contact);
    return of.table.empty() ? 0 : of.table[0][0];
  }

  void DeckAssembly::sort_contacts()
  {
    for (DeckContact contact : deck.contacts)
    {
      const bool first = is_on_rotor(contact.first), second = is_on_rotor(contact.second);
      if (first && second)
        fail("both sides of the contact pair " + contact.first + ", " + contact.second +
             " are on what turns, " + list_of(rotor) +
             ". Say which sections turn: --rotor NAME[,NAME].");
      if (first)
        std::swap(contact.first, contact.second);
      if (first || second)
      {
        pairs.push_back(contact);
        pads.merge(volumes_of(contact.first));
      }
      else
      {
        // The first surface lies on the second.
        if (area_of(contact.first) > area_of(contact.second))
          std::swap(contact.first, contact.second);
        joints.push_back(contact);
      }
    }
    for (const std::string &volume : rotor)
      pads.erase(volume);
  }

  Tensor<1, 3> DeckAssembly::across_sliding_surfaces() const
  {
    const auto add = [&](const std::string &surface, Tensor<1, 3> &sum, Tensor<1, 3> &plane)
    {
      for (const ElementFile::Face &face : faces_of(surface))
      {
        const Tensor<1, 3> normal = cross_product_3d(mesh.nodes[face[1]] - mesh.nodes[face[0]],
                                                     mesh.nodes[face[2]] - mesh.nodes[face[0]]);
        for (unsigned int d = 0; d < 3; ++d)
        {
          sum[d] += std::abs(normal[d]);
          if (std::abs(normal[d]) > 0.999 * normal.norm())
            plane[d] += normal.norm();
        }
      }
    };
    const auto along_one = [](const Tensor<1, 3> &v)
    { return *std::max_element(v.begin_raw(), v.end_raw()) > 0.999 * v.norm(); };
    Tensor<1, 3> sum, plane;
    add(pairs[0].second, sum, plane);
    if (along_one(sum))
      return sum;
    plane = Tensor<1, 3>();
    for (const DeckContact &pair : pairs)
      add(pair.first, sum, plane);
    const unsigned int most =
        std::max_element(plane.begin_raw(), plane.end_raw()) - plane.begin_raw();
    Tensor<1, 3> direction;
    direction[most] = plane[most];
    return plane[most] > 0.5 * (plane[0] + plane[1] + plane[2]) ? direction : sum;
  }

  void DeckAssembly::divide_pairs()
  {
    std::vector<DeckContact> divided;
    for (const DeckContact &pair : pairs)
    {
      const std::vector<PlanePart> of_pad   = plane_parts(mesh, faces_of(pair.first), axis),
                                   of_rotor = plane_parts(mesh, faces_of(pair.second), axis);
      const auto is_whole = [&](const std::vector<PlanePart> &parts, const std::string &surface)
      { return parts.size() == 1 && parts[0].faces.size() == faces_of(surface).size(); };
      if (is_whole(of_pad, pair.first) && is_whole(of_rotor, pair.second))
      {
        divided.push_back(pair);
        continue;
      }
      double nearest = INFINITY;
      std::vector<std::tuple<double, std::size_t, std::size_t>> candidates;
      for (std::size_t p = 0; p < of_pad.size(); ++p)
        for (std::size_t r = 0; r < of_rotor.size(); ++r)
          if (of_pad[p].looks_up != of_rotor[r].looks_up)
          {
            const double gap = std::abs(of_pad[p].place - of_rotor[r].place);
            candidates.emplace_back(gap, p, r);
            nearest = std::min(nearest, gap);
          }
      const double touching = nearest + plane_tolerance * extent_of(pair.first);
      bool found            = false;
      for (const auto &[gap, p, r] : candidates)
        if (gap <= touching)
        {
          found            = true;
          DeckContact part = pair;
          if (!is_whole(of_pad, pair.first))
            parts_of_surfaces[part.first = name_of_part(pair.first, p)] = of_pad[p].faces;
          if (!is_whole(of_rotor, pair.second))
            parts_of_surfaces[part.second = name_of_part(pair.second, r)] = of_rotor[r].faces;
          divided.push_back(part);
        }
      if (!found)
        divided.push_back(pair);
    }
    pairs = divided;
    pads.clear();
    for (const DeckContact &pair : pairs)
      pads.merge(volumes_of(pair.first));
  }

  double DeckAssembly::extent_of(const std::string &surface) const
  {
    Box box;
    for (const ElementFile::Face &face : faces_of(surface))
      for (const unsigned int node : face)
        if (node != ElementFile::none)
          box.add(mesh.nodes[node]);
    return box.low.distance(box.high);
  }

  void DeckAssembly::choose_axis()
  {
    Tensor<1, 3> direction;
    if (deck.axis.size() == 6)
    {
      for (unsigned int d = 0; d < 3; ++d)
      {
        origin[d]    = deck.axis[d];
        direction[d] = std::abs(deck.axis[3 + d] - deck.axis[d]);
      }
      axis_is_told = direction.norm() > 0;
    }
    if (!axis_is_told && pairs.empty())
    {
      direction[2] = 1;
      if (!rotor.empty())
        deck.passed_over.push_back("the axis of the rotor is not told: Mesh/Axis = z is a guess");
    }
    else if (!axis_is_told)
      direction = across_sliding_surfaces();
    for (unsigned int d = 0; d < 3; ++d)
      if (direction[d] > direction[axis])
        axis = d;
    if (!(direction[axis] > 0.999 * direction.norm()))
      fail("the rotor's axis is along none of x, y, z: contact surfaces and *MOTION must be "
           "across a coordinate. Turn the assembly.");
    // Given from its other end, it turns the other way.
    if (axis_is_told && deck.axis[3 + axis] < deck.axis[axis])
      deck.speed = -deck.speed;
    if (axis_is_told || rotor.empty())
      return;
    // The file's origin where that is about in the middle: the middle of a coarse mesh's box is
    // not.
    Box box;
    for (const std::string &volume : rotor)
      for (const unsigned int e : mesh.volumes.at(volume))
        for (const unsigned int node : mesh.elements[e].nodes)
          box.add(mesh.nodes[node]);
    for (unsigned int d = 0; d < 3; ++d)
      if (d != axis)
      {
        const double middle = (box.low[d] + box.high[d]) / 2;
        origin[d]           = std::abs(middle) < 0.05 * (box.high[d] - box.low[d]) ? 0 : middle;
      }
  }

  unsigned int DeckAssembly::placed(const unsigned int component) const
  {
    return (component + 2 - axis) % 3;
  }

  std::string DeckAssembly::place_of(const Point<3> &x) const
  {
    std::array<double, 3> result{};
    for (unsigned int d = 0; d < 3; ++d)
      result[placed(d)] = length * (x[d] - origin[d]);
    return digits(result[0]) + " " + digits(result[1]) + " " + digits(result[2]);
  }

  std::set<unsigned int> DeckAssembly::nodes_on(const std::string &surface) const
  {
    std::set<unsigned int> nodes;
    for (const ElementFile::Face &face : mesh.surfaces.at(surface))
    {
      const auto known = element_of_face.find(ElementFile::ascending(face));
      if (known == element_of_face.end())
        continue;
      const ElementFile::Element &element = mesh.elements[known->second];
      const auto has                      = [&](const unsigned int corner)
      { return std::find(face.begin(), face.end(), element.nodes[corner]) != face.end(); };
      for (const unsigned int node : face)
        if (node != ElementFile::none)
          nodes.insert(node);
      const auto &edges    = ElementFile::edges(element.shape);
      const unsigned int n = ElementFile::n_corners(element.shape);
      for (unsigned int e = 0; e < edges.size() && n + e < element.nodes.size(); ++e)
        if (has(edges[e][0]) && has(edges[e][1]))
          nodes.insert(element.nodes[n + e]);
    }
    return nodes;
  }
} // namespace squeal
