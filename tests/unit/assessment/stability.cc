#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/assessment/stability.h>
#include <squeal/assessment/tables.h>
namespace squeal::tests::stability_tests
{
  using Complex = std::complex<double>;

  namespace
  {
    std::vector<ModeRow> rows_of(const std::vector<Complex> &lambda)
    {
      std::vector<ModeRow> rows(lambda.size());
      for (unsigned int j = 0; j < rows.size(); ++j)
        rows[j].lambda = lambda[j];
      return rows;
    }

    /// Two coupled chains of 20 masses, 0.05 apart in stiffness, with damping d K, gyroscopic g and
    /// circulatory n coupling between the chains.
    QuadraticEigenproblem coupled_chains(const double d, const double g, const double n)
    {
      const unsigned int size = 40;
      std::vector<Entry> mass, velocity, position;
      for (unsigned int i = 0; i < size; ++i)
      {
        const double stiffness = i % 2 == 0 ? 1 : 1.05;
        mass.push_back({i, i, 1 + 0.1 * (i % 3)});
        position.push_back({i, i, 2 * stiffness});
        velocity.push_back({i, i, 2 * d * stiffness});
        if (i >= 2)
          for (const bool transposed : {false, true})
          {
            const unsigned int a = transposed ? i - 2 : i, b = transposed ? i : i - 2;
            position.push_back({a, b, -stiffness});
            velocity.push_back({a, b, -d * stiffness});
          }
        if (i % 2 == 1)
        {
          velocity.push_back({i, i - 1, g});
          velocity.push_back({i - 1, i, -g});
          position.push_back({i, i - 1, n});
          position.push_back({i - 1, i, -n});
        }
      }
      QuadraticEigenproblem problem;
      problem.rows = even_rows(size);
      problem.M    = matrix_of(problem.rows, mass);
      if (d != 0 || g != 0)
        problem.P = matrix_of(problem.rows, velocity);
      problem.Q         = matrix_of(problem.rows, position);
      problem.reference = symmetric_part(problem.rows, problem.Q);
      return problem;
    }

    std::vector<ModeRow> analysed(const QuadraticEigenproblem &problem, const std::string &solver)
    {
      EigensolverOptions options;
      options.max_imaginary = 0.8;
      const EigenSolution found =
          make_eigensolver(value_named<ModeSolver>(solver))->solve(problem, options);
      return analyse(problem, found.modes, 3, options.tolerance);
    }
  } // namespace

  TEST_CASE("stability: verdicts")
  {
    // |Re l| <= tolerance |l| is marginal; else the sign of Re l decides, and growth without
    // oscillation is divergence.
    CHECK(verdict({-1, 100}, 1e-9) == Verdict::stable);
    CHECK(verdict({-1, 0}, 1e-9) == Verdict::stable);
    CHECK(verdict({1, 100}, 1e-9) == Verdict::flutter);
    CHECK(verdict({1e-6, 100}, 1e-9) == Verdict::flutter);
    CHECK(verdict({2, 0}, 1e-9) == Verdict::divergence);
    CHECK(verdict({0, 100}, 1e-9) == Verdict::marginal);
    CHECK(verdict({1e-8, 100}, 1e-9) == Verdict::marginal);
    CHECK(verdict({-1e-8, 100}, 1e-9) == Verdict::marginal);
    CHECK(verdict({-1e-8, 100}, 1e-12) == Verdict::stable);
    CHECK(verdict({0, 0}, 1e-9) == Verdict::marginal);
  }

  TEST_CASE("stability: numbers of a row")
  {
    // l = -3 + 4 i: growth -3, frequency 4/(2 pi), damping ratio 3/5.
    ModeRow row;
    row.lambda = {-3, 4};
    CHECK(row.growth_rate() == -3);
    CHECK(relative_error(row.frequency(), 4 / (2 * M_PI)) <= 1e-15);
    CHECK(relative_error(row.damping_ratio(), 0.6) <= 1e-15);
    row.lambda = {0, 4};
    CHECK_FALSE(std::signbit(row.damping_ratio()));
  }

  TEST_CASE("stability: Rayleigh coefficients reproduce the eigenvalues" *
            doctest::test_suite("one rank"))
  {
    // u^H M u = 1: l^2 + (d + i g) l + (k + i n) = 0, exactly one of the two roots (31).
    for (const std::string solver : {"block_krylov", "krylov", "dense"})
      for (const auto &[d, g, n] : {std::make_tuple(0., 0., 0.), std::make_tuple(0.05, 0., 0.),
                                    std::make_tuple(0., 0.1, 0.), std::make_tuple(0., 0., 0.02),
                                    std::make_tuple(0.01, 0.1, 0.02)})
      {
        CAPTURE(solver);
        CAPTURE(d);
        CAPTURE(g);
        CAPTURE(n);
        const auto rows = analysed(coupled_chains(d, g, n), solver);
        CHECK(rows.size() >= 6);
        bool any_n = false, any_g = false;
        for (unsigned int j = 0; j < rows.size(); ++j)
        {
          const ModeRow &row = rows[j];
          const Complex l    = row.lambda, i(0, 1);
          CHECK(row.cycle == 3);
          CHECK(row.mode == j + 1);
          const Complex b = row.d + i * row.g, c = row.k + i * row.n;
          CHECK(std::abs(l * l + b * l + c) <= 1e-9 * std::norm(l));
          const Complex root = std::sqrt(b * b / 4. - c);
          CHECK(std::min(std::abs(-b / 2. + root - l), std::abs(-b / 2. - root - l)) <=
                1e-9 * std::abs(l));
          CHECK(row.k > 0);
          // Each coefficient belongs to one part of one matrix.
          CHECK((d > 0 ? row.d > 0 : std::abs(row.d) <= 1e-13));
          any_g |= std::abs(row.g) > 1e-3;
          any_n |= std::abs(row.n) > 1e-4;
          if (g == 0)
            CHECK(std::abs(row.g) <= 1e-13);
          if (n == 0)
            CHECK(std::abs(row.n) <= 1e-13);
          CHECK(row.verdict == verdict(l, 1e-9));
        }
        CHECK(any_g == (g > 0));
        CHECK(any_n == (n > 0));
      }
  }

