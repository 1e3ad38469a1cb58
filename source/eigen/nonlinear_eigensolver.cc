#include <squeal/base/stopwatch.h>
#include <squeal/base/subcommunicator.h>
#include <squeal/base/text.h>
#include <squeal/eigen/given_matrices.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/eigen/nonlinear_eigensolver.h>
#include <squeal/eigen/window.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/davidson.h>
#include <squeal/projection/projected_nonlinear.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

// Modes of moduli that depend on the frequency. NonlinearEigensolver::solve() at the end has the
// quadratic problem solved first and hands its vectors and factors to Search, which brings to
// Davidson two bases and inverse iteration with the factors (method()). A step corrects the pairs
// in the enlarged spaces or follows them from the frozen moduli (update()), takes a step of inverse
// iteration on both sides (iterate()), and gives what is not accurate to the engine
// (inaccurate()).

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Where the frozen terms are zero.
    QuadraticEigenproblem quadratic_part(const QuadraticEigenproblem &problem)
    {
      QuadraticEigenproblem result  = problem.of_same_unknowns();
      result.M                      = problem.M.view(false);
      result.P                      = problem.P.view(problem.P.is_transposed());
      result.Q                      = problem.Q.view(problem.Q.is_transposed());
      result.reference              = problem.reference.view(false);
      result.make_shifted_reference = problem.make_shifted_reference;
      result.reference_name         = problem.reference_name;
      result.may_move_rigidly       = problem.may_move_rigidly;
      result.may_excite             = problem.may_excite;
      return result;
    }

    /// Factors of the quadratic problem at a shift, and what it found in a region.
    struct Start
    {
      std::vector<Complex> lambda; ///< without overdamped ones, whose vectors may be there
      MultiVector right, left;     ///< real spans of the vectors
      std::shared_ptr<const Factorization> factorization;
      double shift = 0;
    };

    /// The search for right and left vectors in two growing spaces V and W, in which the problem
    /// is W^T T(l) V: an eigenvalue's error is of the order of the right vector's times the left
    /// one's. Vectors of the spaces keep the contact conditions of the problem and of its
    /// transpose, so that multipliers have no part in it.
    class Search
    {
    public:
      Search(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
             const ShiftInvert &transposed, const EigensolverOptions &options)
          : right{problem, shift_invert}, adjoint(adjoint_of(problem)), left{adjoint, transposed},
            options(options), davidson(problem, method())
      {
      }

      /// All modes that become of the quadratic problem's, with vectors @p of_right and @p of_left
      /// that span those, the ones of the window to the tolerance. Afterwards left_pairs() are
      /// those of the transposed problem.
      EigenPairs run(MultiVector of_right, MultiVector of_left,
                     const std::vector<Complex> &quadratic);
      EigenPairs &left_pairs()
      {
        return left.pairs;
      }
      /// Eigenvalues of the quadratic problem that lead to a mode, in the order of the pairs.
      const std::vector<Complex> &starts() const
      {
        return quadratic;
      }

      unsigned int n_solves  = 0;
      unsigned int n_steps   = 0; ///< of following, the last time
      double seconds_of_left = 0; ///< of inverse iteration

    private:
      /// The problem or its transpose.
      struct Equations
      {
        Equations(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert)
            : problem(problem), shift_invert(shift_invert), backward_error(problem)
        {
        }
        /// Makes pairs of Ritz vectors by one step of inverse iteration.
        void iterate(const std::vector<Complex> &lambda, ComplexMultiVector vectors);

        const QuadraticEigenproblem &problem;
        const ShiftInvert &shift_invert;
        BackwardError backward_error;
        EigenPairs pairs;
      };

      DavidsonMethod method();
      /// The two-sided Rayleigh corrections of the present pairs.
      std::vector<Complex> rayleigh_corrections() const;
      /// Follows the modes in the present spaces. Returns the numbers of those that are left.
      std::vector<unsigned int> follow();
      /// Keeps what is known of these modes alone.
      void keep(const std::vector<unsigned int> &numbers);
      /// Corrects the pairs in the enlarged spaces, or follows them where they would move too far;
      /// the first time follows them. Begins anew where neither succeeds. The first rank does it
      /// for all: dense results differ by rounding from rank to rank, and the way that is taken
      /// with them.
      void update(bool first_time, bool pairs_are_best = false);
      /// Makes the vectors of the present pairs, and takes one step of inverse iteration of them.
      void iterate();
      /// Pairs that have not settled or whose backward errors are too large.
      std::vector<unsigned int> inaccurate(unsigned int step);
      /// Remembers the present pairs if they are the most accurate ones so far; if not, begins anew
      /// with those that are. Returns whether it has begun anew.
      bool return_to_best();
      /// Begins anew with the most accurate pairs so far.
      void begin_anew();
      [[noreturn]] void throw_not_refined() const;
      double bound(const Complex &l) const
      {
        return is_wanted(options, l) ? options.tolerance : 1e-3;
      }

      Equations right;
      const QuadraticEigenproblem adjoint;
      Equations left;
      const EigensolverOptions &options;
      Davidson davidson;
      SmallPairs pairs;
      std::vector<Complex> quadratic, previous; ///< eigenvalues without the frozen terms; before
      std::vector<double> changes, errors;
      double worst = 0, worst_before = std::numeric_limits<double>::infinity();
      bool has_begun_anew = false;
      struct
      {
        EigenPairs right, left;
        double worst = std::numeric_limits<double>::infinity();
      } best;
    };

    DavidsonMethod Search::method()
    {
      DavidsonMethod result;
      result.has_two_bases = true;
      result.most_steps    = 30;
      result.constrain     = [this](MultiVector &columns, const Side side)
      { clear_multipliers(side == Side::right ? right.problem : adjoint, columns); };
      result.partners = [this](const MultiVector &others, const Side side)
      {
        n_solves += others.n_columns();
        const Equations &own = side == Side::right ? right : left;
        return own.shift_invert.solve(multiply(own.problem.M, others));
      };
      return result;
    }

    std::vector<unsigned int> Search::follow()
    {
      const SmallProblem &small = davidson.projected();
      const SmallPairs all =
          small.solve(right.shift_invert.shift, search_radius(options.max_imaginary), true);
      const std::vector<unsigned int> partners = nearest_partners(quadratic, all.lambda);
      if (partners.size() < quadratic.size())
        throw SolverError("Modes of the problem with frozen moduli are missing in its own space.",
                          {Failure::modes_may_come_in});
      pairs = all.select(partners);
      pairs.right.normalise();
      pairs.left.normalise();
      Followed followed = follow_to_exact(small, pairs);
      n_steps           = followed.n_steps;
      return std::move(followed.kept);
    }

    void Search::keep(const std::vector<unsigned int> &numbers)
    {
      const auto select = [&](auto &values)
      {
        auto all = std::exchange(values, {});
        for (const unsigned int j : numbers)
          if (!all.empty())
            values.push_back(all[j]);
      };
      select(quadratic);
      select(previous);
      select(changes);
      if (!best.right.empty())
      {
        best.right = best.right.select(numbers);
        best.left  = best.left.select(numbers);
      }
    }

    bool Search::return_to_best()
    {
      // Errors of right and of left vectors that have nothing to do with each other make W^T T V
      // nearly singular in the end: then a larger space has worse pairs.
      if (worst < best.worst)
      {
        best = {right.pairs, left.pairs, worst};
        return false;
      }
      begin_anew();
      return true;
    }

    void Search::begin_anew()
    {
      davidson.restart({best.right.right.real_span(), best.left.right.real_span()});
      previous = pairs.lambda = best.right.lambda;
      pairs.right             = davidson.coordinates(best.right.right, Side::right);
      pairs.left              = davidson.coordinates(best.left.right, Side::left);
      has_begun_anew          = true;
    }

    void Search::update(const bool first_time, const bool pairs_are_best)
    {
      const MPI_Comm comm     = right.problem.rows.comm;
      const unsigned int size = davidson.n_columns();
      std::vector<unsigned int> kept(quadratic.size());
      std::iota(kept.begin(), kept.end(), 0u);
      pairs.right.resize_rows(size);
      pairs.left.resize_rows(size);
      int rank = 0, is_lost = 0;
      MPI_Comm_rank(comm, &rank);
      work_apart(comm,
                 [&]
                 {
                   if (rank > 0 || (!first_time && correct_exact(davidson.projected(), pairs)))
                     return;
                   // The quadratic problem's modes are no longer in a space that has begun anew.
                   is_lost = has_begun_anew;
                   try
                   {
                     if (!is_lost)
                       kept = follow();
                   }
                   catch (const SolverError &)
                   {
                     if (first_time)
                       throw;
                     is_lost = 1;
                   }
                 });
      MPI_Bcast(&is_lost, 1, MPI_INT, 0, comm);
      if (is_lost)
      {
        if (pairs_are_best)
          throw_not_refined();
        begin_anew();
        update(false, true);
        return;
      }
      unsigned int n = kept.size();
      MPI_Bcast(&n, 1, MPI_UNSIGNED, 0, comm);
      kept.resize(n);
      MPI_Bcast(kept.data(), n, MPI_UNSIGNED, 0, comm);
      keep(kept);
      if (rank > 0)
        pairs = {
            std::vector<Complex>(n), ComplexDenseMatrix(size, n), ComplexDenseMatrix(size, n), {}};
      for (std::vector<Complex> *numbers : {&pairs.lambda, &pairs.right.values, &pairs.left.values})
        MPI_Bcast(numbers->data(), numbers->size(), MPI_CXX_DOUBLE_COMPLEX, 0, comm);
      MPI_Bcast(&n_steps, 1, MPI_UNSIGNED, 0, comm);
    }

    void Search::Equations::iterate(const std::vector<Complex> &lambda, ComplexMultiVector vectors)
    {
      pairs        = EigenPairs();
      pairs.lambda = lambda;
      pairs.right  = std::move(vectors);
      inverse_iteration(problem, shift_invert, pairs);
      pairs.backward_error = backward_error(pairs);
    }

    void Search::iterate()
    {
      right.iterate(pairs.lambda, davidson.vectors(pairs.right, Side::right));
      Stopwatch watch;
      left.iterate(pairs.lambda, davidson.vectors(pairs.left, Side::left));
      seconds_of_left += watch.lap();
      n_solves += 4 * pairs.size();
    }

    std::vector<Complex> Search::rayleigh_corrections() const
    {
      const EigenPairs &modes = right.pairs;
      ComplexMultiVector z    = left.pairs.right; // T(l)^T y = 0: z = conj(y)
      z.conjugate();
      const auto form_of = [&](const Matrix &matrix)
      { return diagonal_form(z, matrix, modes.right); };
      RayleighCorrections corrections(modes.lambda);
      corrections.add(2, 1, form_of(right.problem.M));
      corrections.add(1, 1, form_of(right.problem.P));
      corrections.add(0, 1, form_of(right.problem.Q));
      for (const FrozenTerm &term : right.problem.frozen)
        corrections.add(term, form_of(term.matrix));
      return corrections.values();
    }

    std::vector<unsigned int> Search::inaccurate(const unsigned int step)
    {
      changes.resize(pairs.size(), 1);
      errors.resize(pairs.size());
      const std::vector<Complex> corrections = rayleigh_corrections();
      std::vector<unsigned int> result;
      worst = 0;
      for (unsigned int j = 0; j < pairs.size(); ++j)
      {
        const Complex l = pairs.lambda[j];
        // The eigenvalue must have settled, too, or be so uncertain by rounding that its changes
        // do not become smaller.
        constexpr double uncertain = 1e-5, infinity = std::numeric_limits<double>::infinity();
        errors[j] = std::max(right.pairs.backward_error[j], left.pairs.backward_error[j]);
        const double change =
            std::min(std::abs(corrections[j]), step == 0 ? infinity : std::abs(l - previous[j])) /
            std::abs(l);
        const bool settled = change <= bound(l) || (change <= uncertain && change >= changes[j]);
        changes[j]         = change;
        if (errors[j] > bound(l) || !settled)
          result.push_back(j);
        if (is_wanted(options, l))
          worst = std::max(worst, errors[j]);
      }
      options.progress(text_of("  exact moduli, step ", step, ": ", davidson.n_columns(),
                               " vectors, largest backward error ", worst));
      constexpr double in_vain = 0.5;
      if (worst > in_vain * worst_before)
        davidson.add_partners();
      worst_before = worst;
      previous     = right.pairs.lambda;
      return result;
    }

    void Search::throw_not_refined() const
    {
      throw SolverError(
          text_of("The modes of the problem with moduli that depend on the frequency have "
                  "backward errors of ",
                  best.worst, " at best."),
          {Failure::dense_inaccurate}); // dense begins with other vectors, and ends here, too
    }

    EigenPairs Search::run(MultiVector of_right, MultiVector of_left,
                           const std::vector<Complex> &eigenvalues)
    {
      quadratic = eigenvalues;
      davidson.expand({std::move(of_right), std::move(of_left)});
      const auto correct = [&](const unsigned int step) -> std::optional<BothSides>
      {
        update(step == 0);
        iterate();
        const std::vector<unsigned int> open = inaccurate(step);
        if (open.empty())
          return std::nullopt;
        if (return_to_best())
          return BothSides{MultiVector(right.problem.rows, 0), MultiVector(right.problem.rows, 0)};
        return BothSides{right.pairs.right.columns(open).real_span(),
                         left.pairs.right.columns(open).real_span()};
      };
      if (!davidson.run(correct))
        throw_not_refined();
      return std::move(right.pairs);
    }

    /// The quadratic problem's modes were searched up to the rim of the disc. Those at the window's
    /// end show how much deeper exact frequencies lie: the rim must be twice as far as that.
    void check_that_none_comes_in(const std::vector<Complex> &quadratic,
                                  const std::vector<Complex> &exact, const double max_imaginary)
    {
      constexpr double at_the_end = 0.9;
      double ratio                = 1;
      for (unsigned int j = 0; j < exact.size(); ++j)
        if (exact[j].imag() >= at_the_end * max_imaginary)
          ratio = std::max(ratio, quadratic[j].imag() / exact[j].imag());
      if (1 + 2 * (ratio - 1) > search_radius(1))
        throw SolverError(
            text_of("Modes may be missing: with exact moduli frequencies at the window's end are ",
                    100 * (ratio - 1), " % lower than with those frozen at 2 pi ",
                    max_imaginary / (2 * M_PI), " Hz, and these were searched up to ",
                    100 * (search_radius(1) - 1), " % beyond the end only."),
            {Failure::modes_may_come_in});
    }

    /// What a solver has kept of its disc, and the modes that grow outside of it.
    Start kept_start(EigenSolution &solution, const EigensolverOptions &options)
    {
      Start start;
      start.factorization = solution.reuse.factorization;
      start.lambda        = solution.reuse.disc_lambda;
      start.right         = std::move(solution.reuse.disc_right);
      start.left          = std::move(solution.reuse.disc_left);
      std::vector<unsigned int> beyond;
      for (unsigned int j = 0; j < solution.modes.size(); ++j)
        if (std::abs(solution.modes.lambda[j]) > search_radius(options.max_imaginary))
        {
          beyond.push_back(j);
          start.lambda.push_back(solution.modes.lambda[j]);
        }
      if (!beyond.empty())
      {
        start.right.append(solution.modes.right.columns(beyond).real_span());
        start.left.append(solution.modes.left.columns(beyond).real_span());
      }
      start.lambda.erase(std::remove_if(start.lambda.begin(), start.lambda.end(), is_overdamped),
                         start.lambda.end());
      return start;
    }

    /// Modes of a solver without factors, which has searched a window as wide as the disc.
    Start start_with_factors(const QuadraticEigenproblem &problem, const EigenSolution &solution,
                             const EigensolverOptions &options)
    {
      Start start;
      start.lambda        = solution.modes.lambda;
      start.right         = solution.modes.right.real_span();
      start.left          = solution.modes.left.real_span();
      start.shift         = solution.proof.n_rigid_body_modes > 0 ? 0.1 * options.max_imaginary : 0;
      start.factorization = std::make_shared<const Factorization>(
          start.shift == 0 ? sum_of(problem.rows, {{1., problem.Q}})
                           : sum_of(problem.rows, {{1., problem.Q},
                                                   {start.shift, problem.P},
                                                   {start.shift * start.shift, problem.M}}),
          Factorization::Kind::lu, "the position matrix (for modes with exact moduli)");
      return start;
    }

    std::string text_of_following(const QuadraticEigenproblem &problem,
                                  const unsigned int n_started, const unsigned int n_steps,
                                  const unsigned int n_kept)
    {
      std::string text =
          text_of("; moduli frozen at 2 pi ", problem.frozen.front().frequency / (2 * M_PI),
                  " Hz until there; each of ", n_started,
                  " modes that are not overdamped was followed to the exact moduli, in ", n_steps,
                  " steps, and no two met");
      if (n_kept < n_started)
        text += text_of("; ", n_started - n_kept,
                        " of them could be followed until nearly overdamped only (damping ratio "
                        "above ",
                        nearly_overdamped, ") and are not listed");
      return text;
    }
  } // namespace

  EigenSolution NonlinearEigensolver::solve(const QuadraticEigenproblem &problem,
                                            const EigensolverOptions &options,
                                            const Counting &counting) const
  {
    const QuadraticEigenproblem at_first = quadratic_part(problem);
    EigensolverOptions first             = options;
    first.keep_factors                   = true;
    // Modes may come into the window. Who counts elsewhere counts in the disc of this window, of
    // which all modes are kept.
    if (counting)
      first.shift = 0;
    EigenSolution solution = quadratic->solve(at_first, first, counting);
    Stopwatch watch;
    Start start;
    if (solution.reuse.factorization)
      start = kept_start(solution, options);
    else
    {
      first.max_imaginary = search_radius(options.max_imaginary);
      first.min_imaginary = options.min_imaginary / search_radius(1);
      solution            = quadratic->solve(at_first, first, counting);
      start               = start_with_factors(problem, solution, options);
    }
    solution.reuse    = {};
    EigenPairs &modes = solution.modes;
    if (start.lambda.empty())
      return solution;

    const ShiftInvert shift_invert(*start.factorization, start.shift),
        transposed(*start.factorization, start.shift, true);
    Search search(problem, shift_invert, transposed, options);
    modes = search.run(std::move(start.right), std::move(start.left), start.lambda);
    check_that_none_comes_in(search.starts(), modes.lambda, options.max_imaginary);
    attach_left_vectors(problem, std::move(search.left_pairs()), modes);
    if (problem.given)
      use_given_matrices(problem, modes);
    solution.cost.seconds.left += search.seconds_of_left;
    solution.cost.seconds.right += watch.lap() - search.seconds_of_left;
    solution.cost.n_solves += search.n_solves;
    solution.proof.completeness +=
        text_of_following(problem, start.lambda.size(), search.n_steps, modes.size());
    restrict_to_window(problem, options, solution);
    return solution;
  }
} // namespace squeal
