#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/projection/davidson.h>

#include <cmath>
namespace squeal::tests::davidson_tests
{
  using Complex = std::complex<double>;

  namespace
  {
    constexpr unsigned int n = 40;

    /// A chain with unsymmetric P and Q and a mass that is not constant.
    QuadraticEigenproblem chain(const RowRange &rows)
    {
      std::vector<Entry> m, p, q;
      for (unsigned int i = 0; i < n; ++i)
      {
        m.push_back({i, i, 1 + 0.5 * i / n});
        q.push_back({i, i, 2. + i});
        if (i > 0)
        {
          q.push_back({i, i - 1, -1.2});
          q.push_back({i - 1, i, -0.8});
          p.push_back({i, i - 1, 0.1});
        }
      }
      QuadraticEigenproblem problem;
      problem.rows = rows;
      problem.M    = matrix_of(rows, m);
      problem.P    = matrix_of(rows, p);
      problem.Q    = matrix_of(rows, q);
      return problem;
    }

    MultiVector some_columns(const RowRange &rows, const unsigned int n_columns,
                             const unsigned int seed)
    {
      return block_of(rows, n_columns,
                      [seed](const unsigned int i, const unsigned int j)
                      { return scattered(i, j + 10 * seed); });
    }

    /// V or W.
    MultiVector basis_of(const Davidson &davidson, const Side side)
    {
      return davidson.vectors(ComplexDenseMatrix::identity(davidson.n_columns()), side).re;
    }

    /// How far the projected matrices are from W^T A V, and U^T M U from what it is.
    double defect(const Davidson &davidson, const QuadraticEigenproblem &problem)
    {
      const MultiVector v = basis_of(davidson, Side::right), w = basis_of(davidson, Side::left);
      const auto difference_to = [](DenseMatrix given, const DenseMatrix &expected)
      {
        REQUIRE(given.values.size() == expected.values.size());
        given -= expected;
        return given.largest_entry();
      };
      const auto &small = davidson.projected();
      double largest    = 0;
      for (const auto &[given, matrix] :
           {std::pair(&small.m, &problem.M), {&small.p, &problem.P}, {&small.q, &problem.Q}})
        largest = std::max(largest, difference_to(*given, inner_products(w, multiply(*matrix, v))));
      if (davidson.mass().n_rows > 0)
        largest = std::max(
            largest, difference_to(davidson.mass(), inner_products(v, multiply(problem.M, v))));
      return largest;
    }

    /// Leaves the first rows of columns out: a projection Pi that is its own transpose.
    void clear_first(MultiVector &x)
    {
      clear_rows(x, {0, 1, 2});
    }
  } // namespace

  TEST_CASE("davidson: the projected problem grows with the bases, whatever tests them")
  {
    const RowRange rows                 = even_rows(n);
    const QuadraticEigenproblem problem = chain(rows);
    DavidsonMethod galerkin, kept, made, two;
    galerkin.constrain = [](MultiVector &, Side) {};
    galerkin.measures  = true;
    kept               = galerkin;
    kept.partners      = [&](const MultiVector &x, Side) { return multiply(problem.Q, x); };
    made               = galerkin;
    made.relieve       = clear_first;
    made.partners      = [](MultiVector x, Side)
    {
      clear_first(x);
      return x;
    };
    two               = kept;
    two.has_two_bases = true;
    for (const DavidsonMethod &method : {galerkin, kept, made, two})
    {
      Davidson davidson(problem, method);
      for (unsigned int step = 0; step < 3; ++step)
        davidson.expand({some_columns(rows, 4, 2 * step),
                         some_columns(rows, method.has_two_bases ? 4 : 0, 2 * step + 1)});
      CHECK(davidson.n_columns() == 12);
      CHECK(defect(davidson, problem) < 1e-12 * n);
      if (!method.has_two_bases)
      {
        DenseMatrix turn(12, 2);
        turn(3, 0) = 0.6;
        turn(8, 0) = 0.8;
        turn(5, 1) = 1;
        davidson.turn(turn);
        CHECK(davidson.n_columns() == 2);
        CHECK(defect(davidson, problem) < 1e-12 * n);
      }
      davidson.restart({some_columns(rows, 3, 7), some_columns(rows, 3, 8)});
      CHECK(davidson.n_columns() == 3);
      CHECK(defect(davidson, problem) < 1e-12 * n);
    }
  }

