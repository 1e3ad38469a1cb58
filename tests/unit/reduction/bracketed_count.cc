#include "chains.h"

#include <doctest/doctest.h>

#include <squeal/reduction/bracketed_count.h>

#include <cmath>
#include <set>

namespace squeal::tests::bracketed_count_tests
{
  namespace
  {
    /// Three oscillators: a mass, two stiffnesses, and what is indefinite.
    struct Terms
    {
      const RowRange rows = even_rows(3);
      std::shared_ptr<const Matrix> mass, first, second, indefinite;

      Terms()
      {
        const auto shared = [&](const std::vector<double> &values)
        {
          std::vector<Entry> entries;
          for (unsigned int i = 0; i < values.size(); ++i)
            entries.push_back({i, i, values[i]});
          return std::make_shared<const Matrix>(matrix_of(rows, entries));
        };
        mass       = shared({1, 1, 1});
        first      = shared({1, 4, 0});
        second     = shared({0, 2, 9});
        indefinite = shared({1, -1, 0});
      }
      std::vector<Term> operator()(const double m, const double k_1, const double k_2,
                                   const double geometric = 1, const double contact = 1) const
      {
        return {{Origin::inertia, 2, m, mass},
                {Origin::elasticity, 0, k_1, first},
                {Origin::elasticity, 0, k_2, second},
                {Origin::material_damping, 1, k_1, first},
                {Origin::prestress, 0, geometric, indefinite},
                {Origin::contact, 0, contact, indefinite}};
      }
    };
  } // namespace

  TEST_CASE("bracketed count: in a box of coefficients, beyond it and where its corners differ")
  {
    const Terms terms;
    constexpr double omega = 2.5;
    const auto inertia     = [&](const std::vector<Term> &of)
    { return InertiaCount(terms.rows, 0, omega).count(of); };
    for (const bool semidefinite : {true, false})
    {
      CAPTURE(semidefinite);
      BracketedCount bracketed(terms.rows, 0, omega, semidefinite);
      std::set<unsigned int> numbers;
      for (unsigned int k = 0; k < 60; ++k)
      {
        const double m = 1 + 0.4 * std::sin(1. * k), k_1 = 1.2 + 0.5 * std::cos(2.3 * k),
                     k_2 = 0.9 + 0.4 * std::sin(0.7 * k + 1);
        CAPTURE(k);
        const unsigned int n = inertia(terms(m, k_1, k_2));
        CHECK(bracketed.count(terms(m, k_1, k_2)) == n);
        numbers.insert(n);
      }
      CHECK(numbers.size() > 1);
      // What may be indefinite, or is another matrix, is in no box.
      for (const auto &other : {terms(1, 1, 1, 3), terms(1, 1, 1, 1, 4), terms(1, 1, 1)})
        CHECK(bracketed.count(other) == inertia(other));
      std::vector<Term> exchanged = terms(1, 1, 1);
      exchanged[1].matrix         = terms.second;
      CHECK(bracketed.count(exchanged) == inertia(exchanged));
      bracketed.forget_box();
      CHECK(bracketed.count(terms(1, 1, 1)) == inertia(terms(1, 1, 1)));
    }
  }
} // namespace squeal::tests::bracketed_count_tests
