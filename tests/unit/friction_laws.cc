#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/friction_laws.h>

using namespace squeal;
using namespace squeal::tests;

TEST_CASE("friction_laws: the constant law")
{
  // mu, and mu' = 0, at every speed.
  FrictionLaw law;
  law.coefficient        = 0.6;
  law.coefficient_moving = 0.1; // of no effect here
  for (const double v : {0., 0.3, 100.})
  {
    CHECK(law(v) == 0.6);
    CHECK(law.value_and_derivative(v) == std::make_pair(0.6, 0.));
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
  CHECK(relative_error(law(0.), 0.6) <= 1e-15);
  CHECK(relative_error(law(2.), 0.3 + 0.3 / M_E) <= 1e-15);
  CHECK(relative_error(law(1e3), 0.3) <= 1e-15);
  for (const double v : {0., 0.5, 2., 7.})
  {
    CAPTURE(v);
    const auto [value, derivative] = law.value_and_derivative(v);
    CHECK(value == law(v));
    CHECK(relative_error(derivative, -0.15 * std::exp(-v / 2)) <= 1e-15);
    // Independently of the formula: a central difference, wrong by h^2 mu'''/6 = 6e-13 and by eps/h
    // = 1e-12.
    const double h          = 1e-4;
    const double difference = (law(v + h) - law(v - h)) / (2 * h);
    CHECK(relative_error(derivative, difference, 0.15) <= 1e-9);
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
  CHECK(relative_error(law.value_and_derivative(0).second, 3) <= 1e-15);
}
