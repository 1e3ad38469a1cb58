#include <squeal/block_krylov.h>
#include <squeal/dense.h>
#include <squeal/left_vectors.h>
#include <squeal/window_search.h>

#include <algorithm>
#include <cmath>
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

    /// Vectors Y = F^{-1} G with what is known of them. One linear map is applied to all of it.
    struct Images
    {
      Block y, g, m, p; ///< Y (without contact pressures), F Y, M Y, P Y

      void append(const Images &other)
      {
        y.append(other.y);
        g.append(other.g);
        m.append(other.m);
        p.append(other.p);
      }
      void subtract(const Images &other, const std::vector<double> &coefficients)
      {
        subtract_combination(y, other.y, coefficients);
        subtract_combination(g, other.g, coefficients);
        subtract_combination(m, other.m, coefficients);
        subtract_combination(p, other.p, coefficients);
      }
      void combine(const std::vector<double> &coefficients, const unsigned int n)
      {
        y = squeal::combine(y, coefficients, n);
        g = squeal::combine(g, coefficients, n);
        m = squeal::combine(m, coefficients, n);
        p = squeal::combine(p, coefficients, n);
      }
    };

    /// Corrected vectors of Ritz pairs.
    struct Corrected
    {
      Block y, g;                 ///< Re and Im side by side, with contact pressures; F y
      std::vector<double> change; ///< |y - x| / |x|
    };

    /// The right or the left half of the two-sided search: an orthonormal basis and its images.
    class Side
    {
    public:
      Side(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert)
          : problem(problem), shift_invert(shift_invert), basis{Block(problem.rows, 0),
                                                                Block(problem.rows, 0),
                                                                Block(problem.rows, 0),
                                                                Block(problem.rows, 0)}
      {
      }

      /// The Krylov space of F^{-1} M.
      void start(const BlockSearchOptions &search,
                 const std::function<void(const std::string &)> &progress);

      /// The columns 2j, 2j + 1 are Re and Im of the pair j.
      Corrected correct(const std::vector<Complex> &lambda,
                        const std::vector<std::vector<Complex>> &coefficients);

      /// Adds what is new in the corrected vectors of the given numbers.
      void expand(const Corrected &corrected, const std::vector<unsigned int> &numbers);

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

      const QuadraticEigenproblem &problem;
      const ShiftInvert shift_invert;
      Images basis;
      unsigned int solves = 0;
    };

    void Side::start(const BlockSearchOptions &search,
                     const std::function<void(const std::string &)> &progress)
    {
      BlockSearch found = block_krylov_search(without_velocity_terms(problem), shift_invert, search,
                                              progress);
      Block x = std::move(found.pairs.re);
      x.append(found.pairs.im); // zero for a real vector
      if (!problem.compliant)
        clear_pressures(problem.n_local_constraints, x);
      Block g = multiply(problem.M, orthonormalize(std::move(x)));
      Block y = shift_invert.solve(g);
      solves += found.n_solves + g.n_columns();
      expand(std::move(y), std::move(g));
    }

    Corrected Side::correct(const std::vector<Complex> &lambda,
                            const std::vector<std::vector<Complex>> &coefficients)
    {
      const unsigned int n_pairs = lambda.size(), n = n_columns();
      // g = -((l^2 - s) M + l P) x
      std::vector<double> of_x(std::size_t(n) * 2 * n_pairs), of_m = of_x, of_p = of_x;
      for (unsigned int j = 0; j < n_pairs; ++j)
        for (unsigned int i = 0; i < coefficients[j].size(); ++i)
        {
          const Complex c = coefficients[j][i], m = -(lambda[j] * lambda[j] - shift_invert.square) * c,
                        p     = -lambda[j] * c;
          const std::size_t k = i + std::size_t(n) * 2 * j;
          of_x[k]             = c.real();
          of_x[k + n]         = c.imag();
          of_m[k]             = m.real();
          of_m[k + n]         = m.imag();
          of_p[k]             = p.real();
          of_p[k + n]         = p.imag();
        }
      Corrected result;
      result.g      = combine(basis.m, of_m, 2 * n_pairs);
      const Block p = combine(basis.p, of_p, 2 * n_pairs);
      for (std::size_t i = 0; i < std::size_t(p.n_local()) * p.n_columns(); ++i)
        result.g.data()[i] += p.data()[i];
      result.y = shift_invert.solve(result.g);
      solves += result.y.n_columns();

      Block difference = result.y;
      if (!problem.compliant)
        clear_pressures(problem.n_local_constraints, difference);
      subtract_combination(difference, basis.y, of_x);
      const std::vector<double> lengths = lengths_of(difference);
      for (unsigned int j = 0; j < n_pairs; ++j)
      {
        double square = 0; // the basis is orthonormal
        for (const Complex &c : coefficients[j])
          square += std::norm(c);
        result.change.push_back(std::hypot(lengths[2 * j], lengths[2 * j + 1]) / std::sqrt(square));
      }
      return result;
    }

    void Side::expand(const Corrected &corrected, const std::vector<unsigned int> &numbers)
    {
      Block y(problem.rows, 0), g(problem.rows, 0);
      for (const unsigned int j : numbers)
      {
        y.append(corrected.y.columns(2 * j, 2));
        g.append(corrected.g.columns(2 * j, 2));
      }
      expand(std::move(y), std::move(g));
    }

    void Side::expand(Block y, Block g)
    {
      // A remainder shorter than this, relatively, is rounding; a combination of remainders of unit
      // length shorter than that, too.
      constexpr double rounding = 1e-12, dependent = 1e-6;
      if (!problem.compliant)
        clear_pressures(problem.n_local_constraints, y);
      Images added{std::move(y), std::move(g), {}, {}};
      added.m                          = multiply(problem.M, added.y);
      added.p                          = multiply(problem.P, added.y);
      const std::vector<double> before = lengths_of(added.y);
      // Twice is enough (Kahan).
      for (unsigned int pass = 0; pass < 2; ++pass)
      {
        if (n_columns() > 0)
          added.subtract(basis, inner_products(basis.y, added.y));
        const unsigned int n            = added.y.n_columns();
        const std::vector<double> after = lengths_of(added.y);
        std::vector<double> scaling;
        unsigned int n_kept = 0;
        for (unsigned int j = 0; j < n; ++j)
          if (pass == 1 || after[j] > rounding * before[j])
          {
            scaling.resize(std::size_t(n) * ++n_kept);
            scaling[std::size_t(n) * (n_kept - 1) + j] = 1 / after[j];
          }
        added.combine(scaling, n_kept);
        DenseMatrix vectors(n_kept, n_kept, inner_products(added.y, added.y));
        const std::vector<double> squares = symmetric_eigen(vectors);
        std::vector<double> coefficients;
        for (unsigned int j = 0; j < n_kept; ++j)
          if (squares[j] > dependent * dependent)
            for (unsigned int i = 0; i < n_kept; ++i)
              coefficients.push_back(vectors(i, j) / std::sqrt(squares[j]));
        added.combine(coefficients, n_kept == 0 ? 0 : coefficients.size() / n_kept);
      }
      basis.append(added);
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
      /// The Ritz pairs of the region and a little further.
      std::vector<DensePair> ritz_pairs();
      /// How short a correction must be.
      double bound(const Complex &l) const
      {
        if (options.region.distance(l) > 1)
          return 1e-3; // nothing may be on its way in
        const bool wanted = l.imag() >= options.min_imaginary && l.imag() <= options.max_imaginary;
        return wanted ? options.tolerance : std::sqrt(options.tolerance);
      }

      const QuadraticEigenproblem &problem;
      const QuadraticEigenproblem adjoint;
      const WindowSearchOptions &options;
      const std::function<void(const std::string &)> &progress;
      Side right, left;
      DenseMatrix m, p, f; ///< Z^T M U, Z^T P U, Z^T F U
    };

    std::vector<DensePair> TwoSided::ritz_pairs()
    {
      const unsigned int n = std::min(right.n_columns(), left.n_columns());
      grow(m, left.images().y, right.images().m, n);
      grow(p, left.images().y, right.images().p, n);
      grow(f, left.images().y, right.images().g, n);
      DenseMatrix q = f;
      for (std::size_t k = 0; k < q.values.size(); ++k)
        q.values[k] -= options.region.square * m.values[k];
      std::vector<DensePair> pairs;
      for (DensePair &pair :
           two_sided_quadratic_eigenpairs(m, p, q, 0, std::sqrt(-options.region.square)))
        if (pair.lambda.imag() > 0 && options.region.distance(pair.lambda) <= 1.05)
          pairs.push_back(std::move(pair));
      return pairs;
    }

    WindowSearch TwoSided::run()
    {
      BlockSearchOptions krylov;
      krylov.region        = options.region;
      krylov.max_imaginary = options.max_imaginary;
      krylov.tolerance     = 1e-6;
      krylov.n_expected    = options.n_expected;
      krylov.seed          = options.seed;
      krylov.reach         = 1.5;
      right.start(krylov, progress);
      left.start(krylov, progress);

      constexpr unsigned int max_steps = 20;
      double worst                     = 0;
      for (unsigned int step = 0; step < max_steps; ++step)
      {
        std::vector<DensePair> ritz = ritz_pairs();
        std::vector<Complex> lambda;
        std::vector<std::vector<Complex>> c, d;
        for (DensePair &pair : ritz)
        {
          lambda.push_back(pair.lambda);
          c.push_back(std::move(pair.vector));
          d.push_back(std::move(pair.left));
        }
        const Corrected of_right = right.correct(lambda, c), of_left = left.correct(lambda, d);
        std::vector<unsigned int> inside, open_right, open_left;
        worst = 0;
        for (unsigned int j = 0; j < lambda.size(); ++j)
        {
          if (options.region.contains(lambda[j]))
            inside.push_back(j);
          const double limit = bound(lambda[j]);
          if (!(of_right.change[j] <= limit))
            open_right.push_back(j);
          if (!(of_left.change[j] <= limit))
            open_left.push_back(j);
          worst = std::max({worst, of_right.change[j] / limit, of_left.change[j] / limit});
        }
        std::ostringstream line;
        line << "  window, step " << step << ": " << inside.size() << " eigenvalues, "
             << open_right.size() << " right and " << open_left.size()
             << " left vectors open, subspace of " << m.n_rows;
        line << " worst/limit " << worst;
        progress(line.str());
        if (open_right.empty() && open_left.empty())
        {
          const auto pairs_of = [&](const Corrected &corrected)
          {
            Pairs pairs{{}, Block(problem.rows, 0), Block(problem.rows, 0)};
            for (const unsigned int j : inside)
            {
              pairs.lambda.push_back(lambda[j]);
              pairs.re.append(corrected.y.columns(2 * j, 1));
              pairs.im.append(corrected.y.columns(2 * j + 1, 1));
            }
            return pairs;
          };
          return {pairs_of(of_right), pairs_of(of_left), right.n_solves() + left.n_solves()};
        }
        right.expand(of_right, open_right);
        left.expand(of_left, open_left);
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
