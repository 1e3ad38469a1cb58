#include "fields.h"
#include "helpers.h"

#include <squeal/assessment/stability.h>
#include <squeal/bars/error_estimators.h>
#include <squeal/bars/locking.h>
#include <squeal/eigen/eigensolvers.h>

#include <doctest/doctest.h>
namespace squeal::tests::error_estimators_tests
{
  using namespace dealii;
  using Complex = std::complex<double>;

  namespace
  {
    EigensolverOptions options_for(const Parameters::All &prm)
    {
      EigensolverOptions options;
      options.max_imaginary = 2 * M_PI * prm.eigenproblem.maximum_frequency;
      return options;
    }

    /// A scene on one mesh with one degree: its modes and, if asked for, their estimated errors.
    template <int dim>
    struct Solution
    {
      EigenPairs modes;
      EigenvalueErrors errors;

      Solution(const Geometry<dim> &geometry, Parameters::All prm, const unsigned int degree,
               const std::function<bool(const Point<dim> &, types::material_id)> &refined,
               const bool estimated)
      {
        prm.discretization.degree = degree;
        Log log(MPI_COMM_WORLD);
        PhaseTimer timer;
        BrakeModel<dim> model(geometry, prm, MPI_COMM_WORLD, log, timer);
        model.distribute();
        if (refined)
        {
          refine_where(model.spaces(), refined);
          model.distribute();
        }
        model.assemble(prm);
        modes =
            make_eigensolver(ModeSolver::krylov)->solve(model.problem(), options_for(prm)).modes;
        if (estimated)
          errors = estimate_errors(model, modes);
      }
    };

    /// The correction of every mode against what one degree more really changes, relative to that.
    template <int dim>
    double worst_correction(
        const Geometry<dim> &geometry, const Parameters::All &prm, const unsigned int degree,
        const std::function<bool(const Point<dim> &, types::material_id)> &refined = {})
    {
      const Solution<dim> coarse(geometry, prm, degree, refined, true),
          fine(geometry, prm, degree + 1, refined, false);
      CHECK(coarse.modes.lambda.size() >= 3);
      // Partners by the smallest sum of distances: pairs are nearly double.
      std::vector<std::vector<double>> costs;
      for (unsigned int j = 0; j < coarse.modes.lambda.size(); ++j)
      {
        costs.emplace_back();
        for (const Complex &l : fine.modes.lambda)
          costs[j].push_back(
              std::norm(coarse.modes.lambda[j] + coarse.errors.bounds.correction[j] - l));
      }
      const std::vector<int> partners = assign(costs, fine.modes.lambda.size());
      double worst                    = 0;
      for (unsigned int j = 0; j < coarse.modes.lambda.size(); ++j)
      {
        const Complex l         = coarse.modes.lambda[j],
                      corrected = l + coarse.errors.bounds.correction[j],
                      change    = fine.modes.lambda.at(partners[j]) - l;
        worst = std::max(worst, std::abs(corrected - l - change) / std::abs(change));
        // The bar reaches what one degree more shows.
        CHECK(coarse.errors.bounds.imaginary[j] >= std::abs(change.imag()));
      }
      return worst;
    }

    Parameters::All strip()
    {
      Parameters::All prm;
      prm.discretization.degree          = 2;
      prm.scene                          = Scene::strip;
      prm.operation.angular_velocity     = 2;
      prm.contact.friction.coefficient   = 0.3;
      prm.contact.penalty_stiffness      = 1e12;
      prm.discretization.rotor_cells     = {{1, 16, 2}};
      prm.discretization.pad_cells       = {{1, 5, 2}};
      prm.contact.steady_pressure        = SteadyPressure::uniform;
      prm.eigenproblem.maximum_frequency = 40000;
      return prm;
    }
  } // namespace

  TEST_CASE("error estimators: the correction is what one degree more changes, strip" *
            doctest::test_suite("slow, one rank, optimised"))
  {
    for (const std::string formulation : {"mortar", "penalty", "mortar_penalty"})
      for (const unsigned int degree : {1u, 2u, 3u})
        for (const std::string stage : {"transport", "friction", "full"})
        {
          CAPTURE(formulation);
          CAPTURE(degree);
          CAPTURE(stage);
          Parameters::All prm     = strip();
          prm.stage               = value_named<Stage>(stage);
          prm.contact.formulation = value_named<Formulation>(formulation);
          CHECK(worst_correction(make_strip(prm), prm, degree) <= (degree == 1 ? 0.4 : 0.2));
        }
  }

