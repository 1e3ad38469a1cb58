#include <squeal/base/stopwatch.h>
#include <squeal/base/text.h>
#include <squeal/eigen/block_krylov.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/eigen/growth_search.h>
#include <squeal/eigen/inertia_count.h>
#include <squeal/eigen/interval_search.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/eigen/slepc_pep.h>
#include <squeal/eigen/window.h>
#include <squeal/linalg/compressed_rows.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/ritz.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>

namespace squeal
{
  using Complex = std::complex<double>;

  bool is_wanted(const EigensolverOptions &options, const Complex &l)
  {
    return l.imag() >= options.min_imaginary * (1 - rounding_of_window) &&
           l.imag() <= options.max_imaginary * (1 + rounding_of_window);
  }

  void restrict_to_window(const QuadraticEigenproblem &problem, const EigensolverOptions &options,
                          EigenSolution &solution)
  {
    const std::vector<Complex> &lambda = solution.modes.lambda;
    std::vector<unsigned int> inside;
    unsigned int n_zero = 0;
    for (const unsigned int j : order_of_modes(lambda))
      if (std::abs(lambda[j]) <= rigid_body_limit(options.max_imaginary))
        ++n_zero;
      else if (is_wanted(options, lambda[j]) && !is_overdamped(lambda[j]))
        inside.push_back(j); // real eigenvalues only if they diverge
    solution.proof.n_rigid_body_modes += n_zero / 2;
    solution.modes = solution.modes.select(inside);
    normalise(problem, solution.modes);
  }

  namespace
  {
    unsigned int count_rigid_body_modes(const QuadraticEigenproblem &problem,
                                        const EigensolverOptions &options)
    {
      return problem.may_move_rigidly
                 ? count_reference_modes(problem, rigid_body_limit(options.max_imaginary))
                 : 0;
    }

    /// The real shift, 1/s. Zero eigenvalues of free bodies rule out a shift of zero.
    double shift_of(const EigensolverOptions &options, const bool moves_rigidly)
    {
      return options.max_imaginary * (options.shift > 0 ? options.shift : moves_rigidly ? 0.1 : 0.);
    }

    /// A window whose lower end is below this part of its upper one is cut out of all modes below.
    constexpr double far_from_zero = 0.75;

    bool is_far_from_zero(const EigensolverOptions &options)
    {
      return options.min_imaginary >= far_from_zero * options.max_imaginary;
    }

    /// The window and a margin at both ends, of which modes are moved across the ends by friction
    /// and damping.
    SearchRegion region_around(const EigensolverOptions &options, const double widening)
    {
      const double margin = 1 + 0.05 * widening;
      return SearchRegion::between(options.min_imaginary / margin, options.max_imaginary * margin);
    }

    /// One real factorisation at a real shift, and a search with it; the completeness check and the
    /// vectors are the same whichever search it is.
    class ShiftInvertSolver : public Eigensolver
    {
    public:
      EigenSolution solve(const QuadraticEigenproblem &problem,
                          const EigensolverOptions &options) const override;
      bool counts_in_disc(const EigensolverOptions &options) const override
      {
        return !searches_windows() || !is_far_from_zero(options);
      }
      std::vector<double> counted_frequencies(const EigensolverOptions &options,
                                              const bool may_move_rigidly) const override
      {
        return ends_of(region_of(options), options, may_move_rigidly);
      }

    protected:
      struct Task
      {
        const QuadraticEigenproblem &problem;
        const EigensolverOptions &options;
        const Factorization &factorization;
        SearchRegion region;
        double shift;                     ///< of l; in a window the shift of l^2 is region.square
        unsigned int n_expected, n_rigid; ///< by the inertia, in the region

