#include <squeal/contact/contact_forces.h>
#include <squeal/contact/contact_matrices.h>
#include <squeal/linalg/dense.h>
#include <squeal/mesh/finite_element_space.h>
#include <squeal/statics/direct_statics.h>
#include <squeal/statics/static_equilibrium.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <sstream>

// The steady sliding state by the primal-dual active set. iterate() has the loop, with linear
// problems by a StepSolver: new factors, factors that are there, or GMRES; around it
// solve_static_equilibrium() tries a known contact zone first and explains failures. The second
// follow_static_equilibrium() has a loop of its own, in the space that earlier states span.

namespace squeal
{
  double relative_change(const ContactPressure &before, const ContactPressure &after,
                         const MPI_Comm comm)
  {
    double values[2] = {0, 0};
    for (unsigned int i = 0; i < after.size(); ++i)
      for (unsigned int q = 0; q < after[i].size(); ++q)
      {
        values[0] = std::max(values[0], std::abs(after[i][q] - before[i][q]));
        values[1] = std::max(values[1], std::abs(after[i][q]));
      }
    MPI_Allreduce(MPI_IN_PLACE, values, 2, MPI_DOUBLE, MPI_MAX, comm);
    return values[1] > 0 ? values[0] / values[1] : 0;
  }

  template <int dim>
  SelfLocking self_locking(const RowRange &rows, const std::vector<Term> &body_terms,
                           const Contact<dim> &contact, const ContactPressure &pressure)
  {
    // Damping proportional to mass has a skew position term, which does not belong to the statics.
    ContactMatrices<dim> matrices;
    const Matrix frictionless = symmetric_part(
        rows, sum_of_terms(rows, static_terms(body_terms, contact, pressure, false, matrices)));
    return self_locking(rows, frictionless, friction_matrix(contact, pressure));
  }

  namespace
  {
    /// The given load and that of the contact.
    template <int dim>
    MultiVector total_load(const Contact<dim> &contact, const ContactPressure &pressure,
                           const StaticProblem &problem)
    {
      MultiVector sum = contact_load(contact, pressure, problem.with_friction);
      sum += problem.load;
      return sum;
    }

    /// Pressures and contacts of a new state, and a line about them. Returns whether neither
    /// changes any more.
    template <int dim>
    bool take_step(Contact<dim> &contact, StaticEquilibrium &result, const MPI_Comm comm,
                   const bool only_one = false)
    {
      auto pressure       = contact.pressure_of(result.state);
      const double change = relative_change(result.pressure, pressure, comm);
      result.pressure     = std::move(pressure);
      const auto set      = contact.update_active_set(result.state, only_one);
      result.iterations.push_back(
          {set.n_active, set.n_changed, set.largest_tension, set.largest_penetration, change, 0});
      return set.n_changed == 0 &&
             (!contact.contact_model().friction_is_nonlinear() || change < 1e-11);
    }

    /// X^T A X of a term of the contact, which couples few rows.
    DenseMatrix projected_contact(const MultiVector &X, const Matrix &matrix)
    {
      const RowRange &range = X.row_range();
      const unsigned int n  = X.n_columns();
      std::vector<char> coupled(range.size);
      for_entries(matrix, [&](const PetscInt row, const PetscInt column, double)
                  { coupled[row] = coupled[column] = 1; });
      MPI_Allreduce(MPI_IN_PLACE, coupled.data(), coupled.size(), MPI_CHAR, MPI_MAX, range.comm);
      std::vector<unsigned int> rows, number(range.size);
      for (unsigned int row = 0; row < range.size; ++row)
        if (coupled[row])
        {
          number[row] = rows.size();
          rows.push_back(row);
        }
      const DenseMatrix of_x = gather_rows(X, rows); // a row of X a column
      DenseMatrix image(n, rows.size());
      for_entries(matrix,
                  [&](const PetscInt row, const PetscInt column, const double value)
                  {
                    add_multiple(value, &of_x.values[std::size_t(number[column]) * n], n,
                                 &image.values[std::size_t(number[row]) * n]);
                  });
      DenseMatrix result = of_x * image.transpose();
      MPI_Allreduce(MPI_IN_PLACE, result.values.data(), n * n, MPI_DOUBLE, MPI_SUM, range.comm);
      return result;
    }

