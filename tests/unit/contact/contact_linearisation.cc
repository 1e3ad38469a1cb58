#include "fields.h"

#include <doctest/doctest.h>

#include <squeal/contact/contact.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/contact/contact_matrices.h>
namespace squeal::tests::contact_linearisation_tests
{
  using namespace dealii;

  namespace
  {
    const double p_0 = 1e6, k_C = 1e9, depth = p_0 / k_C;

    /// Free bodies, meshes that do not match.
    template <int dim>
    Geometry<dim> make_scene()
    {
      Parameters::All p;
      p.rotor.clamped              = Clamped::none;
      p.pads.back_face             = BackFace::free;
      p.discretization.rotor_cells = {{1, 10, 1}};
      p.discretization.pad_cells   = {{1, 3, 1}};
      Geometry<dim> geometry;
      if constexpr (dim == 3)
        geometry = make_brake(p);
      else
        geometry = make_strip(p);
      geometry.supports.clear();
      return geometry;
    }

    /// mu(v, p) = 0.5 (1 + 0.3 exp(-v)) (p/1e6)^(-0.1)
    FrictionLaw law_of(const FrictionLaw::Kind kind, const double smoothing_speed)
    {
      FrictionLaw law;
      law.kind               = kind;
      law.coefficient        = 0.4;
      law.coefficient_moving = 0.1;
      law.decay_speed        = 0.3;
      law.smoothing_speed    = smoothing_speed;
      law.expression         = [](const double v, const double p)
      { return 0.5 * (1 + 0.3 * std::exp(-v)) * std::pow(p / 1e6, -0.1); };
      return law;
    }

    template <int dim>
    struct ContactScene
    {
      explicit ContactScene(const bool mortar)
          : mortar(mortar), geometry(make_scene<dim>()), spaces(geometry, 2, mortar, MPI_COMM_WORLD)
      {
        spaces.distribute();
        for (unsigned int c = 0; c < dim; ++c)
          masks.push_back(translation(spaces, all_bodies, c));
        masks.push_back(constant_multiplier(spaces, 1));
      }

      Contact<dim> contact(const FrictionLaw &law, const double omega,
                           const bool transports = true) const
      {
        ContactModel<dim> model;
        model.mortar            = mortar;
        model.penalty_stiffness = k_C;
        model.friction          = law;
        model.angular_velocity  = omega;
        model.transports        = transports;
        model.initial_gap       = [](const Point<dim> &x) { return 0.1 * depth * (1 + 5 * x[0]); };
        Contact<dim> result(spaces, model);
        result.scale_constraints(1e3 * normal_matrix(result).infinity_norm());
        return result;
      }

      /// Scattered numbers times a size in the rows of some displacement components and multipliers
      /// (the last).
      MultiVector scatter(const std::array<double, dim + 1> &sizes, const unsigned int seed) const
      {
        MultiVector result(spaces.rows, 1);
        for (unsigned int c = 0; c <= dim; ++c)
          for (unsigned int i = 0; i < spaces.rows.n_local(); ++i)
            result.data()[i] +=
                sizes[c] * masks[c].data()[i] * scattered(spaces.rows.begin + i, seed);
        return result;
      }

      /// Positive pressures that vary from node to node and a rotor without d_phi u: it swells (2D:
      /// rises), the pads' displacements are scattered.
      MultiVector base(const double pressure_scale) const
      {
        const MultiVector swell = interpolate(spaces, {rotor_body},
                                              [](const Point<dim> &x)
                                              {
                                                Tensor<1, dim> u;
                                                u[dim - 1] =
                                                    dim == 3 ? depth * x[2] / 0.006 : depth;
                                                return u;
                                              });
        const MultiVector pads  = interpolate(
             spaces, {upper_pad_body, lower_pad_body},
             [](const Point<dim> &x)
             {
              Tensor<1, dim> u;
              for (unsigned int c = 0; c < dim; ++c)
                u[c] = 0.2 * depth * (std::sin(90 * x[0] + c) + std::cos(70 * x[dim - 2] - 2 * c));
              return u;
            });
        MultiVector result = scatter({}, 0);
        for (unsigned int i = 0; i < spaces.rows.n_local(); ++i)
          result.data()[i] = swell.data()[i] + pads.data()[i] +
                             masks[dim].data()[i] * p_0 / pressure_scale *
                                 (1 + 0.2 * scattered(spaces.rows.begin + i, 9));
        return result;
      }

      const bool mortar;
      const Geometry<dim> geometry;
      FiniteElementSpace<dim> spaces;
      std::vector<MultiVector>
          masks; ///< 1 in the rows of each displacement component and the multipliers
    };

