#include <squeal/parameters/declare.h>
#include <squeal/parameters/expressions.h>
#include <squeal/parameters/friction_laws.h>

#include <Sacado.hpp>

#include <algorithm>

namespace squeal
{
  void FrictionLaw::declare(dealii::ParameterHandler &prm)
  {
    using namespace Parameters;
    const Subsection section(prm, "Friction");
    add_choice(prm, "Law", kind,
               "mu(v). constant: Coefficient. falling: mu_k + (mu_s - mu_k) exp(-v/v_d) with "
               "mu_s = Coefficient, mu_k = Coefficient at speed, v_d = Decay speed. smoothed: "
               "constant with Smoothing speed. expression: Expression.");
    prm.add_parameter("Coefficient", coefficient, "Friction coefficient mu (falling: at rest), -.",
                      not_negative());
    prm.add_parameter("Coefficient at speed", coefficient_moving,
                      "Friction coefficient at high sliding speed, -. Used by the law falling.",
                      not_negative());
    prm.add_parameter(
        "Decay speed", decay_speed,
        "Sliding speed over which the coefficient falls, m/s. Used by the law falling.",
        positive());
    prm.add_parameter(
        "Expression", text,
        "mu as an expression of the sliding speed v, m/s, and the contact pressure p, Pa. "
        "Used by the law expression; for example 0.4*(p/1e6)^(-0.1).");
    prm.add_parameter(
        "Smoothing speed", smoothing_speed,
        "v_s, m/s: the traction is mu p v/sqrt(v^2 + v_s^2), which has a value at rest. 0: not "
        "smoothed. The law smoothed needs it, the others may have it.",
        not_negative());
  }

  void FrictionLaw::check()
  {
    using namespace Parameters;
    if (kind == Kind::smoothed && smoothing_speed == 0)
      fail("Contact/Friction/Smoothing speed", smoothing_speed,
           "the law smoothed needs a positive speed, m/s.");
    if (kind != Kind::expression)
      return;
    const std::string key = "Contact/Friction/Expression";
    if (text.empty())
      throw InputError(key + ": the law expression needs mu as a function of v and p.");
    expression = friction_expression(text, key);
  }

  FrictionTraction FrictionLaw::traction(const double v, const double p) const
  {
    using Dual = Sacado::Fad::SFad<double, 2>;
    const Dual speed(2, 0, v), pressure(2, 1, p);
    Dual mu = coefficient_of(speed);
    if (kind == Kind::expression)
    {
      const auto slope = [](const auto &f, const double x, const double h)
      { return (8 * (f(x + h) - f(x - h)) - (f(x + 2 * h) - f(x - 2 * h))) / (12 * h); };
      const double p_1 = std::max(p, 1.);
      const double dv  = slope([&](const double x) { return expression(x, p_1); }, v,
                              1e-3 * (v + smoothing_speed));
      const double dp  = slope([&](const double x) { return expression(v, x); }, p_1, 1e-3 * p_1);
      mu               = expression(v, p_1) + dv * (speed - v);
      if (p >= 1)
        mu += dp * (pressure - p);
    }
    if (smoothing_speed == 0)
    {
      const Dual tau = mu * pressure;
      return {tau.val(), tau.dx(0), tau.dx(1), tau.val() / v};
    }
    const Dual over_speed = mu * pressure / sqrt(speed * speed + smoothing_speed * smoothing_speed);
    const Dual tau        = over_speed * speed;
    return {tau.val(), tau.dx(0), tau.dx(1), over_speed.val()};
  }
} // namespace squeal