  TEST_CASE("error estimators: transversely isotropic bodies" *
            doctest::test_suite("slow, one rank, optimised"))
  {
    Parameters::All prm = strip();
    for (Parameters::MaterialSection *material : {&prm.rotor.material, &prm.pads.material})
    {
      material->transversely_isotropic = true;
      material->axial_young_modulus    = 0.3 * material->young_modulus;
      material->axial_poisson_ratio    = 0.15;
      material->axial_shear_modulus    = 0.2 * material->young_modulus;
    }
    for (const unsigned int degree : {2u, 3u})
      CHECK(worst_correction(make_strip(prm), prm, degree) <= 0.2);
  }

  TEST_CASE("error estimators: hanging nodes" * doctest::test_suite("slow, two ranks at most"))
  {
    Parameters::All prm = strip();
    const auto refined  = [](const Point<2> &x, const types::material_id)
    { return std::abs(x[0] - 0.025) < 0.02; };
    for (const unsigned int degree : {2u, 3u})
      CHECK(worst_correction<2>(make_strip(prm), prm, degree, refined) <= 0.2);
  }

  TEST_CASE("error estimators: the correction is what one degree more changes, brake" *
            doctest::test_suite("slow, one rank, optimised"))
  {
    Parameters::All prm;
    prm.discretization.degree          = 2;
    prm.discretization.rotor_cells     = {{5, 30, 1}};
    prm.discretization.pad_cells       = {{1, 3, 1}};
    prm.pads.arrangement               = Arrangement::upper;
    prm.contact.steady_pressure        = SteadyPressure::uniform;
    prm.eigenproblem.maximum_frequency = 1500;
    for (const std::string formulation : {"mortar", "penalty"})
    {
      prm.contact.formulation = value_named<Formulation>(formulation);
      CHECK(worst_correction(make_brake(prm), prm, 2) <= 0.35);
    }
  }

  TEST_CASE("error estimators: geometric stiffness of the static stress" *
            doctest::test_suite("slow, two ranks at most"))
  {
    // The centrifugal load stiffens the disc by a third of a percent and changes its discretisation
    // errors by as little. Left out of the residuals, the stiffness would count as an error itself,
    // half of what one degree more changes here.
    Parameters::All prm;
    prm.stage                          = Stage::transport;
    prm.pads.arrangement               = Arrangement::none;
    prm.operation.angular_velocity     = 300;
    prm.discretization.rotor_cells     = {{3, 20, 1}};
    prm.eigenproblem.maximum_frequency = 1200;
    const Solution<3> free(make_brake(prm), prm, 2, {}, true);
    prm.prestress.centrifugal_load = true;
    const Solution<3> stressed(make_brake(prm), prm, 2, {}, true);
    CHECK(free.modes.lambda.size() >= 3);
    CHECK(stressed.modes.lambda.size() == free.modes.lambda.size());
    for (unsigned int j = 0; j < free.modes.lambda.size(); ++j)
    {
      CHECK(std::abs(stressed.modes.lambda[j]) > 1.002 * std::abs(free.modes.lambda[j]));
      CHECK(std::abs(stressed.errors.bounds.correction[j] - free.errors.bounds.correction[j]) <=
            0.03 * std::abs(free.errors.bounds.correction[j]));
    }
  }

  TEST_CASE(
      "error estimators: a static state without contact, in the stage with friction's damping" *
      doctest::test_suite("slow"))
  {
    Parameters::All prm;
    prm.pads.arrangement               = Arrangement::none;
    prm.operation.angular_velocity     = 300;
    prm.prestress.centrifugal_load     = true;
    prm.discretization.rotor_cells     = {{3, 20, 1}};
    prm.eigenproblem.maximum_frequency = 1200;
    const Solution<3> solution(make_brake(prm), prm, 2, {}, true);
    CHECK(solution.modes.lambda.size() >= 3);
    for (const double bar : solution.errors.bounds.imaginary)
      CHECK(bar > 0);
  }

  TEST_CASE(
      "error estimators: no bars where there is no error, none of a conservative growth rate" *
      doctest::test_suite("slow"))
  {
    // Conservative: T is Hermitian up to the friction, so growth rates have no error at all.
    Parameters::All prm = strip();
    prm.stage           = Stage::transport;
    const Solution<2> solution(make_strip(prm), prm, 2, {}, true);
    for (unsigned int j = 0; j < solution.modes.lambda.size(); ++j)
      CHECK(solution.errors.bounds.growth_rate[j] <= 1e-9 * std::abs(solution.modes.lambda[j]));
  }

