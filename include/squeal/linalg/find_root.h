#pragma once

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

  /// f and df/dp at p.
  using DifferentiableFunction = std::function<std::pair<double, double>(double p)>;

  /// Newton's method between two values at which f has different signs, kept inside of the interval
  /// by bisection; where the derivative is not finite, regula falsi takes its place. Ends when the
  /// step is below 1e-11 of the values' size, whose square the last step makes of it, or where
  /// @p is_converged says so of Newton's step from the last p.
  Root find_root(double low, double f_low, double high, double f_high,
                 const DifferentiableFunction &function,
                 const std::function<bool(double p, double step)> &is_converged = {});

  /// Looks between two values of which nothing is known: the signs of f there decide, and an end
  /// that is a root up to rounding is taken as it is. Nothing if there is no change of sign.
  std::optional<Root> find_root(double low, double high, const DifferentiableFunction &function);
} // namespace squeal
