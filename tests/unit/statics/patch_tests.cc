#include "statics.h"
#include <squeal/contact/contact_forces.h>

#include <doctest/doctest.h>
namespace squeal::tests::patch_tests
{
  using namespace dealii;

  namespace
  {
    /// An elastic layer, fixed below, under a guided block of the same length: for nu = 0 the state
    /// is uniaxial. @p block shorter than the layer: the layer's top is fixed, that is rigid.
    Geometry<2> make_layers(const unsigned int n_rotor, const unsigned int n_pad,
                            const unsigned int edge_layers, const double block = 0.2)
    {
      Parameters::All prm;
      prm.strip.length                   = 0.2;
      prm.strip.thickness                = thickness;
      prm.strip.block_length             = block;
      prm.strip.block_thickness          = thickness;
      prm.pads.pressure                  = p;
      prm.discretization.rotor_cells     = {{1, n_rotor, 2}};
      prm.discretization.pad_cells       = {{1, n_pad, 1}};
      prm.discretization.pad_edge_layers = edge_layers;
      prm.discretization.layer_ratio     = 0.3;
      Geometry<2> geometry               = make_strip(prm);
      if (block < 0.2)
        geometry.supports.push_back({geometry.boundaries.at("rotor.top"), {{true, true}}});
      return geometry;
    }

    /// Refines some columns of cells, of the whole height, so that hanging nodes lie on planes x =
    /// const (2D) or phi = const (3D).
    enum class Hanging
    {
      none,
      rotor,
      pad,
      both ///< the same outline on either side: needed where arcs are polynomials
    };

    template <int dim>
    void refine_columns(FiniteElementSpace<dim> &spaces, const Hanging hanging)
    {
      if (hanging == Hanging::none)
        return;
      const unsigned int before = spaces.triangulation.n_global_active_cells();
      refine_where(spaces,
                   [&](const Point<dim> &x, const types::material_id body)
                   {
                     const bool here =
                         body == rotor_body ? hanging != Hanging::pad : hanging != Hanging::rotor;
                     return here && (dim == 3 ? x[1] > 0 : std::abs(x[0] - 0.04) < 0.039);
                   });
      CHECK(spaces.triangulation.n_global_active_cells() > before);
    }

    /// Constant stress -p: u_n = -p (height)/E in each body from the base up, minus p/k_C at the
    /// interface for penalty.
    template <int dim>
    void check_patch(const Geometry<dim> &geometry, const unsigned int degree, const bool mortar,
                     const Hanging hanging, const double base, const double interface,
                     const bool rigid_rotor = false)
    {
      CAPTURE(degree);
      CAPTURE(mortar);
      CAPTURE(static_cast<int>(hanging));
      FiniteElementSpace<dim> spaces(geometry, degree, mortar, MPI_COMM_WORLD);
      spaces.distribute();
      refine_columns(spaces, hanging);
      const Result<dim> result = solve(spaces, frictionless<dim>(mortar), false, {upper_pad_body});
      const double approach    = mortar ? 0 : p / k_C;
      const auto field         = [&](const double value)
      {
        Tensor<1, dim> u;
        u[dim - 1] = value;
        return u;
      };
      const double sunk = rigid_rotor ? 0 : p * (interface - base) / E_rotor;
      if (!rigid_rotor)
        CHECK(deviation(spaces, result.state, {rotor_body},
                        [&](const Point<dim> &x)
                        { return field(-p * (x[dim - 1] - base) / E_rotor); }) <= 1e-10);
      CHECK(deviation(spaces, result.state, {upper_pad_body},
                      [&](const Point<dim> &x) {
                        return field(-sunk - approach - p * (x[dim - 1] - interface) / E_pad);
                      }) <= 1e-10);
      if (mortar)
        CHECK(deviation_of_multipliers(spaces, result, p) <= 1e-10);
      const ContactResultants &r = result.resultants[0];
      CHECK(relative_error(r.max_pressure, p) <= 1e-10);
      // The clipped areas tile the pad's face; everything touches.
      const double face =
          integrate_boundary(spaces, geometry.boundaries.at("upper_pad.contact"),
                             [](const Point<dim> &, const Tensor<1, dim> &) { return 1.; });
      CHECK(relative_error(r.area, face) <= 1e-12);
      CHECK(relative_error(r.normal_force, p * face) <= 1e-10);
    }

    void check_strip(const unsigned int n_rotor, const unsigned int n_pad,
                     const unsigned int edge_layers, const Hanging hanging = Hanging::none)
    {
      const Geometry<2> geometry = make_layers(n_rotor, n_pad, edge_layers);
      for (const unsigned int degree : {1u, 2u, 3u})
        for (const bool mortar : {true, false})
          check_patch(geometry, degree, mortar, hanging, -thickness, 0);
    }

    void check_blocks(const std::array<unsigned int, 3> &rotor_cells,
                      const std::array<unsigned int, 3> &pad_cells, const double bias = 0,
                      const Hanging hanging = Hanging::none)
    {
      const Geometry<3> geometry = make_blocks(rotor_cells, pad_cells, bias);
      for (const unsigned int degree : {1u, 2u, 3u})
        for (const bool mortar : {true, false})
          if (degree < 3 || mortar)
            check_patch(geometry, degree, mortar, hanging, 0, thickness);
    }
  } // namespace