  TEST_CASE("locking: functions of V_h give way to a local problem on its cell")
  {
    // Bilinear functions on a rectangle a x b cannot bend; one degree more adds
    //     u_y = -x^2/2 - nu' y^2/2,   nu' = nu/(1 - nu)   (plane strain),
    // alone an energy of M I nu'^2 + mu J with M = lambda + 2 mu, I = int y^2, J = int x^2. With s
    // x y in u_x, which is bilinear (no other function has that symmetry), it is
    //     M I (s^2 - 2 s nu'^2 + nu'^2) + mu J (1 - s)^2,
    // least at s = (M I nu'^2 + mu J) / (M I + mu J).
    const Parameters::All prm  = strip();
    const Geometry<2> geometry = make_strip(prm);
    FiniteElementSpace<2> base(geometry, 1, false, MPI_COMM_WORLD);
    base.distribute();
    FiniteElementSpace<2> fine(base, 2);
    fine.distribute();
    CellResiduals<2> integrals(base, fine);
    const DenseMatrix functions   = hierarchical_complement(fine.fe),
                      derivatives = integrals.reference_derivatives(functions);
    const unsigned int n_w        = functions.n_columns;
    YieldingCells<2> yielding(functions, interpolation(base.fe, fine.fe), integrals);
    for (const double nu : {0.3, 0.499})
      for (const auto &cell : fine.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          CAPTURE(nu);
          Material material;
          material.young_modulus = 2e9;
          material.poisson_ratio = nu;
          const double mu        = material.young_modulus / (2 * (1 + nu)),
                       M = 2 * mu * (1 - nu) / (1 - 2 * nu), ratio = nu / (1 - nu),
                       a = cell->extent_in_direction(0), b = cell->extent_in_direction(1),
                       I = a * b * b * b / 12, J = a * a * a * b / 12;

          // Its coefficients: the functions vanish at the corners, and so does the field less a
          // constant.
          DenseMatrix values(functions.n_rows, 1);
          const Point<2> corner = cell->vertex(0), center = cell->center();
          for (unsigned int k = 0; k < functions.n_rows; ++k)
          {
            const auto field = [&](const Tensor<1, 2> &x)
            { return -x[0] * x[0] / 2 - ratio * x[1] * x[1] / 2; };
            values(k, 0) = field(fine.mapping.transform_unit_to_real_cell(
                                     cell, fine.fe.get_unit_support_points()[k]) -
                                 center) -
                           field(corner - center);
          }
          const DenseMatrix coefficients =
              solve_positive(functions.transpose() * functions, functions.transpose() * values);

          integrals.reinit(cell);
          LocalProblem problem;
          problem.matrix = DenseMatrix(2 * n_w, 2 * n_w);
          integrals.stiffness(material, derivatives, problem.matrix);
          for (unsigned int k = 0; k < 2 * n_w; ++k)
            problem.unknowns.push_back(k);
          const auto energy = [&](const DenseMatrix &matrix)
          {
            double sum = 0;
            for (unsigned int i = 0; i < n_w; ++i)
              for (unsigned int j = 0; j < n_w; ++j)
                sum += coefficients(i, 0) * matrix(n_w + i, n_w + j) * coefficients(j, 0);
            return sum;
          };
          const double held = M * I * ratio * ratio + mu * J, s = held / (M * I + mu * J),
                       free = M * I * (s * s - 2 * s * ratio * ratio + ratio * ratio) +
                              mu * J * (1 - s) * (1 - s);
          CHECK(std::abs(energy(problem.matrix) - held) <= 1e-12 * held);
          const std::vector<bool> all(2 * base.fe.n_dofs_per_cell(), true),
              none(2 * base.fe.n_dofs_per_cell(), false);
          CHECK(std::abs(energy(yielding.soften(problem, none, material, integrals)) - held) <=
                1e-12 * held);
          // Rigid motions are held with 1e-9 of the stiffness.
          CHECK(std::abs(energy(yielding.soften(problem, all, material, integrals)) - free) <=
                1e-6 * held);
        }
  }

