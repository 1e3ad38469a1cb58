#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/base/errors.h>
#include <squeal/parameters/parameters.h>

#include <cmath>

namespace squeal::tests::sampling_parameters_tests
{
  namespace
  {
    using Parameters::Sampling;

    Sampling sampling(const std::string &parameters, const std::string &correlation = "")
    {
      Sampling result;
      result.parameters  = parameters;
      result.correlation = correlation;
      return result;
    }

    const std::string mu = "Contact/Friction/Coefficient", pressure = "Pads/Pressure";

    std::string error_of(const Sampling &settings)
    {
      return message_of<InputError>([&]() { settings.check(); });
    }
  } // namespace

  TEST_SUITE("sampling parameters")
  {
    TEST_CASE("distributions: quantiles of each kind; keys with blanks")
    {
      const auto all =
          sampling(mu + " uniform 0.3 0.6; Pads/Material/Young modulus normal 1e10 1e9;" +
                   "Pads/Pressure lognormal 1e6 0.2; Operation/Angular velocity "
                   "table 1:0 3:0.5 4:1")
              .distributions();
      REQUIRE(all.size() == 4);
      CHECK(all[0].parameter == mu);
      CHECK(all[1].parameter == "Pads/Material/Young modulus");
      CHECK(all[3].parameter == "Operation/Angular velocity");
      CHECK(all[0].quantile(0.25) == doctest::Approx(0.375));
      CHECK(all[1].quantile(0.5) == doctest::Approx(1e10));
      CHECK(all[1].quantile(0.975) == doctest::Approx(1e10 + 1.959964e9));
      CHECK(all[2].quantile(0.5) == doctest::Approx(1e6));
      CHECK(all[2].quantile(0.025) == doctest::Approx(1e6 * std::exp(-0.2 * 1.959964)));
      for (const auto &[probability, value] :
           std::vector<std::pair<double, double>>{{1e-9, 1}, {0.25, 2}, {0.5, 3}, {0.75, 3.5}})
        CHECK(all[3].quantile(probability) == doctest::Approx(value));
      CHECK(all[3].quantile(1 - 1e-12) <= 4);
    }

    TEST_CASE("correlation: its factor")
    {
      const auto l =
          sampling(mu + " uniform 0 1; " + pressure + " normal 1e6 1e5", "1, 0.6; 0.6, 1")
              .correlation_factor();
      CHECK(l[0][0] == 1);
      CHECK(l[0][1] == 0);
      CHECK(l[1][0] == doctest::Approx(0.6));
      CHECK(l[1][1] == doctest::Approx(0.8));
    }

    TEST_CASE("refused: what, and what is allowed")
    {
      const std::string two = mu + " uniform 0 1; " + pressure + " normal 1e6 1e5";
      const std::vector<std::pair<Sampling, std::string>> cases = {
          {sampling(mu + " 0.3 0.6"), "no distribution; allowed is a key and uniform"},
          {sampling(mu + " uniform 0.6 0.3"), "the lower bound must be below the upper one"},
          {sampling(mu + " uniform 0.6"), "1 numbers; allowed are two"},
          {sampling(mu + " normal 0.6 0"), "the standard deviation must be positive"},
          {sampling(mu + " normal 0.6 x"), "'x' is not a number"},
          {sampling(mu + " normal 0.6 nan"), "'nan' is not a number"},
          {sampling(mu + " lognormal -1 0.1"), "the median must be positive"},
          {sampling(mu + " table 0.3 0.6:1"), "'0.3' is no value:probability"},
          {sampling(mu + " table 0.3:0 0.6:0.9"), "must rise, these from 0 to 1"},
          {sampling(mu + " table 0.6:0 0.3:1"), "must rise"},
          {sampling(mu + " uniform 0 1; " + mu + " uniform 0 1"), "is named twice"},
          {sampling("Rotor/Thickness uniform 0.01 0.02"), "Rotor/Thickness: samples keep the mesh"},
          {sampling(two, "1, 0.5"), "there must be 2 rows"},
          {sampling(two, "1; 1"), "each row must have 2 numbers"},
          {sampling(two, "1, 0.5; 0.4, 1"), "symmetric with ones on the diagonal"},
          {sampling(two, "2, 0; 0, 1"), "symmetric with ones on the diagonal"},
          {sampling(two, "1, 1; 1, 1"), "not positive definite"},
          {sampling("", "1"), "there are no Sampling/Parameters"}};
      for (const auto &[settings, part] : cases)
      {
        CAPTURE(settings.parameters);
        CAPTURE(settings.correlation);
        CHECK(error_of(settings).find(part) != std::string::npos);
      }
      Sampling with_indices            = sampling(two, "1, 0.5; 0.5, 1");
      with_indices.sensitivity_indices = true;
      CHECK(error_of(with_indices).find("shares of independent numbers") != std::string::npos);
      Sampling from_file = sampling(two);
      from_file.file     = "samples.csv";
      CHECK(error_of(from_file).find("the file names the keys") != std::string::npos);
    }
  }
} // namespace squeal::tests::sampling_parameters_tests
