#include <squeal/parameters/stiffness_factor.h>

#include <cmath>

namespace squeal
{
  using Complex = std::complex<double>;

  Complex StiffnessFactor::operator()(const Complex l) const
  {
    if (l.imag() < 0)
      return std::conj((*this)(std::conj(l)));
    Complex f = 1. + l * viscosity;
    if (l.imag() > 0)
      f += Complex(0, loss_factor + fit.loss_factor);
    for (const auto *series : {&prony, &fit.prony})
      for (const Relaxation &element : *series)
        f += element.strength * l * element.time / (1. + l * element.time);
    if (zener.ratio != 1 && l != 0.)
    {
      const Complex z = std::pow(l * zener.time, zener.order);
      f += (zener.ratio - 1) * z / (1. + z);
    }
    return f;
  }

  Complex StiffnessFactor::derivative(const Complex l) const
  {
    if (l.imag() < 0)
      return std::conj(derivative(std::conj(l)));
    Complex slope = viscosity;
    for (const auto *series : {&prony, &fit.prony})
      for (const Relaxation &element : *series)
      {
        const Complex one_plus = 1. + l * element.time;
        slope += element.strength * element.time / (one_plus * one_plus);
      }
    if (zener.ratio != 1 && l != 0.)
    {
      // dz/dl = a z / l
      const Complex z = std::pow(l * zener.time, zener.order);
      slope += (zener.ratio - 1) * zener.order * z / (l * (1. + z) * (1. + z));
    }
    return slope;
  }

  std::vector<StiffnessFactor::Constant> StiffnessFactor::constants() const
  {
    std::vector<Constant> result;
    if (loss_factor != 0)
      result.push_back({"Loss factor", loss_factor,
                        [](const Complex l) { return Complex(0, l.imag() > 0 ? 1 : 0); }});
    for (unsigned int k = 0; k < prony.size(); ++k)
    {
      const auto [g, tau]      = prony[k];
      const std::string number = " " + std::to_string(k + 1);
      result.push_back({"Prony series/g" + number, g,
                        [tau = tau](const Complex l) { return l * tau / (1. + l * tau); }});
      result.push_back({"Prony series/tau" + number, tau, [g = g, tau = tau](const Complex l) {
                          return g * l / ((1. + l * tau) * (1. + l * tau));
                        }});
    }
    if (zener.ratio != 1)
    {
      const auto [c, tau, a] = zener;
      const auto z           = [tau = tau, a = a](const Complex l) { return std::pow(l * tau, a); };
      // df/dz
      const auto slope = [c = c, z](const Complex l)
      { return (c - 1) / ((1. + z(l)) * (1. + z(l))); };
      result.push_back(
          {"Fractional Zener/c", c, [z](const Complex l) { return z(l) / (1. + z(l)); }});
      result.push_back({"Fractional Zener/tau", tau, [z, slope, tau = tau, a = a](const Complex l) {
                          return slope(l) * z(l) * a / tau;
                        }});
      result.push_back({"Fractional Zener/a", a, [z, slope, tau = tau](const Complex l) {
                          return slope(l) * z(l) * std::log(l * tau);
                        }});
    }
    return result;
  }

  Complex StiffnessFactor::quotient(const Complex l, const Complex m) const
  {
    // The quotient loses the digits that both have in common; the slope half way is right to the
    // square of their distance.
    constexpr double nearly_equal = 1e-5;
    if (std::abs(l - m) <= nearly_equal * std::abs(l))
      return derivative((l + m) / 2.);
    return ((*this)(l) - (*this)(m)) / (l - m);
  }
} // namespace squeal
