#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/base/errors.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/eigen/inertia_count.h>
#include <squeal/projection/backward_error.h>
#include <squeal/reduction/reduced_model.h>
namespace squeal::tests::eigensolvers_tests
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Second differences on n masses at rows first, first + stride ...: springs of stiffness 1
    /// between neighbours and, if its ends are fixed, to the walls.
    std::vector<Entry> chain(const unsigned int n, const bool fixed, const unsigned int first = 0,
                             const unsigned int stride = 1)
    {
      std::vector<Entry> entries;
      for (unsigned int i = 0; i < n; ++i)
      {
        const unsigned int row = first + i * stride;
        entries.push_back({row, row, (!fixed && (i == 0 || i + 1 == n)) ? 1. : 2.});
        if (i > 0)
        {
          entries.push_back({row, row - stride, -1.});
          entries.push_back({row - stride, row, -1.});
        }
      }
      return entries;
    }

    /// omega_j of a chain with fixed ends, j = 1 ... n.
    double fixed_chain(const unsigned int n, const unsigned int j)
    {
      return 2 * std::sin(j * M_PI / (2 * (n + 1)));
    }

    QuadraticEigenproblem problem_of(const unsigned int n, const std::vector<Entry> &mass,
                                     const std::vector<Entry> &velocity,
                                     const std::vector<Entry> &position,
                                     const bool with_reference = false)
    {
      QuadraticEigenproblem problem;
      problem.rows = even_rows(n);
      problem.M    = matrix_of(problem.rows, mass);
      if (!velocity.empty())
        problem.P = matrix_of(problem.rows, velocity);
      problem.Q = matrix_of(problem.rows, position);
      if (with_reference)
      {
        problem.reference      = symmetric_part(problem.rows, problem.Q);
        problem.reference_name = "the symmetric part";
      }
      return problem;
    }

    EigensolverOptions window(const double max_imaginary, const double shift = 0)
    {
      EigensolverOptions options;
      options.max_imaginary = max_imaginary;
      options.shift         = shift;
      return options;
    }

    /// Whether eigenvalues and expected ones agree as sets, relative to their moduli.
    void check_set(std::vector<Complex> computed, std::vector<Complex> expected,
                   const double tolerance)
    {
      CHECK(computed.size() == expected.size());
      double worst = 0;
      for (const Complex &l : expected)
      {
        auto nearest = std::min_element(computed.begin(), computed.end(),
                                        [&](const Complex &a, const Complex &b)
                                        { return std::abs(a - l) < std::abs(b - l); });
        if (nearest == computed.end())
          break;
        worst = std::max(worst, std::abs(*nearest - l) / std::abs(l));
        computed.erase(nearest);
      }
      CHECK(worst <= tolerance);
    }

    /// Order, normalisation u^H M u = 1, phase, and backward errors of what a solver returns.
    void check_form(const QuadraticEigenproblem &problem, const EigenPairs &modes,
                    const double tolerance = 1e-9)
    {
      const unsigned int n = modes.lambda.size();
      CHECK(modes.backward_error.size() == n);
      CHECK(modes.right.re.n_columns() == n);
      CHECK(modes.right.im.n_columns() == n);
      CHECK(std::is_sorted(modes.lambda.begin(), modes.lambda.end(),
                           [](const Complex &a, const Complex &b) { return a.imag() < b.imag(); }));
      const auto recomputed = BackwardError(problem)(modes);
      const DenseMatrix re = replicated(modes.right.re), im = replicated(modes.right.im);
      const ComplexMultiVector m = multiply(problem.M, modes.right);
      const auto re_m_re         = inner_products(modes.right.re, m.re).values,
                 im_m_im         = inner_products(modes.right.im, m.im).values;
      for (unsigned int j = 0; j < n; ++j)
      {
        CHECK(modes.lambda[j].imag() >= 0);
        CHECK(modes.backward_error[j] <= tolerance);
        CHECK(recomputed[j] <= tolerance);
        CHECK(relative_error(re_m_re[j * (n + 1)] + im_m_im[j * (n + 1)], 1) <= 1e-12);
        double largest = 0, at_largest = 0;
        for (unsigned int i = 0; i < re.n_rows; ++i)
          if (std::hypot(re(i, j), im(i, j)) > largest * (1 + 1e-8))
          {
            largest    = std::hypot(re(i, j), im(i, j));
            at_largest = im(i, j);
          }
        CHECK(std::abs(at_largest) <= 1e-7 * largest);
      }
    }

    /// The modes; none, and a failed check, if the solver gives up. (It gives up on all ranks
    /// together.)
    EigenSolution solve(const std::string &name, const QuadraticEigenproblem &problem,
                        const EigensolverOptions &options)
    {
      try
      {
        return make_eigensolver(value_named<ModeSolver>(name))->solve(problem, options);
      }
      catch (const SolverError &error)
      {
        FAIL_CHECK(std::string(error.what()));
      }
      EigenSolution nothing;
      nothing.modes.right = nothing.modes.left = ComplexMultiVector(problem.rows, 0);
      return nothing;
    }

    const std::vector<std::string> solvers = {"block_krylov", "krylov", "dense"};
  } // namespace

  TEST_CASE("eigensolvers: a chain with fixed ends")
  {
    // omega_j = 2 sin(j pi/(2 (n + 1))), n = 60: seven of them up to 0.4.
    const auto problem = problem_of(60, diagonal(60, 1), {}, chain(60, true));
    for (const std::string &name : solvers)
    {
      CAPTURE(name);
      const EigenSolution found = solve(name, problem, window(0.4));
      const EigenPairs &modes   = found.modes;
      std::vector<Complex> expected;
      for (unsigned int j = 1; j <= 7; ++j)
        expected.emplace_back(0, fixed_chain(60, j));
      check_set(modes.lambda, expected, 1e-10);
      check_form(problem, modes);
      CHECK(found.proof.n_rigid_body_modes == 0);
      for (const Complex &l : modes.lambda)
        CHECK(l.real() == 0); // without velocity terms and with symmetric matrices exactly
    }
  }

  namespace
  {
    /// omega_j = 2 sin(j pi/(2 n)), j = 0 the rigid-body mode, which is counted but not listed.
    void check_free_chain(const std::string &solver, const double shift)
    {
      const unsigned int n = 60;
      const auto problem   = problem_of(n, diagonal(n, 1), {}, chain(n, false));
      std::vector<Complex> expected;
      for (unsigned int j = 1; j <= 7; ++j)
        expected.emplace_back(0, 2 * std::sin(j * M_PI / (2 * n)));
      const EigenSolution found = solve(solver, problem, window(0.4, shift));
      check_set(found.modes.lambda, expected, 1e-9);
      check_form(problem, found.modes);
      CHECK(found.proof.n_rigid_body_modes == 1);
    }
  } // namespace

  TEST_CASE("eigensolvers: a chain that is free to move, dense")
  {
    check_free_chain("dense", 0.1);
  }

  // The double zero of the rigid-body mode comes as two real Ritz values. refine_eigenpairs() keeps
  // as many pairs as the search found inside the radius, those of the smallest backward errors: the
  // second zero must not push a mode of the window out.
  TEST_CASE("eigensolvers: a chain that is free to move, krylov")
  {
    check_free_chain("krylov", 0);
  }

  TEST_CASE("eigensolvers: a chain that is free to move, block_krylov")
  {
    for (const double shift : {0., 0.3})
      check_free_chain("block_krylov", shift);
  }

  TEST_CASE("eigensolvers: a shift of the user's choice changes nothing")
  {
    const auto problem = problem_of(40, diagonal(40, 2), {}, chain(40, true));
    const auto plain   = solve("krylov", problem, window(0.3)).modes;
    CHECK(plain.lambda.size() == 5); // 2 sin(j pi/82)/sqrt 2 = 0.0542 j
    for (const std::string &name : solvers)
      for (const double shift : {0.05, 0.7})
      {
        CAPTURE(name);
        CAPTURE(shift);
        const auto shifted = solve(name, problem, window(0.3, shift)).modes;
        check_set(shifted.lambda, plain.lambda, 1e-9);
      }
  }

  TEST_CASE("eigensolvers: degenerate pairs")
  {
    // Two equal chains, rows interleaved: every eigenvalue twice, each time with two independent
    // vectors: the determinant of their Gram matrix, 1 - |x_1^H x_2|^2, is not 0.
    const auto problem =
        problem_of(60, diagonal(60, 1), {}, chain(30, true, 0, 2) + chain(30, true, 1, 2));
    for (const std::string &name : solvers)
    {
      CAPTURE(name);
      const EigenPairs modes = solve(name, problem, window(0.45)).modes;
      std::vector<Complex> expected;
      for (unsigned int j = 1; j <= 4; ++j)
        expected.insert(expected.end(), 2, Complex(0, fixed_chain(30, j)));
      check_set(modes.lambda, expected, 1e-10);
      check_form(problem, modes);
      const auto rr        = inner_products(modes.right.re, modes.right.re).values,
                 ii        = inner_products(modes.right.im, modes.right.im).values;
      const auto ri        = inner_products(modes.right.re, modes.right.im).values;
      const unsigned int n = modes.lambda.size();
      for (unsigned int j = 0; j + 1 < n; j += 2)
      {
        const Complex product(rr[j + (j + 1) * n] + ii[j + (j + 1) * n],
                              ri[j + (j + 1) * n] - ri[j + 1 + j * n]);
        CHECK(1 - std::norm(product) >= 1e-3);
      }
    }
  }

  TEST_CASE("eigensolvers: eigenvalues of a multiplicity larger than the block" *
            doctest::test_suite("slow, optimised"))
  {
    // Nine equal chains with damping c M: -c/2 + i sqrt(omega_j^2 - c^2/4), each nine times.
    const unsigned int n_chains = 9, n = 20;
    const double c = 0.01;
    std::vector<Entry> stiffness;
    for (unsigned int k = 0; k < n_chains; ++k)
      stiffness = stiffness + chain(n, true, k, n_chains);
    const auto problem = problem_of(n * n_chains, diagonal(n * n_chains, 1),
                                    diagonal(n * n_chains, c), stiffness, true);
    std::vector<Complex> expected;
    for (unsigned int j = 1; j <= 3; ++j)
      expected.insert(expected.end(), n_chains,
                      Complex(-c / 2, std::sqrt(std::pow(fixed_chain(n, j), 2) - c * c / 4)));
    const EigenPairs modes = solve("block_krylov", problem, window(0.5)).modes;
    check_set(modes.lambda, expected, 1e-9);
    check_form(problem, modes);
  }

  TEST_CASE("eigensolvers: a gyroscopic conservative system has no growth")
  {
    // Pairs (x, y) of a chain in a frame turning at Omega: with z = x + i y, z'' + 2 i Omega z' +
    // (omega^2 - Omega^2) z = 0, z = exp(i s t), s = -Omega +- omega: frequencies |omega_j +-
    // Omega|, growth rates 0. At Omega = 0.15, above omega_1 = 0.101, the position matrix is
    // indefinite and the motion still stable.
    const unsigned int n = 30;
    for (const double omega : {0.02, 0.15})
    {
      std::vector<Entry> gyroscopic;
      for (unsigned int i = 0; i < n; ++i)
      {
        gyroscopic.push_back({2 * i, 2 * i + 1, -2 * omega});
        gyroscopic.push_back({2 * i + 1, 2 * i, 2 * omega});
      }
      const auto problem = problem_of(
          2 * n, diagonal(2 * n, 1), gyroscopic,
          chain(n, true, 0, 2) + chain(n, true, 1, 2) + diagonal(2 * n, -omega * omega), true);
      std::vector<Complex> expected;
      for (unsigned int j = 1; j <= n; ++j)
        for (const double s : {fixed_chain(n, j) + omega, std::abs(fixed_chain(n, j) - omega)})
          if (s <= 0.41)
            expected.emplace_back(0, s);
      CHECK(expected.size() > 6);
      for (const std::string &name : solvers)
      {
        CAPTURE(omega);
        CAPTURE(name);
        const EigenPairs modes = solve(name, problem, window(0.41)).modes;
        check_set(modes.lambda, expected, 1e-10);
        check_form(problem, modes);
        for (const Complex &l : modes.lambda)
          CHECK(std::abs(l.real()) <= 1e-11 * std::abs(l));
      }
    }
  }

  TEST_CASE("eigensolvers: damping, gyroscopic and circulatory terms together; both solvers agree")
  {
    // P = 0.02 K + G, Q = K + N with N coupling neighbouring nodes skew-symmetrically: what is
    // damped proportionally to K loses the high modes; nothing here has a formula, the dense solver
    // is the oracle.
    const unsigned int n = 60;
    std::vector<Entry> velocity, position = chain(n, true);
    for (Entry entry : chain(n, true))
      velocity.push_back({entry.row, entry.column, 0.02 * entry.value});
    for (unsigned int i = 0; i + 1 < n; i += 2)
    {
      velocity.push_back({i, i + 1, 0.05});
      velocity.push_back({i + 1, i, -0.05});
      position.push_back({i, i + 1, 0.01 * (1 + i % 3)});
      position.push_back({i + 1, i, -0.01 * (1 + i % 3)});
    }
    const auto problem     = problem_of(n, diagonal(n, 1), velocity, position, true);
    const EigenPairs dense = solve("dense", problem, window(0.6)).modes;
    CHECK(dense.lambda.size() >= 10);
    check_form(problem, dense);
    // The least damped mode still has Re l != 0: the comparison is not one of zeros.
    for (const Complex &l : dense.lambda)
      CHECK(std::abs(l.real()) >= 1e-6 * std::abs(l));
    for (const double shift : {0., 0.2})
    {
      CAPTURE(shift);
      for (const std::string name : {"block_krylov", "krylov"})
      {
        CAPTURE(name);
        const EigenPairs modes = solve(name, problem, window(0.6, shift)).modes;
        check_set(modes.lambda, dense.lambda, 1e-9);
        check_form(problem, modes);
      }
    }
  }

  TEST_CASE("eigensolvers: divergence is listed once, decay without oscillation is not")
  {
    // K - c I with omega_1^2 < c < omega_2^2: l = +-sqrt(c - omega_1^2) real, of which the growing
    // one is listed, then i sqrt(omega_j^2 - c).
    const unsigned int n = 40;
    const double w_1 = fixed_chain(n, 1), w_2 = fixed_chain(n, 2), c = (w_1 * w_1 + w_2 * w_2) / 2;
    const auto problem = problem_of(n, diagonal(n, 1), {}, chain(n, true) + diagonal(n, -c));
    std::vector<Complex> expected = {std::sqrt(c - w_1 * w_1)};
    for (unsigned int j = 2; j <= 5; ++j)
      expected.emplace_back(0, std::sqrt(std::pow(fixed_chain(n, j), 2) - c));
    for (const std::string &name : solvers)
    {
      CAPTURE(name);
      const EigenPairs modes = solve(name, problem, window(0.4)).modes;
      check_set(modes.lambda, expected, 1e-9);
      check_form(problem, modes);
    }
  }

  TEST_CASE("eigensolvers: overdamped modes do not oscillate and are not listed")
  {
    // P = c M: l = -c/2 +- sqrt(c^2/4 - omega_j^2), with c = 0.15 two negative real numbers for
    // omega_1 = 0.0515, which lie inside of the search region, and from omega_2 = 0.103 on -0.075 +
    // i sqrt(omega_j^2 - 0.075^2).
    const double c     = 0.15;
    const auto problem = problem_of(60, diagonal(60, 1), diagonal(60, c), chain(60, true), true);
    std::vector<Complex> expected;
    for (unsigned int j = 2; j <= 7; ++j)
      expected.emplace_back(-c / 2, std::sqrt(std::pow(fixed_chain(60, j), 2) - c * c / 4));
    CHECK(expected.back().imag() < 0.36);
    for (const std::string &name : solvers)
    {
      CAPTURE(name);
      const EigenPairs modes = solve(name, problem, window(0.36)).modes;
      check_set(modes.lambda, expected, 1e-10);
      check_form(problem, modes);
    }
  }

  TEST_CASE("eigensolvers: a window without any mode")
  {
    // omega_1 = 0.0515 of 60 masses.
    const auto problem = problem_of(60, diagonal(60, 1), {}, chain(60, true));
    for (const std::string &name : solvers)
    {
      CAPTURE(name);
      const EigenPairs modes = solve(name, problem, window(0.03)).modes;
      CHECK(modes.lambda.empty());
      check_form(problem, modes);
    }
  }

  TEST_CASE("eigensolvers: a window that holds all modes")
  {
    // The search cannot find a mode outside that would end it.
    const auto problem = problem_of(7, diagonal(7, 1), {}, chain(7, true));
    for (const std::string &name : solvers)
    {
      CAPTURE(name);
      std::vector<Complex> expected;
      for (unsigned int j = 1; j <= 7; ++j)
        expected.emplace_back(0, fixed_chain(7, j));
      const EigenPairs modes = solve(name, problem, window(3)).modes;
      check_set(modes.lambda, expected, 1e-10);
    }
  }

  TEST_CASE("eigensolvers: counting modes by inertia")
  {
    // 2 sin(j pi/122) < omega.
    const auto problem = problem_of(60, diagonal(60, 1), {}, chain(60, true));
    for (unsigned int j = 0; j <= 60; j += 5)
      CHECK(count_reference_modes(problem, 2 * std::sin((j + 0.5) * M_PI / 122)) == j);

    // The reference problem, if there is one, is what is counted: here springs four times as stiff.
    auto other      = problem_of(60, diagonal(60, 1), {}, chain(60, true));
    other.reference = sum_of(other.rows, {{4., other.Q}});
    CHECK(count_reference_modes(other, 2 * 2 * std::sin(5.5 * M_PI / 122)) == 5);
  }

  namespace
  {
    /// A chain of 62 masses with constraints u_19 = 0 and u_45 = 0: three chains of 19, 25 and 16
    /// masses. Each rank owns some masses and then some multipliers. The constraint forces act
    /// also, mu times, on mass 10 and 30.
    QuadraticEigenproblem constrained_chain(const double mu, const bool coupled = true)
    {
      const unsigned int n                  = 62;
      const std::vector<unsigned int> fixed = {19, 45};
      QuadraticEigenproblem problem;
      std::vector<unsigned int> row_of_mass(n), row_of_constraint(fixed.size());
      unsigned int row = 0;
      for (unsigned int rank = 0; rank < n_ranks(); ++rank)
      {
        const unsigned int begin = row;
        for (unsigned int i = n * rank / n_ranks(); i < n * (rank + 1) / n_ranks(); ++i)
          row_of_mass[i] = row++;
        const unsigned int first_multiplier = row;
        for (unsigned int c = 0; c < fixed.size(); ++c)
          if ((c + 1) % n_ranks() == rank)
            row_of_constraint[c] = row++;
        if (rank == this_rank())
        {
          problem.rows                = {MPI_COMM_WORLD, begin, row, n + unsigned(fixed.size())};
          problem.n_local_constraints = row - first_multiplier;
        }
      }
      problem.n_constraints = fixed.size();

      std::vector<Entry> mass, position, friction;
      for (unsigned int i = 0; i < n; ++i)
        mass.push_back({row_of_mass[i], row_of_mass[i], 1});
      for (const Entry &entry : chain(n, true))
        position.push_back({row_of_mass[entry.row], row_of_mass[entry.column], entry.value});
      for (unsigned int c = 0; c < fixed.size() && coupled; ++c)
      {
        position.push_back({row_of_mass[fixed[c]], row_of_constraint[c], 1});
        position.push_back({row_of_constraint[c], row_of_mass[fixed[c]], 1});
        friction.push_back({row_of_mass[c == 0 ? 10 : 30], row_of_constraint[c], mu});
      }
      problem.M = matrix_of(problem.rows, mass);
      problem.Q = matrix_of(problem.rows, position + (mu == 0 ? std::vector<Entry>() : friction));
      if (mu != 0)
      {
        problem.reference      = matrix_of(problem.rows, position);
        problem.reference_name = "the chain without friction";
      }
      return problem;
    }
  } // namespace

  namespace
  {
    /// The union of the spectra of three chains; multipliers are reaction forces, no modes of their
    /// own.
    void check_constrained_chain(const std::string &solver, QuadraticEigenproblem problem)
    {
      std::vector<Complex> expected;
      for (const unsigned int n : {19u, 25u, 16u})
        for (unsigned int j = 1; fixed_chain(n, j) <= 0.6; ++j)
          expected.emplace_back(0, fixed_chain(n, j));
      CHECK(expected.size() == 11); // 0.157 j, 0.120 j, 0.184 j: 3 + 5 + 3
      CHECK(count_reference_modes(problem, 0.6) == 11);
      const EigenPairs modes = solve(solver, problem, window(0.6)).modes;
      check_set(modes.lambda, expected, 1e-10);
      check_form(problem, modes);
    }
  } // namespace

  TEST_CASE("eigensolvers: constraints")
  {
    check_constrained_chain("dense", constrained_chain(0));
    // With a reference problem given, although it is the problem itself.
    QuadraticEigenproblem problem = constrained_chain(0);
    problem.reference             = sum_of(problem.rows, {{1., problem.Q}});
    check_constrained_chain("krylov", std::move(problem));
    check_constrained_chain("block_krylov", constrained_chain(0));
  }

  // Trial vectors have differences of parallel columns, blown up from rounding by orthonormalize(),
  // which violate the constraints: tested with themselves they would give the Ritz values of a
  // system with softer constraints, which never converge. With Z = Q^-T M U all is well, without a
  // reference problem, too.
  TEST_CASE("eigensolvers: constraints of a symmetric problem, krylov")
  {
    check_constrained_chain("krylov", constrained_chain(0));
  }

  TEST_CASE("eigensolvers: constraints with friction; both solvers agree")
  {
    // The frictionless frequencies are the reference, the eigenvalues are those of the dense
    // solver; without velocity terms they come in pairs +-l.
    for (const double mu : {0.1, 0.8})
    {
      CAPTURE(mu);
      const auto problem     = constrained_chain(mu);
      const EigenPairs dense = solve("dense", problem, window(0.6)).modes;
      CHECK(dense.lambda.size() >= 8);
      check_form(problem, dense);
      for (const std::string name : {"block_krylov", "krylov"})
      {
        CAPTURE(name);
        const EigenPairs modes = solve(name, problem, window(0.6)).modes;
        check_set(modes.lambda, dense.lambda, 1e-9);
        check_form(problem, modes);
      }
    }
  }

  TEST_CASE("eigensolvers: projected modes are those of the problem itself")
  {
    // The chain with a weak step of friction each time. Only the contact's matrix is another one,
    // so that all but six rows are projected once. The dense solver is the oracle.
    EigensolverOptions options = window(0.6);
    options.keep_factors       = true;
    options.tolerance          = 1e-8; // 62 unknowns leave little room for corrections
    const auto shared          = [](Matrix &&matrix)
    { return std::make_shared<const Matrix>(std::move(matrix)); };
    const auto first     = constrained_chain(0.1);
    const auto mass      = shared(sum_of(first.rows, {{1., first.M}}));
    const auto stiffness = shared(std::move(constrained_chain(0, false).Q));
    const auto terms_of  = [&](const double mu)
    {
      const auto contact =
          shared(sum_of(first.rows, {{1., constrained_chain(mu).Q}, {-1., *stiffness}}));
      return std::vector<Term>{{Origin::inertia, 2, 1., mass},
                               {Origin::elasticity, 0, 1., stiffness},
                               {Origin::contact, 0, 1., contact}};
    };
    ReducedModel reduced(options);
    auto problem             = constrained_chain(0.1);
    problem.may_move_rigidly = false;
    reduced.set_expansion_point(
        problem, terms_of(0.1),
        make_eigensolver(ModeSolver::block_krylov)->solve(problem, options).reuse);
    REQUIRE(reduced.has_expansion_point());
    for (const double mu : {0.1001, 0.1002, 0.1003})
    {
      CAPTURE(mu);
      const auto modes = reduced.solve(terms_of(mu));
      REQUIRE(modes);
      const auto present     = constrained_chain(mu);
      const EigenPairs dense = solve("dense", present, window(0.6)).modes;
      check_set(modes->lambda, dense.lambda, 1e-9);
      for (const double error : modes->backward_error)
        CHECK(error <= options.tolerance);
      for (unsigned int j = 0; j < dense.lambda.size(); ++j)
        CHECK(relative_error(modes->condition[j], dense.condition[j]) <= 1e-4);
    }
  }

  TEST_CASE("eigensolvers: the backward error")
  {
    // One unknown, l^2 + 0.5 l + 1 at l = 2 i: |-4 + i + 1|/(4 + 1 + 1) = sqrt(10)/6, whatever the
    // vector; rank 0 has the row. For the exact roots it vanishes.
    QuadraticEigenproblem problem = problem_of(1, {{0, 0, 1}}, {{0, 0, 0.5}}, {{0, 0, 1}});
    const MultiVector re = block_of(problem.rows, 2, [](unsigned int, unsigned int) { return 3.; });
    const MultiVector im =
        block_of(problem.rows, 2, [](unsigned int, unsigned int) { return -4.; });
    EigenPairs pairs;
    pairs.lambda = {Complex(0, 2), Complex(-0.25, std::sqrt(1 - 0.0625))};
    pairs.right  = {re, im};
    const BackwardError backward_error(problem);
    const ComplexMultiVector result  = backward_error.residuals(pairs);
    const std::vector<double> errors = backward_error(pairs);
    CHECK(relative_error(errors[0], std::sqrt(10.) / 6) <= 1e-15);
    CHECK(errors[1] <= 1e-15);
    // The residual (-3 + i)(3 - 4 i) = -5 + 15 i.
    CHECK(relative_error(replicated(result.re)(0, 0), -5) <= 1e-15);
    CHECK(relative_error(replicated(result.im)(0, 0), 15) <= 1e-15);
  }

  TEST_CASE("eigensolvers: errors")
  {
    CHECK(contains(message_of<InputError>([]() { value_named<ModeSolver>("magic"); }), "krylov"));
    // LAPACK on 3001 unknowns is refused at once.
    const auto problem = problem_of(3001, diagonal(3001, 1), {}, chain(3001, true));
    CHECK(contains(message_of<SolverError>(
                       [&]() { make_eigensolver(ModeSolver::dense)->solve(problem, window(0.1)); }),
                   "3001"));
  }
} // namespace squeal::tests::eigensolvers_tests
