#include <squeal/dense.h>
#include <squeal/left_vectors.h>
#include <squeal/reduced_basis.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    constexpr double forgetting = 0.5;  ///< weight of old vectors after each addition
    constexpr double smallest   = 1e-7; ///< components of less weight are left out

    DenseMatrix gram_of_displacements(const QuadraticEigenproblem &problem, Block block)
    {
      clear_pressures(problem, block);
      return {block.n_columns(), block.n_columns(), inner_products(block, block)};
    }

    void scale_column(Block &block, const unsigned int j, const double factor)
    {
      for (unsigned int i = 0; i < block.n_local(); ++i)
        block.column(j)[i] *= factor;
    }

    /// The n heaviest principal components, orthonormal in the displacements.
    Block orthonormal_components(const QuadraticEigenproblem &problem, const Block &basis,
                                 const unsigned int n)
    {
      Block result = basis.columns(0, n);
      // The Gram matrix resolves their differences in size to half of the digits only: twice.
      for (unsigned int pass = 0; pass < 2; ++pass)
      {
        DenseMatrix vectors              = gram_of_displacements(problem, result);
        std::vector<double> coefficients = symmetric_eigen(vectors);
        const double floor               = coefficients.empty() ? 0. : 1e-15 * coefficients.back();
        for (unsigned int j = 0; j < n; ++j)
          for (unsigned int i = 0; i < n; ++i)
            vectors(i, j) /= std::sqrt(std::max(coefficients[j], floor));
        result = combine(result, vectors.values, n);
      }
      return result;
    }
  } // namespace

  Block add_snapshot(const QuadraticEigenproblem &problem, const Block &basis, const Block &re,
                     const Block &im)
  {
    if (re.n_columns() == 0)
      return basis;
    Block all = re;
    all.append(im);
    const unsigned int n_modes = re.n_columns();
    const DenseMatrix squares  = gram_of_displacements(problem, all);
    for (unsigned int j = 0; j < 2 * n_modes; ++j)
    {
      const unsigned int k = j % n_modes;
      scale_column(all, j, 1 / std::sqrt(squares(k, k) + squares(n_modes + k, n_modes + k)));
    }
    if (basis.n_columns() > 0)
    {
      Block old = basis;
      for (unsigned int j = 0; j < old.n_columns(); ++j)
        scale_column(old, j, forgetting);
      all.append(old);
    }
    DenseMatrix vectors           = gram_of_displacements(problem, all);
    const std::vector<double> eig = symmetric_eigen(vectors);
    const unsigned int n          = all.n_columns();
    std::vector<double> heaviest;
    unsigned int n_kept = 0;
    for (unsigned int j = n; j-- > 0 && eig[j] > smallest * smallest * eig.back(); ++n_kept)
      for (unsigned int i = 0; i < n; ++i)
        heaviest.push_back(vectors(i, j));
    return combine(all, heaviest, n_kept);
  }

  namespace
  {
    /// Right and left pairs in the same order.
    struct TwoSided
    {
      Pairs right, left;
    };

    /// y^T a of each pair of complex columns.
    std::vector<Complex> products(const Pairs &y, const Block &a_re, const Block &a_im)
    {
      std::vector<Complex> sums(y.lambda.size());
      for (unsigned int k = 0; k < sums.size(); ++k)
        for (unsigned int i = 0; i < a_re.n_local(); ++i)
          sums[k] += Complex(y.re.column(k)[i], y.im.column(k)[i]) *
                     Complex(a_re.column(k)[i], a_im.column(k)[i]);
      MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2 * sums.size(), MPI_DOUBLE, MPI_SUM,
                    y.re.row_range().comm);
      return sums;
    }

    /// The modes, their eigenvalues corrected to second order in the vectors' errors by
    ///     dl = - y^T Q(l) x / (y^T Q'(l) x),
    /// if their backward errors, the @p worst of which is returned, and this last change are small
    /// enough: what remains is of the order of its square.
    std::optional<Modes> accept(const QuadraticEigenproblem &problem,
                                const QuadraticEigenproblem &adjoint, TwoSided &pairs,
                                const EigensolverOptions &options, double &worst)
    {
      const Pairs &x                 = pairs.right;
      BackwardError::Result residual = BackwardError(problem)(x.lambda, x.re, x.im);
      const auto left_errors =
          BackwardError(adjoint)(x.lambda, pairs.left.re, pairs.left.im).errors;
      const auto of_q = products(pairs.left, residual.re, residual.im),
                 of_m = products(pairs.left, multiply(problem.M, x.re), multiply(problem.M, x.im)),
                 of_p = products(pairs.left, multiply(problem.P, x.re), multiply(problem.P, x.im));
      double change   = 0;
      worst           = 0;
      for (unsigned int j = 0; j < of_q.size(); ++j)
      {
        const Complex d_lambda = -of_q[j] / (2. * x.lambda[j] * of_m[j] + of_p[j]);
        worst                  = std::max({worst, residual.errors[j], left_errors[j]});
        change                 = std::max(change, std::abs(d_lambda / x.lambda[j]));
        pairs.right.lambda[j] += d_lambda;
      }
      std::ostringstream text;
      text << "  reduced basis: backward errors " << worst << ", change of eigenvalues " << change;
      options.progress(text.str());
      if (!(worst <= options.tolerance && change <= 100 * options.tolerance))
        return std::nullopt;
      Modes modes;
      modes.backward_error = std::move(residual.errors);
      modes.lambda         = pairs.right.lambda;
      modes.re             = std::move(pairs.right.re);
      modes.im             = std::move(pairs.right.im);
      attach_left_vectors(problem, std::move(pairs.left), left_errors, modes);
      return modes;
    }

    /// Corrects displacements of other problems to the constraints of this one, N^T u = 0, by the
    /// displacements of  Q (t, Lambda) = (0, N^T u). The pressures then drop out of the projection.
    /// Those of a compliant contact are part of the vectors.
    Block satisfy_constraints(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                              Block basis)
    {
      if (problem.n_constraints == 0 || problem.compliant)
        return basis;
      clear_pressures(problem, basis);
      Block violation = multiply(problem.Q, basis);
      for (unsigned int k = 0; k < violation.n_columns(); ++k)
        std::fill_n(violation.column(k), violation.n_local() - problem.n_local_constraints, 0.);
      const Block correction = shift_invert.solve(violation);
      for (std::size_t i = 0; i < std::size_t(basis.n_local()) * basis.n_columns(); ++i)
        basis.data()[i] -= correction.data()[i];
      clear_pressures(problem, basis);
      return basis;
    }

    /// The n Ritz pairs with |l| <= radius of the smallest residuals; others are no eigenvalues.
    /// The basis is tested with itself, corrected to the constraints of the adjoint problem: so the
    /// pressures drop out.
    Pairs ritz_pairs(const QuadraticEigenproblem &problem, const QuadraticEigenproblem &adjoint,
                     const ShiftInvert &shift_invert, const ShiftInvert &transposed,
                     const Block &basis, const double radius, const unsigned int n)
    {
      Block trial = satisfy_constraints(problem, shift_invert, basis);
      trial       = orthonormal_components(problem, trial, trial.n_columns());
      Pairs pairs =
          rayleigh_ritz(problem, trial, satisfy_constraints(adjoint, transposed, trial), radius, 0);
      inverse_iteration(problem, shift_invert, pairs);
      if (pairs.lambda.size() <= n)
        return pairs;
      const auto errors = BackwardError(problem)(pairs.lambda, pairs.re, pairs.im).errors;
      std::vector<unsigned int> order(pairs.lambda.size());
      std::iota(order.begin(), order.end(), 0u);
      std::stable_sort(order.begin(), order.end(),
                       [&](const unsigned int i, const unsigned int j)
                       { return errors[i] < errors[j]; });
      order.resize(n);
      return select(pairs, order);
    }
  } // namespace

  std::optional<Modes> solve_in_basis(const QuadraticEigenproblem &problem, const Bases &bases,
                                      const Factorization &factorization, const double radius,
                                      const unsigned int n_expected,
                                      const EigensolverOptions &options)
  {
    const QuadraticEigenproblem adjoint = adjoint_of(problem);
    const ShiftInvert forward(factorization, 0), transposed(factorization, 0, true);
    Block right = bases.right, left = bases.left;
    unsigned int n_solves = 0;
    for (unsigned int step = 0; step < 2; ++step)
    {
      // Two solves for the constraints and one for each vector, on both sides
      n_solves += 2 * (right.n_columns() + left.n_columns()) + 4 * n_expected;
      TwoSided pairs{ritz_pairs(problem, adjoint, forward, transposed, right, radius, n_expected),
                     ritz_pairs(adjoint, problem, transposed, forward, left, radius, n_expected)};
      if (pairs.right.lambda.size() < n_expected || pairs.left.lambda.size() < n_expected)
        break;
      pairs.left   = select(pairs.left, nearest_partners(pairs.right.lambda, pairs.left.lambda));
      double worst = 0;
      if (std::optional<Modes> modes = accept(problem, adjoint, pairs, options, worst))
      {
        modes->n_solves = n_solves;
        return modes;
      }
      if (worst > 20 * options.tolerance) // a second step gains a digit
        break;
      const Block nothing(problem.rows, 0);
      right = add_snapshot(problem, nothing, pairs.right.re, pairs.right.im);
      left  = add_snapshot(problem, nothing, pairs.left.re, pairs.left.im);
    }
    return std::nullopt;
  }
} // namespace squeal
