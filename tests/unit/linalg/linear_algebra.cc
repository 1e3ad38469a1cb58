#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/base/errors.h>
#include <squeal/linalg/compressed_rows.h>
#include <squeal/linalg/factorization.h>

#include <algorithm>
#include <random>
namespace squeal::tests::linear_algebra_tests
{
  namespace
  {
    /// A(i, i) = 2 + i, A(i, i+1) = -1: not symmetric.
    std::vector<Entry> bidiagonal(const unsigned int n)
    {
      std::vector<Entry> entries;
      for (unsigned int i = 0; i < n; ++i)
      {
        entries.push_back({i, i, 2. + i});
        if (i + 1 < n)
          entries.push_back({i, i + 1, -1.});
      }
      return entries;
    }

    /// B(i, n-1-i) = 1 + 0.5 i in every second row: nothing in common with the above but chance.
    std::vector<Entry> antidiagonal(const unsigned int n)
    {
      std::vector<Entry> entries;
      for (unsigned int i = 0; i < n; i += 2)
        entries.push_back({i, n - 1 - i, 1 + 0.5 * i});
      return entries;
    }

    /// What sum_of should give, entry by entry.
    DenseMatrix
    expected_sum(const unsigned int n,
                 const std::vector<std::tuple<double, std::vector<Entry>, bool>> &summands)
    {
      DenseMatrix sum(n, n);
      for (const auto &[c, entries, transposed_too] : summands)
        for (const Entry &entry : entries)
        {
          sum(entry.row, entry.column) += c * entry.value;
          if (transposed_too)
            sum(entry.column, entry.row) += c * entry.value;
        }
      return sum;
    }

    MultiVector first_columns(const MultiVector &block, const unsigned int n)
    {
      MultiVector result(block.row_range(), n);
      std::copy(block.data(), block.data() + std::size_t(n) * block.n_local(), result.data());
      return result;
    }

    double largest_difference(const DenseMatrix &a, const DenseMatrix &b)
    {
      double largest = 0;
      for (std::size_t k = 0; k < a.values.size(); ++k)
        largest = std::max(largest, std::abs(a.values[k] - b.values[k]));
      return a.values.size() == b.values.size() ? largest : 1e300;
    }

    /// |Q^T Q - I|
    double defect_of_orthonormality(const MultiVector &q)
    {
      const std::vector<double> gram = inner_products(q, q).values;
      double largest                 = 0;
      for (unsigned int i = 0; i < q.n_columns(); ++i)
        for (unsigned int j = 0; j < q.n_columns(); ++j)
          largest = std::max(largest, std::abs(gram[i + j * q.n_columns()] - (i == j)));
      return largest;
    }

    /// The largest |a - Q Q^T a| / |a| of the columns.
    double distance_to_span(const MultiVector &q, const MultiVector &a)
    {
      const MultiVector projected = combine(q, inner_products(q, a));
      MultiVector rest            = a;
      for (std::size_t i = 0; i < std::size_t(a.n_local()) * a.n_columns(); ++i)
        rest.data()[i] -= projected.data()[i];
      const std::vector<double> rests = inner_products(rest, rest).values,
                                sizes = inner_products(a, a).values;
      double largest                  = 0;
      for (unsigned int j = 0; j < a.n_columns(); ++j)
        largest = std::max(
            largest, std::sqrt(rests[j * (a.n_columns() + 1)] / sizes[j * (a.n_columns() + 1)]));
      return largest;
    }
  } // namespace

