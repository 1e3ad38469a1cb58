#include <squeal/continuation/reduced_model.h>
#include <squeal/eigen/left_vectors.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  EigenPairs ReducedModel::make_modes(const ReducedPairs &x, const ReducedPairs &y,
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
    const auto vectors_of = [&](const ReducedPairs &solutions)
    {
      const ReducedPairs of_window = solutions.select(numbers);
      return ComplexMultiVector(to_multi_vector(of_window.re), to_multi_vector(of_window.im));
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
    const Matrix m_right = to_matrix(operators[of_right][2]),
                 m_left  = to_matrix(operators[of_left][2]);
    const auto of_x      = sesquilinear_form(modes.right, m_right, modes.right),
               of_z      = sesquilinear_form(modes.left, m_left, modes.left),
               both      = biorthogonality(problem(), modes, modes);
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

  EigenPairs ReducedModel::expand(const EigenPairs &modes) const
  {
    EigenPairs result = pad(modes);
    result.right = {basis.expanded(result.right.re, false), basis.expanded(result.right.im, false)};
    result.left  = {basis.expanded(result.left.re, true), basis.expanded(result.left.im, true)};
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
