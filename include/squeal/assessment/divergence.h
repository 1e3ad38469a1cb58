#pragma once

#include <squeal/eigen/subspace_iteration.h>
#include <squeal/model/model.h>

#include <functional>
#include <optional>
#include <utility>

namespace squeal
{
  /// A root of f(p) = 0.
  struct Root
  {
    double value = 0, accuracy = 0; ///< the last step
    unsigned int iterations = 0;
  };

  /// Newton's method between two values at which f has different signs, kept inside of the interval
  /// by bisection. @p function returns f and df/dp; where the derivative is not finite, regula
  /// falsi takes its place. Ends when the step is below 1e-11 of the values' size: the last step
  /// makes that its square.
  Root find_root(double low, double f_low, double high, double f_high,
                 const std::function<std::pair<double, double>(double)> &function);

  /// The same where only the interval is known: the signs at its ends decide, and an end that is a
  /// root up to rounding is taken as it is. Nothing if there is no change of sign.
  std::optional<Root> find_root(double low, double high,
                                const std::function<std::pair<double, double>(double)> &function);

  /// The real modes that grow, verdict divergence.
  std::vector<unsigned int> divergent_modes(const Modes &modes);

  /// Where an eigenvalue is zero: det Q = 0, the steady state is statically unstable. The
  /// eigenvalue itself is not smooth there (+-j w meet and leave as +-rho), but
  ///     f = 1/(c^T Q^{-1} b) = det Q / (c^T adj(Q) b)
  /// is, and so is
  ///     df/dp = f^2 z^T (dQ/dp) x,   x = Q^{-1} b,   z = Q^{-T} c.
  /// With b = M u and c = M v of the divergent mode nearby the denominator is not small.
  class StaticInstability
  {
  public:
    StaticInstability(const QuadraticEigenproblem &problem, const Modes &modes, unsigned int mode);

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
