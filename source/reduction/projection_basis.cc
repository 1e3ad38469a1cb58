#include <squeal/projection/eigensolver_options.h>
#include <squeal/projection/shift_invert.h>
#include <squeal/projection/small_problem.h>
#include <squeal/reduction/projection_basis.h>

#include <cmath>

namespace squeal
{
  using Complex = std::complex<double>;

  MultiVector ProjectionBasis::displacements(MultiVector block) const
  {
    clear_pressures(n_local_constraints, block);
    return block;
  }

  namespace
  {
    /// Modes, each Re and Im, become unit vectors.
    void scale_modes(MultiVector &block)
    {
      const std::vector<double> squares = inner_products(block, block).values;
      const unsigned int n              = block.n_columns() / 2;
      std::vector<double> factors(2 * n);
      for (unsigned int j = 0; j < 2 * n; ++j)
      {
        const unsigned int re = j % n, im = re + n;
        factors[j] = 1 / std::sqrt(squares[re * (2 * n + 1)] + squares[im * (2 * n + 1)]);
      }
      scale_columns(block, factors);
    }

    Novelty components(const double smallest)
    {
      return {smallest, 0, true};
    }

    /// The space of modes, Re and Im: first what is well apart, as many as it returns.
    unsigned int begin_space(MultiVector modes, SearchSpace &space)
    {
      scale_modes(modes);
      space.add(modes, components(0.3));
      const unsigned int n_apart = space.n_columns();
      space.add(std::move(modes), components(ProjectionBasis::smallest));
      return n_apart;
    }
  } // namespace

  void ProjectionBasis::begin(MultiVector of_right, MultiVector of_left)
  {
    space                      = SearchSpace(rows);
    const unsigned int n_apart = begin_space(std::move(of_right), space);
    test_by(std::move(of_left), n_apart);
  }

  DenseMatrix ProjectionBasis::begin_within(const DenseMatrix &of_right, MultiVector of_left,
                                            const std::vector<Within> &others)
  {
    const unsigned int m = dimension();
    SearchSpace within(small_rows(m));
    const unsigned int n_apart = begin_space(to_multi_vector(of_right), within);
    for (const Within &other : others)
      within.add(to_multi_vector(other.coordinates), components(other.smallest));
    const MultiVector &basis = within.basis();
    const DenseMatrix c(m, basis.n_columns(),
                        {basis.data(), basis.data() + std::size_t(m) * basis.n_columns()});
    space.turn(c);
    test_by(std::move(of_left), n_apart);
    return c;
  }

  void ProjectionBasis::append(MultiVector added, const double smallest)
  {
    space.add(std::move(added), components(smallest));
  }

  /// W = Z G^T (G G^T)^{-1}, G = V^T Z, which makes V^T W = I, where that is well conditioned.
  void ProjectionBasis::test_by(MultiVector left_vectors, const unsigned int n)
  {
    scale_modes(left_vectors);
    const unsigned int n_left = left_vectors.n_columns();
    left                      = MultiVector(rows, 0);
    const DenseMatrix g       = inner_products(right(), 0, n, left_vectors, 0, n_left);
    MultiVector candidate = combine(left_vectors, squeal::solve(g * g.transpose(), g).transpose());
    const DenseMatrix squares = inner_products(candidate, candidate);
    constexpr double longest  = 5;
    for (unsigned int j = 0; j < n; ++j)
      if (!(squares(j, j) <= longest * longest))
        return;
    left = std::move(candidate);
  }

  MultiVector ProjectionBasis::modes_of(const QuadraticEigenproblem &problem,
                                        const MultiVector &space, const double radius,
                                        const double largest) const
  {
    const auto projected_of = [&](const Matrix &matrix)
    { return inner_products(space, multiply(matrix, space)); };
    const SmallPairs pairs =
        SmallProblem{projected_of(problem.M), {}, projected_of(problem.Q), {}, nullptr}.solve(
            0, radius);
    std::vector<unsigned int> near;
    for (unsigned int k = 0; k < pairs.size(); ++k)
      if (std::abs(pairs.lambda[k]) <= largest)
        near.push_back(k);
    return combine(space, real_and_imaginary(pairs.right.columns(near).normalise()));
  }

  // Coordinates.

  MultiVector ProjectionBasis::expanded(const MultiVector &c, const bool of_left) const
  {
    const unsigned int m = dimension(), n = c.n_columns(), n_left = of_left ? left.n_columns() : 0;
    // W differs from V in its first columns
    std::vector<double> of_v(c.data(), c.data() + std::size_t(m) * n), of_w;
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int i = 0; i < n_left; ++i)
      {
        of_w.push_back(-c.column(k)[i]); // it is subtracted
        of_v[i + std::size_t(k) * m] = 0;
      }
    MultiVector sum = combine(right(), of_v, n);
    if (n_left > 0)
      subtract_combination(sum, left, of_w);
    return sum;
  }

  /// V^T x, and d with W^T (z - W d) = 0.
  EigenPairs ProjectionBasis::coordinates(const EigenPairs &whole) const
  {
    EigenPairs result        = whole;
    const unsigned int m     = dimension();
    const auto of_right_side = [&](const MultiVector &x)
    { return to_multi_vector(inner_products(right(), x)); };
    result.right  = {of_right_side(whole.right.re), of_right_side(whole.right.im)};
    MultiVector w = left;
    w.append(right().columns(left.n_columns(), m - left.n_columns()));
    const PositiveFactors squares(inner_products(w, w));
    const auto of_left_side = [&](const MultiVector &z)
    { return to_multi_vector(squares.solve(inner_products(w, z))); };
    result.left = {of_left_side(whole.left.re), of_left_side(whole.left.im)};
    return result;
  }
} // namespace squeal
