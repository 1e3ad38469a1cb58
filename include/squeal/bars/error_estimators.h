#pragma once

#include <squeal/assessment/error_bounds.h>
#include <squeal/model/brake_model.h>
#include <squeal/projection/eigenpairs.h>

#include <complex>
#include <vector>

namespace squeal
{
  /// What the discretisation does to the eigenvalues of a set of modes.
  struct EigenvalueErrors
  {
    ErrorBounds bounds;
    ErrorEffects effects; ///< of which the bounds are made
    /// The modes' own parts of the correction, without coupling: for each cell of this rank, in the
    /// order of the mesh, one number per mode.
    std::vector<std::vector<std::complex<float>>> cells;
  };

  /// Dual-weighted residuals of right and left vectors (theory.md, section 6) in the space of one
  /// degree more on the same mesh, V+ = V_h + W.
  ///
  /// Elimination of W from the enriched problem, projected on the modes of the window, leaves
  ///     T_ij = z_i^H Q+(l_j) x_j - rho_i^H B r_j,   r_j = Q+(l_j) x_j,   rho_i = Q+(l_i)^H z_i,
  /// where B approximates the inverse of Q+ on W: problems on single cells, in the hierarchical
  /// complement of V_h (Bank and Weiser 1985), with what residuals on faces there are divided
  /// between the cells that share them, in proportion to their stiffness there. With z_i^H Q'(l_i)
  /// x_i = 2 l_i, the eigenvalues of
  ///     l_i delta_ij - T_ij / (2 l_i)
  /// are the corrected ones: of second order in the errors of the vectors, coupling of
  /// near-coincident modes and square-root behaviour included (bound_errors()).
  ///
  /// Contact enters through its own terms on V+, paired anew, with the area in contact that it has;
  /// the pads' local problems hold the contact pressure, the rotor's see it as a given traction.
  /// The residuals have all terms of the equations of motion, the geometric stiffness of the static
  /// stress included; local problems leave that out, and what the stress's own error does: both are
  /// of the size of the static strain.
  ///
  /// With a computed steady pressure the correction contains where the edge of contact is, the
  /// bounds how well that is known (contact_edge.h), and the effect of the pressure's own error.
  /// Collective.
  template <int dim>
  EigenvalueErrors estimate_errors(const BrakeModel<dim> &model, const EigenPairs &modes);
} // namespace squeal
