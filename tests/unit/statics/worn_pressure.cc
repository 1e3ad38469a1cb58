#include "statics.h"

#include <doctest/doctest.h>

#include <squeal/statics/worn_pressure.h>

// Worn pads in closed form (theory.md, section 3). The digits are of a program of their own, on the
// exact sector.

namespace squeal::tests::worn_pressure_tests
{
  using namespace dealii;

  namespace
  {
    Parameters::All worn_brake(const unsigned int degree)
    {
      Parameters::All prm;
      prm.discretization.degree      = degree;
      prm.discretization.rotor_cells = {{2, 20, 1}};
      prm.discretization.pad_cells   = {{2, 6, 1}};
      prm.contact.steady_pressure    = SteadyPressure::worn;
      return prm;
    }

    template <int dim>
    ContactModel<dim> sliding(const double mu, const bool mortar = true)
    {
      ContactModel<dim> model    = frictionless<dim>(mortar);
      model.angular_velocity     = dim == 3 ? 20 : 2;
      model.friction.coefficient = mu;
      return model;
    }

    /// Geometry, mesh, contact and pressure.
    template <int dim>
    struct Worn
    {
      Worn(const Parameters::All &prm, const double mu, const WearExponents &exponents,
           const bool mortar = true)
          : geometry(make_scene<dim>(prm)),
            spaces(geometry, prm.discretization.degree, mortar, MPI_COMM_WORLD)
      {
        spaces.distribute();
        contact.emplace(spaces, sliding<dim>(mu, mortar));
        const MultiVector load = assemble_pressure_load(spaces);
        pressure.emplace(*contact, exponents, load, mu != 0);
      }
      double at(const unsigned int pad, const Point<dim> &x) const
      {
        Tensor<1, dim> normal;
        normal[dim - 1] = pad == 0 ? 1 : -1;
        return pressure->at(geometry, pad, x, normal);
      }
      /// int f(x, p) of a pad.
      template <typename Function>
      double integral(const unsigned int pad, const Function &f) const
      {
        const ContactPressure p = pressure->on(*contact);
        double sum              = 0;
        contact->for_each_pair(
            [&](const unsigned int i, const ContactKinematics<dim> &k)
            {
              for (unsigned int q = 0; q < k.n_points && i == pad; ++q)
                sum += k.weights[q] * f(k.positions[q], p[i][k.first_point + q]);
            });
        return Utilities::MPI::sum(sum, MPI_COMM_WORLD);
      }

      const Geometry<dim> geometry;
      FiniteElementSpace<dim> spaces;
      std::optional<Contact<dim>> contact;
      std::optional<WornPressure<dim>> pressure;
    };

    Point<3> corner(const double r, const double degrees)
    {
      const double phi = degrees * M_PI / 180;
      return Point<3>(r * std::cos(phi), r * std::sin(phi), 0.006);
    }
  } // namespace

  TEST_CASE("worn_pressure: digits of the default pads")
  {
    struct Case
    {
      double of_speed;
      std::array<double, 3> numbers; // A, B, C
      std::array<double, 4> corners; // r 0.09: -25, +25; r 0.14: -25, +25 degrees
      double radius;                 // of friction
    };
    for (const Case &known : {Case{1,
                                   {{3.262672e4, 7.3953317e5, -9.7785671e5}},
                                   {{1.446024, 0.619504, 1.316553, 0.490033}},
                                   0.11629763},
                              Case{0,
                                   {{1.2357194e6, -2.083428e6, -8.2407361e6}},
                                   {{1.379221, 0.752337, 1.458944, 0.483792}},
                                   0.11639781}})
    {
      const Worn<3> worn(worn_brake(4), 0.6, {1, known.of_speed});
      const RigidMotion<3> &V = worn.pressure->approach()[0];
      // V.n = t_z + o_x y - o_y x
      CHECK(relative_error(V.translation[2], known.numbers[0], 1e6) <= 2e-7);
      CHECK(relative_error(-V.rotation[1], known.numbers[1], 1e7) <= 2e-7);
      CHECK(relative_error(V.rotation[0], known.numbers[2], 1e7) <= 2e-7);
      for (unsigned int c = 0; c < 4; ++c)
        CHECK(relative_error(worn.at(0, corner(c < 2 ? 0.09 : 0.14, c % 2 == 0 ? -25 : 25)),
                             1e6 * known.corners[c]) <= 2e-6);
      const double force  = worn.integral(0, [](const Point<3> &, const double p) { return p; }),
                   torque = worn.integral(0, [](const Point<3> &x, const double p)
                                          { return p * std::hypot(x[0], x[1]); });
      CHECK(relative_error(torque / force, known.radius) <= 2e-7);
      if (known.of_speed == 0)
        CHECK(relative_error(0.6 * torque, 350.437745) <= 2e-6);
      CHECK(relative_error(worn.pressure->largest(*worn.contact, 0),
                           1e6 * *std::max_element(known.corners.begin(), known.corners.end())) <=
            2e-6);
      // The lower pad is the mirror image.
      CHECK(relative_error(worn.at(1, corner(0.1, 10)), worn.at(0, corner(0.1, 10))) <= 1e-12);
    }
  }

