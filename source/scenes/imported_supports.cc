#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/mesh_files/rigid_motions.h>
#include <squeal/scenes/free_motions.h>
#include <squeal/scenes/imported_supports.h>

#include <algorithm>
#include <cmath>

// What holds the bodies of a mesh file: points with their masses, springs and links (add_points()),
// and which rigid motions supports, contact and joints leave (SupportCheck). With the pads' contact
// nothing may move; without it what is left are the free motions of worn pads.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// The mean place of a surface, and the body that has it.
    std::pair<Point<3>, Body> place_of(const ImportedMesh &mesh, const ImportedBodies &bodies,
                                       const std::string &surface)
    {
      const auto &faces_of_surface = mesh.surface(surface, "Joints/Points").second;
      Point<3> sum;
      double area = 0;
      for (const ImportedMesh::Face &face : faces_of_surface)
      {
        std::array<Point<3>, 4> corners;
        Point<3> centre;
        for (unsigned int v = 0; v < 4; ++v)
        {
          corners[v] = mesh.file.nodes[face[v]];
          centre += corners[v] / 4.;
        }
        sum += area_of(corners) * centre;
        area += area_of(corners);
      }
      return {sum / area, bodies.of(faces_of_surface.front())};
    }

    /// Which rigid motions supports, contact and joints leave: bodies that are tied are one; then
    /// come the points in space, then superelements. Positions are in units of the bodies' size.
    class SupportCheck
    {
    public:
      /// With @p pads_touch the contact holds the pads, else nothing does but supports and joints.
      SupportCheck(const Parameters::All &prm, const ImportedMesh &mesh,
                   const ImportedBodies &bodies, const ImportedSuperelements &superelements,
                   const bool pads_touch, Geometry<3> &geometry)
          : prm(prm), mesh(mesh), bodies(bodies), superelements(superelements.placed),
            geometry(geometry), joints(geometry.point_joints), n_bodies(bodies.names.size()),
            first_superelement(n_bodies + joints.points.size()),
            motions(first_superelement + superelements.placed.size())
      {
        for (const Point<3> &x : mesh.file.nodes)
          box.add(x);
        hold_by_supports(pads_touch);
        hold_by_contacts();
        place_points();
        hold_by_connections();
        superelements.hold(
            first_superelement, [&](const Point<3> &x) { return scaled(x); }, motions);
      }

      /// Notes in the geometry whether anything can move rigidly; throws where that cannot be.
      void check()
      {
        n_free = motions.n_free();
        check_bodies();
        check_superelements();
        check_points();
      }

      /// The motions that are left while the rotor rests, by body.
      std::vector<std::map<Body, RigidMotion<3>>> motions_beside_rotor()
      {
        const auto hold = [&](const unsigned int body)
        {
          for (unsigned int c = 0; c < 6; ++c)
            motions.connect(body, Point<3>(), RigidMotions::ground, Point<3>(), c);
        };
        hold(bodies.cluster[rotor_body]);
        // Numbers that have no motion of their own
        for (unsigned int body = 0; body < n_bodies; ++body)
          if (bodies.cluster[body] != body)
            hold(body);
        const std::vector<Parameters::Joints::Point> points = prm.joints.list_of_points();
        for (unsigned int p = 0; p < points.size(); ++p)
          if (!points[p].surface.empty())
            hold(n_bodies + p);
        const double size = box.low.distance(box.high);
        std::vector<std::map<Body, RigidMotion<3>>> result;
        for (const std::vector<double> &left : motions.basis())
        {
          result.emplace_back();
          for (unsigned int body = 0; body < n_bodies; ++body)
          {
            // t + o x (x - low)/size
            const double *const numbers = &left[6 * bodies.cluster[body]];
            if (std::all_of(numbers, numbers + 6,
                            [](const double x) { return std::abs(x) < 1e-12; }))
              continue;
            RigidMotion<3> motion;
            for (unsigned int d = 0; d < 3; ++d)
            {
              motion.translation[d] = numbers[d];
              motion.rotation[d]    = numbers[3 + d] / size;
            }
            motion.translation -= cross_product_3d(motion.rotation, Tensor<1, 3>(box.low));
            result.back()[Body(body)] = motion;
          }
        }
        return result;
      }

      std::vector<std::string> lines; ///< about points

    private:
      Point<3> scaled(const Point<3> &x) const
      {
        return Point<3>((x - box.low) / box.low.distance(box.high));
      }

      unsigned int cluster_of(const ImportedMesh::Face &face) const
      {
        return bodies.cluster[bodies.of(face)];
      }

      /// A pad's contact face that touches is held along z.
      void hold_by_supports(const bool pads_touch)
      {
        for (const auto &[face, id] : geometry.named_faces)
        {
          std::array<bool, 3> fixed{};
          for (const Support<3> &support : geometry.supports)
            if (support.boundary == id)
              fixed = support.fixed;
          for (const ContactInterface &interface : geometry.interfaces)
            fixed[2] = fixed[2] || (pads_touch && interface.slides() && interface.pad_face == id);
          for (const unsigned int node : face)
            for (unsigned int c = 0; c < 3; ++c)
              if (fixed[c])
                motions.hold(scaled(mesh.file.nodes[node]), c, cluster_of(face));
        }
      }

      void hold_by_contacts()
      {
        const FaceElement<3> flat(1);
        for (const Parameters::Joints::Contact &contact : bodies.pieces.contacts)
          for (const ImportedMesh::Face &face : mesh.file.surfaces.at(contact.first))
          {
            const Tensor<1, 3> normal = flat.frame(mesh.patch(face), Point<2>(0.5, 0.5)).normal;
            for (const unsigned int node : face)
              motions.connect(cluster_of(face), scaled(mesh.file.nodes[node]),
                              cluster_of(mesh.file.surfaces.at(contact.second)[0]),
                              scaled(mesh.file.nodes[node]), {{normal[0], normal[1], normal[2]}},
                              false);
          }
      }

      void place_points()
      {
        const std::vector<Parameters::Joints::Point> points = prm.joints.list_of_points();
        for (unsigned int p = 0; p < points.size(); ++p)
          if (points[p].surface.empty())
          {
            lines.push_back("'" + points[p].name + "' at " + text_of(joints.points[p].place) +
                            ", in space");
            place_and_body.emplace_back(scaled(joints.points[p].place), n_bodies + p);
          }
          else
          {
            const auto [place, body] = place_of(mesh, bodies, points[p].surface);
            if (body == rotor_body && needs_revolution(prm))
              mesh.fail("Joints/Points",
                        "'" + points[p].surface +
                            "' is on the rotor, which turns: a point would stay where "
                            "it is while the rotor turns under it. Allowed are other "
                            "bodies, Stage = elastic, Operation/Angular velocity = 0.");
            place_and_body.emplace_back(scaled(place), bodies.cluster[body]);
            lines.push_back("'" + points[p].name + "' at " + text_of(place) +
                            ", the mean motion of '" + points[p].surface + "' of " +
                            bodies.names[body]);
          }
      }

      void hold_by_connections()
      {
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
      }

      void check_bodies()
      {
        for (unsigned int body = 0; body < n_bodies; ++body)
        {
          const bool is_absent = body == rotor_body && !geometry.has_rotor();
          if (n_free[body] == 0 || bodies.cluster[body] != body || is_absent)
            continue;
          geometry.may_move_rigidly = true;
          const auto n_tied = std::count(bodies.cluster.begin(), bodies.cluster.end(), Body(body));
          if (prm.has_contact() && prm.contact.steady_pressure != SteadyPressure::uniform)
            mesh.fail("Clamped",
                      "the body '" + bodies.names[body] + "'" +
                          (n_tied > 1 ? " with those that are tied to it" : "") +
                          " can move rigidly in " + std::to_string(n_free[body]) + " ways (" +
                          motions.describe(body) +
                          "), so that there is no static equilibrium. It needs supports "
                          "(Clamped, Guided, Fixed in x, y, z), joints, or Contact/Steady "
                          "pressure = uniform.");
        }
      }

      void check_superelements()
      {
        for (unsigned int k = 0; k < superelements.size(); ++k)
          if (const unsigned int body = first_superelement + k; n_free[body] > 0)
          {
            geometry.may_move_rigidly = true;
            if (prm.n_pads() > 0 && prm.contact.steady_pressure != SteadyPressure::uniform)
              mesh.fail(superelements_key,
                        "the superelement '" + superelements[k].element.name +
                            "' can move freely (" + motions.describe(body) +
                            "), so that there is no static equilibrium. It needs surfaces that are "
                            "held, or a stiffness that holds it.");
          }
      }

      void check_points()
      {
        const std::vector<Parameters::Joints::Point> points = prm.joints.list_of_points();
        for (unsigned int p = 0; p < points.size(); ++p)
          if (const auto &mass = joints.points[p].mass;
              points[p].surface.empty() && n_free[n_bodies + p] > 0)
          {
            geometry.may_move_rigidly = true;
            if (prm.has_contact() && prm.contact.steady_pressure != SteadyPressure::uniform)
              mesh.fail("Joints/Points", "the point '" + points[p].name + "' can move freely (" +
                                             motions.describe(n_bodies + p) +
                                             "), so that there is no static equilibrium. It needs "
                                             "springs or rigid links.");
            if (*std::min_element(mass.begin(), mass.end()) == 0)
              mesh.fail("Joints/Points", "the point '" + points[p].name + "' can move freely (" +
                                             motions.describe(n_bodies + p) +
                                             ") and has no mass or no moment of inertia there.");
          }
      }

      const Parameters::All &prm;
      const ImportedMesh &mesh;
      const ImportedBodies &bodies;
      const std::vector<PlacedSuperelement> &superelements;
      Geometry<3> &geometry;
      const PointJoints &joints;
      const unsigned int n_bodies, first_superelement;
      RigidMotions motions;
      Box box;
      std::vector<std::pair<Point<3>, unsigned int>> place_and_body; ///< of points
      std::vector<unsigned int> n_free;                              ///< motions of each body
    };
  } // namespace

  void add_points(const Parameters::Joints &list, Geometry<3> &geometry)
  {
    PointJoints &joints                         = geometry.point_joints;
    std::map<std::string, unsigned int> numbers = {
        {Parameters::Joints::ground, PointConnection::ground}};
    for (const Parameters::Joints::Point &point : list.list_of_points())
    {
      numbers[point.name] = joints.points.size();
      joints.points.push_back(
          {point.name, {}, Point<3>(point.place[0], point.place[1], point.place[2]), {}});
    }
    for (const auto &mass : list.list_of_masses())
      for (unsigned int k = 0; k < 6; ++k)
        joints.points[numbers.at(mass.point)].mass[k] += mass.values[k];
    for (const auto &spring : list.list_of_springs())
      joints.springs.push_back(
          {numbers.at(spring.first), numbers.at(spring.second), spring.values, {}, spring.axes});
    for (const auto &dashpot : list.list_of_dashpots())
      joints.springs.push_back({numbers.at(dashpot.first),
                                numbers.at(dashpot.second),
                                {},
                                dashpot.values,
                                dashpot.axes});
    for (const auto &link : list.list_of_links())
      joints.links.push_back({numbers.at(link.first), numbers.at(link.second), {}, {}});
  }

  std::vector<std::string> check_supports(const Parameters::All &prm, const ImportedMesh &mesh,
                                          const ImportedBodies &bodies,
                                          const ImportedSuperelements &superelements,
                                          Geometry<3> &geometry)
  {
    SupportCheck check(prm, mesh, bodies, superelements, true, geometry);
    check.check();
    if (prm.n_pads() > 0 && prm.contact.is_fully_worn())
    {
      geometry.free_motions =
          SupportCheck(prm, mesh, bodies, superelements, false, geometry).motions_beside_rotor();
      check_free_motions(geometry);
    }
    return check.lines;
  }
} // namespace squeal
