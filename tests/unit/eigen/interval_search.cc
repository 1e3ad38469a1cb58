#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/eigen/interval_search.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/projection/backward_error.h>

#include <algorithm>
#include <cmath>
namespace squeal::tests::interval_search_tests
{
  using Complex = std::complex<double>;

  // n unit masses between walls, damped by alpha each, whose springs push one neighbour more than
  // the other: Q is tridiagonal with 2 and -(1 + mu), -(1 - mu), and P = alpha I. The eigenvalues
  // of Q are w_j^2 = 2 - 2 sqrt(1 - mu^2) cos(j pi/(n + 1)), and l^2 + alpha l + w_j^2 = 0.

  namespace
  {
    constexpr unsigned int n_masses = 60;
    constexpr double alpha = 0.02, mu = 0.02;

    Complex exact(const unsigned int j)
    {
      const double square = 2 - 2 * std::sqrt(1 - mu * mu) * std::cos(j * M_PI / (n_masses + 1));
      return {-alpha / 2, std::sqrt(square - alpha * alpha / 4)};
    }

    QuadraticEigenproblem pushed_chain()
    {
      QuadraticEigenproblem problem;
      problem.rows = even_rows(n_masses);
      std::vector<Entry> mass, damping, position;
      for (unsigned int i = 0; i < n_masses; ++i)
      {
        mass.push_back({i, i, 1});
        damping.push_back({i, i, alpha});
        position.push_back({i, i, 2});
        if (i > 0)
        {
          position.push_back({i, i - 1, -(1 - mu)});
          position.push_back({i - 1, i, -(1 + mu)});
        }
      }
      problem.M = matrix_of(problem.rows, mass);
      problem.P = matrix_of(problem.rows, damping);
      problem.Q = matrix_of(problem.rows, position);
      return problem;
    }

    /// The largest relative distance of an expected eigenvalue to the nearest one found.
    double worst_distance(const std::vector<Complex> &found, const std::vector<Complex> &expected)
    {
      double worst = 0;
      for (const Complex &l : expected)
      {
        double nearest = 1;
        for (const Complex &other : found)
          nearest = std::min(nearest, std::abs(l - other) / std::abs(l));
        worst = std::max(worst, nearest);
      }
      return worst;
    }

    EigenSolution search(const QuadraticEigenproblem &problem, const bool only_count)
    {
      IntervalSearchOptions options;
      options.region        = SearchRegion::between(1.2, 1.5);
      options.min_imaginary = 1.25;
      options.max_imaginary = 1.45;
      options.n_expected    = 8;
      options.only_count    = only_count;
      const Factorization factors(
          sum_of(problem.rows, {{1., problem.Q}, {options.region.square, problem.M}}),
          Factorization::Kind::lu, "a chain");
      return interval_search(problem, factors, options, [](const std::string &) {});
    }

    /// Of the region, and of the window.
    void find_exact(std::vector<Complex> &of_region, std::vector<Complex> &of_window)
    {
      for (unsigned int j = 1; j <= n_masses; ++j)
      {
        if (SearchRegion::between(1.2, 1.5).contains(exact(j)))
          of_region.push_back(exact(j));
        if (exact(j).imag() >= 1.25 && exact(j).imag() <= 1.45)
          of_window.push_back(exact(j));
      }
    }
  } // namespace

  TEST_CASE("interval search: a chain of damped masses with circulatory springs")
  {
    const QuadraticEigenproblem problem = pushed_chain();
    std::vector<Complex> of_region, of_window;
    find_exact(of_region, of_window);
    REQUIRE(of_window.size() >= 4); // 61/pi times the difference of 2 asin(w/2), 0.27: 5
    REQUIRE(of_region.size() > of_window.size());
    const EigenSolution found = search(problem, false);
    const EigenPairs &modes   = found.modes;
    CHECK(modes.size() == of_window.size());
    CHECK(worst_distance(modes.lambda, of_window) <= 1e-11);
    CHECK(found.proof.eigenvalues.size() == of_region.size());
    // Of modes that are not wanted the place is known.
    CHECK(worst_distance(found.proof.eigenvalues, of_region) <= 1e-3);
    EigenPairs transposed;
    transposed.lambda = modes.lambda;
    transposed.right  = modes.left; // z = conj(y), Q(l)^T y = 0
    transposed.right.conjugate();
    const QuadraticEigenproblem adjoint = adjoint_of(problem);
    for (const auto &errors : {BackwardError(problem)(modes), BackwardError(adjoint)(transposed)})
      for (const double error : errors)
        CHECK(error <= 1e-9);
  }

  TEST_CASE("interval search: counting needs no vectors")
  {
    const QuadraticEigenproblem problem = pushed_chain();
    std::vector<Complex> of_region, of_window;
    find_exact(of_region, of_window);
    const EigenSolution counted = search(problem, true);
    CHECK(counted.proof.eigenvalues.size() == of_region.size());
    CHECK(counted.modes.empty());
    CHECK(counted.cost.n_solves < search(problem, false).cost.n_solves);
  }
} // namespace squeal::tests::interval_search_tests
