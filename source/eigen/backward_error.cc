#include <squeal/eigen/backward_error.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using Complex = std::complex<double>;

  BackwardError::BackwardError(const QuadraticEigenproblem &problem)
      : problem(problem), norm_m(problem.M.infinity_norm()), norm_p(problem.P.infinity_norm()),
        norm_q(problem.Q.infinity_norm())
  {
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
    return result;
  }

  std::vector<double> BackwardError::errors(const EigenPairs &pairs,
                                            const ComplexMultiVector &residuals) const
  {
    const unsigned int n = pairs.size();
    std::vector<double> largest(2 * n), result;
    for (unsigned int j = 0; j < n; ++j)
      for (unsigned int i = 0; i < residuals.n_local(); ++i)
      {
        largest[2 * j]     = std::max(largest[2 * j], std::abs(residuals(i, j)));
        largest[2 * j + 1] = std::max(largest[2 * j + 1], std::abs(pairs.right(i, j)));
      }
    MPI_Allreduce(MPI_IN_PLACE, largest.data(), largest.size(), MPI_DOUBLE, MPI_MAX,
                  problem.rows.comm);
    for (unsigned int j = 0; j < n; ++j)
    {
      const Complex l   = pairs.lambda[j];
      const double size = std::norm(l) * norm_m + std::abs(l) * norm_p + norm_q;
      result.push_back(largest[2 * j] / (size * largest[2 * j + 1]));
    }
    return result;
  }
} // namespace squeal
