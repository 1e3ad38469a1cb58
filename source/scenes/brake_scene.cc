#include <squeal/mesh/intervals.h>
#include <squeal/parameters/expressions.h>
#include <squeal/scenes/free_motions.h>
#include <squeal/scenes/make_scene.h>

#include <deal.II/base/numbers.h>

#include <algorithm>
#include <cmath>

// The built-in brake. The rotor's cross-section is divided in the half plane (r, z) and graded
// towards its clamped edges; swept over the angles it gives the ring. Pads are sectors, products
// of graded intervals. Each body brings the names of its boundaries, supports and loads.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// A quadrilateral mesh of half planes phi = const. Vertices of a cell are lexicographic in (r,
    /// z).
    struct CrossSection
    {
      std::vector<std::array<double, 2>> points;
      std::vector<std::array<unsigned int, 4>> cells;
    };

    CrossSection tensor_section(const std::vector<double> &r, const std::vector<double> &z)
    {
      CrossSection section;
      const unsigned int n = r.size();
      for (const double z_k : z)
        for (const double r_i : r)
          section.points.push_back({{r_i, z_k}});
      for (unsigned int k = 0; k + 1 < z.size(); ++k)
        for (unsigned int i = 0; i + 1 < n; ++i)
          section.cells.push_back(
              {{i + n * k, i + 1 + n * k, i + n * (k + 1), i + 1 + n * (k + 1)}});
      return section;
    }

    /// Divides a cell towards its vertex @p corner, both of whose edges lie on the boundary:
    ///
    ///     b ------- d
    ///     |       / |        c B D A is similar to the cell at the given ratio and is divided
    ///     |     /   |        again; the edges a d and b d, which other cells share, stay whole.
    ///     B - D     |
    ///     c - A --- a
    ///
    /// A singularity at c is resolved with two cells for each layer.
    void grade_corner(CrossSection &section, const unsigned int cell, const unsigned int corner,
                      const unsigned int layers, const double ratio)
    {
      for (unsigned int layer = 0; layer < layers; ++layer)
      {
        const std::array<unsigned int, 4> old = section.cells[cell];
        const unsigned int c = old[corner], a = old[corner ^ 1], b = old[corner ^ 2],
                           d = old[corner ^ 3];
        const auto between   = [&](const unsigned int end)
        {
          const auto from = section.points[c], to = section.points[end];
          section.points.push_back(
              {{from[0] + ratio * (to[0] - from[0]), from[1] + ratio * (to[1] - from[1])}});
          return static_cast<unsigned int>(section.points.size() - 1);
        };
        const unsigned int A = between(a), B = between(b), D = between(d);
        // As seen from the corner; turned back into the order of the section.
        const auto turned = [&](const std::array<unsigned int, 4> &seen)
        {
          std::array<unsigned int, 4> result;
          for (unsigned int v = 0; v < 4; ++v)
            result[v] = seen[v ^ corner];
          return result;
        };
        section.cells[cell] = turned({{c, A, B, D}});
        section.cells.push_back(turned({{A, a, D, d}}));
        section.cells.push_back(turned({{B, D, b, d}}));
      }
    }

    /// The rotor's cross-section, graded towards the two edges of its clamped boundary. A single
    /// cell over the thickness makes room for both with its first layer: three cells at the clamp
    /// and four that lead over to the next column.
    CrossSection rotor_section(const Parameters::Rotor &rotor,
                               const Parameters::Discretization &mesh,
                               const std::vector<double> &pad_edges)
    {
      unsigned int layers    = rotor.clamped == Clamped::none ? 0 : mesh.clamp_layers;
      const unsigned int n_r = mesh.rotor_cells[0], n_z = mesh.rotor_cells[2];
      const double width = rotor.outer_radius - rotor.inner_radius, h = rotor.thickness;
      // s, the distance from the clamp, in place of r
      std::vector<double> lines;
      for (const double edge : pad_edges)
        lines.push_back(rotor.clamped == Clamped::outer ? rotor.outer_radius - edge
                                                        : edge - rotor.inner_radius);
      std::sort(lines.begin(), lines.end());
      const std::vector<double> s = aligned_points(0, width, n_r, lines),
                                z = aligned_points(-h / 2, h / 2, n_z, {});
      CrossSection section        = tensor_section(s, z);
      unsigned int lower = 0, upper = n_r * (n_z - 1);
      if (layers > 0 && n_z == 1)
      {
        --layers;
        // Columns at s = 0 and q and two points R, S at t; s[1] is where the next column begins.
        const double edge = std::min(mesh.layer_ratio, 1. / 3), q = edge * std::min(s[1], h),
                     t       = (q + s[1]) / 2;
        const unsigned int n = s.size(), A = section.points.size(), B = A + 1, C = A + 2, D = A + 3,
                           P = A + 4, Q = A + 5, R = A + 6, S = A + 7;
        const double low = (edge - 0.5) * h;
        for (const std::array<double, 2> &point : {std::array<double, 2>{{q, -h / 2}},
                                                   {{q, h / 2}},
                                                   {{0, low}},
                                                   {{0, -low}},
                                                   {{q, low}},
                                                   {{q, -low}},
                                                   {{t, low / 3}},
                                                   {{t, -low / 3}}})
          section.points.push_back(point);
        section.cells[0] = {{0, A, C, P}};
        upper            = section.cells.size();
        for (const std::array<unsigned int, 4> &cell : {std::array<unsigned int, 4>{{D, Q, n, B}},
                                                        {{C, P, D, Q}},
                                                        {{A, 1, P, R}},
                                                        {{R, 1, S, n + 1}},
                                                        {{P, R, Q, S}},
                                                        {{Q, S, B, n + 1}}})
          section.cells.push_back(cell);
      }
      grade_corner(section, lower, 0, layers, mesh.layer_ratio);
      grade_corner(section, upper, 2, layers, mesh.layer_ratio);
      const bool outwards = rotor.clamped != Clamped::outer;
      for (auto &point : section.points)
        point[0] = outwards ? rotor.inner_radius + point[0] : rotor.outer_radius - point[0];
      for (auto &cell : section.cells)
        if (!outwards)
        {
          std::swap(cell[0], cell[1]);
          std::swap(cell[2], cell[3]);
        }
      return section;
    }

    /// Appends the mesh that a cross-section sweeps over the angles. A full ring closes.
    void append_sector(Geometry<3> &geometry, const Body body, const CrossSection &section,
                       const std::vector<double> &angles, const bool ring)
    {
      const unsigned int first = geometry.vertices.size(), n = section.points.size();
      const unsigned int n_phi = ring ? angles.size() - 1 : angles.size();
      for (unsigned int j = 0; j < n_phi; ++j)
        for (const auto &[r, z] : section.points)
          geometry.vertices.emplace_back(r * std::cos(angles[j]), r * std::sin(angles[j]), z);
      for (unsigned int j = 0; j + 1 < angles.size(); ++j)
        for (const auto &quad : section.cells)
        {
          CoarseCell<3> cell;
          for (unsigned int v = 0; v < 8; ++v)
            cell.vertices[v] = first + quad[v % 2 + 2 * (v / 4)] + n * ((j + (v / 2) % 2) % n_phi);
          cell.material_id = body;
          geometry.cells.push_back(cell);
        }
    }

    void append_pad(Geometry<3> &geometry, const Parameters::All &parameters, const Body body)
    {
      const Parameters::Pads &pads           = parameters.pads;
      const Parameters::Discretization &mesh = parameters.discretization;

      const bool upper        = body == upper_pad_body;
      const std::string name  = upper ? "upper_pad" : "lower_pad";
      const double half_angle = pads.sector_angle / 2 * numbers::PI / 180;
      const double face       = (upper ? 1 : -1) * parameters.rotor.thickness / 2;
      const double back       = face + (upper ? 1 : -1) * pads.thickness;

      const unsigned int layers = mesh.pad_edge_layers;
      append_sector(geometry, body,
                    tensor_section(
                        graded_points(pads.inner_radius, pads.outer_radius, mesh.pad_cells[0],
                                      layers, layers, mesh.layer_ratio),
                        graded_points(std::min(face, back), std::max(face, back), mesh.pad_cells[2],
                                      upper ? layers : 0, upper ? 0 : layers, mesh.layer_ratio)),
                    graded_points(-half_angle, half_angle, mesh.pad_cells[1], layers, layers,
                                  mesh.layer_ratio),
                    false);

      const types::boundary_id contact_id    = upper ? 5 : 8;
      const types::boundary_id back_id       = upper ? 6 : 9;
      const types::boundary_id side_id       = upper ? 7 : 10;
      geometry.boundaries[name + ".contact"] = contact_id;
      geometry.boundaries[name + ".back"]    = back_id;
      geometry.boundaries[name + ".side"]    = side_id;
      geometry.rules.push_back({body, 2, face, contact_id});
      geometry.rules.push_back({body, 2, back, back_id});
      geometry.rules.push_back({body, 0, pads.inner_radius, side_id});
      geometry.rules.push_back({body, 0, pads.outer_radius, side_id});
      geometry.rules.push_back({body, 1, -half_angle, side_id});
      geometry.rules.push_back({body, 1, half_angle, side_id});

      if (pads.back_face == BackFace::guided)
        geometry.supports.push_back({back_id, {{true, true, false}}});
      else if (pads.back_face == BackFace::fixed)
        geometry.supports.push_back({back_id, {{true, true, true}}});
      const auto profile    = position_expression<3>(pads.profile, "Pads/Pressure profile");
      const double pressure = pressure_of_loads(pads.pressure);
      geometry.loads.push_back({back_id, [=](const Point<3> &x) { return pressure * profile(x); }});
      geometry.interfaces.push_back({upper ? "upper" : "lower", body, contact_id,
                                     geometry.boundaries[upper ? "rotor.top" : "rotor.bottom"]});
      add_motions_of_pad(parameters, body, back, geometry);
    }
  } // namespace

  Geometry<3> make_brake(const Parameters::All &parameters)
  {
    const Parameters::Rotor &rotor         = parameters.rotor;
    const Parameters::Discretization &mesh = parameters.discretization;

    Geometry<3> geometry;
    geometry.boundaries = {
        {"rotor.inner", 1}, {"rotor.outer", 2}, {"rotor.top", 3}, {"rotor.bottom", 4}};
    geometry.rules = {{rotor_body, 0, rotor.inner_radius, 1},
                      {rotor_body, 0, rotor.outer_radius, 2},
                      {rotor_body, 2, rotor.thickness / 2, 3},
                      {rotor_body, 2, -rotor.thickness / 2, 4}};

    std::vector<double> radii, angles;
    const bool align   = mesh.align_rotor && parameters.pads.n_pads() > 0;
    const double angle = parameters.pads.sector_angle * numbers::PI / 180,
                 begin = align ? -angle / 2 : 0.;
    if (align)
    {
      radii  = {parameters.pads.inner_radius, parameters.pads.outer_radius};
      angles = {begin + angle};
    }
    append_sector(geometry, rotor_body, rotor_section(rotor, mesh, radii),
                  aligned_points(begin, begin + 2 * numbers::PI, mesh.rotor_cells[1], angles),
                  true);
    if (rotor.clamped != Clamped::none)
      geometry.supports.push_back(
          {geometry.boundaries["rotor." + name_of(rotor.clamped)], {{true, true, true}}});

    if (parameters.pads.upper())
      append_pad(geometry, parameters, upper_pad_body);
    if (parameters.pads.lower())
      append_pad(geometry, parameters, lower_pad_body);
    // A guided pad is held by the contact.
    geometry.may_move_rigidly =
        rotor.clamped == Clamped::none ||
        (parameters.pads.n_pads() > 0 && parameters.pads.back_face == BackFace::free);
    return geometry;
  }
} // namespace squeal
