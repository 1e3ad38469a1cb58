#include "fields.h"

#include <doctest/doctest.h>

#include <squeal/bodies/body_operators.h>
#include <squeal/bodies/prestress.h>
#include <squeal/linalg/factorization.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_values.h>
namespace squeal::tests::prestress_tests
{
  using namespace dealii;

  // A free rotor that spins about a tilted axis is at rest in inertial coordinates. So the tilt u =
  // e_x x x is a static solution: the stress that the centrifugal load causes must hold it against
  // the transport terms, (K + K_sigma - Omega^2 M*) u = 0, with K u = 0. In the weak form it holds
  // to rounding on any mesh, because the tilted test functions are test functions too.
  TEST_CASE("prestress: a spinning free rotor may tilt" * doctest::test_suite("slow"))
  {
    const double omega = 150;
    Parameters::All p;
    p.rotor.clamped              = Clamped::none;
    p.pads.arrangement           = Arrangement::none;
    p.discretization.rotor_cells = {{2, 36, 1}};
    for (const unsigned int degree : {1u, 2u, 3u})
    {
      CAPTURE(degree);
      const Geometry<3> geometry = make_brake(p);
      FiniteElementSpace<3> spaces(geometry, degree, false, MPI_COMM_WORLD);
      spaces.distribute();
      const Material material = p.rotor.material;
      const BodyMatrices body = assemble_body(spaces, {rotor_body}, material, true);
      const MultiVector load  = assemble_centrifugal_load(spaces, {rotor_body}, material, omega);
      // A very soft support selects one of the static states; they differ by rigid motions.
      const Matrix held = sum_of(spaces.rows, {{1., *body.K}, {1e-2, *body.M}});
      const MultiVector state =
          Factorization(held, Factorization::Kind::lu, "the held rotor").solve(load);
      const Matrix K_sigma = assemble_stress_stiffness(spaces, {rotor_body}, material, state);
      CHECK(asymmetry(spaces.rows, K_sigma) <= 1e-15);

      const MultiVector tilt  = interpolate(spaces, {rotor_body},
                                            [](const Point<3> &x)
                                            {
                                             Tensor<1, 3> u;
                                             u[1] = -x[2];
                                             u[2] = x[1];
                                             return u;
                                           });
      const DenseMatrix stiff = replicated(multiply(K_sigma, tilt)),
                        soft  = replicated(multiply(*body.M_star, tilt));
      double difference = 0, size = 0;
      for (unsigned int i = 0; i < stiff.n_rows; ++i)
      {
        const double expected = omega * omega * soft(i, 0);
        difference            = std::max(difference, std::abs(stiff(i, 0) - expected));
        size                  = std::max(size, std::abs(expected));
      }
      CHECK(difference <= 2e-4 * size);

      const auto wave = [](const Point<3> &x, const unsigned int c)
      { return std::sin(20 * x[0] + c) * std::cos(15 * x[1] - c) + 30 * x[2] * x[c]; };
      const MultiVector v        = interpolate(spaces, {rotor_body},
                                               [&](const Point<3> &x)
                                               {
                                          Tensor<1, 3> u;
                                          for (unsigned int c = 0; c < 3; ++c)
                                            u[c] = wave(x, c);
                                          return u;
                                        });
      const MultiVector v_turned = interpolate(spaces, {rotor_body},
                                               [&](const Point<3> &x)
                                               {
                                                 Tensor<1, 3> u;
                                                 u[1] = wave(x, 2);
                                                 u[2] = -wave(x, 1);
                                                 return u;
                                               });
      CHECK(relative_error(bilinear_form(v, K_sigma, tilt), inner_product(load, v_turned)) <= 1e-8);

      // The load's own work: int rho Omega^2 r^2 = (x, y, 0).f
      const MultiVector outwards = interpolate(spaces, {rotor_body},
                                               [](const Point<3> &x)
                                               {
                                                 Tensor<1, 3> u;
                                                 u[0] = x[0];
                                                 u[1] = x[1];
                                                 return u;
                                               });
      const double expected      = material.density * omega * omega * M_PI / 2 *
                              (std::pow(0.15, 4) - std::pow(0.05, 4)) * 0.012;
      CHECK(relative_error(inner_product(outwards, load), expected) <= (degree == 1 ? 2e-2 : 1e-5));
    }
  }

