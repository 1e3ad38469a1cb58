#include <squeal/assessment/error_bounds.h>
#include <squeal/assessment/stability.h>
#include <squeal/linalg/dense.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// The eigenvalues of a complex matrix, column-major, nearest to the given ones: among those of
    /// the real matrix [Re, -Im; Im, Re], which also has the conjugate ones.
    std::vector<Complex> nearest_eigenvalues(const std::vector<Complex> &matrix,
                                             const std::vector<Complex> &lambda)
    {
      const unsigned int n = lambda.size();
      DenseMatrix embedded(2 * n, 2 * n);
      for (unsigned int i = 0; i < n; ++i)
        for (unsigned int j = 0; j < n; ++j)
        {
          embedded(i, j) = embedded(n + i, n + j) = matrix[i + n * j].real();
          embedded(n + i, j)                      = matrix[i + n * j].imag();
          embedded(i, n + j)                      = -matrix[i + n * j].imag();
        }
      const DenseEigenpairs pairs = general_eigen(std::move(embedded));
      std::vector<Complex> roots;
      for (unsigned int j = 0; j < 2 * n; ++j)
        roots.emplace_back(pairs.re[j], pairs.im[j]);
      std::vector<std::vector<double>> costs(n);
      for (unsigned int j = 0; j < n; ++j)
        for (const Complex &root : roots)
          costs[j].push_back(std::norm(root - lambda[j]));
      std::vector<Complex> result;
      for (const int partner : assign(costs, roots.size()))
        result.push_back(roots[partner]);
      return result;
    }

    /// The eigenvalues of L + S F S for diagonal L = diag(l_i) and S = diag(sqrt(t_i)), some of the
    /// modes only.
    std::vector<Complex> coupled(const std::vector<Complex> &lambda, const std::vector<Complex> &f,
                                 const std::vector<unsigned int> &members,
                                 const std::vector<double> &t)
    {
      const unsigned int n = members.size(), m = lambda.size();
      std::vector<Complex> matrix(n * n), values;
      for (unsigned int i = 0; i < n; ++i)
      {
        values.push_back(lambda[members[i]]);
        for (unsigned int j = 0; j < n; ++j)
          matrix[i + n * j] = (i == j ? lambda[members[i]] : 0.) +
                              std::sqrt(t[i] * t[j]) * f[members[i] + m * members[j]];
      }
      return nearest_eigenvalues(matrix, values);
    }

    /// The modes that may come closer to mode k than the errors of both, k first.
    std::vector<unsigned int> neighbours(const std::vector<Complex> &lambda,
                                         const std::vector<Complex> &f, const unsigned int k,
                                         const double factor)
    {
      constexpr unsigned int largest = 8;
      const unsigned int m           = lambda.size();
      std::vector<std::pair<double, unsigned int>> candidates;
      for (unsigned int j = 0; j < m; ++j)
      {
        const double distance = std::abs(lambda[j] - lambda[k]);
        if (distance <= 2 * factor * (std::abs(f[j + m * j]) + std::abs(f[k + m * k])))
          candidates.emplace_back(j == k ? -1. : distance, j);
      }
      std::sort(candidates.begin(), candidates.end());
      std::vector<unsigned int> members;
      for (unsigned int i = 0; i < std::min<std::size_t>(largest, candidates.size()); ++i)
        members.push_back(candidates[i].second);
      return members;
    }

  } // namespace

  ErrorBounds bound_errors(const std::vector<Complex> &lambda, const std::vector<Complex> &f,
                           const std::vector<double> &growth_rate_parts, const unsigned int degree,
                           const std::vector<std::vector<std::vector<Complex>>> &alternatives)
  {
    const unsigned int m = lambda.size();
    const double p = degree, seen = 1 - p * p / ((p + 1) * (p + 1)), whole = 1.2 / seen;
    std::vector<unsigned int> all(m);
    std::iota(all.begin(), all.end(), 0u);
    const std::vector<Complex> corrected = coupled(lambda, f, all, std::vector<double>(m, 1.)),
                               extrapolated =
                                   coupled(lambda, f, all, std::vector<double>(m, whole));
    std::vector<std::vector<std::vector<Complex>>> shifted;
    for (const std::vector<std::vector<Complex>> &group : alternatives)
    {
      shifted.emplace_back();
      for (std::vector<Complex> sum : group)
      {
        for (unsigned int i = 0; i < m * m; ++i)
          sum[i] += whole * f[i];
        shifted.back().push_back(coupled(lambda, sum, all, std::vector<double>(m, 1.)));
      }
    }
    ErrorBounds bounds;
    for (unsigned int k = 0; k < m; ++k)
    {
      bounds.correction.push_back(corrected[k] - lambda[k]);
      std::vector<Complex> changes = {corrected[k] - lambda[k], extrapolated[k] - lambda[k]};
      const std::vector<unsigned int> members = neighbours(lambda, f, k, whole);
      for (unsigned int varied = 0; varied < members.size() && members.size() > 1; ++varied)
        for (const bool up : {false, true})
        {
          std::vector<double> t(members.size(), up ? 1. : whole);
          t[varied] = up ? whole : 1.;
          changes.push_back(coupled(lambda, f, members, t)[0] - lambda[k]);
        }
      double re = 0, im = 0;
      for (const Complex &change : changes)
      {
        re = std::max(re, std::abs(change.real()));
        im = std::max(im, std::abs(change.imag()));
      }
      bounds.growth_rate.push_back(re + 0.02 * whole * growth_rate_parts[k]);
      bounds.imaginary.push_back(im);
      for (const std::vector<std::vector<Complex>> &group : shifted)
      {
        double group_re = 0, group_im = 0;
        for (const std::vector<Complex> &roots : group)
        {
          group_re = std::max(group_re, std::abs((roots[k] - extrapolated[k]).real()));
          group_im = std::max(group_im, std::abs((roots[k] - extrapolated[k]).imag()));
        }
        bounds.growth_rate.back() += group_re;
        bounds.imaginary.back() += group_im;
      }
    }
    return bounds;
  }
} // namespace squeal
