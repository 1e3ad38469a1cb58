#include <squeal/linalg/complex_dense.h>
#include <squeal/projection/reduced_eigenproblem.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  ReducedPairs ReducedPairs::select(const std::vector<unsigned int> &which) const
  {
    ReducedPairs result;
    result.re = result.im = DenseMatrix(re.n_rows, which.size());
    for (unsigned int k = 0; k < which.size(); ++k)
    {
      result.lambda.push_back(lambda[which[k]]);
      for (unsigned int i = 0; i < re.n_rows; ++i)
      {
        result.re(i, k) = re(i, which[k]);
        result.im(i, k) = im(i, which[k]);
      }
    }
    return result;
  }

  namespace
  {
    using Complex = std::complex<double>;

    std::vector<Complex> conjugate(std::vector<Complex> vector)
    {
      for (Complex &c : vector)
        c = std::conj(c);
      return vector;
    }

    /// Solves A x = b and A^T y = c in place.
    void solve_both(ComplexDense a, std::vector<Complex> &b, std::vector<Complex> &c)
    {
      ComplexDense right(a.n_rows, 1), left = right;
      right.values = std::move(b);
      left.values  = conjugate(std::move(c));
      const ComplexFactors factors(std::move(a));
      b = std::move(factors.solve(std::move(right)).values);
      c = conjugate(std::move(factors.solve(std::move(left), true).values));
    }

    /// A x, or A^T x, for real A; zero if A is empty.
    std::vector<Complex> product(const DenseMatrix &a, const std::vector<Complex> &x,
                                 const bool transposed)
    {
      std::vector<Complex> result(x.size());
      for (unsigned int j = 0; j < a.n_columns; ++j)
      {
        const double *const column = &a.values[std::size_t(j) * a.n_rows];
        if (transposed)
        {
          double re = 0, im = 0;
          for (unsigned int i = 0; i < a.n_rows; ++i)
          {
            re += column[i] * x[i].real();
            im += column[i] * x[i].imag();
          }
          result[j] = {re, im};
        }
        else
          for (unsigned int i = 0; i < a.n_rows; ++i)
            result[i] += column[i] * x[j];
      }
      return result;
    }

    Complex dot(const std::vector<Complex> &y, const std::vector<Complex> &x)
    {
      Complex sum = 0;
      for (unsigned int i = 0; i < x.size(); ++i)
        sum += y[i] * x[i];
      return sum;
    }

    double length(const std::vector<Complex> &x)
    {
      double square = 0;
      for (const Complex &c : x)
        square += std::norm(c);
      return std::sqrt(square);
    }

    void normalise(std::vector<Complex> &x)
    {
      const double size = length(x);
      for (Complex &c : x)
        c /= size;
    }

    /// The products of one vector with Q, P and M, or of their transposes.
    struct Products
    {
      std::array<std::vector<Complex>, 3> of_order;

      Products(const std::array<DenseMatrix, 3> &problem, const std::vector<Complex> &x,
               const bool transposed)
      {
        for (unsigned int order = 0; order < 3; ++order)
          of_order[order] = product(problem[order], x, transposed);
      }
      /// Q(l) x.
      std::vector<Complex> residual(const Complex l) const
      {
        std::vector<Complex> sum = of_order[0];
        for (unsigned int i = 0; i < sum.size(); ++i)
          sum[i] += l * (of_order[1][i] + l * of_order[2][i]);
        return sum;
      }
      /// Q'(l) x.
      std::vector<Complex> slope(const Complex l) const
      {
        std::vector<Complex> sum = of_order[1];
        for (unsigned int i = 0; i < sum.size(); ++i)
          sum[i] += 2. * l * of_order[2][i];
        return sum;
      }
    };
  } // namespace

  void ReducedEigenproblem::set_violations(const DenseMatrix &violations)
  {
    constexpr double closed = 1e-6; // of unit vectors
    kernel                  = DenseMatrix();
    double largest          = 0;
    for (const double value : violations.values)
      largest = std::max(largest, std::abs(value));
    if (largest <= closed)
      return;
    const unsigned int m            = violations.n_rows;
    DenseMatrix vectors             = outer_product(violations, violations);
    const std::vector<double> sizes = symmetric_eigen(vectors); // ascending
    unsigned int n                  = 0;
    while (n < m && sizes[n] <= closed * closed)
      ++n;
    kernel = DenseMatrix(m, n);
    std::copy_n(vectors.values.data(), std::size_t(m) * n, kernel.values.data());
    // The squares leave gaps of the root of rounding: Z -= R S^{-1} R^T G G^T Z, R the others.
    DenseMatrix range(m, m - n), gaps(n, violations.n_columns), c(m - n, n);
    std::copy_n(vectors.values.data() + std::size_t(m) * n, range.values.size(),
                range.values.data());
    gemm(true, 1, kernel, violations, 0, gaps);
    gemm(true, 1, range, outer_product(violations, gaps), 0, c);
    for (unsigned int j = 0; j < n; ++j)
      for (unsigned int i = 0; i < m - n; ++i)
        c(i, j) /= sizes[n + i];
    gemm(false, -1, range, c, 1, kernel);
  }

  DenseMatrix ReducedEigenproblem::in_kernel(const DenseMatrix &a) const
  {
    return kernel.values.empty() || a.values.empty() ? a : congruent(a, kernel);
  }

  void ReducedEigenproblem::set_terms(const unsigned int order, const DenseMatrix &projected)
  {
    if (order == 0)
      dimension = projected.n_rows;
    small_problem[order] = in_kernel(projected);
  }

  void ReducedEigenproblem::solve_densely(ReducedPairs &x, ReducedPairs &y) const
  {
    std::vector<DensePair> pairs =
        quadratic_eigenpairs(small_problem[2], small_problem[1], small_problem[0], 0, radius, true);
    pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                               [&](const DensePair &pair)
                               {
                                 const double size = std::abs(pair.lambda);
                                 return size > radius || size <= rigid_body_limit(max_imaginary) ||
                                        is_overdamped(pair.lambda);
                               }),
                pairs.end());
    const auto solutions_of = [&](std::vector<Complex> DensePair::*vector)
    {
      ReducedPairs result;
      result.re = result.im = DenseMatrix(dimension, pairs.size());
      for (unsigned int k = 0; k < pairs.size(); ++k)
      {
        result.lambda.push_back(pairs[k].lambda);
        set_column(result, k, pairs[k].*vector);
      }
      return result;
    };
    x = solutions_of(&DensePair::vector);
    y = solutions_of(&DensePair::left);
  }

  void ReducedEigenproblem::set_column(ReducedPairs &solutions, const unsigned int k,
                                       const std::vector<Complex> &vector) const
  {
    const double size = length(vector);
    for (unsigned int i = 0; i < dimension; ++i)
    {
      Complex sum = kernel.values.empty() ? vector[i] : 0.;
      for (unsigned int j = 0; j < kernel.n_columns; ++j)
        sum += kernel(i, j) * vector[j];
      solutions.re(i, k) = sum.real() / size;
      solutions.im(i, k) = sum.imag() / size;
    }
  }

  bool ReducedEigenproblem::improve(ReducedPairs &x, ReducedPairs &y) const
  {
    const bool is_whole  = kernel.values.empty();
    const unsigned int m = is_whole ? dimension : kernel.n_columns, n = x.lambda.size();
    const auto start = [&](const DenseMatrix &part)
    {
      const DenseMatrix padded = with_rows(part, dimension);
      if (is_whole)
        return padded;
      DenseMatrix result(m, n);
      gemm(true, 1, kernel, padded, 0, result);
      return result;
    };
    const DenseMatrix x_re = start(x.re), x_im = start(x.im), y_re = start(y.re),
                      y_im = start(y.im);
    for (ReducedPairs *solutions : {&x, &y})
      solutions->re = solutions->im = DenseMatrix(dimension, n);
    const DenseMatrix &q = small_problem[0], &p = small_problem[1], &mass = small_problem[2];
    const bool damped                     = !p.values.empty();
    constexpr unsigned int max_iterations = 5;
    // Of Q x: far below the tolerance, though the eigenvalue's error is of the second order in it
    // and the next one of the third. Beyond the window modes need only be known.
    constexpr double known        = 1e-8;
    const double largest_residual = std::clamp(1e-3 * tolerance, 1e-11, known);
    for (unsigned int k = 0; k < n; ++k)
    {
      std::vector<Complex> right_vector(m), left_vector(m);
      for (unsigned int i = 0; i < m; ++i)
      {
        right_vector[i] = {x_re(i, k), x_im(i, k)};
        left_vector[i]  = {y_re(i, k), y_im(i, k)};
      }
      normalise(right_vector);
      normalise(left_vector);
      Complex l = x.lambda[k];
      for (unsigned int iteration = 0;; ++iteration)
      {
        const Products of_right(small_problem, right_vector, false),
            of_left(small_problem, left_vector, true);
        // The two-sided Rayleigh functional: y^T (l^2 M + l P + Q) x = 0
        l = nearest_root(dot(left_vector, of_right.of_order[2]),
                         dot(left_vector, of_right.of_order[1]),
                         dot(left_vector, of_right.of_order[0]), l);
        if (!(std::abs(l) <= radius) || is_overdamped(l))
          return false;
        const double largest = l.imag() <= max_imaginary ? largest_residual : known;
        if (length(of_right.residual(l)) <= largest * length(of_right.of_order[0]) &&
            length(of_left.residual(l)) <= largest * length(of_left.of_order[0]))
          break;
        if (iteration == max_iterations)
          return false;
        // x := Q(l)^{-1} Q'(l) x, y := Q(l)^{-T} Q'(l)^T y
        ComplexDense at(m, m);
        for (std::size_t e = 0; e < at.values.size(); ++e)
          at.values[e] = q.values[e] + l * ((damped ? p.values[e] : 0.) + l * mass.values[e]);
        right_vector = of_right.slope(l);
        left_vector  = of_left.slope(l);
        solve_both(std::move(at), right_vector, left_vector);
        normalise(right_vector);
        normalise(left_vector);
      }
      x.lambda[k] = y.lambda[k] = l;
      set_column(x, k, right_vector);
      set_column(y, k, left_vector);
    }
    // Two that have become one?
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int j = 0; j < k; ++j)
        if (std::abs(x.lambda[k] - x.lambda[j]) <= 1e-9 * std::abs(x.lambda[k]))
          return false;
    return true;
  }
} // namespace squeal
