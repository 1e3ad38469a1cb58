#pragma once

#include <complex>
#include <functional>
#include <string>
#include <vector>

namespace squeal
{
  /// By what factor the relaxed stiffness of a material is larger for motions exp(l t), and out of
  /// phase (theory.md, section 12): hysteresis, relaxation (Prony), a fractional Zener element and
  /// a dashpot side by side,
  ///     f(l) = 1 + i eta + sum_k g_k l tau_k / (1 + l tau_k) + (c - 1) z / (1 + z) + l theta,
  ///     z = (l tau)^a,
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

    /// What was fitted to a table (modulus_table.h), eta and a Prony series beside the others.
    struct Fit
    {
      double loss_factor = 0;
      std::vector<Relaxation> prony;
      std::string filename; ///< of the table; empty: none
      double error = 0;     ///< the largest one, relative
    } fit;

    double viscosity = 0; ///< theta, s. No key has it: Rayleigh's beta is a term of its own.

    /// Whether f is not 1.
    bool is_active() const
    {
      return loss_factor != 0 || viscosity != 0 || !prony.empty() || zener.ratio != 1 ||
             fit.loss_factor != 0 || !fit.prony.empty();
    }
    std::complex<double> operator()(std::complex<double> l) const;
    /// f'(l).
    std::complex<double> derivative(std::complex<double> l) const;
    /// One of its constants, as the keys name them (those of a fit have none), and the derivative
    /// of f by it, for Im l >= 0.
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
