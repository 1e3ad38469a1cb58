#pragma once

#include <squeal/base/names.h>

#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace dealii
{
  class ParameterHandler;
}

namespace squeal
{
  /// Friction traction along the sliding direction and its derivatives.
  struct FrictionTraction
  {
    double value      = 0; ///< tau, Pa
    double d_speed    = 0; ///< d tau / d v, Pa s/m: negative for falling friction
    double d_pressure = 0; ///< d tau / d p, -: mu, unless mu depends on the pressure
    double over_speed = 0; ///< tau / v, Pa s/m: what turning the sliding direction is damped by
  };

  /// Coulomb friction in full sliding, tau(v, p) = mu(v, p) p v / sqrt(v^2 + v_s^2), with sliding
  /// speed v >= 0, m/s, and contact pressure p, Pa. The smoothing speed v_s regularises the
  /// direction of slow sliding; 0: none. To add a law: its kind and name, a branch in
  /// coefficient_of(), and for each constant a key in declare() and a row in constants().
  struct FrictionLaw
  {
    enum class Kind
    {
      constant,  ///< mu
      falling,   ///< mu_k + (mu_s - mu_k) exp(-v / v_d)
      smoothed,  ///< mu, with a smoothing speed
      expression ///< a function of v and p that the user gives
    };
    friend std::array<std::string, 4> names_of(Kind)
    {
      return {{"constant", "falling", "smoothed", "expression"}};
    }

    Kind kind                 = Kind::constant;
    double coefficient        = 0;                    ///< mu; for the falling law mu_s, at rest
    double coefficient_moving = 0;                    ///< mu_k, at high speed (falling law)
    double decay_speed        = 1;                    ///< v_d, m/s (falling law)
    double smoothing_speed    = 0;                    ///< v_s, m/s
    std::string text          = "";                   ///< of the expression
    std::function<double(double, double)> expression; ///< mu(v, p), from the text

    /// Makes every constant a key of the section Contact/Friction.
    void declare(dealii::ParameterHandler &prm);
    /// Checks the constants and reads the expression. Throws InputError.
    void check();

    /// The constants by which eigenvalues are differentiated: their keys in Contact/Friction.
    std::vector<std::pair<std::string, double FrictionLaw::*>> constants() const
    {
      if (kind == Kind::expression)
        return {};
      if (kind == Kind::falling)
        return {{"Coefficient", &FrictionLaw::coefficient},
                {"Coefficient at speed", &FrictionLaw::coefficient_moving}};
      return {{"Coefficient", &FrictionLaw::coefficient}};
    }

    /// mu(v). The number type is a template so that Sacado differentiates the law itself.
    template <typename Number>
    Number coefficient_of(const Number &v) const
    {
      using std::exp;
      if (kind == Kind::falling)
        return coefficient_moving + (coefficient - coefficient_moving) * exp(-v / decay_speed);
      return Number(coefficient);
    }

    /// mu(v, p).
    double operator()(const double v, const double p) const
    {
      return kind == Kind::expression ? expression(v, p) : coefficient_of(v);
    }

    bool depends_on_pressure() const
    {
      return kind == Kind::expression;
    }

    /// Whether the derivative with respect to the speed vanishes identically.
    bool is_flat() const
    {
      return (kind == Kind::constant || kind == Kind::smoothed) && smoothing_speed == 0;
    }

    /// The traction and its derivatives: by automatic differentiation, except for an expression,
    /// whose mu is differentiated by five-point differences (its text is evaluated in plain numbers
    /// only).
    ///
    /// An expression may be singular at p = 0 (a negative power, say), where the traction is zero
    /// all the same: it is evaluated at a pressure of at least one pascal.
    FrictionTraction traction(double v, double p) const;
  };
} // namespace squeal
