#include "fields.h"

#include <doctest/doctest.h>

#include <squeal/contact/contact_matrices.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/model/matrix_free_modes.h>
#include <squeal/projection/backward_error.h>

#include <cmath>
namespace squeal::tests::block_davidson_tests
{
  using namespace dealii;

  namespace
  {
    Parameters::All small_brake()
    {
      Parameters::All p;
      p.discretization.degree        = 2;
      p.discretization.rotor_cells   = {{3, 14, 1}};
      p.discretization.pad_cells     = {{2, 3, 1}};
      p.eigenproblem.error_bars      = false;
      p.eigenproblem.mirror_symmetry = false;
      p.eigenproblem.solver          = ModeSolver::block_davidson;
      p.rotor.material.mass_damping  = 20;
      p.operation.angular_velocity   = 50;
      p.contact.friction.coefficient = 0.8;
      p.static_equilibrium.multigrid = Multigrid::ml;
      p.eigenproblem.tolerance       = 1e-10;
      return p;
    }

    EigensolverOptions options_of(const Parameters::All &p)
    {
      EigensolverOptions options;
      options.max_imaginary = 2 * M_PI * 4500;
      options.tolerance     = p.eigenproblem.tolerance;
      return options;
    }

    double largest_of(const std::vector<double> &values)
    {
      return *std::max_element(values.begin(), values.end());
    }
  } // namespace

  TEST_CASE("block_davidson: a matrix that is known by its products" * doctest::test_suite("slow"))
  {
    // An unsymmetric band; Hager's estimate of a norm is a lower bound.
    Parameters::All p          = small_brake();
    const Geometry<3> geometry = make_brake(p);
    FiniteElementSpace<3> spaces(geometry, 1, true, MPI_COMM_WORLD);
    spaces.distribute();
    const RowRange &rows = spaces.rows;
    EntryList entries;
    for (unsigned int row = rows.begin; row < rows.end; ++row)
      for (unsigned int k = 0; k < 4; ++k)
        entries.add(row, (row + k * k) % rows.size,
                    scattered(row, k) * (row == rows.size / 2 ? 3 : 1));
    const Matrix stored = entries.make_matrix(rows),
                 known  = make_matrix_free(
                      rows, [&](const MultiVector &x, const bool transposed)
                      { return transposed ? multiply_transposed(stored, x) : multiply(stored, x); });
    const MultiVector x = scattered_numbers(rows, 3, 0);
    CHECK(product_of(known));
    CHECK(!product_of(stored));
    CHECK(largest_entry(difference(multiply(known, x), multiply(stored, x))) == 0);
    CHECK(largest_entry(
              difference(multiply_transposed(known, x), multiply_transposed(stored, x))) == 0);
    const Matrix transposed = known.view(true);
    CHECK(largest_entry(difference(multiply(transposed, x), multiply_transposed(stored, x))) == 0);
    for (const bool transposed : {false, true})
    {
      const double norm = stored.view(transposed).infinity_norm(),
                   told = known.view(transposed).infinity_norm();
      CHECK(told <= norm * (1 + 1e-14));
      CHECK(told >= 0.3 * norm);
    }
    // Of a matrix without negative entries it is the norm.
    const Matrix mass = assemble_body(spaces, all_bodies, p.rotor.material, false).M->view(false),
                 mass_free = make_matrix_free(rows, [&](const MultiVector &y, bool)
                                              { return multiply(mass, y); });
    CHECK(relative_error(mass_free.infinity_norm(), mass.infinity_norm()) < 1e-13);
  }

