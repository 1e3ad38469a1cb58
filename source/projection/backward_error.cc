#include <squeal/projection/backward_error.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace squeal
{
  using Complex = std::complex<double>;

  BackwardError::BackwardError(const QuadraticEigenproblem &problem)
      : problem(problem), norm_m(problem.M.infinity_norm()), norm_p(problem.P.infinity_norm()),
        norm_q(problem.Q.infinity_norm())
  {
    for (const FrozenTerm &term : problem.frozen)
      norms_of_frozen.push_back(term.matrix.infinity_norm());
  }

  ComplexMultiVector BackwardError::residuals(const EigenPairs &pairs) const
  {
    const ComplexMultiVector m_x = multiply(problem.M, pairs.right),
                             p_x = multiply(problem.P, pairs.right);
    ComplexMultiVector result    = multiply(problem.Q, pairs.right);
    for (unsigned int j = 0; j < pairs.size(); ++j)
    {
      const Complex l = pairs.lambda[j], l2 = l * l;
      for (unsigned int i = 0; i < result.n_local(); ++i)
        result.set(i, j, l2 * m_x(i, j) + l * p_x(i, j) + result(i, j));
    }
    for (const FrozenTerm &term : problem.frozen)
    {
      const ComplexMultiVector a_x = multiply(term.matrix, pairs.right);
      for (unsigned int j = 0; j < pairs.size(); ++j)
      {
        const Complex h = term.h(pairs.lambda[j]);
        for (unsigned int i = 0; i < result.n_local(); ++i)
          result.set(i, j, result(i, j) + h * a_x(i, j));
      }
    }
    return result;
  }

  std::vector<double> BackwardError::errors(const EigenPairs &pairs,
                                            const ComplexMultiVector &residuals) const
  {
    const unsigned int n      = pairs.size();
    constexpr double infinity = std::numeric_limits<double>::infinity();
    std::vector<double> largest(2 * n), result;
    // A maximum passes over what is not a number, as if it were no error.
    const auto add = [](double &maximum, const Complex value)
    { maximum = std::isfinite(std::abs(value)) ? std::max(maximum, std::abs(value)) : infinity; };
    for (unsigned int j = 0; j < n; ++j)
      for (unsigned int i = 0; i < residuals.n_local(); ++i)
      {
        add(largest[2 * j], residuals(i, j));
        add(largest[2 * j + 1], pairs.right(i, j));
      }
    MPI_Allreduce(MPI_IN_PLACE, largest.data(), largest.size(), MPI_DOUBLE, MPI_MAX,
                  problem.rows.comm);
    for (unsigned int j = 0; j < n; ++j)
    {
      const Complex l = pairs.lambda[j];
      double size     = std::norm(l) * norm_m + std::abs(l) * norm_p + norm_q;
      for (unsigned int b = 0; b < problem.frozen.size(); ++b)
        size += std::abs(problem.frozen[b].h(l)) * norms_of_frozen[b];
      const double error = largest[2 * j] / (size * largest[2 * j + 1]);
      result.push_back(std::isfinite(error) && std::isfinite(size) ? error : infinity);
    }
    return result;
  }
} // namespace squeal
