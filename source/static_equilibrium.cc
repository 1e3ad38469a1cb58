#include <squeal/dense.h>
#include <squeal/gmres.h>
#include <squeal/static_equilibrium.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <set>
#include <sstream>

namespace squeal
{
  namespace
  {
    /// A^{-1} B with one step of iterative refinement.
    Block solve_refined(const Matrix &A, const Factorization &factorization,
                        const Block &right_hand_sides)
    {
      const std::size_t n = std::size_t(right_hand_sides.n_local()) * right_hand_sides.n_columns();
      Block solution      = factorization.solve(right_hand_sides);
      Block residual      = multiply(A, solution);
      for (std::size_t i = 0; i < n; ++i)
        residual.data()[i] = right_hand_sides.data()[i] - residual.data()[i];
      const Block correction = factorization.solve(residual);
      for (std::size_t i = 0; i < n; ++i)
        solution.data()[i] += correction.data()[i];
      return solution;
    }

    /// The linear problems of one mesh for changing sets of released multipliers R, by the
    /// factorisation of the problem A without any. Releasing a multiplier replaces its constraint
    /// by Lambda = 0; the constraint then has a slack s:
    ///     A x = b + E_R s,   x_R = 0   =>   x = x_0 + Y s,   A x_0 = b,   A Y = E_R,   Y_RR s =
    ///     -x_0R.
    /// A new set costs a few solves instead of a factorisation.
    class ReleaseSolver
    {
    public:
      ReleaseSolver(const RowRange &rows, Matrix &&matrix, const Block &right_hand_side)
          : rows(rows), A(std::move(matrix)),
            factorization(A, Factorization::Kind::lu, "the stiffness of the static equilibrium"),
            x_0(solve_refined(A, factorization, right_hand_side)), Y(rows, 0)
      {
      }

      /// x for the right side b.
      Block solve(const std::vector<unsigned int> &released)
      {
        return release(x_0, released);
      }
      /// The same for other right sides.
      Block solve(const Block &right_hand_sides, const std::vector<unsigned int> &released)
      {
        return release(solve_refined(A, factorization, right_hand_sides), released);
      }

    private:
      /// x_0 + Y s.
      Block release(Block x, const std::vector<unsigned int> &released)
      {
        std::vector<unsigned int> added;
        for (const unsigned int row : released)
          if (std::find(known.begin(), known.end(), row) == known.end())
            added.push_back(row);
        Block units(rows, added.size());
        for (unsigned int j = 0; j < added.size(); ++j)
          if (rows.contains(added[j]))
            units.column(j)[added[j] - rows.begin] = 1;
        if (!added.empty())
          Y.append(solve_refined(A, factorization, units));
        known.insert(known.end(), added.begin(), added.end());

        // Y_RR and x_0R on all ranks
        const unsigned int n = released.size(), m = x.n_columns();
        std::vector<double> values(n * (n + m));
        for (unsigned int i = 0; i < n; ++i)
          if (rows.contains(released[i]))
            for (unsigned int j = 0; j < n + m; ++j)
              values[i + n * j] = j < n ? Y.column(column_of(released[j]))[released[i] - rows.begin]
                                        : -x.column(j - n)[released[i] - rows.begin];
        MPI_Allreduce(MPI_IN_PLACE, values.data(), values.size(), MPI_DOUBLE, MPI_SUM, rows.comm);
        if (n == 0)
          return x;
        const DenseMatrix slack =
            squeal::solve(DenseMatrix(n, n, {values.begin(), values.begin() + n * n}),
                          DenseMatrix(n, m, {values.begin() + n * n, values.end()}));
        for (unsigned int k = 0; k < m; ++k)
        {
          double *const column = x.column(k);
          for (unsigned int j = 0; j < n; ++j)
          {
            const double *const y = Y.column(column_of(released[j]));
            for (unsigned int i = 0; i < rows.n_local(); ++i)
              column[i] += slack(j, k) * y[i];
          }
          for (const unsigned int row : released) // zero up to rounding: exactly
            if (rows.contains(row))
              column[row - rows.begin] = 0;
        }
        return x;
      }

      unsigned int column_of(const unsigned int row) const
      {
        return std::find(known.begin(), known.end(), row) - known.begin();
      }

      const RowRange rows;
      const Matrix A;
      const Factorization factorization;
      const Block x_0;
      Block Y;
      std::vector<unsigned int> known; ///< the rows of Y's columns
    };

