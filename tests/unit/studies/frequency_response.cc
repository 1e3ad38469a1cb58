#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/eigen/find_modes.h>
#include <squeal/studies/frequency_response.h>

namespace squeal::tests::frequency_response_tests
{
  using Complex = std::complex<double>;

  namespace
  {
    constexpr unsigned int n = 30;

    /// A chain of n masses held at both ends, or free, with damping at one end, gyroscopic and
    /// circulatory forces between neighbours; with hysteresis of its springs.
    struct Chain
    {
      EquationsOfMotion equations;
      std::vector<Complex> dense(const double w) const
      {
        const Complex l(0, w);
        std::vector<Complex> a(n * n);
        const auto add = [&](const Complex factor, const Matrix &matrix)
        {
          for (unsigned int j = 0; j < n; ++j)
          {
            const std::vector<double> column =
                replicate(multiply(matrix, unit_columns(equations.rows, {j})));
            for (unsigned int i = 0; i < n; ++i)
              a[i + n * j] += factor * column[i];
          }
        };
        for (const Term &term : equations.terms)
          add(term.coefficient * std::pow(l, int(term.order)), *term.matrix);
        for (const RelaxationTerm &term : equations.relaxation)
          add(term.coefficient * (term.factor(l) - 1.), *term.matrix);
        return a;
      }
    };

    Chain make_chain(const bool is_free, const double loss_factor)
    {
      std::vector<Entry> mass, spring, velocity, follower;
      for (unsigned int i = 0; i < n; ++i)
      {
        mass.push_back({i, i, 1 + 0.1 * (i % 3)});
        const bool is_end = i == 0 || i == n - 1;
        spring.push_back({i, i, is_free && is_end ? 1. : 2.});
        if (i > 0)
        {
          spring.push_back({i, i - 1, -1});
          spring.push_back({i - 1, i, -1});
          velocity.push_back({i, i - 1, 0.02});
          velocity.push_back({i - 1, i, -0.02});
          follower.push_back({i, i - 1, is_free ? 0 : 0.003});
          follower.push_back({i - 1, i, is_free ? 0 : -0.003});
        }
      }
      if (!is_free)
        velocity.push_back({2, 2, 0.1});
      Chain chain;
      chain.equations.rows = even_rows(n);
      const auto term =
          [&](const Origin origin, const unsigned int order, const std::vector<Entry> &entries)
      {
        chain.equations.terms.push_back(
            {origin, order, 1,
             std::make_shared<const Matrix>(matrix_of(chain.equations.rows, entries))});
      };
      term(Origin::inertia, 2, mass);
      term(Origin::elasticity, 0, spring);
      term(Origin::transport, 1, velocity);
      term(Origin::friction, 0, follower);
      if (loss_factor > 0)
      {
        StiffnessFactor factor;
        factor.loss_factor = loss_factor;
        chain.equations.relaxation.push_back(
            {Origin::elasticity, 1, chain.equations.terms[1].matrix, factor});
      }
      chain.equations.may_move_rigidly = is_free;
      return chain;
    }

    /// e^T A^{-1} f by elimination.
    std::vector<Complex> solve(std::vector<Complex> a, std::vector<Complex> b)
    {
      for (unsigned int k = 0; k < n; ++k)
        for (unsigned int i = k + 1; i < n; ++i)
        {
          const Complex factor = a[i + n * k] / a[k + n * k];
          for (unsigned int j = k; j < n; ++j)
            a[i + n * j] -= factor * a[k + n * j];
          b[i] -= factor * b[k];
        }
      for (unsigned int k = n; k-- > 0;)
      {
        for (unsigned int j = k + 1; j < n; ++j)
          b[k] -= a[k + n * j] * b[j];
        b[k] /= a[k + n * k];
      }
      return b;
    }
  } // namespace

  TEST_CASE("the frequency response of chains is that of elimination, modal and direct" *
            doctest::test_suite("one rank"))
  {
    for (const bool is_free : {false, true})
      for (const double loss_factor : {0., 0.03})
      {
        if (is_free && loss_factor > 0)
          continue;
        const Chain chain = make_chain(is_free, loss_factor);
        EigensolverOptions options;
        options.max_imaginary = 0.6;
        options.tolerance     = 1e-10;
        const EigenSolution found =
            find_modes(ModeSolver::dense, chain.equations, options, Sectors());
        REQUIRE(found.modes.size() > 4);
        const std::vector<unsigned int> forced = {1, 20}, seen = {3, 20, 28};
        const MultiVector forces       = unit_columns(chain.equations.rows, forced),
                          observations = unit_columns(chain.equations.rows, seen);
        std::vector<double> frequencies;
        for (unsigned int i = 1; i <= 60; ++i)
          frequencies.push_back(i * 0.5 / 60 / (2 * M_PI));
        for (const ResponseMethod method : {ResponseMethod::modal, ResponseMethod::direct})
        {
          const FrequencyResponse response =
              frequency_response(chain.equations, Sectors(), found.modes, forces, observations,
                                 frequencies, {method, 1e-6, [](const std::string &) {}});
          // Otherwise nothing is interpolated.
          CHECK((response.n_direct < frequencies.size()) == (method == ResponseMethod::modal));
          for (unsigned int f = 0; f < frequencies.size(); ++f)
          {
            const std::vector<Complex> a = chain.dense(2 * M_PI * frequencies[f]);
            for (unsigned int k = 0; k < forced.size(); ++k)
            {
              std::vector<Complex> b(n);
              b[forced[k]]                 = 1;
              const std::vector<Complex> x = solve(a, b);
              for (unsigned int j = 0; j < seen.size(); ++j)
                CHECK(std::abs(response.values[response.at(f, k, j)] - x[seen[j]]) <=
                      response.errors[response.at(f, k, j)] + 1e-9 * std::abs(x[forced[k]]));
            }
          }
        }
      }
  }
} // namespace squeal::tests::frequency_response_tests
