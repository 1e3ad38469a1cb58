#include <squeal/continuation/reduced_model.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
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
    result.fill(DenseMatrix(lambda.size(), interface.n_rows()));
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
  std::array<DenseMatrix, 2>
  ReducedModel::residuals_at_interface(const ReducedPairs &solutions) const
  {
    std::array<DenseMatrix, 2> result =
        forces_at_interface(solutions.lambda, solutions.re, solutions.im);
    if (interface.is_constrained())
      for (DenseMatrix &part : result)
        add(1, interface.left_constraints().shortest_change(part), part);
    return result;
  }

  MultiVector ReducedModel::residuals(const ReducedPairs &solutions) const
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
      for (unsigned int r = 0; r < interface.n_rows(); ++r)
        if (rows.contains(interface.rows()[r]))
          result.column(k)[interface.rows()[r] - rows.begin] = inside[k / n](k % n, r);
    return result;
  }

  void ReducedModel::certify(const MultiVector &residuals, ReducedPairs &solutions) const
  {
    const unsigned int n = solutions.lambda.size();
    std::array<double, 3> norms{};
    for (unsigned int order = 0; order < 3; ++order)
      for (unsigned int i = 0; i < fixed.size(); ++i)
        norms[order] = std::max(norms[order], std::abs(coefficients[order][i]) * fixed_norms[i]);
    DenseMatrix re(n, basis.peak_rows.size()), im = re;
    gemm(true, 1, solutions.re, peaks, 0, re);
    gemm(true, 1, solutions.im, peaks, 0, im);
    std::array<DenseMatrix, 2> violation;
    violation.fill(DenseMatrix(n, interface.n_rows()));
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
      for (unsigned int r = 0; r < interface.n_rows(); ++r)
        change = std::max(change, violation[0](j, r) * violation[0](j, r) +
                                      violation[1](j, r) * violation[1](j, r));
      change = std::sqrt(change);
      for (unsigned int r = 0; r < basis.peak_rows.size(); ++r)
        peak = std::max(peak, std::hypot(re(j, r), im(j, r)));
      const double l = std::abs(solutions.lambda[j]);
      solutions.errors[j] =
          largest[j] / ((l * l * norms[2] + l * norms[1] + norms[0]) * peak) + change / peak;
    }
  }

  MultiVector ReducedModel::corrections(const MultiVector &residuals,
                                        const std::vector<unsigned int> &which) const
  {
    MultiVector of_chosen(rows, 0);
    for (const unsigned int part : {0u, residuals.n_columns() / 2})
      for (const unsigned int j : which)
        of_chosen.append(residuals.columns(part + j, 1));
    return basis.displacements(factors->solve(of_chosen));
  }
} // namespace squeal
