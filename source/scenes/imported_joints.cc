#include <squeal/parameters/entries.h>
#include <squeal/scenes/imported_joints.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// The coordinate axis that is furthest from all normals: on a cylinder about an axis, that.
    Tensor<1, 3> tangential_axis(const std::vector<SurfaceFace<3>> &first,
                                 const std::vector<SurfaceFace<3>> &second)
    {
      const FaceElement<3> element(2);
      std::array<double, 3> nearest{};
      for (const auto *patches : {&first, &second})
        for (const SurfaceFace<3> &face : *patches)
          for (const Point<2> &xi :
               {Point<2>(0, 0), Point<2>(1, 0), Point<2>(0, 1), Point<2>(1, 1), Point<2>(0.5, 0.5)})
            for (unsigned int d = 0; d < 3; ++d)
              nearest[d] = std::max(nearest[d], std::abs(element.frame(face, xi).normal[d]));
      Tensor<1, 3> axis;
      axis[std::min_element(nearest.begin(), nearest.end()) - nearest.begin()] = 1;
      return axis;
    }

    constexpr double least_cover = 0.9, ///< of the first surface of a tie
        least_part               = 0.5; ///< of a face of one that is tied partly

    /// Whether the tie of a first surface may be covered partly.
    bool is_partly_tied(const Parameters::Joints &joints, const std::string &first)
    {
      for (const std::vector<std::string> &entry : Parameters::entries_of(joints.ties))
        if (entry.size() == 3 && plain_capitals(entry[0]) == plain_capitals(first))
          return true;
      return false;
    }
  } // namespace

  void leave_out_uncovered_faces(const Parameters::Joints &joints, ImportedMesh &mesh,
                                 const ImportedBodies &bodies)
  {
    for (const auto &[first, second] : bodies.pieces.ties)
      if (is_partly_tied(joints, first))
      {
        const std::vector<double> parts = covered_parts(
            bodies.curved_patches(first), bodies.curved_patches(second), joints.position_tolerance);
        std::vector<ImportedMesh::Face> &faces = mesh.file.surfaces.at(first), covered;
        for (unsigned int f = 0; f < faces.size(); ++f)
          if (parts[f] >= least_part)
            covered.push_back(faces[f]);
        if (covered.empty())
          mesh.fail("Joints/Ties", "'" + second + "' covers half of no face of '" + first +
                                       "' within Joints/Position tolerance.");
        faces = std::move(covered);
      }
  }

  ImportedJoints::ImportedJoints(const Parameters::All &prm, const ImportedMesh &mesh,
                                 const ImportedBodies &bodies, Geometry<3> &geometry)
      : prm(prm), mesh(mesh), bodies(bodies), geometry(geometry)
  {
    check_pairs();
    check_ties();
    check_contacts();
  }

  void ImportedJoints::check_pairs()
  {
    for (const auto &of_pad : prm.contact.friction_by_pad())
      if (std::none_of(bodies.pairs.begin(), bodies.pairs.end(),
                       [&](const auto &pair) { return pair.first == of_pad.first; }))
        mesh.fail("Contact/Friction/Of pads",
                  "there is no pad '" + of_pad.first + "' written like that.");
    for (const auto &[pad, rotor] : bodies.pairs)
    {
      check_middle_nodes(pad);
      check_middle_nodes(rotor);
      PairSurroundings surroundings;
      surroundings.axes           = axes_in_file(prm.mesh);
      surroundings.rotor_surfaces = [this]() { return boxes_on_rotor(); };
      pairs.push_back(check_contact_pair("Mesh/Contact pairs: " + mesh.file.name + ": ", pad,
                                         mesh.patches(pad), rotor, mesh.patches(rotor),
                                         prm.mesh.contact_tolerance, surroundings));
    }
  }

  std::map<std::string, Box> ImportedJoints::boxes_on_rotor() const
  {
    std::map<std::string, Box> result;
    for (const auto &[name, faces] : mesh.file.surfaces)
      if (std::all_of(faces.begin(), faces.end(),
                      [&](const ImportedMesh::Face &face)
                      {
                        const auto cells = mesh.faces.find(face);
                        return cells != mesh.faces.end() &&
                               bodies.pieces
                                   .of_rotor[bodies.pieces.material_of_cell[cells->second[0].cell]];
                      }))
        for (const ImportedMesh::Face &face : faces)
          for (const unsigned int node : face)
            result[name].add(mesh.file.nodes[node]);
    return result;
  }

  void ImportedJoints::check_middle_nodes(const std::string &name) const
  {
    Box box;
    for (const ImportedMesh::Face &face : mesh.file.surfaces.at(name))
      for (const unsigned int node : face)
        box.add(mesh.file.nodes[node]);
    const double allowed = plane_tolerance * box.low.distance(box.high);
    for (const ImportedMesh::Face &face : mesh.file.surfaces.at(name))
      for (const Point<3> &x : mesh.bent_patch(face))
        if (x[2] < box.low[2] - allowed || x[2] > box.high[2] + allowed)
          mesh.fail("Contact pairs", "a middle node bends '" + name + "' at " + text_of(x) +
                                         "; contact surfaces must be plane, across the axis z.");
  }

  void ImportedJoints::check_ties()
  {
    std::map<std::string, std::string> firsts;
    for (const auto &[pad, rotor] : bodies.pairs)
    {
      firsts[pad]   = "Mesh/Contact pairs";
      firsts[rotor] = "Mesh/Contact pairs";
    }
    for (const auto &[first, second] : bodies.pieces.ties)
    {
      if (const auto other = firsts.find(first); other != firsts.end())
        mesh.fail("Joints/Ties", "'" + first + "' is the first of a tie and in " + other->second +
                                     " too: its faces would be tied twice. A surface can be the "
                                     "second of several ties.");
      firsts[first] = "another joint";
      const JointMeasures tie =
          check_joint("Joints/Ties: " + mesh.file.name + ": ", first, bodies.curved_patches(first),
                      second, bodies.curved_patches(second), prm.joints.position_tolerance,
                      is_partly_tied(prm.joints, first) ? least_part : least_cover);
      surfaces.push_back(tie);
      geometry.ties.push_back(
          {tie.name, geometry.boundaries.at(first), geometry.boundaries.at(second), tie.distance});
    }
    for (const auto &[first, second] : bodies.pieces.ties)
      if (const auto other = firsts.find(second); other != firsts.end())
        mesh.fail("Joints/Ties", "'" + second + "' is the second of a tie and in " + other->second +
                                     " too; allowed is a surface that is the second of other ties "
                                     "only.");
  }

  void ImportedJoints::check_contacts()
  {
    const std::string key = "Joints/Contacts";
    std::map<std::string, std::string> uses;
    std::map<unsigned int, std::string> at_node; // the surface that has the pressure there
    const auto use = [&](const std::string &name, const std::string &by)
    {
      const auto [other, is_new] = uses.emplace(name, by);
      if (!is_new)
        mesh.fail(key, "'" + name + "' is in a contact and in " + other->second + " too.");
    };
    const auto take_nodes = [&](const std::string &name)
    {
      for (const ImportedMesh::Face &face : mesh.file.surfaces.at(name))
        for (const unsigned int node : face)
          if (const auto [other, is_new] = at_node.emplace(node, name);
              !is_new && other->second != name)
            mesh.fail(key,
                      "the surfaces '" + name + "' and '" + other->second +
                          "' share nodes, among them that at " + text_of(mesh.file.nodes[node]) +
                          ": two contacts would share a pressure there. One of them must be the "
                          "second of its contact.");
    };
    for (const auto &[pad, rotor] : bodies.pairs)
    {
      use(pad, "Mesh/Contact pairs");
      take_nodes(pad);
    }
    for (const auto &[first, second] : bodies.pieces.ties)
      for (const std::string &name : {first, second})
        uses.emplace(name, "Joints/Ties");
    for (const Parameters::Joints::Contact &contact : bodies.pieces.contacts)
    {
      use(contact.first, "another contact");
      use(contact.second, "another contact");
      take_nodes(contact.first);
      const auto first       = bodies.curved_patches(contact.first),
                 second      = bodies.curved_patches(contact.second);
      JointMeasures measures = check_joint(key + ": " + mesh.file.name + ": ", contact.first, first,
                                           contact.second, second, prm.joints.position_tolerance);
      measures.kind          = contact.sticks ? "Stick contact" : "Frictionless contact";
      surfaces.push_back(measures);
      const Body body = bodies.of(mesh.file.surfaces.at(contact.first)[0]);
      geometry.interfaces.push_back(
          {measures.name, body, geometry.boundaries.at(contact.first),
           geometry.boundaries.at(contact.second), measures.distance,
           contact.sticks ? ContactKind::stick : ContactKind::frictionless,
           tangential_axis(first, second), contact.friction});
    }
  }
} // namespace squeal