    /// Completes X^T A_i X of the matrices of these terms. X is long: one product with it for those
    /// of all bodies.
    void project(const TermList &terms, StateSpace &space)
    {
      const MultiVector &X = space.basis.basis();
      const unsigned int n = X.n_columns();
      space.projections.carry_over(terms, [](unsigned int) { return DenseMatrix(); });
      struct Added
      {
        unsigned int number, n_known, columns, rows; ///< where the products A x and A^T x begin
      };
      std::vector<Added> added;
      MultiVector images(X.row_range(), 0);
      for (unsigned int k = 0; k < terms.n_matrices(); ++k)
      {
        const Matrix &matrix       = *terms.matrix(k);
        const Origin origin        = terms.terms_of(k).front().origin;
        const unsigned int n_known = space.projections[k].n_rows, columns = images.n_columns();
        if (is_of_contact(origin))
        {
          if (n_known < n)
            space.projections[k] = projected_contact(X, matrix);
          continue;
        }
        const MultiVector of_new = X.columns(n_known, n - n_known);
        images.append(multiply(matrix, of_new));
        added.push_back({k, n_known, columns, columns});
        if (!is_conservative(origin))
        {
          added.back().rows = images.n_columns();
          images.append(multiply_transposed(matrix, of_new));
        }
      }
      const DenseMatrix products = inner_products(X, images);
      for (const auto &[k, n_known, columns, rows] : added)
      {
        const DenseView<double> right = products.columns(columns, n - n_known),
                                below = products.columns(rows, n - n_known).transpose();
        space.projections[k]          = grow(
                     space.projections[k], n,
                     [&](const unsigned int first, unsigned int, unsigned int, const unsigned int n_columns)
                     { return first == 0 ? right : below.columns(0, n_columns); });
      }
    }

    /// x = X c with X^T (b - A x) = 0.
    MultiVector best_combination(const StateSpace &space, const TermList &terms,
                                 const MultiVector &b)
    {
      const MultiVector &X = space.basis.basis();
      const unsigned int n = X.n_columns();
      DenseMatrix A(n, n);
      for (unsigned int k = 0; k < terms.n_matrices(); ++k)
        A.add(terms.coefficient(k, 0), space.projections[k]);
      const DenseMatrix c = squeal::solve(std::move(A), inner_products(X, b));
      return combine(X, c);
    }

    /// Why there is no equilibrium with friction: whether it is self-locking, with all contacts
    /// closed as at first or with those of the last active set.
    template <int dim>
    double largest_gain(const RowRange &rows, const std::vector<Term> &body_terms,
                        const Contact<dim> &first, const Contact<dim> &last,
                        const ContactPressure &pressure)
    {
      double gain = 0;
      for (const Contact<dim> *contact : {&first, &last})
        try
        {
          gain = std::max(gain, self_locking(rows, body_terms, *contact, pressure).gain);
        }
        catch (const SolverError &)
        {
          // Without friction there is no equilibrium with these contacts either.
        }
      return gain;
    }

    std::string explain_gain(const double gain)
    {
      std::ostringstream text;
      text << " Friction amplifies contact pressure with the gain " << gain
           << (gain >= 1 ? ": the brake is self-locking (gain of 1 and more), no steady sliding "
                           "holds the load."
                         : " (1: self-locking). Check first that the loads press the bodies "
                           "together.")
           << " Try a smaller friction coefficient, or a pad with a shorter lever arm between its "
              "face and its support.";
      return text.str();
    }

    /// Solves the linear problems of the active-set iteration.
    template <int dim>
    struct StepSolver
    {
      using Pressure = ContactPressure;
      bool is_direct; ///< solutions are accurate at any rate
      /// Puts the solution of A x = b at the present active set and pressure into x and returns how
      /// many iterations that took. Accurate only if it may be the last time.
      std::function<unsigned int(const Contact<dim> &, const Pressure &, const MultiVector &b,
                                 bool accurate, MultiVector &x)>
          solve;
      /// |b - A x| / |b| of the x that was solved for last.
      std::function<double(const Contact<dim> &, const Pressure &, const MultiVector &b,
                           const MultiVector &x)>
          relative_residual;
    };

