#include <squeal/base/stopwatch.h>
#include <squeal/base/subcommunicator.h>
#include <squeal/base/text.h>
#include <squeal/eigen/backward_error.h>
#include <squeal/eigen/given_matrices.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/eigen/nonlinear_eigensolver.h>
#include <squeal/eigen/projected_nonlinear.h>
#include <squeal/eigen/search_space.h>
#include <squeal/eigen/window.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Where the frozen terms are zero.
    QuadraticEigenproblem quadratic_part(const QuadraticEigenproblem &problem)
    {
      QuadraticEigenproblem result;
      result.rows                   = problem.rows;
      result.M                      = problem.M.view(false);
      result.P                      = problem.P.view(problem.P.is_transposed());
      result.Q                      = problem.Q.view(problem.Q.is_transposed());
      result.n_constraints          = problem.n_constraints;
      result.n_local_constraints    = problem.n_local_constraints;
      result.compliant              = problem.compliant;
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
      std::vector<Complex> lambda;
      MultiVector right, left; ///< real spans of the vectors
      std::shared_ptr<const Factorization> factorization;
      double shift = 0;
    };

    /// The search for the right vectors of a problem, or of its transpose, in one growing space.
    class Search
    {
    public:
      Search(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
             const EigensolverOptions &options)
          : problem(problem), shift_invert(shift_invert), options(options),
            galerkin(problem.n_constraints == 0 || problem.compliant), space(problem.rows),
            tests(problem.rows, 0), backward_error(problem)
      {
        projected.terms = &problem.frozen;
        projected.a.resize(problem.frozen.size());
      }

      /// All modes that become of the quadratic problem's, with vectors that span those, the ones
      /// of the window to the tolerance.
      EigenPairs run(MultiVector start, const std::vector<Complex> &quadratic);

      unsigned int n_solves = 0;
      unsigned int n_steps  = 0; ///< of following, the last time

    private:
      void expand(MultiVector block);
      /// Follows the modes in the present space.
      void follow();
      /// Corrects the pairs in the enlarged space, or follows them where they would move too far;
      /// the first time follows them. The first rank does it for all: dense results differ by
      /// rounding from rank to rank, and the way that is taken with them.
      void update(bool first_time);
      /// The vectors of the present pairs, and one step of inverse iteration of them.
      EigenPairs iterate();
      double bound(const Complex &l) const
      {
        return is_wanted(options, l) ? options.tolerance : 1e-3;
      }

      const QuadraticEigenproblem &problem;
      const ShiftInvert &shift_invert;
      const EigensolverOptions &options;
      const bool galerkin;
      SearchSpace space;
      MultiVector tests; ///< as in refine_eigenpairs(), unless Galerkin's
      ProjectedNonlinear projected;
      std::vector<ProjectedPair> pairs;
      std::vector<Complex> quadratic; ///< eigenvalues without the frozen terms
      BackwardError backward_error;
    };

    void Search::expand(MultiVector block)
    {
      clear_multipliers(problem, block);
      const unsigned int old = space.n_columns();
      block                  = space.add(std::move(block), {1e-10});
      const unsigned int n = block.n_columns(), size = old + n;
      if (n == 0)
        return;
      MultiVector new_tests = block;
      if (!galerkin)
      {
        new_tests = shift_invert.solve_transposed(multiply(problem.M, block));
        n_solves += n;
      }
      tests.append(new_tests);
      const MultiVector &basis = space.basis();
      const auto enlarge       = [&](const Matrix &matrix, DenseMatrix &known)
      {
        if (!matrix)
          return;
        const MultiVector image   = multiply(matrix, block),
                          adjoint = multiply_transposed(matrix, new_tests);
        const DenseMatrix right(size, n, inner_products(tests, image)),
            lower(n, size, inner_products(adjoint, basis));
        DenseMatrix larger(size, size);
        for (unsigned int j = 0; j < size; ++j)
          for (unsigned int i = 0; i < size; ++i)
            larger(i, j) = j >= old   ? right(i, j - old)
                           : i >= old ? lower(i - old, j)
                                      : known(i, j);
        known = std::move(larger);
      };
      enlarge(problem.M, projected.m);
      enlarge(problem.P, projected.p);
      enlarge(problem.Q, projected.q);
      for (unsigned int b = 0; b < problem.frozen.size(); ++b)
        enlarge(problem.frozen[b].matrix, projected.a[b]);
      for (ProjectedPair &pair : pairs)
      {
        pair.right.resize(size);
        pair.left.resize(size);
      }
    }

    void Search::follow()
    {
      const std::vector<DensePair> all =
          quadratic_eigenpairs(projected.m, projected.p, projected.q, shift_invert.shift,
                               search_radius(options.max_imaginary), true);
      std::vector<Complex> lambda;
      for (const DensePair &pair : all)
        lambda.push_back(pair.lambda);
      const std::vector<unsigned int> partners = nearest_partners(quadratic, lambda);
      if (partners.size() < quadratic.size())
        throw SolverError("Modes of the problem with frozen moduli are missing in its own space.",
                          {Failure::modes_missing});
      const auto scaled = [](std::vector<Complex> x, const bool conjugate)
      {
        double square = 0;
        for (const Complex &value : x)
          square += std::norm(value);
        for (Complex &value : x)
          value = (conjugate ? std::conj(value) : value) / std::sqrt(square);
        return x;
      };
      pairs.clear();
      for (const unsigned int j : partners)
        pairs.push_back({all[j].lambda, scaled(all[j].vector, false), scaled(all[j].left, true)});
      n_steps = follow_to_exact(projected, pairs);
    }

    void Search::update(const bool first_time)
    {
      const MPI_Comm comm = problem.rows.comm;
      int rank            = 0;
      MPI_Comm_rank(comm, &rank);
      work_apart(comm,
                 [&]
                 {
                   if (rank == 0 && (first_time || !correct_exact(projected, pairs)))
                     follow();
                 });
      const unsigned int size = space.n_columns();
      std::vector<Complex> numbers;
      for (const ProjectedPair &pair : pairs)
      {
        numbers.push_back(pair.lambda);
        numbers.insert(numbers.end(), pair.right.begin(), pair.right.end());
        numbers.insert(numbers.end(), pair.left.begin(), pair.left.end());
      }
      numbers.resize((1 + 2 * std::size_t(size)) * quadratic.size());
      MPI_Bcast(numbers.data(), 2 * numbers.size(), MPI_DOUBLE, 0, comm);
      MPI_Bcast(&n_steps, 1, MPI_UNSIGNED, 0, comm);
      pairs.resize(quadratic.size());
      auto next = numbers.cbegin();
      for (ProjectedPair &pair : pairs)
      {
        pair.lambda = *next++;
        pair.right.assign(next, next + size);
        pair.left.assign(next + size, next + 2 * size);
        next += 2 * size;
      }
    }

    EigenPairs Search::iterate()
    {
      EigenPairs result;
      std::vector<double> re, im;
      for (const ProjectedPair &pair : pairs)
      {
        result.lambda.push_back(pair.lambda);
        for (const Complex &c : pair.right)
        {
          re.push_back(c.real());
          im.push_back(c.imag());
        }
      }
      result.right.re = combine(space.basis(), re, pairs.size());
      result.right.im = combine(space.basis(), im, pairs.size());
      inverse_iteration(problem, shift_invert, result);
      n_solves += 2 * pairs.size();
      result.backward_error = backward_error(result);
      return result;
    }

    EigenPairs Search::run(MultiVector start, const std::vector<Complex> &eigenvalues)
    {
      quadratic = eigenvalues;
      expand(std::move(start));
      constexpr unsigned int most_steps = 30;
      EigenPairs modes;
      std::vector<Complex> previous;
      std::vector<double> changes;
      const auto correct = [&](const unsigned int step) -> std::optional<MultiVector>
      {
        update(step == 0);
        modes = iterate();
        changes.resize(modes.size(), 1);
        std::vector<unsigned int> inaccurate;
        double worst = 0;
        for (unsigned int j = 0; j < modes.size(); ++j)
        {
          const Complex l = modes.lambda[j];
          // The eigenvalue must have settled, too, or be so uncertain by rounding that its changes
          // do not become smaller.
          constexpr double uncertain = 1e-5;
          const double error         = modes.backward_error[j],
                       change = previous.empty() ? 1 : std::abs(l - previous[j]) / std::abs(l);
          const bool settled  = change <= bound(l) || (change <= uncertain && change >= changes[j]);
          changes[j]          = change;
          if (error > bound(l) || !settled)
            inaccurate.push_back(j);
          if (is_wanted(options, l))
            worst = std::max(worst, modes.backward_error[j]);
        }
        options.progress(text_of("  exact moduli, step ", step, ": ", space.n_columns(),
                                 " vectors, largest backward error ", worst));
        previous = modes.lambda;
        if (inaccurate.empty())
          return std::nullopt;
        return modes.right.columns(inaccurate).real_span();
      };
      if (!expand_until_accurate(most_steps, correct,
                                 [&](MultiVector block) { expand(std::move(block)); }))
        throw SolverError(
            text_of("The modes of the problem with moduli that depend on the frequency have "
                    "backward errors up to ",
                    *std::max_element(modes.backward_error.begin(), modes.backward_error.end()),
                    " after ", most_steps, " corrections."),
            {Failure::pairs_not_refined});
      return modes;
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
  } // namespace

  EigenSolution NonlinearEigensolver::solve(const QuadraticEigenproblem &problem,
                                            const EigensolverOptions &options) const
  {
    const QuadraticEigenproblem at_first = quadratic_part(problem);
    EigensolverOptions first             = options;
    first.keep_factors                   = true;
    // Modes may come into the window. Who counts elsewhere counts in the disc of this window, of
    // which all modes are kept.
    if (options.counted_elsewhere)
      first.shift = 0;
    EigenSolution solution = quadratic->solve(at_first, first);
    Stopwatch watch;
    Start start;
    if (solution.reuse.factorization)
    {
      start.factorization = solution.reuse.factorization;
      start.lambda        = solution.reuse.disc_lambda;
      start.right         = std::move(solution.reuse.disc_right);
      start.left          = std::move(solution.reuse.disc_left);
      // Those that grow outside of the disc are no part of it.
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
    }
    else
    {
      first.max_imaginary = search_radius(options.max_imaginary);
      first.min_imaginary = options.min_imaginary / search_radius(1);
      solution            = quadratic->solve(at_first, first);
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
    }
    solution.reuse    = {};
    EigenPairs &modes = solution.modes;
    if (start.lambda.empty())
      return solution;

    const ShiftInvert shift_invert(*start.factorization, start.shift),
        transposed(*start.factorization, start.shift, true);
    Search right(problem, shift_invert, options);
    modes = right.run(std::move(start.right), start.lambda);
    check_that_none_comes_in(start.lambda, modes.lambda, options.max_imaginary);
    solution.cost.seconds.right += watch.lap();
    const QuadraticEigenproblem adjoint = adjoint_of(problem);
    Search left(adjoint, transposed, options);
    EigenPairs transposed_pairs = left.run(std::move(start.left), start.lambda);
    attach_left_vectors(
        problem, transposed_pairs.select(nearest_partners(modes.lambda, transposed_pairs.lambda)),
        modes);
    if (problem.given)
      use_given_matrices(problem, modes);
    solution.cost.seconds.left += watch.lap();
    solution.cost.n_solves += right.n_solves + left.n_solves;
    solution.proof.completeness += text_of(
        "; moduli frozen at 2 pi ", problem.frozen.front().frequency / (2 * M_PI),
        " Hz until there; each of ", start.lambda.size(),
        " modes was followed to the exact moduli, in ", right.n_steps, " steps, and no two met");
    restrict_to_window(problem, options, solution);
    return solution;
  }
} // namespace squeal
