#include <squeal/mesh/geometry.h>
#include <squeal/parameters/expressions.h>

#include <deal.II/base/numbers.h>
#include <deal.II/grid/grid_tools.h>
#include <deal.II/grid/manifold_lib.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  std::vector<double> graded_points(const double a, const double b, const unsigned int n,
                                    const unsigned int at_start, const unsigned int at_end,
                                    const double ratio)
  {
    const double h = (b - a) / n;
    // A single cell that is graded at both ends shares its width between them.
    const double width         = (n == 1 && at_start > 0 && at_end > 0) ? h / 2 : h;
    std::vector<double> points = {a};
    for (unsigned int k = at_start; k > 0; --k)
      points.push_back(a + width * std::pow(ratio, k));
    for (unsigned int i = 1; i < n; ++i)
      points.push_back(a + i * h);
    for (unsigned int k = 1; k <= at_end; ++k)
      points.push_back(b - width * std::pow(ratio, k));
    points.push_back(b);
    return points;
  }

  std::vector<double> aligned_points(const double a, const double b, const unsigned int n,
                                     const std::vector<double> &lines)
  {
    std::vector<double> ends = {a};
    for (const double line : lines)
      if (line > ends.back() + 1e-6 * (b - a) && line < b - 1e-6 * (b - a))
        ends.push_back(line);
    ends.push_back(b);
    if (n + 1 < ends.size())
      ends = {a, b};
    // Each interval has a cell; one more goes where cells are longest.
    std::vector<unsigned int> counts(ends.size() - 1, 1);
    for (unsigned int k = counts.size(); k < n; ++k)
    {
      unsigned int longest = 0;
      for (unsigned int i = 1; i < counts.size(); ++i)
        if ((ends[i + 1] - ends[i]) / counts[i] >
            (1 + 1e-9) * (ends[longest + 1] - ends[longest]) / counts[longest])
          longest = i;
      ++counts[longest];
    }
    std::vector<double> points = {a};
    for (unsigned int i = 0; i < counts.size(); ++i)
      for (unsigned int k = 1; k <= counts[i]; ++k)
        points.push_back(k == counts[i] ? ends[i + 1]
                                        : ends[i] + k * (ends[i + 1] - ends[i]) / counts[i]);
    return points;
  }

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
          CellData<3> cell;
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
      const double pressure = pads.pressure;
      geometry.loads.push_back({back_id, [=](const Point<3> &x) { return pressure * profile(x); }});
      geometry.interfaces.push_back({upper ? "upper" : "lower", body, contact_id,
                                     geometry.boundaries[upper ? "rotor.top" : "rotor.bottom"]});
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

  Geometry<2> make_strip(const Parameters::All &parameters)
  {
    const Parameters::Strip &strip         = parameters.strip;
    const Parameters::Pads &pads           = parameters.pads;
    const Parameters::Discretization &mesh = parameters.discretization;

    Geometry<2> geometry;
    geometry.boundaries = {
        {"rotor.left", 1}, {"rotor.right", 2}, {"rotor.top", 3}, {"rotor.bottom", 4}};
    geometry.periodic = {1, 2};
    geometry.rules    = {{rotor_body, 0, -strip.length / 2, 1},
                         {rotor_body, 0, strip.length / 2, 2},
                         {rotor_body, 1, 0., 3},
                         {rotor_body, 1, -strip.thickness, 4}};
    geometry.supports.push_back({4, {{true, true}}});

    const auto append =
        [&](const Body body, const std::vector<double> &x, const std::vector<double> &y)
    {
      const unsigned int first = geometry.vertices.size(), n = x.size();
      for (const double y_j : y)
        for (const double x_i : x)
          geometry.vertices.emplace_back(x_i, y_j);
      for (unsigned int j = 0; j + 1 < y.size(); ++j)
        for (unsigned int i = 0; i + 1 < n; ++i)
        {
          CellData<2> cell;
          for (unsigned int v = 0; v < 4; ++v)
            cell.vertices[v] = first + i + v % 2 + n * (j + v / 2);
          cell.material_id = body;
          geometry.cells.push_back(cell);
        }
    };
    append(rotor_body,
           graded_points(-strip.length / 2, strip.length / 2, mesh.rotor_cells[1], 0, 0,
                         mesh.layer_ratio),
           graded_points(-strip.thickness, 0, mesh.rotor_cells[2], 0, 0, mesh.layer_ratio));
    if (pads.arrangement == Arrangement::none)
      return geometry;

    const unsigned int layers = mesh.pad_edge_layers;
    append(upper_pad_body,
           graded_points(-strip.block_length / 2, strip.block_length / 2, mesh.pad_cells[1], layers,
                         layers, mesh.layer_ratio),
           graded_points(0, strip.block_thickness, mesh.pad_cells[2], layers, 0, mesh.layer_ratio));
    geometry.boundaries["upper_pad.contact"] = 5;
    geometry.boundaries["upper_pad.back"]    = 6;
    geometry.boundaries["upper_pad.side"]    = 7;
    geometry.rules.push_back({upper_pad_body, 1, 0., 5});
    geometry.rules.push_back({upper_pad_body, 1, strip.block_thickness, 6});
    geometry.rules.push_back({upper_pad_body, 0, -strip.block_length / 2, 7});
    geometry.rules.push_back({upper_pad_body, 0, strip.block_length / 2, 7});
    if (pads.back_face == BackFace::guided)
      geometry.supports.push_back({6, {{true, false}}});
    else if (pads.back_face == BackFace::fixed)
      geometry.supports.push_back({6, {{true, true}}});
    geometry.may_move_rigidly = pads.back_face == BackFace::free;
    const auto profile        = position_expression<2>(pads.profile, "Pads/Pressure profile");
    const double pressure     = pads.pressure;
    geometry.loads.push_back({6, [=](const Point<2> &x) { return pressure * profile(x); }});
    geometry.interfaces.push_back({"block", upper_pad_body, 5, 3});
    return geometry;
  }

  template <int dim>
  std::vector<Body> Geometry<dim>::bodies_of(const unsigned int material) const
  {
    std::vector<Body> result;
    for (unsigned int id = 0; id < parts.size(); ++id)
      if (parts[id].material == material &&
          (parts[id].body == rotor_body || other_bodies.count(parts[id].body) > 0 ||
           std::any_of(interfaces.begin(), interfaces.end(),
                       [&](const ContactInterface &interface)
                       { return interface.pad == parts[id].body; })))
        result.push_back(Body(id));
    return result;
  }

  template <int dim>
  std::vector<std::pair<std::string, Body>> Geometry<dim>::named_bodies() const
  {
    std::vector<std::pair<std::string, Body>> result;
    if (has_rotor())
      result.emplace_back("rotor", rotor_body);
    for (const ContactInterface &interface : interfaces)
      if (interface.slides())
        result.emplace_back(interface.name, interface.pad);
    for (const auto &[body, name] : other_bodies)
      result.emplace_back(name, body);
    return result;
  }

  template <int dim>
  Tensor<1, dim> Geometry<dim>::transport(const Point<dim> &x) const
  {
    // brake: w = e_z x x = (-y, x, 0); strip: w = e_x
    Tensor<1, dim> w;
    if (dim == 2)
      w[0] = 1;
    else
    {
      w[0] = -x[1];
      w[1] = x[0];
    }
    return w;
  }

  template <int dim>
  void Geometry<dim>::make_coarse_mesh(Triangulation<dim> &triangulation) const
  {
    triangulation.create_triangulation(vertices, cells, SubCellData());
    if constexpr (dim == 3)
    {
      for (const auto &cell : triangulation.active_cell_iterators())
        if (parts[cell->material_id()].curved)
          cell->set_all_manifold_ids(0);
      triangulation.set_manifold(0, CylindricalManifold<3>(2));
      quadratic.attach(triangulation, 1);
    }

    double size = 0;
    for (const Point<dim> &vertex : triangulation.get_vertices())
      size = std::max(size, vertex.norm());
    for (const auto &cell : triangulation.active_cell_iterators())
      for (const unsigned int f : cell->face_indices())
        if (cell->face(f)->at_boundary() && rules.empty())
        {
          std::array<unsigned int, 4> vertices_of_face{};
          for (const unsigned int v : cell->face(f)->vertex_indices())
            vertices_of_face[v] = cell->face(f)->vertex_index(v);
          std::sort(vertices_of_face.begin(), vertices_of_face.end());
          if (const auto named = named_faces.find(vertices_of_face); named != named_faces.end())
            cell->face(f)->set_boundary_id(named->second);
        }
        else if (cell->face(f)->at_boundary())
        {
          unsigned int n_matching = 0;
          for (const BoundaryRule &rule : rules)
            if (rule.body == cell->material_id())
            {
              bool matches = true;
              for (const unsigned int v : cell->face(f)->vertex_indices())
              {
                const Point<dim> &x = cell->face(f)->vertex(v);
                const double r      = std::hypot(x[0], x[1]);
                double difference =
                    x[std::min<unsigned int>(rule.coordinate, dim - 1)] - rule.value;
                if (dim == 3 && rule.coordinate == 0)
                  difference = r - rule.value;
                else if (dim == 3 && rule.coordinate == 1)
                  difference =
                      r * std::remainder(std::atan2(x[1], x[0]) - rule.value, 2 * numbers::PI);
                matches &= std::abs(difference) < 1e-10 * size;
              }
              if (matches)
              {
                cell->face(f)->set_boundary_id(rule.id);
                ++n_matching;
              }
            }
          Assert(n_matching == 1, ExcMessage("A boundary face has no name, or several."));
          (void)n_matching;
        }

    if constexpr (dim == 2)
      if (is_periodic())
      {
        std::vector<GridTools::PeriodicFacePair<typename Triangulation<dim>::cell_iterator>> pairs;
        GridTools::collect_periodic_faces(triangulation, periodic.first, periodic.second, 0, pairs);
        triangulation.add_periodicity(pairs);
      }
  }

  template struct Geometry<2>;
  template struct Geometry<3>;
} // namespace squeal
