#pragma once

#include <squeal/linalg/dense.h>

#include <vector>

namespace squeal
{
  /// Real modes in coordinates of a span, (K - w^2 M) phi = 0 with unit modal masses.
  struct RealModes
  {
    DenseMatrix coordinates;     ///< of phi, a column a mode
    std::vector<double> squares; ///< w^2, 1/s^2, ascending
  };

  /// Rayleigh-Ritz in a real span of modes, of which @p mass and @p stiffness are the forms: the
  /// lowest ones, at most @p n_modes. Directions of the span that are nothing but rounding, as
  /// imaginary parts of real vectors are, are left out.
  RealModes real_modes(const DenseMatrix &mass, const DenseMatrix &stiffness, unsigned int n_modes);
} // namespace squeal
