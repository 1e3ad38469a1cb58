#include <squeal/continuation/reduced_model.h>
#include <squeal/linalg/reduced_tools.h>

#include <algorithm>
#include <cmath>

// LAPACK in complex arithmetic, which PETSc's interface for real numbers does not have.
extern "C"
{
  void zgetrf_(const int *m, const int *n, std::complex<double> *a, const int *lda, int *pivots,
               int *info);
  void zgetrs_(const char *trans, const int *n, const int *n_rhs, const std::complex<double> *a,
               const int *lda, const int *pivots, std::complex<double> *b, const int *ldb,
               int *info);
}

namespace squeal
{
  using namespace reduced;

  namespace
  {
    /// Solves A x = b and A^T y = c in place; false if A is exactly singular.
    bool solve_both(std::vector<std::complex<double>> &a, std::vector<std::complex<double>> &b,
                    std::vector<std::complex<double>> &c, const int n)
    {
      std::vector<int> pivots(n);
      int info      = 0;
      const int one = 1;
      zgetrf_(&n, &n, a.data(), &n, pivots.data(), &info);
      if (info != 0)
        return false;
      zgetrs_("N", &n, &one, a.data(), &n, pivots.data(), b.data(), &n, &info);
      zgetrs_("T", &n, &one, a.data(), &n, pivots.data(), c.data(), &n, &info);
      return true;
    }

    using Complex = std::complex<double>;

    /// y^T A x for real A.
    Complex form(const std::vector<Complex> &y, const DenseMatrix &a, const std::vector<Complex> &x)
    {
      Complex sum = 0;
      for (unsigned int j = 0; j < a.n_columns; ++j)
      {
        double re = 0, im = 0;
        const double *column = &a.values[std::size_t(j) * a.n_rows];
        for (unsigned int i = 0; i < a.n_rows; ++i)
        {
          re += column[i] * y[i].real();
          im += column[i] * y[i].imag();
        }
        sum += Complex(re, im) * x[j];
      }
      return sum;
    }
  } // namespace

