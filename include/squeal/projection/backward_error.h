#pragma once

#include <squeal/projection/eigenpairs.h>

namespace squeal
{
  /// The normwise backward error of approximate eigenpairs (Tisseur, 2000) in the infinity norm,
  ///     |Q(l) x| / ((|l|^2 |M| + |l| |P| + |Q|) |x|),
  /// the one measure for all solvers; with frozen terms |h(l)| |A| of each is added below, and the
  /// residual is the exact one.
  class BackwardError
  {
  public:
    explicit BackwardError(const QuadraticEigenproblem &problem);

    /// The backward errors of the right vectors.
    std::vector<double> operator()(const EigenPairs &pairs) const
    {
      return errors(pairs, residuals(pairs));
    }
    /// Q(l_j) x_j.
    ComplexMultiVector residuals(const EigenPairs &pairs) const;
    /// The backward errors of given residuals.
    std::vector<double> errors(const EigenPairs &pairs, const ComplexMultiVector &residuals) const;

  private:
    const QuadraticEigenproblem &problem;
    double norm_m, norm_p, norm_q;
    std::vector<double> norms_of_frozen;
  };
} // namespace squeal