        double radius() const
        {
          return region.radius;
        }
        ShiftInvert shift_invert(const bool adjoint = false) const
        {
          return region.is_disc() ? ShiftInvert(factorization, shift, adjoint)
                                  : ShiftInvert::of_square(factorization, region.square, adjoint);
        }
        bool in_region(const Complex &l) const
        {
          return region.contains(l) && std::abs(l) > rigid_body_limit(options.max_imaginary);
        }
      };
      static BlockSearchOptions search_options(const Task &task, const unsigned int seed)
      {
        BlockSearchOptions options;
        options.region        = task.region;
        options.max_imaginary = task.options.max_imaginary;
        options.tolerance     = std::min(1e-11, 1e-2 * task.options.tolerance);
        options.n_expected    = task.n_expected + task.n_rigid;
        options.seed          = seed;
        return options;
      }
      static void add_left_by_block_search(const Task &task, EigenSolution &solution)
      {
        BlockSearchOptions options = search_options(task, 2);
        options.tolerance          = 1e-8; // of vectors: their eigenvalues are known
        options.n_expected         = solution.modes.size() + task.n_rigid;
        search_left_vectors(task.problem, task.shift_invert(true), options, task.options, solution);
      }
      /// Finds the eigenvalues of the region (proof.eigenvalues) and either the wanted modes or a
      /// space that has them (reuse.search_space).
      virtual EigenSolution search(const Task &task, unsigned int seed) const = 0;
      /// Adds left vectors to modes that have none.
      virtual void add_left(const Task &task, EigenSolution &solution) const = 0;
      /// Whether right and left vectors of the whole disc are computed.
      virtual bool has_all_of_disc() const
      {
        return false;
      }
      /// Whether a window far from zero is searched by itself; else all modes below it are found,
      /// too.
      virtual bool searches_windows() const
      {
        return false;
      }

    private:
      SearchRegion region_of(const EigensolverOptions &options, const double widening = 1) const
      {
        return counts_in_disc(options) ? SearchRegion{0, search_radius(options.max_imaginary)}
                                       : region_around(options, widening);
      }
      /// The ends of a region; of a disc the lower one is that of rigid bodies, if they may move.
      static std::vector<double> ends_of(const SearchRegion &region,
                                         const EigensolverOptions &options,
                                         const bool may_move_rigidly)
      {
        std::vector<double> ends;
        if (!region.is_disc())
          ends.push_back(region.lower());
        else if (may_move_rigidly)
          ends.push_back(rigid_body_limit(options.max_imaginary));
        ends.push_back(region.upper());
        return ends;
      }
      EigenSolution solve_in(const SearchRegion &region, const QuadraticEigenproblem &problem,
                             const EigensolverOptions &options) const;
      /// Searches twice if the inertia does not confirm the number found.
      /// @p start becomes what spans the vectors found, to be refined if need be.
      EigenSolution search_all(const Task &task, MultiVector &start) const;

      /// Adds modes of the window that grow outside of the disc, and tells what is known of them.
      /// Returns whether there are signs of them.
      static bool look_for_growth_beyond(const Task &task, EigenSolution &solution);

      mutable RememberedCounts count_reference;
    };

    /// SLEPc's PEP: single vectors.
    class Krylov : public ShiftInvertSolver
    {
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
      bool searches_windows() const override
      {
        return true;
      }
      bool has_all_of_disc() const override
      {
        return true;
      }
    };

    /// Whether there are pairs and all are good enough; computes backward errors that are not
    /// known.
    bool is_accurate(const QuadraticEigenproblem &problem, const EigensolverOptions &options,
                     EigenPairs &pairs)
    {
      if (pairs.empty())
        return false;
      if (pairs.backward_error.empty())
        pairs.backward_error = BackwardError(problem)(pairs);
      return *std::max_element(pairs.backward_error.begin(), pairs.backward_error.end()) <=
             options.tolerance;
    }

    /// Vectors that span the right ones of the modes.
    MultiVector span_of(const EigenSolution &found)
    {
      return found.modes.empty() ? found.reuse.search_space : found.modes.right.real_span();
    }

    [[noreturn]] void throw_inaccurate(const std::vector<double> &backward_errors)
    {
      std::ostringstream message;
      message << "The modes of the window have backward errors up to "
              << *std::max_element(backward_errors.begin(), backward_errors.end()) << ".";
      throw SolverError(message.str(), {Failure::modes_inaccurate});
    }

