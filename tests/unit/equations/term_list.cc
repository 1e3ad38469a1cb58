#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/equations/term_list.h>

#include <cmath>
#include <memory>
#include <vector>

namespace squeal::tests::term_list_tests
{
  namespace
  {
    std::shared_ptr<const Matrix> shared_diagonal(const RowRange &rows, const double value)
    {
      std::vector<Entry> entries;
      for (unsigned int i = 0; i < rows.size; ++i)
        entries.push_back({i, i, value * (1 + i)});
      return std::make_shared<const Matrix>(matrix_of(rows, entries));
    }

    /// D = alpha M + beta K beside M and K, and matrices that are none.
    struct Damped
    {
      RowRange rows                   = even_rows(6);
      std::shared_ptr<const Matrix> m = shared_diagonal(rows, 1), k = shared_diagonal(rows, 10);

      std::vector<Term> operator()(const double alpha, const double beta) const
      {
        return {{Origin::inertia, 2, 1., m},
                {Origin::elasticity, 0, 2., k},
                {Origin::material_damping, 1, alpha, m},
                {Origin::material_damping, 1, beta, k},
                {Origin::material_damping, 0, 0.5, k},
                {Origin::friction, 0, 1., nullptr},
                {Origin::friction, 0, 1., std::make_shared<const Matrix>()}};
      }
    };

    MultiVector ones(const RowRange &rows)
    {
      MultiVector x(rows, 1);
      for (unsigned int i = 0; i < rows.n_local(); ++i)
        x.data()[i] = 1;
      return x;
    }
  } // namespace

  TEST_CASE("term list: each matrix once, its coefficients by order, products and terms")
  {
    const Damped terms;
    const TermList list(terms(0.3, 0));
    REQUIRE(list.n_matrices() == 2);
    CHECK(list.matrix(0) == terms.m);
    CHECK(list.by_order(0) == std::array<double, 3>{{0, 0.3, 1}});
    CHECK(list.by_order(1) == std::array<double, 3>{{2.5, 0, 0}});
    CHECK(list.terms_of(1).size() == 3);
    CHECK(list.find(terms.k) == 1u);
    CHECK(!list.find(shared_diagonal(terms.rows, 10))); // equal, but another one
    CHECK(list.coefficient(terms.k, 0) == 2.5);
    CHECK(list.coefficient(nullptr, 0) == 0);

    CHECK(list.has_matrices_of(TermList(terms(7, 8))));
    CHECK(!list.has_matrices_of(TermList(Damped()(0.3, 0))));

    const std::vector<Term> merged = list.terms();
    REQUIRE(merged.size() == 3); // the zero is left out
    CHECK(merged[2].coefficient == 2.5);
    CHECK(merged[2].origin == Origin::elasticity);

    const MultiVector product = list.multiply(0, ones(terms.rows));
    for (unsigned int i = 0; i < terms.rows.n_local(); ++i)
      CHECK(product.data()[i] == doctest::Approx(25. * (1 + terms.rows.begin + i)));
  }

  TEST_CASE("term list: several sums, which share matrices, are multiplied at once")
  {
    const Damped terms;
    const std::vector<Term> all      = terms(0.3, 0.1);
    const TermList sums              = TermList::of_sums({{all[0], all[1]}, {}, {all[3], all[3]}});
    const std::vector<MultiVector> x = sums.multiply_all(ones(terms.rows));
    REQUIRE(x.size() == 3);
    for (unsigned int i = 0; i < terms.rows.n_local(); ++i)
    {
      CHECK(x[0].data()[i] == doctest::Approx(21. * (1 + terms.rows.begin + i)));
      CHECK(x[1].data()[i] == 0);
      CHECK(x[2].data()[i] == doctest::Approx(2. * (1 + terms.rows.begin + i)));
    }
  }

  TEST_CASE("term list: values are carried over with their matrices, which they do not keep alive")
  {
    Damped terms;
    PerMatrix<double> norms;
    unsigned int n_made = 0;
    const auto take     = [&](const std::vector<Term> &some)
    {
      const TermList list(some);
      norms.carry_over(list,
                       [&](const unsigned int k)
                       {
                         ++n_made;
                         return list.matrix(k)->infinity_norm();
                       });
    };
    take(terms(1, 1));
    CHECK(n_made == 2);
    CHECK(norms.at(terms.k) == doctest::Approx(60));
    take(terms(2, 3));
    CHECK(n_made == 2);
    take({{Origin::elasticity, 0, 1., terms.k}});
    CHECK(norms.size() == 1);
    CHECK(!norms.find(terms.m));
    CHECK_THROWS_AS(norms.at(terms.m), std::logic_error);

    const std::weak_ptr<const Matrix> before = terms.k;
    terms.k                                  = shared_diagonal(terms.rows, 20);
    CHECK(before.expired());
    take(terms(1, 1));
    CHECK(n_made == 4);
    CHECK(norms[1] == doctest::Approx(120));
  }

  TEST_CASE("term list: known terms are the same with the same matrices and coefficients only")
  {
    Damped terms;
    const KnownTerms known(terms(1, 2));
    CHECK(known.are(terms(1, 2)));
    CHECK(!known.are(terms(1, 2.5)));
    CHECK(!known.are({{Origin::inertia, 2, 1., terms.m}}));
    CHECK(KnownTerms().are({}));
    terms.k = shared_diagonal(terms.rows, 10);
    CHECK(!known.are(terms(1, 2)));
  }
} // namespace squeal::tests::term_list_tests