  TEST_CASE("error bounds: modes of different parity are not coupled, corrections cross by vector")
  {
    // Corrections of +5 and -5 take 1000 and 1001 past each other: by distance alone each would get
    // the other's.
    const Complex j(0, 1);
    const std::vector<Complex> lambda = {1000. * j, 1001. * j},
                               f      = {5. * j, 1. * j, 1. * j, -5. * j};

    const double mean = 1000.5, half = std::hypot(4.5, 1.); // of [1005, 1; 1, 996]
    const ErrorBounds whole = bound_errors(lambda, {}, {f, {}, 2, {}});
    CHECK(std::abs(lambda[0] + whole.correction[0] - j * (mean + half)) <= 1e-9);
    CHECK(std::abs(lambda[1] + whole.correction[1] - j * (mean - half)) <= 1e-9);
    const ErrorBounds apart =
        bound_errors(lambda, {Parity::symmetric, Parity::antisymmetric}, {f, {}, 2, {}});
    CHECK(std::abs(apart.correction[0] - f[0]) <= 1e-9);
    CHECK(std::abs(apart.correction[1] - f[3]) <= 1e-9);
    CHECK(apart.imaginary[0] < whole.imaginary[0]);
  }

  TEST_CASE("error bounds: what is independent is added by squares, what may come to it as it is")
  {
    // One mode: the whole of degree 2 is 2.16 times what is seen.
    const Complex j(0, 1);
    const double whole                = whole_effect(2);
    const std::vector<Complex> lambda = {1000. * j}, f = {3. + 20. * j};
    const std::vector<std::vector<Complex>> parts = {{5. + 30. * j}, {-3. + 10. * j}};
    using Alternatives                            = ErrorEffects::Alternatives;
    const Alternatives edge{{{-5. + 1. * j}, {7. - 2. * j}, {1. + 0.5 * j}}, true, "edge"},
        locking{{{4. + 30. * j}}, false, "locking"};
    const auto bounds = [&](const std::vector<Alternatives> &alternatives) {
      return bound_errors(lambda, {}, {f, parts, 2, alternatives});
    };
    const double re = whole * 3, im = whole * 20, of_parts = unequal_parts * whole * 8;
    const ErrorBounds alone = bounds({}), both = bounds({edge, locking}),
                      twice = bounds({edge, edge});
    CHECK(alone.growth_rate[0] == doctest::Approx(std::hypot(re, of_parts)));
    CHECK(alone.imaginary[0] == doctest::Approx(im));
    CHECK(both.growth_rate[0] == doctest::Approx(std::hypot(re, of_parts, 7.) + 4));
    CHECK(both.imaginary[0] == doctest::Approx(std::hypot(im, 2.) + 30));
    CHECK(twice.growth_rate[0] == doctest::Approx(std::hypot(re, of_parts, 14.)));
    // Parts: e, g, and each group of alternatives.
    REQUIRE(both.parts.size() == 4);
    const std::vector<double> expected = {re, of_parts, 7, 4}, expected_imaginary = {im, 0, 2, 30};
    for (unsigned int part = 0; part < 4; ++part)
    {
      CHECK(both.parts[part].growth_rate[0] == doctest::Approx(expected[part]));
      CHECK(both.parts[part].imaginary[0] == doctest::Approx(expected_imaginary[part]));
    }
    CHECK(both.parts[2].cause == "edge");
    CHECK(both.parts[3].cause == "locking");
    // The likeliest edge is part of the correction.
    CHECK(std::abs(alone.correction[0] - f[0]) <= 1e-9);
    CHECK(std::abs(both.correction[0] - (f[0] + 1. + 0.5 * j)) <= 1e-9);
  }

  TEST_CASE("error bounds: a pair that meets on the way of its effects flutters there")
  {
    // i [d, c; -c, -d] has +- i sqrt(d^2 - c^2): nothing grows but for |d| < c. The effects take d
    // from 3 by 1.9 to 1.1, and by 1.9 times 2.16, the whole of degree 2, to -1.1: past the
    // flutter.
    const Complex j(0, 1);
    const double distance = 3, shift = 1.9, c = 0.05, omega = 1000;
    const auto bars = [&](const double sign)
    {
      const std::vector<Complex> lambda = {j * (omega + distance), j * (omega - distance)};
      // At t with d = 0 the coupling is c.
      const double coupling        = c / (distance / shift);
      const std::vector<Complex> f = {-shift * j, sign * coupling * j, coupling * j, shift * j};
      return bound_errors(lambda, {}, {f, {}, 2, {}});
    };
    const ErrorBounds meeting = bars(-1), passing = bars(1);
    for (const unsigned int k : {0, 1})
    {
      CHECK(meeting.growth_rate[k] == doctest::Approx(c).epsilon(1e-2));
      // Two that only pass each other, as symmetric coupling lets them, do not grow.
      CHECK(passing.growth_rate[k] <= 1e-9);
    }
  }
} // namespace squeal::tests::error_estimators_tests
