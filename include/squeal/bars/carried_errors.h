#pragma once

#include <squeal/assessment/stability.h>
#include <squeal/linalg/dense.h>

#include <complex>
#include <optional>
#include <vector>

namespace squeal
{
  /// Modes at one value of a parameter, as far as bars need to know them.
  struct ModesOnCourse
  {
    double value = 0;
    std::vector<std::complex<double>> lambda;
    std::vector<Parity> parity;         ///< of each, or empty
    std::vector<unsigned int> branches; ///< of each
    /// How the modes of the place before turn into these (ModeTracker::transition()).
    ComplexDenseMatrix transition;
  };
  ModesOnCourse on_course(double value, const EigenPairs &modes,
                          const std::vector<unsigned int> &branches,
                          std::vector<std::complex<double>> transition, unsigned int n_before);

  /// Effects that are known of some of the modes of a place.
  struct KnownEffects
  {
    std::vector<unsigned int> modes; ///< their numbers there, ascending
    ErrorEffects effects;
  };

  /// Carries the effects F of the discretisation from a place to the next one or back: in the basis
  /// of its modes, x' = x C, the first-order effect is
  ///     F' = C^{-1} F C.
  /// Modes without a partner on the same branch lose it, all do where C cannot be inverted.
  KnownEffects carry_forward(const KnownEffects &known, const ModesOnCourse &from,
                             const ModesOnCourse &to);
  KnownEffects carry_back(const KnownEffects &known, const ModesOnCourse &from,
                          const ModesOnCourse &to);
  /// (1 - share) a + share b; where only one is known, that.
  KnownEffects blend(const KnownEffects &a, const KnownEffects &b, double share);
  KnownEffects all_known(ErrorEffects effects);
  /// bound_errors() of those of the modes whose effects are known, in the order of known.modes.
  ErrorBounds bound_errors(const KnownEffects &known,
                           const std::vector<std::complex<double>> &lambda,
                           const std::vector<Parity> &parity);

  /// Gives the rows of modes these bounds, and their verdicts with them; returns the bounds.
  ErrorBounds set_bars(std::vector<ModeRow> &rows, const KnownEffects &known,
                       const std::vector<std::complex<double>> &lambda,
                       const std::vector<Parity> &parity, double tolerance);

  /// The effects on the modes of all places of a course, from those at its two ends: carried from
  /// both, and between them linear in the parameter, as the operators nearly are (theory.md,
  /// section 10).
  std::vector<KnownEffects> effects_along(const std::vector<ModesOnCourse> &course,
                                          const ErrorEffects &first, const ErrorEffects &last);

  /// What the discretisation does to a critical value of a parameter.
  struct CriticalBar
  {
    double correction = 0; ///< the value with one degree more, less the computed one
    double error      = 0; ///< a bound
    /// The interval of the value, where other values of a sweep make it shorter.
    std::optional<double> lowest = {}, highest = {};
  };

  /// What becomes critical between two places.
  struct CriticalModes
  {
    unsigned int mode = 0;       ///< its number at the first place
    int other         = -1;      ///< and that of the one it meets, or -1
    std::complex<double> lambda; ///< at the critical value
  };

  /// The bar of a critical value between two places. In the modes of the first one the problem is
  ///     A(p) = A_0 + q A_1 + q^2 A_2 + F, q = (p - p_0)/(p_1 - p_0), A_0 = diag(l_i),
  /// A_1 of the chord, bent through the modes @p at the value itself unless their vectors are
  /// nearly parallel. The bar is how far effects that are as large as in bound_errors() move the
  /// value at which A(p) is critical: where Re l = 0 or, of two modes, ((l_i - l_j)/2)^2 = 0. So
  /// near-coincident modes couple here as they do there, and onsets are not taken for linear where
  /// they begin like a square root. Parts vary by kinds of cells alone, not by modes: two modes
  /// that meet have shapes much alike, and what they have in common leaves them where they meet.
  ///
  /// Nothing if it cannot be known.
  std::optional<CriticalBar> bound_critical_value(const ModesOnCourse &from,
                                                  const ModesOnCourse &at, const ModesOnCourse &to,
                                                  const KnownEffects &at_from,
                                                  const KnownEffects &at_to,
                                                  const CriticalModes &critical);
  /// Bounds a critical value by the eigenvalue's derivative dl/dp = @p slope alone: where there is
  /// no place on one of the sides, and for divergence. Nothing if it cannot be known.
  std::optional<CriticalBar> bound_critical_value(const ModesOnCourse &at,
                                                  const KnownEffects &known, unsigned int mode,
                                                  double slope);
} // namespace squeal
