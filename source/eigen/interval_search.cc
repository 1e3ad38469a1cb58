#include <squeal/base/text.h>
#include <squeal/eigen/block_krylov.h>
#include <squeal/eigen/interval_search.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/davidson.h>

#include <algorithm>
#include <cmath>

// Modes of a window far from zero. start_vectors() takes the eigenvectors without velocity terms
// from block_krylov; SideSearch corrects the right vectors in a growing space until corrections are
// short (improve()), and a second one the left vectors, which begins with what the first one
// knows; refine_eigenvalues() combines both to an error of the second order. interval_search() at
// the end does this with ever smaller bounds until backward errors are below the tolerance.

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// The problem without its velocity terms.
    QuadraticEigenproblem without_velocity_terms(const QuadraticEigenproblem &problem)
    {
      QuadraticEigenproblem result = problem.of_same_unknowns();
      result.M                     = problem.M.view(false);
      result.Q                     = problem.Q.view(problem.Q.is_transposed());
      return result;
    }

    /// Norms of the columns without their last rows.
    std::vector<double> lengths_of(const MultiVector &block, const unsigned int n_left_out)
    {
      std::vector<double> squares(block.n_columns());
      for (unsigned int k = 0; k < block.n_columns(); ++k)
        for (unsigned int i = 0; i + n_left_out < block.n_local(); ++i)
          squares[k] += block.column(k)[i] * block.column(k)[i];
      MPI_Allreduce(MPI_IN_PLACE, squares.data(), squares.size(), MPI_DOUBLE, MPI_SUM,
                    block.row_range().comm);
      for (double &square : squares)
        square = std::sqrt(square);
      return squares;
    }

    /// Some rows at the end of each rank's part, as rows of their own.
    RowRange last_rows(const RowRange &rows, const unsigned int n_local)
    {
      RowRange result{rows.comm, 0, 0, 0};
      MPI_Allreduce(&n_local, &result.size, 1, MPI_UNSIGNED, MPI_SUM, rows.comm);
      MPI_Scan(&n_local, &result.end, 1, MPI_UNSIGNED, MPI_SUM, rows.comm);
      result.begin = result.end - n_local;
      return result;
    }

    /// Takes the rows of such a range, the last ones of each rank, out of a block.
    MultiVector last_rows(const MultiVector &block, const RowRange &range)
    {
      MultiVector result(range, block.n_columns());
      for (unsigned int k = 0; k < block.n_columns(); ++k)
        std::copy_n(block.column(k) + block.n_local() - range.n_local(), range.n_local(),
                    result.column(k));
      return result;
    }

    /// What is known of vectors Y.
    struct Images
    {
      MultiVector g, m, p;   ///< F Y (with contact pressures), M Y, P Y
      MultiVector pressures; ///< of Y
    };

    /// Corrections t = -F^{-1} Q(l) x of Ritz pairs, turned, one or two real columns each.
    struct Corrections
    {
      MultiVector t, residual;         ///< with pressures; F t
      std::vector<unsigned int> first; ///< column of each pair, and their number
      std::vector<Complex> turns;      ///< factors of modulus 1
      std::vector<double> sizes;       ///< |t| / |x|
    };

    /// f_j x_j of Ritz pairs.
    template <typename Factor>
    ComplexDenseMatrix scaled(const SmallPairs &ritz, const Factor &factor)
    {
      std::vector<Complex> factors;
      for (const Complex &l : ritz.lambda)
        factors.push_back(factor(l));
      return ComplexDenseMatrix(ritz.right).scale(factors);
    }

    /// The search for right vectors or, with the adjoint problem, for left ones: an orthonormal
    /// basis, its images and test vectors. Its bases and its loop are its own, and not Davidson's,
    /// because it keeps images of the basis: they give residuals without a product and corrections
    /// that satisfy the constraints to their own rounding.
    class SideSearch
    {
    public:
      SideSearch(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                 const IntervalSearchOptions &options, const double slack)
          : shift_invert(shift_invert), problem(problem), options(options), slack(slack),
            n_cleared(problem.compliant ? 0 : problem.n_local_constraints),
            pressure_rows(last_rows(problem.rows, n_cleared)), space(problem.rows),
            tests(problem.rows, 0)
      {
        for (MultiVector Images::*block : {&Images::g, &Images::m, &Images::p})
          basis.*block = MultiVector(problem.rows, 0);
        basis.pressures = MultiVector(pressure_rows, 0);
      }

      /// Begins with F^{-1} M x.
      void start(const MultiVector &x);
      /// Begins with the left vectors Z d of the other side's projected problem, whose images
      /// F^T Z d = M U d are known: a step nearer than the others' start.
      void start(const SideSearch &other);

      /// Enlarges the basis until the corrections of all pairs of the region are short enough, of
      /// the wanted ones |t| <= @p wanted_bound |x|.
      void improve(double wanted_bound, const std::function<void(const std::string &)> &progress);

      /// All eigenvalues of the region.
      std::vector<Complex> eigenvalues() const;
      /// The corrected wanted vectors x + t, with their contact pressures, each times a factor of
      /// modulus 1.
      EigenPairs wanted_pairs() const;

      unsigned int n_solves() const
      {
        return solves;
      }

    private:
      /// The Ritz pairs of the region and a little further, or the left ones.
      SmallPairs ritz_pairs(bool of_left) const;
      /// Selects the pairs that need a correction. Of modes that are not wanted only the place must
      /// be known: once their corrections were small, they rest until they move.
      SmallPairs moving_pairs() const;
      bool is_wanted(const Complex &l) const
      {
        return options.region.contains(l) && l.imag() >= options.min_imaginary * (1 - slack) &&
               l.imag() <= options.max_imaginary * (1 + slack);
      }
      /// How short a correction must be; what is a little outside of the region must not be on its
      /// way in.
      double bound(const Complex &l) const
      {
        return is_wanted(l) ? wanted_bound : options.region.contains(l) ? 1e-2 : 3e-2;
      }
      Corrections correct(const SmallPairs &ritz);
      /// Adds what is new in the corrections of the given numbers.
      void expand(const Corrections &corrections, const std::vector<unsigned int> &numbers);
      void expand(MultiVector y, MultiVector g);
      unsigned int n_columns() const
      {
        return space.n_columns();
      }

      const ShiftInvert shift_invert;
      const QuadraticEigenproblem &problem;
      const IntervalSearchOptions &options;
      const double slack;
      const unsigned int n_cleared; ///< pressures, for which there are constraints
      const RowRange pressure_rows;
      SearchSpace space; ///< Y, without contact pressures
      Images basis;
      MultiVector tests;       ///< Z = F^{-T} M U
      DenseMatrix m, p, f;     ///< Z^T M U, Z^T P U, Z^T F U
      SmallPairs ritz, moving; ///< in the region; those that were corrected last
      Corrections corrections; ///< of these
      std::vector<Complex> at_rest;
      double wanted_bound = 0;
      unsigned int solves = 0, step = 0;
    };

    Corrections SideSearch::correct(const SmallPairs &ritz)
    {
      constexpr double much_shorter = 0.02;
      // -Q(l) x = ((s - l^2) M - l P - F) x, with the contact pressures of the basis' vectors.
      ComplexMultiVector residual = combine(
          basis.m, scaled(ritz, [&](const Complex &l) { return shift_invert.square - l * l; }));
      for (const ComplexMultiVector &part :
           {combine(basis.p, scaled(ritz, [](const Complex &l) { return l; })),
            combine(basis.g, ritz.right)})
      {
        residual.re -= part.re;
        residual.im -= part.im;
      }
      // Vectors are almost real and damping almost imaginary, so that most residuals have one
      // direction only: the other one is left out where it is short.
      Corrections result;
      result.first = {0};
      for (const auto &[turn, longer, shorter] : main_parts(residual))
      {
        const bool keeps_both = shorter > much_shorter * much_shorter * longer;
        result.turns.push_back(turn);
        result.first.push_back(result.first.back() + (keeps_both ? 2 : 1));
      }
      residual.scale(result.turns);
      result.residual = MultiVector(problem.rows, 0);
      for (unsigned int j = 0; j < ritz.size(); ++j)
      {
        result.residual.append(residual.re.columns(j, 1));
        if (result.first[j + 1] == result.first[j] + 2)
          result.residual.append(residual.im.columns(j, 1));
      }
      result.t = shift_invert.solve(result.residual);
      solves += result.t.n_columns();
      const std::vector<double> lengths = lengths_of(result.t, n_cleared),
                                of_x    = ritz.right.column_norms(); // the basis is orthonormal
      for (unsigned int j = 0; j < ritz.size(); ++j)
      {
        double t_square = 0;
        for (unsigned int k = result.first[j]; k < result.first[j + 1]; ++k)
          t_square += lengths[k] * lengths[k];
        result.sizes.push_back(std::sqrt(t_square) / of_x[j]);
      }
      return result;
    }

    void SideSearch::expand(const Corrections &corrections,
                            const std::vector<unsigned int> &numbers)
    {
      MultiVector t(problem.rows, 0), residual(problem.rows, 0);
      for (const unsigned int j : numbers)
      {
        const unsigned int first = corrections.first[j], n = corrections.first[j + 1] - first;
        t.append(corrections.t.columns(first, n));
        residual.append(corrections.residual.columns(first, n));
      }
      expand(std::move(t), std::move(residual));
    }

    void SideSearch::expand(MultiVector y, MultiVector g)
    {
      // A remainder shorter than this, relatively, is rounding; a combination of remainders of unit
      // length shorter than that, too.
      constexpr Novelty not_rounding = {1e-12, 1e-6};
      MultiVector pressures          = last_rows(y, pressure_rows);
      clear_pressures(n_cleared, y);
      y = space.add(std::move(y), not_rounding, {{g, basis.g}, {pressures, basis.pressures}});
      const MultiVector m_y = multiply(problem.M, y);
      tests.append(shift_invert.solve_transposed(m_y));
      solves += m_y.n_columns();
      basis.m.append(m_y);
      basis.p.append(multiply(problem.P, y));
      basis.g.append(g);
      basis.pressures.append(pressures);
    }

    SmallPairs SideSearch::ritz_pairs(const bool of_left) const
    {
      const auto oriented = [&](const DenseMatrix &a) -> DenseMatrix
      { return of_left ? a.transpose() : DenseView<double>(a); };
      DenseMatrix q = f;
      for (std::size_t k = 0; k < q.values.size(); ++k)
        q.values[k] -= options.region.square * m.values[k];
      const SmallPairs all = SmallProblem{oriented(m), oriented(p), oriented(q), {}, nullptr}.solve(
          0, std::sqrt(-options.region.square));
      std::vector<unsigned int> near;
      for (unsigned int k = 0; k < all.size(); ++k)
        if (all.lambda[k].imag() > 0 && options.region.distance(all.lambda[k]) <= 1.05)
          near.push_back(k);
      return all.select(near);
    }

    SmallPairs SideSearch::moving_pairs() const
    {
      constexpr double at_the_same_place = 1e-3;
      std::vector<unsigned int> result;
      for (unsigned int k = 0; k < ritz.size(); ++k)
      {
        const Complex l = ritz.lambda[k];
        const bool rests =
            std::any_of(at_rest.begin(), at_rest.end(),
                        [&](const Complex &other)
                        { return std::abs(l - other) <= at_the_same_place * std::abs(l); });
        if (is_wanted(l) || !rests)
          result.push_back(k);
      }
      return ritz.select(result);
    }

    std::vector<Complex> SideSearch::eigenvalues() const
    {
      std::vector<Complex> result;
      for (const Complex &l : ritz.lambda)
        if (options.region.contains(l))
          result.push_back(l);
      return result;
    }

    EigenPairs SideSearch::wanted_pairs() const
    {
      EigenPairs pairs;
      std::vector<unsigned int> wanted;
      std::vector<Complex> turns;
      for (unsigned int j = 0; j < moving.size(); ++j)
        if (is_wanted(moving.lambda[j]))
        {
          wanted.push_back(j);
          pairs.lambda.push_back(moving.lambda[j]);
          turns.push_back(corrections.turns[j]);
        }
      const ComplexDenseMatrix turned    = moving.right.columns(wanted).scale(turns);
      pairs.right                        = combine(space.basis(), turned);
      const ComplexMultiVector pressures = combine(basis.pressures, turned);
      const auto add_rest = [&](MultiVector &x, const MultiVector &of_x, const unsigned int part)
      {
        for (unsigned int k = 0; k < wanted.size(); ++k)
        {
          std::copy_n(of_x.column(k), n_cleared, x.column(k) + x.n_local() - n_cleared);
          const unsigned int t = corrections.first[wanted[k]] + part;
          if (t < corrections.first[wanted[k] + 1]) // a short second part was left out
            add_multiple(1, corrections.t.column(t), x.n_local(), x.column(k));
        }
      };
      add_rest(pairs.right.re, pressures.re, 0);
      add_rest(pairs.right.im, pressures.im, 1);
      return pairs;
    }

    void SideSearch::start(const MultiVector &x)
    {
      MultiVector g = multiply(problem.M, x);
      MultiVector y = shift_invert.solve(g);
      solves += g.n_columns();
      expand(std::move(y), std::move(g));
    }

    void SideSearch::start(const SideSearch &other)
    {
      const ComplexDenseMatrix d = other.ritz_pairs(true).right;
      expand(combine(other.tests, d).real_span(), combine(other.basis.m, d).real_span());
    }

    void SideSearch::improve(const double new_bound,
                             const std::function<void(const std::string &)> &progress)
    {
      constexpr unsigned int max_steps = 25;
      wanted_bound                     = new_bound;
      double worst                     = 0;
      for (; step < max_steps; ++step)
      {
        m           = grow_products(m, tests, basis.m);
        p           = grow_products(p, tests, basis.p);
        f           = grow_products(f, tests, basis.g);
        ritz        = ritz_pairs(false);
        moving      = moving_pairs();
        corrections = correct(moving);
        std::vector<unsigned int> open;
        worst = 0;
        for (unsigned int j = 0; j < moving.size(); ++j)
        {
          const Complex l = moving.lambda[j];
          worst           = std::max(worst, corrections.sizes[j] / bound(l));
          if (!(corrections.sizes[j] <= bound(l)))
            open.push_back(j);
          else if (!is_wanted(l))
            at_rest.push_back(l);
        }
        progress(text_of("  window: ", ritz.size() - open.size(), " of ", ritz.size(),
                         " eigenvalues converged, subspace of ", n_columns()));
        if (open.empty())
          return;
        expand(corrections, open);
      }
      throw SolverError(text_of("The modes of the window did not converge in ", max_steps,
                                " steps: the largest correction is ", worst,
                                " times what is allowed."),
                        {Failure::interval_stalled});
    }

    /// Makes l of both the root near it of y^T (l^2 M + l P + Q) x = 0, whose error is of the
    /// second order: the product of the vectors' errors.
    void refine_eigenvalues(const QuadraticEigenproblem &problem, EigenPairs &right,
                            EigenPairs &left)
    {
      const unsigned int n = right.size();
      ComplexMultiVector z = left.right; // y^T = z^H with z = conj(y)
      z.conjugate();
      const auto forms = [&](const Matrix &matrix)
      { return sesquilinear_form(z, matrix, right.right); };
      const std::vector<Complex> m = forms(problem.M), p = forms(problem.P), q = forms(problem.Q);
      for (unsigned int j = 0, k = 0; j < n; ++j, k += n + 1)
      {
        // Of a multiple eigenvalue a left vector may belong to another right one.
        constexpr double much = 1e-5;
        const Complex before = right.lambda[j], l = nearest_root(m[k], p[k], q[k], before);
        if (std::abs(l - before) <= much * std::abs(before))
          right.lambda[j] = left.lambda[j] = l;
      }
    }

    /// The eigenvectors without velocity terms, orthonormalised, and the right-hand sides solved.
    MultiVector start_vectors(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                              const IntervalSearchOptions &options,
                              const std::function<void(const std::string &)> &progress,
                              unsigned int &n_solves)
    {
      BlockSearchOptions krylov;
      krylov.region        = options.region;
      krylov.max_imaginary = options.max_imaginary;
      krylov.tolerance     = 1e-2; // velocity terms change the vectors by as much
      krylov.n_expected    = options.n_expected;
      krylov.seed          = options.seed;
      krylov.reach         = 2; // neighbours of the region, to which P couples
      const EigenSolution found =
          block_krylov_search(without_velocity_terms(problem), shift_invert, krylov, progress);
      n_solves += found.cost.n_solves;
      MultiVector x = found.modes.right.real_span(); // Im is zero for a real vector
      clear_multipliers(problem, x);
      return orthonormalize(std::move(x));
    }
  } // namespace

  EigenSolution interval_search(const QuadraticEigenproblem &problem,
                                const Factorization &factorization,
                                const IntervalSearchOptions &options,
                                const std::function<void(const std::string &)> &progress)
  {
    const QuadraticEigenproblem adjoint = adjoint_of(problem);
    const double square                 = options.region.square;
    // What is at the window's ends must be on the same side for both; the caller cuts.
    SideSearch right(problem, ShiftInvert::of_square(factorization, square), options, 1e-5),
        left(adjoint, ShiftInvert::of_square(factorization, square, true), options, 1e-4);
    EigenSolution result;
    unsigned int &n_solves = result.cost.n_solves;
    const MultiVector x    = start_vectors(problem, ShiftInvert::of_square(factorization, square),
                                           options, progress, n_solves);
    right.start(x);
    if (options.only_count)
    {
      right.improve(1e-2, progress);
      result.proof.eigenvalues = right.eigenvalues();
      n_solves += right.n_solves();
      return result;
    }
    double bound = 1e-6;
    right.improve(bound, progress);
    left.start(right);
    left.improve(bound, progress);
    const BackwardError of_right(problem), of_left(adjoint);
    const auto is_accurate = [&](const EigenPairs &pairs)
    {
      return std::all_of(pairs.backward_error.begin(), pairs.backward_error.end(),
                         [&](const double error) { return error <= options.tolerance; });
    };
    EigenPairs &modes = result.modes, transposed;
    for (;; bound /= 10)
    {
      modes                  = right.wanted_pairs();
      const EigenPairs found = left.wanted_pairs();
      if (found.size() < modes.size())
        throw SolverError(text_of("The transposed problem has ", found.size(),
                                  " eigenvalues in the window where the problem has ", modes.size(),
                                  ": left vectors are missing."),
                          {Failure::interval_left_vectors_missing});
      transposed = found.select(nearest_partners(modes.lambda, found.lambda));
      refine_eigenvalues(problem, modes, transposed);
      modes.backward_error      = of_right(modes);
      transposed.backward_error = of_left(transposed);
      if (is_accurate(modes) && is_accurate(transposed))
        break;
      right.improve(bound / 10, progress);
      left.improve(bound / 10, progress);
    }
    result.proof.eigenvalues = right.eigenvalues();
    attach_left_vectors(problem, std::move(transposed), modes);
    n_solves += right.n_solves() + left.n_solves();
    return result;
  }
} // namespace squeal
