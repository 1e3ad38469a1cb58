#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/assessment/error_bounds.h>
#include <squeal/bars/changed_edges.h>
#include <squeal/contact/contact_matrices.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/model/brake_model.h>
#include <squeal/scenes/make_scene.h>
namespace squeal::tests::contact_edge_tests
{
  using Complex = std::complex<double>;

  namespace
  {
    /// A small brake whose pads lift off at one end, with everything that friction does.
    Parameters::All brake_with_lift_off()
    {
      Parameters::All prm;
      prm.discretization.degree          = 2;
      prm.discretization.rotor_cells     = {{2, 12, 1}};
      prm.discretization.pad_cells       = {{2, 4, 1}};
      prm.contact.steady_pressure        = SteadyPressure::computed;
      prm.contact.friction.coefficient   = 0.5;
      prm.contact.initial_gap            = "5e-6 * (1 + tanh((y - 0.03) / 0.005))";
      prm.eigenproblem.maximum_frequency = 1200; // beyond, opening changes a pair past first order
      prm.rotor.material.stiffness_damping = 1e-7;
      return prm;
    }

    /// Its equations about the static state.
    struct LiftedBrake
    {
      LiftedBrake() : model(make_brake(prm), prm, MPI_COMM_WORLD, log, timer)
      {
        model.distribute();
        model.assemble(prm);
      }
      const Parameters::All prm = brake_with_lift_off();
      Log log{MPI_COMM_WORLD};
      PhaseTimer timer;
      BrakeModel<3> model;
    };

    ContactEdge copy_of(const ContactEdge &edge, const BrakeModel<3> &model)
    {
      return {edge.parts,          edge.releasing,
              edge.closing,        edge.releasing_at,
              edge.closing_at,     edge.release_energy,
              edge.closing_energy, edge.slack,
              edge.pressure,       sum_of(model.spaces().rows, {{1., edge.closed}})};
    }

    /// The eigenvalues of diag(l) + F.
    std::vector<Complex> changed_by(const std::vector<Complex> &lambda,
                                    const std::vector<Complex> &effect)
    {
      ComplexDenseMatrix matrix(lambda.size(), lambda.size(), effect);
      for (unsigned int j = 0; j < lambda.size(); ++j)
        matrix(j, j) += lambda[j];
      return general_eigen(std::move(matrix)).values;
    }

    EigenPairs solve(const QuadraticEigenproblem &problem, const Parameters::All &prm)
    {
      EigensolverOptions options;
      options.max_imaginary = 2 * M_PI * prm.eigenproblem.maximum_frequency;
      return make_eigensolver(ModeSolver::krylov)->solve(problem, options).modes;
    }
  } // namespace

