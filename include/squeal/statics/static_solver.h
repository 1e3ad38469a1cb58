#pragma once

#include <squeal/parameters/parameters.h>
#include <squeal/statics/static_equilibrium.h>
#include <squeal/statics/wear_steps.h>
#include <squeal/statics/worn_pressure.h>

#include <memory>
#include <optional>
#include <vector>

namespace squeal
{
  /// The steady sliding state about which the equations of motion are linearised, with all that a
  /// linearisation depends on.
  template <int dim>
  struct SteadyState
  {
    Parameters::All parameters;                   ///< at which it was found
    std::vector<Term> body_terms;                 ///< of order 0; none without matrices
    std::optional<Contact<dim>> contact;          ///< with the active set; none without surfaces
    std::optional<StaticEquilibrium> equilibrium; ///< none: the pressure is given
    ContactPressure pressure;                     ///< Pa, at the contact's quadrature points
    std::optional<WornPressure<dim>> worn;        ///< where the pressure is that of worn pads
    std::vector<WearStep> wear_steps;             ///< by which pads got worn
    ContactMatrices<dim> contact_matrices;        ///< kept for the state that follows
    /// Where modes are to be found without factors, too: the solver of the equilibrium.
    std::shared_ptr<IterativeStatics<dim>> iterative;
  };

  /// Closes the contact everywhere and scales its constraints to the stiffness of the bodies: that
  /// of @p body_terms and of the iterative solver, if there is one. Without any the scale stays.
  template <int dim>
  void close_contact(Contact<dim> &contact, const std::vector<Term> &body_terms,
                     const IterativeStatics<dim> *solver);

  /// Finds steady sliding states that follow one another, each by the first of its candidates that
  /// can, cheapest first:
  ///
  /// 1. cached factors: those of an earlier state, while they serve (DirectStatics::serves), made
  ///    once a second state has the bodies of the one before;
  /// 2. nearby factors: GMRES from the state before, preconditioned by products with the inverse of
  ///    a matrix nearby;
  /// 3. the iterative solver, if there is one; else new factors.
  template <int dim>
  class StaticSolver
  {
  public:
    /// @p contact is closed or has the active set of another mesh, or with @p nearby has the active
    /// set of @p before; it leaves with that of the state. Only with @p nearby the state may depend
    /// on what came before: candidates 1 and 2. @p matrices are those of the contact, @p iterative
    /// may be null. Throws SolverError.
    StaticEquilibrium solve(const StaticProblem &problem, Contact<dim> &contact,
                            ContactMatrices<dim> &matrices, std::optional<StaticEquilibrium> before,
                            const LinearOperator &nearby, IterativeStatics<dim> *iterative);

    /// Drops the cached factors, which keep the matrices of the bodies.
    void drop_factors()
    {
      cached.reset();
    }

  private:
    /// Whether cached factors serve; makes them where they are worth it.
    bool has_factors(const StaticProblem &problem, const Contact<dim> &contact, bool follows);

    std::unique_ptr<DirectStatics<dim>> cached;
    KnownTerms of_last;    ///< the bodies' terms of the last state
    bool may_cache = true; ///< factors have not turned out to be of no use
  };
} // namespace squeal