  TEST_CASE("block_davidson: vectors satisfy the constraints, pressures bear what they can" *
            doctest::test_suite("slow"))
  {
    Parameters::All p          = small_brake();
    const Geometry<3> geometry = make_brake(p);
    FiniteElementSpace<3> spaces(geometry, 2, true, MPI_COMM_WORLD);
    refine_where(spaces, [](const Point<3> &centre, const types::material_id)
                 { return centre[0] > 0 && std::abs(centre[1]) < 0.05; });
    for (const double compliance : {0., 1e-12})
    {
      CAPTURE(compliance);
      ContactModel<3> model = BrakeModel<3>::contact_model(p);
      model.compliance      = compliance;
      model.initial_gap     = {};
      Contact<3> contact(spaces, model);
      contact.scale_constraints(1e9);
      const std::vector<unsigned int> all = contact.multipliers();
      contact.set_closed({all.begin(), all.begin() + 5}, false);
      const auto pressure = contact.uniform_pressure(1e6);
      const Matrix normal = normal_matrix(contact), friction = friction_matrix(contact, pressure),
                   coupling            = sum_of(spaces.rows, {{1, normal}, {1, friction}});
      const unsigned int n_multipliers = spaces.rows.end - spaces.first_local_multiplier;
      MultiVector stiffness(spaces.rows, 1);
      for (unsigned int i = 0; i < stiffness.n_local(); ++i)
        stiffness.data()[i] = 1e9 * (1.5 + scattered(spaces.rows.begin + i));
      const ConstraintProjection constraints(spaces.rows, n_multipliers, coupling, stiffness);

      MultiVector start = scattered_numbers(spaces.rows, 3, 1);
      if (compliance == 0)
        clear_pressures(n_multipliers, start);
      for (const unsigned int row : contact.released_multipliers())
        if (spaces.rows.contains(row))
          for (unsigned int k = 0; k < 3; ++k)
            start.column(k)[row - spaces.rows.begin] = 0;
      for (const bool left : {false, true})
      {
        CAPTURE(left);
        const auto constraint_rows = [&](const MultiVector &x)
        {
          MultiVector y = left ? multiply_transposed(coupling, x) : multiply(coupling, x);
          for (unsigned int k = 0; k < y.n_columns(); ++k)
            std::fill_n(y.column(k), y.n_local() - n_multipliers, 0.);
          return largest_entry(y);
        };
        const double before = constraint_rows(start);
        CHECK(before > 0);
        MultiVector x = start;
        constraints.satisfy(x, left);
        CHECK(constraint_rows(x) <= 1e-12 * before);
        // A projection: nothing is left to do, and multipliers stay.
        MultiVector again = x;
        constraints.satisfy(again, left);
        CHECK(largest_entry(difference(again, x)) <= 1e-12);
        MultiVector moved = difference(x, start);
        for (unsigned int k = 0; k < 3; ++k)
          std::fill_n(moved.column(k), moved.n_local() - n_multipliers, 0.);
        CHECK(largest_entry(moved) == 0);

        // W-weighted, no constraint is loaded any more, and pressures explain the change.
        MultiVector residual = scattered_numbers(spaces.rows, 3, 2);
        clear_pressures(n_multipliers, residual);
        const MultiVector given     = residual;
        const MultiVector pressures = constraints.relieve(residual, left);
        const MultiVector expected =
            left ? multiply_transposed(coupling, pressures) : multiply(coupling, pressures);
        CHECK(largest_entry(difference(difference(residual, given), expected)) <=
              1e-12 * largest_entry(given));
        MultiVector weighted = residual;
        for (unsigned int k = 0; k < 3; ++k)
          for (unsigned int i = 0; i < weighted.n_local(); ++i)
            weighted.column(k)[i] /= stiffness.data()[i];
        clear_pressures(n_multipliers, weighted);
        MultiVector at_start = given;
        for (unsigned int k = 0; k < 3; ++k)
          for (unsigned int i = 0; i < at_start.n_local(); ++i)
            at_start.column(k)[i] /= stiffness.data()[i];
        CHECK(constraint_rows(weighted) <= 1e-12 * constraint_rows(at_start));
      }
    }
  }

  TEST_CASE("block_davidson: modes without factors are those of the assembled equations" *
            doctest::test_suite("slow, one rank, optimised"))
  {
    // (On ranks: tests/run/test_parallel.py.) On a mesh with hanging nodes, with all terms:
    // eigenvalues, and right and left vectors that the assembled matrices judge. Backward errors of
    // these are of the first order: about the root of the eigenvalues' accuracy times what is left
    // of it in the infinity norm.
    Parameters::All p          = small_brake();
    const Geometry<3> geometry = make_brake(p);
    const auto make            = [&](const std::string &solver)
    {
      static Log log(MPI_COMM_WORLD);
      static PhaseTimer timer;
      p.eigenproblem.solver              = value_named<ModeSolver>(solver);
      p.static_equilibrium.linear_solver = LinearSolver::automatic;
      auto model = std::make_unique<BrakeModel<3>>(geometry, p, MPI_COMM_WORLD, log, timer);
      model->distribute();
      refine_where(model->spaces(), [](const Point<3> &centre, const types::material_id)
                   { return centre[0] > 0 && std::abs(centre[1]) < 0.03 && centre[2] > 0; });
      model->distribute();
      model->assemble(p);
      return model;
    };
    const auto assembled                = make("krylov");
    const QuadraticEigenproblem problem = assembled->problem();
    const EigenPairs expected =
        make_eigensolver(ModeSolver::krylov)->solve(problem, options_of(p)).modes;
    const auto matrix_free = make("block_davidson");
    EigenSolution solution = find_modes_without_factors(*matrix_free, options_of(p));
    EigenPairs &found      = solution.modes;
    REQUIRE(found.size() == expected.size());
    REQUIRE(found.size() >= 8);
    for (unsigned int j = 0; j < found.size(); ++j)
    {
      CHECK(std::abs(found.lambda[j] - expected.lambda[j]) <= 1e-10 * std::abs(expected.lambda[j]));
      CHECK(relative_error(found.condition[j], expected.condition[j]) < 1e-4);
    }
    // Pressures are scaled by what each model knows of the stiffness.
    const double scale =
        matrix_free->contact()->pressure_scale() / assembled->contact()->pressure_scale();
    const unsigned int n_multipliers =
        assembled->spaces().rows.end - assembled->spaces().first_local_multiplier;
    for (ComplexMultiVector *x : {&found.right, &found.left})
      for (unsigned int k = 0; k < x->n_columns(); ++k)
        for (unsigned int i = x->n_local() - n_multipliers; i < x->n_local(); ++i)
          x->set(i, k, scale * (*x)(i, k));
    const auto errors = BackwardError(problem)(found);
    CHECK(largest_of(errors) < 1e-6);
    // Norms without matrices are lower bounds, so what was told is not smaller.
    for (unsigned int j = 0; j < errors.size(); ++j)
      CHECK(errors[j] <= 1.001 * found.backward_error[j]);
    EigenPairs transposed;
    transposed.lambda = found.lambda;
    transposed.right  = found.left; // z = conj(y)
    transposed.right.conjugate();
    const QuadraticEigenproblem adjoint = adjoint_of(problem);
    CHECK(largest_of(BackwardError(adjoint)(transposed)) < 1e-6);
    CHECK(contains(solution.proof.completeness, "not proven without factors"));
  }
} // namespace squeal::tests::block_davidson_tests
