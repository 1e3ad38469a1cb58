#include "fields.h"

#include <doctest/doctest.h>

#include <squeal/bodies/body_operators.h>

#include <deal.II/base/tensor.h>
namespace squeal::tests::body_operators_tests
{
  using namespace dealii;

  namespace
  {
    const Material material{2e11, 0.3, 7000, 0, 0};

    /// A free ring of (radial, around, axial) cells without pads.
    Geometry<3> free_ring(const std::array<unsigned int, 3> &cells)
    {
      Parameters::All p;
      p.rotor.clamped              = Clamped::none;
      p.rotor.thickness            = 0.03;
      p.pads.arrangement           = Arrangement::none;
      p.discretization.rotor_cells = cells;
      return make_brake(p);
    }

    /// Refines the one cell of the ring that begins at phi = 0 (and, of several, lies inside and
    /// below).
    void refine_one_cell(FiniteElementSpace<3> &spaces)
    {
      refine_where(spaces,
                   [](const Point<3> &centre, const types::material_id)
                   {
                     const double phi = std::atan2(centre[1], centre[0]);
                     return phi > 0 && phi < M_PI / 3 && std::hypot(centre[0], centre[1]) < 0.101 &&
                            centre[2] < 0.001;
                   });
    }

    Tensor<1, 3> times(const Tensor<2, 3> &A, const Point<3> &x)
    {
      return A * Tensor<1, 3>(x);
    }

    /// (-y, x, 0)
    Tensor<1, 3> transport(const Point<3> &x)
    {
      return Tensor<1, 3>({-x[1], x[0], 0.});
    }

    const Tensor<2, 3> A({{0.3, -0.2, 0.5}, {0.7, 0.1, -0.4}, {-0.6, 0.25, 0.8}});
    const Tensor<2, 3> B({{-0.5, 0.9, 0.1}, {0.2, 0.35, 0.6}, {0.45, -0.15, -0.3}});
  } // namespace

  TEST_CASE("body_operators: M, K, M* are symmetric and G is skew, entry by entry")
  {
    // Hanging nodes on faces with curved edges included. In serial every pair of entries is added
    // in the same order; on several ranks the order of summation, and so the last digit, may
    // differ.
    for (const unsigned int degree : {1u, 2u, 3u})
    {
      CAPTURE(degree);
      const Geometry<3> geometry = free_ring({{2, 6, degree == 3 ? 1u : 2u}});
      FiniteElementSpace<3> spaces(geometry, degree, false, MPI_COMM_WORLD);
      refine_one_cell(spaces);
      CHECK(Utilities::MPI::max(spaces.hanging.n_constraints(), MPI_COMM_WORLD) > 0);
      const BodyMatrices body = assemble_body(spaces, {rotor_body}, material, true);
      const double tolerance  = 1e-15;
      CHECK(asymmetry(spaces.rows, *body.M) <= tolerance);
      CHECK(asymmetry(spaces.rows, *body.K) <= tolerance);
      CHECK(asymmetry(spaces.rows, *body.M_star) <= tolerance);
      CHECK(asymmetry(spaces.rows, *body.G, 1) <= tolerance);
    }
  }

  TEST_CASE("body_operators: the stiffness is the sum of those of its components")
  {
    const Geometry<3> geometry = free_ring({{2, 6, 2}});
    FiniteElementSpace<3> spaces(geometry, 2, false, MPI_COMM_WORLD);
    refine_one_cell(spaces);
    Material axial               = material;
    axial.transversely_isotropic = true;
    axial.axial_young_modulus    = 0.4 * material.young_modulus;
    axial.axial_poisson_ratio    = 0.2;
    axial.axial_shear_modulus    = 0.3 * material.young_modulus;
    for (const Material &of : {material, axial})
    {
      const auto matrices      = assemble_stiffnesses(spaces, {rotor_body}, of);
      const auto whole         = assemble_body(spaces, {rotor_body}, of, false).K;
      std::vector<Summand> sum = {{-1., *whole}};
      for (unsigned int k = 0; k < matrices.size(); ++k)
        sum.push_back({elastic_components<3>(of)[k].coefficient, *matrices[k]});
      const Matrix rest = sum_of(spaces.rows, sum);
      CHECK((rest ? rest.infinity_norm() : 0) <= 1e-14 * whole->infinity_norm());
    }
  }

