#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh/coarse_mesh.h>
#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/scenes/deck_doubts.h>
#include <squeal/scenes/imported_faces.h>
#include <squeal/scenes/imported_joints.h>
#include <squeal/scenes/imported_supports.h>
#include <squeal/scenes/make_scene.h>
#include <squeal/scenes/mesh_report.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Where the axis of the rotor may lie, by the box around it: that of a disc is a square across
    /// its axis, with the axis in its middle. Empty where the file's axis lies there.
    std::string advice_on_axis(const Parameters::Mesh &section, const ImportedMesh &mesh,
                               const ImportedPieces &pieces)
    {
      constexpr double tolerance = 0.02; // of the size: corners of a coarse disc
      Box box;
      for (unsigned int c = 0; c < mesh.file.cells.size(); ++c)
        if (pieces.of_rotor[pieces.material_of_cell[c]])
          for (const unsigned int node : mesh.file.cells[c].nodes)
            box.add(mesh.file.nodes[node]);
      const Tensor<1, 3> size = box.high - box.low;
      const Point<3> middle   = box.low + size / 2;
      const std::string axes  = axes_in_file(section);
      const auto is_axis      = [&](const unsigned int d)
      {
        const double a = size[(d + 1) % 3], b = size[(d + 2) % 3];
        return std::abs(a - b) <= tolerance * std::max(a, b) && size[d] < std::min(a, b);
      };
      for (const unsigned int d : {0u, 1u})
        if (is_axis(d) && !is_axis(2))
          return text_of(". It is as wide in ", axes[(d + 1) % 3], " as in ", axes[(d + 2) % 3],
                         " of the file: Mesh/Axis = ", axes[d], "?");
      if (!is_axis(2) || std::hypot(middle[0], middle[1]) <= 1e-3 * size[0])
        return "";
      std::array<double, 3> there = section.origin();
      for (unsigned int d = 0; d < 2; ++d)
        there[std::string("xyz").find(axes[d])] += middle[d] / section.scale;
      return text_of(". Its middle is not on the axis: Mesh/Origin = ", number(there[0], 6), ", ",
                     number(there[1], 6), ", ", number(there[2], 6),
                     ", in the file's unit of length, before Mesh/Scale?");
    }

    constexpr double revolution_tolerance = 1e-3; ///< of a face's size

    /// The transport field must be tangential on the rotor's surface, and on surfaces between its
    /// materials.
    void check_revolution(const Parameters::Mesh &section, const ImportedMesh &mesh,
                          const ImportedPieces &pieces)
    {
      const std::string ways =
          " With transport the rotor must be a body of revolution about z. Else it needs "
          "Rotor/Transport = none, which neglects transport, Stage = elastic or "
          "Operation/Angular velocity = 0.";
      if (section.curved == CurvedBodies::none)
        mesh.fail("Curved bodies",
                  "with straight edges the rotor is not a body of revolution." + ways);
      for (const auto &[face, cells] : mesh.faces)
      {
        const unsigned int material = pieces.material_of_cell[cells[0].cell];
        if (!pieces.of_rotor[material] ||
            (cells.size() == 2 && pieces.material_of_cell[cells[1].cell] == material))
          continue;
        std::array<Point<3>, 4> corners;
        for (unsigned int v = 0; v < 4; ++v)
          corners[v] = mesh.file.nodes[face[v]];
        const double distance = distance_from_revolution(corners),
                     size =
                         std::max(corners[0].distance(corners[1]), corners[0].distance(corners[2]));
        if (distance > revolution_tolerance * size)
        {
          std::ostringstream message;
          message << "a face of the rotor at " << mesh.element(cells[0].cell) << " is " << distance
                  << " m off every surface of revolution about z";
          const std::string place = advice_on_axis(section, mesh, pieces);
          mesh.fail("Rotor",
                    message.str() + (place.empty() ? " (holes, vanes, an axis that Axis and Origin "
                                                     "do not name)." +
                                                         ways
                                                   : place));
        }
      }
    }

    /// Cells and the nodes that cells have; faces with names follow, as those of the mesh do.
    void add_cells(const std::vector<unsigned int> &part_of_cell, ImportedMesh &mesh,
                   Geometry<3> &geometry)
    {
      geometry.own = mesh.file.own;
      std::vector<unsigned int> number(mesh.file.nodes.size(), -1);
      for (unsigned int c = 0; c < mesh.file.cells.size(); ++c)
      {
        CoarseCell<3> cell;
        cell.material_id = part_of_cell[c];
        for (unsigned int v = 0; v < 8; ++v)
        {
          const unsigned int node = mesh.file.cells[c].nodes[lexicographic_corners[v]];
          if (number[node] == numbers::invalid_unsigned_int)
          {
            number[node] = geometry.vertices.size();
            geometry.vertices.push_back(mesh.file.nodes[node]);
          }
          cell.vertices[v] = number[node];
          if (geometry.own.has(c))
            geometry.own.cells[c].between[v] =
                mesh.file.own.cells[c].between[lexicographic_corners[v]];
        }
        geometry.cells.push_back(cell);
      }
      std::map<ImportedMesh::Face, types::boundary_id> renumbered;
      const auto renumber = [&](ImportedMesh::Face face)
      {
        for (unsigned int &node : face)
          node = number[node];
        std::sort(face.begin(), face.end());
        return face;
      };
      for (const auto &[face, id] : geometry.named_faces)
        renumbered[renumber(face)] = id;
      geometry.named_faces = std::move(renumbered);
      geometry.quadratic   = mesh.file.quadratic.renumbered(number);
      for (auto &[name, surface] : mesh.file.surfaces)
        for (ImportedMesh::Face &face : surface)
          face = renumber(face);
      const std::vector<CoarseCell<3>> before = geometry.cells;
      if (!order_consistently(geometry.cells))
        mesh.fail("File",
                  "the cells' edges cannot be directed consistently: rows of cells close in "
                  "a twisted ring.");
      for (unsigned int c = 0; c < geometry.cells.size(); ++c)
        if (geometry.own.has(c))
        {
          const auto between = geometry.own.cells[c].between;
          for (unsigned int v = 0; v < 8; ++v)
            geometry.own.cells[c].between[v] =
                between[std::find(before[c].vertices.begin(), before[c].vertices.end(),
                                  geometry.cells[c].vertices[v]) -
                        before[c].vertices.begin()];
        }
    }

    /// What elements with own polynomials do not have.
    void check_own_elements(const Parameters::All &prm, const ImportedMesh &mesh)
    {
      constexpr unsigned int highest = 3;
      if (mesh.file.own.empty())
        return;
      const auto refuse = [&](const bool given, const std::string &what, const std::string &allowed)
      {
        if (given)
          mesh.fail("Tetrahedra",
                    "own: " + what + " needs Mesh/Tetrahedra = divided" + allowed + ".");
      };
      refuse(prm.discretization.degree > highest,
             text_of("Discretization/Degree = ", prm.discretization.degree),
             text_of(", or a degree of at most ", highest));
      refuse(prm.refinement.edge_levels > 0, "Refinement/Contact edge levels", "");
      refuse(prm.eigenproblem.solver == ModeSolver::block_davidson,
             "Eigenproblem/Solver = block_davidson", ", or another solver");
      refuse(prm.static_equilibrium.linear_solver == LinearSolver::iterative,
             "Static equilibrium/Linear solver = iterative", ", or direct");
    }

    /// A uniform contact pressure is that of the load only where both act on the same area.
    void check_uniform_pressure(const Parameters::Contact &section,
                                const std::vector<ContactPairMeasures> &pairs,
                                const Geometry<3> &geometry)
    {
      if (section.steady_pressure != SteadyPressure::uniform || pairs.empty())
        return;
      double contact = 0, loaded = 0;
      for (const ContactPairMeasures &pair : pairs)
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
  } // namespace

  Geometry<3> make_imported_scene(const Parameters::All &prm)
  {
    ImportedMesh mesh(prm);
    check_own_elements(prm, mesh);
    const ImportedBodies bodies(prm, mesh);
    Geometry<3> geometry;
    geometry.parts        = bodies.parts;
    geometry.other_bodies = bodies.others;
    const ImportedSuperelements superelements(prm, mesh, bodies);
    for (const PlacedSuperelement &placed : superelements.placed)
      geometry.superelements.push_back(placed.element);
    add_points(prm.joints, geometry);
    leave_out_uncovered_faces(prm.joints, mesh, bodies);
    name_faces(prm, mesh, bodies, geometry);
    const ImportedJoints joints(prm, mesh, bodies, geometry);
    if (needs_revolution(prm))
      check_revolution(prm.mesh, mesh, bodies.pieces);
    const std::vector<std::string> points =
        check_supports(prm, mesh, bodies, superelements, geometry);
    add_cells(bodies.part_of_cell, mesh, geometry);

    MeshFacts facts{mesh.file,    bodies.names,    mesh.n_turned, mesh.roles,
                    joints.pairs, joints.surfaces, points,        {}};
    for (const PlacedSuperelement &placed : superelements.placed)
      facts.superelements.push_back(placed.report);
    report_mesh(prm, facts, geometry);
    geometry.report += doubts_about_deck(prm);
    check_uniform_pressure(prm.contact, joints.pairs, geometry);
    return geometry;
  }
} // namespace squeal