    /// Largest difference of two pressures and the largest pressure.
    template <typename Pressure>
    double relative_change(const Pressure &before, const Pressure &after, const MPI_Comm comm)
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
  } // namespace

  template <int dim>
  Matrix static_tangent(const RowRange &rows, const std::vector<Term> &body_terms,
                        const Contact<dim> &contact,
                        const typename Contact<dim>::Pressure &pressure, const bool with_friction)
  {
    std::vector<Summand> summands;
    for (const Term &term : body_terms)
      if (term.order == 0 && term.matrix)
        summands.push_back({term.coefficient, *term.matrix});
    const Matrix normal   = contact.normal();
    const Matrix friction = with_friction ? contact.friction(pressure) : Matrix();
    summands.push_back({1., normal});
    summands.push_back({1., friction});
    return sum_of(rows, summands);
  }

  template <int dim>
  SelfLocking self_locking(const RowRange &rows, const std::vector<Term> &body_terms,
                           const Contact<dim> &contact,
                           const typename Contact<dim>::Pressure &pressure)
  {
    // Damping proportional to mass has a skew position term, which does not belong to the statics.
    const Matrix frictionless =
        symmetric_part(rows, static_tangent(rows, body_terms, contact, pressure, false));
    return self_locking(rows, frictionless, contact.friction(pressure));
  }

  namespace
  {
    bool is_nonlinear(const FrictionLaw &friction)
    {
      return friction.kind == FrictionLaw::Kind::expression;
    }

    /// The given load and that of the contact.
    template <int dim>
    Block total_load(const Contact<dim> &contact, const typename Contact<dim>::Pressure &pressure,
                     const bool with_friction, const Block &load)
    {
      Block sum = contact.load(pressure, with_friction);
      for (unsigned int i = 0; i < sum.n_local(); ++i)
        sum.data()[i] += load.data()[i];
      return sum;
    }

    /// Pressures and contacts of a new state, and a line about them. Returns whether neither
    /// changes any more.
    template <int dim>
    bool take_step(Contact<dim> &contact, StaticEquilibrium &result, const MPI_Comm comm)
    {
      auto pressure       = contact.pressure_of(result.state);
      const double change = relative_change(result.pressure, pressure, comm);
      result.pressure     = std::move(pressure);
      const auto set      = contact.update_active_set(result.state);
      result.iterations.push_back(
          {set.n_active, set.n_changed, set.largest_tension, set.largest_penetration, change, 0});
      return set.n_changed == 0 &&
             (!is_nonlinear(contact.contact_model().friction) || change < 1e-11);
    }

    /// Products with the static tangent, whose parts are not summed.
    template <int dim>
    std::function<Block(const Block &)>
    tangent_product(const std::vector<Term> &body_terms, const Contact<dim> &contact,
                    const typename Contact<dim>::Pressure &pressure, const bool with_friction)
    {
      const std::shared_ptr<const Matrix> normal = contact.shared_normal();
      std::pair<double, std::shared_ptr<const Matrix>> slip;
      if (with_friction)
        slip = contact.shared_friction(pressure);
      return [&body_terms, normal, slip](const Block &x)
      {
        Block y        = multiply(*normal, x);
        const auto add = [&](const double factor, const Matrix &matrix)
        {
          if (!matrix)
            return;
          const Block product = multiply(matrix, x);
          for (std::size_t i = 0; i < std::size_t(y.n_local()) * y.n_columns(); ++i)
            y.data()[i] += factor * product.data()[i];
        };
        if (slip.second)
          add(slip.first, *slip.second);
        for (const Term &term : body_terms)
          if (term.order == 0 && term.matrix)
            add(term.coefficient, *term.matrix);
        return y;
      };
    }

    /// x = X c with X^T (b - A X c) = 0.
    Block best_combination(const Block &states, const LinearOperator &tangent, const Block &b)
    {
      const Block X        = orthonormalize(states);
      const unsigned int n = X.n_columns();
      const DenseMatrix c  = squeal::solve(DenseMatrix(n, n, inner_products(X, tangent(X))),
                                           DenseMatrix(n, 1, inner_products(X, b)));
      return combine(X, c.values, 1);
    }

