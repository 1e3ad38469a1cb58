#include <squeal/base/errors.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/reduction/craig_bampton.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace squeal
{
  namespace
  {
    /// The rows and columns from some on.
    Matrix trailing_block(const Matrix &matrix, const unsigned int first, const RowRange &rows)
    {
      EntryList entries;
      for_entries(matrix,
                  [&](const unsigned int row, const unsigned int column, const double value)
                  {
                    if (row >= first && column >= first)
                      entries.add(row - first, column - first, value);
                  });
      return entries.make_matrix(rows);
    }

    /// Modes of the space that a block spans: orthonormal in M, by ascending frequency.
    MultiVector ritz_modes(const Matrix &K, const Matrix &M, const MultiVector &block,
                           std::vector<double> &squares)
    {
      constexpr double dependent = 1e-10;
      // Columns of unit length in M, then what is independent of them
      DenseMatrix m                     = symmetrised(inner_products(block, multiply(M, block)));
      const std::vector<double> lengths = symmetric_eigen(m);
      DenseMatrix basis(m.n_rows, 0);
      for (unsigned int k = 0; k < lengths.size(); ++k)
        if (lengths[k] > dependent * lengths.back())
          basis.append(DenseMatrix(m.columns(k, 1)).scale({1 / std::sqrt(lengths[k])}));
      const MultiVector orthonormal = combine(block, basis);
      DenseMatrix k = symmetrised(inner_products(orthonormal, multiply(K, orthonormal)));
      squares       = symmetric_eigen(k);
      return combine(orthonormal, k);
    }

    /// The fixed-interface modes of a part.
    class FixedModes
    {
    public:
      FixedModes(const Matrix &K, const Matrix &M, const RowRange &rows) : K(K), M(M), rows(rows) {}

      /// The lowest, by ascending w^2.
      MultiVector find(const unsigned int wanted, const double frequency,
                       std::vector<double> &squares) const
      {
        // All modes of a small part, or most of them, come from a dense problem.
        constexpr unsigned int small = 500, large = 6000;
        const unsigned int n = rows.size, n_modes = std::min(wanted, n);
        MultiVector modes;
        if (n_modes == 0)
          return MultiVector(rows, 0);
        if (n <= small || (2 * n_modes > n && frequency == 0))
        {
          if (n > large)
            throw SolverError("Output/Superelement modes = " + std::to_string(wanted) +
                              ": most of the " + std::to_string(n) +
                              " modes of the part are too many; allowed are half of them.");
          std::vector<unsigned int> all(n);
          for (unsigned int i = 0; i < n; ++i)
            all[i] = i;
          modes = ritz_modes(K, M, unit_columns(rows, all), squares);
        }
        else
          modes = find_below(window(n_modes, 2 * M_PI * frequency), squares);
        unsigned int n_kept = std::min<std::size_t>(n_modes, squares.size());
        while (frequency > 0 && n_kept > 0 && std::sqrt(squares[n_kept - 1]) > 2 * M_PI * frequency)
          --n_kept;
        squares.resize(n_kept);
        return modes.columns(0, n_kept);
      }

    private:
      /// The number of modes below, by Sylvester's law.
      unsigned int count(const double omega) const
      {
        return Factorization(sum_of(rows, {{1., K}, {-omega * omega, M}}),
                             Factorization::Kind::ldlt, "the modes of the superelement")
            .inertia()
            .negative;
      }

      /// A frequency, 1/s, that has the wanted modes below it and few others; not above the limit.
      double window(const unsigned int wanted, const double limit) const
      {
        // Most are below (|K|/|M|)^(1/2).
        double high = std::sqrt(K.infinity_norm() / M.infinity_norm()) / 4, low = 0;
        if (limit > 0)
          high = std::min(high, limit);
        while (count(high) < wanted && !(limit > 0 && high >= limit))
        {
          low = high;
          high *= 2;
          if (limit > 0)
            high = std::min(high, limit);
        }
        for (unsigned int step = 0; step < 40 && count(high) > 1.3 * wanted + 5; ++step)
        {
          const double middle                   = (low + high) / 2;
          (count(middle) < wanted ? low : high) = middle;
        }
        return high;
      }

      MultiVector find_below(const double omega, std::vector<double> &squares) const
      {
        QuadraticEigenproblem problem;
        problem.rows             = rows;
        problem.M                = M.view(false);
        problem.Q                = K.view(false);
        problem.may_move_rigidly = false;
        problem.may_excite       = false;
        EigensolverOptions options;
        options.max_imaginary = omega;
        options.tolerance     = 1e-10;
        const EigenSolution found =
            make_eigensolver(ModeSolver::block_krylov)->solve(problem, options);
        if (found.modes.empty())
        {
          squares.clear();
          return MultiVector(rows, 0);
        }
        MultiVector block = found.modes.right.re;
        block.append(found.modes.right.im); // of equal modes
        MultiVector modes = ritz_modes(K, M, block, squares);
        squares.resize(std::min<std::size_t>(squares.size(), found.modes.size()));
        return modes;
      }

      const Matrix &K, &M;
      const RowRange rows;
    };
  } // namespace

  ReducedPart craig_bampton(const Matrix &K, const Matrix &M, const Matrix &D, const RowRange &rows,
                            const unsigned int n_interface, const unsigned int n_modes,
                            const double frequency)
  {
    ReducedPart result;
    const unsigned int n = rows.size, n_inner = n - n_interface;
    result.n_internal = n_inner;
    std::vector<double> squares;
    std::vector<unsigned int> interface(n_interface);
    for (unsigned int i = 0; i < n_interface; ++i)
      interface[i] = i;
    // [1; Psi], then [0; Phi]
    MultiVector basis = unit_columns(rows, interface);
    if (n_inner > 0)
    {
      const RowRange inner     = small_rows(n_inner);
      const Matrix K_ii        = trailing_block(K, n_interface, inner),
                   M_ii        = trailing_block(M, n_interface, inner);
      const MultiVector forces = multiply(K, basis);
      MultiVector right(inner, n_interface);
      for (unsigned int j = 0; j < n_interface; ++j)
        std::copy_n(forces.column(j) + n_interface, n_inner, right.column(j));
      {
        const Factorization held(K_ii, Factorization::Kind::ldlt,
                                 "the part of the superelement, held at its interface");
        const MultiVector moved = held.solve(right);
        for (unsigned int j = 0; j < n_interface; ++j)
          for (unsigned int i = 0; i < n_inner; ++i)
            basis.column(j)[n_interface + i] = -moved.column(j)[i];
      }
      const MultiVector modes = FixedModes(K_ii, M_ii, inner).find(n_modes, frequency, squares);
      MultiVector inside(rows, squares.size());
      for (unsigned int j = 0; j < squares.size(); ++j)
        std::copy_n(modes.column(j), n_inner, inside.column(j) + n_interface);
      basis.append(inside);
    }
    result.n_modes     = squares.size();
    result.highest     = squares.empty() ? 0 : std::sqrt(squares.back()) / (2 * M_PI);
    const auto reduced = [&](const Matrix &matrix)
    { return symmetrised(inner_products(basis, multiply(matrix, basis))); };
    result.K = reduced(K);
    result.M = reduced(M);
    if (D)
      result.D = reduced(D);
    // Known to be so: modes are orthogonal to each other and, in K, to static displacements.
    for (unsigned int k = 0; k < squares.size(); ++k)
      for (unsigned int i = 0; i < n_interface + squares.size(); ++i)
      {
        const unsigned int j = n_interface + k;
        result.K(i, j) = result.K(j, i) = i == j ? squares[k] : 0;
        if (i >= n_interface)
          result.M(i, j) = result.M(j, i) = i == j ? 1 : 0;
      }
    return result;
  }
} // namespace squeal
