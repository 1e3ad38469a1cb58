#include <squeal/base/errors.h>
#include <squeal/base/files.h>
#include <squeal/base/text.h>
#include <squeal/mesh_files/deck_lines.h>
#include <squeal/mesh_files/deck_model.h>
#include <squeal/mesh_files/element_file.h>
#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/mesh_files/plane_parts.h>
#include <squeal/parameters/parameter_file.h>
#include <squeal/scenes/deck_parameters.h>
#include <squeal/scenes/make_scene.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <tuple>

// What a deck says beside its mesh (deck_model.h) becomes a parameter file. DeckWriter first
// decides which units the deck has, what turns, which contacts slide and where the axis is; then
// write() writes the file from top to bottom, Mesh with its supports, materials, joints, operation,
// friction, and at the end what was passed over.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// The law of a section's material as lines of a parameter file.
    struct DeckLaw
    {
      std::string material, orientation;
      bool operator<(const DeckLaw &other) const
      {
        return std::tie(material, orientation) < std::tie(other.material, other.orientation);
      }
    };

    class DeckWriter
    {
    public:
      DeckWriter(const ElementFile &mesh, DeckModel &&deck, const DeckOptions &options)
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

      std::string write()
      {
        out << "# Written by squeal --from-deck " << mesh.name
            << ". Look it through: what it passed over\n# is listed at the end. Units: "
            << (length == 1 ? "the deck's are taken as m, kg, s."
                            : "the deck's are taken as mm, t, s, N, MPa; here all are m, kg, s.")
            << "\n\nset Scene = mesh\nset Stage = " << (pairs.empty() ? "elastic" : "full")
            << "\n\nsubsection Mesh\n";
        line("File", file_name());
        line("Scale", digits(length));
        line("Axis", std::string(1, "xyz"[axis]),
             axis_is_told ? "" : "as the contact surfaces say");
        line("Origin", digits(origin[0]) + ", " + digits(origin[1]) + ", " + digits(origin[2]),
             "a point of the axis, units of the file");
        take_unread();
        mark(DeckMeaning::unknown);
        write_bodies();
        mark(DeckMeaning::body);
        write_supports();
        mark(DeckMeaning::holds);
        write_pressures();
        mark(DeckMeaning::load);
        write_parts();
        out << "end\n";
        write_materials();
        write_joints();
        mark(DeckMeaning::joins);
        write_operation();
        mark(DeckMeaning::turns);
        write_friction();
        mark(DeckMeaning::rubs);
        section("Discretization", {{"Degree", "2"}});
        write_window();
        if (!unread.empty() && !options.partial)
        {
          std::string list;
          for (const auto &[meaning, what] : unread)
            list += "\n  " + what + " (" + name_of(meaning) + ")";
          fail("what follows carries load, holds, joins, turns or is not known, and cannot be "
               "read. With --partial it is left out, and listed in the file:" +
               list);
        }
        for (const auto &[meaning, what] : unread)
          deck.passed_over.push_back(what);
        if (!deck.passed_over.empty())
          out << "\n# Passed over:\n";
        for (const std::string &what : deck.passed_over)
          out << "#   " << what << "\n";
        return out.str();
      }

    private:
      [[noreturn]] void fail(const std::string &message) const
      {
        throw InputError("--from-deck " + mesh.name + ": " + message);
      }

      /// Notes what carries something and cannot be read.
      void leave_out(const DeckMeaning meaning, const std::string &what)
      {
        unread.emplace_back(meaning, what);
      }

      /// Says at its place in the file what of a meaning is left out.
      void mark(const DeckMeaning meaning)
      {
        for (const auto &[carries, what] : unread)
          if (carries == meaning)
            out << "  # Left out: " << what << "\n";
      }

      /// What the reader of the deck did not read, and elements that no keyword read.
      void take_unread()
      {
        unread = deck.not_read;
        std::set<std::string> seen;
        for (const DeckSection &of : deck.sections)
          if (seen.insert(of.material).second)
            for (const std::string &what : deck.materials.at(of.material).unread)
              leave_out(DeckMeaning::body, what);
        static const std::set<std::string> lumped = {"MASS",     "SPRINGA",  "SPRING1", "SPRING2",
                                                     "DASHPOTA", "DASHPOT1", "DASHPOT2"};
        for (const auto &[type, n] : mesh.passed_over)
          if (lumped.count(type) == 0)
            leave_out(DeckMeaning::joins, std::to_string(n) + " elements of type " + type);
        seen.clear();
        const auto look = [&](const DeckContact &contact, const bool slides)
        {
          const auto found          = deck.interactions.find(contact.interaction);
          const std::string between = " between " + contact.first + " and " + contact.second;
          if (found == deck.interactions.end())
            return leave_out(DeckMeaning::rubs, "there is no *SURFACE INTERACTION '" +
                                                    contact.interaction + "'" + between);
          const DeckInteraction &of = found->second;
          for (const std::string &problem : of.problems)
            leave_out(DeckMeaning::rubs, problem + between);
          if (slides && of.is_rough)
            leave_out(DeckMeaning::rubs, "*FRICTION, ROUGH" + between + ", which slide");
          if (slides ? of.stiffness != interaction_of(pairs[0]).stiffness : of.stiffness > 0)
            leave_out(DeckMeaning::rubs,
                      "*SURFACE BEHAVIOR: the stiffness " + digits(of.stiffness) + between +
                          (slides ? ", since the first pair has another one"
                                  : ", which do not slide: these contacts are hard"));
          if (!slides && (of.table.size() > 1 || of.decays))
            leave_out(DeckMeaning::rubs,
                      "*FRICTION that varies" + between + ", which do not slide");
        };
        for (const DeckContact &contact : pairs)
          look(contact, true);
        for (const DeckContact &contact : joints)
          look(contact, false);
      }

      /// The deck's name as a value of a parameter file.
      std::string file_name() const
      {
        const std::string &name = mesh.name;
        if (name.find('"') != std::string::npos ||
            std::any_of(name.begin(), name.end(), [](const unsigned char c) { return c < 0x20; }))
          fail("a parameter file cannot hold this name; rename the deck.");
        return name.find_first_of("#\\ ") == std::string::npos ? name : "\"" + name + "\"";
      }

      void write_operation()
      {
        if (pairs.empty() && deck.speed == 0)
          return;
        if (!deck.speed_is_told && !options.speed)
          fail("the deck does not say how fast the rotor turns (*MOTION, ROTATION). Say it, in "
               "rad/s: --speed VALUE.");
        section("Operation",
                {{"Angular velocity", digits(options.speed ? *options.speed : deck.speed)}});
      }

      void write_window()
      {
        const double highest = deck.frequency > 0 ? deck.frequency : options.window;
        if (!(highest > 0))
          return;
        if (deck.frequency == 0)
          out << "\n# The deck asks for " << deck.n_modes
              << " modes: so many has the brake up to here, counted on elements of degree 1.";
        std::vector<std::pair<std::string, std::string>> lines_of = {
            {"Maximum frequency", digits(highest)}};
        if (deck.lowest_frequency > 0 && deck.lowest_frequency < highest)
          lines_of.emplace_back("Minimum frequency", digits(deck.lowest_frequency));
        section("Eigenproblem", lines_of);
      }

      static std::string digits(const double value)
      {
        return formatted("%.15g", value);
      }

      void line(const std::string &key, const std::string &value, const std::string &comment = "")
      {
        if (!value.empty())
          out << "  set " << key << " = " << value << (comment.empty() ? "" : "  # " + comment)
              << "\n";
      }

      void section(const std::string &name,
                   const std::vector<std::pair<std::string, std::string>> &lines_of)
      {
        out << "\nsubsection " << name << "\n";
        for (const auto &[key, value] : lines_of)
          line(key, value);
        out << "end\n";
      }

      static void append(std::string &list, const std::string &item)
      {
        list += (list.empty() ? "" : ", ") + item;
      }

      static std::string list_of(const std::set<std::string> &names)
      {
        std::string list;
        for (const std::string &name : names)
          append(list, name);
        return list;
      }

      /// A density below 1e-3 is in t/mm^3: solids have 1e-9 to 2e-8 of these, and more than 10
      /// kg/m^3. Without densities there are no modes.
      void choose_units()
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
            fail("the set " + of.volume + " of a *SOLID SECTION has no solid elements.");
          if (material->second.elastic.empty() || !(material->second.density > 0))
            fail("the material " + of.material + " needs *ELASTIC and a *DENSITY above zero.");
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
      }

      std::set<std::string> volumes() const
      {
        std::set<std::string> result;
        for (const DeckSection &of : deck.sections)
          result.insert(of.volume);
        return result;
      }

      void choose_rotor(const std::string &names)
      {
        const std::set<std::string> known = volumes();
        if (deck_label(names) == "NONE" && known.count("NONE") == 0)
          return; // parts alone
        if (names.empty())
        {
          // DISC_PAD and the like are what presses on a disc.
          const auto has_one_of =
              [](const std::string &volume, const std::vector<std::string> &words)
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
              fail("--rotor: there is no section '" + name + "'. Allowed are: " + list_of(known) +
                   ".");
            rotor.insert(deck_label(name));
          }
        if (rotor.empty())
          fail(
              "no section has a name like rotor, disc or disk. Say which turns: --rotor NAME, of " +
              list_of(known) + "; or --rotor none: the parts are studied alone.");
      }

      const std::vector<ElementFile::Face> &faces_of(const std::string &surface) const
      {
        if (const auto part = parts_of_surfaces.find(surface); part != parts_of_surfaces.end())
          return part->second;
        const auto faces = mesh.surfaces.find(surface);
        if (faces == mesh.surfaces.end() || faces->second.empty())
          fail("there is no surface " + surface + " with faces of solid elements.");
        return faces->second;
      }

      /// The sections that have a face.
      std::set<std::string> volumes_at(const ElementFile::Face &face) const
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

      /// The sections in which a surface is.
      std::set<std::string> volumes_of(const std::string &surface) const
      {
        std::set<std::string> result;
        for (const ElementFile::Face &face : faces_of(surface))
          result.merge(volumes_at(face));
        if (result.empty())
          fail("the surface " + surface + " is on no section's elements.");
        return result;
      }

      bool is_on_rotor(const std::string &surface) const
      {
        const std::set<std::string> of = volumes_of(surface);
        return std::any_of(of.begin(), of.end(),
                           [&](const std::string &volume) { return rotor.count(volume) > 0; });
      }

      double area_of(const std::string &surface) const
      {
        double area = 0;
        for (const ElementFile::Face &face : faces_of(surface))
        {
          // Half the product of the diagonals; a triangle's fourth corner is the first again.
          const Point<3> &fourth = mesh.nodes[face[3] == ElementFile::none ? face[0] : face[3]];
          area += cross_product_3d(mesh.nodes[face[2]] - mesh.nodes[face[0]],
                                   fourth - mesh.nodes[face[1]])
                      .norm() /
                  2;
        }
        return area;
      }

      const DeckInteraction &interaction_of(const DeckContact &contact) const
      {
        static const DeckInteraction none;
        const auto found = deck.interactions.find(contact.interaction);
        return found == deck.interactions.end() ? none : found->second;
      }

      double friction_of(const DeckContact &contact) const
      {
        const DeckInteraction &of = interaction_of(contact);
        return of.table.empty() ? 0 : of.table[0][0];
      }

      /// What slides on the rotor is a pad; other contacts are joints.
      void sort_contacts()
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

      /// The direction across the sliding surfaces, as absolute values: of the rotor's, or where
      /// that has a rim, too, of the coordinate that most of the pads' surfaces lie across.
      Tensor<1, 3> across_sliding_surfaces() const
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

      /// Parts of two surfaces that slide on each other where one of them has several planes: both
      /// faces of the disc, or a skin over its rim. Each part of a pad touches that of the rotor
      /// which looks towards it and is nearest.
      void divide_pairs()
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

      double extent_of(const std::string &surface) const
      {
        Box box;
        for (const ElementFile::Face &face : faces_of(surface))
          for (const unsigned int node : face)
            if (node != ElementFile::none)
              box.add(mesh.nodes[node]);
        return box.low.distance(box.high);
      }

      /// Across the sliding surfaces, through the middle of the rotor.
      void choose_axis()
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
            deck.passed_over.push_back(
                "the axis of the rotor is not told: Mesh/Axis = z is a guess");
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
        // Of the origin of the file where that is about in the middle, which of a coarse mesh no
        // box is.
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

      /// The coordinate of the parameter file that one of the deck becomes.
      unsigned int placed(const unsigned int component) const
      {
        return (component + 2 - axis) % 3;
      }

      std::string place_of(const Point<3> &x) const
      {
        std::array<double, 3> result{};
        for (unsigned int d = 0; d < 3; ++d)
          result[placed(d)] = length * (x[d] - origin[d]);
        return digits(result[0]) + " " + digits(result[1]) + " " + digits(result[2]);
      }

      void write_bodies()
      {
        std::map<DeckLaw, std::set<std::string>> of_rotor, of_pads, of_others;
        for (const DeckSection &of : deck.sections)
          (rotor.count(of.volume)  ? of_rotor
           : pads.count(of.volume) ? of_pads
                                   : of_others)[{of.material, of.orientation}]
              .insert(of.volume);
        if (rotor.empty())
          out << "  set Rotor =  # parts are studied alone\n";
        unsigned int n_parts = 0;
        const auto add = [&](std::map<DeckLaw, std::set<std::string>> &laws, const std::string &own,
                             const std::string &body)
        {
          for (const auto &[law, names] : laws)
            if (!own.empty() && &law == &laws.begin()->first)
            {
              line(own, list_of(names));
              laws_of_sections.emplace_back(own, law);
            }
            else
            {
              const std::string part = "Part " + std::to_string(++n_parts);
              parts.push_back({part, list_of(names), body});
              laws_of_sections.emplace_back(part, law);
            }
        };
        add(of_rotor, "Rotor", "rotor");
        add(of_pads, "Pads", "pads");
        add(of_others, "", "parts");
        std::string list;
        for (const DeckContact &pair : pairs)
          append(list, pair.first + " : " + pair.second);
        line("Contact pairs", list);
      }

      /// Nodes of the faces of a surface, those between the corners, too.
      std::set<unsigned int> nodes_on(const std::string &surface) const
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

      /// Nodes of elements all of whose corners are in a set.
      std::set<unsigned int> nodes_of_elements_in(const std::set<unsigned int> &set) const
      {
        std::set<unsigned int> nodes;
        for (const ElementFile::Element &element : mesh.elements)
          if (std::all_of(element.nodes.begin(),
                          element.nodes.begin() + ElementFile::n_corners(element.shape),
                          [&](const unsigned int node) { return set.count(node) > 0; }))
            nodes.insert(element.nodes.begin(), element.nodes.end());
        return nodes;
      }

      /// Each node that is held must be on a face that is, in the same direction: an edge or a
      /// single node holds nothing as meshes become fine.
      void check_supports()
      {
        std::array<std::set<unsigned int>, 3> held;
        for (const DeckSupport &support : deck.supports)
          if (mesh.surfaces.count(support.nodes) > 0)
            for (const unsigned int d : support.components)
              held[d].merge(nodes_on(support.nodes));
        std::set<unsigned int> of_elements;
        for (const ElementFile::Element &element : mesh.elements)
          of_elements.insert(element.nodes.begin(), element.nodes.end());
        for (const DeckSupport &support : deck.supports)
        {
          std::set<unsigned int> nodes, missing;
          if (const auto set = mesh.node_sets.find(support.nodes); set != mesh.node_sets.end())
            for (const unsigned int node : set->second)
              if (of_elements.count(node) > 0)
                nodes.insert(node);
          if (nodes.empty() && mesh.surfaces.count(support.nodes) == 0)
          {
            leave_out(DeckMeaning::holds, support.where + ": *BOUNDARY, " + support.nodes +
                                              " holds no nodes of solid elements");
            continue;
          }
          const std::set<unsigned int> inside = nodes_of_elements_in(nodes);
          for (const unsigned int d : support.components)
            for (const unsigned int node : nodes)
              if (held[d].count(node) == 0 && inside.count(node) == 0)
                missing.insert(node);
          if (!missing.empty())
            leave_out(DeckMeaning::holds,
                      text_of(support.where, ": *BOUNDARY, ", support.nodes, ": ", missing.size(),
                              " of ", nodes.size(), " nodes, among them that at (",
                              mesh.nodes[*missing.begin()],
                              "), are on no face all of whose corners are held. Edges and single "
                              "nodes hold nothing as meshes become fine: hold faces"));
        }
      }

      /// The deck's components of those that are held in another system; nothing: they are along no
      /// axes of the deck.
      std::optional<std::set<unsigned int>> along_axes(const DeckTransform &transform,
                                                       const std::set<unsigned int> &held) const
      {
        if (held.size() == 3)
          return held;
        const auto coordinate = [](const Tensor<1, 3> &v) -> std::optional<unsigned int>
        {
          for (unsigned int d = 0; d < 3; ++d)
            if (std::abs(v[d]) > (1 - 1e-10) * v.norm())
              return d;
          return {};
        };
        std::set<unsigned int> result;
        const Tensor<1, 3> z = cross_product_3d(transform.first, transform.in_plane);
        if (transform.is_cylindrical)
        {
          // Along the circle and its radius only together, and about an axis of the deck
          const auto along = coordinate(transform.first);
          if (!along || held.count(0) != held.count(1))
            return {};
          for (unsigned int d = 0; d < 3; ++d)
            if (held.count(d == *along ? 2 : 0) > 0)
              result.insert(d);
          return result;
        }
        const std::array<Tensor<1, 3>, 3> directions = {
            {transform.first, cross_product_3d(z, transform.first), z}};
        for (const unsigned int d : held)
          if (const auto along = coordinate(directions[d]))
            result.insert(*along);
          else
            return {};
        return result;
      }

      /// Supports of nodes that have a system of their own are turned into the deck's.
      void apply_transforms()
      {
        for (const DeckTransform &transform : deck.transforms)
        {
          const auto turned = mesh.node_sets.find(transform.nodes);
          if (turned == mesh.node_sets.end())
          {
            leave_out(DeckMeaning::holds, transform.where + ": *TRANSFORM, of nodes " +
                                              transform.nodes + ", which are none of the mesh");
            continue;
          }
          const std::set<unsigned int> nodes(turned->second.begin(), turned->second.end());
          for (DeckSupport &support : deck.supports)
          {
            const auto set = mesh.node_sets.find(support.nodes);
            if (set == mesh.node_sets.end())
              continue;
            const std::size_t n =
                std::count_if(set->second.begin(), set->second.end(),
                              [&](const unsigned int node) { return nodes.count(node) > 0; });
            const auto components = along_axes(transform, support.components);
            if (n == 0 || (components && *components == support.components))
              continue;
            if (components && n == set->second.size())
              support.components = *components;
            else
              leave_out(DeckMeaning::holds, support.where + ": *BOUNDARY, " + support.nodes +
                                                ", in the directions of *TRANSFORM (" +
                                                transform.where +
                                                "), which are not those of the axes" +
                                                (components ? " of all of its nodes" : ""));
          }
        }
      }

      void write_supports()
      {
        apply_transforms();
        check_supports();
        std::map<std::string, std::set<unsigned int>> components;
        for (const DeckSupport &support : deck.supports)
          if (mesh.surfaces.count(support.nodes) > 0)
            for (const unsigned int d : support.components)
              components[support.nodes].insert(placed(d));
        std::map<std::string, std::set<std::string>> names;
        for (const auto &[surface, fixed] : components)
          if (fixed.size() == 3)
            names["Clamped"].insert(surface);
          else if (fixed == std::set<unsigned int>{0, 1})
            names["Guided"].insert(surface);
          else
            for (const unsigned int d : fixed)
              names[std::string("Fixed in ") + "xyz"[d]].insert(surface);
        for (const auto &[key, surfaces] : names)
          line(key, list_of(surfaces));
      }

      /// The parameter file has one pressure, that of the first load.
      void write_pressures()
      {
        std::set<std::string> loaded;
        for (const DeckPressure &of : deck.pressures)
        {
          faces_of(of.surface);
          if (pressure == 0)
            pressure = of.value;
          if (of.value != pressure || of.value < 0)
            leave_out(DeckMeaning::load,
                      text_of(of.where, ": the pressure ", of.value, " on ", of.surface,
                              ", since the pads have ", pressure,
                              ": Pads/Pressure profile can tell them apart by place"));
          else if (!loaded.insert(of.surface).second)
            leave_out(DeckMeaning::load,
                      of.where + ": a second load on the faces of " + of.surface);
        }
        line("Pressure on", list_of(loaded));
      }

      void write_parts()
      {
        for (const auto &[part, volumes_of, body] : parts)
          out << "  subsection " << part << "\n    set Volumes = " << volumes_of
              << "\n    set Body = " << body << "\n    subsection Material\n"
              << material_lines(law_of(part), "      ") << "    end\n  end\n";
      }

      const DeckLaw &law_of(const std::string &name) const
      {
        return std::find_if(laws_of_sections.begin(), laws_of_sections.end(),
                            [&](const auto &entry) { return entry.first == name; })
            ->second;
      }

      /// Material sections of rotor and pads, the latter with the pressure.
      void write_materials()
      {
        for (const std::string name : {"Rotor", "Pads"})
        {
          const bool has_material =
              std::any_of(laws_of_sections.begin(), laws_of_sections.end(),
                          [&](const auto &entry) { return entry.first == name; });
          const bool has_pressure = name == "Pads" && pressure != 0;
          if (!has_material && !has_pressure)
            continue;
          out << "\nsubsection " << name << "\n";
          if (has_pressure)
            line("Pressure", digits(pressure / (length * length)));
          if (has_material)
            out << "  subsection Material\n" << material_lines(law_of(name), "    ") << "  end\n";
          out << "end\n";
        }
      }

      std::string material_lines(const DeckLaw &law, const std::string &indent) const
      {
        const DeckMaterial &material = deck.materials.at(law.material);
        // N/mm^2 and t/mm^3: a stress is force over area, a density mass over volume.
        const double stress = 1 / (length * length),
                     density =
                         (length == 1 ? 1 : 1e3) / (length * length * length) * material.density;
        std::string text = indent + "# " + law.material + "\n";
        const auto add   = [&](const std::string &key, const double value)
        { text += indent + "set " + key + " = " + digits(value) + "\n"; };
        if (material.elastic.size() == 2)
        {
          add("Young modulus", stress * material.elastic[0]);
          add("Poisson ratio", material.elastic[1]);
        }
        else
        {
          const std::array<double, 5> constants = transversely_isotropic(law, material.elastic);
          text += indent + "set Law = transversely_isotropic\n";
          add("Young modulus", stress * constants[0]);
          add("Poisson ratio", constants[1]);
          add("Axial Young modulus", stress * constants[2]);
          add("Axial Poisson ratio", constants[3]);
          add("Axial shear modulus", stress * constants[4]);
        }
        add("Density", density);
        add("Mass proportional damping", material.mass_damping);
        add("Stiffness proportional damping", material.stiffness_damping);
        if (material.loss_factor != 0)
          add("Loss factor", material.loss_factor);
        return text;
      }

      /// E_t, nu_t, E_n, nu_tn, G_tn of engineering constants E1 E2 E3 nu12 nu13 nu23 G12 G13 G23
      /// of which one direction n is along the rotor's axis and the two others, t, are alike: nu_tn
      /// = nu_nt E_t / E_n, G_t = E_t / 2 (1 + nu_t).
      std::array<double, 5> transversely_isotropic(const DeckLaw &law,
                                                   const std::vector<double> &constants) const
      {
        std::array<Tensor<1, 3>, 3> directions;
        for (unsigned int d = 0; d < 3; ++d)
          directions[d][d] = 1;
        if (!law.orientation.empty())
        {
          const auto found = deck.orientations.find(law.orientation);
          if (found == deck.orientations.end())
            fail("there is no rectangular *ORIENTATION " + law.orientation + ".");
          directions[0] = found->second.first;
          directions[2] = cross_product_3d(found->second.first, found->second.in_plane);
          directions[1] = cross_product_3d(directions[2], directions[0]);
        }
        const std::array<double, 3> E = {{constants[0], constants[1], constants[2]}};
        // By the direction that a pair of directions leaves out
        const std::array<double, 3> nu = {{constants[5], constants[4], constants[3]}},
                                    G  = {{constants[8], constants[7], constants[6]}};
        const auto equal               = [](const double a, const double b)
        { return std::abs(a - b) <= 1e-6 * (std::abs(a) + std::abs(b)); };
        for (unsigned int n = 0; n < 3; ++n)
        {
          if (!(std::abs(directions[n][axis]) > (1 - 1e-6) * directions[n].norm()))
            continue;
          const unsigned int s = n == 0 ? 1 : 0, t = n == 2 ? 1 : 2;
          // nu_ij, i < j, is the contraction along j by stretch along i.
          const auto of_stretch_across = [&](const unsigned int across)
          {
            const double value = nu[3 - n - across];
            return across < n ? value : value * E[across] / E[n];
          };
          if (!equal(E[s], E[t]) || !equal(G[s], G[t]) ||
              !equal(of_stretch_across(s), of_stretch_across(t)) ||
              !equal(G[n], E[s] / (2 * (1 + nu[n]))))
            break;
          return {{E[s], nu[n], E[n], of_stretch_across(s), G[s]}};
        }
        fail("the engineering constants of " + law.material +
             " are not transversely isotropic about the rotor's axis, the only anisotropic law "
             "that squeal has: two directions across the axis must be alike, G = E / 2 (1 + nu) "
             "between them.");
      }

      void write_joints()
      {
        std::string ties, contacts;
        for (auto [first, second] : deck.ties)
        {
          // The first surface lies on the second.
          if (area_of(first) > 1.0001 * area_of(second))
            std::swap(first, second);
          append(ties, first + " : " + second);
        }
        for (const DeckContact &contact : joints)
          append(contacts,
                 contact.first + " : " + contact.second +
                     (friction_of(contact) > 0 ? " : stick " + digits(friction_of(contact))
                      : interaction_of(contact).is_rough ? " : stick"
                                                         : " : frictionless"));
        for (const DeckLumped &lumped : deck.lumped)
          add_lumped(lumped);
        std::string points;
        for (const auto &[name, place] : points_used)
          append(points, name + " : " + place);
        if (ties.empty() && contacts.empty() && points.empty())
          return;
        section("Joints", {{"Ties", ties},
                           {"Contacts", contacts},
                           {"Points", points},
                           {"Masses", lumped_lists["*MASS"]},
                           {"Springs", lumped_lists["*SPRING"]},
                           {"Dashpots", lumped_lists["*DASHPOT"]}});
      }

      /// The point of a node: that of the surface to which a coupling ties it, or in space.
      std::optional<std::string> point_of(std::string node, Point<3> &x)
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
        const auto found = deck.nodes.find(node);
        if (found == deck.nodes.end())
          return {};
        x = found->second;
        if (!surface.empty())
          faces_of(surface);
        else
        {
          // Exactly: both were read from the same text.
          for (const ElementFile::Element &element : mesh.elements)
            for (const unsigned int of_mesh : element.nodes)
              if (mesh.nodes[of_mesh] == x)
                return {};
        }
        const std::string name = "P" + node;
        points_used[name]      = surface.empty() ? place_of(x) : surface;
        return name;
      }

      void add_lumped(const DeckLumped &lumped)
      {
        const auto pass_over = [&](const std::string &why)
        { leave_out(DeckMeaning::joins, lumped.where + ": " + lumped.kind + ", " + why); };
        const std::vector<std::vector<double>> &rows = lumped.rows;
        const auto elements                          = deck.lumped_elements.find(lumped.elements);
        if (elements == deck.lumped_elements.end())
          return pass_over("the set " + lumped.elements + " has no elements outside of parts");
        const double mass_unit = length == 1 ? 1 : 1e3;
        std::string &list      = lumped_lists[lumped.kind];
        for (const DeckLumpedElement &element : elements->second)
        {
          std::vector<std::string> names;
          std::vector<Point<3>> places(2);
          for (unsigned int k = 0; k < std::min<std::size_t>(2, element.nodes.size()); ++k)
            if (const auto name = point_of(element.nodes[k], places[k]))
              names.push_back(*name);
          if (names.empty() || names.size() != element.nodes.size())
          {
            pass_over("at a node of the mesh or a part; a *COUPLING to a surface makes it a point");
            continue;
          }
          if (lumped.kind == "*MASS" && !rows.empty() && !rows[0].empty())
            append(list, names[0] + " : " + digits(mass_unit * rows[0][0]));
          else if (element.type == "SPRINGA" || element.type == "DASHPOTA")
          {
            // Its first data line is empty.
            const double value           = rows.empty() || rows.back().empty() ? 0 : rows.back()[0];
            const Tensor<1, 3> direction = places[1] - places[0];
            if (names.size() != 2 || direction.norm() == 0)
            {
              pass_over("between points at one place, which has no direction");
              continue;
            }
            std::array<double, 3> along{};
            for (unsigned int d = 0; d < 3; ++d)
              along[placed(d)] = direction[d] / direction.norm();
            append(list, names[0] + " : " + names[1] + " : " + digits(value / length) + " 0 0 : " +
                             digits(along[0]) + " " + digits(along[1]) + " " + digits(along[2]));
          }
          else if (rows.size() >= 2 && !rows[0].empty() && !rows[1].empty())
          {
            const double component = rows[0][0];
            const unsigned int of  = component >= 1 && component <= 6 ? component : 0;
            if (of == 0 || (names.size() == 2 && (rows[0].size() < 2 || rows[0][1] != component)))
            {
              pass_over("between two different components");
              continue;
            }
            std::array<double, 6> values{};
            // N mm per radian
            values[of > 3 ? 3 + placed(of - 4) : placed(of - 1)] =
                rows[1][0] * (of > 3 ? length : 1 / length);
            append(list, names[0] + " : " + (names.size() == 2 ? names[1] : "ground") + " :");
            for (const double value : values)
              list += " " + digits(value);
          }
          else
            pass_over("without values");
        }
      }

      /// The function that is linear between points (x, y) and constant outside, by absolute
      /// values, which need no commas: c + sum of half the changes of slope times |x - x_i|.
      static std::string piecewise_linear(const std::string &variable, const std::vector<double> &x,
                                          const std::vector<double> &y)
      {
        std::string sum;
        double constant = y[0], slope = 0;
        for (std::size_t i = 0; i < x.size(); ++i)
        {
          const double next = i + 1 < x.size() ? (y[i + 1] - y[i]) / (x[i + 1] - x[i]) : 0,
                       half = (next - slope) / 2;
          slope             = next;
          constant -= half * (x[i] - x[0]);
          if (half != 0)
            sum += "+(" + digits(half) + ")*abs(" + variable + "-" + digits(x[i]) + ")";
        }
        return "(" + digits(constant) + sum + ")";
      }

      /// A table by slip rate and pressure, linear between its values: sum over the pressures p_j
      /// of mu_j(v) times the function of p that is 1 at p_j and 0 at the others.
      std::string table_of_friction(const std::vector<std::array<double, 3>> &table) const
      {
        std::map<double, std::map<double, double>> by_pressure;
        for (const auto &[mu, v, p] : table)
          by_pressure[p / (length * length)][v * length] = mu;
        std::vector<double> pressures;
        for (const auto &entry : by_pressure)
          pressures.push_back(entry.first);
        std::string sum;
        for (std::size_t j = 0; j < pressures.size(); ++j)
        {
          std::vector<double> speeds, values, unit(pressures.size());
          for (const auto &[v, mu] : by_pressure.at(pressures[j]))
          {
            speeds.push_back(v);
            values.push_back(mu);
          }
          unit[j] = 1;
          sum += (sum.empty() ? "" : "+") + piecewise_linear("v", speeds, values);
          if (pressures.size() > 1)
            sum += "*" + piecewise_linear("p", pressures, unit);
        }
        return sum;
      }

      /// Keys and values of a pair's friction law.
      std::vector<std::pair<std::string, std::string>> friction_law(const DeckContact &pair) const
      {
        const DeckInteraction &of = interaction_of(pair);
        if (of.table.size() > 1)
          return {{"Law", "expression"}, {"Expression", table_of_friction(of.table)}};
        if (of.decays && of.decay > 0)
          return {{"Law", "falling"},
                  {"Coefficient", digits(friction_of(pair))},
                  {"Coefficient at speed", digits(of.at_speed)},
                  {"Decay speed", digits(length / of.decay)}};
        return {{"Law", "constant"}, {"Coefficient", digits(friction_of(pair))}};
      }

      void friction_line(const std::string &key, const std::string &value)
      {
        if (!value.empty())
          out << "    set " << key << " = " << value << "\n";
      }

      void write_friction()
      {
        if (pairs.empty())
          return;
        const auto law = friction_law(pairs[0]);
        std::string of_pads;
        for (const DeckContact &pair : pairs)
          if (const auto other = friction_law(pair); other != law)
          {
            append(of_pads, pair.first + " :");
            for (std::size_t k = 0; k < other.size(); ++k)
              of_pads += (k > 0 ? "; " : " ") + other[k].first + " " + other[k].second;
          }
        out << "\nsubsection Contact\n";
        if (const double stiffness = interaction_of(pairs[0]).stiffness; stiffness > 0)
        {
          line("Formulation", "penalty");
          line("Penalty stiffness", digits(stiffness / (length * length * length)));
        }
        out << "  subsection Friction\n";
        for (const auto &[key, value] : law)
          if (key != "Law" || value != "constant")
            friction_line(key, value);
        friction_line("Of pads", of_pads);
        out << "  end\nend\n";
      }

      struct PartLines
      {
        std::string name, volumes, body;
      };

      const ElementFile &mesh;
      DeckModel deck;
      const DeckOptions options;
      /// What carries something and is left out.
      std::vector<std::pair<DeckMeaning, std::string>> unread;
      std::map<std::string, std::vector<ElementFile::Face>> parts_of_surfaces; ///< by planes
      std::map<ElementFile::Face, unsigned int> element_of_face;
      double length = 1;                 ///< metres of the deck's unit
      std::set<std::string> rotor, pads; ///< no rotor: parts are studied alone
      std::vector<DeckContact> pairs, joints;
      unsigned int axis = 0;
      bool axis_is_told = false;
      std::array<double, 3> origin{};
      double pressure = 0; ///< in units of the deck
      std::vector<PartLines> parts;
      std::vector<std::pair<std::string, DeckLaw>> laws_of_sections;
      std::map<std::string, std::string> points_used, lumped_lists;
      std::ostringstream out;
    };
  } // namespace

  namespace
  {
    /// Throws InputError where a run would refuse the parameter file that was written, or its mesh.
    void read_back(const std::string &text, const std::string &filename)
    {
      try
      {
        ParameterFile file;
        file.read_text(filename, text);
        make_imported_scene(file.parameters());
      }
      catch (const InputError &error)
      {
        throw InputError("--from-deck " + filename +
                         ": a run would refuse the parameter file: " + error.what() +
                         "\nWith --partial the file is written all the same, to be mended.");
      }
    }
  } // namespace

  DeckParameters parameters_of_deck(const std::string &filename, const DeckOptions &options)
  {
    if (filename.size() < 4 || filename.substr(filename.size() - 4) != ".inp")
      throw InputError("--from-deck " + filename + ": a deck (.inp) is expected.");
    const ElementFile mesh = read_mesh_file(filename);
    std::ifstream in       = open_regular_file(filename);
    DeckModel deck         = read_deck_model(in, filename);
    DeckParameters result;
    if (deck.frequency == 0 && deck.n_modes >= 1)
      result.n_modes = deck.n_modes;
    result.text = DeckWriter(mesh, std::move(deck), options).write();
    if (!options.partial)
      read_back(result.text, filename);
    return result;
  }
} // namespace squeal