  TEST_CASE("stability: causes of growth without oscillation")
  {
    // l^2 + 0.3 l + 4 - 5 = 0: the imaginary part of (30) is zero, the real part gives
    // l = -0.3 - 4/l + 5/l.
    RayleighParts parts;
    parts.origins = {Origin::velocity, Origin::elasticity, Origin::friction};
    parts.bodies  = {"all"};
    parts.n_modes = 1;
    parts.parts   = {{{0.3, 0, 0, 0}}, {{0, 0, 4, 0}}, {{0, 0, -5, 0}}};
    EigenPairs modes;
    modes.lambda         = {-0.15 + std::sqrt(0.15 * 0.15 + 1)};
    modes.backward_error = {0};
    const double l       = modes.lambda[0].real();
    const auto causes    = contributions(parts, modes, analyse(parts, modes, 0, 1e-9));
    REQUIRE(causes.size() == 3);
    CHECK(relative_error(causes[0].growth_rate, -0.3) <= 1e-15);
    CHECK(relative_error(causes[1].growth_rate, -4 / l) <= 1e-15);
    CHECK(relative_error(causes[2].growth_rate, 5 / l) <= 1e-15);
    CHECK(relative_error(causes[0].growth_rate + causes[1].growth_rate + causes[2].growth_rate,
                         l) <= 1e-14);
    // With digits, not as zeros, where all of it is small.
    for (const double scale : {1., 1e-7})
    {
      auto small = causes;
      for (Contribution &cause : small)
        cause.growth_rate *= scale;
      const std::string text = contributions_table(small, {1});
      CHECK(contains(text, scale == 1 ? "growth rate 0.86119 1/s = +5.80594 friction"
                                      : "growth rate 8.6119e-08 1/s = +5.8059e-07 friction"));
    }
  }

  TEST_CASE("stability: with damping, (34) decides as the eigenvalue does")
  {
    // Asymptotically stable iff d > 0 and k d^2 + n d g - n^2 > 0 for both roots of (30); the
    // computed root is one of them, so a stable pair of coefficients means Re l < 0.
    unsigned int n_unstable = 0;
    for (const double n : {0.005, 0.05})
      for (const ModeRow &row : analysed(coupled_chains(0.01, 0.05, n), "dense"))
      {
        const bool stable =
            row.d > 0 && row.k * row.d * row.d + row.n * row.d * row.g - row.n * row.n > 0;
        if (stable)
          CHECK(row.verdict == Verdict::stable);
        n_unstable += row.verdict == Verdict::flutter;
      }
    CHECK(n_unstable > 0);
  }

  TEST_CASE("stability: matching the modes of two meshes")
  {
    const Complex i(0, 1);
    // The same modes in another order: crossing branches keep their growth rates.
    CHECK(match_modes(rows_of({5. + 100.5 * i, -5. + 100.6 * i, 200. * i}),
                      rows_of({-5. + 100. * i, 5. + 100.1 * i, 200. * i})) ==
          std::vector<int>({1, 0, 2}));
    // A common shift by nearly the distance of neighbours does not confuse: nearest ones would be
    // 1, 2 and then 0.
    CHECK(match_modes(rows_of({100. * i, 101. * i, 102. * i}),
                      rows_of({100.9 * i, 101.9 * i, 102.9 * i})) == std::vector<int>({0, 1, 2}));
    // More modes on one mesh than on the other: the far one is left over.
    CHECK(match_modes(rows_of({100. * i, 150. * i, 200. * i}), rows_of({101. * i, 201. * i})) ==
          std::vector<int>({0, -1, 1}));
    CHECK(match_modes(rows_of({101. * i, 201. * i}), rows_of({100. * i, 150. * i, 200. * i})) ==
          std::vector<int>({0, 2}));
    CHECK(match_modes(rows_of({1. * i}), {}) == std::vector<int>({-1}));
    CHECK(match_modes({}, rows_of({1. * i})).empty());
    // The assignment is that of least sum of squares: against all permutations of six scattered
    // eigenvalues.
    std::vector<Complex> fine, coarse;
    for (unsigned int k = 0; k < 6; ++k)
    {
      fine.emplace_back(10 * scattered(k, 1), 100 + 10 * scattered(k, 2));
      coarse.emplace_back(10 * scattered(k, 3), 100 + 10 * scattered(k, 4));
    }
    const auto cost = [&](const std::vector<int> &match)
    {
      double sum = 0;
      for (unsigned int k = 0; k < 6; ++k)
        sum += std::norm(fine[k] - coarse[match[k]]);
      return sum;
    };
    std::vector<int> permutation = {0, 1, 2, 3, 4, 5};
    double least                 = 1e300;
    do
      least = std::min(least, cost(permutation));
    while (std::next_permutation(permutation.begin(), permutation.end()));
    CHECK(relative_error(cost(match_modes(rows_of(fine), rows_of(coarse))), least) <= 1e-14);
  }
} // namespace squeal::tests::stability_tests
