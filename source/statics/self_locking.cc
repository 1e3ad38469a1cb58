#include <squeal/linalg/dense.h>
#include <squeal/linalg/factorization.h>
#include <squeal/projection/small_problem.h>
#include <squeal/statics/self_locking.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  namespace
  {
    /// The largest real eigenvalue of the leading part of the Hessenberg matrix and its residual.
    SelfLocking largest_real(const std::vector<std::vector<double>> &h, const unsigned int n)
    {
      // theta y = H y as (theta P + Q) y = 0, P = I and Q = -H.
      DenseMatrix p(n, n), q(n, n);
      double size = 0;
      for (unsigned int j = 0; j < n; ++j)
      {
        p(j, j) = 1;
        for (unsigned int i = 0; i < n && i < h[j].size(); ++i)
        {
          q(i, j) = -h[j][i];
          size    = std::max(size, std::abs(h[j][i]));
        }
      }
      SelfLocking result;
      result.steps = n;
      if (size == 0)
        return result;
      // A shift to the right of all eigenvalues.
      SmallPairs pairs =
          SmallProblem{DenseMatrix(n, n), p, q, {}, nullptr}.solve(2. * n * size, size);
      pairs.right.normalise();
      for (unsigned int k = 0; k < pairs.size(); ++k)
        if (const std::complex<double> l = pairs.lambda[k];
            std::abs(l.imag()) <= 1e-10 * size && l.real() > result.gain)
        {
          result.gain  = l.real();
          result.error = h[n - 1].size() > n ? h[n - 1][n] * std::abs(pairs.right(n - 1, k)) : 0;
        }
      return result;
    }
  } // namespace

  SelfLocking self_locking(const RowRange &rows, const Matrix &tangent, const Matrix &friction)
  {
    constexpr unsigned int max_steps = 120, between_checks = 5;
    constexpr double tolerance = 1e-5; // three digits suffice
    if (!friction)
      return {};
    const Factorization factorization(tangent, Factorization::Kind::ldlt,
                                      "the frictionless tangent (for self-locking)");
    const auto feedback = [&](const MultiVector &x)
    {
      MultiVector y = factorization.solve(multiply(friction, x));
      y *= -1;
      return y;
    };
    MultiVector start(rows, 1);
    for (unsigned int i = 0; i < rows.n_local(); ++i)
      start.data()[i] = 1.5 + std::sin(1. + rows.begin + i);
    MultiVector next = feedback(start), basis(rows, 0);

    std::vector<std::vector<double>> h; // by column
    SelfLocking result;
    double before = 0;
    for (unsigned int n = 0;; ++n)
    {
      // Orthogonalised twice, which is as good as to rounding.
      std::vector<double> column(n);
      for (unsigned int pass = 0; pass < 2 && n > 0; ++pass)
      {
        const DenseMatrix along = inner_products(basis, next);
        subtract_combination(next, basis, along);
        for (unsigned int k = 0; k < n; ++k)
          column[k] += along(k, 0);
      }
      const double norm = length_of(next);
      double size       = norm;
      for (const double c : column)
        size = std::max(size, std::abs(c));
      const bool invariant = norm <= 1e-13 * size;
      if (n > 0)
      {
        if (!invariant)
          column.push_back(norm);
        h.push_back(std::move(column));
        if (invariant || n % between_checks == 0)
        {
          result = largest_real(h, n);
          // None yet may mean that the complex ones come first.
          const bool settled = result.gain > 0 && result.error <= tolerance &&
                               std::abs(result.gain - before) <= tolerance;
          before = result.gain;
          if (invariant || settled || n >= max_steps)
            return result;
        }
      }
      if (norm == 0)
        return result;
      for (unsigned int i = 0; i < next.n_local(); ++i)
        next.data()[i] /= norm;
      basis.append(next);
      next = feedback(next);
    }
  }
} // namespace squeal