  TEST_CASE("worn_pressure: balance of virtual work, any law, degree and formulation")
  {
    const double mu = 0.5, t = 0.012;
    for (const unsigned int degree : {1u, 2u, 3u})
      for (const auto &[exponents, mortar] :
           {std::make_pair(WearExponents{1, 1}, true), std::make_pair(WearExponents{2, 0.5}, false),
            std::make_pair(WearExponents{0.7, 1}, true)})
      {
        const Worn<3> worn(worn_brake(degree), mu, exponents, mortar);
        // Of the load as it is assembled, whose quadrature is not the contact's
        const MultiVector load = assemble_pressure_load(worn.spaces);
        const auto of_load     = [&](const std::function<double(const Point<3> &)> &f)
        {
          return -inner_product(load, interpolate(worn.spaces, {upper_pad_body},
                                                  [&](const Point<3> &x)
                                                  {
                                                    Tensor<1, 3> u;
                                                    u[2] = f(x);
                                                    return u;
                                                  }));
        };
        const double force  = of_load([](const Point<3> &) { return 1.; }),
                     load_x = of_load([](const Point<3> &x) { return x[0]; });
        CHECK(relative_error(worn.integral(0, [](const Point<3> &, double p) { return p; }),
                             force) <= 1e-11);
        CHECK(relative_error(
                  worn.integral(0, [&](const Point<3> &x, double p)
                                { return p * (x[0] - t * mu * x[1] / std::hypot(x[0], x[1])); }),
                  load_x) <= 1e-10);
        CHECK(std::abs(worn.integral(0,
                                     [&](const Point<3> &x, double p) {
                                       return p * (x[1] + t * mu * x[0] / std::hypot(x[0], x[1]));
                                     })) <= 1e-10 * load_x);
      }
  }

  TEST_CASE("worn_pressure: a block under a layer, and one that is worn free")
  {
    // int p = p_0 L, int p (x + t mu) = 0: p = A + B x, A = p_0, B = -12 t mu p_0/L^2.
    Parameters::All prm            = worn_brake(2);
    prm.scene                      = Scene::strip;
    prm.discretization.rotor_cells = {{1, 31, 2}};
    prm.discretization.pad_cells   = {{1, 8, 2}};
    const double L = prm.strip.block_length, t = prm.strip.block_thickness, mu = 0.3;
    const Worn<2> worn(prm, mu, {1, 1});
    for (const double x : {-L / 2, 0., L / 3})
      CHECK(relative_error(worn.at(0, Point<2>(x, 0)), 1e6 * (1 - 12 * t * mu * x / (L * L)),
                           1e6) <= 1e-11);
    CHECK(!worn.pressure->is_open(0));
    // Wider than L (1 - 2 t mu/L)... p = A (b - x) on [-L/2, b]: its centre is t mu from the
    // middle.
    const double steep = 0.6, b = 3 * (L / 2 - t * steep) - L / 2;
    REQUIRE(b < L / 2);
    Worn<2> open(prm, steep, {1, 1});
    CHECK(open.pressure->is_open(0));
    CHECK(open.at(0, Point<2>(b + 1e-3, 0)) == 0);
    CHECK(open.at(0, Point<2>(b - 2e-3, 0)) > 0);
    CHECK(relative_error(open.integral(0, [](const Point<2> &, double p) { return p; }), 1e6 * L) <=
          1e-11);
    const unsigned int all = open.contact->n_active_multipliers();
    open.pressure->release(*open.contact);
    const double share = 1 - double(open.contact->n_active_multipliers()) / all;
    CHECK(std::abs(share - (L / 2 - b) / L) < 0.08); // of nodes
  }
} // namespace squeal::tests::worn_pressure_tests