  // The part of the energy int sigma_0 : E(u), E the Green strain, sigma_0 = C grad u_0 held fixed,
  // has K_sigma as its second derivative: W(v + w) - W(v) - W(w) = v^T K_sigma w exactly. Quadratic
  // fields on rectangles are represented exactly, so W may be integrated from their formulas.
  TEST_CASE("prestress: the second derivative of the energy of a held stress")
  {
    Parameters::All p;
    p.scene                      = Scene::strip;
    p.discretization.rotor_cells = {{1, 10, 1}};
    p.discretization.pad_cells   = {{1, 4, 2}};
    Geometry<2> geometry         = make_strip(p);
    geometry.supports.clear();
    FiniteElementSpace<2> spaces(geometry, 2, false, MPI_COMM_WORLD);
    spaces.distribute();
    const Material material = p.pads.material;

    // A quadratic field with coefficients that depend on a seed, and its gradient.
    const auto field = [](const unsigned int seed)
    {
      return [seed](const Point<2> &x)
      {
        Tensor<1, 2> u;
        for (unsigned int c = 0; c < 2; ++c)
          u[c] = scattered(c, seed) * x[0] * x[0] + scattered(c + 2, seed) * x[0] * x[1] +
                 scattered(c + 4, seed) * x[1] * x[1] + 0.1 * scattered(c + 6, seed) * x[0] +
                 0.1 * scattered(c + 8, seed) * x[1];
        return u;
      };
    };
    const auto gradient = [](const unsigned int seed, const Point<2> &x)
    {
      Tensor<2, 2> g; // d_j u_i
      for (unsigned int c = 0; c < 2; ++c)
      {
        g[c][0] = 2 * scattered(c, seed) * x[0] + scattered(c + 2, seed) * x[1] +
                  0.1 * scattered(c + 6, seed);
        g[c][1] = scattered(c + 2, seed) * x[0] + 2 * scattered(c + 4, seed) * x[1] +
                  0.1 * scattered(c + 8, seed);
      }
      return g;
    };

    const std::vector<Body> block = {upper_pad_body};
    const auto nodal              = [&](const unsigned int seed)
    { return interpolate(spaces, block, field(seed)); };
    const Matrix K_sigma  = assemble_stress_stiffness(spaces, block, material, nodal(1));
    const double computed = bilinear_form(nodal(2), K_sigma, nodal(3));

    FEValues<2> fe_values(spaces.mapping, spaces.fe, QGauss<2>(4),
                          update_quadrature_points | update_JxW_values);
    double v_and_w = 0, v = 0, w = 0;
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned() && cell->material_id() == upper_pad_body)
      {
        fe_values.reinit(cell);
        for (const unsigned int q : fe_values.quadrature_point_indices())
        {
          const Point<2> &x = fe_values.quadrature_point(q);
          const Tensor<2, 2> strain =
              (gradient(1, x) + Tensor<2, 2>(transpose(gradient(1, x)))) / 2;
          Tensor<2, 2> stress = 2 * material.shear_modulus() * strain;
          for (unsigned int d = 0; d < 2; ++d)
            stress[d][d] += material.lame_lambda() * trace(strain);
          const auto energy = [&](const Tensor<2, 2> &g)
          {
            const Tensor<2, 2> green =
                (g + Tensor<2, 2>(transpose(g)) + Tensor<2, 2>(transpose(g) * g)) / 2;
            return scalar_product(stress, green) * fe_values.JxW(q);
          };
          v_and_w += energy(gradient(2, x) + gradient(3, x));
          v += energy(gradient(2, x));
          w += energy(gradient(3, x));
        }
      }
    const double expected = Utilities::MPI::sum(v_and_w - v - w, MPI_COMM_WORLD);
    CHECK(relative_error(computed, expected) <= 1e-9);
  }
} // namespace squeal::tests::prestress_tests
