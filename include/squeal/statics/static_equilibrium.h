#pragma once

#include <squeal/equations/sector.h>
#include <squeal/projection/search_space.h>
#include <squeal/statics/contact_edge.h>
#include <squeal/statics/direct_statics.h>
#include <squeal/statics/iterative_statics.h>
#include <squeal/statics/self_locking.h>

#include <functional>
#include <limits>
#include <optional>
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

  /// What states that followed one another span, X, and what the bodies' matrices make of it: they
  /// stay when their coefficients change.
  struct StateSpace
  {
    SearchSpace basis;                  ///< X
    PerMatrix<DenseMatrix> projections; ///< X^T A_i X
  };

  struct StaticEquilibrium
  {
    MultiVector state; ///< one column, contact pressures in the multipliers' rows
    std::vector<StaticIteration> iterations;
    ContactPressure pressure; ///< of the state, Pa, at the contact's quadrature points
    ContactEdge edge;         ///< on demand
    StateSpace space; ///< spanned by the states that this one followed; empty for a first state
    /// Upper bound of the part of `state` outside `space`, relative to its length.
    double beyond_space = std::numeric_limits<double>::infinity();
  };

  /// The largest difference of two pressures by the largest of the second. Collective.
  double relative_change(const ContactPressure &before, const ContactPressure &after,
                         MPI_Comm comm);

  /// What a static equilibrium is asked for.
  struct StaticProblem
  {
    std::vector<Term> body_terms; ///< only those of order 0 are used
    bool with_friction;
    MultiVector load;
    bool with_edge = false; ///< asks for StaticEquilibrium::edge
    /// Largest last correction, relative to its length, of a state that follows another one.
    double tolerance = 1e-12;
    /// Asked for the sectors of the mesh where the state is factorised for. Empty: the whole is the
    /// only one.
    std::function<Sectors()> find_sectors = {};

    Sectors sectors() const
    {
      return find_sectors ? find_sectors() : Sectors();
    }
  };

  /// The gain of friction on the contact pressure at the present active set.
  template <int dim>
  SelfLocking self_locking(const RowRange &rows, const std::vector<Term> &body_terms,
                           const Contact<dim> &contact, const ContactPressure &pressure);

  /// Finds the steady sliding state of theory.md, section 3: p >= 0, g <= 0, p g = 0 with friction
  /// in full sliding,
  ///     sum_{order 0} c_i A_i q_0 + (N + mu T) Lambda_0 = f,
  /// by new factors (DirectStatics). Primal-dual active set (a semi-smooth Newton method,
  /// Hintermueller, Ito, Kunisch 2002); a friction law that depends on the pressure is linearised
  /// in the same steps. The operator is not symmetric because of friction. @p contact comes with
  /// the first active set and leaves with that of the solution; if one with released contacts leads
  /// nowhere, everything touches at first.
  ///
  /// Throws SolverError if a pad loses all contact, and if active sets repeat or the tangent is
  /// singular; with friction it then tells whether that is self-locking.
  template <int dim>
  StaticEquilibrium solve_static_equilibrium(const StaticProblem &problem, Contact<dim> &contact);

  /// Finds the steady sliding state by an iterative solver, without factors and without the bodies'
  /// matrices. Throws SolverError.
  template <int dim>
  StaticEquilibrium solve_static_equilibrium(IterativeStatics<dim> &solver,
                                             const StaticProblem &problem, Contact<dim> &contact);

  /// Follows an equilibrium nearby from its active set on, without a factorisation and with no
  /// matrix but those of the contact: in the space X that earlier states and their corrections
  /// span,
  ///     x = X c,   X^T (f - A x) = 0,
  /// with the active set that belongs to it; then X gets the correction B (f - A x), B ~ A^{-1} the
  /// products @p nearby, until that is small. Returns nothing if it does not become so; @p contact
  /// is then to be closed again. The contact's matrices are made by @p matrices.
  template <int dim>
  std::optional<StaticEquilibrium>
  follow_static_equilibrium(StaticEquilibrium before, const LinearOperator &nearby,
                            const StaticProblem &problem, Contact<dim> &contact,
                            ContactMatrices<dim> &matrices);

  /// Follows an equilibrium nearby from its active set on, by factors that serve it
  /// (DirectStatics::serves). Returns nothing if no state is found; @p contact is then to be closed
  /// again.
  template <int dim>
  std::optional<StaticEquilibrium> follow_static_equilibrium(DirectStatics<dim> &solver,
                                                             const StaticProblem &problem,
                                                             Contact<dim> &contact);
} // namespace squeal
