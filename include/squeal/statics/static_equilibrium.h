#pragma once

#include <squeal/statics/contact_edge.h>
#include <squeal/statics/direct_statics.h>
#include <squeal/statics/iterative_statics.h>
#include <squeal/statics/self_locking.h>
#include <squeal/symmetry/mirror.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace squeal
{
  /// One step of the active-set iteration.
  struct StaticIteration
  {
    unsigned int n_active, n_changed; ///< multipliers (mortar) or quadrature points (penalty)
    double largest_tension;           ///< of what was closed, Pa
    double largest_penetration;       ///< of what was open, m
    double pressure_change;           ///< largest change of the pressure relative to its maximum
    unsigned int n_linear;            ///< steps of GMRES; 0: a direct solver
  };

  /// What states that followed one another span, and what the bodies make of it.
  struct StateSpace
  {
    MultiVector basis;  ///< orthonormal
    MultiVector images; ///< sum of the bodies' position terms times the basis
    KnownTerms terms;   ///< these
  };

  struct StaticEquilibrium
  {
    MultiVector state; ///< one column, contact pressures in the multipliers' rows
    std::vector<StaticIteration> iterations;
    typename std::vector<std::vector<double>> pressure; ///< Contact::Pressure of the state
    ContactEdge border;                                 ///< on demand
    StateSpace space;                                   ///< of those before it, if it followed them
  };

  /// The tangent of the static problem at fixed active set: the body terms of order 0, N, and with
  /// friction d tau/dp at the given pressure.
  template <int dim>
  Matrix static_tangent(const RowRange &rows, const std::vector<Term> &body_terms,
                        const Contact<dim> &contact,
                        const typename Contact<dim>::Pressure &pressure, bool with_friction);

  /// The gain of friction on the contact pressure at the present active set.
  template <int dim>
  SelfLocking self_locking(const RowRange &rows, const std::vector<Term> &body_terms,
                           const Contact<dim> &contact,
                           const typename Contact<dim>::Pressure &pressure);

  /// The steady sliding state of theory.md, section 3: p >= 0, g <= 0, p g = 0 with friction in
  /// full sliding,
  ///     sum_{order 0} c_i A_i q_0 + (N + mu T) Lambda_0 = f.
  /// Primal-dual active set (a semi-smooth Newton method, Hintermueller, Ito, Kunisch 2002); a
  /// friction law that depends on the pressure is linearised in the same steps. The operator is not
  /// symmetric because of friction; DirectStatics solves with it. @p contact leaves with the active
  /// set of the solution. @p with_border: for error bars. @p symmetry of the mesh: what is
  /// symmetric is solved for by halves.
  ///
  /// Throws SolverError if a pad loses all contact, and if active sets repeat or the tangent is
  /// singular; with friction it then tells whether that is self-locking.
  template <int dim>
  StaticEquilibrium
  solve_static_equilibrium(const RowRange &rows, const std::vector<Term> &body_terms,
                           Contact<dim> &contact, bool with_friction, const MultiVector &load,
                           bool with_border                              = false,
                           const std::optional<MirrorSymmetry> &symmetry = std::nullopt);

  /// The same with an iterative solver, without factors and without the bodies' matrices.
  template <int dim>
  StaticEquilibrium solve_static_equilibrium(IterativeStatics<dim> &solver, Contact<dim> &contact,
                                             bool with_friction, const MultiVector &load);

  /// The same out of the state and the active set of an equilibrium nearby, by GMRES with factors
  /// of a matrix nearby: no factorisation, no matrix but those of the contact. It begins with the
  /// combination of earlier states that satisfies the equations best. Nothing if that does not
  /// converge; @p contact is then to be closed again.
  template <int dim>
  std::optional<StaticEquilibrium>
  follow_static_equilibrium(StaticEquilibrium before, const LinearOperator &nearby,
                            const std::vector<Term> &body_terms, Contact<dim> &contact,
                            bool with_friction, const MultiVector &load);

  /// The same out of the active set of an equilibrium nearby, by factors that serve it
  /// (DirectStatics::serves). Nothing if there is none; @p contact is then to be closed again.
  template <int dim>
  std::optional<StaticEquilibrium>
  follow_static_equilibrium(DirectStatics<dim> &solver, Contact<dim> &contact, bool with_friction,
                            const MultiVector &load);
} // namespace squeal
