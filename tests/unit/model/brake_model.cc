#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/eigen/find_modes.h>
#include <squeal/model/brake_model.h>
#include <squeal/scenes/make_scene.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

namespace squeal::tests::brake_model_tests
{
  namespace
  {
    /// A few cells with all terms of the stage full, pressed on and dragged along.
    Parameters::All small_brake()
    {
      Parameters::All prm;
      prm.discretization.degree            = 1;
      prm.discretization.rotor_cells       = {{1, 9, 1}};
      prm.discretization.pad_cells         = {{1, 2, 1}};
      prm.contact.steady_pressure          = SteadyPressure::computed;
      prm.contact.friction.coefficient     = 0.3;
      prm.rotor.material.stiffness_damping = 1e-7;
      prm.rotor.material.mass_damping      = 2;
      return prm;
    }

    struct Brake
    {
      explicit Brake(const Parameters::All &prm)
          : prm(prm), model(make_scene<3>(prm), prm, MPI_COMM_WORLD, log, timer)
      {
        model.distribute();
      }
      const Parameters::All prm;
      Log log{MPI_COMM_WORLD};
      PhaseTimer timer;
      BrakeModel<3> model;
    };

    /// What linearisations and states that follow need of a state: not its edge, which is no copy.
    SteadyState<3> copy_of(const SteadyState<3> &state)
    {
      SteadyState<3> copy;
      copy.parameters       = state.parameters;
      copy.body_terms       = state.body_terms;
      copy.contact          = state.contact;
      copy.pressure         = state.pressure;
      copy.contact_matrices = state.contact_matrices;
      copy.equilibrium.emplace();
      copy.equilibrium->state    = state.equilibrium->state;
      copy.equilibrium->pressure = state.equilibrium->pressure;
      return copy;
    }

    /// Largest difference of two lists' sums of one order, relative to the first one's norm.
    double difference_of(const EquationsOfMotion &a, const EquationsOfMotion &b,
                         const unsigned int order)
    {
      const Matrix of_a = sum_of(a.rows, a.terms, order), of_b = sum_of(b.rows, b.terms, order);
      return sum_of(a.rows, {{1., of_a}, {-1., of_b}}).infinity_norm() / of_a.infinity_norm();
    }

    void check_equal(const EquationsOfMotion &a, const EquationsOfMotion &b,
                     const double tolerance = 1e-13)
    {
      REQUIRE(a.terms.size() == b.terms.size());
      for (unsigned int k = 0; k < a.terms.size(); ++k)
      {
        CHECK(a.terms[k].origin == b.terms[k].origin);
        CHECK(a.terms[k].order == b.terms[k].order);
      }
      CHECK(a.n_constraints == b.n_constraints);
      for (const unsigned int order : {0u, 1u, 2u})
        CHECK(difference_of(a, b, order) <= tolerance);
    }
  } // namespace

  TEST_CASE("brake model: a linearisation depends on its state alone")
  {
    Parameters::All first = small_brake(), second = first;
    second.operation.angular_velocity *= -2;
    second.contact.friction.coefficient = 0.5;
    second.pads.pressure *= 3;
    second.pads.material.density *= 1.1;
    second.rotor.material.mass_damping = 5;
    // The terms about each state as a model gives them that knows no other.
    const auto alone = [](const Parameters::All &prm)
    {
      Brake brake(prm);
      brake.model.assemble(prm);
      return brake.model.equations();
    };
    Brake brake(first);
    BrakeModel<3> &model          = brake.model;
    SteadyState<3> a              = copy_of(model.find_steady_state(first)),
                   b              = copy_of(model.find_steady_state(second));
    const SteadyState<3> a_before = copy_of(a), b_before = copy_of(b);
    {
      const EquationsOfMotion of_a = model.linearise(a), of_b = model.linearise(b);
      CHECK(difference_of(of_a, of_b, 0) > 1e-6);
      CHECK(difference_of(of_a, of_b, 1) > 1e-2);
      constexpr double of_states = 1e-9; // pressures are solved for
      check_equal(of_a, alone(first), of_states);
      check_equal(of_b, alone(second), of_states);
      a = copy_of(a_before);
      b = copy_of(b_before);
      check_equal(of_b, model.linearise(b));
      check_equal(of_a, model.linearise(a));
      check_equal(of_a, model.linearise(a)); // with the matrices that it has kept
    }
    // It does not change what the model answers about its present state.
    CHECK(model.terms().empty());
    check_equal(model.linearise(), alone(second), 1e-9);
    CHECK(model.parameters().pads.pressure == second.pads.pressure);
  }

