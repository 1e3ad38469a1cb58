#pragma once

#include <squeal/model/model.h>
#include <squeal/projection/eigenpairs.h>

#include <optional>

namespace squeal
{
  /// How far damping is from modal. In the real modes phi_i, w_i of the conservative terms, with
  /// unit modal masses, Rayleigh-Ritz in the real span of the modes, it is
  ///     D_ij = phi_i^T C phi_j,
  /// C the symmetric part of material damping, dashpots and a given velocity matrix, and of
  /// relaxation Im f(i w) K / w at w^2 = w_i w_j. The measure is |D - diag D| / |D|, Frobenius'
  /// norms: 0 for modal damping, e.g. one material with Rayleigh damping.
  ///
  /// Nothing without damping, or with less than two modes. @p modes are whole. Collective.
  std::optional<double> non_modal_damping(const Model &model, const EigenPairs &modes);
} // namespace squeal
