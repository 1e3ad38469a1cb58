#include <squeal/block_krylov.h>
#include <squeal/dense.h>
#include <squeal/left_vectors.h>
#include <squeal/window_search.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// The problem without its velocity terms.
    QuadraticEigenproblem without_velocity_terms(const QuadraticEigenproblem &problem)
    {
      QuadraticEigenproblem result;
      result.rows                = problem.rows;
      result.M                   = problem.M.view(false);
      result.Q                   = problem.Q.view(problem.Q.is_transposed());
      result.n_constraints       = problem.n_constraints;
      result.n_local_constraints = problem.n_local_constraints;
      result.compliant           = problem.compliant;
      return result;
    }

    /// Norms of the columns.
    std::vector<double> lengths_of(const Block &block)
    {
      std::vector<double> squares(block.n_columns());
      for (unsigned int k = 0; k < block.n_columns(); ++k)
        for (unsigned int i = 0; i < block.n_local(); ++i)
          squares[k] += block.column(k)[i] * block.column(k)[i];
      MPI_Allreduce(MPI_IN_PLACE, squares.data(), squares.size(), MPI_DOUBLE, MPI_SUM,
                    block.row_range().comm);
      for (double &square : squares)
        square = std::sqrt(square);
      return squares;
    }

    /// Vectors with what is known of them.
    struct Images
    {
      Block y, g, m, p; ///< Y (without contact pressures), F Y (with them), M Y, P Y
    };

    /// Corrections t = -F^{-1} Q(l) x of Ritz pairs, one or two real columns each.
    struct Corrections
    {
      Block t, residual;               ///< F t
      std::vector<unsigned int> first; ///< column of each pair, and their number
      std::vector<double> sizes;       ///< |t| / |x|
    };

    /// Ritz pairs: eigenvalues and coefficients in a basis.
    struct RitzPairs
    {
      std::vector<Complex> lambda;
      std::vector<std::vector<Complex>> coefficients;
    };

    /// The right or the left half of the two-sided search: an orthonormal basis and its images.
    class Side
    {
    public:
      Side(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert)
          : shift_invert(shift_invert), problem(problem), basis{Block(problem.rows, 0),
                                                                Block(problem.rows, 0),
                                                                Block(problem.rows, 0),
                                                                Block(problem.rows, 0)}
      {
      }

      /// F^{-1} M x.
      void start(const Block &x);

      Corrections correct(const RitzPairs &ritz);

      /// Adds what is new in the corrections of the given numbers.
      void expand(const Corrections &corrections, const std::vector<unsigned int> &numbers);

      /// The corrected vectors x + t, with their contact pressures.
      Pairs vectors(const RitzPairs &ritz);

      const ShiftInvert shift_invert;

      const Images &images() const
      {
        return basis;
      }
      unsigned int n_columns() const
      {
        return basis.y.n_columns();
      }
      unsigned int n_solves() const
      {
        return solves;
      }

    private:
      void expand(Block y, Block g);
      /// F (x + t) = -((l^2 - s) M + l P) x.
      Block sources(const RitzPairs &ritz) const;

      const QuadraticEigenproblem &problem;
      Images basis;
      unsigned int solves = 0;
    };

    void Side::start(const Block &x)
    {
      Block g = multiply(problem.M, x);
      Block y = shift_invert.solve(g);
      solves += g.n_columns();
      expand(std::move(y), std::move(g));
    }

    RitzPairs select(const RitzPairs &ritz, const std::vector<unsigned int> &numbers)
    {
      RitzPairs result;
      for (const unsigned int j : numbers)
      {
        result.lambda.push_back(ritz.lambda[j]);
        result.coefficients.push_back(ritz.coefficients[j]);
      }
      return result;
    }

    /// The coefficients of f_j x_j, Re and Im side by side.
    template <typename Factor>
    std::vector<double> real_columns(const RitzPairs &ritz, const unsigned int n_rows,
                                     const Factor &factor)
    {
      std::vector<double> columns(std::size_t(n_rows) * 2 * ritz.lambda.size());
      for (unsigned int j = 0; j < ritz.lambda.size(); ++j)
        for (unsigned int i = 0; i < ritz.coefficients[j].size(); ++i)
        {
          const Complex c = factor(ritz.lambda[j]) * ritz.coefficients[j][i];
          columns[i + std::size_t(n_rows) * 2 * j]       = c.real();
          columns[i + std::size_t(n_rows) * (2 * j + 1)] = c.imag();
        }
      return columns;
    }

    Block Side::sources(const RitzPairs &ritz) const
    {
      const unsigned int n = n_columns(), n_all = 2 * ritz.lambda.size();
      Block result = combine(basis.m,
                             real_columns(ritz, n, [&](const Complex &l)
                                          { return shift_invert.square - l * l; }),
                             n_all);
      subtract_combination(result, basis.p,
                           real_columns(ritz, n, [](const Complex &l) { return l; }));
      return result;
    }

    /// Turns each complex vector a + i b of a block of (a, b) so that a is as long as can be, a and
    /// b orthogonal, and leaves out short b: vectors are almost real and damping almost imaginary,
    /// so that most residuals have one direction only.
    Block main_parts(const Block &pairs, std::vector<unsigned int> &first)
    {
      constexpr double much_shorter = 0.02;
      const unsigned int n_pairs = pairs.n_columns() / 2, n = pairs.n_local();
      std::vector<double> sums(3 * n_pairs); // a a, b b, a b
      for (unsigned int j = 0; j < n_pairs; ++j)
      {
        const double *a = pairs.column(2 * j), *b = pairs.column(2 * j + 1);
        for (unsigned int i = 0; i < n; ++i)
        {
          sums[3 * j] += a[i] * a[i];
          sums[3 * j + 1] += b[i] * b[i];
          sums[3 * j + 2] += a[i] * b[i];
        }
      }
      MPI_Allreduce(MPI_IN_PLACE, sums.data(), sums.size(), MPI_DOUBLE, MPI_SUM,
                    pairs.row_range().comm);
      std::vector<double> coefficients;
      first.assign(1, 0);
      for (unsigned int j = 0; j < n_pairs; ++j)
      {
        // (a + i b)^T (a + i b) becomes real and positive.
        const Complex square(sums[3 * j] - sums[3 * j + 1], 2 * sums[3 * j + 2]);
        const double both = sums[3 * j] + sums[3 * j + 1], angle = -std::arg(square) / 2,
                     long_one = both + std::abs(square), short_one = both - std::abs(square);
        const bool keeps_both = short_one > much_shorter * much_shorter * long_one;
        first.push_back(first.back() + (keeps_both ? 2 : 1));
        coefficients.resize(std::size_t(2 * n_pairs) * first.back());
        const auto column         = coefficients.begin() + std::size_t(2 * n_pairs) * first[j];
        column[2 * j]             = std::cos(angle);
        column[2 * j + 1]         = -std::sin(angle);
        if (keeps_both)
        {
          column[2 * n_pairs + 2 * j]     = std::sin(angle);
          column[2 * n_pairs + 2 * j + 1] = std::cos(angle);
        }
      }
      return combine(pairs, coefficients, first.back());
    }

    Corrections Side::correct(const RitzPairs &ritz)
    {
      Corrections result;
      // -Q(l) x, with the contact pressures of the basis' vectors.
      Block residual = sources(ritz);
      subtract_combination(residual, basis.g,
                           real_columns(ritz, n_columns(), [](const Complex &) { return 1.; }));
      result.residual = main_parts(residual, result.first);
      result.t        = shift_invert.solve(result.residual);
      solves += result.t.n_columns();
      if (!problem.compliant)
        clear_pressures(problem.n_local_constraints, result.t);
      const std::vector<double> lengths = lengths_of(result.t);
      for (unsigned int j = 0; j < ritz.lambda.size(); ++j)
      {
        double square = 0; // the basis is orthonormal
        for (const Complex &c : ritz.coefficients[j])
          square += std::norm(c);
        double t_square = 0;
        for (unsigned int k = result.first[j]; k < result.first[j + 1]; ++k)
          t_square += lengths[k] * lengths[k];
        result.sizes.push_back(std::sqrt(t_square / square));
      }
      return result;
    }

    Pairs Side::vectors(const RitzPairs &ritz)
    {
      const Block y = shift_invert.solve(sources(ritz));
      solves += y.n_columns();
      Pairs pairs{ritz.lambda, Block(problem.rows, 0), Block(problem.rows, 0)};
      for (unsigned int j = 0; j < ritz.lambda.size(); ++j)
      {
        pairs.re.append(y.columns(2 * j, 1));
        pairs.im.append(y.columns(2 * j + 1, 1));
      }
      return pairs;
    }

    void Side::expand(const Corrections &corrections, const std::vector<unsigned int> &numbers)
    {
      Block t(problem.rows, 0), residual(problem.rows, 0);
      for (const unsigned int j : numbers)
      {
        const unsigned int first = corrections.first[j], n = corrections.first[j + 1] - first;
        t.append(corrections.t.columns(first, n));
        residual.append(corrections.residual.columns(first, n));
      }
      expand(std::move(t), std::move(residual));
    }

    void Side::expand(Block y, Block g)
    {
      // A remainder shorter than this, relatively, is rounding; a combination of remainders of unit
      // length shorter than that, too.
      constexpr double rounding = 1e-12, dependent = 1e-6;
      if (!problem.compliant)
        clear_pressures(problem.n_local_constraints, y);
      const auto combine_both = [&](const std::vector<double> &coefficients, const unsigned int n)
      {
        y = combine(y, coefficients, n);
        g = combine(g, coefficients, n);
      };
      // Twice is enough (Kahan).
      for (unsigned int pass = 0; pass < 2 && y.n_columns() > 0; ++pass)
      {
        const unsigned int n = y.n_columns();
        const DenseMatrix before(n, n, inner_products(y, y));
        DenseMatrix vectors = before;
        if (n_columns() > 0)
        {
          const std::vector<double> part = inner_products(basis.y, y);
          subtract_combination(y, basis.y, part);
          subtract_combination(g, basis.g, part);
          vectors = DenseMatrix(n, n, inner_products(y, y));
        }
        // Remainders of unit length, without those that are rounding, and of these the well
        // conditioned combinations.
        std::vector<double> length(n);
        for (unsigned int k = 0; k < n; ++k)
          length[k] = vectors(k, k) > rounding * rounding * before(k, k)
                          ? std::sqrt(vectors(k, k))
                          : std::numeric_limits<double>::infinity();
        for (unsigned int k = 0; k < n; ++k)
          for (unsigned int i = 0; i < n; ++i)
            vectors(i, k) /= length[i] * length[k];
        const std::vector<double> squares = symmetric_eigen(vectors);
        std::vector<double> coefficients;
        for (unsigned int k = 0; k < n; ++k)
          if (squares[k] > dependent * dependent)
            for (unsigned int i = 0; i < n; ++i)
              coefficients.push_back(vectors(i, k) / (length[i] * std::sqrt(squares[k])));
        combine_both(coefficients, coefficients.size() / n);
      }
      basis.m.append(multiply(problem.M, y));
      basis.p.append(multiply(problem.P, y));
      basis.y.append(y);
      basis.g.append(g);
    }

    /// Z^T B with the first n columns of each; what is known of it from before is kept.
    void grow(DenseMatrix &form, const Block &z, const Block &b, const unsigned int n)
    {
      const unsigned int old = form.n_rows, more = n - old;
      DenseMatrix all(n, n);
      for (unsigned int j = 0; j < old; ++j)
        for (unsigned int i = 0; i < old; ++i)
          all(i, j) = form(i, j);
      const std::vector<double> right = inner_products(z, 0, n, b, old, more),
                                below = inner_products(z, old, more, b, 0, old);
      for (unsigned int j = 0; j < more; ++j)
        for (unsigned int i = 0; i < n; ++i)
          all(i, old + j) = right[i + std::size_t(n) * j];
      for (unsigned int j = 0; j < old; ++j)
        for (unsigned int i = 0; i < more; ++i)
          all(old + i, j) = below[i + std::size_t(more) * j];
      form = std::move(all);
    }

    /// The two-sided search.
    class TwoSided
    {
    public:
      TwoSided(const QuadraticEigenproblem &problem, const Factorization &factorization,
               const WindowSearchOptions &options,
               const std::function<void(const std::string &)> &progress)
          : problem(problem), adjoint(adjoint_of(problem)), options(options), progress(progress),
            right(problem, ShiftInvert::of_square(factorization, options.region.square)),
            left(adjoint, ShiftInvert::of_square(factorization, options.region.square, true))
      {
      }
      WindowSearch run();

    private:
      void start();
      /// The Ritz pairs of the region and a little further, right and left.
      void find_ritz_pairs();
      /// Those that need a correction. Of modes that are not wanted only the place must be known:
      /// once their corrections were small, they rest until they move.
      std::vector<unsigned int> moving_pairs() const;
      bool is_wanted(const Complex &l) const
      {
        return options.region.contains(l) && l.imag() >= options.min_imaginary &&
               l.imag() <= options.max_imaginary;
      }
      /// How short a correction must be. Eigenvalues are right to its square; what is a little
      /// outside of the region must not be on its way in.
      double bound(const Complex &l) const
      {
        return is_wanted(l) ? step_bound : options.region.contains(l) ? 1e-2 : 3e-2;
      }
      /// The wanted pairs with their vectors; false if a backward error is too large.
      bool finish(WindowSearch &result);

      const QuadraticEigenproblem &problem;
      const QuadraticEigenproblem adjoint;
      const WindowSearchOptions &options;
      const std::function<void(const std::string &)> &progress;
      Side right, left;
      DenseMatrix m, p, f; ///< Z^T M U, Z^T P U, Z^T F U
      RitzPairs of_right, of_left;
      std::vector<Complex> at_rest;
      double step_bound     = 1e-6;
      unsigned int n_solves = 0;
    };

    void TwoSided::start()
    {
      BlockSearchOptions krylov;
      krylov.region        = options.region;
      krylov.max_imaginary = options.max_imaginary;
      krylov.tolerance     = 1e-4;
      krylov.n_expected    = options.n_expected;
      krylov.seed          = options.seed;
      krylov.reach         = 2; // neighbours of the region, to which P couples
      BlockSearch found = block_krylov_search(without_velocity_terms(problem), right.shift_invert,
                                              krylov, progress);
      n_solves          = found.n_solves;
      Block x           = std::move(found.pairs.re);
      x.append(found.pairs.im); // zero for a real vector
      if (!problem.compliant)
        clear_pressures(problem.n_local_constraints, x);
      x = orthonormalize(std::move(x));
      right.start(x);
      left.start(x);
    }

    void TwoSided::find_ritz_pairs()
    {
      const unsigned int n = std::min(right.n_columns(), left.n_columns());
      grow(m, left.images().y, right.images().m, n);
      grow(p, left.images().y, right.images().p, n);
      grow(f, left.images().y, right.images().g, n);
      DenseMatrix q = f;
      for (std::size_t k = 0; k < q.values.size(); ++k)
        q.values[k] -= options.region.square * m.values[k];
      of_right = of_left = {};
      for (DensePair &pair :
           two_sided_quadratic_eigenpairs(m, p, q, 0, std::sqrt(-options.region.square)))
        if (pair.lambda.imag() > 0 && options.region.distance(pair.lambda) <= 1.05)
        {
          of_right.lambda.push_back(pair.lambda);
          of_left.lambda.push_back(pair.lambda);
          of_right.coefficients.push_back(std::move(pair.vector));
          of_left.coefficients.push_back(std::move(pair.left));
        }
    }

    std::vector<unsigned int> TwoSided::moving_pairs() const
    {
      constexpr double at_the_same_place = 1e-3;
      std::vector<unsigned int> numbers;
      for (unsigned int j = 0; j < of_right.lambda.size(); ++j)
      {
        const Complex l = of_right.lambda[j];
        const bool rests =
            std::any_of(at_rest.begin(), at_rest.end(), [&](const Complex &other)
                        { return std::abs(l - other) <= at_the_same_place * std::abs(l); });
        if (is_wanted(l) || !rests)
          numbers.push_back(j);
      }
      return numbers;
    }

    bool TwoSided::finish(WindowSearch &result)
    {
      result.lambda.clear();
      std::vector<unsigned int> wanted;
      for (unsigned int j = 0; j < of_right.lambda.size(); ++j)
      {
        if (options.region.contains(of_right.lambda[j]))
          result.lambda.push_back(of_right.lambda[j]);
        if (is_wanted(of_right.lambda[j]))
          wanted.push_back(j);
      }
      result.right          = right.vectors(select(of_right, wanted));
      result.left           = left.vectors(select(of_left, wanted));
      result.backward_error = BackwardError(problem)(result.right.lambda, result.right.re,
                                                     result.right.im)
                                  .errors;
      result.left_backward_error =
          BackwardError(adjoint)(result.left.lambda, result.left.re, result.left.im).errors;
      result.n_solves   = n_solves + right.n_solves() + left.n_solves();
      const auto passes = [&](const double error) { return error <= options.tolerance; };
      return std::all_of(result.backward_error.begin(), result.backward_error.end(), passes) &&
             std::all_of(result.left_backward_error.begin(), result.left_backward_error.end(),
                         passes);
    }

    WindowSearch TwoSided::run()
    {
      start();
      constexpr unsigned int max_steps = 25;
      double worst                     = 0;
      for (unsigned int step = 0; step < max_steps; ++step)
      {
        find_ritz_pairs();
        const std::vector<unsigned int> moving = moving_pairs();
        const RitzPairs of_x = select(of_right, moving), of_y = select(of_left, moving);
        const Corrections right_steps = right.correct(of_x), left_steps = left.correct(of_y);
        std::vector<unsigned int> open;
        worst = 0;
        for (unsigned int j = 0; j < moving.size(); ++j)
        {
          const Complex l    = of_x.lambda[j];
          const double limit = bound(l),
                       size  = std::max(right_steps.sizes[j], left_steps.sizes[j]);
          worst              = std::max(worst, size / limit);
          if (!(size <= limit))
            open.push_back(j);
          else if (!is_wanted(l))
            at_rest.push_back(l);
        }
        progress("  window: " + std::to_string(of_right.lambda.size() - open.size()) + " of " +
                 std::to_string(of_right.lambda.size()) + " eigenvalues converged, subspace of " +
                 std::to_string(m.n_rows));
        WindowSearch result;
        if (open.empty() && finish(result))
          return result;
        if (open.empty())
        {
          step_bound /= 10;
          open.resize(moving.size());
          std::iota(open.begin(), open.end(), 0u);
        }
        right.expand(right_steps, open);
        left.expand(left_steps, open);
      }
      std::ostringstream message;
      message << "The modes of the window did not converge in " << max_steps
              << " steps: the largest correction is " << worst
              << " times what is allowed. Try a narrower window (Eigenproblem/Minimum frequency), a "
                 "larger Eigenproblem/Tolerance, or Eigenproblem/Solver = krylov.";
      throw SolverError(message.str());
    }
  } // namespace

  WindowSearch window_search(const QuadraticEigenproblem &problem,
                             const Factorization &factorization,
                             const WindowSearchOptions &options,
                             const std::function<void(const std::string &)> &progress)
  {
    return TwoSided(problem, factorization, options, progress).run();
  }
} // namespace squeal