  TEST_CASE("body_operators: on a conforming mesh the symmetries are exact in serial")
  {
    const Geometry<3> geometry = free_ring({{2, 6, 1}});
    FiniteElementSpace<3> spaces(geometry, 2, false, MPI_COMM_WORLD);
    spaces.distribute();
    const BodyMatrices body = assemble_body(spaces, {rotor_body}, material, true);
    const double tolerance  = n_ranks() == 1 ? 0 : 1e-15;
    CHECK(asymmetry(spaces.rows, *body.M) <= tolerance);
    CHECK(asymmetry(spaces.rows, *body.K) <= tolerance);
    CHECK(asymmetry(spaces.rows, *body.M_star) <= tolerance);
    CHECK(asymmetry(spaces.rows, *body.G, 1) <= tolerance);
  }

  TEST_CASE("body_operators: linear fields on a mesh with hanging nodes")
  {
    // The hanging nodes lie on plane faces phi = const, where linear fields are reproduced exactly.
    // With u = A x, v = B x everything is an integral of polynomials over the meshed body of volume
    // V:
    //   K: the stress does no work on rigid-body motions; energy 1/2 (lambda tr^2 + 2 mu eps:eps)
    //   V; M: rho V per direction;  M*: int rho (A w).(B w), and nothing for constants; G: 1/2 int
    //   rho [v.(A w) - u.(B w)], skew: nothing between equal fields.
    for (const unsigned int degree : {1u, 2u, 3u})
    {
      CAPTURE(degree);
      const Geometry<3> geometry = free_ring({{1, 6, 1}});
      FiniteElementSpace<3> spaces(geometry, degree, false, MPI_COMM_WORLD);
      refine_one_cell(spaces);
      CHECK(spaces.triangulation.n_global_active_cells() == 5 + 8);
      const BodyMatrices body = assemble_body(spaces, {rotor_body}, material, true);
      const double rho        = material.density;
      const double V = integrate(spaces, {rotor_body}, [](const Point<3> &) { return 1.; });

      for (unsigned int c = 0; c < 3; ++c)
      {
        const MultiVector shift = translation(spaces, {rotor_body}, c);
        Tensor<1, 3> axis;
        axis[c] = 1;
        const MultiVector rotation =
            interpolate(spaces, {rotor_body},
                        [&](const Point<3> &x) { return cross_product_3d(axis, Tensor<1, 3>(x)); });
        CHECK(largest_entry(multiply(*body.K, shift)) <= 1e-14 * body.K->infinity_norm());
        CHECK(largest_entry(multiply(*body.K, rotation)) <=
              1e-14 * body.K->infinity_norm() * largest_entry(rotation));
        CHECK(relative_error(bilinear_form(shift, *body.M, shift), rho * V) <= 1e-13);
        CHECK(largest_entry(multiply(*body.M_star, shift)) <= 1e-14 * body.M_star->infinity_norm());
        for (unsigned int d = 0; d < 3; ++d)
        {
          const MultiVector other = translation(spaces, {rotor_body}, d);
          CHECK(std::abs(bilinear_form(other, *body.G, shift)) <= 1e-14 * rho * V);
          if (c != d)
            CHECK(std::abs(bilinear_form(other, *body.M, shift)) <= 1e-14 * rho * V);
        }
      }

      const MultiVector u =
          interpolate(spaces, {rotor_body}, [](const Point<3> &x) { return times(A, x); });
      const MultiVector v =
          interpolate(spaces, {rotor_body}, [](const Point<3> &x) { return times(B, x); });
      const Tensor<2, 3> eps = 0.5 * (A + transpose(A));
      const double lambda = material.lame_lambda(), mu = material.shear_modulus();
      CHECK(relative_error(bilinear_form(u, *body.K, u),
                           (lambda * std::pow(trace(eps), 2) + 2 * mu * eps.norm_square()) * V) <=
            1e-12);
      const auto integral = [&](const auto &function)
      { return rho * integrate(spaces, {rotor_body}, function); };
      CHECK(relative_error(bilinear_form(v, *body.M, u),
                           integral([](const Point<3> &x) { return times(B, x) * times(A, x); })) <=
            1e-12);
      CHECK(relative_error(bilinear_form(v, *body.M_star, u),
                           integral([](const Point<3> &x)
                                    { return (B * transport(x)) * (A * transport(x)); })) <= 1e-12);
      const double g = integral(
          [](const Point<3> &x)
          { return 0.5 * (times(B, x) * (A * transport(x)) - times(A, x) * (B * transport(x))); });
      CHECK(relative_error(bilinear_form(v, *body.G, u), g) <= 1e-12);
      CHECK(relative_error(bilinear_form(u, *body.G, v), -g) <= 1e-12);
      CHECK(std::abs(bilinear_form(u, *body.G, u)) <= 1e-14 * std::abs(g));
    }
  }

