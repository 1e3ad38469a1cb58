#include <squeal/base/stopwatch.h>
#include <squeal/eigen/block_krylov.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/eigen/inertia_count.h>
#include <squeal/eigen/interval_search.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/eigen/slepc_pep.h>
#include <squeal/linalg/compressed_rows.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>

namespace squeal
{
  using Complex = std::complex<double>;

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

    bool is_wanted(const EigensolverOptions &options, const Complex &l)
    {
      return l.imag() >= options.min_imaginary && l.imag() <= options.max_imaginary;
    }

    /// x := f x for every column of a complex block.
    void scale(MultiVector &re, MultiVector &im, const std::vector<Complex> &factors)
    {
      for (unsigned int k = 0; k < factors.size(); ++k)
        for (unsigned int i = 0; i < re.n_local(); ++i)
        {
          const Complex x = factors[k] * Complex(re.column(k)[i], im.column(k)[i]);
          re.column(k)[i] = x.real();
          im.column(k)[i] = x.imag();
        }
    }

    /// The factors that turn the largest component of each column to the real axis.
    std::vector<Complex> turning_factors(const RowRange &rows, const MultiVector &re,
                                         const MultiVector &im)
    {
      // The first of the largest components, which may be equal by symmetry: rounding and the
      // number of ranks are not to choose.
      const unsigned int n = re.n_columns();
      const auto size_of   = [&](const unsigned int i, const unsigned int k)
      { return std::hypot(re.column(k)[i], im.column(k)[i]); };
      std::vector<double> largest(n, 0.);
      for (unsigned int k = 0; k < n; ++k)
        for (unsigned int i = 0; i < rows.n_local(); ++i)
          largest[k] = std::max(largest[k], size_of(i, k));
      MPI_Allreduce(MPI_IN_PLACE, largest.data(), n, MPI_DOUBLE, MPI_MAX, rows.comm);
      std::vector<unsigned int> first(n, rows.size); // global row
      for (unsigned int k = 0; k < n; ++k)
        for (unsigned int i = 0; i < rows.n_local() && first[k] == rows.size; ++i)
          if (!(size_of(i, k) * (1 + 1e-8) < largest[k]))
            first[k] = rows.begin + i;
      MPI_Allreduce(MPI_IN_PLACE, first.data(), n, MPI_UNSIGNED, MPI_MIN, rows.comm);
      std::vector<Complex> factors(n);
      for (unsigned int k = 0; k < n; ++k)
        if (rows.contains(first[k]))
        {
          const unsigned int i = first[k] - rows.begin;
          factors[k] = largest[k] > 0 ? Complex(re.column(k)[i], -im.column(k)[i]) / size_of(i, k)
                                      : Complex(1);
        }
      MPI_Allreduce(MPI_IN_PLACE, factors.data(), 2 * n, MPI_DOUBLE, MPI_SUM, rows.comm);
      return factors;
    }
  } // namespace

  void turn_to_real(Modes &modes)
  {
    // z^H Q'(l) x does not change if both are multiplied by the same factor of modulus 1.
    const std::vector<Complex> factors = turning_factors(modes.re.row_range(), modes.re, modes.im);
    scale(modes.re, modes.im, factors);
    scale(modes.left_re, modes.left_im, factors);
  }

  void normalise(const QuadraticEigenproblem &problem, Modes &modes)
  {
    const unsigned int n = modes.lambda.size(), n_local = problem.rows.n_local();
    // Sums over the rows of x^H M x, z^H M z, z^H (2 l M + P) x
    std::vector<Complex> sums(3 * n), factors = turning_factors(problem.rows, modes.re, modes.im),
                                      left_factors(n);
    const MultiVector m_re = multiply(problem.M, modes.re), m_im = multiply(problem.M, modes.im),
                      p_re = multiply(problem.P, modes.re), p_im = multiply(problem.P, modes.im),
                      z_re = multiply(problem.M, modes.left_re),
                      z_im = multiply(problem.M, modes.left_im);
    const auto entry =
        [](const MultiVector &re, const MultiVector &im, const unsigned int k, const unsigned int i)
    { return Complex(re.column(k)[i], im.column(k)[i]); };
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int i = 0; i < n_local; ++i)
      {
        const Complex x = entry(modes.re, modes.im, k, i),
                      z = entry(modes.left_re, modes.left_im, k, i), mx = entry(m_re, m_im, k, i);
        sums[3 * k] += std::conj(x) * mx;
        sums[3 * k + 1] += std::conj(z) * entry(z_re, z_im, k, i);
        sums[3 * k + 2] += std::conj(z) * (2. * modes.lambda[k] * mx + entry(p_re, p_im, k, i));
      }
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2 * sums.size(), MPI_DOUBLE, MPI_SUM,
                  problem.rows.comm);
    modes.condition.clear();
    for (unsigned int k = 0; k < n; ++k)
    {
      const double x_norm   = std::sqrt(sums[3 * k].real()),
                   z_norm   = std::sqrt(sums[3 * k + 1].real());
      const Complex product = sums[3 * k + 2];
      modes.condition.push_back(z_norm * x_norm * std::abs(2. * modes.lambda[k]) /
                                std::abs(product));
      factors[k] /= x_norm;
      left_factors[k] = std::conj(2. * modes.lambda[k] / (product * factors[k]));
    }
    scale(modes.re, modes.im, factors);
    scale(modes.left_re, modes.left_im, left_factors);
  }

  namespace
  {
    /// The modes inside the window, sorted.
    Modes in_window(const QuadraticEigenproblem &problem, const EigensolverOptions &options,
                    Modes modes)
    {
      std::vector<unsigned int> order;
      unsigned int n_zero = 0;
      for (unsigned int j = 0; j < modes.lambda.size(); ++j)
        if (std::abs(modes.lambda[j]) <= rigid_body_limit(options.max_imaginary))
          ++n_zero;
        else if (is_wanted(options, modes.lambda[j]) &&
                 (modes.lambda[j].imag() > 0 || modes.lambda[j].real() > 0))
          order.push_back(j); // real eigenvalues only if they diverge
      std::sort(order.begin(), order.end(),
                [&](const unsigned int a, const unsigned int b)
                { return precedes(modes.lambda[a], modes.lambda[b]); });

      Modes result              = modes;
      result.disc_lambda        = modes.lambda;
      result.n_rigid_body_modes = modes.n_rigid_body_modes + n_zero / 2;
      const auto select         = [&](auto &values)
      {
        const auto all = values;
        values.clear();
        for (const unsigned int j : order)
          values.push_back(all[j]);
      };
      select(result.lambda);
      select(result.backward_error);
      select(result.left_backward_error);
      for (MultiVector Modes::*block : {&Modes::re, &Modes::im, &Modes::left_re, &Modes::left_im})
      {
        result.*block = MultiVector(problem.rows, order.size());
        for (unsigned int k = 0; k < order.size(); ++k)
          std::copy_n((modes.*block).column(order[k]), problem.rows.n_local(),
                      (result.*block).column(k));
      }
      return result;
    }

    /// One real factorisation at a real shift, and a search with it; the completeness check and the
    /// vectors are the same whichever search it is.
    class ShiftInvertSolver : public Eigensolver
    {
    public:
      Modes solve(const QuadraticEigenproblem &problem,
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
      struct Search
      {
        std::vector<Complex> lambda; ///< with Im l >= 0
        MultiVector vectors;         ///< Re and Im
        Pairs pairs;                 ///< those of the region, if they are converged already
        Pairs left;                  ///< Q(l)^T y = 0 in the order of pairs, if found, too
        std::vector<double> errors,  ///< backward errors of both, if known
            left_errors;
        MultiVector space; ///< searched, if the solver has a basis
        unsigned int n_solves = 0;
      };
      virtual Search search(const Task &task, unsigned int seed) const = 0;
      virtual void add_left(const Task &task, Modes &modes) const      = 0;
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
      Modes solve_in(const SearchRegion &region, const QuadraticEigenproblem &problem,
                     const EigensolverOptions &options) const;
      /// Searches twice if the inertia does not confirm the number found.
      Search search_all(const Task &task, std::string &completeness) const;

      mutable RememberedCounts count_reference;
    };

    /// SLEPc's PEP: single vectors.
    class Krylov : public ShiftInvertSolver
    {
      Search search(const Task &task, const unsigned int seed) const override
      {
        SlepcPep found = pep_search(task.problem, task.factorization, task.shift,
                                    std::hypot(task.radius(), task.shift),
                                    2 * (task.n_expected + task.n_rigid) + 4, seed, task.options);
        Search result;
        result.lambda  = std::move(found.lambda);
        result.vectors = std::move(found.vectors);
        return result;
      }
      void add_left(const Task &task, Modes &modes) const override
      {
        add_left_vectors(task.problem, task.shift_invert(true), task.radius(), task.options, modes);
      }
    };

    /// Block Krylov: as many right-hand sides a step as the factors serve at the cost of a
    /// few.
    class BlockKrylov : public ShiftInvertSolver
    {
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
      /// In a window velocity terms are no part of the factors.
      static Search search_with_velocity_terms(const Task &task, const unsigned int seed)
      {
        IntervalSearchOptions options;
        options.region        = task.region;
        options.min_imaginary = task.options.min_imaginary;
        options.max_imaginary = task.options.max_imaginary;
        options.tolerance     = task.options.tolerance;
        options.only_count    = seed > 0; // the second search confirms the number
        options.n_expected    = task.n_expected;
        options.seed          = seed;
        IntervalSearch found =
            window_search(task.problem, task.factorization, options, task.options.progress);
        Search result;
        result.lambda      = std::move(found.lambda);
        result.n_solves    = found.n_solves;
        result.pairs       = std::move(found.right);
        result.errors      = std::move(found.backward_error);
        result.left        = std::move(found.left);
        result.left_errors = std::move(found.left_backward_error);
        return result;
      }
      Search search(const Task &task, const unsigned int seed) const override
      {
        if (!task.region.is_disc() && task.problem.P)
          return search_with_velocity_terms(task, seed);
        BlockSearch found = block_krylov_search(task.problem, task.shift_invert(),
                                                search_options(task, seed), task.options.progress);
        Search result;
        result.lambda   = found.pairs.lambda;
        result.n_solves = found.n_solves;
        if (task.options.keep_factors)
          result.space = std::move(found.space);
        std::vector<unsigned int> inside;
        for (unsigned int j = 0; j < result.lambda.size(); ++j)
          if (task.in_region(result.lambda[j]) &&
              (task.region.is_disc() || is_wanted(task.options, result.lambda[j])))
            inside.push_back(j);
        result.pairs   = select(found.pairs, inside);
        result.vectors = result.pairs.re;
        result.vectors.append(result.pairs.im);
        return result;
      }
      void add_left(const Task &task, Modes &modes) const override
      {
        BlockSearchOptions options = search_options(task, 2);
        options.tolerance          = 1e-8; // of vectors: their eigenvalues are known
        options.n_expected         = modes.lambda.size() + task.n_rigid;
        search_left_vectors(task.problem, task.shift_invert(true), options, task.options, modes);
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

    ShiftInvertSolver::Search ShiftInvertSolver::search_all(const Task &task,
                                                            std::string &completeness) const
    {
      const auto count_in_region = [&](const std::vector<Complex> &lambda)
      {
        return std::count_if(lambda.begin(), lambda.end(),
                             [&](const Complex &l) { return task.in_region(l) && l.imag() > 0; });
      };
      // Friction and damping move eigenvalues, so near the rim the numbers of the problem and of
      // its reference may differ without anything missing: then an independent search from another
      // start decides.
      Search found               = search(task, 0);
      const unsigned int n_found = count_in_region(found.lambda), n_expected = task.n_expected;
      std::ostringstream text;
      if (task.region.is_disc())
        text << n_found << " modes with |l| <= 2 pi " << task.region.upper() / (2 * M_PI) << " Hz";
      else
        text << n_found << " modes around the window, " << task.region.lower() / (2 * M_PI)
             << " to " << task.region.upper() / (2 * M_PI) << " Hz";
      text << "; the inertia of "
           << (task.problem.has_reference() ? task.problem.reference_name
                                            : std::string("the problem itself (it is symmetric)"))
           << " proves " << n_expected << " there";
      if (n_found != n_expected)
      {
        Search again               = search(task, 1);
        const unsigned int n_again = count_in_region(again.lambda);
        text << "; a second search from another start vector found " << n_again;
        if (n_again != n_found || is_own_reference(task.problem))
          throw SolverError("Two Krylov searches of the same window found " +
                            std::to_string(n_found) + " and " + std::to_string(n_again) +
                            " modes, the reference problem has " + std::to_string(n_expected) +
                            ": modes are missing. Try a smaller Eigenproblem/Tolerance, or "
                            "Eigenproblem/Solver = dense for a small problem.");
        found.vectors.append(again.vectors);
        found.n_solves += again.n_solves;
      }
      completeness = text.str();
      return found;
    }

    [[noreturn]] void throw_inaccurate(const std::vector<double> &backward_errors)
    {
      std::ostringstream message;
      message << "The modes of the window have backward errors up to "
              << *std::max_element(backward_errors.begin(), backward_errors.end())
              << ". Try a larger Eigenproblem/Tolerance, or Eigenproblem/Solver = krylov.";
      throw SolverError(message.str());
    }

    /// The pairs as they are, if they are good enough; their backward errors if they are known.
    bool accept(const QuadraticEigenproblem &problem, const EigensolverOptions &options,
                Pairs &pairs, std::vector<double> errors, Modes &modes)
    {
      if (pairs.lambda.empty())
        return false;
      modes.backward_error = !errors.empty()
                                 ? std::move(errors)
                                 : BackwardError(problem)(pairs.lambda, pairs.re, pairs.im).errors;
      if (*std::max_element(modes.backward_error.begin(), modes.backward_error.end()) >
          options.tolerance)
        return false;
      modes.lambda = std::move(pairs.lambda);
      modes.re     = std::move(pairs.re);
      modes.im     = std::move(pairs.im);
      return true;
    }

    Modes ShiftInvertSolver::solve(const QuadraticEigenproblem &problem,
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

    Modes ShiftInvertSolver::solve_in(const SearchRegion &region,
                                      const QuadraticEigenproblem &problem,
                                      const EigensolverOptions &options) const
    {
      Stopwatch watch;
      Modes::Seconds seconds;
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

      std::string completeness;
      Search found = search_all(task, completeness);
      Modes modes;
      if (!is_disc && found.pairs.lambda.empty())
        modes.re = modes.im = MultiVector(problem.rows, 0);
      else if (!accept(problem, options, found.pairs, std::move(found.errors), modes))
      {
        if (!is_disc)
          throw_inaccurate(modes.backward_error);
        std::vector<Complex> inside;
        for (const Complex &l : found.lambda)
          if (task.in_region(l))
            inside.push_back(l);
        modes = polish(problem, task.shift_invert(), std::move(found.vectors), inside,
                       task.radius(), false, options);
      }
      // Without any other term l^2 is real; rounding makes a complex pair of a double one.
      constexpr double rounding = 1e-9;
      for (Complex &l : modes.lambda)
        if (!problem.has_reference() && std::abs(l.real()) <= rounding * l.imag())
          l = Complex(0, std::abs(l));
      modes.n_solves += found.n_solves;
      modes.n_rigid_body_modes   = n_rigid;
      modes.n_reference          = n_expected + n_rigid;
      modes.factor_memory_mib    = factors->memory_mib();
      modes.predicted_memory_mib = factors->predicted_memory_mib();
      modes.completeness         = completeness;
      seconds.right              = watch.lap();
      if (found.left.lambda.empty())
        add_left(task, modes);
      else
        attach_left_vectors(problem, std::move(found.left), std::move(found.left_errors), modes);
      seconds.left  = watch.lap();
      modes.seconds = seconds;
      if (options.keep_factors && has_all_of_disc() && square == 0)
      {
        modes.factorization = factors;
        modes.search_space  = std::move(found.space);
        modes.disc_right    = modes.re;
        modes.disc_right.append(modes.im);
        modes.disc_left = modes.left_re;
        modes.disc_left.append(modes.left_im);
      }
      modes = in_window(problem, options, std::move(modes));
      normalise(problem, modes);
      return modes;
    }

    /// LAPACK on the whole problem; the oracle of the other solvers.
    class Dense : public Eigensolver
    {
    public:
      Modes solve(const QuadraticEigenproblem &problem,
                  const EigensolverOptions &options) const override
      {
        constexpr unsigned int largest = 3000;
        if (problem.rows.size > largest)
          throw SolverError("The dense solver takes at most " + std::to_string(largest) +
                            " unknowns; this problem has " + std::to_string(problem.rows.size) +
                            ". Use Eigenproblem/Solver = block_krylov.");
        // Every rank solves the whole problem: the basis of the projection is the identity.
        MultiVector identity(problem.rows, problem.rows.size);
        for (unsigned int row = problem.rows.begin; row < problem.rows.end; ++row)
          identity.column(row)[row - problem.rows.begin] = 1;
        const double radius        = search_radius(options.max_imaginary);
        const unsigned int n_rigid = count_rigid_body_modes(problem, options);
        const double shift         = shift_of(options, n_rigid > 0);
        options.progress("  dense: " + std::to_string(problem.rows.size) + " unknowns");
        Pairs pairs = rayleigh_ritz(problem, identity, identity, radius, shift);
        // Rounding decides how many of the defective zeros of a free body have Im l >= 0, in the
        // transposed problem anew: they are counted and left out.
        std::vector<unsigned int> moving;
        for (unsigned int j = 0; j < pairs.lambda.size(); ++j)
          if (std::abs(pairs.lambda[j]) > rigid_body_limit(options.max_imaginary))
            moving.push_back(j);
        pairs = select(pairs, moving);
        Modes modes;
        modes.n_rigid_body_modes = n_rigid;
        modes.backward_error     = BackwardError(problem)(pairs.lambda, pairs.re, pairs.im).errors;
        modes.lambda             = pairs.lambda;
        modes.re                 = std::move(pairs.re);
        modes.im                 = std::move(pairs.im);
        for (const double error : modes.backward_error)
          if (error > options.tolerance)
            throw SolverError("The dense solver's backward error is " + std::to_string(error) +
                              ". Try a larger Eigenproblem/Tolerance.");
        modes.completeness = "all eigenvalues were computed";
        add_left_vectors(problem, identity, shift, radius, modes);
        modes = in_window(problem, options, std::move(modes));
        normalise(problem, modes);
        return modes;
      }
    };
  } // namespace

  std::unique_ptr<Eigensolver> make_eigensolver(const std::string &name)
  {
    if (name == "block_krylov")
      return std::make_unique<BlockKrylov>();
    if (name == "krylov")
      return std::make_unique<Krylov>();
    if (name == "dense")
      return std::make_unique<Dense>();
    throw InputError("Eigenproblem/Solver = " + name +
                     ": allowed are block_krylov, krylov and dense.");
  }
} // namespace squeal
