#include "helpers.h"

#include <doctest/doctest.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/fe/mapping_q.h>

#include <squeal/mesh/coarse_mesh.h>
#include <squeal/mesh/intervals.h>
#include <squeal/scenes/make_scene.h>
namespace squeal::tests::geometry_tests
{
  using namespace dealii;

  namespace
  {
    /// What a mesh measures: areas by boundary id, flux of x/3 through them (the volume of the body
    /// that they enclose) and volume by body.
    struct Measures
    {
      std::map<types::boundary_id, double> areas;
      std::map<types::material_id, double> volumes, fluxes;
    };

    Measures measure(const Triangulation<3> &triangulation)
    {
      // The mapping of degree 4 is wrong by (half an arc)^5 and less: 1e-9 for arcs of 5 degrees.
      const MappingQ<3> mapping(4);
      const FE_Q<3> fe(1);
      FEValues<3> cell_values(mapping, fe, QGauss<3>(6), update_JxW_values);
      FEFaceValues<3> face_values(mapping, fe, QGauss<2>(6),
                                  update_JxW_values | update_normal_vectors |
                                      update_quadrature_points);
      Measures result;
      for (const auto &cell : triangulation.active_cell_iterators())
      {
        cell_values.reinit(cell);
        for (const double JxW : cell_values.get_JxW_values())
          result.volumes[cell->material_id()] += JxW;
        for (const unsigned int f : cell->face_indices())
          if (cell->face(f)->at_boundary())
          {
            face_values.reinit(cell, f);
            for (const unsigned int q : face_values.quadrature_point_indices())
            {
              result.areas[cell->face(f)->boundary_id()] += face_values.JxW(q);
              result.fluxes[cell->material_id()] +=
                  face_values.JxW(q) *
                  (face_values.normal_vector(q) * face_values.quadrature_point(q)) / 3;
            }
          }
      }
      return result;
    }

    /// Every name against the area of its part of cylinders and planes.
    void check_brake(const Parameters::All &p, const unsigned int n_refinements,
                     const double tolerance)
    {
      const Geometry<3> geometry = make_brake(p);
      Triangulation<3> triangulation;
      make_coarse_mesh(geometry, triangulation);
      triangulation.refine_global(n_refinements);
      Measures measured = measure(triangulation);

      const double ri = p.rotor.inner_radius, ro = p.rotor.outer_radius, h = p.rotor.thickness;
      std::map<std::string, double> areas = {{"rotor.inner", 2 * M_PI * ri * h},
                                             {"rotor.outer", 2 * M_PI * ro * h},
                                             {"rotor.top", M_PI * (ro * ro - ri * ri)},
                                             {"rotor.bottom", M_PI * (ro * ro - ri * ri)}};
      std::map<Body, double> volumes      = {{rotor_body, M_PI * (ro * ro - ri * ri) * h}};

      const double a = p.pads.inner_radius, b = p.pads.outer_radius, t = p.pads.thickness;
      const double angle = p.pads.sector_angle * M_PI / 180;
      const auto pad     = [&](const std::string &name, const Body body)
      {
        areas[name + ".contact"] = areas[name + ".back"] = angle / 2 * (b * b - a * a);
        areas[name + ".side"]                            = angle * (a + b) * t + 2 * (b - a) * t;
        volumes[body]                                    = angle / 2 * (b * b - a * a) * t;
      };
      if (p.pads.upper())
        pad("upper_pad", upper_pad_body);
      if (p.pads.lower())
        pad("lower_pad", lower_pad_body);

      CHECK(geometry.boundaries.size() == areas.size());
      for (const auto &[name, area] : areas)
      {
        CAPTURE(name);
        CHECK(geometry.boundaries.count(name) == 1);
        if (geometry.boundaries.count(name) == 1)
          CHECK(relative_error(measured.areas[geometry.boundaries.at(name)], area) <= tolerance);
      }
      // No boundary without a name.
      CHECK(measured.areas.size() == areas.size());
      CHECK(measured.volumes.size() == volumes.size());
      for (const auto &[body, volume] : volumes)
      {
        CAPTURE(body);
        CHECK(relative_error(measured.volumes[body], volume) <= tolerance);
        // The normals point outwards, and the boundary of each body is closed.
        CHECK(relative_error(measured.fluxes[body], volume) <= tolerance);
      }
    }
  } // namespace

