#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/base/errors.h>
#include <squeal/linalg/dense.h>
#include <squeal/linalg/inverse_diagonal.h>

namespace squeal::tests::dense_tests
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Row by row, as one writes a matrix.
    DenseMatrix matrix(const unsigned int n, const std::vector<double> &rows)
    {
      DenseMatrix result(n, rows.size() / n);
      for (unsigned int i = 0; i < n; ++i)
        for (unsigned int j = 0; j < result.n_columns; ++j)
          result(i, j) = rows[i * result.n_columns + j];
      return result;
    }
  } // namespace

  TEST_CASE("dense: symmetric_eigen")
  {
    // The second difference matrix of order n has the eigenvalues 2 - 2 cos(j pi / (n + 1)),
    // ascending in j, and the orthonormal vectors sqrt(2 / (n + 1)) sin(i j pi / (n + 1)).
    const unsigned int n = 12;
    DenseMatrix a(n, n);
    for (unsigned int i = 0; i < n; ++i)
    {
      a(i, i) = 2;
      if (i > 0)
        a(i, i - 1) = a(i - 1, i) = -1;
    }
    const std::vector<double> eigenvalues = symmetric_eigen(a);
    CHECK(eigenvalues.size() == n);
    const double angle = M_PI / (n + 1);
    for (unsigned int j = 0; j < n; ++j)
    {
      CHECK(std::abs(eigenvalues[j] - (2 - 2 * std::cos((j + 1) * angle))) <= 4e-15);
      double product = 0;
      for (unsigned int i = 0; i < n; ++i)
        product += a(i, j) * std::sqrt(2. / (n + 1)) * std::sin((i + 1) * (j + 1) * angle);
      CHECK(std::abs(std::abs(product) - 1) <= 1e-13);
    }
  }

  TEST_CASE("dense: solve and gemm")
  {
    // A needs pivoting (its first pivot is zero) and is not symmetric: [0 2; 1 3] x = (4, 5) gives
    // x = (-1, 2).
    const DenseMatrix x = solve(matrix(2, {0, 2, 1, 3}), matrix(2, {4, 2, 5, 1}));
    CHECK(x(0, 0) == -1);
    CHECK(x(1, 0) == 2);
    CHECK(x(0, 1) == -2); // the second column (2, 1)
    CHECK(x(1, 1) == 1);
    CHECK_THROWS_AS(solve(matrix(2, {1, 2, 2, 4}), matrix(2, {1, 1})), SolverError);

    // C := 2 A^T B - C with A = [1 2; 3 4; 5 6], B = (1, 0, -1), C = (1, 1): A^T B = (-4, -4).
    const DenseMatrix a = matrix(3, {1, 2, 3, 4, 5, 6});
    DenseMatrix c       = matrix(2, {1, 1});
    gemm<double>(2, a.transpose(), matrix(3, {1, 0, -1}), -1, c.values.data());
    CHECK(c(0, 0) == -9);
    CHECK(c(1, 0) == -9);
    // C := A D with A as above and D = (1, -1): row differences -1.
    const DenseMatrix d = a * matrix(2, {1, -1});
    for (unsigned int i = 0; i < 3; ++i)
      CHECK(d(i, 0) == -1);
  }

  namespace
  {
    template <typename Number>
    Dense<Number> scattered_matrix(const unsigned int m, const unsigned int n,
                                   const unsigned int seed)
    {
      Dense<Number> a(m, n);
      for (unsigned int k = 0; k < m * n; ++k)
        a.values[k] = scattered(k, seed);
      if constexpr (!std::is_same_v<Number, double>)
        for (unsigned int k = 0; k < m * n; ++k)
          a.values[k] += Complex(0, scattered(k, seed + 1));
      return a;
    }

    /// The largest difference from sums over the views' entries.
    template <typename Number>
    double error_of_product(const DenseView<Number> &a, const DenseView<Number> &b)
    {
      const Dense<Number> c = a * b;
      REQUIRE(c.n_rows == a.n_rows());
      REQUIRE(c.n_columns == b.n_columns());
      double error = 0;
      for (unsigned int j = 0; j < c.n_columns; ++j)
        for (unsigned int i = 0; i < c.n_rows; ++i)
        {
          Number sum = 0;
          for (unsigned int k = 0; k < a.n_columns(); ++k)
            sum += a(i, k) * b(k, j);
          error = std::max(error, std::abs(c(i, j) - sum));
        }
      return error;
    }

    template <typename Number>
    void check_products()
    {
      const Dense<Number> a = scattered_matrix<Number>(6, 5, 1),
                          b = scattered_matrix<Number>(5, 7, 3);
      const auto part       = a.rows(1, 3).columns(2, 2);
      for (const unsigned int n : {0, 1, 4}) // a column alone by another function of BLAS
        for (const unsigned int m : {0, 1, 3})
        {
          CAPTURE(n);
          CAPTURE(m);
          CHECK(error_of_product<Number>(a.rows(2, m), b.columns(1, n)) <= 1e-15);
          CHECK(error_of_product<Number>(a.columns(1, m).transpose(), a.columns(0, n)) <= 1e-15);
          CHECK(error_of_product<Number>(a.columns(1, m).adjoint(), a.columns(0, n)) <= 1e-15);
          CHECK(error_of_product<Number>(b.rows(0, 5).columns(0, m).transpose(), b.columns(1, n)) <=
                1e-15);
          CHECK(error_of_product<Number>(a.rows(0, m), a.rows(1, n).transpose()) <= 1e-15);
          CHECK(error_of_product<Number>(a.rows(0, m), a.rows(1, n).adjoint()) <= 1e-15);
        }
      CHECK(error_of_product<Number>(part, part.transpose()) <= 1e-15);
      CHECK(error_of_product<Number>(part.adjoint(), part) <= 1e-15);
      CHECK(part.transpose().rows(1, 1)(0, 2) == a(3, 3));

      // Copies of views
      const Dense<Number> copy = part.transpose();
      CHECK(copy.n_rows == 2);
      CHECK(copy.n_columns == 3);
      CHECK(copy(1, 2) == a(3, 3));
      Dense<Number> all = a;
      all.append(a.columns(1, 2));
      CHECK(all.n_columns == 7);
      CHECK(all(4, 6) == a(4, 2));
      all.resize_rows(8);
      CHECK(all(4, 6) == a(4, 2));
      CHECK(all(7, 6) == Number(0));

      // Lengths
      Dense<Number> unit = a;
      unit.normalise();
      for (const double length : unit.column_norms())
        CHECK(std::abs(length - 1) <= 1e-15);

      // Factors, of the matrix and its transposes
      Dense<Number> square      = scattered_matrix<Number>(5, 5, 7);
      const Dense<Number> right = scattered_matrix<Number>(5, 2, 9);
      for (unsigned int i = 0; i < 5; ++i)
        square(i, i) += i % 2 == 0 ? 4. : -4.; // far from singular
      const LuFactors<Number> factors(square);
      using Form        = typename DenseView<Number>::Form;
      const auto defect = [&](const DenseView<Number> &of, const Form form)
      {
        Dense<Number> difference = of * factors.solve(right, form);
        difference -= right;
        return difference.largest_entry();
      };
      CHECK(defect(square, Form::plain) <= 1e-13);
      CHECK(defect(square.transpose(), Form::transposed) <= 1e-13);
      CHECK(defect(square.adjoint(), Form::adjoint) <= 1e-13);
    }
  } // namespace

  TEST_CASE("dense: products of views, real and complex")
  {
    check_products<double>();
    check_products<Complex>();

    // A real matrix times a complex one; Z^H X by products of real and imaginary parts
    const DenseMatrix a        = scattered_matrix<double>(4, 6, 11);
    const ComplexDenseMatrix x = scattered_matrix<Complex>(6, 3, 13),
                             z = scattered_matrix<Complex>(6, 2, 15);
    ComplexDenseMatrix of_a(4, 6);
    for (unsigned int k = 0; k < a.values.size(); ++k)
      of_a.values[k] = a.values[k];
    ComplexDenseMatrix difference = a * x;
    difference -= of_a * x;
    CHECK(difference.largest_entry() <= 1e-15);
    difference = adjoint_product(real_and_imaginary(z).transpose() * real_and_imaginary(x));
    difference -= z.adjoint() * x;
    CHECK(difference.largest_entry() <= 1e-15);
    CHECK(to_complex(real_and_imaginary(x)).values == x.values);
  }

  TEST_CASE("dense: eigenvalues of general matrices, right and left vectors")
  {
    const DenseMatrix a        = scattered_matrix<double>(9, 9, 21);
    const ComplexDenseMatrix c = scattered_matrix<Complex>(9, 9, 23);
    const auto check =
        [](const DenseEigenpairs &e, const ComplexDenseMatrix &of_right, ComplexDenseMatrix of_left)
    {
      // A X = X Theta, U^H A = Theta U^H
      ComplexDenseMatrix right = e.right;
      right.scale(e.values);
      right -= of_right;
      CHECK(right.largest_entry() <= 1e-14);
      for (unsigned int j = 0; j < e.values.size(); ++j)
        for (unsigned int i = 0; i < e.values.size(); ++i)
          of_left(i, j) -= e.values[i] * std::conj(e.left(j, i));
      CHECK(of_left.largest_entry() <= 1e-14);
    };
    const DenseEigenpairs of_a = general_eigen(a, true), of_c = general_eigen(c, true);
    ComplexDenseMatrix complex_a(9, 9);
    for (unsigned int k = 0; k < a.values.size(); ++k)
      complex_a.values[k] = a.values[k];
    check(of_a, a * of_a.right, of_a.left.adjoint() * complex_a);
    check(of_c, c * of_c.right, of_c.left.adjoint() * c);
    CHECK(of_a.rounding.size() == 9);
    unsigned int n_complex = 0;
    for (unsigned int j = 0; j < 9; ++j)
      if (of_a.values[j].imag() > 0)
      {
        CHECK(of_a.values[j + 1] == std::conj(of_a.values[j]));
        ++n_complex;
      }
    CHECK(n_complex > 0);
    CHECK(general_eigen(a).left.empty());
  }

  TEST_CASE("dense: pseudo-inverse")
  {
    const auto check_equal = [](const DenseMatrix &a, const DenseMatrix &b)
    {
      REQUIRE(a.values.size() == b.values.size());
      for (unsigned int k = 0; k < a.values.size(); ++k)
        CHECK(std::abs(a.values[k] - b.values[k]) < 1e-12);
    };
    // Of rank 3, of rank 2 but for rounding, and of rank 2 with fewer rows than columns: the four
    // conditions of Moore and Penrose
    for (const DenseMatrix &a :
         {matrix(3, {2, 1, 0, -1, 3, 1, 0, 0.5, 1}), matrix(3, {1, 2, 3, 4, 5, 6, 5, 7, 9 + 1e-14}),
          matrix(2, {1, 2, 3, -1, 0, 1})})
    {
      const DenseMatrix p = pseudo_inverse(a, 1e-8), ap = a * p, pa = p * a;
      check_equal(ap * a, a);
      check_equal(pa * p, p);
      check_equal(ap.transpose(), ap);
      check_equal(pa.transpose(), pa);
    }
    CHECK(pseudo_inverse(DenseMatrix(), 1e-8).values.empty());
  }

  TEST_CASE("dense: diagonal of an inverse")
  {
    // [4 2 0; 2 5 3; 0 3 6] has the determinant 4 (30 - 9) - 2 (12) = 60 and the cofactors 21, 24,
    // 16 on its diagonal. What is below the diagonal is not read.
    const std::vector<double> diagonal = inverse_diagonal(matrix(3, {4, 2, 0, 0, 5, 3, 0, 0, 6}));
    const std::vector<double> expected = {21. / 60, 24. / 60, 16. / 60};
    for (unsigned int i = 0; i < 3; ++i)
      CHECK(diagonal[i] == doctest::Approx(expected[i]).epsilon(1e-14));
    CHECK_THROWS_AS(inverse_diagonal(matrix(2, {1, 2, 2, 4})), SolverError);
  }

  TEST_CASE("dense: independent combinations of remainders")
  {
    // Remainders (1, 0), (1, 1e-3), (1e-9, 0) and (0, 1e-13) of columns of length 1: the third is a
    // short copy of the first, the last is rounding.
    const DenseMatrix remainders = matrix(2, {1, 1, 1e-9, 0, 0, 1e-3, 0, 1e-13}),
                      before     = matrix(4, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    const DenseMatrix products   = remainders.transpose() * remainders;
    const DenseMatrix clear      = independent_combinations(products, before, 1e-12, 1e-6);
    REQUIRE(clear.n_rows == 4);
    REQUIRE(clear.n_columns == 2);
    const DenseMatrix basis = remainders * clear, unit = basis.transpose() * basis;
    for (unsigned int j = 0; j < 2; ++j)
    {
      CHECK(clear(3, j) == 0);
      for (unsigned int i = 0; i < 2; ++i)
        CHECK(std::abs(unit(i, j) - (i == j ? 1 : 0)) <= 1e-9);
    }
    // Where (1, 1e-3) counts as the direction of the others, one is left.
    CHECK(independent_combinations(products, before, 1e-12, 1e-2).n_columns == 1);
    CHECK(independent_combinations(DenseMatrix(), DenseMatrix(), 1e-12, 1e-6).n_columns == 0);
  }
} // namespace squeal::tests::dense_tests