  /// The effects of opening R and of closing C are compared with the eigenvalues of the problem in
  /// which R is open or C is closed.
  TEST_CASE("A contact that opens or closes moves the eigenvalues as its edge says" *
            doctest::test_suite("slow, optimised"))
  {
    LiftedBrake brake;
    const Parameters::All &prm          = brake.prm;
    const BrakeModel<3> &model          = brake.model;
    const QuadraticEigenproblem problem = model.problem();
    const EigenPairs modes              = solve(problem, prm);
    const ContactEdge &edge             = model.equilibrium()->edge;
    REQUIRE(edge.releasing.size() >= 2);
    REQUIRE(edge.closing.size() >= 2);
    const unsigned int m = modes.lambda.size();
    REQUIRE(m >= 4);
    const EdgeEffects effects = edge_effects(edge, modes.right, modes.left);
    CHECK(effects.rows.size() == edge.releasing.size() + edge.closing.size());

    const Matrix before[] = {normal_matrix(*model.contact()),
                             friction_matrix(*model.contact(), model.pressure())};
    for (const bool opens : {true, false})
    {
      Contact<3> contact = *model.contact();
      contact.set_closed(opens ? edge.releasing : edge.closing, !opens);
      const Matrix normal         = normal_matrix(contact),
                   friction       = friction_matrix(contact, model.pressure());
      QuadraticEigenproblem other = model.problem();
      other.Q                     = sum_of(
                              problem.rows,
                              {{1., problem.Q}, {1., normal}, {1., friction}, {-1., before[0]}, {-1., before[1]}});
      other.make_shifted_reference = nullptr; // counted by its own matrix
      other.n_constraints          = contact.n_active_multipliers();
      const EigenPairs changed     = solve(other, prm);
      const auto partners          = nearest_partners(modes.lambda, changed.lambda);
      REQUIRE(partners.size() == m);
      std::vector<Complex> f(m * m);
      for (unsigned int k = 0; k < f.size(); ++k)
        f[k] = -(opens ? effects.opening[k] : effects.closing[k]) / (2. * modes.lambda[k % m]);
      const ErrorBounds bounds =
          bound_errors(modes.lambda, {}, {std::vector<Complex>(m * m), {}, 2, {{{f}, false}}});
      // The small problem is nearer than first order.
      const std::vector<unsigned int> &rows = opens ? edge.releasing : edge.closing;
      const std::vector<Complex> by_small   = changed_by(
            modes.lambda, effects_of_changes({{opens, rows, DenseMatrix::identity(rows.size())}},
                                             edge, model.equations(), modes)
                              .front());
      const auto of_small = nearest_partners(modes.lambda, by_small);
      double largest      = 0;
      for (unsigned int j = 0; j < m; ++j)
      {
        const Complex change = changed.lambda[partners[j]] - modes.lambda[j];
        CAPTURE(opens);
        CAPTURE(std::abs(change));
        CHECK(std::abs(by_small[of_small[j]] - changed.lambda[partners[j]]) <=
              0.05 * std::abs(change) + 1e-9 * std::abs(modes.lambda[j]));
        CAPTURE(modes.lambda[j].imag());
        CHECK(std::abs(bounds.growth_rate[j] - std::abs(change.real())) < 0.25 * std::abs(change));
        CHECK(std::abs(bounds.imaginary[j] - std::abs(change.imag())) < 0.25 * std::abs(change));
        largest = std::max(largest, std::abs(change));
      }
      CHECK(largest > 1e-4 * std::abs(modes.lambda[0])); // otherwise nothing was compared
    }
  }

  TEST_CASE("The static state tells where between its nodes the edge of contact is")
  {
    LiftedBrake brake;
    const EigenPairs modes   = solve(brake.model.problem(), brake.prm);
    const ContactEdge &known = brake.model.equilibrium()->edge;
    ContactEdge edge         = copy_of(known, brake.model); // whose energies are given
    const unsigned int m     = modes.size();
    REQUIRE(edge.release_energy.size() == edge.closing_energy.size());

    // The shift s of the parabola (s^2 - s)/2 F_o + (s^2 + s)/2 F_c that gives an effect, for one
    // mode
    const auto shift_of = [&](const EdgeEffects &effects, const std::vector<Complex> &effect)
    {
      const Complex F_o = effects.opening[0], F_c = effects.closing[0], a = (F_c + F_o) / 2.,
                    b = (F_c - F_o) / 2., root = std::sqrt(b * b + 4. * a * effect[0]);
      const Complex one = (-b + root) / (2. * a), other = (-b - root) / (2. * a);
      return std::abs(one) < std::abs(other) ? one : other;
    };
    // Both pads have one energy, so that they have one shift.
    double q_before = 0;
    for (const double closing : {0., 0.01, 0.3, 1.})
    {
      std::fill(edge.release_energy.begin(), edge.release_energy.end(), 1.);
      std::fill(edge.closing_energy.begin(), edge.closing_energy.end(), closing);
      const EdgeEffects effects = edge_effects(edge, modes.right, modes.left);
      REQUIRE(effects.by_level.size() == 1);
      const EdgeEffects::Shifts &shifts = effects.by_level.front();
      // sum |F_c| / sum |F_o| by pad; here they are images of each other
      double of_opening = 0, of_closing = 0;
      for (unsigned int j = 0; j < m; ++j)
      {
        of_opening += std::abs(effects.opening[j + m * j]);
        of_closing += std::abs(effects.closing[j + m * j]);
      }
      const double q = std::sqrt(closing * of_opening / of_closing);
      CAPTURE(q);
      if (closing == 0 || q > 1.2)
      {
        // Not known better than to half a spacing
        CHECK(std::abs(shifts.likeliest[0]) == 0);
        CHECK(std::abs(shift_of(effects, shifts.smaller) + 0.5) <= 1e-8);
        CHECK(std::abs(shift_of(effects, shifts.larger) - 0.5) <= 1e-8);
        continue;
      }
      const double s = (1 - q) / (1 + q) / 2 - 0.2;
      CHECK(q > q_before);
      CHECK(std::abs(shift_of(effects, shifts.likeliest) - s) <= 1e-8);
      CHECK(std::abs(shift_of(effects, shifts.smaller) - (s - 0.2)) <= 1e-8);
      CHECK(std::abs(shift_of(effects, shifts.larger) - (s + 0.2)) <= 1e-8);
      q_before = q;
    }
    CHECK(q_before > 0);
  }

