#include <squeal/expressions.h>
#include <squeal/geometry.h>

#include <deal.II/base/numbers.h>
#include <deal.II/grid/grid_tools.h>
#include <deal.II/grid/manifold_lib.h>

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

  namespace
  {
    /// Appends the tensor-product mesh of radii, angles and heights to the geometry. A full ring
    /// closes.
    void append_sector(Geometry<3> &geometry, const Body body, const std::vector<double> &radii,
                       const std::vector<double> &angles, const std::vector<double> &heights,
                       const bool ring)
    {
      const unsigned int first = geometry.vertices.size();
      const unsigned int n_r = radii.size(), n_z = heights.size();
      const unsigned int n_phi = ring ? angles.size() - 1 : angles.size();
      for (unsigned int k = 0; k < n_z; ++k)
        for (unsigned int j = 0; j < n_phi; ++j)
          for (unsigned int i = 0; i < n_r; ++i)
            geometry.vertices.emplace_back(radii[i] * std::cos(angles[j]),
                                           radii[i] * std::sin(angles[j]), heights[k]);

      const auto vertex = [&](const unsigned int i, const unsigned int j, const unsigned int k)
      { return first + i + n_r * (j % n_phi + n_phi * k); };
      for (unsigned int k = 0; k + 1 < n_z; ++k)
        for (unsigned int j = 0; j + 1 < angles.size(); ++j)
          for (unsigned int i = 0; i + 1 < n_r; ++i)
          {
            CellData<3> cell;
            for (unsigned int v = 0; v < 8; ++v)
              cell.vertices[v] = vertex(i + v % 2, j + (v / 2) % 2, k + v / 4);
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
                    graded_points(pads.inner_radius, pads.outer_radius, mesh.pad_cells[0], layers,
                                  layers, mesh.layer_ratio),
                    graded_points(-half_angle, half_angle, mesh.pad_cells[1], layers, layers,
                                  mesh.layer_ratio),
                    graded_points(std::min(face, back), std::max(face, back), mesh.pad_cells[2],
                                  upper ? layers : 0, upper ? 0 : layers, mesh.layer_ratio),
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

      if (pads.back_face == "guided")
        geometry.supports.push_back({back_id, {{true, true, false}}});
      else if (pads.back_face == "fixed")
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

    const unsigned int layers   = rotor.clamped == "none" ? 0 : mesh.clamp_layers;
    const unsigned int at_inner = rotor.clamped == "inner" ? layers : 0;
    const unsigned int at_outer = rotor.clamped == "outer" ? layers : 0;
    append_sector(geometry, rotor_body,
                  graded_points(rotor.inner_radius, rotor.outer_radius, mesh.rotor_cells[0],
                                at_inner, at_outer, mesh.layer_ratio),
                  graded_points(0, 2 * numbers::PI, mesh.rotor_cells[1], 0, 0, mesh.layer_ratio),
                  graded_points(-rotor.thickness / 2, rotor.thickness / 2, mesh.rotor_cells[2],
                                layers, layers, mesh.layer_ratio),
                  true);
    if (rotor.clamped != "none")
      geometry.supports.push_back(
          {geometry.boundaries["rotor." + rotor.clamped], {{true, true, true}}});

    if (parameters.pads.upper())
      append_pad(geometry, parameters, upper_pad_body);
    if (parameters.pads.lower())
      append_pad(geometry, parameters, lower_pad_body);
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
    if (pads.arrangement == "none")
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
    if (pads.back_face == "guided")
      geometry.supports.push_back({6, {{true, false}}});
    else if (pads.back_face == "fixed")
      geometry.supports.push_back({6, {{true, true}}});
    const auto profile    = position_expression<2>(pads.profile, "Pads/Pressure profile");
    const double pressure = pads.pressure;
    geometry.loads.push_back({6, [=](const Point<2> &x) { return pressure * profile(x); }});
    geometry.interfaces.push_back({"block", upper_pad_body, 5, 3});
    return geometry;
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
      triangulation.set_all_manifold_ids(0);
      triangulation.set_manifold(0, CylindricalManifold<3>(2));
    }

    for (const auto &cell : triangulation.active_cell_iterators())
      for (const unsigned int f : cell->face_indices())
        if (cell->face(f)->at_boundary())
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
                matches &= std::abs(difference) < 1e-10 * x.norm() + 1e-14;
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
