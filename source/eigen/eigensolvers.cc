#include <squeal/base/text.h>
#include <squeal/eigen/growth_search.h>
#include <squeal/eigen/interval_search.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/eigen/shift_invert_solver.h>
#include <squeal/eigen/slepc_pep.h>
#include <squeal/eigen/window.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/ritz.h>

#include <algorithm>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// SLEPc's PEP: single vectors.
    class Krylov : public ShiftInvertSolver
    {
    public:
      Krylov() : ShiftInvertSolver(ModeSolver::krylov) {}

    private:
      EigenSolution search(const Task &task, const unsigned int seed) const override
      {
        EigenPairs found = pep_search(task.problem, task.factorization, task.shift,
                                      std::hypot(task.radius(), task.shift),
                                      2 * (task.n_expected + task.n_rigid) + 4, seed, task.options);
        EigenSolution result;
        std::copy_if(found.lambda.begin(), found.lambda.end(),
                     std::back_inserter(result.proof.ritz_values_beyond),
                     [&](const Complex &l) { return !task.region.contains(l); });
        result.proof.eigenvalues  = std::move(found.lambda);
        result.reuse.search_space = found.right.real_span();
        std::vector<unsigned int> inside;
        for (unsigned int j = 0; j < found.size(); ++j)
          if (const Complex l = result.proof.eigenvalues[j]; task.in_region(l) && !is_overdamped(l))
            inside.push_back(j);
        found.lambda = result.proof.eigenvalues;
        result.modes = found.select(inside);
        return result;
      }
      void add_left(const Task &task, EigenSolution &solution) const override
      {
        try
        {
          add_left_vectors(task.problem, task.shift_invert(true), task.radius(), task.options,
                           solution);
        }
        catch (const SolverError &) // damping too strong for a space without it
        {
          add_left_by_block_search(task, solution);
        }
      }
    };

    /// Block Krylov: as many right-hand sides a step as the factors serve at the cost of a
    /// few.
    class BlockKrylov : public ShiftInvertSolver
    {
    public:
      BlockKrylov() : ShiftInvertSolver(ModeSolver::block_krylov) {}

    private:
      /// In a window velocity terms are no part of the factors.
      static EigenSolution search_with_velocity_terms(const Task &task, const unsigned int seed)
      {
        IntervalSearchOptions options;
        options.region        = task.region;
        options.min_imaginary = task.options.min_imaginary;
        options.max_imaginary = task.options.max_imaginary;
        options.tolerance     = task.options.tolerance;
        options.only_count    = seed > 0; // the second search confirms the number
        options.n_expected    = task.n_expected;
        options.seed          = seed;
        return interval_search(task.problem, task.factorization, options, task.options.progress);
      }
      EigenSolution search(const Task &task, const unsigned int seed) const override
      {
        if (!task.region.is_disc() && task.problem.P)
          return search_with_velocity_terms(task, seed);
        EigenSolution found = block_krylov_search(
            task.problem, task.shift_invert(), search_options(task, seed), task.options.progress);
        if (!task.options.keep_factors)
          found.reuse.search_space = {};
        found.proof.eigenvalues = found.modes.lambda;
        std::vector<unsigned int> inside;
        for (unsigned int j = 0; j < found.modes.size(); ++j)
          if (const Complex l = found.modes.lambda[j];
              task.in_region(l) && (task.region.is_disc() || is_wanted(task.options, l)))
            inside.push_back(j);
        found.modes = found.modes.select(inside);
        return found;
      }
      void add_left(const Task &task, EigenSolution &solution) const override
      {
        add_left_by_block_search(task, solution);
      }
      bool has_all_of_disc() const override
      {
        return true;
      }
    };

    /// LAPACK on the whole problem; the oracle of the other solvers.
    class DenseSolver : public Eigensolver
    {
    public:
      EigenSolution solve(const QuadraticEigenproblem &problem, const EigensolverOptions &options,
                          const Counting &) const override
      {
        constexpr unsigned int largest = 3000;
        if (problem.rows.size > largest)
          throw SolverError("The dense solver takes at most " + std::to_string(largest) +
                                " unknowns; this problem has " + std::to_string(problem.rows.size) +
                                ".",
                            {Failure::too_large_for_dense});
        const double radius = search_radius(options.max_imaginary);
        // A body on springs of nearly nothing has zeros as a free one has.
        const unsigned int n_rigid =
            count_reference_modes(problem, rigid_body_limit(options.max_imaginary));
        const double shift = real_shift(options, n_rigid > 0);
        options.progress("  dense: " + std::to_string(problem.rows.size) + " unknowns");
        const auto is_listed = [&](const Complex &l)
        { return std::abs(l) <= radius || grows_beyond_disc(l, options.max_imaginary); };
        const EigenPairs pairs = finite_pairs(
            problem, dense_eigenpairs(problem, radius, shift,
                                      [&](const Complex &l) {
                                        return is_listed(l) ||
                                               (is_wanted(options, l) && !is_overdamped(l));
                                      }));
        // Rounding decides how many of the defective zeros of a free body have Im l >= 0: they are
        // counted and left out.
        std::vector<unsigned int> moving;
        unsigned int n_decaying_beyond = 0;
        for (unsigned int j = 0; j < pairs.size(); ++j)
          if (!is_listed(pairs.lambda[j]))
            ++n_decaying_beyond;
          else if (std::abs(pairs.lambda[j]) > rigid_body_limit(options.max_imaginary))
            moving.push_back(j);
        EigenSolution solution;
        EigenPairs &modes    = solution.modes;
        modes                = pairs.select(moving);
        modes.backward_error = BackwardError(problem)(modes);
        for (const double error : modes.backward_error)
          if (error > options.tolerance)
            throw SolverError(text_of("The dense solver's backward error is ", error, "."),
                              {Failure::dense_inaccurate});
        const auto n_in_disc = [&](const auto &is_one)
        {
          return std::count_if(modes.lambda.begin(), modes.lambda.end(),
                               [&](const Complex &l)
                               { return std::abs(l) <= radius && is_one(l); });
        };
        const unsigned int n_overdamped = n_in_disc(is_overdamped),
                           n_found      = n_in_disc([](const Complex &l)
                                               { return l.imag() > 0 && !is_overdamped(l); });
        if (n_found + n_rigid != count_reference_modes(problem, radius))
          check_for_missing(problem, {0, radius}, n_found + n_overdamped, n_rigid);
        solution.proof.n_rigid_body_modes = n_rigid;
        solution.proof.completeness =
            text_of("all eigenvalues were computed; listed are those with |lambda| <= 2 pi ",
                    radius / (2 * M_PI), " Hz and all that grow");
        if (n_decaying_beyond > 0)
          solution.proof.completeness +=
              text_of(", not ", n_decaying_beyond, " of the window that decay outside");
        complete_left_vectors(problem, modes);
        restrict_to_window(problem, options, solution);
        return solution;
      }
    };
  } // namespace

  std::unique_ptr<Eigensolver> make_eigensolver(const ModeSolver solver)
  {
    switch (solver)
    {
    case ModeSolver::block_krylov:
      return std::make_unique<BlockKrylov>();
    case ModeSolver::krylov:
      return std::make_unique<Krylov>();
    case ModeSolver::dense:
      return std::make_unique<DenseSolver>();
    default:
      throw InputError("Eigenproblem/Solver = " + name_of(solver) +
                       ": allowed are block_krylov, krylov and dense.");
    }
  }
} // namespace squeal
