#pragma once

#include <squeal/model/model.h>
#include <squeal/projection/eigenpairs.h>

#include <vector>

namespace squeal
{
  /// The real modes that grow, verdict divergence.
  std::vector<unsigned int> divergent_modes(const EigenPairs &modes);

  /// Where an eigenvalue is zero: det Q = 0, the steady state is statically unstable. The
  /// eigenvalue itself is not smooth there (+-j w meet and leave as +-rho), but
  ///     f = 1/(c^T Q^{-1} b) = det Q / (c^T adj(Q) b)
  /// is, and so is
  ///     df/dp = f^2 z^T (dQ/dp) x,   x = Q^{-1} b,   z = Q^{-T} c.
  /// With b = M u and c = M v of the divergent mode nearby the denominator is not small.
  class StaticInstability
  {
  public:
    StaticInstability(const QuadraticEigenproblem &problem, const EigenPairs &modes,
                      unsigned int mode);

    struct Result
    {
      double value = 0;
      std::vector<double> derivatives; ///< not finite where value is exactly zero
    };
    Result evaluate(const QuadraticEigenproblem &problem,
                    const std::vector<ParameterDerivative> &derivatives) const;

  private:
    MultiVector b, c;
  };
} // namespace squeal