  TEST_CASE("patch_tests: constant stress across the interface of a strip" *
            doctest::test_suite("slow"))
  {
    SUBCASE("matching")
    {
      check_strip(6, 6, 0);
    }
    SUBCASE("rotor finer, nested and not")
    {
      check_strip(12, 6, 0);
      check_strip(7, 3, 0);
    }
    SUBCASE("pad finer, nested and not")
    {
      check_strip(4, 8, 0);
      check_strip(4, 9, 0);
    }
    SUBCASE("shifted")
    {
      check_strip(6, 6, 1);
      // a short block in the middle of a rigid layer
      for (const unsigned int degree : {1u, 2u, 3u})
        for (const bool mortar : {true, false})
          check_patch(make_layers(9, 4, 0, 0.083), degree, mortar, Hanging::none, 0, 0, true);
    }
    SUBCASE("hanging nodes")
    {
      for (const Hanging hanging : {Hanging::rotor, Hanging::pad, Hanging::both})
      {
        check_strip(6, 6, 0, hanging);
        check_strip(5, 7, 1, hanging);
      }
    }
  }

  TEST_CASE("patch_tests: hanging nodes across the periodic boundary" * doctest::test_suite("slow"))
  {
    const Geometry<2> geometry = make_layers(6, 5, 0);
    for (const unsigned int degree : {1u, 2u, 3u})
    {
      CAPTURE(degree);
      FiniteElementSpace<2> spaces(geometry, degree, true, MPI_COMM_WORLD);
      spaces.distribute();
      refine_where(spaces, [](const Point<2> &x, const types::material_id body)
                   { return body == rotor_body && x[0] > 0.06; });
      const Result<2> result = solve(spaces, frictionless<2>(true), false, {upper_pad_body});
      CHECK(deviation(spaces, result.state, {rotor_body},
                      [](const Point<2> &x) {
                        return Tensor<1, 2>({0., -p * (x[1] + thickness) / E_rotor});
                      }) <= 1e-10);
      CHECK(deviation_of_multipliers(spaces, result, p) <= 1e-10);
    }
  }

  // The arcs of both sides are the same polynomials: meshes differ along r and z, and hanging nodes
  // lie on planes phi = const.
  TEST_CASE("patch_tests: constant stress across the interface of blocks" *
            doctest::test_suite("slow"))
  {
    SUBCASE("matching")
    {
      check_blocks({{2, 3, 1}}, {{2, 3, 1}});
    }
    SUBCASE("rotor finer")
    {
      check_blocks({{4, 3, 1}}, {{2, 3, 1}});
    }
    SUBCASE("pad finer")
    {
      check_blocks({{2, 3, 1}}, {{3, 3, 1}});
    }
    SUBCASE("shifted")
    {
      check_blocks({{3, 3, 1}}, {{3, 3, 1}}, 0.2);
    }
    SUBCASE("hanging nodes")
    {
      check_blocks({{1, 4, 1}}, {{1, 4, 1}}, 0, Hanging::both);
      check_blocks({{2, 4, 1}}, {{1, 4, 1}}, 0, Hanging::both);
    }
  }

  TEST_CASE("patch_tests: clipped areas sum to the pad's face, whatever the rotor's mesh" *
            doctest::test_suite("slow"))
  {
    // Arcs of their own on each side, hanging nodes on either.
    Parameters::All prm;
    prm.discretization.rotor_cells = {{2, 16, 1}};
    prm.discretization.pad_cells   = {{1, 4, 1}};
    const Geometry<3> geometry     = make_brake(prm);
    for (const Hanging hanging : {Hanging::none, Hanging::rotor, Hanging::pad, Hanging::both})
      for (const unsigned int degree : {1u, 2u, 3u})
      {
        CAPTURE(static_cast<int>(hanging));
        CAPTURE(degree);
        FiniteElementSpace<3> spaces(geometry, degree, true, MPI_COMM_WORLD);
        spaces.distribute();
        refine_columns(spaces, hanging);
        const Contact<3> contact(spaces, frictionless<3>(true));
        for (const ContactResultants &r : resultants(contact, contact.uniform_pressure(p), nullptr))
        {
          const double face =
              integrate_boundary(spaces, geometry.boundaries.at(r.name + "_pad.contact"),
                                 [](const Point<3> &, const Tensor<1, 3> &) { return 1.; });
          CHECK(relative_error(r.area, face) <= 1e-12);
          CHECK(relative_error(r.normal_force, p * face) <= 1e-12);
        }
      }
  }

  TEST_CASE("patch_tests: faces of the default brake, which nearly match, have few common points" *
            doctest::test_suite("slow"))
  {
    // Their arcs are approximated with different spans and differ by 1e-6: the slivers between them
    // must not get as many as all the rest.
    const Geometry<3> geometry = make_brake(Parameters::All());
    FiniteElementSpace<3> spaces(geometry, 3, true, MPI_COMM_WORLD);
    spaces.distribute();
    const Contact<3> contact(spaces, frictionless<3>(true));
    unsigned int n_points = 0, n_faces = 0;
    for (const auto &interface : contact.paired_interfaces())
    {
      n_faces += interface.pad_faces.size();
      for (const auto &pair : interface.pairs)
        n_points += pair.points.size();
    }
    n_points = Utilities::MPI::sum(n_points, MPI_COMM_WORLD);
    n_faces  = Utilities::MPI::sum(n_faces, MPI_COMM_WORLD);
    MESSAGE(n_points, " points, ", n_faces, " faces");
    CHECK(n_points <= 200 * n_faces);
  }
} // namespace squeal::tests::patch_tests
