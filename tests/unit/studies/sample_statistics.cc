#include <doctest/doctest.h>

#include <squeal/studies/sample_statistics.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace squeal::tests::sample_statistics_tests
{
  namespace
  {
    constexpr double pi = 3.14159265358979323846;

    /// f = sin x_1 + 7 sin^2 x_2 + 0.1 x_3^4 sin x_1, x_i uniform in (-pi, pi): Ishigami and Homma,
    /// 1990.
    double ishigami(const std::vector<double> &u)
    {
      const auto x = [&](const unsigned int i) { return pi * (2 * u[i] - 1); };
      return std::sin(x(0)) + 7 * std::pow(std::sin(x(1)), 2) +
             0.1 * std::pow(x(2), 4) * std::sin(x(0));
    }

    SensitivityIndices indices_of_ishigami(const unsigned int n, const unsigned int which)
    {
      std::vector<double> at_a, at_b, at_ab;
      for (const std::vector<double> &u : sobol_points(n, 6))
      {
        const std::vector<double> a(u.begin(), u.begin() + 3), b(u.begin() + 3, u.end());
        std::vector<double> ab = a;
        ab[which]              = b[which];
        at_a.push_back(ishigami(a));
        at_b.push_back(ishigami(b));
        at_ab.push_back(ishigami(ab));
      }
      return sensitivity_indices(at_a, at_b, at_ab);
    }
  } // namespace

  TEST_SUITE("sample statistics")
  {
    TEST_CASE("sobol: in the open cube, the centre first, means far better than random ones")
    {
      const unsigned int n = 1024, d = 16;
      const auto points = sobol_points(n, d);
      REQUIRE(points.size() == n);
      for (const double x : points[0])
        CHECK(std::abs(x - 0.5) < 1e-9);
      for (unsigned int i = 0; i < d; ++i)
      {
        double mean = 0;
        std::vector<unsigned int> n_in(16, 0);
        for (const auto &point : points)
        {
          REQUIRE(point[i] > 0);
          REQUIRE(point[i] < 1);
          mean += point[i] / n;
          ++n_in[unsigned(16 * point[i])];
        }
        CHECK(std::abs(mean - 0.5) < 1. / n);
        for (const unsigned int in_stratum : n_in)
          CHECK(std::abs(int(in_stratum) - int(n / 16)) <= 1);
      }
      // x y has the mean 1/4 and the variance 7/144: random points are off by 7e-3.
      double product = 0;
      for (const auto &point : points)
        product += point[d - 2] * point[d - 1] / n;
      CHECK(std::abs(product - 0.25) < 1.5e-3);
    }

    TEST_CASE("share: Wilson's interval, also where no sample or each one is a hit")
    {
      // Wilson's interval of 5 hits of 10 is 0.2366 ... 0.7634; of none of 10 it ends at
      // z^2 / (10 + z^2).
      CHECK(share_of(5, 10).value == 0.5);
      CHECK(share_of(5, 10).error == doctest::Approx(0.26341).epsilon(1e-4));
      const double z2 = 1.959964 * 1.959964;
      CHECK(share_of(0, 10).error == doctest::Approx(z2 / (10 + z2)).epsilon(1e-9));
      CHECK(share_of(10, 10).error == doctest::Approx(z2 / (10 + z2)).epsilon(1e-9));
      CHECK(std::isnan(share_of(0, 0).value));
      // 95 % of the intervals of random samples have the probability in them.
      std::mt19937 random(1);
      for (const double p : {0.02, 0.1, 0.5})
      {
        const unsigned int n_trials = 4000, n = 100;
        std::binomial_distribution<unsigned int> hits(n, p);
        unsigned int n_covered = 0;
        for (unsigned int trial = 0; trial < n_trials; ++trial)
        {
          const Share share = share_of(hits(random), n);
          n_covered += std::abs(share.value - p) <= share.error;
        }
        CHECK(n_covered >= 0.93 * n_trials);
      }
    }

    TEST_CASE("indices: of Ishigami's function")
    {
      const double first[3] = {0.31391, 0.44241, 0}, total[3] = {0.55759, 0.44241, 0.24368};
      for (unsigned int i = 0; i < 3; ++i)
      {
        const SensitivityIndices few  = indices_of_ishigami(512, i),
                                 many = indices_of_ishigami(8192, i);
        CHECK(std::abs(many.first_order.value - first[i]) < 5e-3);
        CHECK(std::abs(many.total.value - total[i]) < 5e-3);
        CHECK(std::abs(few.first_order.value - first[i]) < few.first_order.error + 1e-12);
        CHECK(std::abs(few.total.value - total[i]) < few.total.error + 1e-12);
        CHECK(many.first_order.error < 0.35 * few.first_order.error + 1e-12);
      }
    }

    TEST_CASE("indices: what is not finite is left out, a constant has none")
    {
      const double nan = std::numeric_limits<double>::quiet_NaN();
      const auto whole = sensitivity_indices({1, 2, 3}, {2, 1, 4}, {1.5, 1, 3}),
                 parts =
                     sensitivity_indices({1, nan, 2, 3, 1}, {2, 5, 1, 4, 1}, {1.5, 1, 1, 3, nan});
      CHECK(whole.total.value == parts.total.value);
      CHECK(whole.first_order.error == parts.first_order.error);
      CHECK(std::isnan(sensitivity_indices({1, 1}, {1, 1}, {1, 1}).total.value));
      CHECK(std::isnan(sensitivity_indices({nan}, {1}, {1}).first_order.value));
    }

    TEST_CASE("quantile: interpolated")
    {
      CHECK(quantile_of({3, 1, 2}, 0.5) == 2);
      CHECK(quantile_of({3, 1, 2}, 0.25) == 1.5);
      CHECK(quantile_of({3, 1, 2}, 1) == 3);
      CHECK(quantile_of({4}, 0.05) == 4);
      CHECK(std::isnan(quantile_of({}, 0.5)));
    }
  }
} // namespace squeal::tests::sample_statistics_tests
