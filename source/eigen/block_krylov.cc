#include <squeal/eigen/block_krylov.h>
#include <squeal/linalg/dense.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    constexpr double rounding = 1e-13; ///< a direction shorter than this, relatively, is noise

    /// Contact pressures are carried along scaled by this, so that no inner product sees them.
    constexpr double invisible = 1e-140;

    DenseMatrix gram_matrix(const MultiVector &block)
    {
      return {block.n_columns(), block.n_columns(), inner_products(block, block)};
    }

    /// Orthonormal columns after one more projection: those that it did not hurt, made orthonormal
    /// again. Others were noise.
    MultiVector repair(const MultiVector &block)
    {
      const unsigned int n          = block.n_columns();
      DenseMatrix vectors           = gram_matrix(block);
      const std::vector<double> eig = symmetric_eigen(vectors);
      std::vector<double> coefficients;
      for (unsigned int j = 0; j < n; ++j)
        if (eig[j] > 0.5)
          for (unsigned int i = 0; i < n; ++i)
            coefficients.push_back(vectors(i, j) / std::sqrt(eig[j]));
      return combine(block, coefficients, coefficients.size() / n);
    }

    /// Columns first ... first + n of a.
    DenseMatrix columns_of(const DenseMatrix &a, const unsigned int first, const unsigned int n)
    {
      const auto begin = a.values.begin() + std::size_t(first) * a.n_rows;
      return {a.n_rows, n, std::vector<double>(begin, begin + std::size_t(n) * a.n_rows)};
    }

    void append(DenseMatrix &a, const DenseMatrix &b)
    {
      if (b.n_columns == 0)
        return;
      a.values.insert(a.values.end(), b.values.begin(), b.values.end());
      a.n_rows = b.n_rows;
      a.n_columns += b.n_columns;
    }

    /// Displacements less the constraints between them: the dimension of the range of Q(s)^{-1} M.
    unsigned int n_free_displacements(const QuadraticEigenproblem &problem)
    {
      unsigned int n_pressures = problem.n_local_constraints;
      MPI_Allreduce(MPI_IN_PLACE, &n_pressures, 1, MPI_UNSIGNED, MPI_SUM, problem.rows.comm);
      return problem.rows.size - n_pressures - (problem.compliant ? 0 : problem.n_constraints);
    }

    /// A Krylov decomposition  S V = V_all H  that grows by blocks: V are the first n_columns() of
    /// the orthonormal V_all.
    class Arnoldi
    {
    public:
      Arnoldi(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert, const double c,
              const unsigned int block_size, const unsigned int seed)
          : problem(problem), shift_invert(shift_invert), c(c), quadratic(bool(problem.P)),
            largest(n_free_displacements(problem)), basis(problem.rows, 0)
      {
        start(block_size, seed);
      }

      void step();

      unsigned int n_columns() const
      {
        return hessenberg_columns.size();
      }
      unsigned int n_new() const ///< in the block that comes next; 0: the space is invariant
      {
        return small.n_columns - n_columns();
      }
      unsigned int n_solves() const
      {
        return solves;
      }
      MultiVector release_basis()
      {
        return std::move(basis);
      }
      /// (n_columns + n_new) x n_columns.
      DenseMatrix hessenberg() const;
      /// The first halves of S V C, with their contact pressures.
      MultiVector images(const DenseMatrix &coefficients) const;

    private:
      void start(unsigned int block_size, unsigned int seed);
      /// Coefficients of a block in U, which it may enlarge.
      DenseMatrix expand(MultiVector block);
      /// Coefficients of small vectors in the small basis, which they may enlarge.
      DenseMatrix expand_small(DenseMatrix block);
      void scale_pressures(MultiVector &block, double factor) const;

      const QuadraticEigenproblem &problem;
      const ShiftInvert &shift_invert;
      const double c;
      const bool quadratic;
      const unsigned int largest; ///< dimension of the space of displacements in contact
      MultiVector basis;          ///< U
      DenseMatrix small;          ///< the (g_1, g_2) of V_all; only g_1 = I without a velocity term
      std::vector<std::vector<double>> hessenberg_columns;
      unsigned int solves = 0;
    };

    void Arnoldi::scale_pressures(MultiVector &block, const double factor) const
    {
      for (unsigned int k = 0; k < block.n_columns(); ++k)
        for (unsigned int i = block.n_local() - problem.n_local_constraints; i < block.n_local();
             ++i)
          block.column(k)[i] *= factor;
    }

    DenseMatrix Arnoldi::expand(MultiVector block)
    {
      const unsigned int n_old = basis.n_columns(), n_block = block.n_columns();
      const DenseMatrix before = gram_matrix(block),
                        old(n_old, n_block, inner_products(basis, block));
      subtract_combination(block, basis, old.values);
      const DenseMatrix after = gram_matrix(block);
      // What is left beyond the dimension of the space is rounding: the longest remainders are new.
      std::vector<unsigned int> kept;
      for (unsigned int k = 0; k < n_block; ++k)
        if (after(k, k) > rounding * rounding * before(k, k))
          kept.push_back(k);
      std::stable_sort(kept.begin(), kept.end(),
                       [&](const unsigned int i, const unsigned int j)
                       { return after(i, i) * before(j, j) > after(j, j) * before(i, i); });
      kept.resize(std::min<std::size_t>(kept.size(), largest - std::min(largest, n_old)));
      std::sort(kept.begin(), kept.end());
      MultiVector rest(problem.rows, 0);
      for (const unsigned int k : kept)
        rest.append(block.columns(k, 1));
      // Twice is enough (Kahan).
      rest = orthonormalize(std::move(rest));
      if (rest.n_columns() > 0)
      {
        subtract_combination(rest, basis, inner_products(basis, rest));
        rest = repair(rest);
      }
      const DenseMatrix added(rest.n_columns(), n_block, inner_products(rest, block));
      basis.append(rest);

      DenseMatrix coefficients(basis.n_columns(), n_block);
      for (unsigned int j = 0; j < n_block; ++j)
      {
        for (unsigned int i = 0; i < n_old; ++i)
          coefficients(i, j) = old(i, j);
        for (unsigned int i = 0; i < added.n_rows; ++i)
          coefficients(n_old + i, j) = added(i, j);
      }
      return coefficients;
    }

    DenseMatrix Arnoldi::expand_small(DenseMatrix block)
    {
      const unsigned int n_rows = block.n_rows, n_old = small.n_columns;
      DenseMatrix coefficients(n_old, block.n_columns);
      std::vector<double> before(block.n_columns);
      const auto norm = [&](const DenseMatrix &a, const unsigned int j)
      {
        double square = 0;
        for (unsigned int i = 0; i < n_rows; ++i)
          square += a(i, j) * a(i, j);
        return std::sqrt(square);
      };
      for (unsigned int j = 0; j < block.n_columns; ++j)
        before[j] = norm(block, j);
      for (unsigned int pass = 0; pass < 2; ++pass)
      {
        DenseMatrix part(n_old, block.n_columns);
        gemm(true, 1, small, block, 0, part);
        gemm(false, -1, small, part, 1, block);
        for (std::size_t k = 0; k < part.values.size(); ++k)
          coefficients.values[k] += part.values[k];
      }
      // Modified Gram-Schmidt, twice, of the few columns of the block.
      DenseMatrix added(n_rows, 0);
      std::vector<std::vector<double>> more(block.n_columns);
      for (unsigned int j = 0; j < block.n_columns; ++j)
      {
        more[j].assign(added.n_columns, 0.);
        for (unsigned int pass = 0; pass < 2; ++pass)
          for (unsigned int k = 0; k < added.n_columns; ++k)
          {
            double product = 0;
            for (unsigned int i = 0; i < n_rows; ++i)
              product += added(i, k) * block(i, j);
            for (unsigned int i = 0; i < n_rows; ++i)
              block(i, j) -= product * added(i, k);
            more[j][k] += product;
          }
        const double length = norm(block, j);
        // As in expand(): beyond the dimension of the space there is only rounding.
        if (length > rounding * before[j] && n_old + added.n_columns < n_rows)
        {
          DenseMatrix column = columns_of(block, j, 1);
          for (double &value : column.values)
            value /= length;
          append(added, column);
          more[j].push_back(length);
        }
      }
      append(small, added);
      coefficients = with_rows(coefficients, small.n_columns);
      for (unsigned int j = 0; j < block.n_columns; ++j)
        for (unsigned int k = 0; k < more[j].size(); ++k)
          coefficients(n_old + k, j) = more[j][k];
      return coefficients;
    }

    /// (u, l) with both parts filled up to n rows.
    DenseMatrix stack(const DenseMatrix &upper, const DenseMatrix &lower, const unsigned int n)
    {
      DenseMatrix result(2 * n, upper.n_columns);
      for (unsigned int j = 0; j < upper.n_columns; ++j)
      {
        for (unsigned int i = 0; i < upper.n_rows; ++i)
          result(i, j) = upper(i, j);
        for (unsigned int i = 0; i < lower.n_rows; ++i)
          result(n + i, j) = lower(i, j);
      }
      return result;
    }

    DenseMatrix part_of(const DenseMatrix &stacked, const unsigned int half)
    {
      const unsigned int n = stacked.n_rows / 2;
      DenseMatrix result(n, stacked.n_columns);
      for (unsigned int j = 0; j < stacked.n_columns; ++j)
        for (unsigned int i = 0; i < n; ++i)
          result(i, j) = stacked(half * n + i, j);
      return result;
    }

    void Arnoldi::start(const unsigned int block_size, const unsigned int seed)
    {
      MultiVector block = shift_invert.solve(
          multiply(problem.M, scattered_numbers(problem.rows, block_size, seed)));
      solves += block_size;
      scale_pressures(block, invisible);
      basis                = orthonormalize(std::move(block));
      const unsigned int d = basis.n_columns();
      small                = DenseMatrix(quadratic ? 2 * d : d, d); // a = U, b = 0
      for (unsigned int i = 0; i < d; ++i)
        small(i, i) = 1;
    }

    void Arnoldi::step()
    {
      const double s         = shift_invert.shift;
      const unsigned int n   = n_new();
      const DenseMatrix last = columns_of(small, n_columns(), n);
      const DenseMatrix a    = quadratic ? part_of(last, 0) : DenseMatrix(),
                        b    = quadratic ? part_of(last, 1) : last;
      // -c (P + 2 s M) a - c^2 M b, and + c^2 M b without a velocity term
      DenseMatrix factors = b;
      for (std::size_t k = 0; k < factors.values.size(); ++k)
        factors.values[k] =
            quadratic ? -c * c * b.values[k] - 2 * s * c * a.values[k] : c * c * b.values[k];
      append(factors, a);
      const MultiVector vectors = combine(basis, factors.values, factors.n_columns);
      MultiVector right         = multiply(problem.M, vectors.columns(0, n));
      if (quadratic)
      {
        const MultiVector of_p = multiply(problem.P, vectors.columns(n, n));
        for (std::size_t i = 0; i < std::size_t(right.n_local()) * n; ++i)
          right.data()[i] -= c * of_p.data()[i];
      }
      MultiVector solution = shift_invert.solve(right);
      scale_pressures(solution, invisible);
      DenseMatrix image    = expand(std::move(solution));
      const unsigned int d = basis.n_columns();
      solves += n;
      if (quadratic)
      {
        small = stack(part_of(small, 0), part_of(small, 1), d);
        image = stack(image, a, d);
      }
      else
        small = with_rows(small, d);
      const DenseMatrix columns = expand_small(std::move(image));
      for (unsigned int j = 0; j < n; ++j)
        hessenberg_columns.push_back(columns_of(columns, j, 1).values);
    }

    DenseMatrix Arnoldi::hessenberg() const
    {
      DenseMatrix result(small.n_columns, n_columns());
      for (unsigned int j = 0; j < n_columns(); ++j)
        std::copy(hessenberg_columns[j].begin(), hessenberg_columns[j].end(),
                  &result.values[std::size_t(j) * result.n_rows]);
      return result;
    }

    MultiVector Arnoldi::images(const DenseMatrix &coefficients) const
    {
      const DenseMatrix all = hessenberg();
      DenseMatrix in_small(all.n_rows, coefficients.n_columns);
      gemm(false, 1, all, coefficients, 0, in_small);
      const DenseMatrix upper = quadratic ? part_of(small, 0) : small;
      DenseMatrix in_basis(upper.n_rows, coefficients.n_columns);
      gemm(false, 1, upper, in_small, 0, in_basis);
      MultiVector result = combine(basis, in_basis.values, coefficients.n_columns);
      scale_pressures(result, 1 / invisible);
      return result;
    }

    /// The Ritz pairs up to a distance.
    struct Ritz
    {
      std::vector<Complex> lambda;
      std::vector<double> residual; ///< |S v - theta v| / |theta|
      DenseMatrix re, im;           ///< in V
    };

    Ritz ritz_pairs(const DenseMatrix &h, const ShiftInvert &shift_invert, const bool quadratic,
                    const SearchRegion &region, const double reach)
    {
      const double c          = region.radius;
      const unsigned int m    = h.n_columns;
      const DenseEigenpairs e = general_eigen(with_rows(h, m));
      Ritz result;
      result.re = result.im = DenseMatrix(m, 0);
      for (unsigned int j = 0; j < m; ++j)
      {
        const Complex theta(e.re[j], e.im[j]);
        const bool complex_pair = e.im[j] != 0;
        const DenseMatrix re    = columns_of(e.vectors, j, 1);
        DenseMatrix im(m, 1);
        if (complex_pair)
          im = columns_of(e.vectors, j + 1, 1);
        double square = 0;
        for (unsigned int i = m; i < h.n_rows; ++i)
        {
          Complex r = 0;
          for (unsigned int k = 0; k < m; ++k)
            r += h(i, k) * Complex(re.values[k], im.values[k]);
          square += std::norm(r);
        }
        const auto add = [&](const Complex lambda, const double sign)
        {
          if (region.distance(lambda) > reach)
            return;
          result.lambda.push_back(lambda);
          result.residual.push_back(std::sqrt(square) / std::abs(theta));
          append(result.re, re);
          DenseMatrix signed_im = im;
          for (double &value : signed_im.values)
            value *= sign;
          append(result.im, signed_im);
        };
        if (std::abs(theta) > 0)
        {
          if (quadratic)
            add(shift_invert.shift + c / std::conj(theta), -1); // conj(theta): Im l >= 0
          else
            for (const SquareRoot &root : upper_square_roots(shift_invert.square - c * c / theta))
              add(root.value, root.conjugate ? -1 : 1);
        }
        j += complex_pair;
      }
      return result;
    }

    EigenPairs select_pairs(const Arnoldi &arnoldi, const Ritz &ritz,
                            const BlockSearchOptions &options)
    {
      EigenPairs pairs;
      DenseMatrix re(ritz.re.n_rows, 0), im(ritz.im.n_rows, 0);
      for (unsigned int j = 0; j < ritz.lambda.size(); ++j)
        if (options.region.distance(ritz.lambda[j]) <= options.reach)
        {
          pairs.lambda.push_back(ritz.lambda[j]);
          append(re, columns_of(ritz.re, j, 1));
          append(im, columns_of(ritz.im, j, 1));
        }
      pairs.right = {arnoldi.images(re), arnoldi.images(im)};
      return pairs;
    }
  } // namespace

  EigenSolution block_krylov_search(const QuadraticEigenproblem &problem,
                                    const ShiftInvert &shift_invert,
                                    const BlockSearchOptions &options,
                                    const std::function<void(const std::string &)> &progress)
  {
    const bool quadratic = bool(problem.P);
    Arnoldi arnoldi(problem, shift_invert, options.region.radius,
                    std::min(options.block_size, n_free_displacements(problem)), options.seed);
    EigenSolution result;
    const unsigned int per_mode = quadratic ? 2 : 1;
    unsigned int next_check     = per_mode * (3 * options.n_expected / 2 + 2 * options.block_size);
    const unsigned int largest  = per_mode * (20 * options.n_expected + 40 * options.block_size);
    constexpr unsigned int none = std::numeric_limits<unsigned int>::max() / 4;
    unsigned int done_since     = none;
    for (;;)
    {
      if (arnoldi.n_new() > 0)
        arnoldi.step();
      const unsigned int m = arnoldi.n_columns();
      if (m < next_check && arnoldi.n_new() > 0)
        continue;
      next_check      = m + 2 * options.block_size;
      const Ritz ritz = ritz_pairs(arnoldi.hessenberg(), shift_invert, quadratic, options.region,
                                   std::max(1.05, options.reach));
      unsigned int n_inside = 0, n_converged = 0;
      bool done = true;
      for (unsigned int j = 0; j < ritz.lambda.size(); ++j)
      {
        // In the window to the tolerance, in the rest of the disc to its root, and a little
        // further nothing may be on its way in.
        const double distance = options.region.distance(ritz.lambda[j]);
        if (distance > 1.05)
          continue;
        const bool inside  = distance <= 1;
        const double bound = ritz.lambda[j].imag() <= options.max_imaginary
                                 ? options.tolerance
                                 : std::sqrt(options.tolerance);
        n_inside += inside;
        n_converged += inside && ritz.residual[j] <= bound;
        done = done && (ritz.residual[j] <= bound || (!inside && ritz.residual[j] <= 1e-3));
      }
      progress("  block_krylov: " + std::to_string(n_converged) + " of " +
               std::to_string(n_inside) + " eigenvalues converged, subspace of " +
               std::to_string(m));
      // Friction may have moved a mode out of the disc: fewer than expected are all if a space half
      // as large again shows no more.
      done_since = done ? std::min(done_since, m) : none;
      if ((done && (n_inside >= options.n_expected || 2 * m >= 3 * done_since)) ||
          arnoldi.n_new() == 0)
      {
        result.modes = select_pairs(arnoldi, ritz, options);
        break;
      }
      if (m >= largest)
        throw SolverError("The block Krylov search did not converge in a space of " +
                              std::to_string(m) + " vectors: " + std::to_string(n_converged) +
                              " of " + std::to_string(n_inside) + " eigenvalues.",
                          {Failure::krylov_space_full});
    }
    result.cost.n_solves      = arnoldi.n_solves();
    result.reuse.search_space = arnoldi.release_basis();
    return result;
  }
} // namespace squeal
