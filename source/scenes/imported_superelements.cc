#include <squeal/scenes/imported_superelements.h>

#include <algorithm>
#include <set>

namespace squeal
{
  using namespace dealii;

  ImportedSuperelements::ImportedSuperelements(const Parameters::All &prm, const ImportedMesh &mesh,
                                               const ImportedBodies &bodies)
      : prm(prm), mesh(mesh), bodies(bodies)
  {
    for (const auto &entry : prm.joints.list_of_superelements())
    {
      if (entry.name == "points" || entry.name == "contact" || entry.name == "joints" ||
          std::count(bodies.names.begin(), bodies.names.end(), entry.name) > 0)
        mesh.fail(superelements_key, "there is a body '" + entry.name +
                                         "' already; the superelement needs a name of its own.");
      std::vector<HoldingSurface> surfaces;
      for (const std::string &text : entry.surfaces)
      {
        const std::string &name = mesh.surface(text, superelements_key).first;
        surfaces.push_back({name, bodies.curved_patches(name)});
      }
      placed.push_back(read_superelement(entry, surfaces, prm.joints.position_tolerance));
    }
  }

  void ImportedSuperelements::hold(const unsigned int first,
                                   const std::function<Point<3>(const Point<3> &)> &scaled,
                                   RigidMotions &motions) const
  {
    const auto entries = prm.joints.list_of_superelements();
    for (unsigned int k = 0; k < placed.size(); ++k)
    {
      std::vector<unsigned int> cluster; // that each surface belongs to
      for (const std::string &name : entries[k].surfaces)
      {
        std::set<Body> holders;
        for (const ImportedMesh::Face &face : mesh.surface(name, superelements_key).second)
          holders.insert(bodies.of(face));
        if (holders.size() > 1)
          mesh.fail(superelements_key, "the surface '" + name + "' is on " +
                                           std::to_string(holders.size()) +
                                           " bodies; allowed is one.");
        const Body body = *holders.begin();
        if (body == rotor_body && needs_revolution(prm))
          mesh.fail(
              superelements_key,
              "'" + name +
                  "' is on the rotor, which turns: a superelement would stay where it is. "
                  "Allowed are other bodies, Stage = elastic, Operation/Angular velocity = 0.");
        cluster.push_back(bodies.cluster[body]);
      }
      std::vector<Point<3>> places;
      for (const Point<3> &x : placed[k].element.nodes)
        places.push_back(scaled(x));
      for (unsigned int n = 0; n < places.size(); ++n)
        if (placed[k].element.is_held[n])
          for (unsigned int c = 0; c < 3; ++c)
            motions.connect(first + k, places[n], cluster[placed[k].surface_of_node[n]], places[n],
                            c);
      motions.hold_by(rigid_stiffness(placed[k].element, places), first + k);
    }
  }

  Body exported_body(const Parameters::All &prm, const ImportedMesh &mesh,
                     const ImportedBodies &bodies)
  {
    const auto [name, surfaces] = prm.output.superelement_of();
    const auto body =
        std::find_if(bodies.others.begin(), bodies.others.end(),
                     [wanted = name](const auto &other) { return other.second == wanted; });
    if (body == bodies.others.end())
    {
      std::string known;
      for (const auto &other : bodies.others)
        known += (known.empty() ? "" : ", ") + other.second;
      mesh.fail(exported_key, "there is no body '" + name +
                                  "' that neither turns nor touches the rotor. Allowed are: " +
                                  (known.empty() ? "none, there are no such bodies" : known) + ".");
    }
    for (const std::string &surface : surfaces)
      for (const ImportedMesh::Face &face : mesh.surface(surface, exported_key).second)
        if (bodies.of(face) != body->first)
          mesh.fail(exported_key,
                    "the surface '" + surface + "' has faces that are not on '" + name + "'.");
    return body->first;
  }
} // namespace squeal
