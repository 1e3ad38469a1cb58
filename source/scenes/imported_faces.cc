#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/parameters/expressions.h>
#include <squeal/scenes/imported_faces.h>
#include <squeal/scenes/imported_superelements.h>

#include <algorithm>
#include <functional>
#include <set>
#include <tuple>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// What a face of the boundary is used for.
    struct Use
    {
      std::array<bool, 3> fixed{};
      bool is_loaded = false;
      std::set<unsigned int> pressures; ///< entries of Mesh/Pressures
      std::string contact;              ///< or tied surface
      std::set<unsigned int> points;
      std::set<unsigned int> superelements;
      std::set<std::string> places; ///< of the frequency response
      bool is_exported = false;
      bool operator<(const Use &other) const
      {
        return std::tie(fixed, is_loaded, pressures, contact, points, superelements, places,
                        is_exported) < std::tie(other.fixed, other.is_loaded, other.pressures,
                                                other.contact, other.points, other.superelements,
                                                other.places, other.is_exported);
      }
    };

    /// Collects the uses of faces, then gives each combination of them a boundary id.
    class FaceUses
    {
    public:
      FaceUses(const Parameters::All &prm, ImportedMesh &mesh, const ImportedBodies &bodies)
          : prm(prm), mesh(mesh), bodies(bodies)
      {
        add_supports_and_loads();
        add_joined_surfaces();
        add_points();
        add_superelements();
        add_places();
        add_exported();
      }

      void name(Geometry<3> &geometry) const
      {
        std::map<Use, types::boundary_id> ids;
        std::set<types::boundary_id> exported;
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
            const double pressure = pressure_of_loads(prm.pads.pressure);
            geometry.loads.push_back(
                {id->second, [=](const Point<3> &x) { return pressure * profile(x); }});
          }
          for (const unsigned int k : use.pressures)
            geometry.loads.push_back({id->second, [](const Point<3> &) { return 1.; }, k});
          if (!use.contact.empty() && !geometry.boundaries.emplace(use.contact, id->second).second)
            mesh.fail(exported_key, "its surfaces have some of the faces of '" + use.contact +
                                        "', which is in contact or tied; allowed are all or none.");
          for (const unsigned int k : use.superelements)
            geometry.superelements[k].surface.insert(id->second);
          for (const std::string &name : use.places)
            geometry.response_surfaces[name].insert(id->second);
          if (use.is_exported)
            exported.insert(id->second);
          for (const unsigned int p : use.points)
            geometry.point_joints.points[p].surface.insert(id->second);
        }

        if (!prm.output.superelement.empty())
          geometry.superelement_out = {exported_body(prm, mesh, bodies), exported};
      }

    private:
      /// Changes the uses of all faces of some surfaces.
      void add(const std::string &names, const std::string &key,
               const std::function<void(Use &)> &change)
      {
        for (const std::string &text : names_of(names))
        {
          const auto &[name, surface] = mesh.surface(text, key);
          std::string &role           = mesh.roles[name];
          role += (role.empty() ? "" : "; ") + key;
          for (const ImportedMesh::Face &face : surface)
          {
            mesh.boundary_cell(face, name, key);
            change(uses[face]);
          }
        }
      }

      void fix(const std::string &names, const std::string &key,
               const std::array<bool, 3> &components)
      {
        add(names, key,
            [&](Use &use)
            {
              for (unsigned int d = 0; d < 3; ++d)
                use.fixed[d] = use.fixed[d] || components[d];
            });
      }

      /// Changes the uses of all faces of a surface, which must not be in contact or tied.
      void add_free(const std::string &surface, const std::string &key,
                    const std::function<void(Use &)> &change)
      {
        add(surface, key,
            [&](Use &use)
            {
              if (!use.contact.empty())
                mesh.fail(key, "a face of '" + surface + "' is in contact or tied too.");
              change(use);
            });
      }

      void add_supports_and_loads()
      {
        fix(prm.mesh.clamped, "Clamped", {{true, true, true}});
        fix(prm.mesh.guided, "Guided", {{true, true, false}});
        fix(prm.mesh.fixed[0], "Fixed in x", {{true, false, false}});
        fix(prm.mesh.fixed[1], "Fixed in y", {{false, true, false}});
        fix(prm.mesh.fixed[2], "Fixed in z", {{false, false, true}});
        add(prm.mesh.pressure_on, "Pressure on", [](Use &use) { use.is_loaded = true; });
        for (unsigned int k = 0; k < prm.mesh.surface_pressures.size(); ++k)
          add(prm.mesh.surface_pressures[k].first, "Pressures",
              [&](Use &use) { use.pressures.insert(k); });
      }

      /// A rotor's surface is as large as the disc, which may be held where no pad lies: faces that
      /// are supported are no contact surface. That pads lie on the rest is checked with the pair.
      void give_up_supported_faces(const std::string &name)
      {
        std::vector<ImportedMesh::Face> &faces = mesh.file.surfaces.at(name), left;
        for (const ImportedMesh::Face &face : faces)
          if (const auto use = uses.find(face);
              use == uses.end() || use->second.fixed == std::array<bool, 3>())
            left.push_back(face);
        if (!left.empty())
          faces = std::move(left);
      }

      /// Surfaces of contact pairs and joints carry nothing else.
      void add_joined_surfaces()
      {
        std::set<std::string> surfaces;
        const auto add_surfaces = [&](const auto &list, const std::string &key)
        {
          for (const auto &[first, second] : list)
            for (const std::string &name : {first, second})
              if (surfaces.insert(name).second)
                add(name, key,
                    [&](Use &use)
                    {
                      if (use.is_loaded || !use.pressures.empty() ||
                          use.fixed != std::array<bool, 3>() || !use.contact.empty())
                        mesh.fail(key,
                                  "a face of '" + name +
                                      "' is supported, loaded or in another contact surface or "
                                      "joint too.");
                      use.contact = name;
                    });
        };
        for (const auto &pair : bodies.pairs)
          give_up_supported_faces(pair.second);
        add_surfaces(bodies.pairs, "Contact pairs");
        add_surfaces(bodies.pieces.ties, "Joints/Ties");
        std::vector<std::pair<std::string, std::string>> touching;
        for (const Parameters::Joints::Contact &contact : bodies.pieces.contacts)
          touching.emplace_back(contact.first, contact.second);
        add_surfaces(touching, "Joints/Contacts");
      }

      void add_points()
      {
        const std::vector<Parameters::Joints::Point> points = prm.joints.list_of_points();
        for (unsigned int p = 0; p < points.size(); ++p)
          if (!points[p].surface.empty())
            add_free(points[p].surface, "Joints/Points", [&](Use &use) { use.points.insert(p); });
      }

      void add_superelements()
      {
        const auto elements = prm.joints.list_of_superelements();
        for (unsigned int k = 0; k < elements.size(); ++k)
          for (const std::string &name : elements[k].surfaces)
            add_free(name, superelements_key, [&](Use &use) { use.superelements.insert(k); });
      }

      /// Surfaces at which forces act or motions are observed: names that are no points'.
      void add_places()
      {
        std::set<std::string> names;
        for (const auto &[key, places] :
             {std::make_pair("Response/Forces", prm.response.list_of_forces(3)),
              std::make_pair("Response/Observations", prm.response.list_of_observations(3))})
          for (const Parameters::Response::Place &place : places)
            if (place.point.empty() && !prm.joints.has_point(place.name) &&
                names.insert(place.name).second)
              add_free(place.name, key, [&](Use &use) { use.places.insert(place.name); });
      }

      /// Surfaces of the superelement that is to be made, on whose nodes no support may be.
      void add_exported()
      {
        if (prm.output.superelement.empty())
          return;
        for (const std::string &name : prm.output.superelement_of().second)
          add(name, exported_key, [](Use &use) { use.is_exported = true; });
        std::set<unsigned int> supported;
        for (const auto &[face, use] : uses)
          if (use.fixed != std::array<bool, 3>())
            supported.insert(face.begin(), face.end());
        for (const auto &[face, use] : uses)
          for (const unsigned int node : face)
            if (use.is_exported && supported.count(node) > 0)
              mesh.fail(exported_key,
                        "its surfaces have the node at " + text_of(mesh.file.nodes[node]) +
                            ", which is supported too; a superelement hangs on surfaces "
                            "that are free to move.");
      }

      const Parameters::All &prm;
      ImportedMesh &mesh;
      const ImportedBodies &bodies;
      std::map<ImportedMesh::Face, Use> uses;
    };
  } // namespace

  void name_faces(const Parameters::All &prm, ImportedMesh &mesh, const ImportedBodies &bodies,
                  Geometry<3> &geometry)
  {
    FaceUses(prm, mesh, bodies).name(geometry);
    for (unsigned int i = 0; i < bodies.pairs.size(); ++i)
    {
      const auto &[pad, rotor] = bodies.pairs[i];
      for (unsigned int j = 0; j < i; ++j)
        if (bodies.pairs[j].first == pad)
          mesh.fail("Contact pairs", "'" + pad + "' is in two pairs.");
      geometry.interfaces.push_back({pad, bodies.pad_of_pair[i], geometry.boundaries.at(pad),
                                     geometry.boundaries.at(rotor), prm.mesh.contact_tolerance});
    }
  }
} // namespace squeal
