#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/parameters/stiffness_factor.h>

#include <complex>
#include <vector>

namespace squeal::tests::stiffness_factor_tests
{
  using Complex = std::complex<double>;

  namespace
  {
    StiffnessFactor all_kinds()
    {
      StiffnessFactor factor;
      factor.loss_factor = 0.06;
      factor.prony       = {{0.2, 3e-4}, {0.3, 4e-5}};
      factor.zener       = {20, 1e-6, 0.6};
      return factor;
    }

    const std::vector<Complex> places = {
        {0, 3e3}, {-500, 2e4}, {200, 4e4}, {-3e4, 1e4}, {10, -7e3}};
  } // namespace

  TEST_CASE("stiffness_factor: each element against its formula")
  {
    const Complex l(-100, 2e4);
    StiffnessFactor factor;
    CHECK(!factor.is_active());
    CHECK(factor(l) == 1.);

    factor.loss_factor = 0.06;
    CHECK(factor(l) == Complex(1, 0.06));
    CHECK(factor(std::conj(l)) == Complex(1, -0.06));
    CHECK(factor(-10.) == 1.); // no hysteresis without oscillation

    // One Prony element at l = i / tau: half of its strength, half of it out of phase.
    factor       = {};
    factor.prony = {{0.4, 1e-3}};
    CHECK(std::abs(factor(Complex(0, 1e3)) - Complex(1.2, 0.2)) <= 1e-15);

    // (1 + c z) / (1 + z) at z = sqrt(i): (1 + c z)(1 + conj(z)) / |1 + z|^2 with z = (1 +
    // i)/sqrt 2.
    factor          = {};
    factor.zener    = {5, 1e-3, 0.5};
    const Complex z = Complex(1, 1) / std::sqrt(2.);
    CHECK(std::abs(factor(Complex(0, 1e3)) - (1. + 5. * z) / (1. + z)) <= 1e-14);
  }

  TEST_CASE("stiffness_factor: relaxed and glassy limits, conjugate symmetry")
  {
    const StiffnessFactor factor = all_kinds();
    const double hysteresis      = factor.loss_factor;
    // |z| = 1e-12^0.6
    CHECK(std::abs(factor(Complex(0, 1e-6)) - Complex(1, hysteresis)) <= 20 * std::pow(1e-12, 0.6));
    CHECK(factor(0.) == 1.);
    CHECK(std::abs(factor(Complex(0, 1e40)) - Complex(1 + 0.5 + 19, hysteresis)) <= 1e-9);
    for (const Complex &l : places)
    {
      CHECK(factor(std::conj(l)) == std::conj(factor(l)));
      CHECK(factor.derivative(std::conj(l)) == std::conj(factor.derivative(l)));
      CHECK(std::abs(factor.quotient(std::conj(l), std::conj(places[0])) -
                     std::conj(factor.quotient(l, places[0]))) <= 1e-20);
    }
  }

  TEST_CASE("stiffness_factor: derivative and quotient")
  {
    const StiffnessFactor factor = all_kinds();
    for (const Complex &l : places)
      for (const Complex direction : {Complex(1), Complex(0, 1)}) // f is analytic
      {
        const Complex step     = 1e-5 * std::abs(l) * direction,
                      quotient = (factor(l + step) - factor(l - step)) / (2. * step),
                      slope    = factor.derivative(l);
        CHECK(std::abs(quotient - slope) <= 1e-8 * std::abs(slope));
        // Both branches of the quotient agree where they meet.
        const Complex near = l + 0.99e-5 * std::abs(l) * direction,
                      far  = l + 1.01e-5 * std::abs(l) * direction;
        CHECK(std::abs(factor.quotient(l, near) - factor.quotient(l, far)) <=
              1e-5 * std::abs(slope));
        CHECK(std::abs(factor.quotient(l, far) - factor.quotient(far, l)) <=
              1e-9 * std::abs(slope));
      }
  }

  TEST_CASE("stiffness_factor: derivatives by its constants")
  {
    StiffnessFactor factor    = all_kinds();
    double *const constants[] = {&factor.loss_factor,   &factor.prony[0].strength,
                                 &factor.prony[0].time, &factor.prony[1].strength,
                                 &factor.prony[1].time, &factor.zener.ratio,
                                 &factor.zener.time,    &factor.zener.order};
    const auto derivatives    = factor.constants();
    REQUIRE(derivatives.size() == 8);
    for (unsigned int k = 0; k < 8; ++k)
    {
      const double value = *constants[k], step = 1e-5 * value;
      CHECK(derivatives[k].value == value);
      for (const Complex &l : places)
      {
        if (l.imag() < 0)
          continue;
        *constants[k]          = value + step;
        const Complex plus     = factor(l);
        *constants[k]          = value - step;
        const Complex quotient = (plus - factor(l)) / (2 * step),
                      slope    = derivatives[k].derivative(l);
        *constants[k]          = value;
        CHECK(std::abs(quotient - slope) <= 1e-8 * std::abs(slope) + 1e-10 / value);
      }
    }
  }
} // namespace squeal::tests::stiffness_factor_tests