  TEST_CASE("geometry: areas of the named boundaries and volumes of the default brake")
  {
    // Sectors of cylinders: areas r dphi dz and (r_o^2 - r_i^2) dphi / 2. One refinement makes arcs
    // of 5 degrees (rotor) and 4.2 degrees (pads).
    Parameters::All p;
    p.discretization.rotor_cells = {{2, 36, 1}};
    p.discretization.pad_cells   = {{1, 6, 1}};
    check_brake(p, 1, 1e-8);
  }

  TEST_CASE("geometry: other arrangements and a graded mesh")
  {
    Parameters::All p;
    p.rotor.inner_radius             = 0.03;
    p.rotor.thickness                = 0.02;
    p.pads.sector_angle              = 80;
    p.pads.thickness                 = 0.007;
    p.discretization.rotor_cells     = {{2, 30, 1}};
    p.discretization.pad_cells       = {{1, 8, 1}};
    p.discretization.clamp_layers    = 2;
    p.discretization.pad_edge_layers = 1;
    p.pads.arrangement               = Arrangement::upper;
    p.rotor.clamped                  = Clamped::outer;
    check_brake(p, 0, 1e-7);
    p.pads.arrangement = Arrangement::none;
    p.rotor.clamped    = Clamped::none;
    check_brake(p, 0, 1e-7);
  }

  TEST_CASE("geometry: a mesh with the smallest number of cells is a brake as well")
  {
    // Three cells around, one each elsewhere; pads over the whole width of the rotor and almost all
    // of its circumference. Arcs of 60 degrees after one refinement: 1e-3.
    Parameters::All p;
    p.pads.inner_radius          = p.rotor.inner_radius;
    p.pads.outer_radius          = p.rotor.outer_radius;
    p.pads.sector_angle          = 340;
    p.discretization.rotor_cells = {{1, 3, 1}};
    p.discretization.pad_cells   = {{1, 3, 1}};
    check_brake(p, 1, 1e-3);
  }

  TEST_CASE("geometry: a pad that lies on one face of the rotor and presses towards it")
  {
    // The upper pad's contact face is the rotor's top, z = h/2; the lower one is its mirror image.
    // Supports and loads belong to the back faces, the clamp to the rotor's inner cylinder.
    Parameters::All p;
    const Geometry<3> geometry = make_brake(p);
    CHECK(geometry.interfaces.size() == 2);
    for (const ContactInterface &interface : geometry.interfaces)
    {
      const bool upper      = interface.name == "upper";
      const std::string pad = upper ? "upper_pad" : "lower_pad";
      CHECK(interface.pad == (upper ? upper_pad_body : lower_pad_body));
      CHECK(interface.pad_face == geometry.boundaries.at(pad + ".contact"));
      CHECK(interface.rotor_face == geometry.boundaries.at(upper ? "rotor.top" : "rotor.bottom"));
    }
    CHECK(geometry.loads.size() == 2);
    for (const PressureLoad<3> &load : geometry.loads)
      CHECK(load.pressure(Point<3>(0.1, 0.01, 0.018)) == p.pads.pressure);

    Triangulation<3> triangulation;
    make_coarse_mesh(geometry, triangulation);
    for (const auto &cell : triangulation.active_cell_iterators())
    {
      const double z = cell->center()[2], r = std::hypot(cell->center()[0], cell->center()[1]);
      if (cell->material_id() == rotor_body)
        CHECK(std::abs(z) < 0.006);
      else
      {
        CHECK((cell->material_id() == upper_pad_body ? z : -z) > 0.006);
        CHECK(r > 0.08);
        CHECK(std::abs(std::atan2(cell->center()[1], cell->center()[0])) < 25 * M_PI / 180);
      }
      for (const unsigned int f : cell->face_indices())
        for (const ContactInterface &interface : geometry.interfaces)
          if (cell->face(f)->at_boundary() &&
              (cell->face(f)->boundary_id() == interface.pad_face ||
               cell->face(f)->boundary_id() == interface.rotor_face))
            CHECK(std::abs(cell->face(f)->center()[2] -
                           (interface.name == "upper" ? 0.006 : -0.006)) <= 1e-15);
    }
  }

