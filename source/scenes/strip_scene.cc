#include <squeal/mesh/intervals.h>
#include <squeal/parameters/expressions.h>
#include <squeal/scenes/free_motions.h>
#include <squeal/scenes/make_scene.h>

namespace squeal
{
  using namespace dealii;

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
          CoarseCell<2> cell;
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
    const double pressure     = pressure_of_loads(pads.pressure);
    geometry.loads.push_back({6, [=](const Point<2> &x) { return pressure * profile(x); }});
    geometry.interfaces.push_back({"block", upper_pad_body, 5, 3});
    add_motions_of_pad(parameters, upper_pad_body, strip.block_thickness, geometry);
    return geometry;
  }
} // namespace squeal
