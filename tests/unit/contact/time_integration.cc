#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/contact/contact_forces.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/linalg/factorization.h>
#include <squeal/model/brake_model.h>
#include <squeal/scenes/make_scene.h>

/// The equations of motion with the nonlinear forces of contact and friction, integrated in time
/// from a small disturbance of the steady sliding: what grows or decays there does so with the real
/// part of an eigenvalue.
namespace squeal::tests::time_integration_tests
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Full of what is nonlinear: a block pressed onto a moving strip, with friction that is
    /// constant or falls with the speed; little damping.
    Parameters::All small_strip(const FrictionLaw::Kind law, const double coefficient)
    {
      Parameters::All prm;
      prm.discretization.degree               = 2;
      prm.scene                               = Scene::strip;
      prm.operation.angular_velocity          = 2;
      prm.contact.formulation                 = Formulation::penalty;
      prm.contact.penalty_stiffness           = 1e12;
      prm.contact.friction.kind               = law;
      prm.contact.friction.coefficient        = coefficient;
      prm.contact.friction.coefficient_moving = coefficient - 0.05;
      prm.contact.friction.decay_speed        = 3;
      prm.rotor.material.stiffness_damping    = 1e-9;
      prm.pads.material.stiffness_damping     = 1e-9;
      prm.discretization.rotor_cells          = {{1, 12, 1}};
      prm.discretization.pad_cells            = {{1, 5, 1}};
      prm.eigenproblem.maximum_frequency      = 40000;
      return prm;
    }

    /// The same in three dimensions: pads of soft lining on both faces of a disc, few cells.
    Parameters::All small_brake()
    {
      Parameters::All prm;
      prm.discretization.degree            = 1;
      prm.contact.formulation              = Formulation::penalty;
      prm.contact.penalty_stiffness        = 1e12;
      prm.contact.friction.coefficient     = 0.6;
      prm.operation.angular_velocity       = 20;
      prm.rotor.material.stiffness_damping = 1e-7;
      prm.pads.material.stiffness_damping  = 1e-7;
      prm.pads.material.young_modulus      = 1e9;
      prm.discretization.rotor_cells       = {{2, 12, 1}};
      prm.discretization.pad_cells         = {{1, 3, 1}};
      prm.eigenproblem.maximum_frequency   = 25000; // that of what grows fastest is in it
      return prm;
    }

    /// M a + P v + Q u + f(u, v) = b by the trapezoidal rule, f being the forces of contact and
    /// friction.
    template <int dim>
    struct Motion
    {
      Motion(const BrakeModel<dim> &model, const double step)
          : contact(*model.contact()), rows(model.spaces().rows), h(step),
            load(model.static_load(model.parameters(), model.spaces())),
            u(model.equilibrium()->state), v(rows, 1), a(rows, 1)
      {
        std::vector<Term> all = model.equations().terms, bodies;
        for (const Term &term : all)
          if (!is_of_contact(term.origin))
            bodies.push_back(term);
        M            = sum_of(rows, bodies, 2);
        P            = sum_of(rows, bodies, 1);
        Q            = sum_of(rows, bodies, 0);
        Q_linearised = sum_of(rows, all, 0);
        // M + h/2 P + h^2/4 Q, linearised: the steps' Newton iterations keep it.
        jacobian = std::make_unique<Factorization>(sum_of(rows, {{1., sum_of(rows, all, 2)},
                                                                 {h / 2, sum_of(rows, all, 1)},
                                                                 {h * h / 4, Q_linearised}}),
                                                   Factorization::Kind::lu, "time step");
      }

      MultiVector residual(const MultiVector &u, const MultiVector &v, const MultiVector &a) const
      {
        MultiVector r = nonlinear_forces(contact, u, v, true);
        add(r, 1, multiply(M, a));
        if (P)
          add(r, 1, multiply(P, v));
        add(r, 1, multiply(Q, u));
        add(r, -1, load);
        return r;
      }

      /// The rest of the nonlinear forces: in the static state friction has the direction in which
      /// the undeformed surface slides.
      void settle()
      {
        const Factorization stiffness(Q_linearised, Factorization::Kind::lu, "rest");
        for (unsigned int i = 0; i < 10; ++i)
          add(u, -1, stiffness.solve(residual(u, v, a)));
      }

      /// The acceleration that the equations ask for, a first time.
      void start()
      {
        const Factorization mass(M, Factorization::Kind::ldlt, "mass");
        a = mass.solve(residual(u, v, a));
        a *= -1;
      }

      void step()
      {
        const MultiVector u_0 = sum(sum(u, h, v), h * h / 4, a), v_0 = sum(v, h / 2, a);
        for (unsigned int i = 0; i < 3; ++i)
        {
          u = sum(u_0, h * h / 4, a);
          v = sum(v_0, h / 2, a);
          add(a, -1, jacobian->solve(residual(u, v, a)));
        }
        u = sum(u_0, h * h / 4, a);
        v = sum(v_0, h / 2, a);
      }

      const Contact<dim> &contact;
      const RowRange rows;
      const double h;
      const MultiVector load;
      MultiVector u, v, a;
      Matrix M, P, Q, Q_linearised;
      std::unique_ptr<Factorization> jacobian;
    };

    double squared(const MultiVector &a)
    {
      return inner_product(a, a);
    }

    /// The modes that grow and decay fastest in a period: what they become in time has the real
    /// parts of their eigenvalues as rates, to 1 %. @p speed is that of sliding, m/s.
    template <int dim>
    void check_rates(const Parameters::All &prm, const Geometry<dim> &geometry, const double speed)
    {
      Log log(MPI_COMM_WORLD);
      PhaseTimer timer;
      BrakeModel<dim> model(geometry, prm, MPI_COMM_WORLD, log, timer);
      model.distribute();
      model.assemble(prm);
      EigensolverOptions options;
      options.max_imaginary = 2 * M_PI * prm.eigenproblem.maximum_frequency;
      const EigenPairs modes =
          make_eigensolver(ModeSolver::krylov)->solve(model.problem(), options).modes;
      const auto ratio = [&](const unsigned int j)
      { return modes.lambda[j].real() / modes.lambda[j].imag(); };
      unsigned int growing = 0, decaying = 0;
      for (unsigned int j = 0; j < modes.size(); ++j)
      {
        growing  = ratio(j) > ratio(growing) ? j : growing;
        decaying = ratio(j) < ratio(decaying) ? j : decaying;
      }
      for (const unsigned int j : {growing, decaying})
      {
        const Complex l                = modes.lambda[j];
        const double period            = 2 * M_PI / l.imag();
        constexpr unsigned int n_steps = 60; // of a period: (w h)^2/4 = 0.3 % of Re l
        const unsigned int n_periods =
            std::min(100., std::round(1.5 / (2 * M_PI * std::abs(ratio(j)))));
        Motion<dim> motion(model, period / n_steps);
        motion.settle();
        const MultiVector rest = motion.u, x_re = modes.right.re.columns(j, 1),
                          x_im = modes.right.im.columns(j, 1);
        // The vector's motion, at its fastest a ten thousandth of the sliding speed
        const double scale =
            1e-4 * speed / (std::abs(l) * std::max(largest_entry(x_re), largest_entry(x_im)));
        add(motion.u, scale, x_re);
        add(motion.v, scale * l.real(), x_re);
        add(motion.v, -scale * l.imag(), x_im);
        motion.start();
        const auto amplitude = [&]
        { return std::sqrt(squared(sum(motion.u, -1, rest)) + squared(motion.v) / std::norm(l)); };
        const double first = amplitude();
        for (unsigned int step = 0; step < n_periods * n_steps; ++step)
          motion.step();
        const double rate = std::log(amplitude() / first) / (n_periods * period);
        CAPTURE(l);
        MESSAGE("Re l = ", l.real(), " 1/s, in ", n_periods, " periods ", rate);
        CHECK(relative_error(rate, l.real()) <= 0.01);
      }
      CHECK(ratio(growing) > 0);
      CHECK(ratio(decaying) < 0);
    }
  } // namespace

  TEST_CASE("time integration: small motions grow and decay as the eigenvalues say" *
            doctest::test_suite("slow, one rank, optimised"))
  {
    for (const auto &[law, coefficient] : {std::make_pair(FrictionLaw::Kind::constant, 0.3),
                                           std::make_pair(FrictionLaw::Kind::falling, 0.3),
                                           std::make_pair(FrictionLaw::Kind::falling, 0.1)})
    {
      const Parameters::All prm = small_strip(law, coefficient);
      check_rates(prm, make_strip(prm), prm.operation.angular_velocity);
    }
  }

  TEST_CASE("time integration: the same of a disc between pads" *
            doctest::test_suite("slow, one rank, optimised"))
  {
    const Parameters::All prm = small_brake();
    check_rates(prm, make_brake(prm), prm.operation.angular_velocity * 0.115);
  }
} // namespace squeal::tests::time_integration_tests