  TEST_CASE("geometry: supports")
  {
    // guided: in-plane components; fixed: all; free: none. The clamp fixes all components of one
    // cylinder.
    const auto supports = [](const std::string &back_face, const std::string &clamped)
    {
      Parameters::All p;
      p.pads.back_face = value_named<BackFace>(back_face);
      p.rotor.clamped  = value_named<Clamped>(clamped);
      return make_brake(p);
    };
    const Geometry<3> guided = supports("guided", "inner");
    CHECK(guided.supports.size() == 3);
    for (const Support<3> &support : guided.supports)
      if (support.boundary == guided.boundaries.at("rotor.inner"))
        CHECK(support.fixed == std::array<bool, 3>{{true, true, true}});
      else
      {
        CHECK((support.boundary == guided.boundaries.at("upper_pad.back") ||
               support.boundary == guided.boundaries.at("lower_pad.back")));
        CHECK(support.fixed == std::array<bool, 3>{{true, true, false}});
      }
    CHECK(supports("free", "none").supports.empty());
    const Geometry<3> fixed = supports("fixed", "outer");
    CHECK(fixed.supports.size() == 3);
    for (const Support<3> &support : fixed.supports)
    {
      CHECK(support.fixed == std::array<bool, 3>{{true, true, true}});
      CHECK(support.boundary != fixed.boundaries.at("rotor.inner"));
    }
  }

  TEST_CASE("geometry: refined faces keep the names of their parents")
  {
    Parameters::All p;
    p.discretization.rotor_cells  = {{1, 8, 1}};
    p.discretization.pad_cells    = {{1, 2, 1}};
    p.discretization.clamp_layers = 0;
    Triangulation<3> triangulation;
    make_coarse_mesh(make_brake(p), triangulation);
    // 8 faces on each of the rotor's four boundaries; 2 on the contact and back face of each pad, 6
    // on its side.
    const auto count = [&]()
    {
      std::map<types::boundary_id, unsigned int> n;
      for (const auto &face : triangulation.active_face_iterators())
        if (face->at_boundary())
          ++n[face->boundary_id()];
      return n;
    };
    const auto coarse = count();
    CHECK(coarse ==
          std::map<types::boundary_id, unsigned int>(
              {{1, 8}, {2, 8}, {3, 8}, {4, 8}, {5, 2}, {6, 2}, {7, 6}, {8, 2}, {9, 2}, {10, 6}}));
    triangulation.refine_global(1);
    for (const auto &[id, n] : count())
      CHECK(n == 4 * coarse.at(id));
  }

  TEST_CASE("geometry: the transport field is that of a rotation")
  {
    // w = e_z x x: at (3, 4, 5) it is (-4, 3, 0).
    const Tensor<1, 3> w = Geometry<3>().transport(Point<3>(3, 4, 5));
    CHECK(w == Tensor<1, 3>({-4., 3., 0.}));
  }

  TEST_CASE("geometry: layers at the clamp add two cells each and edge, nothing elsewhere")
  {
    // Per cell around: a single cell over the thickness becomes seven with the first layer, and
    // each further one divides the two corner cells into three; two cells over the thickness: the
    // corners only.
    for (const bool outer : {false, true})
      for (const unsigned int n_z : {1u, 2u})
        for (const unsigned int layers : {0u, 1u, 3u})
        {
          CAPTURE(n_z);
          CAPTURE(layers);
          Parameters::All p;
          p.pads.arrangement            = Arrangement::none;
          p.rotor.clamped               = outer ? Clamped::outer : Clamped::inner;
          p.discretization.rotor_cells  = {{2, 6, n_z}};
          p.discretization.clamp_layers = layers;
          const Geometry<3> geometry    = make_brake(p);
          const unsigned int added =
              n_z == 1 ? (layers > 0 ? 6 + 4 * (layers - 1) : 0) : 4 * layers;
          CHECK(geometry.cells.size() == 6 * (2 * n_z + added));
          // The smallest distance of a vertex from the edge, which carries one itself.
          const double edge_r = outer ? p.rotor.outer_radius : p.rotor.inner_radius;
          double nearest      = 1;
          for (const Point<3> &x : geometry.vertices)
          {
            const double distance =
                std::hypot(std::hypot(x[0], x[1]) - edge_r, x[2] - p.rotor.thickness / 2);
            if (distance > 1e-12)
              nearest = std::min(nearest, distance);
          }
          const double h = p.rotor.thickness / n_z;
          CHECK(nearest == doctest::Approx(h * std::pow(p.discretization.layer_ratio, layers)));
        }
  }