  TEST_CASE("davidson: each side has its constraint, and both have as many columns")
  {
    const RowRange rows                 = even_rows(n);
    const QuadraticEigenproblem problem = chain(rows);
    for (const bool have_partners : {true, false}) // or what is not seen is dropped
    {
      unsigned int n_partners = 0;
      DavidsonMethod method;
      method.has_two_bases = true;
      method.constrain     = [](MultiVector &x, const Side side)
      { clear_rows(x, {side == Side::right ? 0u : 1u}); };
      method.partners = [&](const MultiVector &x, Side)
      {
        n_partners += x.n_columns();
        return have_partners ? multiply(problem.Q, x) : MultiVector(rows, 0);
      };
      Davidson davidson(problem, method);
      davidson.expand({some_columns(rows, 4, 0), some_columns(rows, 2, 1)});
      CHECK(davidson.n_columns() == (have_partners ? 4 : 2));
      CHECK(n_partners == (have_partners ? 2 : 6)); // it is tried three times
      const DenseMatrix v = replicated(basis_of(davidson, Side::right)),
                        w = replicated(basis_of(davidson, Side::left));
      CHECK(v.n_columns == w.n_columns);
      for (unsigned int j = 0; j < v.n_columns; ++j)
      {
        CHECK(std::abs(v(0, j)) < 1e-14);
        CHECK(std::abs(w(1, j)) < 1e-14);
      }
      CHECK(defect(davidson, problem) < 1e-12 * n);
    }
  }

  TEST_CASE("davidson: steps until nothing is left to correct, or give up")
  {
    const RowRange rows                 = even_rows(n);
    const QuadraticEigenproblem problem = chain(rows);
    DavidsonMethod method;
    method.most_steps = 3;
    method.constrain  = [](MultiVector &, Side) {};
    for (const unsigned int n_needed : {2, 3})
    {
      Davidson davidson(problem, method);
      const auto correct = [&](const unsigned int step) -> std::optional<BothSides>
      {
        CHECK(davidson.n_columns() == 2 * step);
        if (step == n_needed)
          return std::nullopt;
        return BothSides{some_columns(rows, 2, step), {}};
      };
      CHECK(davidson.run(correct) == (n_needed < method.most_steps));
    }
  }

  TEST_CASE("davidson: a diagonal preconditioner finds an eigenvalue")
  {
    const RowRange rows           = even_rows(n);
    QuadraticEigenproblem problem = chain(rows);
    problem.P                     = {};
    const DenseMatrix m = replicated(rows, problem.M), q = replicated(rows, problem.Q);
    const auto lowest = [](const SmallProblem &small)
    {
      const SmallPairs pairs = small.solve(0, 1);
      const auto at =
          std::min_element(pairs.lambda.begin(), pairs.lambda.end(),
                           [](const Complex &a, const Complex &b) { return a.imag() < b.imag(); });
      return pairs.select({static_cast<unsigned int>(at - pairs.lambda.begin())});
    };
    const Complex expected = lowest({m, {}, q, {}, nullptr}).lambda[0];
    DavidsonMethod method;
    method.most_steps = 30;
    method.constrain  = [](MultiVector &, Side) {};
    Davidson davidson(problem, method);
    davidson.expand({unit_columns(rows, {0}), {}});
    Complex found;
    const auto correct = [&](unsigned int) -> std::optional<BothSides>
    {
      const SmallPairs pair = lowest(davidson.projected());
      found                 = pair.lambda[0];
      const MultiVector x   = davidson.vectors(pair.right, Side::right).re;
      MultiVector r         = multiply(problem.Q, x);
      r.add((found * found).real(), multiply(problem.M, x));
      if (length_of(r) < 1e-9 * length_of(x))
        return std::nullopt;
      for (unsigned int row = rows.begin; row < rows.end; ++row)
        r.data()[row - rows.begin] /= 2. + row;
      return BothSides{std::move(r), {}};
    };
    CHECK(davidson.run(correct));
    CHECK(std::abs(found - expected) < 1e-12 * std::abs(expected));
  }
} // namespace squeal::tests::davidson_tests