  TEST_CASE("body_operators: integrals over the ring")
  {
    // Degree 3 with 16 cells around approximates the cylinders to about 1e-7.
    //   int rho = rho pi (r_o^2 - r_i^2) h;
    //   M* of u = x e_i: int rho y^2 = rho pi h (r_o^4 - r_i^4)/4;
    //   G with v = y e_x, u = x e_x: 1/2 int rho (y (-y) - x (x)) = -int rho y^2, as without
    //   integration by parts.
    const Geometry<3> geometry = free_ring({{1, 16, 1}});
    FiniteElementSpace<3> spaces(geometry, 3, false, MPI_COMM_WORLD);
    spaces.distribute();
    const BodyMatrices body = assemble_body(spaces, {rotor_body}, material, true);
    const double ri = 0.05, ro = 0.15, h = 0.03, rho = material.density;
    const MultiVector shift = translation(spaces, {rotor_body}, 1);
    CHECK(relative_error(bilinear_form(shift, *body.M, shift),
                         rho * M_PI * (ro * ro - ri * ri) * h) <= 1e-6);
    const double second_moment = rho * M_PI * h * (std::pow(ro, 4) - std::pow(ri, 4)) / 4;
    for (unsigned int c = 0; c < 3; ++c)
    {
      const auto field = [&](const unsigned int coordinate)
      {
        return interpolate(spaces, {rotor_body},
                           [&](const Point<3> &x)
                           {
                             Tensor<1, 3> u;
                             u[c] = x[coordinate];
                             return u;
                           });
      };
      CHECK(relative_error(bilinear_form(field(0), *body.M_star, field(0)), second_moment) <= 1e-6);
      CHECK(relative_error(bilinear_form(field(1), *body.G, field(0)), -second_moment) <= 1e-6);
      CHECK(relative_error(bilinear_form(field(0), *body.G, field(1)), second_moment) <= 1e-6);
    }
    // The same rotation about the axis as rigid body and as transport: G and M* of the field w =
    // e_z x x give d_phi w = e_z x w = -(x, y, 0): M*: int rho r^2 = 2 int rho y^2; G: int rho
    // w.(-x) = 0.
    const MultiVector w = interpolate(spaces, {rotor_body}, transport);
    CHECK(relative_error(bilinear_form(w, *body.M_star, w), 2 * second_moment) <= 1e-6);
  }

  TEST_CASE("body_operators: translations on a curved mesh with hanging nodes on its cylinders")
  {
    const Geometry<3> geometry = free_ring({{2, 6, 1}});
    FiniteElementSpace<3> spaces(geometry, 2, false, MPI_COMM_WORLD);
    refine_one_cell(spaces);
    const BodyMatrices body = assemble_body(spaces, {rotor_body}, material, true);
    const double V          = integrate(spaces, {rotor_body}, [](const Point<3> &) { return 1.; });
    for (unsigned int c = 0; c < 3; ++c)
    {
      const MultiVector shift = translation(spaces, {rotor_body}, c);
      CHECK(largest_entry(multiply(*body.K, shift)) <= 1e-14 * body.K->infinity_norm());
      CHECK(largest_entry(multiply(*body.M_star, shift)) <= 1e-14 * body.M_star->infinity_norm());
      CHECK(relative_error(bilinear_form(shift, *body.M, shift), material.density * V) <= 1e-13);
    }
  }

  // x is a finite element function although the nodes of the refined cell are not those of the
  // cylinder: hanging ones lie on the neighbour's polynomial arc. (Left on the cylinder they would
  // give the rotation a strain energy of 9e-5 E V here.)
  TEST_CASE("body_operators: rotations of a mesh with hanging nodes on its cylinders")
  {
    const Geometry<3> geometry = free_ring({{2, 6, 1}});
    FiniteElementSpace<3> spaces(geometry, 2, false, MPI_COMM_WORLD);
    refine_one_cell(spaces);
    const BodyMatrices body = assemble_body(spaces, {rotor_body}, material, false);
    const double V          = integrate(spaces, {rotor_body}, [](const Point<3> &) { return 1.; });
    const MultiVector rotation = interpolate(spaces, {rotor_body}, transport);
    CHECK(bilinear_form(rotation, *body.K, rotation) <= 1e-12 * material.young_modulus * V);
  }

