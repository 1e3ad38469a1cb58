#include <squeal/base/errors.h>
#include <squeal/mesh_import/imported_scene.h>
#include <squeal/mesh_import/mesh_checks.h>
#include <squeal/mesh_import/placed_mesh.h>
#include <squeal/mesh_import/rigid_motions.h>
#include <squeal/mesh_import/superelement_files.h>
#include <squeal/parameters/expressions.h>

#include <deal.II/base/utilities.h>
#include <deal.II/grid/grid_tools.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <tuple>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    constexpr double revolution_tolerance = 1e-3; ///< of a face's size
    const std::string superelements_key   = "Joints/Superelements";
    const std::string exported_key        = "Output/Superelement";

    std::vector<std::string> list_of(const std::string &text)
    {
      return text.empty() ? std::vector<std::string>() : Utilities::split_string_list(text, ',');
    }

    /// Builds the geometry step by step; each step refuses what it cannot work with.
    class ImportedScene
    {
    public:
      explicit ImportedScene(const Parameters::All &prm)
          : prm(prm), mesh(prm.mesh),
            file(read_placed_mesh(prm)), facts{file, {}, 0, {}, {}, {}, {}, {}}
      {
      }

      Geometry<3> make()
      {
        assign_materials();
        turn_cells();
        find_neighbours();
        find_bodies();
        name_faces();
        check_pairs();
        check_ties();
        check_contacts();
        if (needs_revolution())
          check_revolution();
        check_supports();
        add_cells();
        report_mesh(prm, facts, geometry);
        check_uniform_pressure();
        return std::move(geometry);
      }

    private:
      using Face = MeshFile::Face;

      [[noreturn]] void fail(const std::string &key, const std::string &message) const
      {
        throw InputError((key.find('/') < key.size() && key.find("Part") != 0 ? "" : "Mesh/") +
                         key + ": " + file.name + ": " + message);
      }

      std::string element(const unsigned int cell) const
      {
        Point<3> centre;
        for (const unsigned int node : file.cells[cell].nodes)
          centre += file.nodes[node] / 8.;
        return "element " + std::to_string(file.cells[cell].number) + " at " + text_of(centre);
      }

      /// The group of a name; where capitals are the only difference, that.
      template <typename T>
      const std::pair<const std::string, T> &
      find_group(const std::map<std::string, T> &groups, const std::string &name,
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
                      (known.empty() ? "none, the file has no " + kind + " groups" : known) + ".");
      }

      void assign_materials()
      {
        const std::vector<Parameters::BodyMaterial> materials = prm.materials();
        constexpr unsigned int none                           = -1;
        material_of_cell.assign(file.cells.size(), none);
        std::vector<std::string> named(file.cells.size());
        for (unsigned int m = 0; m < materials.size(); ++m)
        {
          of_rotor.push_back(materials[m].of_rotor);
          const std::string key = m == 0   ? "Rotor"
                                  : m == 1 ? "Pads"
                                           : materials[m].section.substr(5) + "/Volumes";
          for (const std::string &text : list_of(materials[m].volumes))
          {
            const auto &[name, cells] = find_group(file.volumes, text, key, "volume");
            facts.roles[name]         = key;
            for (const unsigned int c : cells)
            {
              if (material_of_cell[c] != none && material_of_cell[c] != m)
                fail(key, element(c) + " is in the volumes '" + named[c] + "' and '" + name +
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
        for (const auto &[name, cells] : file.volumes)
          if (std::binary_search(cells.begin(), cells.end(), c))
            groups += (groups.empty() ? "'" : "', '") + name;
        fail("Rotor",
             std::to_string(std::count(lost, material_of_cell.end(), none)) +
                 " cells have no material, first " + element(c) + ", " +
                 (groups.empty() ? "in no volume group" : "in the volume group " + groups + "'") +
                 ". Every cell must be in a volume of Mesh/Rotor, Mesh/Pads or a "
                 "Mesh/Part's Volumes.");
      }

      /// Cells that are numbered as their mirror image are turned; distorted ones are refused.
      void turn_cells()
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
            ++facts.n_turned;
          }
          else if (!(*low > 0))
          {
            std::ostringstream message;
            message << element(c) << " has the scaled Jacobian " << *low << " at a corner and "
                    << *high << " at another: it is folded or flat. All must be positive.";
            fail("File", message.str());
          }
        }
      }

      /// Which cells share which face. A face between two cells lies on opposite sides of them.
      void find_neighbours()
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

      /// Pieces that hang together by nodes are the bodies: one rotor, or several pieces of it that
      /// are tied, pads with a contact pair, and others that hang on joints.
      void find_bodies()
      {
        Groups pieces(file.nodes.size());
        for (const MeshFile::Cell &cell : file.cells)
          for (const unsigned int node : cell.nodes)
            pieces.join(node, cell.nodes[0]);
        const auto piece_of = [&](const unsigned int cell)
        { return pieces.of(file.cells[cell].nodes[0]); };

        std::map<unsigned int, unsigned int> rotor_pieces, others; // and a cell of each
        for (unsigned int c = 0; c < file.cells.size(); ++c)
          (of_rotor[material_of_cell[c]] ? rotor_pieces : others).emplace(piece_of(c), c);
        for (const auto &[piece, cell] : rotor_pieces)
          if (const auto other = others.find(piece); other != others.end())
            fail("Contact pairs", "rotor and pad hang together by common nodes, " + element(cell) +
                                      " and " + element(other->second) +
                                      ". Surfaces in contact need nodes of their own.");
        if (rotor_pieces.empty())
          fail("Rotor", "the rotor has no cells.");

        // The pieces of the surfaces of each joint
        ties        = prm.joints.tied_surfaces();
        contacts    = prm.joints.list_of_contacts();
        Groups tied = pieces;
        std::set<unsigned int> joined;
        for (const Parameters::Joints::Point &point : prm.joints.list_of_points())
          if (!point.surface.empty())
          {
            std::set<unsigned int> of_point;
            for (const Face &face :
                 find_group(file.surfaces, point.surface, "Joints/Points", "surface").second)
              of_point.insert(piece_of(boundary_cell(face, point.surface, "Joints/Points").cell));
            if (of_point.size() > 1)
              fail("Joints/Points", "the surface '" + point.surface + "' of the point '" +
                                        point.name + "' is on " + std::to_string(of_point.size()) +
                                        " bodies; allowed is one.");
            joined.insert(of_point.begin(), of_point.end());
          }
        for (const auto &superelement : prm.joints.list_of_superelements())
          for (const std::string &name : superelement.surfaces)
            for (const Face &face :
                 find_group(file.surfaces, name, superelements_key, "surface").second)
              joined.insert(piece_of(boundary_cell(face, name, superelements_key).cell));
        for (auto &tie : ties)
        {
          std::set<bool> turns;
          unsigned int last = numbers::invalid_unsigned_int;
          for (std::string *name : {&tie.first, &tie.second})
          {
            *name = find_group(file.surfaces, *name, "Joints/Ties", "surface").first;
            for (const Face &face : file.surfaces.at(*name))
            {
              const unsigned int piece = piece_of(boundary_cell(face, *name, "Joints/Ties").cell);
              turns.insert(rotor_pieces.count(piece) > 0);
              joined.insert(piece);
              if (last != numbers::invalid_unsigned_int)
                tied.join(piece, last);
              last = piece;
            }
          }
          if (turns.size() > 1)
            fail("Joints/Ties", "'" + tie.first + "' and '" + tie.second +
                                    "' are a tie across the sliding surface: one is on the rotor, "
                                    "the other is not. Both must turn or both must not.");
        }
        for (Parameters::Joints::Contact &contact : contacts)
          find_contact_bodies(contact, rotor_pieces, piece_of, tied, joined);
        for (const auto &[piece, cell] : rotor_pieces)
          if (tied.of(piece) != tied.of(rotor_pieces.begin()->first))
            fail("Rotor", "the rotor is in " + std::to_string(rotor_pieces.size()) +
                              " pieces that share no nodes, among them " +
                              element(rotor_pieces.begin()->second) + " and " + element(cell) +
                              ". Common surfaces of volumes need common nodes (in Gmsh: "
                              "Coherence), or a joint (Joints/Ties).");

        std::map<unsigned int, Body> bodies;
        for (const auto &rotor_piece : rotor_pieces)
          bodies[rotor_piece.first] = rotor_body;
        facts.bodies = {"rotor"};
        pairs        = mesh.pairs();
        for (auto &[pad_name, rotor_name] : pairs)
        {
          // The names as in the file
          pad_name   = find_group(file.surfaces, pad_name, "Contact pairs", "surface").first;
          rotor_name = find_group(file.surfaces, rotor_name, "Contact pairs", "surface").first;
          std::set<unsigned int> pad_pieces;
          for (const Face &face : file.surfaces.at(pad_name))
            pad_pieces.insert(piece_of(boundary_cell(face, pad_name, "Contact pairs").cell));
          for (const Face &face : file.surfaces.at(rotor_name))
            if (!rotor_pieces.count(
                    piece_of(boundary_cell(face, rotor_name, "Contact pairs").cell)))
              fail("Contact pairs", "'" + rotor_name +
                                        "' is not on the rotor; allowed is pad "
                                        "surface : rotor surface.");
          if (pad_pieces.size() != 1 || !others.count(*pad_pieces.begin()))
            fail("Contact pairs", "'" + pad_name +
                                      "' is not on one pad; allowed is pad surface : "
                                      "rotor surface.");
          if (bodies.emplace(*pad_pieces.begin(), Body(facts.bodies.size())).second)
            facts.bodies.push_back(pad_name);
          pad_of_pair.push_back(bodies.at(*pad_pieces.begin()));
        }
        for (const auto &[piece, cell] : others)
        {
          if (bodies.count(piece))
            continue;
          if (!joined.count(piece))
            fail(
                "Contact pairs",
                "the piece with " + element(cell) +
                    " has no contact pair and no joint (Joints/Ties, Contacts, Points), and shares "
                    "no nodes with a "
                    "pad that has a contact pair. Common surfaces of volumes need common nodes (in "
                    "Gmsh: Coherence).");
          const Body body = Body(facts.bodies.size());
          bodies.emplace(piece, body);
          facts.bodies.push_back(name_of_piece(cell));
          geometry.other_bodies[body] = facts.bodies.back();
        }
        // Bodies that are tied hold each other.
        cluster_of_body.resize(facts.bodies.size());
        for (const auto &[piece, body] : bodies)
          cluster_of_body[body] = bodies.at(tied.of(piece));

        // One material id for each body and material.
        std::map<std::pair<Body, unsigned int>, unsigned int> ids;
        geometry.parts.clear();
        for (unsigned int c = 0; c < file.cells.size(); ++c)
        {
          const Body body             = bodies.at(piece_of(c));
          const unsigned int material = material_of_cell[c];
          const auto [id, is_new]     = ids.emplace(std::make_pair(body, material), ids.size());
          if (is_new)
            geometry.parts.push_back(
                {body, material,
                 mesh.curved == CurvedBodies::all ||
                     (mesh.curved == CurvedBodies::rotor && body == rotor_body)});
          part_of_cell.push_back(id->second);
        }
      }

      /// The names as in the file of a contact's surfaces, each on one body that does not turn.
      template <typename PieceOf>
      void find_contact_bodies(Parameters::Joints::Contact &contact,
                               const std::map<unsigned int, unsigned int> &rotor_pieces,
                               const PieceOf &piece_of, Groups &tied,
                               std::set<unsigned int> &joined) const
      {
        const std::string key = "Joints/Contacts";
        std::vector<unsigned int> found;
        for (std::string *name : {&contact.first, &contact.second})
        {
          *name = find_group(file.surfaces, *name, key, "surface").first;
          std::set<unsigned int> pieces;
          for (const Face &face : file.surfaces.at(*name))
            pieces.insert(piece_of(boundary_cell(face, *name, key).cell));
          if (pieces.size() > 1)
            fail(key, "the surface '" + *name + "' is on " + std::to_string(pieces.size()) +
                          " bodies; allowed is one.");
          if (rotor_pieces.count(*pieces.begin()))
            fail(key,
                 "the surface '" + *name +
                     "' is on the rotor, which turns. What slides on it is a pad (Mesh/Contact "
                     "pairs); pieces of the rotor are joined by Joints/Ties.");
          found.push_back(*pieces.begin());
        }
        if (found[0] == found[1])
          fail(key, "'" + contact.first + "' and '" + contact.second +
                        "' are on the same body; allowed are two bodies.");
        joined.insert(found.begin(), found.end());
        if (contact.sticks)
          tied.join(found[0], found[1]);
      }

      /// That of a volume group in which a cell of the piece is; two pieces of one group differ by
      /// a number.
      std::string name_of_piece(const unsigned int cell) const
      {
        std::string name = "part";
        for (const auto &[group, cells] : file.volumes)
          if (std::binary_search(cells.begin(), cells.end(), cell))
            name = group;
        std::string result = name;
        for (unsigned int k = 2; std::count(facts.bodies.begin(), facts.bodies.end(), result) > 0;
             ++k)
          result = name + " " + std::to_string(k);
        return result;
      }

      struct CellFace
      {
        unsigned int cell, face;
      };

      /// The cell of a face that must be on the boundary.
      CellFace boundary_cell(const Face &face, const std::string &name,
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
                        element(cells->second[0].cell) +
                        "; only faces of the boundary are allowed.");
        return cells->second[0];
      }

      /// Boundary ids: one for each combination of supports and load that a face has, and one for
      /// each contact surface.
      void name_faces()
      {
        struct Use
        {
          std::array<bool, 3> fixed{};
          bool is_loaded = false;
          std::string contact; ///< or tied surface
          std::set<unsigned int> points;
          std::set<unsigned int> superelements;
          bool is_exported = false;
          bool operator<(const Use &other) const
          {
            return std::tie(fixed, is_loaded, contact, points, superelements, is_exported) <
                   std::tie(other.fixed, other.is_loaded, other.contact, other.points,
                            other.superelements, other.is_exported);
          }
        };
        std::map<Face, Use> uses;
        const auto add = [&](const std::string &names, const std::string &key, const auto &change)
        {
          for (const std::string &text : list_of(names))
          {
            const auto &[name, surface] = find_group(file.surfaces, text, key, "surface");
            std::string &role           = facts.roles[name];
            role += (role.empty() ? "" : "; ") + key;
            for (const Face &face : surface)
            {
              boundary_cell(face, name, key);
              change(uses[face]);
            }
          }
        };
        const auto fix = [](const std::array<bool, 3> components)
        {
          return [components](Use &use)
          {
            for (unsigned int d = 0; d < 3; ++d)
              use.fixed[d] = use.fixed[d] || components[d];
          };
        };
        add(mesh.clamped, "Clamped", fix({{true, true, true}}));
        add(mesh.guided, "Guided", fix({{true, true, false}}));
        add(mesh.fixed[0], "Fixed in x", fix({{true, false, false}}));
        add(mesh.fixed[1], "Fixed in y", fix({{false, true, false}}));
        add(mesh.fixed[2], "Fixed in z", fix({{false, false, true}}));
        add(mesh.pressure_on, "Pressure on", [](Use &use) { use.is_loaded = true; });
        std::set<std::string> surfaces;
        const auto add_surfaces = [&](const auto &list, const std::string &key)
        {
          for (const auto &[first, second] : list)
            for (const std::string &name : {first, second})
              if (surfaces.insert(name).second)
                add(name, key,
                    [&](Use &use)
                    {
                      if (use.is_loaded || use.fixed != std::array<bool, 3>() ||
                          !use.contact.empty())
                        fail(key, "a face of '" + name +
                                      "' is supported, loaded or in another contact surface or "
                                      "joint too.");
                      use.contact = name;
                    });
        };
        add_surfaces(pairs, "Contact pairs");
        add_surfaces(ties, "Joints/Ties");
        std::vector<std::pair<std::string, std::string>> touching;
        for (const Parameters::Joints::Contact &contact : contacts)
          touching.emplace_back(contact.first, contact.second);
        add_surfaces(touching, "Joints/Contacts");
        const std::vector<Parameters::Joints::Point> points = prm.joints.list_of_points();
        for (unsigned int p = 0; p < points.size(); ++p)
          if (!points[p].surface.empty())
            add(points[p].surface, "Joints/Points",
                [&](Use &use)
                {
                  if (!use.contact.empty())
                    fail("Joints/Points",
                         "a face of '" + points[p].surface + "' is in contact or tied too.");
                  use.points.insert(p);
                });

        const auto elements = prm.joints.list_of_superelements();
        for (unsigned int k = 0; k < elements.size(); ++k)
          for (const std::string &name : elements[k].surfaces)
            add(name, superelements_key,
                [&, k](Use &use)
                {
                  if (!use.contact.empty())
                    fail(superelements_key, "a face of '" + name + "' is in contact or tied too.");
                  use.superelements.insert(k);
                });
        read_superelements();
        const std::vector<std::string> exported = prm.output.superelement.empty()
                                                      ? std::vector<std::string>()
                                                      : prm.output.superelement_of().second;
        for (const std::string &name : exported)
          add(name, exported_key, [](Use &use) { use.is_exported = true; });
        std::set<unsigned int> supported;
        for (const auto &[face, use] : uses)
          if (use.fixed != std::array<bool, 3>())
            supported.insert(face.begin(), face.end());
        for (const auto &[face, use] : uses)
          for (const unsigned int node : face)
            if (use.is_exported && supported.count(node) > 0)
              fail(exported_key, "its surfaces have the node at " + text_of(file.nodes[node]) +
                                     ", which is supported too; a superelement hangs on surfaces "
                                     "that are free to move.");

        add_points();
        std::map<Use, types::boundary_id> ids;
        std::set<types::boundary_id> exported_boundaries;
        for (const auto &[face, use] : uses)
        {
          const auto [id, is_new]    = ids.emplace(use, ids.size() + 1);
          geometry.named_faces[face] = id->second;
          if (!is_new)
            continue;
          if (use.fixed != std::array<bool, 3>())
            geometry.supports.push_back({id->second, use.fixed});
          if (use.is_loaded)
          {
            const auto profile = position_expression<3>(prm.pads.profile, "Pads/Pressure profile");
            const double pressure = prm.pads.pressure;
            geometry.loads.push_back(
                {id->second, [=](const Point<3> &x) { return pressure * profile(x); }});
          }
          if (!use.contact.empty() && !geometry.boundaries.emplace(use.contact, id->second).second)
            fail(exported_key, "its surfaces have some of the faces of '" + use.contact +
                                   "', which is in contact or tied; allowed are all or none.");
          for (const unsigned int k : use.superelements)
            geometry.superelements[k].surface.insert(id->second);
          if (use.is_exported)
            exported_boundaries.insert(id->second);
          for (const unsigned int p : use.points)
            geometry.point_joints.points[p].surface.insert(id->second);
        }
        if (!exported.empty())
          geometry.superelement_out = {exported_body(exported), exported_boundaries};
        for (unsigned int i = 0; i < pairs.size(); ++i)
        {
          const auto &[pad, rotor] = pairs[i];
          for (unsigned int j = 0; j < i; ++j)
            if (pairs[j].first == pad)
              fail("Contact pairs", "'" + pad + "' is in two pairs.");
          geometry.interfaces.push_back({pad, pad_of_pair[i], geometry.boundaries.at(pad),
                                         geometry.boundaries.at(rotor), mesh.contact_tolerance});
        }
      }

      /// The body of which a superelement is to be made, which has all faces of the surfaces.
      Body exported_body(const std::vector<std::string> &surfaces) const
      {
        const std::string name = prm.output.superelement_of().first;
        const auto body = std::find_if(geometry.other_bodies.begin(), geometry.other_bodies.end(),
                                       [&](const auto &other) { return other.second == name; });
        if (body == geometry.other_bodies.end())
        {
          std::string known;
          for (const auto &other : geometry.other_bodies)
            known += (known.empty() ? "" : ", ") + other.second;
          fail(exported_key, "there is no body '" + name +
                                 "' that neither turns nor touches the rotor. Allowed are: " +
                                 (known.empty() ? "none, there are no such bodies" : known) + ".");
        }
        for (const std::string &surface : surfaces)
          for (const Face &face :
               find_group(file.surfaces, surface, exported_key, "surface").second)
            if (geometry.parts[part_of_cell[faces.at(face)[0].cell]].body != body->first)
              fail(exported_key,
                   "the surface '" + surface + "' has faces that are not on '" + name + "'.");
        return body->first;
      }

      /// Superelements, and which of their nodes are held. Their surfaces get ids with the faces.
      void read_superelements()
      {
        for (const auto &entry : prm.joints.list_of_superelements())
        {
          if (entry.name == "points" || entry.name == "contact" || entry.name == "joints" ||
              std::count(facts.bodies.begin(), facts.bodies.end(), entry.name) > 0)
            fail(superelements_key, "there is a body '" + entry.name +
                                        "' already; the superelement needs a name of its own.");
          std::vector<HoldingSurface> surfaces;
          for (const std::string &text : entry.surfaces)
          {
            const std::string &name =
                find_group(file.surfaces, text, superelements_key, "surface").first;
            surfaces.push_back({name, curved_patches(name)});
          }
          superelements.push_back(
              read_superelement(entry, surfaces, prm.joints.position_tolerance));
          geometry.superelements.push_back(superelements.back().element);
          facts.superelements.push_back(superelements.back().report);
        }
      }

      /// Connects superelements with the bodies that hold them; they are bodies from @p first on.
      /// Positions are given to motions as @p scaled.
      template <typename Function>
      void hold_by_superelements(const unsigned int first, const Function &scaled,
                                 RigidMotions &motions) const
      {
        const auto entries = prm.joints.list_of_superelements();
        for (unsigned int k = 0; k < superelements.size(); ++k)
        {
          std::vector<unsigned int> cluster; // that each surface belongs to
          for (const std::string &name : entries[k].surfaces)
          {
            std::set<Body> bodies;
            for (const Face &face :
                 find_group(file.surfaces, name, superelements_key, "surface").second)
              bodies.insert(geometry.parts[part_of_cell[faces.at(face)[0].cell]].body);
            if (bodies.size() > 1)
              fail(superelements_key, "the surface '" + name + "' is on " +
                                          std::to_string(bodies.size()) +
                                          " bodies; allowed is one.");
            const Body body = *bodies.begin();
            if (body == rotor_body && needs_revolution())
              fail(
                  superelements_key,
                  "'" + name +
                      "' is on the rotor, which turns: a superelement would stay where it is. "
                      "Allowed are other bodies, Stage = elastic, Operation/Angular velocity = 0.");
            cluster.push_back(cluster_of_body[body]);
          }
          std::vector<Point<3>> places;
          for (const Point<3> &x : superelements[k].element.nodes)
            places.push_back(scaled(x));
          for (unsigned int n = 0; n < places.size(); ++n)
            if (superelements[k].element.is_held[n])
              for (unsigned int c = 0; c < 3; ++c)
                motions.connect(first + k, places[n], cluster[superelements[k].surface_of_node[n]],
                                places[n], c);
          motions.hold_by(rigid_stiffness(superelements[k].element, places), first + k);
        }
      }

      /// Points, with masses, springs and links. Their surfaces get ids with the faces.
      void add_points()
      {
        PointJoints &joints                         = geometry.point_joints;
        std::map<std::string, unsigned int> numbers = {
            {Parameters::Joints::ground, PointConnection::ground}};
        for (const Parameters::Joints::Point &point : prm.joints.list_of_points())
        {
          numbers[point.name] = joints.points.size();
          joints.points.push_back(
              {point.name, {}, Point<3>(point.place[0], point.place[1], point.place[2]), {}});
        }
        for (const auto &mass : prm.joints.list_of_masses())
          for (unsigned int k = 0; k < 6; ++k)
            joints.points[numbers.at(mass.point)].mass[k] += mass.values[k];
        for (const auto &spring : prm.joints.list_of_springs())
          joints.springs.push_back({numbers.at(spring.first),
                                    numbers.at(spring.second),
                                    spring.values,
                                    {},
                                    spring.axes});
        for (const auto &dashpot : prm.joints.list_of_dashpots())
          joints.springs.push_back({numbers.at(dashpot.first),
                                    numbers.at(dashpot.second),
                                    {},
                                    dashpot.values,
                                    dashpot.axes});
        for (const auto &link : prm.joints.list_of_links())
          joints.links.push_back({numbers.at(link.first), numbers.at(link.second), {}, {}});
      }

      void check_ties()
      {
        std::map<std::string, std::string> firsts;
        for (const auto &[pad, rotor] : pairs)
        {
          firsts[pad]   = "Mesh/Contact pairs";
          firsts[rotor] = "Mesh/Contact pairs";
        }
        for (const auto &[first, second] : ties)
        {
          if (const auto other = firsts.find(first); other != firsts.end())
            fail("Joints/Ties", "'" + first + "' is the first of a tie and in " + other->second +
                                    " too: its faces would be tied twice. A surface can be the "
                                    "second of several ties.");
          firsts[first] = "another joint";
          const JointMeasures tie =
              check_joint("Joints/Ties: " + file.name + ": ", first, curved_patches(first), second,
                          curved_patches(second), prm.joints.position_tolerance);
          facts.joints.push_back(tie);
          geometry.ties.push_back({tie.name, geometry.boundaries.at(first),
                                   geometry.boundaries.at(second), tie.distance});
        }
        for (const auto &[first, second] : ties)
          if (const auto other = firsts.find(second); other != firsts.end())
            fail("Joints/Ties", "'" + second + "' is the second of a tie and in " + other->second +
                                    " too; allowed is a surface that is the second of other ties "
                                    "only.");
      }

      /// Contacts that do not slide: each pressure belongs to one pair of surfaces.
      void check_contacts()
      {
        const std::string key = "Joints/Contacts";
        std::map<std::string, std::string> uses;
        std::map<unsigned int, std::string> at_node; // the surface that has the pressure there
        const auto use = [&](const std::string &name, const std::string &by)
        {
          const auto [other, is_new] = uses.emplace(name, by);
          if (!is_new)
            fail(key, "'" + name + "' is in a contact and in " + other->second + " too.");
        };
        const auto take_nodes = [&](const std::string &name)
        {
          for (const Face &face : file.surfaces.at(name))
            for (const unsigned int node : face)
              if (const auto [other, is_new] = at_node.emplace(node, name);
                  !is_new && other->second != name)
                fail(key,
                     "the surfaces '" + name + "' and '" + other->second +
                         "' share nodes, among them that at " + text_of(file.nodes[node]) +
                         ": two contacts would share a pressure there. One of them must be the "
                         "second of its contact.");
        };
        for (const auto &[pad, rotor] : pairs)
        {
          use(pad, "Mesh/Contact pairs");
          take_nodes(pad);
        }
        for (const auto &[first, second] : ties)
          for (const std::string &name : {first, second})
            uses.emplace(name, "Joints/Ties");
        for (const Parameters::Joints::Contact &contact : contacts)
        {
          use(contact.first, "another contact");
          use(contact.second, "another contact");
          take_nodes(contact.first);
          const auto first = curved_patches(contact.first), second = curved_patches(contact.second);
          JointMeasures measures =
              check_joint(key + ": " + file.name + ": ", contact.first, first, contact.second,
                          second, prm.joints.position_tolerance);
          measures.kind = contact.sticks ? "Stick contact" : "Frictionless contact";
          facts.joints.push_back(measures);
          const Body body =
              geometry.parts[part_of_cell[faces.at(file.surfaces.at(contact.first)[0])[0].cell]]
                  .body;
          geometry.interfaces.push_back(
              {measures.name, body, geometry.boundaries.at(contact.first),
               geometry.boundaries.at(contact.second), measures.distance,
               contact.sticks ? ContactKind::stick : ContactKind::frictionless,
               tangential_axis(first, second), contact.friction});
        }
      }

      /// The coordinate axis that is furthest from all normals: on a cylinder about an axis, that.
      Tensor<1, 3> tangential_axis(const std::vector<SurfaceFace<3>> &first,
                                   const std::vector<SurfaceFace<3>> &second) const
      {
        const FaceElement<3> element(2);
        std::array<double, 3> nearest{};
        for (const auto *patches : {&first, &second})
          for (const SurfaceFace<3> &face : *patches)
            for (const Point<2> &xi : {Point<2>(0, 0), Point<2>(1, 0), Point<2>(0, 1),
                                       Point<2>(1, 1), Point<2>(0.5, 0.5)})
              for (unsigned int d = 0; d < 3; ++d)
                nearest[d] = std::max(nearest[d], std::abs(element.frame(face, xi).normal[d]));
        Tensor<1, 3> axis;
        axis[std::min_element(nearest.begin(), nearest.end()) - nearest.begin()] = 1;
        return axis;
      }

      /// A face as a surface patch whose normal points out of its cell.
      SurfaceFace<3> patch(const Face &face) const
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

      /// Patches of degree 2, which follow circles about the axis where their body does.
      std::vector<SurfaceFace<3>> curved_patches(const std::string &name) const
      {
        std::vector<SurfaceFace<3>> result;
        for (const Face &face : file.surfaces.at(name))
        {
          const SurfaceFace<3> flat = patch(face);
          const bool is_curved      = geometry.parts[part_of_cell[faces.at(face)[0].cell]].curved;
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
          curved.orientation                 = flat.orientation;
          const std::array<Point<3>, 4> ends = {
              {flat.nodes[0], flat.nodes[1], flat.nodes[2], flat.nodes[3]}};
          if (const auto centre = file.quadratic.faces.find(face);
              centre != file.quadratic.faces.end())
          {
            curved.nodes = quadratic_patch(face, centre->second);
            result.push_back(curved);
            continue;
          }
          const Point<3> left = between(ends[0], ends[2]), right = between(ends[1], ends[3]);
          for (const auto &[a, b] :
               {std::make_pair(ends[0], ends[1]), {left, right}, {ends[2], ends[3]}})
            for (const Point<3> &x : {a, between(a, b), b})
              curved.nodes.push_back(x);
          result.push_back(curved);
        }
        return result;
      }

      /// The nine points of a face whose edges have middle nodes.
      std::vector<Point<3>> quadratic_patch(const Face &face, const Point<3> &centre) const
      {
        const CellFace at = faces.at(face)[0];
        std::array<unsigned int, 4> nodes; // as in patch()
        for (unsigned int v = 0; v < 4; ++v)
          nodes[v] =
              file.cells[at.cell].nodes[MeshFile::cell_faces[at.face][lexicographic_corners[v]]];
        const auto between = [&](const unsigned int a, const unsigned int b) {
          return file.quadratic.edges.at({{std::min(nodes[a], nodes[b]),
                                           std::max(nodes[a], nodes[b])}});
        };
        const auto corner = [&](const unsigned int v) { return file.nodes[nodes[v]]; };
        return {corner(0),     between(0, 1), corner(1), between(0, 2), centre,
                between(1, 3), corner(2),     between(2, 3), corner(3)};
      }

      std::vector<SurfaceFace<3>> patches(const std::string &name) const
      {
        std::vector<SurfaceFace<3>> result;
        for (const Face &face : file.surfaces.at(name))
          result.push_back(patch(face));
        return result;
      }

      void check_pairs()
      {
        for (const auto &of_pad : prm.contact.friction_by_pad())
          if (std::none_of(pairs.begin(), pairs.end(),
                           [&](const auto &pair) { return pair.first == of_pad.first; }))
            fail("Contact/Friction/Of pads",
                 "there is no pad '" + of_pad.first + "' written like that.");
        for (const auto &[pad, rotor] : pairs)
          check_plane(pad);
          check_plane(rotor);
          facts.pairs.push_back(check_contact_pair("Mesh/Contact pairs: " + file.name + ": ", pad,
                                                   patches(pad), rotor, patches(rotor),
                                                   mesh.contact_tolerance));
      }

      /// Middle nodes must not bend a contact surface; corners are checked with the pair.
      void check_plane(const std::string &name) const
      {
        Box box;
        for (const Face &face : file.surfaces.at(name))
          for (const unsigned int node : face)
            box.add(file.nodes[node]);
        const double allowed = 1e-4 * box.low.distance(box.high);
        for (const Face &face : file.surfaces.at(name))
          if (const auto centre = file.quadratic.faces.find(face);
              centre != file.quadratic.faces.end())
            for (const Point<3> &x : quadratic_patch(face, centre->second))
              if (x[2] < box.low[2] - allowed || x[2] > box.high[2] + allowed)
                fail("Contact pairs", "a middle node bends '" + name + "' at " + text_of(x) +
                                          "; contact surfaces must be plane, across the axis z.");
      }

      bool needs_revolution() const
      {
        const std::string speed = "Operation/Angular velocity";
        return prm.terms().transport &&
               (prm.operation.angular_velocity != 0 || prm.sweep.parameter == speed ||
                prm.sweep.second_parameter == speed);
      }

      /// The transport field must be tangential on the rotor's surface, and on surfaces between its
      /// materials.
      void check_revolution() const
      {
        const std::string ways =
            " With transport the rotor must be a body of revolution about z. Else it needs "
            "Rotor/Transport = none, which neglects transport, Stage = elastic or "
            "Operation/Angular velocity = 0.";
        if (mesh.curved == CurvedBodies::none)
          fail("Curved bodies",
               "with straight edges the rotor is not a body of revolution." + ways);
        for (const auto &[face, cells] : faces)
        {
          const unsigned int material = material_of_cell[cells[0].cell];
          if (!of_rotor[material] ||
              (cells.size() == 2 && material_of_cell[cells[1].cell] == material))
            continue;
          std::array<Point<3>, 4> corners;
          for (unsigned int v = 0; v < 4; ++v)
            corners[v] = file.nodes[face[v]];
          const double distance = distance_from_revolution(corners),
                       size     = std::max(corners[0].distance(corners[1]),
                                           corners[0].distance(corners[2]));
          if (distance > revolution_tolerance * size)
          {
            std::ostringstream message;
            message << "a face of the rotor at " << element(cells[0].cell) << " is " << distance
                    << " m off every surface of revolution about z (holes, vanes, an axis that "
                       "Axis and Origin do not name).";
            fail("Rotor", message.str() + ways);
          }
        }
      }

      /// The mean place of a surface, and the body that has it.
      std::pair<Point<3>, Body> place_of(const std::string &surface) const
      {
        const auto &faces_of_surface =
            find_group(file.surfaces, surface, "Joints/Points", "surface").second;
        Point<3> sum;
        double area = 0;
        for (const Face &face : faces_of_surface)
        {
          std::array<Point<3>, 4> corners;
          Point<3> centre;
          for (unsigned int v = 0; v < 4; ++v)
          {
            corners[v] = file.nodes[face[v]];
            centre += corners[v] / 4.;
          }
          sum += area_of(corners) * centre;
          area += area_of(corners);
        }
        const unsigned int cell = faces.at(faces_of_surface.front())[0].cell;
        return {sum / area, geometry.parts[part_of_cell[cell]].body};
      }

      /// Whether supports, contact and joints hold every body. A pad's contact face is held along
      /// z.
      void check_supports()
      {
        // Bodies that are tied are one; then come the points in space.
        const PointJoints &joints             = geometry.point_joints;
        const unsigned int n_bodies           = facts.bodies.size();
        const unsigned int first_superelement = n_bodies + joints.points.size();
        RigidMotions motions(first_superelement + superelements.size());
        Box box;
        for (const Point<3> &x : file.nodes)
          box.add(x);
        const double size = box.low.distance(box.high);
        const auto scaled = [&](const Point<3> &x) { return Point<3>((x - box.low) / size); };
        for (const auto &[face, id] : geometry.named_faces)
        {
          const unsigned int part = part_of_cell[faces.at(face)[0].cell];
          std::array<bool, 3> fixed{};
          for (const Support<3> &support : geometry.supports)
            if (support.boundary == id)
              fixed = support.fixed;
          for (const ContactInterface &interface : geometry.interfaces)
            fixed[2] = fixed[2] || (interface.slides() && interface.pad_face == id);
          for (const unsigned int node : face)
            for (unsigned int c = 0; c < 3; ++c)
              if (fixed[c])
                motions.hold(scaled(file.nodes[node]), c,
                             cluster_of_body[geometry.parts[part].body]);
        }
        const FaceElement<3> flat(1);
        const auto cluster = [&](const Face &face)
        {
          const CellFace at = faces.at(face)[0];
          return cluster_of_body[geometry.parts[part_of_cell[at.cell]].body];
        };
        for (const Parameters::Joints::Contact &contact : contacts)
          for (const Face &face : file.surfaces.at(contact.first))
          {
            const Tensor<1, 3> normal = flat.frame(patch(face), Point<2>(0.5, 0.5)).normal;
            for (const unsigned int node : face)
              motions.connect(cluster(face), scaled(file.nodes[node]),
                              cluster(file.surfaces.at(contact.second)[0]),
                              scaled(file.nodes[node]), {{normal[0], normal[1], normal[2]}}, false);
          }
        std::vector<std::pair<Point<3>, unsigned int>> place_and_body;
        const std::vector<Parameters::Joints::Point> points = prm.joints.list_of_points();
        for (unsigned int p = 0; p < points.size(); ++p)
          if (points[p].surface.empty())
          {
            facts.points.push_back("'" + points[p].name + "' at " +
                                   text_of(joints.points[p].place) + ", in space");
            place_and_body.emplace_back(scaled(joints.points[p].place), n_bodies + p);
          }
          else
          {
            const auto [place, body] = place_of(points[p].surface);
            if (body == rotor_body && needs_revolution())
              fail("Joints/Points", "'" + points[p].surface +
                                        "' is on the rotor, which turns: a point would stay where "
                                        "it is while the rotor turns under it. Allowed are other "
                                        "bodies, Stage = elastic, Operation/Angular velocity = 0.");
            place_and_body.emplace_back(scaled(place), cluster_of_body[body]);
            facts.points.push_back("'" + points[p].name + "' at " + text_of(place) +
                                   ", the mean motion of '" + points[p].surface + "' of " +
                                   facts.bodies[body]);
          }
        const auto connect = [&](const PointConnection &connection, const unsigned int c)
        {
          const auto &[x, a] = place_and_body[connection.first];
          if (connection.second == PointConnection::ground)
            motions.connect(a, x, RigidMotions::ground, x, connection.axes[c % 3], c >= 3);
          else
            motions.connect(a, x, place_and_body[connection.second].second,
                            place_and_body[connection.second].first, connection.axes[c % 3],
                            c >= 3);
        };
        for (const PointConnection &spring : joints.springs)
          for (unsigned int c = 0; c < 6; ++c)
            if (spring.stiffness[c] > 0)
              connect(spring, c);
        for (const PointConnection &link : joints.links)
          for (unsigned int c = 0; c < 6; ++c)
          {
            // The second moves as if it were part of the first: at one place.
            const auto &[x, a] = place_and_body[link.first];
            motions.connect(a, x,
                            link.second == PointConnection::ground
                                ? RigidMotions::ground
                                : place_and_body[link.second].second,
                            x, c);
          }
        hold_by_superelements(first_superelement, scaled, motions);
        const std::vector<unsigned int> n_free = motions.n_free();
        for (unsigned int body = 0; body < n_bodies; ++body)
        {
          if (n_free[body] == 0 || cluster_of_body[body] != body)
            continue;
          geometry.may_move_rigidly = true;
          const auto n_tied =
              std::count(cluster_of_body.begin(), cluster_of_body.end(), Body(body));
          if (prm.has_contact() && prm.contact.steady_pressure == SteadyPressure::computed)
            fail("Clamped", "the body '" + facts.bodies[body] + "'" +
                                (n_tied > 1 ? " with those that are tied to it" : "") +
                                " can move rigidly in " + std::to_string(n_free[body]) + " ways (" +
                                motions.describe(body) +
                                "), so that there is no static equilibrium. It needs supports "
                                "(Clamped, Guided, Fixed in x, y, z), joints, or Contact/Steady "
                                "pressure = uniform.");
        }
        for (unsigned int k = 0; k < superelements.size(); ++k)
          if (const unsigned int body = first_superelement + k; n_free[body] > 0)
          {
            geometry.may_move_rigidly = true;
            if (prm.n_pads() > 0 && prm.contact.steady_pressure == SteadyPressure::computed)
              fail(superelements_key,
                   "the superelement '" + superelements[k].element.name + "' can move freely (" +
                       motions.describe(body) +
                       "), so that there is no static equilibrium. It needs surfaces that are "
                       "held, or a stiffness that holds it.");
          }
        for (unsigned int p = 0; p < points.size(); ++p)
          if (const auto &mass = joints.points[p].mass;
              points[p].surface.empty() && n_free[n_bodies + p] > 0)
          {
            geometry.may_move_rigidly = true;
            if (prm.has_contact() && prm.contact.steady_pressure == SteadyPressure::computed)
              fail("Joints/Points", "the point '" + points[p].name + "' can move freely (" +
                                        motions.describe(n_bodies + p) +
                                        "), so that there is no static equilibrium. It needs "
                                        "springs or rigid links.");
            if (*std::min_element(mass.begin(), mass.end()) == 0)
              fail("Joints/Points", "the point '" + points[p].name + "' can move freely (" +
                                        motions.describe(n_bodies + p) +
                                        ") and has no mass or no moment of inertia there.");
          }
      }

      void add_cells()
      {
        // Nodes that no cell has are left out; named faces follow.
        std::vector<unsigned int> number(file.nodes.size(), -1);
        for (unsigned int c = 0; c < file.cells.size(); ++c)
        {
          CellData<3> cell;
          cell.material_id = part_of_cell[c];
          for (unsigned int v = 0; v < 8; ++v)
          {
            const unsigned int node = file.cells[c].nodes[lexicographic_corners[v]];
            if (number[node] == numbers::invalid_unsigned_int)
            {
              number[node] = geometry.vertices.size();
              geometry.vertices.push_back(file.nodes[node]);
            }
            cell.vertices[v] = number[node];
          }
          geometry.cells.push_back(cell);
        }
        std::map<Face, types::boundary_id> renumbered;
        const auto renumber = [&](Face face)
        {
          for (unsigned int &node : face)
            node = number[node];
          std::sort(face.begin(), face.end());
          return face;
        };
        for (const auto &[face, id] : geometry.named_faces)
          renumbered[renumber(face)] = id;
        geometry.named_faces = std::move(renumbered);
        geometry.quadratic   = file.quadratic.renumbered(number);
        for (auto &[name, surface] : file.surfaces)
          for (Face &face : surface)
            face = renumber(face);
        try
        {
          GridTools::consistently_order_cells(geometry.cells);
        }
        catch (const ExceptionBase &)
        {
          fail("File", "the cells' edges cannot be directed consistently: rows of cells close in "
                       "a twisted ring.");
        }
      }

      /// A uniform contact pressure is that of the load only where both act on the same area.
      void check_uniform_pressure() const
      {
        if (prm.contact.steady_pressure != SteadyPressure::uniform || facts.pairs.empty())
          return;
        double contact = 0, loaded = 0;
        for (const ContactPairMeasures &pair : facts.pairs)
          contact += pair.pad_area;
        for (const auto &[face, id] : geometry.named_faces)
          for (const PressureLoad<3> &load : geometry.loads)
            if (load.boundary == id)
            {
              std::array<Point<3>, 4> corners;
              for (unsigned int v = 0; v < 4; ++v)
                corners[v] = geometry.vertices[face[v]];
              loaded += area_of(corners);
            }
        if (std::abs(loaded - contact) > 0.02 * contact)
        {
          std::ostringstream message;
          message << "Contact/Steady pressure = uniform: the pressure acts on " << loaded
                  << " m^2, the pads' contact surfaces have " << contact
                  << " m^2, so that it is not the contact pressure; allowed is computed.";
          throw InputError(message.str());
        }
      }

      const Parameters::All &prm;
      const Parameters::Mesh &mesh;
      MeshFile file;
      MeshFacts facts;
      Geometry<3> geometry;
      std::vector<std::pair<std::string, std::string>> pairs, ties;
      std::vector<Parameters::Joints::Contact> contacts; ///< that do not slide
      std::vector<PlacedSuperelement> superelements;
      std::vector<Body> pad_of_pair;
      std::vector<Body> cluster_of_body; ///< one of the bodies that are tied to it
      std::vector<bool> of_rotor;        ///< by material
      std::vector<unsigned int> material_of_cell, part_of_cell;
      std::map<Face, std::vector<CellFace>> faces;
    };
  } // namespace

  Geometry<3> make_mesh_scene(const Parameters::All &parameters)
  {
    return ImportedScene(parameters).make();
  }
} // namespace squeal