    template <int dim>
    StepSolver<dim> solver_by(DirectStatics<dim> &factors)
    {
      using Pressure = ContactPressure;
      return {true,
              [&factors](const Contact<dim> &contact, const Pressure &pressure,
                         const MultiVector &b, bool, MultiVector &x)
              {
                x = factors.solve(contact, pressure, b);
                return 0;
              },
              [&factors](const Contact<dim> &, const Pressure &, const MultiVector &,
                         const MultiVector &) { return factors.relative_residual(); }};
    }

    template <int dim>
    StepSolver<dim> solver_by(IterativeStatics<dim> &solver, const bool with_friction)
    {
      using Pressure = ContactPressure;
      // Preconditioned residuals are relative errors of the state, but for the condition of the
      // preconditioned matrix. What decides about the next active set needs less.
      constexpr double of_active_set = 1e-5, of_state = 1e-12;
      return {false,
              [&solver, with_friction](const Contact<dim> &contact, const Pressure &pressure,
                                       const MultiVector &b, const bool accurate, MultiVector &x)
              {
                return solver.solve(contact, pressure, with_friction, b,
                                    accurate ? of_state : of_active_set, x);
              },
              [&solver, with_friction](const Contact<dim> &contact, const Pressure &pressure,
                                       const MultiVector &b, const MultiVector &x)
              {
                const LinearOperator A = solver.tangent(contact, pressure, with_friction);
                return length_of(difference(b, A(x))) / length_of(b);
              }};
    }

    /// The active sets repeat.
    struct Unsettled : SolverError
    {
      using SolverError::SolverError;
    };

    /// How many contacts may change in a step: all that break the conditions, which is a Newton
    /// step, until the sets repeat; then the last one alone (Murty 1974: no set comes twice, if the
    /// contact's compliance is a P-matrix), until fewer break them than ever before, and all
    /// again. (Block principal pivoting: Judice and Pires, Comput. Oper. Res. 21 (1994) 587.)
    class Pivoting
    {
    public:
      bool only_one() const
      {
        return one;
      }
      /// After a step that found that so many contacts break the conditions, and led to this set.
      void note(const unsigned int n_broken, const std::size_t set)
      {
        if (n_broken < fewest)
        {
          fewest = n_broken;
          one    = false;
        }
        if (!one && !visited.insert(set).second)
          one = true;
      }

    private:
      bool one            = false;
      unsigned int fewest = std::numeric_limits<unsigned int>::max();
      std::set<std::size_t> visited; // by all contacts
    };

    template <int dim>
    void iterate(const StepSolver<dim> &solver, const StaticProblem &problem, Contact<dim> &contact,
                 StaticEquilibrium &result)
    {
      const MPI_Comm comm = problem.load.row_range().comm;
      result.pressure     = contact.uniform_pressure(0);
      result.state        = MultiVector(problem.load.row_range(), 1);

      Pivoting pivoting;
      // The edge of the contact zone moves by about one row of contacts in a step.
      unsigned int max_iterations = 60;
      bool accurate               = solver.is_direct;
      for (unsigned int iteration = 0; iteration < max_iterations; ++iteration)
      {
        if (iteration == 1)
          max_iterations += result.iterations.front().n_active / 2;
        const unsigned int n_linear =
            solver.solve(contact, result.pressure, total_load(contact, result.pressure, problem),
                         accurate, result.state);
        const bool settled                = take_step(contact, result, comm, pivoting.only_one());
        result.iterations.back().n_linear = n_linear;
        if (settled && accurate)
        {
          // A singular tangent need not be noticed when it is factorised: a pad that touches at
          // one point can tip over. Then the state does not satisfy the equations.
          // Without a load there is nothing to satisfy.
          constexpr double largest = 1e-6;
          const MultiVector b      = total_load(contact, result.pressure, problem);
          if (length_of(b) > 0 &&
              !(solver.relative_residual(contact, result.pressure, b, result.state) <= largest))
            throw SingularMatrix("The static equilibrium does not satisfy its equations: contact "
                                 "and supports do not hold a body, which slides away or tips "
                                 "over.");
          return;
        }
        accurate |= settled;

        const std::vector<std::string> lost = contact.lost_contacts();
        if (!lost.empty())
          throw SolverError("The static equilibrium has no contact on the pad '" + lost.front() +
                                "': nothing presses it onto the rotor.",
                            {Failure::contact_lost});
        pivoting.note(result.iterations.back().n_changed, contact.active_set().hash(comm));
      }
      const unsigned int n_steps = result.iterations.size();
      throw Unsettled(
          "The active set of the static equilibrium does not settle (" + std::to_string(n_steps) +
          " steps, " + std::to_string(result.iterations.back().n_changed) +
          " changes in the last; " +
          (n_steps < max_iterations ? "the sets repeat)." : "more steps are not taken)."));
    }