  TEST_CASE("Each level of refinement has its own part of the edge of contact")
  {
    LiftedBrake brake;
    const EigenPairs modes   = solve(brake.model.problem(), brake.prm);
    const ContactEdge &known = brake.model.equilibrium()->edge;
    const EdgeEffects whole  = edge_effects(known, modes.right, modes.left);
    const unsigned int n     = known.parts.size(); // interfaces: all cells are of one level
    for (const ContactEdge::Part &part : known.parts)
      CHECK(part.level == 0);

    // As if every other row lay at smaller cells, of which alone something is known
    ContactEdge edge = copy_of(known, brake.model);
    for (unsigned int i = 0; i < n; ++i)
      edge.parts.push_back({i, 1});
    for (std::vector<unsigned int> *part_of_row : {&edge.releasing_at, &edge.closing_at})
      for (unsigned int k = 0; k < part_of_row->size(); ++k)
        (*part_of_row)[k] += n * (k % 2);
    edge.release_energy.assign(2 * n, 0.);
    edge.closing_energy.assign(2 * n, 0.);
    const auto sum_at_half = [&](const EdgeEffects &effects, const std::size_t k)
    {
      Complex sum = 0;
      for (const EdgeEffects::Shifts &shifts : effects.by_level)
        sum += shifts.smaller[k];
      return sum;
    };
    const EdgeEffects unknown = edge_effects(edge, modes.right, modes.left);
    std::fill(edge.release_energy.begin() + n, edge.release_energy.end(), 1.);
    std::fill(edge.closing_energy.begin() + n, edge.closing_energy.end(), 1e-3);
    const EdgeEffects half_known = edge_effects(edge, modes.right, modes.left);
    for (const EdgeEffects *effects : {&unknown, &half_known})
    {
      REQUIRE(effects->by_level.size() == 2);
      CHECK(std::abs(effects->opening[0] - whole.opening[0]) <= 1e-12 * std::abs(whole.opening[0]));
      CHECK(std::abs(effects->closing[0] - whole.closing[0]) <= 1e-12 * std::abs(whole.closing[0]));
      CHECK(std::abs(effects->by_level[0].likeliest[0]) == 0);
    }
    const Complex half = 0.375 * whole.opening[0] - 0.125 * whole.closing[0];
    CHECK(std::abs(sum_at_half(unknown, 0) - half) <= 1e-12 * std::abs(half));
    CHECK(std::abs(unknown.by_level[1].likeliest[0]) == 0);
    CHECK(std::abs(half_known.by_level[1].likeliest[0]) > 0);
    CHECK(half_known.by_level[0].smaller[0] == unknown.by_level[0].smaller[0]);
  }
} // namespace squeal::tests::contact_edge_tests