  TEST_CASE("linear_algebra: sum_of adds on the union of the patterns")
  {
    // Values are small multiples of 1/2, so that the sums are exact whatever their order.
    const unsigned int n = 11;
    const RowRange rows  = even_rows(n);
    const auto a = bidiagonal(n), b = antidiagonal(n);
    const Matrix A = matrix_of(rows, a), B = matrix_of(rows, b);

    const Matrix sum = sum_of(rows, {{2., A}, {-0.5, B}});
    CHECK(largest_difference(replicated(rows, sum),
                             expected_sum(n, {{2., a, false}, {-0.5, b, false}})) == 0);
    const Matrix reversed = sum_of(rows, {{-0.5, B}, {2., A}});
    CHECK(largest_difference(replicated(rows, reversed), replicated(rows, sum)) == 0);

    const Matrix symmetrised = sum_of(rows, {{0.5, A, true}, {3., B, true}, {1., A}});
    CHECK(largest_difference(replicated(rows, symmetrised),
                             expected_sum(n, {{0.5, a, true}, {3., b, true}, {1., a, false}})) ==
          0);

    // The pattern is the union: 11 + 10 entries of A, 6 of B (rows 0, 2 ... 10), of which one falls
    // on A: i = n-1-i at i = 5 is odd; n-1-i = i+1 has no solution for odd n.
    CHECK(A.n_nonzeros() == 21);
    CHECK(B.n_nonzeros() == 6);
    CHECK(sum.n_nonzeros() == 27);
  }

  TEST_CASE("linear_algebra: a matrix is added in the places that another one has")
  {
    // Numbers are small multiples of 1/2: exact. On several ranks the antidiagonal is others'
    // columns.
    const unsigned int n = 11;
    const RowRange rows  = even_rows(n);
    const auto a = bidiagonal(n), b = antidiagonal(n);
    const Matrix A = matrix_of(rows, a), B = matrix_of(rows, b),
                 sum = sum_of(rows, {{1., A}, {1., B}});
    CHECK(add_in_place(rows, -3, B, sum));
    CHECK(add_in_place(rows, 0.5, A, sum));
    CHECK(largest_difference(replicated(rows, sum),
                             expected_sum(n, {{1.5, a, false}, {-2., b, false}})) == 0);
    CHECK(sum.n_nonzeros() == 27);
    // What becomes zero stays a place.
    CHECK(add_in_place(rows, 2, B, sum));
    CHECK(largest_difference(replicated(rows, sum), expected_sum(n, {{1.5, a, false}})) == 0);
    CHECK(sum.n_nonzeros() == 27);
    // A sum leaves its summands as they are, whether the places of one hold the other or not.
    const DenseMatrix before = replicated(rows, sum);
    CHECK(largest_difference(replicated(rows, sum_in_places(rows, sum, -3, A)),
                             expected_sum(n, {{-1.5, a, false}})) == 0);
    CHECK(largest_difference(replicated(rows, sum), before) == 0);
    CHECK(largest_difference(replicated(rows, sum_in_places(rows, A, 2, B)),
                             expected_sum(n, {{1., a, false}, {2., b, false}})) == 0);
    CHECK(largest_difference(replicated(rows, A), expected_sum(n, {{1., a, false}})) == 0);
    // Some ranks may have no row of B that A has no place for: none says that it fits.
    CHECK_FALSE(add_in_place(rows, 1, B, A));
  }