    EigenSolution ShiftInvertSolver::search_all(const Task &task, MultiVector &start) const
    {
      const auto count_in_region = [&](const EigenSolution &solution)
      {
        const std::vector<Complex> &lambda = solution.proof.eigenvalues;
        return std::count_if(lambda.begin(), lambda.end(),
                             [&](const Complex &l)
                             { return task.in_region(l) && l.imag() > 0 && !is_overdamped(l); });
      };
      // Friction and damping move eigenvalues, so near the rim the numbers of the problem and of
      // its reference may differ without anything missing: then an independent search from another
      // start decides.
      EigenSolution found        = search(task, 0);
      const unsigned int n_found = count_in_region(found), n_expected = task.n_expected;
      start = span_of(found);
      std::ostringstream text;
      if (task.region.is_disc())
        text << n_found << " modes with |lambda| <= 2 pi " << task.region.upper() / (2 * M_PI)
             << " Hz";
      else
        text << n_found << " modes around the window, " << task.region.lower() / (2 * M_PI)
             << " to " << task.region.upper() / (2 * M_PI) << " Hz";
      text << ", " << n_expected << " counted independently, by the inertia of "
           << (task.problem.has_reference() ? task.problem.reference_name
                                            : std::string("the problem itself (it is symmetric)"));
      if (n_found == n_expected)
        text << ": none is missing";
      else
      {
        const EigenSolution again  = search(task, 1);
        const unsigned int n_again = count_in_region(again);
        text << "; a second search from another start vector found " << n_again;
        if (n_again != n_found || is_own_reference(task.problem))
          throw SolverError("Two Krylov searches of the same window found " +
                                std::to_string(n_found) + " and " + std::to_string(n_again) +
                                " modes, the reference problem has " + std::to_string(n_expected) +
                                ": modes are missing.",
                            {Failure::modes_missing});
        if (const MultiVector more = span_of(again); more.n_columns() > 0)
          start.append(more);
        found.cost.n_solves += again.cost.n_solves;
      }
      found.proof.completeness = text.str();
      return found;
    }

    EigenSolution ShiftInvertSolver::solve(const QuadraticEigenproblem &problem,
                                           const EigensolverOptions &options) const
    {
      try
      {
        return solve_in(region_of(options), problem, options);
      }
      catch (const SingularMatrix &)
      {
        if (counts_in_disc(options))
          throw;
        // An undamped mode lies exactly at the centre: another centre.
        return solve_in(region_of(options, 1.1), problem, options);
      }
    }

    EigenSolution ShiftInvertSolver::solve_in(const SearchRegion &region,
                                              const QuadraticEigenproblem &problem,
                                              const EigensolverOptions &options) const
    {
      Stopwatch watch;
      EigenSolution::Cost::Seconds seconds;
      // At shift 0 the position matrix itself is factorised; a rigid body makes it singular.
      const bool is_disc = region.is_disc(), is_counted_here = !options.counted_elsewhere;
      unsigned int n_rigid = 0, n_expected = 0;
      if (is_counted_here)
      {
        const std::vector<unsigned int> n_below =
            count_reference(problem, ends_of(region, options, problem.may_move_rigidly));
        const unsigned int n_lowest = n_below.size() > 1 ? n_below.front() : 0;
        n_rigid                     = is_disc ? n_lowest : 0;
        n_expected                  = n_below.back() - n_lowest;
      }
      const double shift  = is_disc ? shift_of(options, n_rigid > 0) : 0,
                   square = is_disc ? shift * shift : region.square;
      seconds.counting    = watch.lap();
      const Matrix shifted =
          square == 0 ? Matrix()
          : shift == 0
              ? sum_in_places(problem.rows, problem.Q, square, problem.M)
              : sum_of(problem.rows, {{1., problem.Q}, {shift, problem.P}, {square, problem.M}});
      const auto factors = std::make_shared<const Factorization>(
          square == 0 ? problem.Q : shifted, Factorization::Kind::lu,
          "the position matrix (for shift-invert)");
      if (!is_counted_here)
        n_expected = options.counted_elsewhere();
      seconds.factorization = watch.lap();
      const Task task{problem, options, *factors, region, shift, n_expected, n_rigid};

      MultiVector start;
      EigenSolution solution = search_all(task, start);
      EigenPairs &modes      = solution.modes;
      std::vector<Complex> inside;
      for (const Complex &l : solution.proof.eigenvalues)
        if (task.in_region(l) && !is_overdamped(l))
          inside.push_back(l);
      if (inside.empty() || (!is_disc && modes.empty()))
      {
        modes       = {};
        modes.right = ComplexMultiVector(problem.rows, 0);
      }
      else if (!is_accurate(problem, options, modes))
      {
        if (!is_disc)
          throw_inaccurate(modes.backward_error);
        EigenSolution refined = refine_eigenpairs(problem, task.shift_invert(), std::move(start),
                                                  std::move(inside), task.radius(), false, options);
        modes                 = std::move(refined.modes);
        solution.cost.n_solves += refined.cost.n_solves;
      }
      // Without any other term l^2 is real; rounding makes a complex pair of a double one.
      constexpr double rounding = 1e-9;
      for (Complex &l : modes.lambda)
        if (!problem.has_reference() && std::abs(l.real()) <= rounding * l.imag())
          l = Complex(0, std::abs(l));
      solution.proof.n_rigid_body_modes  = n_rigid;
      solution.proof.n_reference         = n_expected + n_rigid;
      solution.cost.factor_memory_mib    = factors->memory_mib();
      solution.cost.predicted_memory_mib = factors->predicted_memory_mib();
      seconds.right                      = watch.lap();
      if (modes.left.n_columns() == 0)
        add_left(task, solution);
      seconds.left          = watch.lap();
      solution.cost.seconds = seconds;
      if (options.keep_factors && has_all_of_disc() && square == 0)
      {
        solution.reuse.factorization = factors;
        solution.reuse.disc_right    = modes.right.real_span();
        solution.reuse.disc_left     = modes.left.real_span();
        solution.reuse.n_reference   = solution.proof.n_reference;
        solution.reuse.disc_lambda   = modes.lambda;
        solution.reuse.clearance     = clearance_of(solution.proof, options.max_imaginary);
      }
      else
        solution.reuse = {};
      if (is_disc && options.looks_beyond_disc)
        solution.reuse.has_no_growth_beyond = !look_for_growth_beyond(task, solution);
      restrict_to_window(problem, options, solution);
      return solution;
    }