    /// |computed - expected|/|expected|, 2-norms over displacement rows and over multiplier rows,
    /// the worse of them.
    template <int dim>
    double difference(const ContactScene<dim> &scene, const MultiVector &computed,
                      const MultiVector &expected)
    {
      const DenseMatrix a = replicated(computed), b = replicated(expected),
                        is_multiplier = replicated(scene.masks[dim]);
      double errors[2] = {0, 0}, norms[2] = {0, 0};
      for (unsigned int i = 0; i < a.n_rows; ++i)
      {
        const unsigned int part = is_multiplier(i, 0) != 0;
        errors[part] += std::pow(a(i, 0) - b(i, 0), 2);
        norms[part] += std::pow(b(i, 0), 2);
      }
      CHECK(norms[0] > 0);
      return std::sqrt(
          std::max(errors[0] / norms[0], norms[1] > 0 ? errors[1] / norms[1] : errors[1]));
    }

    template <int dim>
    void check_linearisation(const bool mortar, const FrictionLaw::Kind kind)
    {
      const ContactScene<dim> scene(mortar);
      for (const double smoothing_speed : {0., 0.2})
        for (const auto &[omega, transports] :
             {std::make_pair(4., true), std::make_pair(-1.5, true), std::make_pair(-1.5, false)})
        {
          CAPTURE(mortar);
          CAPTURE(smoothing_speed);
          CAPTURE(omega);
          CAPTURE(transports);
          const Contact<dim> contact = scene.contact(law_of(kind, smoothing_speed),
                                                     dim == 3 ? omega : omega / 8, transports);
          const MultiVector state    = scene.base(contact.pressure_scale()),
                            rest(scene.spaces.rows, 1);
          const auto pressure = contact.pressure_of(state);
          for (const ContactResultants &r : resultants(contact, pressure, &state))
          {
            CHECK(r.min_pressure == 0); // no tension
            CHECK(r.max_pressure > 1.1 * p_0);
          }
          const Matrix N = normal_matrix(contact), T = friction_matrix(contact, pressure);
          const auto damping = friction_damping(contact, pressure);

          // (F(x + h dx, v + h dv) - F(x - h dx, v - h dv)) / (2 h)
          const auto quotient =
              [&](const MultiVector &dx, const MultiVector &dv, const double h, const bool mu)
          {
            const MultiVector after = nonlinear_forces(contact, sum(state, h, dx), sum(rest, h, dv),
                                                       mu),
                              before = nonlinear_forces(contact, sum(state, -h, dx),
                                                        sum(rest, -h, dv), mu);
            return sum(sum(rest, 0.5 / h, after), -0.5 / h, before);
          };

          // The change of the pressure and of the sliding speed by a step is some 1e-4 of them.
          std::array<double, dim + 1> sizes;
          sizes.fill(1);
          sizes[dim]               = p_0 / depth / contact.pressure_scale();
          const double h           = 1e-4 * depth;
          const MultiVector any    = scene.scatter(sizes, 1);
          const MultiVector normal = quotient(any, rest, h, false),
                            both   = quotient(any, rest, h, true);
          CHECK(difference(scene, multiply(N, any), normal) <= 1e-6);
          const MultiVector Q_any =
              sum(multiply(damping.Q, any), 1, multiply(damping.Q_falling, any));
          CHECK(difference(scene, sum(multiply(T, any), 1, Q_any), sum(both, -1, normal)) <= 1e-6);

          // Tangential displacements leave the pressure alone: Q and Q_falling by themselves.
          sizes[dim - 1] = sizes[dim] = 0;
          const MultiVector in_plane  = scene.scatter(sizes, 2);
          const MultiVector Q_in_plane =
              sum(multiply(damping.Q, in_plane), 1, multiply(damping.Q_falling, in_plane));
          const MultiVector shear = quotient(in_plane, rest, h, true);
          CHECK(bool(damping.Q) == (dim == 3 && transports));
          if (damping.Q || damping.Q_falling)
            CHECK(difference(scene, Q_in_plane, shear) <= 1e-6);
          else
            CHECK(largest_entry(shear) <= 1e-9 * largest_entry(both));

          // The directions turn with the surface: what differs from fixed directions.
          sizes.fill(1);
          sizes[dim] = p_0 / depth / contact.pressure_scale();
          for (const bool mu : {false, true})
          {
            const auto turning = turning_contact(contact, pressure, mu);
            const auto forces  = [&](const double step)
            {
              const MultiVector x = sum(state, step, any);
              return sum(nonlinear_forces(contact, x, rest, mu, &state), -1,
                         nonlinear_forces(contact, x, rest, mu));
            };
            // Slopes, unlike pressures, stay small for much larger steps.
            const double step = 1e-7;
            MultiVector turned =
                sum(sum(rest, 0.5 / step, forces(step)), -0.5 / step, forces(-step));
            // Nothing happens in the constraints, up to the order of summation.
            for (unsigned int row = 0; row < turned.n_local(); ++row)
              turned.data()[row] *= 1 - scene.masks[dim].data()[row];
            CHECK(
                difference(scene,
                           sum(multiply(turning.pressure, any), 1, multiply(turning.friction, any)),
                           turned) <= 1e-6);
            CHECK(asymmetry(scene.spaces.rows, turning.pressure) <= 1e-13);
          }

          sizes.fill(1);
          sizes[dim]             = 0;
          const MultiVector rate = scene.scatter(sizes, 3);
          const MultiVector P_rate =
              sum(multiply(damping.P, rate), 1, multiply(damping.P_falling, rate));
          const MultiVector drag = quotient(rest, rate, 1e-5, true);
          if (dim == 3 || damping.P_falling)
            CHECK(difference(scene, P_rate, drag) <= 1e-6);
          else
            CHECK(largest_entry(drag) <= 1e-9 * largest_entry(both));
        }
    }