  TEST_CASE("linear_algebra: products with rows, of vectors that small matrices hold as rows")
  {
    // Small integers: exact. 7 rows, 5 columns, an empty row; 1, 8 and 19 vectors: less than a
    // block of columns, one, and some more.
    constexpr unsigned int n_rows = 7, n_columns = 5;
    CompressedRows a;
    DenseMatrix dense(n_rows, n_columns);
    for (unsigned int i = 0; i < n_rows; ++i)
    {
      for (unsigned int k = 0; k < n_columns; ++k)
        if (i != 3 && (i + 2 * k) % 3 != 0)
        {
          dense(i, k) = 1. + i - 2. * k;
          a.add(k, dense(i, k));
        }
      a.end_row();
    }
    for (const unsigned int m : {1u, 8u, 19u})
    {
      DenseMatrix x(m, n_columns), y(m, n_rows), of_x(m, n_rows), of_y(m, n_columns);
      for (unsigned int j = 0; j < m; ++j)
      {
        for (unsigned int k = 0; k < n_columns; ++k)
          x(j, k) = of_y(j, k) = 3. * j - k;
        for (unsigned int i = 0; i < n_rows; ++i)
          y(j, i) = of_x(j, i) = 2. * i - j;
      }
      add_product(-2, a, x, of_x);
      add_transposed_product(0.5, a, y, of_y);
      for (unsigned int j = 0; j < m; ++j)
      {
        for (unsigned int i = 0; i < n_rows; ++i)
        {
          double expected = y(j, i);
          for (unsigned int k = 0; k < n_columns; ++k)
            expected -= 2 * dense(i, k) * x(j, k);
          CHECK(of_x(j, i) == expected);
        }
        for (unsigned int k = 0; k < n_columns; ++k)
        {
          double expected = x(j, k);
          for (unsigned int i = 0; i < n_rows; ++i)
            expected += 0.5 * dense(i, k) * y(j, i);
          CHECK(of_y(j, k) == expected);
        }
      }
    }
  }

  TEST_CASE("linear_algebra: empty summands and empty sums")
  {
    const RowRange rows = even_rows(5);
    const Matrix empty, A = matrix_of(rows, bidiagonal(5));
    CHECK_FALSE(bool(sum_of(rows, std::vector<Summand>{})));
    CHECK_FALSE(bool(sum_of(rows, {{1., empty}, {0., A}})));
    const Matrix copy = sum_of(rows, {{1., empty, true}, {1., A}});
    CHECK(largest_difference(replicated(rows, copy), replicated(rows, A)) == 0);
    CHECK(empty.infinity_norm() == 0);
    CHECK(empty.n_nonzeros() == 0);
    CHECK(largest_entry(multiply(empty, block_of(rows, 2, scattered))) == 0);
  }

