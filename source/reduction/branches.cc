#include <squeal/projection/eigensolver_options.h>
#include <squeal/reduction/branches.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  std::vector<std::complex<double>> transition_of(std::vector<std::complex<double>> form,
                                                  const EigenPairs &before)
  {
    for (std::size_t k = 0; k < form.size(); ++k) // z_i^H Q'(l_i) x_i = 2 l_i
      form[k] /= 2. * before.lambda[k % before.size()];
    return form;
  }

  bool continue_branches(const std::vector<std::complex<double>> &transition,
                         const BranchPoint &before, const double max_imaginary, BranchPoint &next)
  {
    const unsigned int n = before.modes.lambda.size(), m = next.modes.lambda.size();
    std::vector<std::vector<double>> overlap(n, std::vector<double>(m)), cost = overlap;
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int j = 0; j < m; ++j)
      {
        overlap[i][j] = std::abs(transition[i + std::size_t(j) * n]);
        // The nearness of the eigenvalues decides only where overlaps do not.
        const double distance = std::abs(next.modes.lambda[j] - before.modes.lambda[i]) /
                                std::abs(before.modes.lambda[i]);
        cost[i][j] = std::pow(1 - std::min(1., overlap[i][j]), 2) + 1e-3 * std::min(1., distance);
      }
    const std::vector<int> partners = assign(cost, m);

    next.branches.assign(m, 0);
    next.overlaps.assign(m, 0.);
    next.n_branches = before.n_branches;
    std::vector<bool> continued(m, false);
    // Steps on the way to a value do not look for what grows outside of the disc.
    const auto may_come_or_go = [&](const std::complex<double> l) {
      return std::abs(l.imag()) > 0.99 * max_imaginary ||
             std::abs(l) > search_radius(max_imaginary);
    };
    bool certain = true;
    for (unsigned int i = 0; i < n; ++i)
    {
      const int j = partners[i];
      if (j >= 0 && overlap[i][j] > 0.1)
      {
        next.branches[j] = before.branches[i];
        next.overlaps[j] = overlap[i][j];
        continued[j]     = true;
        for (unsigned int k = 0; k < m; ++k)
          certain &= int(k) == j || may_come_or_go(before.modes.lambda[i]) ||
                     overlap[i][k] < 0.5 * overlap[i][j];
      }
      certain &= may_come_or_go(before.modes.lambda[i]) || (j >= 0 && overlap[i][j] > 0.8);
    }
    for (unsigned int j = 0; j < m; ++j)
      if (!continued[j])
      {
        certain &= may_come_or_go(next.modes.lambda[j]);
        next.branches[j] = next.n_branches++;
      }
    return certain;
  }

  void continue_by_eigenvalues(const BranchPoint &before, BranchPoint &next)
  {
    constexpr double farthest = 0.1;
    const unsigned int n = before.modes.lambda.size(), m = next.modes.lambda.size();
    std::vector<std::vector<double>> cost(n, std::vector<double>(m));
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int j = 0; j < m; ++j)
        cost[i][j] = std::norm(before.modes.lambda[i] - next.modes.lambda[j]);
    const std::vector<int> partners = assign(cost, m);
    next.branches.assign(m, 0);
    next.overlaps.assign(m, 0.);
    next.n_branches = before.n_branches;
    std::vector<bool> continued(m, false);
    for (unsigned int i = 0; i < n; ++i)
      if (const int j = partners[i];
          j >= 0 && cost[i][j] <= farthest * farthest * std::norm(before.modes.lambda[i]))
      {
        next.branches[j] = before.branches[i];
        continued[j]     = true;
      }
    for (unsigned int j = 0; j < m; ++j)
      if (!continued[j])
        next.branches[j] = next.n_branches++;
  }
} // namespace squeal
