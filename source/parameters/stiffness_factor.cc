#include <squeal/parameters/stiffness_factor.h>

#include <cmath>

namespace squeal
{
  using Complex = std::complex<double>;

  Complex StiffnessFactor::operator()(const Complex l) const
  {
    if (l.imag() < 0)
      return std::conj((*this)(std::conj(l)));
    Complex f(1, l.imag() > 0 ? loss_factor : 0.);
    for (const Relaxation &element : prony)
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
    Complex slope = 0;
    for (const Relaxation &element : prony)
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