    template <int dim>
    void check_laws()
    {
      for (const bool mortar : {true, false})
        for (const FrictionLaw::Kind kind :
             {FrictionLaw::Kind::constant, FrictionLaw::Kind::falling,
              FrictionLaw::Kind::expression})
        {
          CAPTURE(static_cast<int>(kind));
          check_linearisation<dim>(mortar, kind);
        }
    }
  } // namespace

  // The matrices are the derivatives of the nonlinear forces at a steady state in which v = Omega
  // w: d_phi u_0 = 0. Central differences with steps of 1e-4 relative are wrong by about 1e-8.
  TEST_CASE("contact_linearisation: difference quotients of the nonlinear forces, brake")
  {
    check_laws<3>();
  }

  TEST_CASE("contact_linearisation: difference quotients of the nonlinear forces, strip")
  {
    check_laws<2>();
  }

  TEST_CASE("contact_linearisation: the turning contact at rest is the limit of slow turning")
  {
    for (const double sign : {1., -1.})
    {
      const ContactScene<3> scene(false);
      const auto law     = law_of(FrictionLaw::Kind::constant, 0);
      const auto at_rest = scene.contact(law, sign * 0.), slow = scene.contact(law, sign * 1e-9);
      const auto pressure = slow.pressure_of(scene.base(slow.pressure_scale()));
      const MultiVector x = scene.scatter({{1, 1, 1, 1}}, 1),
                        y = multiply(turning_contact(slow, pressure, true).friction, x);
      CHECK(std::isfinite(largest_entry(y)));
      CHECK(difference(scene, multiply(turning_contact(at_rest, pressure, true).friction, x), y) <=
            1e-8);
    }
  }

  TEST_CASE("contact_linearisation: signs of the damping")
  {
    // Constant mu: P = int c b b^T, c >= 0, is symmetric and damps. mu' < 0: P_falling = int mu' p
    // e e^T is symmetric and drives. x^T P x is compared to |x^T| |P x|.
    for (const bool mortar : {true, false})
    {
      CAPTURE(mortar);
      const ContactScene<3> scene(mortar);
      const auto relative_work = [&](const Matrix &matrix, const unsigned int seed)
      {
        const MultiVector x = scene.scatter({{1, 1, 1, 1}}, seed), y = multiply(matrix, x);
        return inner_product(x, y) / std::sqrt(inner_product(x, x) * inner_product(y, y));
      };
      for (const double omega : {4., -1.5})
      {
        CAPTURE(omega);
        const auto constant = scene.contact(law_of(FrictionLaw::Kind::constant, 0), omega);
        const auto pressure = constant.pressure_of(scene.base(constant.pressure_scale()));
        const Matrix P      = friction_damping(constant, pressure).P;
        CHECK(asymmetry(scene.spaces.rows, P) <= 1e-15);
        const auto falling =
            friction_damping(scene.contact(law_of(FrictionLaw::Kind::falling, 0), omega), pressure);
        CHECK(asymmetry(scene.spaces.rows, falling.P) <= 1e-15);
        CHECK(asymmetry(scene.spaces.rows, falling.P_falling) <= 1e-15);
        for (unsigned int seed = 0; seed < 5; ++seed)
        {
          CHECK(relative_work(P, seed) >= 0);
          CHECK(relative_work(falling.P, seed) >= 0);
          CHECK(relative_work(falling.P_falling, seed) < 0);
        }
      }
    }
  }
} // namespace squeal::tests::contact_linearisation_tests
