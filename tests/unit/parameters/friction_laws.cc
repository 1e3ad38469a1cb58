#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/parameters/friction_laws.h>
namespace squeal::tests::friction_laws_tests
{
  TEST_CASE("friction_laws: the constant law")
  {
    // mu, and mu' = 0, at every speed.
    FrictionLaw law;
    law.coefficient        = 0.6;
    law.coefficient_moving = 0.1; // of no effect here
    for (const double v : {0., 0.3, 100.})
    {
      CHECK(law(v, 1e6) == 0.6);
      const FrictionTraction tau = law.traction(v, 1e6);
      CHECK(tau.value == 0.6e6);
      CHECK(tau.d_speed == 0);
      CHECK(tau.d_pressure == 0.6);
      if (v > 0)
        CHECK(relative_error(tau.over_speed, 0.6e6 / v) <= 1e-15);
    }
  }

  TEST_CASE("friction_laws: the falling law")
  {
    // mu(v) = 0.3 + 0.3 exp(-v/2): 0.6 at rest, 0.3 + 0.3/e at v = 2, towards 0.3 at high speed;
    // mu'(v) = -0.15 exp(-v/2).
    FrictionLaw law;
    law.kind               = FrictionLaw::Kind::falling;
    law.coefficient        = 0.6;
    law.coefficient_moving = 0.3;
    law.decay_speed        = 2;
    CHECK(relative_error(law(0., 1e6), 0.6) <= 1e-15);
    CHECK(relative_error(law(2., 1e6), 0.3 + 0.3 / M_E) <= 1e-15);
    CHECK(relative_error(law(1e3, 1e6), 0.3) <= 1e-15);
    for (const double v : {0., 0.5, 2., 7.})
    {
      CAPTURE(v);
      const double p             = 2e6;
      const FrictionTraction tau = law.traction(v, p);
      CHECK(tau.value == p * law(v, p));
      CHECK(tau.d_pressure == law(v, p));
      CHECK(relative_error(tau.d_speed, -0.15 * p * std::exp(-v / 2)) <= 1e-15);
      // Independently of the formula: a central difference, wrong by h^2 mu'''/6 = 6e-13 and by
      // eps/h = 1e-12.
      const double h          = 1e-4;
      const double difference = (law(v + h, p) - law(v - h, p)) / (2 * h);
      CHECK(relative_error(tau.d_speed / p, difference, 0.15) <= 1e-9);
    }
  }

  TEST_CASE("friction_laws: a law that rises with speed")
  {
    // Coefficient at speed above that at rest: mu' > 0, at rest (0.5 - 0.2)/0.1 = 3 s/m.
    FrictionLaw law;
    law.kind               = FrictionLaw::Kind::falling;
    law.coefficient        = 0.2;
    law.coefficient_moving = 0.5;
    law.decay_speed        = 0.1;
    CHECK(relative_error(law.traction(0, 1).d_speed, 3) <= 1e-15);
  }

  TEST_CASE("friction_laws: smoothed direction and user's expression, against differences")
  {
    // tau = mu(v, p) p v/sqrt(v^2 + v_s^2). Central differences of h = 1e-4 relative: wrong by
    // 1e-8.
    FrictionLaw law;
    law.kind       = FrictionLaw::Kind::expression;
    law.expression = [](const double v, const double p)
    { return 0.5 * (1 + 0.3 * std::exp(-v)) * std::pow(p / 1e6, -0.1); };
    for (const double v_s : {0., 0.4})
      for (const double v : {0.2, 1., 5.})
        for (const double p : {1e5, 3e6})
        {
          law.smoothing_speed = v_s;
          const auto value    = [&](const double v, const double p)
          { return law.expression(v, p) * p * v / std::hypot(v, v_s); };
          const FrictionTraction tau = law.traction(v, p);
          const double h             = 1e-4;
          CHECK(relative_error(tau.value, value(v, p)) <= 1e-14);
          CHECK(relative_error(tau.over_speed, value(v, p) / v) <= 1e-14);
          CHECK(relative_error(tau.d_speed,
                               (value(v * (1 + h), p) - value(v * (1 - h), p)) / (2 * v * h),
                               value(v, p) / v) <= 1e-7);
          CHECK(relative_error(tau.d_pressure, (value(v, p * (1 + h)) - value(v, p * (1 - h))) /
                                                   (2 * p * h)) <= 1e-7);
        }
    // At rest the smoothed traction vanishes, with the slope mu p/v_s.
    law.kind            = FrictionLaw::Kind::constant;
    law.coefficient     = 0.6;
    law.smoothing_speed = 0.1;
    CHECK(law.traction(0, 1e6).value == 0);
    CHECK(relative_error(law.traction(0, 1e6).over_speed, 6e6) <= 1e-15);
    CHECK(relative_error(law.traction(0, 1e6).d_speed, 6e6) <= 1e-15);
    CHECK_FALSE(law.is_flat());
  }
} // namespace squeal::tests::friction_laws_tests
