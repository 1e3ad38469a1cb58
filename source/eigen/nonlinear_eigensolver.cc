#include <squeal/base/stopwatch.h>
#include <squeal/base/subcommunicator.h>
#include <squeal/base/text.h>
#include <squeal/eigen/given_matrices.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/eigen/nonlinear_eigensolver.h>
#include <squeal/eigen/window.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/projected_nonlinear.h>
#include <squeal/projection/search_space.h>

#include <algorithm>
#include <cmath>
#include <limits>
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
      std::vector<Complex> lambda;
      MultiVector right, left; ///< real spans of the vectors
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
            options(options)
      {
        projected.terms = &problem.frozen;
        projected.a.resize(problem.frozen.size());
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

      unsigned int n_solves  = 0;
      unsigned int n_steps   = 0; ///< of following, the last time
      double seconds_of_left = 0; ///< of inverse iteration

    private:
      /// The problem or its transpose.
      struct Side
      {
        Side(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert)
            : problem(problem), shift_invert(shift_invert), space(problem.rows),
              backward_error(problem)
        {
        }
        const QuadraticEigenproblem &problem;
        const ShiftInvert &shift_invert;
        SearchSpace space;
        BackwardError backward_error;
        EigenPairs pairs;

        /// Adds what is new in the columns to the space and appends it to @p added.
        void add(MultiVector columns, MultiVector &added)
        {
          clear_multipliers(problem, columns);
          added.append(space.add(std::move(columns), {1e-10}));
        }
        /// Of the columns that were @p added last keeps as many combinations as @p others, of the
        /// other side, has columns: those with the largest products with M and these.
        void keep_what_is_seen(MultiVector &added, const MultiVector &others);
        /// One step of inverse iteration from coordinates in the space.
        void iterate(const std::vector<Complex> &lambda, const std::vector<Complex> &coordinates);
      };

      void expand(MultiVector of_right, MultiVector of_left);
      /// Those of the present pairs.
      std::vector<Complex> rayleigh_corrections() const;
      /// Follows the modes in the present spaces.
      void follow();
      /// Corrects the pairs in the enlarged spaces, or follows them where they would move too far;
      /// the first time follows them. The first rank does it for all: dense results differ by
      /// rounding from rank to rank, and the way that is taken with them.
      void update(bool first_time);
      /// The vectors of the present pairs, and one step of inverse iteration of them.
      void iterate();
      double bound(const Complex &l) const
      {
        return is_wanted(options, l) ? options.tolerance : 1e-3;
      }

      Side right;
      const QuadraticEigenproblem adjoint;
      Side left;
      const EigensolverOptions &options;
      ProjectedNonlinear projected;
      std::vector<ProjectedPair> pairs;
      std::vector<Complex> quadratic; ///< eigenvalues without the frozen terms
      /// What is new in V and in W may have nothing to do with each other, errors of right and of
      /// left vectors: W^T T V is nearly singular then. Partners on the other side mend it, at
      /// twice the price; they are added where the spaces have grown in vain.
      bool needs_partners = false;
      MultiVector newest_right, newest_left;
    };

    void Search::Side::keep_what_is_seen(MultiVector &added, const MultiVector &others)
    {
      const unsigned int n = added.n_columns(), n_kept = others.n_columns();
      const DenseMatrix seen(n_kept, n, inner_products(others, multiply(problem.M, added)));
      DenseMatrix combinations(n, n);
      gemm(true, 1, seen, seen, 0, combinations);
      symmetric_eigen(combinations); // ascending
      added = combine(added, some_columns(combinations, n - n_kept, n_kept).values, n_kept);
      MultiVector basis = space.basis().columns(0, space.n_columns() - n);
      basis.append(added);
      space = SearchSpace(std::move(basis));
    }

    void Search::expand(MultiVector of_right, MultiVector of_left)
    {
      const RowRange &rows   = right.problem.rows;
      const unsigned int old = right.space.n_columns();
      MultiVector v(rows, 0), w(rows, 0);
      right.add(std::move(of_right), v);
      left.add(std::move(of_left), w);
      const auto partners_of = [this](const MultiVector &columns, const Side &other)
      {
        n_solves += columns.n_columns();
        return other.shift_invert.solve(multiply(other.problem.M, columns));
      };
      if (needs_partners)
      {
        const MultiVector of_v = partners_of(newest_right, left),
                          of_w = partners_of(newest_left, right);
        left.add(of_v, w);
        right.add(of_w, v);
      }
      // As many columns on both sides: what was not new on one of them gives way to the partners
      // F^{-T} M v, F^{-1} M w of the other's.
      const auto fill = [&](const MultiVector &longer, Side &shorter, MultiVector &added)
      {
        const unsigned int first = added.n_columns(), n = longer.n_columns() - first;
        shorter.add(partners_of(longer.columns(first, n), shorter), added);
      };
      for (unsigned int k = 0; k < 3 && v.n_columns() != w.n_columns(); ++k)
        if (v.n_columns() > w.n_columns())
          fill(v, left, w);
        else
          fill(w, right, v);
      // F^{-1} M damps what oscillates quickly: where the spaces are nearly all there is, partners
      // may bring nothing new. Then what the shorter side sees least gives way.
      if (v.n_columns() > w.n_columns())
        right.keep_what_is_seen(v, w);
      else if (w.n_columns() > v.n_columns())
        left.keep_what_is_seen(w, v);
      const unsigned int n = v.n_columns(), size = old + n;
      if (n == 0)
        return;
      newest_right       = v;
      newest_left        = w;
      const auto enlarge = [&](const Matrix &matrix, DenseMatrix &known)
      {
        if (!matrix)
          return;
        const MultiVector image         = multiply(matrix, v),
                          adjoint_image = multiply_transposed(matrix, w);
        const auto block                = [&](const unsigned int, const unsigned int n_left,
                               const unsigned int first_right, const unsigned int n_right)
        {
          return DenseMatrix(n_left, n_right,
                             first_right == old ? inner_products(left.space.basis(), image)
                                                : inner_products(adjoint_image, 0, n_left,
                                                                 right.space.basis(), 0, old));
        };
        known = grow(known, size, block);
      };
      enlarge(right.problem.M, projected.m);
      enlarge(right.problem.P, projected.p);
      enlarge(right.problem.Q, projected.q);
      for (unsigned int b = 0; b < right.problem.frozen.size(); ++b)
        enlarge(right.problem.frozen[b].matrix, projected.a[b]);
      for (ProjectedPair &pair : pairs)
      {
        pair.right.resize(size);
        pair.left.resize(size);
      }
    }

    void Search::follow()
    {
      const std::vector<DensePair> all =
          quadratic_eigenpairs(projected.m, projected.p, projected.q, right.shift_invert.shift,
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
      const MPI_Comm comm = right.problem.rows.comm;
      int rank            = 0;
      MPI_Comm_rank(comm, &rank);
      work_apart(comm,
                 [&]
                 {
                   if (rank == 0 && (first_time || !correct_exact(projected, pairs)))
                     follow();
                 });
      const unsigned int size = right.space.n_columns();
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

    void Search::Side::iterate(const std::vector<Complex> &lambda,
                               const std::vector<Complex> &coordinates)
    {
      std::vector<double> re, im;
      for (const Complex &c : coordinates)
      {
        re.push_back(c.real());
        im.push_back(c.imag());
      }
      pairs          = EigenPairs();
      pairs.lambda   = lambda;
      pairs.right.re = combine(space.basis(), re, lambda.size());
      pairs.right.im = combine(space.basis(), im, lambda.size());
      inverse_iteration(problem, shift_invert, pairs);
      pairs.backward_error = backward_error(pairs);
    }

    void Search::iterate()
    {
      std::vector<Complex> lambda, of_right, of_left;
      for (const ProjectedPair &pair : pairs)
      {
        lambda.push_back(pair.lambda);
        of_right.insert(of_right.end(), pair.right.begin(), pair.right.end());
        for (const Complex &c : pair.left) // T(l)^T y = 0: y = conj(z)
          of_left.push_back(std::conj(c));
      }
      right.iterate(lambda, of_right);
      Stopwatch watch;
      left.iterate(lambda, of_left);
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

    EigenPairs Search::run(MultiVector of_right, MultiVector of_left,
                           const std::vector<Complex> &eigenvalues)
    {
      quadratic = eigenvalues;
      expand(std::move(of_right), std::move(of_left));
      constexpr unsigned int most_steps = 30;
      std::vector<Complex> previous;
      std::vector<double> changes, errors;
      double worst_before = std::numeric_limits<double>::infinity();
      const auto correct =
          [&](const unsigned int step) -> std::optional<std::pair<MultiVector, MultiVector>>
      {
        update(step == 0);
        iterate();
        changes.resize(pairs.size(), 1);
        errors.resize(pairs.size());
        const std::vector<Complex> corrections =
            step == 0 ? rayleigh_corrections() : std::vector<Complex>();
        std::vector<unsigned int> inaccurate;
        double worst = 0;
        for (unsigned int j = 0; j < pairs.size(); ++j)
        {
          const Complex l = pairs[j].lambda;
          // The eigenvalue must have settled, too, or be so uncertain by rounding that its changes
          // do not become smaller.
          constexpr double uncertain = 1e-5;
          errors[j] = std::max(right.pairs.backward_error[j], left.pairs.backward_error[j]);
          const double change =
              std::abs(step == 0 ? corrections[j] : l - previous[j]) / std::abs(l);
          const bool settled = change <= bound(l) || (change <= uncertain && change >= changes[j]);
          changes[j]         = change;
          if (errors[j] > bound(l) || !settled)
            inaccurate.push_back(j);
          if (is_wanted(options, l))
            worst = std::max(worst, errors[j]);
        }
        options.progress(text_of("  exact moduli, step ", step, ": ", right.space.n_columns(),
                                 " vectors, largest backward error ", worst));
        constexpr double in_vain = 0.5;
        needs_partners |= worst > in_vain * worst_before;
        worst_before = worst;
        previous     = right.pairs.lambda;
        if (inaccurate.empty())
          return std::nullopt;
        return std::make_pair(right.pairs.right.columns(inaccurate).real_span(),
                              left.pairs.right.columns(inaccurate).real_span());
      };
      if (!expand_until_accurate(most_steps, correct,
                                 [&](std::pair<MultiVector, MultiVector> blocks)
                                 { expand(std::move(blocks.first), std::move(blocks.second)); }))
        throw SolverError(
            text_of("The modes of the problem with moduli that depend on the frequency have "
                    "backward errors up to ",
                    *std::max_element(errors.begin(), errors.end()), " after ", most_steps,
                    " corrections."),
            {Failure::pairs_not_refined});
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
    Search search(problem, shift_invert, transposed, options);
    modes = search.run(std::move(start.right), std::move(start.left), start.lambda);
    check_that_none_comes_in(start.lambda, modes.lambda, options.max_imaginary);
    attach_left_vectors(problem, std::move(search.left_pairs()), modes);
    if (problem.given)
      use_given_matrices(problem, modes);
    solution.cost.seconds.left += search.seconds_of_left;
    solution.cost.seconds.right += watch.lap() - search.seconds_of_left;
    solution.cost.n_solves += search.n_solves;
    solution.proof.completeness += text_of(
        "; moduli frozen at 2 pi ", problem.frozen.front().frequency / (2 * M_PI),
        " Hz until there; each of ", start.lambda.size(),
        " modes was followed to the exact moduli, in ", search.n_steps, " steps, and no two met");
    restrict_to_window(problem, options, solution);
    return solution;
  }
} // namespace squeal
