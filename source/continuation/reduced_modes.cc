#include <squeal/continuation/reduced_model.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/linalg/reduced_tools.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace reduced;

  Modes ReducedModel::make_modes(const Solutions &x, const Solutions &y,
                                 const std::vector<unsigned int> &which) const
  {
    const unsigned int m = dimension();
    std::vector<unsigned int> order;
    Modes modes;
    for (unsigned int k = 0; k < which.size(); ++k)
    {
      const Complex l = x.lambda[which[k]];
      modes.disc_lambda.push_back(l);
      if (l.imag() <= options.max_imaginary && (l.imag() > 0 || l.real() > 0))
        order.push_back(k);
    }
    std::sort(order.begin(), order.end(),
              [&](const unsigned int a, const unsigned int b)
              {
                const Complex l = x.lambda[which[a]], k = x.lambda[which[b]];
                return std::make_pair(l.imag(), l.real()) < std::make_pair(k.imag(), k.real());
              });
    std::vector<unsigned int> numbers;
    for (const unsigned int k : order)
    {
      numbers.push_back(which[k]);
      modes.backward_error.push_back(x.errors[which[k]]);
    }
    const Solutions of_window = chosen(x, numbers), left_of_window = chosen(y, numbers);
    const std::vector<double> left_errors(numbers.size(), std::nan("")); // not computed
    modes.lambda = of_window.lambda;
    modes.re     = to_block(of_window.re);
    modes.im     = to_block(of_window.im);
    Pairs of_left;
    of_left.lambda     = left_of_window.lambda;
    of_left.re         = to_block(left_of_window.re);
    of_left.im         = to_block(left_of_window.im);
    modes.completeness = "followed by projection on " + std::to_string(m) + " vectors";
    attach_left_vectors(problem(), std::move(of_left), left_errors, modes);
    normalise(modes);
    return modes;
  }

  /// x^H V^T M V x = 1, z^H W^T Q'(l) V x = 2 l, and the condition numbers.
  void ReducedModel::normalise(Modes &modes) const
  {
    const unsigned int n = modes.lambda.size();
    const Matrix m_right = sparse(operators[of_right][2]), m_left = sparse(operators[of_left][2]);
    const auto of_x = sesquilinear_form(modes.re, modes.im, m_right, modes.re, modes.im),
               of_z = sesquilinear_form(modes.left_re, modes.left_im, m_left, modes.left_re,
                                        modes.left_im),
               both = biorthogonality(problem(), modes.lambda, modes.left_re, modes.left_im,
                                      modes.lambda, modes.re, modes.im);
    modes.condition.clear();
    for (unsigned int k = 0; k < n; ++k)
    {
      const std::size_t at = k + std::size_t(k) * n;
      const double x_norm = std::sqrt(of_x[at].real()), z_norm = std::sqrt(of_z[at].real());
      modes.condition.push_back(z_norm * x_norm * std::abs(2. * modes.lambda[k]) /
                                std::abs(both[at]));
      const Complex factor = std::conj(2. * modes.lambda[k] / (both[at] / x_norm));
      for (unsigned int i = 0; i < modes.re.n_local(); ++i)
      {
        modes.re.column(k)[i] /= x_norm;
        modes.im.column(k)[i] /= x_norm;
        const Complex z = factor * Complex(modes.left_re.column(k)[i], modes.left_im.column(k)[i]);
        modes.left_re.column(k)[i] = z.real();
        modes.left_im.column(k)[i] = z.imag();
      }
    }
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

  Modes ReducedModel::expand(const Modes &modes) const
  {
    Modes result   = pad(modes);
    result.re      = expanded(result.re, false);
    result.im      = expanded(result.im, false);
    result.left_re = expanded(result.left_re, true);
    result.left_im = expanded(result.left_im, true);
    return result;
  }

  /// V^T x, and d with W^T (z - W d) = 0.
  Modes ReducedModel::coordinates(const Modes &whole) const
  {
    Modes result             = whole;
    const unsigned int m     = dimension();
    const auto of_right_side = [&](const MultiVector &x)
    { return to_block(DenseMatrix(m, x.n_columns(), inner_products(right, x))); };
    result.re     = of_right_side(whole.re);
    result.im     = of_right_side(whole.im);
    MultiVector w = left;
    w.append(right.columns(left.n_columns(), m - left.n_columns()));
    const PositiveFactors squares(DenseMatrix(m, m, inner_products(w, w)));
    const auto of_left_side = [&](const MultiVector &z)
    { return to_block(squares.solve(DenseMatrix(m, z.n_columns(), inner_products(w, z)))); };
    result.left_re = of_left_side(whole.left_re);
    result.left_im = of_left_side(whole.left_im);
    return result;
  }

  Modes ReducedModel::pad(const Modes &modes) const
  {
    Modes result = modes;
    for (MultiVector Modes::*block : {&Modes::re, &Modes::im, &Modes::left_re, &Modes::left_im})
    {
      const MultiVector &old = modes.*block;
      MultiVector padded(small_rows(dimension()), old.n_columns());
      for (unsigned int k = 0; k < old.n_columns(); ++k)
        std::copy_n(old.column(k), old.n_local(), padded.column(k));
      result.*block = std::move(padded);
    }
    return result;
  }
} // namespace squeal
