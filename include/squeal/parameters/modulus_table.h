#pragma once

#include <squeal/parameters/stiffness_factor.h>

namespace squeal
{
  /// Where a data sheet of modulus and loss factor over frequency, and temperature, is to be used.
  struct ModulusTableUse
  {
    std::string key;        ///< of messages
    std::string filename;   ///< frequency_hz, storage_modulus_pa, loss_factor[, temperature_c]
    double relaxed_modulus; ///< Pa: what f is relative to
    double temperature;     ///< deg C
    double lowest, highest; ///< of the window, Hz
  };

  /// Fits to the table, interpolated at the temperature, the factor of a passive material that is
  /// analytic beside the axis,
  ///     f(i w) = 1 + i eta + sum_k g_k i w tau_k / (1 + i w tau_k),   eta, g_k >= 0,
  /// by least squares of the relative errors, with times tau_k at equal distances on a logarithmic
  /// scale from a decade below the table's frequencies to a decade above. Between temperatures
  /// logarithms of moduli and loss factors are linear, between frequencies both over log f.
  ///
  /// Throws InputError: a table that does not cover the window or the temperature, moduli below
  /// the relaxed one, and fits whose largest relative error is above a tenth.
  StiffnessFactor::Fit fit_modulus_table(const ModulusTableUse &use);
} // namespace squeal