    template <int dim>
    bool touches_everywhere(const Contact<dim> &contact)
    {
      ActiveSet closed = contact.active_set();
      closed.close();
      int does = closed == contact.active_set();
      MPI_Allreduce(MPI_IN_PLACE, &does, 1, MPI_INT, MPI_MIN, contact.spaces().comm);
      return does;
    }

    /// By new factors, from the present active set on.
    template <int dim>
    void solve_by_factors(const StaticProblem &problem, Contact<dim> &contact,
                          StaticEquilibrium &result)
    {
      const RowRange rows = problem.load.row_range();
      DirectStatics<dim> factors(rows, problem.body_terms, contact.contact_model(),
                                 problem.with_friction, problem.sectors(), problem.with_edge, true);
      iterate(solver_by(factors), problem, contact, result);
      if (problem.with_edge)
        result.edge = find_contact_edge(
            contact, result.pressure, rows, problem.with_friction, result.state,
            [&](const MultiVector &b, const std::vector<unsigned int> &multipliers)
            { return factors.solve_columns(contact, b, multipliers); });
    }

    /// An active set that is known of another mesh need not lead to the state: then everything
    /// touches at first.
    template <int dim, typename Solve>
    std::optional<StaticEquilibrium> solve_from_zone(Contact<dim> &contact, const Solve &solve)
    {
      if (touches_everywhere(contact))
        return std::nullopt;
      try
      {
        StaticEquilibrium result;
        solve(result);
        return result;
      }
      catch (const SolverError &)
      {
        contact.close();
        return std::nullopt;
      }
    }
  } // namespace

  template <int dim>
  StaticEquilibrium solve_static_equilibrium(const StaticProblem &problem, Contact<dim> &contact)
  {
    if (auto found = solve_from_zone(contact, [&](StaticEquilibrium &result)
                                     { solve_by_factors(problem, contact, result); }))
      return std::move(*found);
    const RowRange rows           = problem.load.row_range();
    const Contact<dim> all_closed = contact;
    StaticEquilibrium result;
    const auto gain = [&]()
    { return largest_gain(rows, problem.body_terms, all_closed, contact, result.pressure); };
    std::string failure;
    try
    {
      solve_by_factors(problem, contact, result);
      return result;
    }
    catch (const Unsettled &error)
    {
      failure = error.what();
    }
    catch (const SingularMatrix &)
    {
      if (!problem.with_friction)
        throw;
      failure = "The static equilibrium with friction has a singular tangent: contact and supports "
                "do not hold a pad, which slides away or tips over.";
    }
    catch (const SolverError &error)
    {
      // Whether the steps of a brake that locks lose its contact or repeat is decided by rounding.
      if (!problem.with_friction ||
          std::count(error.kinds.begin(), error.kinds.end(), Failure::contact_lost) == 0 ||
          !(gain() >= 1))
        throw;
      failure = "The static equilibrium with friction loses the contact of a pad.";
    }
    throw SolverError(failure + (problem.with_friction ? explain_gain(gain())
                                                       : std::string(" Try a finer mesh.")));
  }

  template <int dim>
  StaticEquilibrium solve_static_equilibrium(IterativeStatics<dim> &solver,
                                             const StaticProblem &problem, Contact<dim> &contact)
  {
    const auto solve = [&](StaticEquilibrium &result)
    { iterate(solver_by(solver, problem.with_friction), problem, contact, result); };
    if (auto found = solve_from_zone(contact, solve))
      return std::move(*found);
    StaticEquilibrium result;
    try
    {
      solve(result);
      return result;
    }
    catch (SolverError &error)
    {
      error.kinds.push_back(Failure::iterative_statics_failed);
      throw;
    }
  }