    bool ShiftInvertSolver::look_for_growth_beyond(const Task &task, EigenSolution &solution)
    {
      Stopwatch watch;
      EigenSolution::Proof &proof = solution.proof;
      const unsigned int n_found  = std::count_if(
           proof.eigenvalues.begin(), proof.eigenvalues.end(),
           [&](const Complex &l) { return task.in_region(l) && l.imag() > 0 && !is_overdamped(l); });
      GrowthSigns signs;
      try
      {
        signs = signs_of_growth(task.problem, task.options, n_found == task.n_expected, proof);
      }
      catch (const SolverError &error) // the modes of the disc are known nevertheless
      {
        proof.beyond = std::string("not known. ") + error.what();
        return true;
      }
      if (signs.any())
      {
        const EigenSolution beyond = search_growth_beyond(task.problem, task.options, signs);
        if (!beyond.modes.empty())
          solution.modes.append(beyond.modes);
        proof.beyond        = beyond.proof.beyond;
        proof.lacks_growing = beyond.proof.lacks_growing;
        solution.cost.n_solves += beyond.cost.n_solves;
      }
      else
        proof.beyond = "no sign of modes that grow outside of that disc";
      solution.cost.seconds.right += watch.lap();
      return signs.any();
    }

    /// LAPACK on the whole problem; the oracle of the other solvers.
    class Dense : public Eigensolver
    {
    public:
      EigenSolution solve(const QuadraticEigenproblem &problem,
                          const EigensolverOptions &options) const override
      {
        constexpr unsigned int largest = 3000;
        if (problem.rows.size > largest)
          throw SolverError("The dense solver takes at most " + std::to_string(largest) +
                                " unknowns; this problem has " + std::to_string(problem.rows.size) +
                                ".",
                            {Failure::too_large_for_dense});
        const double radius        = search_radius(options.max_imaginary);
        const unsigned int n_rigid = count_rigid_body_modes(problem, options);
        const double shift         = shift_of(options, n_rigid > 0);
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
      return std::make_unique<Dense>();
    default:
      throw InputError("Eigenproblem/Solver = " + name_of(solver) +
                       ": allowed are block_krylov, krylov and dense.");
    }
  }
} // namespace squeal
