#include <squeal/base/stopwatch.h>
#include <squeal/eigen/growth_search.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/eigen/shift_invert_solver.h>
#include <squeal/eigen/window.h>
#include <squeal/linalg/compressed_rows.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/ritz.h>

#include <algorithm>
#include <sstream>

namespace squeal
{
  using Complex = std::complex<double>;

  BlockSearchOptions ShiftInvertSolver::search_options(const Task &task, const unsigned int seed)
  {
    BlockSearchOptions options;
    options.region        = task.region;
    options.max_imaginary = task.options.max_imaginary;
    options.tolerance     = std::min(1e-11, 1e-2 * task.options.tolerance);
    options.n_expected    = task.n_expected + task.n_rigid;
    options.seed          = seed;
    return options;
  }

  void ShiftInvertSolver::add_left_by_block_search(const Task &task, EigenSolution &solution)
  {
    BlockSearchOptions options = search_options(task, 2);
    options.tolerance          = 1e-8; // of vectors: their eigenvalues are known
    options.n_expected         = solution.modes.size() + task.n_rigid;
    search_left_vectors(task.problem, task.shift_invert(true), options, task.options, solution);
  }

  namespace
  {
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

    /// At a shift of zero modes were missed that are nearly at zero: a body on springs of nearly
    /// nothing, or of a mass beyond measure. Beside them a search at zero sees no others.
    struct SoftModes
    {
    };

    [[noreturn]] void throw_inaccurate(const std::vector<double> &backward_errors)
    {
      std::ostringstream message;
      message << "The modes of the window have backward errors up to "
              << *std::max_element(backward_errors.begin(), backward_errors.end()) << ".";
      throw SolverError(message.str(), {Failure::modes_inaccurate});
    }
  } // namespace

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
      text << n_found << " modes around the window, " << task.region.lower() / (2 * M_PI) << " to "
           << task.region.upper() / (2 * M_PI) << " Hz";
    text << ", " << n_expected << " counted independently, by the inertia of "
         << (task.problem.has_reference() ? task.problem.reference_name
                                          : std::string("the problem itself (it is symmetric)"));
    if (n_found == n_expected)
      text << ": none is missing";
    else
    {
      unsigned int n_zero = task.n_rigid;
      if (task.region.is_disc() && n_zero == 0)
        n_zero = count_reference_modes(task.problem, rigid_body_limit(task.options.max_imaginary));
      if (task.region.is_disc() && task.shift == 0 && n_zero > 0)
        throw SoftModes();
      const EigenSolution again  = search(task, 1);
      const unsigned int n_again = count_in_region(again);
      text << "; a second search from another start vector found " << n_again;
      if (n_again != n_found || is_own_reference(task.problem))
        throw SolverError("Two Krylov searches of the same window found " +
                              std::to_string(n_found) + " and " + std::to_string(n_again) +
                              " modes, the reference problem has " + std::to_string(n_expected) +
                              ": modes are missing.",
                          {Failure::modes_missing});
      const unsigned int n_real =
          std::count_if(found.proof.eigenvalues.begin(), found.proof.eigenvalues.end(),
                        [&](const Complex &l) { return task.in_region(l) && is_overdamped(l); });
      check_for_missing(task.problem, task.region, n_found + n_real, n_zero);
      if (const MultiVector more = span_of(again); more.n_columns() > 0)
        start.append(more);
      found.cost.n_solves += again.cost.n_solves;
    }
    found.proof.completeness = text.str();
    return found;
  }

  EigenSolution ShiftInvertSolver::solve(const QuadraticEigenproblem &problem,
                                         const EigensolverOptions &options,
                                         const Counting &counting) const
  {
    const SearchRegion region = search_region(kind, options);
    try
    {
      return solve_in(region, problem, options, counting, problem.may_move_rigidly);
    }
    catch (const SoftModes &)
    {
      return solve_in(region, problem, options, {}, true);
    }
    catch (const SingularMatrix &)
    {
      if (region.is_disc())
        throw;
      // An undamped mode lies exactly at the centre: another centre.
      return solve_in(search_region(kind, options, 1.1), problem, options, counting,
                      problem.may_move_rigidly);
    }
  }

  EigenSolution ShiftInvertSolver::solve_in(const SearchRegion &region,
                                            const QuadraticEigenproblem &problem,
                                            const EigensolverOptions &options,
                                            const Counting &counting, const bool may_be_soft) const
  {
    Stopwatch watch;
    EigenSolution::Cost::Seconds seconds;
    // At shift 0 the position matrix itself is factorised; a rigid body makes it singular.
    const bool is_disc   = region.is_disc();
    unsigned int n_rigid = 0, n_expected = 0;
    if (!counting)
    {
      const std::vector<unsigned int> n_below =
          count_reference(problem, ends_of(region, options, may_be_soft));
      const unsigned int n_lowest = n_below.size() > 1 ? n_below.front() : 0;
      n_rigid                     = is_disc ? n_lowest : 0;
      n_expected                  = n_below.back() - n_lowest;
    }
    const double shift  = is_disc ? real_shift(options, n_rigid > 0) : 0,
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
    if (counting)
      n_expected = counting();
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
      // What was counted as rigid may diverge: squares of frequencies below zero are not told
      // apart.
      signs = signs_of_growth(task.problem, task.options,
                              n_found == task.n_expected && task.n_rigid == 0, proof);
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
} // namespace squeal