    /// Solves A x = b from the given x on with B ~ A^{-1}; false if that does not converge.
    bool correct(const LinearOperator &tangent, const LinearOperator &nearby, const Block &b,
                 Block &x)
    {
      // Preconditioned residuals are relative errors of the state.
      constexpr double tolerance              = 1e-12;
      constexpr unsigned int most_corrections = 60;
      Block residual                          = b;
      const Block product                     = tangent(x);
      for (unsigned int i = 0; i < b.n_local(); ++i)
        residual.data()[i] -= product.data()[i];
      const Block change = nearby(residual);
      const double size  = std::sqrt(inner_products(x, x)[0]);
      for (unsigned int i = 0; i < b.n_local(); ++i)
        x.data()[i] += change.data()[i];
      // What is left after it is a fraction of the change.
      if (std::sqrt(inner_products(change, change)[0]) <= 10 * tolerance * size)
        return true;
      return bool(gmres(tangent, nearby, b, x, tolerance, most_corrections));
    }

    /// Why there is no equilibrium with friction: whether it is self-locking, with all contacts
    /// closed as at first or with those of the last active set.
    template <int dim>
    std::string explain_failure(const RowRange &rows, const std::vector<Term> &body_terms,
                                const Contact<dim> &first, const Contact<dim> &last,
                                const typename Contact<dim>::Pressure &pressure)
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
      std::ostringstream text;
      text << " Friction amplifies contact pressure with the gain " << gain
           << (gain >= 1 ? ": the brake is self-locking (gain of 1 and more), no steady sliding "
                           "holds the load."
                         : " (1: self-locking).")
           << " Try a smaller friction coefficient, or a pad with a shorter lever arm between its "
              "face and its support.";
      return text.str();
    }

    /// Solves the linear problems of the active-set iteration.
    template <int dim>
    class LinearSteps
    {
    public:
      virtual ~LinearSteps() = default;
      /// Puts the solution at the present active set and pressure of @p result into its state and
      /// returns how many iterations that took. @p accurate only if it may be the last time.
      virtual unsigned int solve(const Contact<dim> &contact, StaticEquilibrium &result,
                                 const Block &right_hand_side, bool accurate) = 0;
      /// Products with the matrix of the linear problem.
      virtual LinearOperator tangent(const Contact<dim> &contact,
                                     const typename Contact<dim>::Pressure &pressure) const = 0;
      /// Whether the solutions are accurate at any rate.
      virtual bool is_direct() const = 0;
    };

    template <int dim>
    class DirectSteps : public LinearSteps<dim>
    {
    public:
      DirectSteps(const RowRange &rows, const std::vector<Term> &body_terms,
                  const ContactModel<dim> &model, const bool with_friction)
          : rows(rows), body_terms(body_terms), with_friction(with_friction),
            factor_once(model.mortar && !is_nonlinear(model.friction))
      {
      }

      unsigned int solve(const Contact<dim> &contact, StaticEquilibrium &result,
                         const Block &right_hand_side, bool) override
      {
        constexpr unsigned int most_releases      = 400;
        const std::vector<unsigned int> &released = contact.released_multipliers();
        if (factor_once && released.size() > most_releases)
        {
          factor_once = false;
          release_solver.reset();
        }
        const auto assemble = [&]()
        { return static_tangent(rows, body_terms, contact, result.pressure, with_friction); };
        if (factor_once)
        {
          if (!release_solver)
            release_solver = std::make_unique<ReleaseSolver>(rows, assemble(), right_hand_side);
          result.state = release_solver->solve(released);
          return 0;
        }
        factorization.reset();
        const Matrix A = assemble();
        factorization  = std::make_unique<Factorization>(A, Factorization::Kind::lu,
                                                        "the stiffness of the static equilibrium");
        result.state   = solve_refined(A, *factorization, right_hand_side);
        return 0;
      }
      /// Solutions of the last linear problem, whose contacts these are, for other right sides.
      Block solve(const Contact<dim> &contact, const Block &right_hand_sides)
      {
        return factor_once ? release_solver->solve(right_hand_sides, contact.released_multipliers())
                           : factorization->solve(right_hand_sides);
      }
      LinearOperator tangent(const Contact<dim> &contact,
                             const typename Contact<dim>::Pressure &pressure) const override
      {
        return tangent_product(body_terms, contact, pressure, with_friction);
      }
      bool is_direct() const override
      {
        return true;
      }

    private:
      const RowRange rows;
      const std::vector<Term> &body_terms;
      const bool with_friction;
      /// A friction law that depends on the pressure, and penalty contact with its many points,
      /// change the matrix in each step; for mortar contact one factorisation, at first with all
      /// contacts closed, serves all active sets of a moderate number of releases.
      bool factor_once;
      std::unique_ptr<ReleaseSolver> release_solver;
      std::unique_ptr<Factorization> factorization; ///< of the last matrix, if it changes
    };

