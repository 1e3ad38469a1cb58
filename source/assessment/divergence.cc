#include <squeal/assessment/divergence.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace squeal
{
  std::vector<unsigned int> divergent_modes(const EigenPairs &modes)
  {
    std::vector<unsigned int> result;
    for (unsigned int j = 0; j < modes.lambda.size(); ++j)
      if (modes.lambda[j].imag() == 0 && modes.lambda[j].real() > 0)
        result.push_back(j);
    return result;
  }

  namespace
  {
    MultiVector column_times(const Matrix &matrix, const MultiVector &block,
                             const unsigned int column)
    {
      MultiVector x(block.row_range(), 1);
      std::copy_n(block.column(column), block.n_local(), x.data());
      x                 = multiply(matrix, x);
      const double size = std::sqrt(inner_product(x, x));
      for (unsigned int i = 0; i < x.n_local(); ++i)
        x.data()[i] /= size;
      return x;
    }
  } // namespace

  StaticInstability::StaticInstability(const QuadraticEigenproblem &problem,
                                       const EigenPairs &modes, const unsigned int mode)
      : b(column_times(problem.M, modes.right.re, mode)),
        c(column_times(problem.M, modes.left.re, mode))
  {
  }

  StaticInstability::Result
  StaticInstability::evaluate(const QuadraticEigenproblem &problem,
                              const std::vector<ParameterDerivative> &derivatives) const
  {
    Result result;
    result.derivatives.assign(derivatives.size(), std::numeric_limits<double>::quiet_NaN());
    try
    {
      const Factorization factorization(problem.Q, Factorization::Kind::lu,
                                        "the position matrix (for static instability)");
      const MultiVector x = factorization.solve(b), z = factorization.solve_transposed(c);
      const double reciprocal = inner_product(c, x);
      if (!std::isfinite(reciprocal)) // singular up to rounding
        return result;
      result.value = 1 / reciprocal;
      for (unsigned int k = 0; k < derivatives.size(); ++k)
      {
        double sum = 0;
        for (const Term &term : derivatives[k].terms)
          if (term.order == 0)
            sum += term.coefficient * inner_product(z, multiply(*term.matrix, x));
        result.derivatives[k] = result.value * result.value * sum;
      }
    }
    catch (const SingularMatrix &)
    {
      result.value = 0; // this is the point itself
    }
    return result;
  }
} // namespace squeal
