#pragma once

#include <squeal/bars/enriched_residuals.h>

namespace squeal
{
  /// What one degree more adds to the static state, in V+ = V_h + W: the local problems' answer to
  /// its residual, w in W, and what V_h answers to that,
  ///     x+ - x_h = w + P v,    A v = -P^T A+ w,
  /// with the tangents A and A+ of theory.md, section 3, at the present contacts, and P the
  /// interpolation. Without v the pressures of w would not be in equilibrium with the load: what
  /// they do to the modes is some hundred times too large then.
  ///
  /// @p local is w. The rotor is held in A, whose rest is factorised
  /// (BrakeModel::static_response()). Collective; throws SolverError.
  template <int dim>
  MultiVector static_correction(const BrakeModel<dim> &model,
                                const EnrichedResiduals<dim> &residuals, MultiVector local);
} // namespace squeal