    template <int dim>
    class IterativeSteps : public LinearSteps<dim>
    {
    public:
      IterativeSteps(IterativeStatics<dim> &solver, const bool with_friction)
          : solver(solver), with_friction(with_friction)
      {
      }

      unsigned int solve(const Contact<dim> &contact, StaticEquilibrium &result,
                         const Block &right_hand_side, const bool accurate) override
      {
        // Preconditioned residuals are relative errors of the state, but for the condition of the
        // preconditioned matrix. What decides about the next active set needs less.
        constexpr double of_active_set = 1e-5, of_state = 1e-12;
        return solver.solve(contact, result.pressure, with_friction, right_hand_side,
                            accurate ? of_state : of_active_set, result.state);
      }
      LinearOperator tangent(const Contact<dim> &contact,
                             const typename Contact<dim>::Pressure &pressure) const override
      {
        return solver.tangent(contact, pressure, with_friction);
      }
      bool is_direct() const override
      {
        return false;
      }

    private:
      IterativeStatics<dim> &solver;
      const bool with_friction;
    };

    /// A singular tangent need not be noticed when it is factorised: a pad that touches at one
    /// point can tip over. Then the state does not satisfy the equations.
    template <int dim>
    void check_residual(const LinearSteps<dim> &steps, const Contact<dim> &contact,
                        const bool with_friction, const Block &load,
                        const StaticEquilibrium &result)
    {
      constexpr double largest = 1e-6;
      const Block b            = total_load(contact, result.pressure, with_friction, load);
      Block r                  = steps.tangent(contact, result.pressure)(result.state);
      for (unsigned int i = 0; i < r.n_local(); ++i)
        r.data()[i] -= b.data()[i];
      const double residual = std::sqrt(inner_products(r, r)[0] / inner_products(b, b)[0]);
      if (!(residual <= largest))
        throw SingularMatrix("its equations are not satisfied");
    }

    /// The active sets repeat.
    struct Unsettled : SolverError
    {
      using SolverError::SolverError;
    };