  template <int dim>
  std::optional<StaticEquilibrium> follow_static_equilibrium(DirectStatics<dim> &solver,
                                                             const StaticProblem &problem,
                                                             Contact<dim> &contact)
  {
    StaticEquilibrium result;
    try
    {
      iterate(solver_by(solver), problem, contact, result);
      return result;
    }
    catch (const SolverError &)
    {
      return std::nullopt;
    }
  }

  template <int dim>
  std::optional<StaticEquilibrium>
  follow_static_equilibrium(StaticEquilibrium before, const LinearOperator &nearby,
                            const StaticProblem &problem, Contact<dim> &contact,
                            ContactMatrices<dim> &matrices)
  {
    constexpr unsigned int most_corrections = 60, most_vectors = 400, most_kept = 8;
    constexpr double of_active_set = 1e-5; // what decides about it needs no more
    const TermList of_bodies(terms_of_order(problem.body_terms, 0));
    StaticEquilibrium result;
    result.state         = std::move(before.state);
    result.pressure      = std::move(before.pressure);
    result.space         = std::move(before.space);
    StateSpace &space    = result.space;
    const RowRange &rows = result.state.row_range();
    const unsigned int n = space.basis.n_columns();
    if (n == 0)
      space.basis = SearchSpace(rows);
    else if (n >= most_vectors)
    {
      MultiVector last    = space.basis.basis().columns(n - most_kept, most_kept);
      space.basis         = SearchSpace(std::move(last));
      before.beyond_space = std::numeric_limits<double>::infinity();
      space.projections   = {};
    }
    constexpr Novelty any{1e-10};
    // What the next state may lack anyway is not worth a vector; a state that is known to lie in
    // the space is not projected again.
    const double shortest = std::max(any.shortest, problem.tolerance);
    if (before.beyond_space > shortest)
      space.basis.add(result.state, {shortest});
    // Not the loop of Davidson: the terms change with the contact from step to step, and what is
    // projected is kept by matrix from state to state.
    for (unsigned int correction = 0; correction < most_corrections; ++correction)
    {
      TermList terms = of_bodies;
      for (const Term &term :
           static_terms({}, contact, result.pressure, problem.with_friction, matrices))
        terms.add(term);
      project(terms, space);
      const MultiVector b      = total_load(contact, result.pressure, problem);
      result.state             = best_combination(space, terms, b);
      const MultiVector change = nearby(difference(b, terms.multiply(0, result.state)));
      const double error       = length_of(change) / length_of(result.state);
      // What is left after it is a fraction of the change.
      result.state += change;
      if (error <= of_active_set)
      {
        const bool settled = take_step(contact, result, rows.comm);
        if (settled && error <= 10 * problem.tolerance)
        {
          result.beyond_space = error;
          return result;
        }
        if (!contact.lost_contacts().empty())
          return std::nullopt;
      }
      if (space.basis.add(change, any).n_columns() == 0)
        return std::nullopt;
    }
    return std::nullopt;
  }

  template SelfLocking self_locking(const RowRange &, const std::vector<Term> &, const Contact<2> &,
                                    const ContactPressure &);
  template StaticEquilibrium solve_static_equilibrium(const StaticProblem &, Contact<2> &);
  template StaticEquilibrium solve_static_equilibrium(IterativeStatics<2> &, const StaticProblem &,
                                                      Contact<2> &);
  template std::optional<StaticEquilibrium>
  follow_static_equilibrium(DirectStatics<2> &, const StaticProblem &, Contact<2> &);
  template std::optional<StaticEquilibrium>
  follow_static_equilibrium(StaticEquilibrium, const LinearOperator &, const StaticProblem &,
                            Contact<2> &, ContactMatrices<2> &);
  template SelfLocking self_locking(const RowRange &, const std::vector<Term> &, const Contact<3> &,
                                    const ContactPressure &);
  template StaticEquilibrium solve_static_equilibrium(const StaticProblem &, Contact<3> &);
  template StaticEquilibrium solve_static_equilibrium(IterativeStatics<3> &, const StaticProblem &,
                                                      Contact<3> &);
  template std::optional<StaticEquilibrium>
  follow_static_equilibrium(DirectStatics<3> &, const StaticProblem &, Contact<3> &);
  template std::optional<StaticEquilibrium>
  follow_static_equilibrium(StaticEquilibrium, const LinearOperator &, const StaticProblem &,
                            Contact<3> &, ContactMatrices<3> &);
} // namespace squeal
