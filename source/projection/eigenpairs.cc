#include <squeal/projection/eigenpairs.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace squeal
{
  using Complex = std::complex<double>;

  EigenPairs EigenPairs::select(const std::vector<unsigned int> &numbers) const
  {
    EigenPairs result;
    const auto pick = [&](const auto &from, auto &to)
    {
      for (const unsigned int j : numbers)
        if (!from.empty())
          to.push_back(from[j]);
    };
    pick(lambda, result.lambda);
    pick(backward_error, result.backward_error);
    pick(left_backward_error, result.left_backward_error);
    pick(condition, result.condition);
    pick(projection_error, result.projection_error);
    pick(parity, result.parity);
    result.right = right.columns(numbers);
    if (left.n_columns() > 0)
      result.left = left.columns(numbers);
    return result;
  }

  void EigenPairs::append(const EigenPairs &others)
  {
    const auto join = [](const auto &more, auto &all)
    { all.insert(all.end(), more.begin(), more.end()); };
    join(others.lambda, lambda);
    join(others.backward_error, backward_error);
    join(others.left_backward_error, left_backward_error);
    join(others.condition, condition);
    join(others.projection_error, projection_error);
    join(others.parity, parity);
    right.append(others.right);
    left.append(others.left);
  }

  std::vector<unsigned int> order_of_modes(const std::vector<Complex> &lambda)
  {
    std::vector<unsigned int> order(lambda.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(),
                     [&](const unsigned int a, const unsigned int b)
                     { return precedes(lambda[a], lambda[b]); });
    return order;
  }

  std::vector<unsigned int> nearest_partners(const std::vector<Complex> &lambda,
                                             const std::vector<Complex> &others)
  {
    std::vector<bool> taken(others.size(), false);
    std::vector<unsigned int> partners;
    for (unsigned int j = 0; j < std::min(lambda.size(), others.size()); ++j)
    {
      unsigned int best = others.size();
      for (unsigned int k = 0; k < others.size(); ++k)
        if (!taken[k] && (best == others.size() ||
                          std::abs(others[k] - lambda[j]) < std::abs(others[best] - lambda[j])))
          best = k;
      taken[best] = true;
      partners.push_back(best);
    }
    return partners;
  }

  double largest_change(const std::vector<Complex> &lambda, const std::vector<Complex> &previous)
  {
    if (lambda.size() != previous.size())
      return 1;
    double change                            = 0;
    const std::vector<unsigned int> partners = nearest_partners(lambda, previous);
    for (unsigned int k = 0; k < lambda.size(); ++k)
      change = std::max(change, std::abs(previous[partners[k]] - lambda[k]) / std::abs(lambda[k]));
    return change;
  }

  std::vector<Complex> biorthogonality(const QuadraticEigenproblem &problem,
                                       const EigenPairs &of_left, const EigenPairs &of_right)
  {
    const ComplexMultiVector &z = of_left.left, &x = of_right.right;
    std::vector<Complex> form       = sesquilinear_form(z, problem.M, x);
    const std::vector<Complex> of_p = sesquilinear_form(z, problem.P, x);
    for (std::size_t j = 0, k = 0; j < of_right.size(); ++j)
      for (std::size_t i = 0; i < of_left.size(); ++i, ++k)
        form[k] = (of_left.lambda[i] + of_right.lambda[j]) * form[k] + of_p[k];
    for (const FrozenTerm &term : problem.frozen)
    {
      const std::vector<Complex> of_a = sesquilinear_form(z, term.matrix, x);
      for (std::size_t j = 0, k = 0; j < of_right.size(); ++j)
        for (std::size_t i = 0; i < of_left.size(); ++i, ++k)
          form[k] += term.quotient(of_left.lambda[i], of_right.lambda[j]) * of_a[k];
    }
    return form;
  }

  namespace
  {
    /// The factors that turn the largest component of each column to the real axis.
    std::vector<Complex> turning_factors(const ComplexMultiVector &x)
    {
      // The first of the largest components, which may be equal by symmetry: rounding and the
      // number of ranks are not to choose.
      const RowRange &rows = x.row_range();
      const unsigned int n = x.n_columns();
      const auto size_of   = [&](const unsigned int i, const unsigned int k)
      { return std::hypot(x.re.column(k)[i], x.im.column(k)[i]); };
      std::vector<double> largest(n, 0.);
      for (unsigned int k = 0; k < n; ++k)
        for (unsigned int i = 0; i < rows.n_local(); ++i)
          largest[k] = std::max(largest[k], size_of(i, k));
      MPI_Allreduce(MPI_IN_PLACE, largest.data(), n, MPI_DOUBLE, MPI_MAX, rows.comm);
      std::vector<unsigned int> first(n, rows.size); // global row
      for (unsigned int k = 0; k < n; ++k)
        for (unsigned int i = 0; i < rows.n_local() && first[k] == rows.size; ++i)
          if (!(size_of(i, k) * (1 + 1e-8) < largest[k]))
            first[k] = rows.begin + i;
      MPI_Allreduce(MPI_IN_PLACE, first.data(), n, MPI_UNSIGNED, MPI_MIN, rows.comm);
      std::vector<Complex> factors(n);
      for (unsigned int k = 0; k < n; ++k)
        if (rows.contains(first[k]))
        {
          const unsigned int i = first[k] - rows.begin;
          factors[k]           = largest[k] > 0 ? std::conj(x(i, k)) / size_of(i, k) : Complex(1);
        }
      MPI_Allreduce(MPI_IN_PLACE, factors.data(), 2 * n, MPI_DOUBLE, MPI_SUM, rows.comm);
      return factors;
    }
  } // namespace

  void RayleighCorrections::add(const unsigned int order, const double coefficient,
                                const std::vector<Complex> &forms)
  {
    for (unsigned int j = 0; j < lambda.size(); ++j)
    {
      const Complex l = lambda[j], a = coefficient * forms[j];
      residuals[j] += order == 2 ? l * l * a : order == 1 ? l * a : a;
      slopes[j] += order == 2 ? 2. * l * a : order == 1 ? a : 0.;
    }
  }

  void RayleighCorrections::add(const FrozenTerm &term, const std::vector<Complex> &forms)
  {
    for (unsigned int j = 0; j < lambda.size(); ++j)
    {
      residuals[j] += term.h(lambda[j]) * forms[j];
      slopes[j] += term.derivative(lambda[j]) * forms[j];
    }
  }

  std::vector<Complex> RayleighCorrections::values() const
  {
    std::vector<Complex> result;
    for (unsigned int j = 0; j < lambda.size(); ++j)
      result.push_back(residuals[j] / slopes[j]);
    return result;
  }

  void turn_to_real(EigenPairs &modes)
  {
    // z^H Q'(l) x does not change if both are multiplied by the same factor of modulus 1.
    const std::vector<Complex> factors = turning_factors(modes.right);
    modes.right.scale(factors);
    modes.left.scale(factors);
  }

  void normalise(const QuadraticEigenproblem &problem, EigenPairs &modes)
  {
    const unsigned int n = modes.size();
    // Sums over the rows of x^H M x, z^H M z, z^H (2 l M + P) x, x^H x, z^H z, x^H P x
    constexpr unsigned int n_sums = 6;
    std::vector<Complex> sums(n_sums * n), factors = turning_factors(modes.right), left_factors(n);
    const ComplexMultiVector m_x = multiply(problem.M, modes.right),
                             p_x = multiply(problem.P, modes.right),
                             m_z = multiply(problem.M, modes.left);
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int i = 0; i < problem.rows.n_local(); ++i)
      {
        const Complex x = modes.right(i, k), z = modes.left(i, k), mx = m_x(i, k);
        Complex *of_mode = &sums[n_sums * k];
        of_mode[0] += std::conj(x) * mx;
        of_mode[1] += std::conj(z) * m_z(i, k);
        of_mode[2] += std::conj(z) * (2. * modes.lambda[k] * mx + p_x(i, k));
        of_mode[3] += std::norm(x);
        of_mode[4] += std::norm(z);
        of_mode[5] += std::conj(x) * p_x(i, k);
      }
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2 * sums.size(), MPI_DOUBLE, MPI_SUM,
                  problem.rows.comm);
    for (const FrozenTerm &term : problem.frozen)
    {
      const std::vector<Complex> of_a = diagonal_form(modes.left, term.matrix, modes.right);
      for (unsigned int k = 0; k < n; ++k)
        sums[n_sums * k + 2] += term.derivative(modes.lambda[k]) * of_a[k];
    }
    modes.condition.clear();
    // A motion without mass, whose eigenvalue a dashpot gives, has a length all the same.
    constexpr double rounding = 1e-20; // of squares
    const double largest      = problem.M.infinity_norm();
    for (unsigned int k = 0; k < n; ++k)
    {
      const Complex *of_mode = &sums[n_sums * k], product = of_mode[2];
      const bool has_mass =
          std::abs(modes.lambda[k] * of_mode[0]) > rounding * std::abs(of_mode[5]);
      const auto norm = [&](const Complex &form, const Complex &square)
      { return std::sqrt(has_mass && form.real() > 0 ? form.real() : largest * square.real()); };
      const double x_norm = norm(of_mode[0], of_mode[3]), z_norm = norm(of_mode[1], of_mode[4]);
      modes.condition.push_back(z_norm * x_norm * std::abs(2. * modes.lambda[k]) /
                                std::abs(product));
      factors[k] /= x_norm;
      left_factors[k] = std::conj(2. * modes.lambda[k] / (product * factors[k]));
    }
    modes.right.scale(factors);
    modes.left.scale(left_factors);
  }
} // namespace squeal
