#include <doctest/doctest.h>

#include <squeal/linalg/find_root.h>

#include <cmath>
#include <limits>
namespace squeal::tests::find_root_tests
{
  TEST_CASE("find_root: Newton's method within an interval")
  {
    // p^2 = 2 between 0 and 2, upwards and downwards.
    const auto square = [](const double p) { return std::make_pair(p * p - 2, 2 * p); };
    for (const bool upwards : {true, false})
    {
      const Root root = upwards ? find_root(0, -2, 2, 2, square) : find_root(2, 2, 0, -2, square);
      CHECK(std::abs(root.value - std::sqrt(2.)) <= 1e-15);
      CHECK(root.accuracy <= 2e-11);
      CHECK(root.iterations <= 7);
    }
    // atan(10 p) from -1 to 4: from the chord's point Newton leaves the interval; bisection helps.
    const auto arc = [](const double p)
    { return std::make_pair(std::atan(10 * p), 10 / (1 + 100 * p * p)); };
    CHECK(std::abs(find_root(-1, arc(-1).first, 4, arc(4).first, arc).value) <= 1e-12);
  }

  TEST_CASE("find_root: without a derivative, and with another criterion")
  {
    // Regula falsi of p^3 = 1/8 between 0.4 and 0.6 comes nearer with every step: 40 of them
    // suffice for 1e-9.
    const auto cubic = [](const double p)
    { return std::make_pair(p * p * p - 0.125, std::numeric_limits<double>::quiet_NaN()); };
    CHECK(std::abs(find_root(0.4, 0.064 - 0.125, 0.6, 0.216 - 0.125, cubic).value - 0.5) <= 1e-9);
    // p^2 = 2 from 1 to 2: the chord meets zero at 4/3, Newton's step from there is 1/12.
    const auto square = [](const double p) { return std::make_pair(p * p - 2, 2 * p); };
    const Root root =
        find_root(1, -1, 2, 2, square, [](const double, const double step) { return step < 0.1; });
    CHECK(root.iterations == 1);
    CHECK(std::abs(root.accuracy - 1. / 12) <= 1e-15);
    CHECK(std::abs(root.value - 17. / 12) <= 1e-15);
  }

  TEST_CASE("find_root: ends that are roots, and intervals without one")
  {
    const auto line = [](const double p) { return std::make_pair(p - 1, 1.); };
    CHECK(!find_root(2, 3, line));
    CHECK(find_root(1, 3, line)->iterations == 0);
    CHECK(find_root(1, 3, line)->value == 1);
    // 1e-12 beside a root: taken with one step of Newton's method.
    CHECK(std::abs(find_root(0, 1 - 1e-12, line)->value - 1) <= 1e-15);
    CHECK(std::abs(find_root(0, 3, line)->value - 1) <= 1e-15);
  }
} // namespace squeal::tests::find_root_tests