  /// d/dp of the terms, the state's own dependence included, against central differences of
  /// linearisations about states at p +- h. The scale of the constraints follows the stiffest body,
  /// the rotor: its modulus is left out.
  TEST_CASE("brake model: derivatives are differences of linearisations")
  {
    struct Key
    {
      std::string path;
      std::function<double &(Parameters::All &)> value;
    };
    const std::vector<Key> keys = {
        {"Operation/Angular velocity",
         [](Parameters::All &p) -> double & { return p.operation.angular_velocity; }},
        {"Contact/Friction/Coefficient",
         [](Parameters::All &p) -> double & { return p.contact.friction.coefficient; }},
        {"Pads/Pressure", [](Parameters::All &p) -> double & { return p.pads.pressure; }},
        {"Pads/Material/Young modulus",
         [](Parameters::All &p) -> double & { return p.pads.material.young_modulus; }},
        {"Rotor/Material/Density",
         [](Parameters::All &p) -> double & { return p.rotor.material.density; }},
        {"Rotor/Material/Mass proportional damping",
         [](Parameters::All &p) -> double & { return p.rotor.material.mass_damping; }}};
    Brake brake(small_brake());
    BrakeModel<3> &model = brake.model;
    for (const Key &key : keys)
    {
      CAPTURE(key.path);
      Parameters::All prm = brake.prm;
      model.assemble(prm);
      const std::vector<ParameterDerivative> found = model.derivatives(key.path);
      REQUIRE(found.size() == 1);
      const double value = key.value(prm), h = 1e-4 * std::abs(value);
      CHECK(found[0].value == value);
      const unsigned int n_active = model.contact()->n_active_multipliers();
      const auto at               = [&](const double other)
      {
        key.value(prm) = other;
        model.assemble(prm);
        REQUIRE(model.contact()->n_active_multipliers() == n_active);
        return model.equations();
      };
      const EquationsOfMotion above = at(value + h), below = at(value - h);
      for (const unsigned int order : {0u, 1u, 2u})
      {
        CAPTURE(order);
        const RowRange &rows = above.rows;
        const Matrix plus    = sum_of(rows, above.terms, order),
                     minus   = sum_of(rows, below.terms, order),
                     slope   = sum_of(rows, {{0.5 / h, plus}, {-0.5 / h, minus}});
        // What rounding makes of the difference of large numbers
        const double rounding = 1e-13 * plus.infinity_norm() / h;
        const Matrix given    = sum_of(rows, found[0].terms, order);
        const double error    = given ? sum_of(rows, {{1., given}, {-1., slope}}).infinity_norm()
                                      : slope.infinity_norm();
        CHECK(error <= 1e-5 * slope.infinity_norm() + rounding);
      }
    }
    CHECK(model.derivatives("Contact/Friction/No such key").empty());
  }

  TEST_CASE("brake model: sectors are those of the mesh, if the parameters allow for them")
  {
    const auto sectors_of = [](const std::string &arrangement, const bool allowed)
    {
      Parameters::All prm              = small_brake();
      prm.pads.arrangement             = value_named<Arrangement>(arrangement);
      prm.eigenproblem.mirror_symmetry = allowed;
      Brake brake(prm);
      brake.model.assemble(prm);
      const Sectors sectors = brake.model.sectors();
      if (sectors.are_two()) // and the terms keep them
        CHECK(sectors.keep(std::vector<std::vector<Term>>{brake.model.equations().of_order(0),
                                                          brake.model.equations().of_order(1)}));
      return sectors.are_two();
    };
    CHECK(sectors_of("both", true));
    CHECK_FALSE(sectors_of("both", false));
    CHECK_FALSE(sectors_of("upper", true));
  }

  TEST_CASE("brake model: the terms of a body (theory.md, section 2)")
  {
    Parameters::All prm            = small_brake();
    prm.operation.angular_velocity = 7;
    const auto coefficient =
        [&](const bool of_rotor, const unsigned int order, const BodyTerm::Kind kind)
    {
      double sum = 0;
      for (const Parameters::BodyMaterial &body : prm.materials())
        if (body.of_rotor == of_rotor)
          for (const BodyTerm &term : body_terms(prm, body))
            sum += term.order == order && term.matrix == kind ? term.coefficient : 0.;
      return sum;
    };
    using Kind = BodyTerm::Kind;
    // M, alpha M + beta K + 2 Omega G, K - Omega^2 M* + alpha Omega G
    CHECK(coefficient(true, 2, Kind::M) == 1);
    CHECK(coefficient(true, 1, Kind::M) == 2);
    CHECK(coefficient(true, 1, Kind::K) == 1e-7);
    CHECK(coefficient(true, 1, Kind::G) == 14);
    CHECK(coefficient(true, 0, Kind::K) == 1);
    CHECK(coefficient(true, 0, Kind::M_star) == -49);
    CHECK(coefficient(true, 0, Kind::G) == 14);
    // Pads do not turn.
    CHECK(coefficient(false, 1, Kind::G) == 0);
    CHECK(coefficient(false, 0, Kind::M_star) == 0);
    prm.stage = Stage::elastic;
    CHECK(coefficient(true, 1, Kind::K) == 0);
    CHECK(coefficient(true, 0, Kind::M_star) == 0);
  }
} // namespace squeal::tests::brake_model_tests
