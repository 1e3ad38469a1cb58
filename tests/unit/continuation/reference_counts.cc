#include "chains.h"

#include <doctest/doctest.h>

#include <squeal/continuation/reference_counts.h>
#include <squeal/eigen/inertia_count.h>

namespace squeal::tests::reference_counts_tests
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

  TEST_SUITE("reference counts")
  {
    TEST_CASE("stiffer and lighter, softer and heavier, both, other matrices")
    {
      const Terms terms;
      ReferenceCounts counts(true);
      const auto compare = [&](const std::vector<Term> &a, const std::vector<Term> &b)
      { return ReferenceCounts::compare(counts.key_of(a), counts.key_of(b)); };
      CHECK(compare(terms(1, 1, 1), terms(1, 1, 1)) == 0);
      CHECK(compare(terms(1, 2, 1), terms(1, 1, 1)) == 1);
      CHECK(compare(terms(1, 2, 3), terms(1, 1, 1)) == 1);
      CHECK(compare(terms(0.5, 2, 1), terms(1, 1, 1)) == 1);
      CHECK(compare(terms(2, 1, 1), terms(1, 1, 1)) == -1);
      CHECK(compare(terms(2, 0.5, 1), terms(1, 1, 1)) == -1);
      CHECK(!compare(terms(2, 2, 1), terms(1, 1, 1)));
      CHECK(!compare(terms(1, 2, 0.5), terms(1, 1, 1)));
      // What may be indefinite, or is another matrix, must be the same.
      CHECK(!compare(terms(1, 1, 1, 2), terms(1, 1, 1)));
      CHECK(!compare(terms(1, 1, 1, 1, 2), terms(1, 1, 1)));
      std::vector<Term> other = terms(1, 1, 1);
      other[1].matrix         = terms.second;
      CHECK(!compare(other, terms(1, 1, 1)));
      other.pop_back();
      CHECK(!compare(other, terms(1, 1, 1)));
      // Nothing is known of matrices from files.
      ReferenceCounts of_files;
      CHECK(!ReferenceCounts::compare(of_files.key_of(terms(1, 2, 1)),
                                      of_files.key_of(terms(1, 1, 1))));
    }

    TEST_CASE("between two of the same number all have it; elsewhere nothing is known")
    {
      const Terms terms;
      ReferenceCounts counts(true);
      const auto find = [&](const double m, const double k_1, const double k_2)
      { return counts.find(counts.key_of(terms(m, k_1, k_2))); };
      const auto add = [&](const double m, const double k_1, const double k_2, const bool is_same)
      { counts.add(counts.key_of(terms(m, k_1, k_2)), is_same); };
      add(1, 1, 1, true);
      CHECK(find(1, 1, 1) == true);
      CHECK(!find(1, 2, 1));
      add(0.9, 2, 2, true);
      CHECK(find(1, 1.5, 1) == true);
      CHECK(find(0.95, 1.5, 1.2) == true);
      CHECK(!find(1.1, 1.5, 1.2));
      CHECK(!find(1, 1.5, 0.9));
      add(1, 3, 3, false);
      CHECK(find(1, 3, 3) == false);
      CHECK(!find(1, 2.5, 2.5)); // what has another number bounds nothing
      counts.clear();
      CHECK(!find(1, 1, 1));
    }

    TEST_CASE("the inertia agrees wherever it is bracketed")
    {
      const Terms terms;
      const auto inertia = [&](const std::vector<Term> &of)
      { return InertiaCount(terms.rows, 0, 2.5).count(of); };
      // w^2 = 1 + 2, 4 + 2 - 2, 9 at the centre, with what the indefinite matrices add: two below.
      ReferenceCounts counts(true);
      const unsigned int n = inertia(terms(1, 1, 1));
      CHECK(n == 2);
      for (const double m : {0.8, 1., 1.2})
        for (const double k_1 : {0.8, 1., 1.2, 1.6})
          for (const double k_2 : {0.5, 0.8, 1., 1.2})
            if (m != 1 || k_1 != 1 || k_2 != 1)
              counts.add(counts.key_of(terms(m, k_1, k_2)), inertia(terms(m, k_1, k_2)) == n);
      unsigned int n_known = 0;
      for (double m = 0.75; m < 1.3; m += 0.1)
        for (double k_1 = 0.75; k_1 < 1.7; k_1 += 0.1)
          for (double k_2 = 0.45; k_2 < 1.3; k_2 += 0.1)
            if (const auto known = counts.find(counts.key_of(terms(m, k_1, k_2))))
            {
              CHECK(*known == (inertia(terms(m, k_1, k_2)) == n));
              ++n_known;
            }
      CHECK(n_known > 20);
    }
  }
} // namespace squeal::tests::reference_counts_tests