  TEST_CASE("body_operators: matrices of one body do not touch another")
  {
    // Upper and lower pad together weigh 2 rho V_pad; the rotor is no part of it. Only the axial
    // component is free on the guided back faces.
    Parameters::All p;
    p.discretization.rotor_cells = {{1, 6, 1}};
    p.discretization.pad_cells   = {{1, 2, 1}};
    p.rotor.clamped              = Clamped::none;
    const Geometry<3> geometry   = make_brake(p);
    FiniteElementSpace<3> spaces(geometry, 2, true, MPI_COMM_WORLD);
    spaces.distribute();
    const BodyMatrices pads =
        assemble_body(spaces, {upper_pad_body, lower_pad_body}, material, false);
    const double V = integrate(spaces, {upper_pad_body}, [](const Point<3> &) { return 1.; });
    const MultiVector of_rotor = translation(spaces, {rotor_body}, 2);
    const MultiVector of_upper = translation(spaces, {upper_pad_body}, 2);
    const MultiVector of_all   = translation(spaces, all_bodies, 2);
    CHECK_FALSE(bool(pads.G));
    CHECK_FALSE(bool(pads.M_star));
    CHECK(largest_entry(multiply(*pads.M, of_rotor)) == 0);
    CHECK(largest_entry(multiply(*pads.K, of_rotor)) == 0);
    CHECK(relative_error(bilinear_form(of_upper, *pads.M, of_upper), material.density * V) <=
          1e-13);
    CHECK(relative_error(bilinear_form(of_all, *pads.M, of_all), 2 * material.density * V) <=
          1e-13);
    // Rows of multipliers are empty.
    const MultiVector pressure = constant_multiplier(spaces, 1.);
    CHECK(largest_entry(multiply(*pads.M, pressure)) == 0);
    CHECK(largest_entry(multiply(*pads.K, pressure)) == 0);
  }

  TEST_CASE("body_operators: resultants of the pressure load")
  {
    // p A of each back face towards the rotor, so -p A e_z on the upper pad and +p A e_z on the
    // lower one, with A = angle (b^2 - a^2)/2; moments p A times the centroid's radius r_s, r_s A =
    // (2/3) sin(angle/2) (b^3 - a^3).
    Parameters::All p;
    p.discretization.rotor_cells = {{1, 6, 1}};
    p.discretization.pad_cells   = {{1, 3, 1}};
    p.pads.pressure              = 3e5;
    p.pads.back_face             = BackFace::free;
    for (const bool refined : {false, true})
    {
      CAPTURE(refined);
      const Geometry<3> geometry = make_brake(p);
      FiniteElementSpace<3> spaces(geometry, 3, true, MPI_COMM_WORLD);
      spaces.distribute();
      if (refined) // the middle third of the upper pad: hanging nodes on the loaded face
        refine_where(spaces, [](const Point<3> &x, const types::material_id body)
                     { return body == upper_pad_body && std::abs(x[1]) < 0.01; });
      const MultiVector load = assemble_pressure_load(spaces);
      const double angle = 50 * M_PI / 180, a = p.pads.inner_radius, b = p.pads.outer_radius;
      const double force = p.pads.pressure * angle / 2 * (b * b - a * a);
      const double moment =
          p.pads.pressure * 2. / 3 * std::sin(angle / 2) * (b * b * b - a * a * a);
      for (const Body pad : {upper_pad_body, lower_pad_body})
      {
        const double sign       = pad == upper_pad_body ? -1 : 1;
        const auto virtual_work = [&](const MultiVector &u) { return inner_product(u, load); };
        CHECK(relative_error(virtual_work(translation(spaces, {pad}, 2)), sign * force) <= 1e-7);
        CHECK(std::abs(virtual_work(translation(spaces, {pad}, 0))) <= 1e-13 * force);
        CHECK(std::abs(virtual_work(translation(spaces, {pad}, 1))) <= 1e-13 * force);
        const MultiVector tilt = interpolate(spaces, {pad},
                                             [](const Point<3> &x) {
                                               return Tensor<1, 3>({0., 0., x[0]});
                                             });
        CHECK(relative_error(virtual_work(tilt), sign * moment) <= 1e-7);
      }
      CHECK(largest_entry(interpolate(spaces, {rotor_body}, transport)) > 0);
      CHECK(std::abs(inner_product(translation(spaces, {rotor_body}, 2), load)) == 0);
      CHECK(std::abs(inner_product(constant_multiplier(spaces, 1), load)) == 0);
    }
  }
} // namespace squeal::tests::body_operators_tests