  TEST_CASE("linear_algebra: symmetric_part")
  {
    // (A + A^T)/2 of the bidiagonal matrix: diagonal 2 + i, both neighbours -1/2.
    const unsigned int n = 7;
    const RowRange rows  = even_rows(n);
    const Matrix part    = symmetric_part(rows, matrix_of(rows, bidiagonal(n)));
    const DenseMatrix p  = replicated(rows, part);
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int j = 0; j < n; ++j)
        CHECK(p(i, j) == (i == j ? 2. + i : (i + 1 == j || j + 1 == i) ? -0.5 : 0.));
  }

  TEST_CASE("linear_algebra: infinity norm")
  {
    // The largest row sum of moduli. Bidiagonal: row i has 2 + i + 1, the last one 2 + n - 1 only:
    // n
    // + 1 both in row n-2 and n-1; with -20 in the first row it is 2 + 1 + 20.
    const unsigned int n = 9;
    const RowRange rows  = even_rows(n);
    auto entries         = bidiagonal(n);
    CHECK(matrix_of(rows, entries).infinity_norm() == n + 1);
    entries.push_back({0, n - 1, -20.});
    CHECK(matrix_of(rows, entries).infinity_norm() == 23);
  }

  TEST_CASE("linear_algebra: blocks")
  {
    // A with A(i, i) = 2 + i and A(i, i+1) = -1 maps x = (1, 2, 3 ...) to (2 + i)(i + 1) - (i + 2)
    // = (i + 2) i, and in the last row n (n + 1).
    const unsigned int n = 8;
    const RowRange rows  = even_rows(n);
    const MultiVector x  = block_of(rows, 2,
                                    [](const unsigned int i, const unsigned int j) {
                                     return j == 0 ? i + 1. : i == 3 ? 1. : 0.;
                                   });
    const Matrix A       = matrix_of(rows, bidiagonal(n));
    const DenseMatrix y  = replicated(multiply(A, x));
    for (unsigned int i = 0; i < n; ++i)
      CHECK(y(i, 0) == (i + 1 < n ? (i + 2.) * i : n * (n + 1.)));

    // inner_products and combine: x^T x = [sum i^2, 4; 4, 1]; columns (x_0 - 4 x_1) and x_1 are
    // orthogonal to e_3 and equal e_3.
    const std::vector<double> gram = inner_products(x, x).values;
    CHECK(gram == std::vector<double>({n * (n + 1.) * (2 * n + 1.) / 6, 4, 4, 1}));
    const MultiVector c = combine(x, {1, -4, 0, 1}, 2);
    const DenseMatrix d = replicated(c);
    for (unsigned int i = 0; i < n; ++i)
    {
      CHECK(d(i, 0) == (i == 3 ? 0. : i + 1.));
      CHECK(d(i, 1) == (i == 3 ? 1. : 0.));
    }

    MultiVector joined = first_columns(x, 1);
    joined.append(c);
    CHECK(joined.n_columns() == 3);
    CHECK(inner_products(joined, joined)(2, 2) == 1);
  }

  TEST_CASE("linear_algebra: orthonormalize keeps nearly dependent directions and drops duplicates")
  {
    // Columns a, b, a + 1e-6 c, b + 1e-11 d, then a again, 3 b, and zero: the span is that of a, b,
    // c, d. The direction of d is known to 1e-16/1e-11 = 1e-5 only, but it must be there.
    const unsigned int n = 40;
    const RowRange rows  = even_rows(n);
    const auto direction = [](const unsigned int k)
    {
      return [k](const unsigned int i)
      { return std::sin((i + 1) * (k + 1) * M_PI / (40 + 1)) * std::sqrt(2. / 41); };
    };
    const auto a = direction(0), b = direction(1), c = direction(2), d = direction(3);
    const MultiVector block = block_of(rows, 7,
                                       [&](const unsigned int i, const unsigned int j)
                                       {
                                         switch (j)
                                         {
                                         case 0:
                                         case 4:
                                           return a(i);
                                         case 1:
                                           return b(i);
                                         case 2:
                                           return a(i) + 1e-6 * c(i);
                                         case 3:
                                           return b(i) + 1e-11 * d(i);
                                         case 5:
                                           return 3 * b(i);
                                         default:
                                           return 0.;
                                         }
                                       });
    const MultiVector q     = orthonormalize(block);
    CHECK(q.n_columns() == 4);
    CHECK(defect_of_orthonormality(q) <= 1e-13);
    CHECK(distance_to_span(q, first_columns(block, 6)) <= 1e-15);
    // a, b, c, d are orthonormal (discrete sines).
    const MultiVector exact =
        block_of(rows, 4,
                 [&](const unsigned int i, const unsigned int j) {
                   return j == 0 ? a(i) : j == 1 ? b(i) : j == 2 ? c(i) : d(i);
                 });
    CHECK(distance_to_span(q, first_columns(exact, 2)) <= 1e-14);
    CHECK(distance_to_span(q, first_columns(exact, 3)) <= 1e-9);
    CHECK(distance_to_span(q, exact) <= 1e-4);
  }

  TEST_CASE("linear_algebra: orthonormalize does not depend on the lengths of the columns")
  {
    // A well-conditioned set of 12 columns whose lengths range over 40 decades: all are kept.
    const RowRange rows     = even_rows(50);
    const MultiVector block = block_of(rows, 12,
                                       [](const unsigned int i, const unsigned int j) {
                                         return scattered(i, j) * std::pow(10., 20. - 40. * j / 11);
                                       });
    const MultiVector q     = orthonormalize(block);
    CHECK(q.n_columns() == 12);
    CHECK(defect_of_orthonormality(q) <= 1e-13);
    CHECK(distance_to_span(q, block) <= 1e-14);
  }

  TEST_CASE("linear_algebra: orthonormalize of a graded set")
  {
    // Krylov-like columns A^j x of a diagonal matrix, the hardest thing it gets: neighbouring
    // columns turn parallel. Whatever is dropped must lie in the span up to rounding.
    const unsigned int n    = 60;
    const RowRange rows     = even_rows(n);
    const MultiVector block = block_of(rows, 30,
                                       [](const unsigned int i, const unsigned int j)
                                       { return std::pow(1 + 3. * i / 60, j); });
    const MultiVector q     = orthonormalize(block);
    CHECK(q.n_columns() <= 30);
    CHECK(q.n_columns() >= 8);
    CHECK(defect_of_orthonormality(q) <= 1e-13);
    CHECK(distance_to_span(q, block) <= 1e-13);
  }

  TEST_CASE("linear_algebra: orthonormalize of more columns than rows")
  {
    // 5 rows, 9 columns: a basis of R^5.
    const RowRange rows = even_rows(5);
    const MultiVector q = orthonormalize(block_of(rows, 9, scattered));
    CHECK(q.n_columns() == 5);
    CHECK(defect_of_orthonormality(q) <= 1e-13);
  }

  TEST_CASE("linear_algebra: orthonormalize of nothing")
  {
    // The span of no columns, and of zero columns, is {0}: an empty basis.
    const RowRange rows = even_rows(6);
    CHECK(orthonormalize(MultiVector(rows, 0)).n_columns() == 0);
    CHECK(orthonormalize(MultiVector(rows, 3)).n_columns() == 0);
  }

  namespace
  {
    /// Upwind convection-diffusion with an entry far from the diagonal: not symmetric, diagonally
    /// dominant.
    std::vector<Entry> convection(const unsigned int n)
    {
      std::vector<Entry> entries;
      for (unsigned int i = 0; i < n; ++i)
      {
        entries.push_back({i, i, 4. + 0.1 * i});
        if (i > 0)
          entries.push_back({i, i - 1, -2.5});
        if (i + 1 < n)
          entries.push_back({i, i + 1, -0.5});
        if (i % 7 == 0)
          entries.push_back({i, (3 * i + 5) % n, 0.75});
      }
      return entries;
    }
  } // namespace

  TEST_CASE("linear_algebra: solve and solve_transposed of a matrix that is not symmetric")
  {
    // A x = b with b := A x is solved for the known x, and A^T y = c with c := A^T y likewise. On
    // three ranks the smallest size leaves ranks without rows.
    for (const unsigned int n : {50u, 2u})
    {
      CAPTURE(n);
      const RowRange rows = even_rows(n);
      const auto entries  = convection(n);
      std::vector<Entry> transposed_entries;
      for (const Entry &entry : entries)
        transposed_entries.push_back({entry.column, entry.row, entry.value});
      const Matrix A = matrix_of(rows, entries), A_transposed = matrix_of(rows, transposed_entries);
      const Factorization factorization(A, Factorization::Kind::lu, "a test matrix");
      const MultiVector x = block_of(rows, 4, scattered);

      const DenseMatrix exact  = replicated(x);
      const DenseMatrix solved = replicated(factorization.solve(multiply(A, x)));
      CHECK(largest_difference(solved, exact) <= 1e-14);
      const DenseMatrix of_transposed =
          replicated(factorization.solve_transposed(multiply(A_transposed, x)));
      CHECK(largest_difference(of_transposed, exact) <= 1e-14);
      // A transposed solve leaves no trace in the next plain one.
      CHECK(largest_difference(replicated(factorization.solve(multiply(A, x))), exact) <= 1e-14);

      CHECK(factorization.solve(MultiVector(rows, 0)).n_columns() == 0);
      CHECK(factorization.memory_mib() >= 0);
    }
  }

  TEST_CASE("linear_algebra: inertia of a diagonal matrix")
  {
    // The signs of the diagonal: 7 negative ones in 30, none zero.
    const unsigned int n = 30;
    const RowRange rows  = even_rows(n);
    std::vector<Entry> entries;
    for (unsigned int i = 0; i < n; ++i)
      entries.push_back({i, i, (i % 4 == 3 ? -1 : 1) * (1. + i)});
    const Factorization factorization(matrix_of(rows, entries), Factorization::Kind::ldlt,
                                      "a diagonal matrix");
    CHECK(factorization.inertia().negative == 7);
    CHECK(factorization.inertia().zero == 0);
    CHECK(factorization.inertia().positive == 23);
  }

  TEST_CASE("linear_algebra: inertia of a tridiagonal and of a saddle-point matrix")
  {
    // Second differences minus s: eigenvalues 2 - 2 cos(j pi/(n+1)) - s; for s = 1 those with
    // j < (n + 1)/3 are negative: 6 of n = 19.
    const unsigned int n = 19;
    std::vector<Entry> chain;
    for (unsigned int i = 0; i < n; ++i)
    {
      chain.push_back({i, i, 2. - 1.});
      if (i > 0)
        chain.push_back({i, i - 1, -1.});
      if (i + 1 < n)
        chain.push_back({i, i + 1, -1.});
    }
    {
      const RowRange rows = even_rows(n);
      const Factorization factorization(matrix_of(rows, chain), Factorization::Kind::ldlt,
                                        "a chain");
      CHECK(factorization.inertia().negative == 6);
      CHECK(factorization.inertia().positive == 13);
    }

    // With a constraint x_9 = 0 (multiplier in row 19, a zero on the diagonal) two chains of 9 are
    // left: eigenvalues below 1 for j < 10/3, 3 + 3, and each constraint adds one negative and one
    // positive sign: 7 and 13.
    chain.push_back({n, 9, 1.});
    chain.push_back({9, n, 1.});
    const RowRange rows = even_rows(n + 1);
    const Factorization factorization(matrix_of(rows, chain), Factorization::Kind::ldlt,
                                      "a saddle point");
    CHECK(factorization.inertia().negative == 7);
    CHECK(factorization.inertia().positive == 13);
  }

  TEST_CASE("linear_algebra: factors are renewed for other numbers in the same places")
  {
    const unsigned int n = 50;
    const RowRange rows  = even_rows(n);
    const Matrix A       = matrix_of(rows, convection(n));
    Factorization factorization(A, Factorization::Kind::lu, "a test matrix");
    const MultiVector x = block_of(rows, 4, scattered);
    SQUEAL_PETSC(MatScale(A, -0.25));
    std::vector<Entry> diagonal;
    for (unsigned int i = 0; i < n; ++i)
      diagonal.push_back({i, i, -3.});
    REQUIRE(add_in_place(rows, 1, matrix_of(rows, diagonal), A));
    factorization.renew(A);
    CHECK(largest_difference(replicated(factorization.solve(multiply(A, x))), replicated(x)) <=
          1e-14);

    // Second differences minus s, eigenvalues 2 - 2 cos(j pi/20) - s: those with j < 20/3 are below
    // s = 1, those with j < 10 below s = 2.
    const RowRange few = even_rows(19);
    std::vector<Entry> chain, ones;
    for (unsigned int i = 0; i < 19; ++i)
    {
      chain.push_back({i, i, 2. - 1.});
      ones.push_back({i, i, 1.});
      if (i > 0)
        chain.push_back({i, i - 1, -1.});
      if (i < 18)
        chain.push_back({i, i + 1, -1.});
    }
    const Matrix shifted = matrix_of(few, chain);
    Factorization symmetric(shifted, Factorization::Kind::ldlt, "a chain");
    CHECK(symmetric.inertia().negative == 6);
    REQUIRE(add_in_place(few, -0.99, matrix_of(few, ones), shifted));
    symmetric.renew(shifted);
    CHECK(symmetric.inertia().negative == 9);
    CHECK(symmetric.inertia().positive == 10);
  }

  TEST_CASE("linear_algebra: inertia counts zeros of a singular matrix")
  {
    // Diagonal with two zeros.
    const unsigned int n = 12;
    const RowRange rows  = even_rows(n);
    std::vector<Entry> entries;
    for (unsigned int i = 0; i < n; ++i)
      entries.push_back({i, i, i == 2 || i == 7 ? 0. : i % 3 == 0 ? -1. : 1.});
    const Factorization factorization(matrix_of(rows, entries), Factorization::Kind::ldlt,
                                      "a diagonal matrix");
    CHECK(factorization.inertia().negative == 4); // 0, 3, 6, 9
    CHECK(factorization.inertia().zero == 2);
    CHECK(factorization.inertia().positive == 6);
  }

  TEST_CASE("linear_algebra: a singular matrix is a solver error that says which matrix")
  {
    const unsigned int n = 6;
    const RowRange rows  = even_rows(n);
    const auto message   = [&](const std::vector<Entry> &entries)
    {
      return message_of<SolverError>(
          [&]()
          {
            const Factorization factorization(matrix_of(rows, entries), Factorization::Kind::lu,
                                              "the test matrix");
          });
    };
    // Numerically: the last two rows are equal, and elimination without rounding finds 1 - 1 = 0.
    std::vector<Entry> entries;
    for (unsigned int i = 0; i + 2 < n; ++i)
      entries.push_back({i, i, 1.});
    for (const unsigned int i : {n - 2, n - 1})
      for (const unsigned int j : {n - 2, n - 1})
        entries.push_back({i, j, 1.});
    CHECK(contains(message(entries), "the test matrix"));
    CHECK(contains(message(entries), "singular"));
    // Structurally: an empty row and column.
    entries.clear();
    for (unsigned int i = 1; i < n; ++i)
      entries.push_back({i, i, 1.});
    CHECK(contains(message(entries), "the test matrix"));
    CHECK(contains(message(entries), "singular"));
  }

  TEST_CASE("linear_algebra: make_matrix stores the announced entries and no more")
  {
    // Room for the diagonal only: a second entry in a row is an error, not a silent reallocation.
    const RowRange rows = even_rows(6);
    const std::vector<PetscInt> one(rows.n_local(), 1), none(rows.n_local(), 0);
    const Matrix diagonal = make_matrix(rows, one, none);
    for (PetscInt row = rows.begin; row < PetscInt(rows.end); ++row)
    {
      const PetscScalar value = 1. + row;
      SQUEAL_PETSC(MatSetValues(diagonal, 1, &row, 1, &row, &value, ADD_VALUES));
    }
    compress(diagonal);
    CHECK(diagonal.n_nonzeros() == 6);
    CHECK(diagonal.infinity_norm() == 6);

    const Matrix full = make_matrix(rows, one, none);
    if (rows.n_local() >= 2)
    {
      const PetscInt row = rows.begin, columns[] = {row, row + 1};
      const PetscScalar values[] = {1, 1};
      CHECK_THROWS_AS(SQUEAL_PETSC(MatSetValues(full, 1, &row, 2, columns, values, ADD_VALUES)),
                      SolverError);
    }
  }

  TEST_CASE("linear_algebra: a list of entries adds what several ranks have in one place")
  {
    // Each rank has some entries of all rows. Multiples of 1/2: sums are exact.
    const unsigned int n = 13;
    const RowRange rows  = even_rows(n);
    int rank = 0, n_ranks = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
    EntryList entries;
    DenseMatrix expected(n, n);
    for (int k = 0; k < 150; ++k)
    {
      const int row = k * 7 % n, column = k * k % 5 + k % 3;
      const double value = row == 4 ? 0. : 0.5 * (k % 9 - 4); // nothing in one row
      expected(row, column) += value;
      if (k % n_ranks == rank)
        entries.add(row, column, value);
    }
    entries.add(-1, 2, 1.);
    entries.add(2, -1, 1.);
    const Matrix matrix = entries.make_matrix(rows);
    CHECK(largest_difference(replicated(rows, matrix), expected) == 0);
    const unsigned int n_stored = std::count_if(expected.values.begin(), expected.values.end(),
                                                [](const double x) { return x != 0; });
    CHECK(n_stored > 20);
    CHECK(n_stored < expected.values.size());
    CHECK(matrix.n_nonzeros() == n_stored);
    // The list is still there.
    CHECK(largest_difference(replicated(rows, entries.make_matrix(rows)), expected) == 0);
    CHECK(EntryList().make_matrix(rows).n_nonzeros() == 0);
  }

  TEST_CASE("linear_algebra: blocks are added where the matrix has places, on any rank")
  {
    // Blocks of a chain of elements between unknowns k, k + 3 and k + 6, in any order, shared out
    // among the ranks. Multiples of 1/2: sums are exact.
    const unsigned int n = 14;
    const RowRange rows  = even_rows(n);
    int rank = 0, n_ranks = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
    CompressedRows pattern;
    for (unsigned int row = rows.begin; row < rows.end; ++row)
    {
      for (int column = row - 6; column <= int(row) + 6; column += 3)
        if (column >= 0 && column < int(n))
        {
          pattern.columns.push_back(column);
          pattern.values.push_back(0.);
        }
      pattern.end_row();
    }
    const Matrix matrix = make_matrix(rows, std::move(pattern));
    DenseMatrix expected(n, n);
    {
      BlockAdder blocks(matrix, rows);
      for (int k = 0; k + 6 < int(n); ++k)
      {
        const std::vector<PetscInt> unknowns = {k + 6, k, k % 4 == 1 ? -1 : k + 3};
        std::vector<double> block(9);
        for (int i = 0; i < 9; ++i)
          block[i] = 0.5 * (i + 1) + k;
        for (unsigned int i = 0; i < 3; ++i)
          for (unsigned int j = 0; j < 3; ++j)
            if (unknowns[i] >= 0 && unknowns[j] >= 0)
              expected(unknowns[i], unknowns[j]) += block[3 * i + j];
        if (k % n_ranks == rank)
          blocks.add(unknowns, blocks.places(unknowns), 0, 0, 3, block.data());
      }
      if (rows.n_local() >= 2)
        CHECK_THROWS_AS(blocks.places({PetscInt(rows.begin), PetscInt(rows.begin) + 1}),
                        std::logic_error);
    }
    compress(matrix);
    CHECK(largest_difference(replicated(rows, matrix), expected) == 0);
  }

  TEST_CASE("linear_algebra: repeated entries are those of a list, each time anew")
  {
    const unsigned int n = 11;
    const RowRange rows  = even_rows(n);
    int rank = 0, n_ranks = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
    RepeatedEntries repeated;
    for (unsigned int time = 0; time < 5; ++time)
    {
      CAPTURE(time);
      EntryList list;
      const auto add = [&](const int row, const int column, const double value)
      {
        repeated.add(row, column, value);
        list.add(row, column, value);
      };
      for (int k = rank; k < 90; k += n_ranks)
        add(k * 5 % n, k * k % 7, time == 3 && k % 2 == 0 ? 0. : 0.5 * ((k + time) % 9 - 4));
      add(-1, 2, 1.);
      add(2, -1, 1.);
      const Matrix matrix = repeated.make_matrix(rows), expected = list.make_matrix(rows);
      CHECK(largest_difference(replicated(rows, matrix), replicated(rows, expected)) == 0);
      CHECK(matrix.n_nonzeros() == expected.n_nonzeros());
    }
    // Fewer entries than before, or more
    CHECK_THROWS_AS(repeated.make_matrix(rows), std::logic_error);
  }
} // namespace squeal::tests::linear_algebra_tests
