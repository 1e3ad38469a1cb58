#include <squeal/continuation/reduced_model.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/linalg/reduced_tools.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace reduced;

  EigenPairs ReducedModel::make_modes(const Solutions &x, const Solutions &y,
                                      const std::vector<unsigned int> &which) const
  {
    std::vector<Complex> lambda;
    for (const unsigned int k : which)
      lambda.push_back(x.lambda[k]);
    std::vector<unsigned int> numbers;
    EigenPairs modes, transposed;
    for (const unsigned int k : order_of_modes(lambda))
      if (is_in_window(lambda[k]) && (lambda[k].imag() > 0 || lambda[k].real() > 0))
      {
        numbers.push_back(which[k]);
        modes.lambda.push_back(lambda[k]);
        modes.backward_error.push_back(x.errors[which[k]]);
      }
    const auto vectors_of = [&](const Solutions &solutions)
    {
      const Solutions of_window = chosen(solutions, numbers);
      return ComplexMultiVector(to_block(of_window.re), to_block(of_window.im));
    };
    modes.right      = vectors_of(x);
    transposed.right = vectors_of(y);
    transposed.backward_error.assign(numbers.size(), std::nan("")); // not computed
    attach_left_vectors(problem(), std::move(transposed), modes);
    normalise(modes);
    return modes;
  }

  /// x^H V^T M V x = 1, z^H W^T Q'(l) V x = 2 l, and the condition numbers.
  void ReducedModel::normalise(EigenPairs &modes) const
  {
    const unsigned int n = modes.size();
    const Matrix m_right = sparse(operators[of_right][2]), m_left = sparse(operators[of_left][2]);
    const auto of_x = sesquilinear_form(modes.right, m_right, modes.right),
               of_z = sesquilinear_form(modes.left, m_left, modes.left),
               both = biorthogonality(problem(), modes, modes);
    modes.condition.clear();
    std::vector<Complex> right_factors, left_factors;
    for (unsigned int k = 0; k < n; ++k)
    {
      const std::size_t at = k + std::size_t(k) * n;
      const double x_norm = std::sqrt(of_x[at].real()), z_norm = std::sqrt(of_z[at].real());
      modes.condition.push_back(z_norm * x_norm * std::abs(2. * modes.lambda[k]) /
                                std::abs(both[at]));
      right_factors.push_back(1 / x_norm);
      left_factors.push_back(std::conj(2. * modes.lambda[k] / (both[at] / x_norm)));
    }
    modes.right.scale(right_factors);
    modes.left.scale(left_factors);
  }

  // Coordinates.

  MultiVector ReducedModel::expanded(const MultiVector &c, const bool of_left) const
  {
    const unsigned int m = dimension(), n = c.n_columns(), n_left = of_left ? left.n_columns() : 0;
    // W differs from V in its first columns
    std::vector<double> of_v(c.data(), c.data() + std::size_t(m) * n), of_w;
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int i = 0; i < n_left; ++i)
      {
        of_w.push_back(-c.column(k)[i]); // it is subtracted
        of_v[i + std::size_t(k) * m] = 0;
      }
    MultiVector sum = combine(right, of_v, n);
    if (n_left > 0)
      subtract_combination(sum, left, of_w);
    return sum;
  }

  EigenPairs ReducedModel::expand(const EigenPairs &modes) const
  {
    EigenPairs result = pad(modes);
    result.right      = {expanded(result.right.re, false), expanded(result.right.im, false)};
    result.left       = {expanded(result.left.re, true), expanded(result.left.im, true)};
    return result;
  }

  /// V^T x, and d with W^T (z - W d) = 0.
  EigenPairs ReducedModel::coordinates(const EigenPairs &whole) const
  {
    EigenPairs result        = whole;
    const unsigned int m     = dimension();
    const auto of_right_side = [&](const MultiVector &x)
    { return to_block(DenseMatrix(m, x.n_columns(), inner_products(right, x))); };
    result.right  = {of_right_side(whole.right.re), of_right_side(whole.right.im)};
    MultiVector w = left;
    w.append(right.columns(left.n_columns(), m - left.n_columns()));
    const PositiveFactors squares(DenseMatrix(m, m, inner_products(w, w)));
    const auto of_left_side = [&](const MultiVector &z)
    { return to_block(squares.solve(DenseMatrix(m, z.n_columns(), inner_products(w, z)))); };
    result.left = {of_left_side(whole.left.re), of_left_side(whole.left.im)};
    return result;
  }

  EigenPairs ReducedModel::pad(const EigenPairs &modes) const
  {
    EigenPairs result = modes;
    for (ComplexMultiVector *vectors : {&result.right, &result.left})
      for (MultiVector *part : {&vectors->re, &vectors->im})
      {
        MultiVector padded(small_rows(dimension()), part->n_columns());
        for (unsigned int k = 0; k < part->n_columns(); ++k)
          std::copy_n(part->column(k), part->n_local(), padded.column(k));
        *part = std::move(padded);
      }
    return result;
  }
} // namespace squeal
