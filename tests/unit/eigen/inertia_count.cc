#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/eigen/inertia_count.h>

#include <algorithm>
#include <cmath>
#include <set>
namespace squeal::tests::inertia_count_tests
{
  // A chain of n equal masses and springs between walls, some masses held by constraints. What is
  // between two held masses is a chain of its own, with the frequencies 2 sin(j pi / (2 (n + 1))).

  namespace
  {
    constexpr unsigned int n_masses        = 40;
    const std::vector<unsigned int> places = {7, 19, 30}; ///< where masses can be held
    constexpr double omega                 = 0.8;

    unsigned int exact_count(const std::set<unsigned int> &open)
    {
      unsigned int count = 0, first = 0;
      const auto add_chain = [&](const unsigned int end)
      {
        for (unsigned int j = 1; j <= end - first; ++j)
          count += 2 * std::sin(j * M_PI / (2 * (end - first + 1))) < omega;
        first = end + 1;
      };
      for (unsigned int c = 0; c < places.size(); ++c)
        if (open.count(c) == 0)
          add_chain(places[c]);
      add_chain(n_masses);
      return count;
    }

    /// l^2 m + chain; m(i) is the mass of place i.
    template <typename MassOf>
    QuadraticEigenproblem chain_with(const MassOf &mass_of)
    {
      QuadraticEigenproblem problem;
      problem.rows = even_rows(n_masses);
      std::vector<Entry> mass, stiffness;
      for (unsigned int i = 0; i < n_masses; ++i)
      {
        mass.push_back({i, i, mass_of(i)});
        stiffness.push_back({i, i, 2});
        if (i > 0)
        {
          stiffness.push_back({i, i - 1, -1});
          stiffness.push_back({i - 1, i, -1});
        }
      }
      problem.M = matrix_of(problem.rows, mass);
      problem.Q = matrix_of(problem.rows, stiffness);
      return problem;
    }
  } // namespace

  TEST_CASE("reference count: several frequencies, with one matrix")
  {
    const QuadraticEigenproblem problem = chain_with([](unsigned int) { return 1.; }),
                                heavier = chain_with([](unsigned int) { return 4.; });
    const std::vector<double> omegas    = {0.3, 1.9, 0.8, 0.3};
    const auto exact                    = [&](const double mass)
    {
      std::vector<unsigned int> numbers;
      for (const double w : omegas)
      {
        numbers.push_back(0);
        for (unsigned int j = 1; j <= n_masses; ++j)
          numbers.back() += 2 * std::sin(j * M_PI / (2 * (n_masses + 1))) < std::sqrt(mass) * w;
      }
      return numbers;
    };
    CHECK(count_reference_modes(problem, omegas, problem.shifted_reference(0.3)) == exact(1));
    RememberedCounts counts;
    CHECK(counts(problem, omegas) == exact(1));
    CHECK(counts(heavier, omegas) == exact(4));
    CHECK(counts(problem, omegas) == exact(1));

    // 2 - 1^2 2 = 0 on a third of the diagonal is not stored, and missing for the next frequency.
    const QuadraticEigenproblem cancelling =
        chain_with([](const unsigned int i) { return i % 3 == 0 ? 2. : 1.; });
    CHECK(count_reference_modes(cancelling, {1., 1.5, 0.5}, cancelling.shifted_reference(1.)) ==
          std::vector<unsigned int>{count_reference_modes(cancelling, 1.),
                                    count_reference_modes(cancelling, 1.5),
                                    count_reference_modes(cancelling, 0.5)});
  }

  TEST_CASE("reference count: contacts open and close")
  {
    RowRange rows                = even_rows(n_masses);
    const bool is_last           = this_rank() + 1 == n_ranks();
    const unsigned int n_of_rank = is_last ? places.size() : 0; // constraints
    rows.size += places.size();
    rows.end += n_of_rank;
    std::vector<Entry> mass, stiffness;
    for (unsigned int i = 0; i < n_masses; ++i)
    {
      mass.push_back({i, i, 1});
      stiffness.push_back({i, i, 2});
      if (i > 0)
      {
        stiffness.push_back({i, i - 1, -1});
        stiffness.push_back({i - 1, i, -1});
      }
    }
    const auto M        = std::make_shared<const Matrix>(matrix_of(rows, mass)),
               K        = std::make_shared<const Matrix>(matrix_of(rows, stiffness));
    const auto terms_of = [&](const std::set<unsigned int> &open)
    {
      std::vector<Entry> contact;
      for (unsigned int c = 0; c < places.size(); ++c)
        if (const unsigned int row = n_masses + c; open.count(c) > 0)
          contact.push_back({row, row, 3});
        else
        {
          contact.push_back({row, places[c], 1});
          contact.push_back({places[c], row, 1});
        }
      return std::vector<Term>{
          {Origin::inertia, 2, 1., M},
          {Origin::elasticity, 0, 1., K},
          {Origin::contact, 0, 1., std::make_shared<const Matrix>(matrix_of(rows, contact))}};
    };
    InertiaCount reference(rows, n_of_rank, omega);
    // All by the first factorisation
    for (const std::set<unsigned int> &open :
         std::vector<std::set<unsigned int>>{{}, {1}, {0, 2}, {0, 1, 2}, {1, 2}, {}})
    {
      CAPTURE(open.size());
      CHECK(reference.count(terms_of(open)) == exact_count(open));
    }
    // One that begins with an open contact; where it closes another factorisation is needed.
    InertiaCount other(rows, n_of_rank, omega);
    for (const std::set<unsigned int> &open :
         std::vector<std::set<unsigned int>>{{1}, {0, 1}, {0}, {0, 1, 2}})
    {
      CAPTURE(open.size());
      CHECK(other.count(terms_of(open)) == exact_count(open));
    }
  }
} // namespace squeal::tests::inertia_count_tests
