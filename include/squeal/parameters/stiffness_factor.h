#pragma once

#include <complex>
#include <functional>
#include <string>
#include <vector>

namespace squeal
{
  /// By what factor the relaxed stiffness of a material is larger for motions exp(l t), and out of
  /// phase (theory.md, section 12): hysteresis, relaxation (Prony) and a fractional Zener element
  /// side by side,
  ///     f(l) = 1 + i eta + sum_k g_k l tau_k / (1 + l tau_k) + (c - 1) z / (1 + z),  z = (l
  ///     tau)^a,
  /// for Im l > 0, principal branch; f(conj(l)) = conj(f(l)). On the real axis, where f jumps,
  /// there is no hysteresis. f is analytic elsewhere but at the negative real l.
  struct StiffnessFactor
  {
    double loss_factor = 0; ///< eta, -

    struct Relaxation
    {
      double strength; ///< g, part of the relaxed stiffness, -
      double time;     ///< tau, s
    };
    std::vector<Relaxation> prony;

    struct FractionalZener
    {
      double ratio = 1; ///< c, of glassy to relaxed stiffness, -
      double time  = 0; ///< tau, s
      double order = 1; ///< a, -
    } zener;

    /// Whether f is not 1.
    bool is_active() const
    {
      return loss_factor != 0 || !prony.empty() || zener.ratio != 1;
    }
    std::complex<double> operator()(std::complex<double> l) const;
    /// f'(l).
    std::complex<double> derivative(std::complex<double> l) const;
    /// One of its constants, as the keys name them, and the derivative of f by it, for Im l >= 0.
    struct Constant
    {
      std::string name;
      double value;
      std::function<std::complex<double>(std::complex<double>)> derivative;
    };
    std::vector<Constant> constants() const;
    /// (f(l) - f(m)) / (l - m), f'(l) where both are equal to rounding.
    std::complex<double> quotient(std::complex<double> l, std::complex<double> m) const;
  };
} // namespace squeal
