#pragma once

#include <Sacado.hpp>

#include <cmath>
#include <string>
#include <utility>

namespace squeal
{
  /// Coulomb friction coefficient as a function of the sliding speed v >= 0, m/s.
  /// To add a law: one branch in operator() and its name in the pattern of Contact/Friction/Law.
  struct FrictionLaw
  {
    enum class Kind
    {
      constant, ///< mu
      falling   ///< mu_k + (mu_s - mu_k) exp(-v / v_d)
    };

    Kind   kind               = Kind::constant;
    double coefficient        = 0; ///< mu; for the falling law mu_s, at rest
    double coefficient_moving = 0; ///< mu_k, at high speed (falling law)
    double decay_speed        = 1; ///< v_d, m/s (falling law)

    /// mu(v). The number type is a template so that Sacado differentiates the law itself.
    template <typename Number>
    Number operator()(const Number &v) const
    {
      using std::exp;
      if (kind == Kind::falling)
        return coefficient_moving + (coefficient - coefficient_moving) * exp(-v / decay_speed);
      return Number(coefficient);
    }

    /// mu(v) and its derivative mu'(v) in s/m, by automatic differentiation.
    std::pair<double, double> value_and_derivative(const double v) const
    {
      using Dual = Sacado::Fad::SFad<double, 1>;
      const Dual mu = (*this)(Dual(1, 0, v));
      return {mu.val(), mu.dx(0)};
    }
  };
} // namespace squeal