    template <int dim>
    void iterate(LinearSteps<dim> &steps, Contact<dim> &contact, const bool with_friction,
                 const Block &load, StaticEquilibrium &result)
    {
      const MPI_Comm comm = load.row_range().comm;
      result.pressure     = contact.uniform_pressure(0);
      result.state        = Block(load.row_range(), 1);

      std::set<std::size_t> visited;
      // The border of contact moves by about one row of contacts in a step.
      unsigned int max_iterations = 60;
      bool accurate               = steps.is_direct();
      for (unsigned int iteration = 0; iteration < max_iterations; ++iteration)
      {
        if (iteration == 1)
          max_iterations += result.iterations.front().n_active / 2;
        const unsigned int n_linear = steps.solve(
            contact, result, total_load(contact, result.pressure, with_friction, load), accurate);
        const bool settled                = take_step(contact, result, comm);
        result.iterations.back().n_linear = n_linear;
        if (settled && accurate)
        {
          check_residual(steps, contact, with_friction, load, result);
          result.states = result.state;
          return;
        }
        accurate |= settled;

        const std::vector<std::string> lost = contact.lost_contacts();
        if (!lost.empty())
          throw SolverError(
              "The static equilibrium has no contact on the pad '" + lost.front() +
              "': nothing presses it onto the rotor. Check Pads/Pressure and Contact/Initial gap.");
        if (result.iterations.back().n_changed > 0 &&
            !visited.insert(contact.active_set_hash()).second)
          break;
      }
      const unsigned int n_steps = result.iterations.size();
      throw Unsettled(
          "The active set of the static equilibrium does not settle (" + std::to_string(n_steps) +
          " steps, " + std::to_string(result.iterations.back().n_changed) +
          " changes in the last; " +
          (n_steps < max_iterations ? "the sets repeat)." : "more steps are not taken)."));
    }
  } // namespace

  template <int dim>
  std::optional<StaticEquilibrium>
  follow_static_equilibrium(const StaticEquilibrium &before, const LinearOperator &nearby,
                            const std::vector<Term> &body_terms, Contact<dim> &contact,
                            const bool with_friction, const Block &load)
  {
    const RowRange &rows                  = before.state.row_range();
    constexpr unsigned int max_iterations = 10, most_states = 8;
    StaticEquilibrium result;
    result.state    = before.state;
    result.pressure = before.pressure;
    for (unsigned int iteration = 0; iteration < max_iterations; ++iteration)
    {
      const auto tangent = tangent_product(body_terms, contact, result.pressure, with_friction);
      const Block b      = total_load(contact, result.pressure, with_friction, load);
      if (iteration == 0)
        result.state = best_combination(before.states, tangent, b);
      if (!correct(tangent, nearby, b, result.state))
        return std::nullopt;
      if (take_step(contact, result, rows.comm))
      {
        const unsigned int n = before.states.n_columns(), n_kept = std::min(n, most_states - 1);
        result.states = before.states.columns(n - n_kept, n_kept);
        result.states.append(result.state);
        return result;
      }
      if (!contact.lost_contacts().empty())
        return std::nullopt;
    }
    return std::nullopt;
  }

  template <int dim>
  StaticEquilibrium solve_static_equilibrium(const RowRange &rows,
                                             const std::vector<Term> &body_terms,
                                             Contact<dim> &contact, const bool with_friction,
                                             const Block &load, const bool with_border)
  {
    const Contact<dim> all_closed = contact;
    StaticEquilibrium result;
    std::string failure;
    try
    {
      DirectSteps<dim> steps(rows, body_terms, contact.contact_model(), with_friction);
      iterate(steps, contact, with_friction, load, result);
      if (with_border)
        result.border =
            find_contact_border(contact, result.pressure, rows, with_friction,
                                [&](const Block &b) { return steps.solve(contact, b); });
      return result;
    }
    catch (const Unsettled &error)
    {
      failure = error.what();
    }
    catch (const SingularMatrix &error)
    {
      if (!with_friction)
        throw;
      failure = "The static equilibrium with friction has a singular tangent: contact and supports "
                "do not hold a pad, which slides away or tips over.";
    }
    throw SolverError(failure + (with_friction ? explain_failure(rows, body_terms, all_closed,
                                                                 contact, result.pressure)
                                               : std::string(" Try a finer mesh.")));
  }

  template <int dim>
  StaticEquilibrium solve_static_equilibrium(IterativeStatics<dim> &solver, Contact<dim> &contact,
                                             const bool with_friction, const Block &load)
  {
    StaticEquilibrium result;
    IterativeSteps<dim> steps(solver, with_friction);
    try
    {
      iterate(steps, contact, with_friction, load, result);
    }
    catch (const SolverError &error)
    {
      throw SolverError(
          std::string(error.what()) +
          " Static equilibrium/Linear solver = direct tells more, for example whether friction is "
          "self-locking, where its factors fit; on a coarse mesh they do.");
    }
    return result;
  }

  template Matrix static_tangent(const RowRange &, const std::vector<Term> &, const Contact<2> &,
                                 const Contact<2>::Pressure &, bool);
  template Matrix static_tangent(const RowRange &, const std::vector<Term> &, const Contact<3> &,
                                 const Contact<3>::Pressure &, bool);
  template SelfLocking self_locking(const RowRange &, const std::vector<Term> &, const Contact<2> &,
                                    const Contact<2>::Pressure &);
  template SelfLocking self_locking(const RowRange &, const std::vector<Term> &, const Contact<3> &,
                                    const Contact<3>::Pressure &);
  template StaticEquilibrium solve_static_equilibrium(const RowRange &, const std::vector<Term> &,
                                                      Contact<2> &, bool, const Block &, bool);
  template std::optional<StaticEquilibrium>
  follow_static_equilibrium(const StaticEquilibrium &, const LinearOperator &,
                            const std::vector<Term> &, Contact<2> &, bool, const Block &);
  template StaticEquilibrium solve_static_equilibrium(const RowRange &, const std::vector<Term> &,
                                                      Contact<3> &, bool, const Block &, bool);
  template StaticEquilibrium solve_static_equilibrium(IterativeStatics<2> &, Contact<2> &, bool,
                                                      const Block &);
  template StaticEquilibrium solve_static_equilibrium(IterativeStatics<3> &, Contact<3> &, bool,
                                                      const Block &);
  template std::optional<StaticEquilibrium>
  follow_static_equilibrium(const StaticEquilibrium &, const LinearOperator &,
                            const std::vector<Term> &, Contact<3> &, bool, const Block &);
} // namespace squeal
