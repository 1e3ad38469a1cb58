#pragma once

#include <squeal/eigensolvers.h>

#include <optional>
#include <string>

namespace squeal
{
  /// One line of modes.csv. A value that was not computed is empty.
  struct ModeRow
  {
    unsigned int cycle = 0, mode = 0;
    std::complex<double> lambda;
    std::string verdict; ///< stable, flutter, divergence, marginal, undecided
    std::optional<double> growth_rate_error, frequency_error;
    double backward_error = 0;
    std::optional<double> condition_number;
    double d = 0, g = 0, k = 0, n = 0; ///< Rayleigh coefficients, theory.md section 4

    double growth_rate() const
    {
      return lambda.real();
    }
    double frequency() const
    {
      return std::abs(lambda.imag()) / (2 * M_PI);
    }
    double damping_ratio() const
    {
      return 0. - lambda.real() / std::abs(lambda);
    } // no -0
  };

  /// The verdict on an eigenvalue whose relative error is @p tolerance.
  std::string verdict(std::complex<double> lambda, double tolerance);

  /// Verdicts and Rayleigh coefficients of all modes: with u^H M u = 1,
  ///     d + j g = x^H P x,   k + j n = x^H Q x,
  /// x holding the multipliers too: u^H N Lambda vanishes by the constraint, so k and n are those
  /// of the displacements and the friction.
  std::vector<ModeRow> analyse(const QuadraticEigenproblem &problem, const Modes &modes,
                               unsigned int cycle, double tolerance);

  /// For every mode of @p fine the index of the mode of @p coarse that belongs to it, or -1 if
  /// there is none left: the assignment with the least sum of squared distances of the eigenvalues.
  /// (A common shift of all modes by the mesh does not confuse it, as it would a search for the
  /// nearest.)
  std::vector<int> match_modes(const std::vector<ModeRow> &fine,
                               const std::vector<ModeRow> &coarse);
} // namespace squeal
