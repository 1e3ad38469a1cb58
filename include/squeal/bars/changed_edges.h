#pragma once

#include <squeal/equations/equations_of_motion.h>
#include <squeal/projection/eigenpairs.h>
#include <squeal/statics/contact_edge.h>

#include <complex>
#include <vector>

namespace squeal
{
  /// One other edge of a contact: multipliers that release, R of ContactEdge, or close, C.
  struct EdgeChange
  {
    bool opens;
    std::vector<unsigned int> rows;
    DenseMatrix directions; ///< D, orthonormal: R releases in these; of C the unit matrix
  };

  /// Solves the small problem of each change (theory.md, section 6): a contact that touches in a
  /// few nodes is another system with one node less or more, and what that does to an eigenvalue is
  /// larger than first order can tell. With A the position terms, the static answers
  ///     Y = A^{-1} E_R D,   S = D^T E_R^T Y,   v = D^T x_R   where R releases,
  ///     Y = A^{-1} a,       S = b Y - c,       v = b x       where C closes (ContactEdge),
  /// and the modes X and Z of the window, X' = X - Y S^+ v satisfies the conditions of the changed
  /// contact, Z' likewise with A^T, and
  ///     (l^2 Z'^H M X' + l Z'^H P X' + Z'^H Q X') y = 0
  /// has the changed eigenvalues: with the inertia of the answers and the coupling of the modes. To
  /// first order they are those of edge_effects(). What relaxes is taken at the eigenvalue before.
  ///
  /// Returns F, column-major, for each change: diag(l) + F has the changed eigenvalues with the
  /// coefficients y of their vectors. Throws SolverError if A cannot be factorised. Collective.
  std::vector<std::vector<std::complex<double>>>
  effects_of_changes(const std::vector<EdgeChange> &changes, const ContactEdge &edge,
                     const EquationsOfMotion &equations, const EigenPairs &modes);

  /// What other edges of a contact between bodies that do not slide make of the eigenvalues.
  struct ChangedEdge
  {
    unsigned int interface;
    std::vector<std::complex<double>> opening, closing; ///< F; zero where nothing changes
  };

  /// All contacts between bodies that do not slide, by interface, each changed alone.
  ///
  /// One that touches only beside its edge would be empty without R. It bears its load all the
  /// same: pressures, and tractions, keep to the proportion of the static pressures, and R releases
  /// in the directions across that. Where that leaves none, in one node, a smaller contact is taken
  /// to change as much as a larger one. Collective.
  template <int dim>
  std::vector<ChangedEdge>
  changed_edges(const ContactEdge &edge, const Contact<dim> &contact, const MultiVector &state,
                const EquationsOfMotion &equations, const EigenPairs &modes);

  /// The edge of the contacts that slide alone: first-order effects of the others are zero.
  template <int dim>
  ContactEdge sliding_edge(const ContactEdge &edge, const Contact<dim> &contact);
} // namespace squeal