  void ReducedModel::solve_densely(Solutions &x, Solutions &y) const
  {
    std::vector<DensePair> pairs = quadratic_eigenpairs(
        small_problem[2], has_velocity_terms ? small_problem[1] : DenseMatrix(), small_problem[0],
        0, radius(), true);
    pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                               [&](const DensePair &pair)
                               {
                                 const double size = std::abs(pair.lambda);
                                 return size > radius() ||
                                        size <= rigid_body_limit(options.max_imaginary);
                               }),
                pairs.end());
    const auto solutions_of = [&](std::vector<Complex> DensePair::*vector)
    {
      Solutions result;
      result.re = result.im = DenseMatrix(dimension(), pairs.size());
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

  void ReducedModel::set_column(Solutions &solutions, const unsigned int k,
                                const std::vector<Complex> &vector) const
  {
    double square = 0;
    for (const Complex c : vector)
      square += std::norm(c);
    for (unsigned int i = 0; i < dimension(); ++i)
    {
      Complex sum = kernel.values.empty() ? vector[i] : 0.;
      for (unsigned int j = 0; j < kernel.n_columns; ++j)
        sum += kernel(i, j) * vector[j];
      solutions.re(i, k) = sum.real() / std::sqrt(square);
      solutions.im(i, k) = sum.imag() / std::sqrt(square);
    }
  }

  bool ReducedModel::improve(Solutions &x, Solutions &y) const
  {
    const bool is_whole  = kernel.values.empty();
    const unsigned int m = is_whole ? dimension() : kernel.n_columns, n = x.lambda.size();
    const auto start = [&](const DenseMatrix &part)
    {
      const DenseMatrix padded = with_rows(part, dimension());
      if (is_whole)
        return padded;
      DenseMatrix result(m, n);
      gemm(true, 1, kernel, padded, 0, result);
      return result;
    };
    const DenseMatrix x_re = start(x.re), x_im = start(x.im), y_re = start(y.re),
                      y_im = start(y.im);
    for (Solutions *solutions : {&x, &y})
      solutions->re = solutions->im = DenseMatrix(dimension(), n);
    const DenseMatrix &q = small_problem[0], &p = small_problem[1], &mass = small_problem[2];
    const bool damped = has_velocity_terms && !p.values.empty();
    std::vector<Complex> at(std::size_t(m) * m);
    constexpr unsigned int max_iterations = 5;
    for (unsigned int k = 0; k < n; ++k)
    {
      std::vector<Complex> right_vector(m), left_vector(m);
      for (unsigned int i = 0; i < m; ++i)
      {
        right_vector[i] = {x_re(i, k), x_im(i, k)};
        left_vector[i]  = {y_re(i, k), y_im(i, k)};
      }
      // The two-sided Rayleigh functional: y^T (l^2 M + l P + Q) x = 0
      const auto rayleigh_functional = [&](const Complex l)
      {
        return nearest_root(form(left_vector, mass, right_vector),
                            damped ? form(left_vector, p, right_vector) : 0.,
                            form(left_vector, q, right_vector), l);
      };
      Complex l      = rayleigh_functional(x.lambda[k]);
      bool converged = false;
      for (unsigned int iteration = 0; iteration < max_iterations && !converged; ++iteration)
      {
        // x := Q(l)^{-1} Q'(l) x, y := Q(l)^{-T} Q'(l)^T y
        std::vector<Complex> of_right(m), of_left(m);
        for (unsigned int j = 0; j < m; ++j)
        {
          const std::size_t first = std::size_t(j) * m;
          for (unsigned int i = 0; i < m; ++i)
          {
            const double p_e    = damped ? p.values[first + i] : 0.;
            const Complex l_m   = l * mass.values[first + i];
            at[first + i]       = q.values[first + i] + l * (p_e + l_m);
            const Complex slope = p_e + 2. * l_m;
            of_right[i] += slope * right_vector[j];
            of_left[j] += slope * left_vector[i];
          }
        }
        if (!solve_both(at, of_right, of_left, m))
          return false;
        const auto normalise = [](std::vector<Complex> &vector)
        {
          double size = 0;
          for (const Complex &c : vector)
            size += std::norm(c);
          for (Complex &c : vector)
            c /= std::sqrt(size);
        };
        right_vector = std::move(of_right);
        left_vector  = std::move(of_left);
        normalise(right_vector);
        normalise(left_vector);
        const Complex before = l;
        l                    = rayleigh_functional(before);
        // Of the third order: the next change is the cube. What has not become accurate fails to
        // be certified.
        converged = std::abs(l - before) <= 1e-7 * std::abs(l);
      }
      if (!converged || std::abs(l) > radius())
        return false;
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

  /// The fixed matrices' factors sum_order c l^order of each solution.
  std::vector<std::vector<ReducedModel::Complex>>
  ReducedModel::factors_of(const std::vector<Complex> &lambda) const
  {
    std::vector<std::vector<Complex>> result(fixed.size(), std::vector<Complex>(lambda.size()));
    for (unsigned int i = 0; i < fixed.size(); ++i)
      for (unsigned int j = 0; j < lambda.size(); ++j)
        for (unsigned int order = 0; order < 3; ++order)
          result[i][j] += coefficients[order][i] * std::pow(lambda[j], int(order));
    return result;
  }

  namespace
  {
    /// Columns of a complex matrix times factors.
    void scale_columns(const DenseMatrix &re, const DenseMatrix &im,
                       const std::vector<std::complex<double>> &factors, DenseMatrix &to_re,
                       DenseMatrix &to_im)
    {
      to_re = to_im = DenseMatrix(re.n_rows, re.n_columns);
      for (unsigned int j = 0; j < re.n_columns; ++j)
        for (unsigned int i = 0; i < re.n_rows; ++i)
        {
          const std::complex<double> x = factors[j] * std::complex<double>(re(i, j), im(i, j));
          to_re(i, j)                  = x.real();
          to_im(i, j)                  = x.imag();
        }
    }
  } // namespace

  /// The interface rows of Q(l) x without the contact's pressures: Re and Im, a row a solution.
  std::array<DenseMatrix, 2> ReducedModel::forces_at_interface(const std::vector<Complex> &lambda,
                                                               const DenseMatrix &x_re,
                                                               const DenseMatrix &x_im) const
  {
    std::array<DenseMatrix, 2> result;
    result.fill(DenseMatrix(lambda.size(), interface_rows.size()));
    for (unsigned int order = 0; order < 3; ++order)
    {
      const DenseMatrix &of_basis = images_at_rows[order];
      if (of_basis.values.empty())
        continue;
      std::vector<Complex> powers;
      for (const Complex l : lambda)
        powers.push_back(std::pow(l, int(order)));
      DenseMatrix re, im;
      scale_columns(x_re, x_im, powers, re, im);
      gemm(true, 1, re, of_basis, 1, result[0]);
      gemm(true, 1, im, of_basis, 1, result[1]);
    }
    return result;
  }

  /// The interface rows of Q(l) x with the pressures that make them smallest: Re and Im, a row a
  /// solution.
  std::array<DenseMatrix, 2> ReducedModel::residuals_at_interface(const Solutions &solutions) const
  {
    std::array<DenseMatrix, 2> result =
        forces_at_interface(solutions.lambda, solutions.re, solutions.im);
    if (has_constraints && !compliant)
      for (DenseMatrix &part : result)
        add(1, shortest_change(left_constraints, part), part);
    return result;
  }

  MultiVector ReducedModel::residuals(const Solutions &solutions) const
  {
    const unsigned int n                            = solutions.lambda.size();
    const std::vector<std::vector<Complex>> factors = factors_of(solutions.lambda);
    MultiVector result(rows, 2 * n);
    for (unsigned int i = 0; i < fixed.size(); ++i)
    {
      DenseMatrix re, im;
      scale_columns(solutions.re, solutions.im, factors[i], re, im);
      std::vector<double> c = std::move(re.values);
      c.insert(c.end(), im.values.begin(), im.values.end());
      for (double &value : c)
        value *= -1; // it is subtracted
      subtract_combination(result, images[i], c);
    }
    const auto inside = residuals_at_interface(solutions);
    for (unsigned int k = 0; k < 2 * n; ++k)
      for (unsigned int r = 0; r < interface_rows.size(); ++r)
        if (rows.contains(interface_rows[r]))
          result.column(k)[interface_rows[r] - rows.begin] = inside[k / n](k % n, r);
    return result;
  }

  void ReducedModel::certify(const MultiVector &residuals, Solutions &solutions) const
  {
    const unsigned int n = solutions.lambda.size();
    std::array<double, 3> norms{};
    for (unsigned int order = 0; order < 3; ++order)
      for (unsigned int i = 0; i < fixed.size(); ++i)
        norms[order] = std::max(norms[order], std::abs(coefficients[order][i]) * fixed_norms[i]);
    DenseMatrix re(n, peak_rows.size()), im = re;
    gemm(true, 1, solutions.re, peaks, 0, re);
    gemm(true, 1, solutions.im, peaks, 0, im);
    std::array<DenseMatrix, 2> violation;
    violation.fill(DenseMatrix(n, interface_rows.size()));
    gemm(true, 1, solutions.re, right_change, 0, violation[0]);
    gemm(true, 1, solutions.im, right_change, 0, violation[1]);
    std::vector<double> largest(n);
    for (unsigned int j = 0; j < n; ++j)
    {
      const double *const re = residuals.column(j), *const im = residuals.column(n + j);
      double square = 0, sum = 0;
      for (unsigned int i = 0; i < residuals.n_local(); ++i)
      {
        const double of_row = re[i] * re[i] + im[i] * im[i];
        square              = std::max(square, of_row);
        sum += of_row; // a maximum passes over what is not a number
      }
      largest[j] = std::isfinite(sum) ? std::sqrt(square) : HUGE_VAL;
    }
    MPI_Allreduce(MPI_IN_PLACE, largest.data(), n, MPI_DOUBLE, MPI_MAX, rows.comm);
    solutions.errors.assign(n, 0.);
    for (unsigned int j = 0; j < n; ++j)
    {
      // In the infinity norm; |x| is at least the largest of some rows.
      double peak = 0, change = 0;
      for (unsigned int r = 0; r < interface_rows.size(); ++r)
        change = std::max(change, violation[0](j, r) * violation[0](j, r) +
                                      violation[1](j, r) * violation[1](j, r));
      change = std::sqrt(change);
      for (unsigned int r = 0; r < peak_rows.size(); ++r)
        peak = std::max(peak, std::hypot(re(j, r), im(j, r)));
      const double l = std::abs(solutions.lambda[j]);
      solutions.errors[j] =
          largest[j] / ((l * l * norms[2] + l * norms[1] + norms[0]) * peak) + change / peak;
    }
  }

  MultiVector ReducedModel::corrections(const MultiVector &residuals,
                                        const std::vector<unsigned int> &which) const
  {
    MultiVector chosen(rows, 0);
    for (const unsigned int part : {0u, residuals.n_columns() / 2})
      for (const unsigned int j : which)
        chosen.append(residuals.columns(part + j, 1));
    return displacements(factors->solve(chosen));
  }
} // namespace squeal