  TEST_CASE("geometry: aligned points")
  {
    // Equal cells where no line is in the way, all lines among the ends, longest cells divided
    // first.
    CHECK(aligned_points(0, 1, 4, {}) == std::vector<double>({0, 0.25, 0.5, 0.75, 1}));
    CHECK(aligned_points(0, 1, 4, {0.6}) == std::vector<double>({0, 0.3, 0.6, 0.8, 1}));
    CHECK(aligned_points(0, 1, 1, {0.6}) == std::vector<double>({0, 1})); // no room for the line
    CHECK(aligned_points(0, 1, 2, {0, 0.5, 1}) == std::vector<double>({0, 0.5, 1}));

    // The default rotor: radii 0.09 and 0.14 and angles +-25 degrees are lines of the mesh.
    Parameters::All p;
    bool inner = false, outer = false, begin = false, end = false;
    for (const Point<3> &x : make_brake(p).vertices)
    {
      const double r = std::hypot(x[0], x[1]), phi = std::atan2(x[1], x[0]) * 180 / M_PI;
      if (std::abs(x[2]) > p.rotor.thickness / 2 + 1e-12)
        continue; // a pad's
      inner |= std::abs(r - 0.09) < 1e-12 && std::abs(phi - 90) < 20;
      outer |= std::abs(r - 0.14) < 1e-12 && std::abs(phi - 90) < 20;
      begin |= std::abs(phi + 25) < 1e-9 && r < 0.08;
      end |= std::abs(phi - 25) < 1e-9 && r < 0.08;
    }
    CHECK((inner && outer && begin && end));
  }

  TEST_CASE("geometry: graded points")
  {
    // n equal cells and at_start + at_end dividing points. The k-th of them is ratio^k of the end
    // cell's width away from the end (half of that width if one cell has both ends).
    for (const unsigned int n : {1u, 2u, 5u})
      for (const unsigned int at_start : {0u, 1u, 3u})
        for (const unsigned int at_end : {0u, 2u})
        {
          CAPTURE(n);
          CAPTURE(at_start);
          CAPTURE(at_end);
          const double ratio = 0.3, a = -1, b = 4;
          const auto points = graded_points(a, b, n, at_start, at_end, ratio);
          CHECK(points.size() == n + 1 + at_start + at_end);
          CHECK(points.front() == a);
          CHECK(points.back() == b);
          CHECK(std::is_sorted(points.begin(), points.end(), std::less_equal<double>()));
          const double width = (b - a) / n / (n == 1 && at_start > 0 && at_end > 0 ? 2 : 1);
          for (unsigned int k = 1; k <= at_start; ++k)
            CHECK(relative_error(points[at_start + 1 - k] - a, width * std::pow(ratio, k)) <=
                  1e-12);
          for (unsigned int k = 1; k <= at_end; ++k)
            CHECK(relative_error(b - points[points.size() - 2 - at_end + k],
                                 width * std::pow(ratio, k)) <= 1e-12);
          for (unsigned int i = 1; i < n; ++i)
            CHECK(relative_error(points[at_start + i], a + i * (b - a) / n, b - a) <= 1e-15);
        }
    CHECK(graded_points(0, 1, 4, 0, 0, 0.2) == std::vector<double>({0, 0.25, 0.5, 0.75, 1}));
  }

  TEST_CASE("geometry: each graded layer is ratio times as thick as the next one inwards")
  {
    const auto points = graded_points(0, 1, 1, 4, 0, 0.2);
    // Between the second and the last layer. The outermost one is ratio/(1 - ratio) of its
    // neighbour.
    for (unsigned int k = 1; k < 4; ++k)
      CHECK(relative_error((points[k + 1] - points[k]) / (points[k + 2] - points[k + 1]), 0.2) <=
            1e-12);
    CHECK(relative_error((points[1] - points[0]) / (points[2] - points[1]), 0.25) <= 1e-12);
  }
} // namespace squeal::tests::geometry_tests
