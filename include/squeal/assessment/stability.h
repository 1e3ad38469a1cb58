#pragma once

#include <squeal/assessment/error_bounds.h>
#include <squeal/assessment/mode_shapes.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/model/model.h>

#include <array>
#include <optional>
#include <string>

namespace squeal
{
  /// marginal: neither grows nor decays, up to rounding. undecided: the error bar straddles zero.
  SQUEAL_CHOICE(Verdict, stable, flutter, divergence, marginal, undecided)

  /// One line of modes.csv. A value that was not computed is empty.
  struct ModeRow
  {
    unsigned int cycle = 0, mode = 0;
    std::complex<double> lambda;
    Verdict verdict = Verdict::stable;
    std::optional<double> growth_rate_error, frequency_error;
    /// The eigenvalue with the estimated discretisation error taken off.
    std::optional<std::complex<double>> corrected;
    double backward_error = 0;
    std::optional<double> condition_number;
    double left_backward_error = 0;
    double d = 0, g = 0, k = 0, n = 0; ///< Rayleigh coefficients, theory.md section 4
    /// |l - the nearer root of (31)|/|l|: a check of every matrix at once.
    double rayleigh_defect = 0;
    /// k d^2 + n d g - n^2 of criterion (34), 1/s^4: with d > 0 both roots of (31) are stable iff
    /// it is positive.
    double criterion = 0;
    Parity parity    = Parity::none;
    std::optional<ModeShape> shape; ///< of bodies that turn

    bool is_unstable() const
    {
      return verdict == Verdict::flutter || verdict == Verdict::divergence;
    }
    /// Empty where the error is not known.
    std::optional<double> corrected_growth_rate() const
    {
      return corrected ? std::optional<double>(corrected->real()) : std::nullopt;
    }
    std::optional<double> corrected_frequency() const
    {
      return corrected ? std::optional<double>(std::abs(corrected->imag()) / (2 * M_PI))
                       : std::nullopt;
    }
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

  /// What the algebra leaves open of an eigenvalue, 1/s: its backward error, at least that of
  /// rounded matrices, times its condition number.
  double algebraic_error(std::complex<double> lambda, double backward_error, double condition);

  /// No eigenvalue is known better than to this part of it: rounding of sums of some thousand
  /// terms.
  constexpr double smallest_tolerance = 1e-12;

  /// The verdict on an eigenvalue that the solver knows to the relative error @p tolerance and
  /// whose growth rate discretisation or conditioning bound to @p growth_rate_error, 1/s: undecided
  /// where that straddles zero, marginal where both errors are rounding.
  Verdict verdict(std::complex<double> lambda, double tolerance, double growth_rate_error = 0);

  /// Verdicts and Rayleigh coefficients of all modes: with u^H M u = 1,
  ///     d + j g = x^H P x,   k + j n = x^H Q x,
  /// x holding the multipliers too: u^H N Lambda vanishes by the constraint, so k and n are those
  /// of the displacements and the friction.
  std::vector<ModeRow> analyse(const QuadraticEigenproblem &problem, const EigenPairs &modes,
                               unsigned int cycle, double tolerance);

  /// Analyses modes whose forms x^H P x and x^H Q x are given, one number for each mode.
  std::vector<ModeRow> analyse(const EigenPairs &modes,
                               const std::vector<std::complex<double>> &of_p,
                               const std::vector<std::complex<double>> &of_q, unsigned int cycle,
                               double tolerance);

  /// The parts of x^H P x = d + j g and x^H Q x = k + j n of all modes by origin and body.
  struct RayleighParts
  {
    std::vector<Origin> origins;
    std::vector<std::string> bodies;
    unsigned int n_modes = 0;
    std::vector<std::array<double, 4>> parts; ///< d, g, k, n

    std::array<double, 4> &at(const unsigned int origin, const unsigned int body,
                              const unsigned int mode)
    {
      return parts[(origin * bodies.size() + body) * n_modes + mode];
    }
    const std::array<double, 4> &at(const unsigned int origin, const unsigned int body,
                                    const unsigned int mode) const
    {
      return parts[(origin * bodies.size() + body) * n_modes + mode];
    }
  };
  /// Each matrix of the model is multiplied once. Collective.
  RayleighParts rayleigh_parts(const Model &model, const EigenPairs &modes);

  /// Verdicts and Rayleigh coefficients with these parts.
  std::vector<ModeRow> analyse(const RayleighParts &parts, const EigenPairs &modes,
                               unsigned int cycle, double tolerance);

  /// What one kind of term in one body does to one mode.
  struct Contribution
  {
    unsigned int mode;
    std::string origin, body;
    double d = 0, g = 0, k = 0, n = 0; ///< parts of the Rayleigh coefficients
    /// The part of the growth rate, 1/s. The imaginary part of (30) with l = rho + j w,
    ///     2 rho w + d w + g rho + n = 0,
    /// makes rho the sum of -(d w + n)/(2 w + g) over all terms. Without oscillation, w = 0, the
    /// real part, rho^2 + d rho + k = 0, makes it the sum of -(d + k/rho).
    double growth_rate = 0;
    /// Work per cycle on the mode of unit modal mass, -pi (d w + n), J: positive feeds energy in;
    /// zero without cycles.
    double energy = 0;
  };

  /// The Rayleigh coefficients split by origin and body: why a mode grows or decays.
  std::vector<Contribution> contributions(const RayleighParts &parts, const EigenPairs &modes,
                                          const std::vector<ModeRow> &rows);

  /// Gives a mode, the j-th of these bounds, its corrected value, its bars and the verdict with
  /// them. What the algebra leaves open is added.
  void set_bar(ModeRow &row, const ErrorBounds &bars, unsigned int j, double tolerance);

  /// What is known of the modes of a mesh: verdicts, and why.
  struct ModeTable
  {
    std::vector<ModeRow> rows;
    std::vector<Contribution> contributions;
  };
  /// @p bars are of these modes, or empty where the discretisation is not judged. Collective.
  ModeTable assess_stability(const Model &model, const EigenPairs &modes, unsigned int cycle,
                             double tolerance, const ErrorBounds &bars = {});

  /// The index of the mode that grows fastest or decays slowest.
  unsigned int least_stable(const std::vector<ModeRow> &rows);

  /// dl/dp of every mode, from left and right vectors: with z^H Q'(l) x = 2 l,
  ///     dl/dp = -z^H (sum_i dc_i/dp A_i l^order_i) x / (2 l).
  std::vector<std::complex<double>> sensitivities(const ParameterDerivative &derivative,
                                                  const EigenPairs &modes);

  /// The roots of (30), l^2 + (d + j g) l + k + j n = 0.
  std::array<std::complex<double>, 2> rayleigh_roots(double d, double g, double k, double n);

  /// For every row of a cost matrix its column in the assignment with the least sum, or -1 if none
  /// of the @p n_columns is left for it.
  std::vector<int> assign(const std::vector<std::vector<double>> &costs, unsigned int n_columns);

  /// For every mode of @p fine the index of the mode of @p coarse that belongs to it, or -1 if
  /// there is none left: the assignment with the least sum of squared distances of the eigenvalues,
  /// or of the corrected ones where both are known. (A common shift of all modes by the mesh does
  /// not confuse it, as it would a search for the nearest.)
  std::vector<int> match_modes(const std::vector<ModeRow> &fine,
                               const std::vector<ModeRow> &coarse);
} // namespace squeal
