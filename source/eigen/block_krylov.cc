#include <squeal/eigen/block_krylov.h>
#include <squeal/projection/search_space.h>
#include <squeal/projection/small_problem.h>

#include <algorithm>
#include <cmath>
#include <limits>

// Block Krylov search. Arnoldi holds the space: the basis U, the small orthonormal factors of the
// Krylov vectors, and the Hessenberg matrix, a block of which comes with each step(). The search
// looks at the eigenvalues of that matrix when enough may have converged, and ends when all of the
// region have; their vectors are images S v, which have contact pressures. What is nearly converged
// outside of the region is reported, too.

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    constexpr double rounding = 1e-13; ///< a direction shorter than this, relatively, is noise

    /// Contact pressures are carried along scaled by this, so that no inner product sees them.
    constexpr double invisible = 1e-140;

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
            space(problem.rows, n_free_displacements(problem))
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
        return space.release();
      }
      /// (n_columns + n_new) x n_columns.
      DenseMatrix hessenberg() const;
      /// The first halves of S V C, with their contact pressures.
      ComplexMultiVector images(const ComplexDenseMatrix &coefficients) const;

    private:
      void start(unsigned int block_size, unsigned int seed);
      /// Coefficients of a block in U, which it may enlarge.
      DenseMatrix expand(MultiVector block);
      /// Coefficients of small vectors in the small basis, which they may enlarge.
      DenseMatrix expand_small(const DenseMatrix &block);
      void scale_pressures(MultiVector &block, double factor) const;

      const QuadraticEigenproblem &problem;
      const ShiftInvert &shift_invert;
      const double c;
      const bool quadratic;
      SearchSpace space; ///< U, of displacements in contact
      DenseMatrix small; ///< the (g_1, g_2) of V_all; only g_1 = I without a velocity term
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
      // What is left beyond the dimension of the space is rounding: the longest remainders are new.
      DenseMatrix coefficients;
      space.add(std::move(block), {rounding}, {}, &coefficients);
      return coefficients;
    }

    DenseMatrix Arnoldi::expand_small(const DenseMatrix &block)
    {
      SearchSpace small_space(to_multi_vector(small), small.n_rows);
      DenseMatrix coefficients;
      const MultiVector added =
          small_space.add(to_multi_vector(block), {rounding}, {}, &coefficients);
      small.append({added.data(), small.n_rows, added.n_columns()});
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
      return stacked.rows(half * stacked.n_rows / 2, stacked.n_rows / 2);
    }

    void Arnoldi::start(const unsigned int block_size, const unsigned int seed)
    {
      // Motions without mass are in the range of Q(s)^{-1} P only.
      MultiVector right = multiply(problem.M, scattered_numbers(problem.rows, block_size, seed));
      if (quadratic)
      {
        constexpr unsigned int others = 100;  // numbers that are not those of M
        constexpr double share        = 1e-3; // little of what M alone finds sooner
        MultiVector of_p =
            multiply(problem.P, scattered_numbers(problem.rows, block_size, others + seed));
        of_p *= share / c;
        right += of_p;
      }
      MultiVector block = shift_invert.solve(right);
      solves += block_size;
      scale_pressures(block, invisible);
      space.add(std::move(block), {rounding});
      const unsigned int d = space.n_columns();
      small                = DenseMatrix(quadratic ? 2 * d : d, d); // a = U, b = 0
      for (unsigned int i = 0; i < d; ++i)
        small(i, i) = 1;
    }

    void Arnoldi::step()
    {
      const double s         = shift_invert.shift;
      const unsigned int n   = n_new();
      const DenseMatrix last = small.columns(n_columns(), n);
      const DenseMatrix a    = quadratic ? part_of(last, 0) : DenseMatrix(),
                        b    = quadratic ? part_of(last, 1) : last;
      // -c (P + 2 s M) a - c^2 M b, and + c^2 M b without a velocity term
      DenseMatrix factors = b;
      for (std::size_t k = 0; k < factors.values.size(); ++k)
        factors.values[k] =
            quadratic ? -c * c * b.values[k] - 2 * s * c * a.values[k] : c * c * b.values[k];
      factors.append(a);
      const MultiVector vectors = combine(space.basis(), factors);
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
      const unsigned int d = space.n_columns();
      solves += n;
      if (quadratic)
      {
        small = stack(part_of(small, 0), part_of(small, 1), d);
        image = stack(image, a, d);
      }
      else
        small.resize_rows(d);
      const DenseMatrix columns = expand_small(image);
      for (unsigned int j = 0; j < n; ++j)
        hessenberg_columns.push_back(DenseMatrix(columns.columns(j, 1)).values);
    }

    DenseMatrix Arnoldi::hessenberg() const
    {
      DenseMatrix result(small.n_columns, n_columns());
      for (unsigned int j = 0; j < n_columns(); ++j)
        std::copy(hessenberg_columns[j].begin(), hessenberg_columns[j].end(),
                  &result.values[std::size_t(j) * result.n_rows]);
      return result;
    }

    ComplexMultiVector Arnoldi::images(const ComplexDenseMatrix &coefficients) const
    {
      const ComplexDenseMatrix in_small = hessenberg() * coefficients;
      ComplexMultiVector result =
          combine(space.basis(), small.rows(0, space.n_columns()) * in_small);
      scale_pressures(result.re, 1 / invisible);
      scale_pressures(result.im, 1 / invisible);
      return result;
    }

    /// The Ritz pairs in V up to a distance, with errors |S v - theta v| / |theta|.
    SmallPairs ritz_pairs(const DenseMatrix &h, const ShiftInvert &shift_invert,
                          const bool quadratic, const SearchRegion &region, const double reach)
    {
      const double c                      = region.radius;
      const unsigned int m                = h.n_columns;
      const DenseEigenpairs e             = general_eigen<double>(h.rows(0, m));
      const std::vector<double> residuals = (h.rows(m, h.n_rows - m) * e.right).column_norms();
      SmallPairs result;
      result.right = ComplexDenseMatrix(m, 0);
      for (unsigned int j = 0; j < m; ++j)
      {
        const Complex theta = e.values[j];
        if (theta.imag() < 0) // its conjugate is there
          continue;
        const auto add = [&](const Complex lambda, const bool conjugate)
        {
          if (region.distance(lambda) > reach)
            return;
          ComplexDenseMatrix vector = e.right.columns(j, 1);
          result.lambda.push_back(lambda);
          result.errors.push_back(residuals[j] / std::abs(theta));
          result.right.append(conjugate ? vector.conjugate() : vector);
        };
        if (std::abs(theta) > 0)
        {
          if (quadratic)
            add(shift_invert.shift + c / std::conj(theta), true); // conj(theta): Im l >= 0
          else
            for (const SquareRoot &root : upper_square_roots(shift_invert.square - c * c / theta))
              add(root.value, root.conjugate);
        }
      }
      return result;
    }

    /// Eigenvalues farther out, or not converged, that are nearly converged.
    std::vector<Complex> not_given(const SmallPairs &ritz, const SearchRegion &region,
                                   const double given)
    {
      constexpr double nearly = 0.1; // of their residuals
      std::vector<Complex> result;
      for (unsigned int k = 0; k < ritz.size(); ++k)
        if (ritz.errors[k] <= nearly &&
            (region.distance(ritz.lambda[k]) > 1 || ritz.errors[k] > given))
          result.push_back(ritz.lambda[k]);
      return result;
    }

    /// The pairs within reach whose errors are not larger.
    EigenPairs select_pairs(const Arnoldi &arnoldi, const SmallPairs &ritz,
                            const double largest_error, const BlockSearchOptions &options)
    {
      std::vector<unsigned int> chosen;
      for (unsigned int k = 0; k < ritz.size(); ++k)
        if (!(ritz.errors[k] > largest_error) &&
            options.region.distance(ritz.lambda[k]) <= options.reach)
          chosen.push_back(k);
      const SmallPairs found = ritz.select(chosen);
      EigenPairs pairs;
      pairs.lambda = found.lambda;
      pairs.right  = arnoldi.images(found.right);
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
    const unsigned int largest =
        options.most_vectors > 0 ? options.most_vectors
                                 : per_mode * (20 * options.n_expected + 40 * options.block_size);
    constexpr unsigned int none = std::numeric_limits<unsigned int>::max() / 4;
    unsigned int done_since     = none;
    for (;;)
    {
      if (arnoldi.n_new() > 0)
        arnoldi.step();
      const unsigned int m = arnoldi.n_columns();
      if (m < next_check && arnoldi.n_new() > 0)
        continue;
      // A search that may fail is checked seldom: its Ritz values cost as much as its vectors.
      next_check = m + (options.most_vectors > 0 ? std::max(2 * options.block_size, m / 3)
                                                 : 2 * options.block_size);
      const SmallPairs ritz = ritz_pairs(arnoldi.hessenberg(), shift_invert, quadratic,
                                         options.region, std::max(1.05, options.reach));
      unsigned int n_inside = 0, n_converged = 0;
      bool done = true;
      for (unsigned int k = 0; k < ritz.size(); ++k)
      {
        // In the window to the tolerance, in the rest of the disc to its root, and a little
        // further nothing may be on its way in.
        const double distance = options.region.distance(ritz.lambda[k]), residual = ritz.errors[k];
        if (distance > 1.05)
          continue;
        const bool inside  = distance <= 1;
        const double bound = ritz.lambda[k].imag() <= options.max_imaginary
                                 ? options.tolerance
                                 : std::sqrt(options.tolerance);
        n_inside += inside;
        n_converged += inside && residual <= bound;
        done = done && (residual <= bound || (!inside && residual <= 1e-3));
      }
      progress("  block_krylov: " + std::to_string(n_converged) + " of " +
               std::to_string(n_inside) + " eigenvalues converged, subspace of " +
               std::to_string(m));
      // Friction may have moved a mode out of the disc: fewer than expected are all if a space half
      // as large again shows no more.
      done_since = done ? std::min(done_since, m) : none;
      const bool is_complete =
          (done && (n_inside >= options.n_expected || 2 * m >= 3 * done_since)) ||
          arnoldi.n_new() == 0;
      const bool is_partial = !is_complete && options.most_vectors > 0 && m >= largest;
      if (is_complete || is_partial)
      {
        constexpr double everywhere = std::numeric_limits<double>::infinity();
        const double largest_error  = is_partial ? options.tolerance : everywhere;
        result.modes                = select_pairs(arnoldi, ritz, largest_error, options);
        if (options.region.is_disc())
          result.proof.ritz_values_beyond = not_given(
              ritz_pairs(arnoldi.hessenberg(), shift_invert, quadratic, options.region, everywhere),
              options.region, largest_error);
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
