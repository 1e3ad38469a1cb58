#include <squeal/base/errors.h>
#include <squeal/projection/projected_nonlinear.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    void add_real(const Complex factor, const DenseMatrix &a, ComplexDense &sum)
    {
      for (std::size_t k = 0; k < a.values.size(); ++k)
        sum.values[k] += factor * a.values[k];
    }
  } // namespace

  ComplexDense ProjectedNonlinear::at(const Complex l, const Complex t) const
  {
    ComplexDense result(size(), size());
    add_real(l * l, m, result);
    add_real(l, p, result);
    add_real(1, q, result);
    for (unsigned int b = 0; b < a.size(); ++b)
      add_real(t * (*terms)[b].h(l), a[b], result);
    return result;
  }

  ComplexDense ProjectedNonlinear::derivative(const Complex l, const Complex t) const
  {
    ComplexDense result(size(), size());
    add_real(2. * l, m, result);
    add_real(1, p, result);
    for (unsigned int b = 0; b < a.size(); ++b)
      add_real(t * (*terms)[b].derivative(l), a[b], result);
    return result;
  }

  namespace
  {
    using Pairs = std::vector<ProjectedPair>;

    /// Eigenvalues this close, relatively, are corrected together.
    constexpr double close_neighbours = 2e-3;

    /// The numbers of pairs whose eigenvalues hang together by close neighbours.
    std::vector<std::vector<unsigned int>> clusters_of(const Pairs &pairs)
    {
      std::vector<std::vector<unsigned int>> clusters;
      std::vector<bool> taken(pairs.size(), false);
      for (unsigned int first = 0; first < pairs.size(); ++first)
      {
        if (taken[first])
          continue;
        std::vector<unsigned int> cluster = {first};
        taken[first]                      = true;
        for (unsigned int k = 0; k < cluster.size(); ++k)
          for (unsigned int j = 0; j < pairs.size(); ++j)
            if (const Complex l = pairs[cluster[k]].lambda;
                !taken[j] && std::abs(pairs[j].lambda - l) <= close_neighbours * std::abs(l))
            {
              taken[j] = true;
              cluster.push_back(j);
            }
        clusters.push_back(std::move(cluster));
      }
      return clusters;
    }

    double length_of(const Complex *x, const unsigned int n)
    {
      return std::sqrt(std::accumulate(x, x + n, 0.,
                                       [](const double sum, const Complex value)
                                       { return sum + std::norm(value); }));
    }

    void scale_to_one(ComplexDense &x)
    {
      for (unsigned int j = 0; j < x.n_columns; ++j)
      {
        Complex *const column = &x(0, j);
        const double length   = length_of(column, x.n_rows);
        for (unsigned int i = 0; i < x.n_rows; ++i)
          column[i] /= length;
      }
    }

    /// The pairs of a cluster, corrected together at one l. Returns the largest change.
    double correct_together(const ProjectedNonlinear &problem, const Complex t, const Complex l,
                            const std::vector<unsigned int> &cluster, Pairs &pairs)
    {
      const unsigned int n = problem.size(), k = cluster.size();
      ComplexDense x(n, k), z(n, k);
      for (unsigned int j = 0; j < k; ++j)
      {
        std::copy_n(pairs[cluster[j]].right.data(), n, &x(0, j));
        std::copy_n(pairs[cluster[j]].left.data(), n, &z(0, j));
      }
      const ComplexDense at = problem.at(l, t), slope = problem.derivative(l, t);
      const ComplexFactors factors(at);
      ComplexDense y = factors.solve(product(slope, x)),
                   w = factors.solve(product(slope, z, true), true);
      scale_to_one(y);
      scale_to_one(w);
      // W^H T Y y = theta W^H T' Y y
      const ComplexFactors of_slope(product(w, product(slope, y), true));
      const ComplexDense small = of_slope.solve(product(w, product(at, y), true));
      ComplexEigenpairs local  = general_eigen(small);
      // Left vectors of the pencil: u^H S^{-1} B = theta u^H with S = W^H T' Y gives S^{-H} u.
      x = product(y, local.right);
      z = product(w, of_slope.solve(local.left, true));
      scale_to_one(x);
      scale_to_one(z);
      // In the order of before, so that the changes are those of modes.
      std::vector<unsigned int> order(k), before(k);
      std::iota(order.begin(), order.end(), 0u);
      std::iota(before.begin(), before.end(), 0u);
      std::sort(order.begin(), order.end(),
                [&](const unsigned int i, const unsigned int j)
                { return local.values[i].imag() > local.values[j].imag(); });
      std::sort(before.begin(), before.end(),
                [&](const unsigned int i, const unsigned int j)
                { return pairs[cluster[i]].lambda.imag() < pairs[cluster[j]].lambda.imag(); });
      double change = 0;
      for (unsigned int j = 0; j < k; ++j)
      {
        ProjectedPair &pair = pairs[cluster[before[j]]];
        const Complex next  = l - local.values[order[j]];
        change              = std::max(change, std::abs(next - pair.lambda));
        pair.lambda         = next;
        std::copy_n(&x(0, order[j]), n, pair.right.data());
        std::copy_n(&z(0, order[j]), n, pair.left.data());
      }
      return change;
    }

    bool is_finite(const ProjectedPair &pair)
    {
      return std::isfinite(pair.lambda.real()) && std::isfinite(pair.lambda.imag());
    }

    bool are_one(const ProjectedPair &one, const ProjectedPair &other)
    {
      constexpr double equal = 1e-9, parallel = 1e-10;
      if (std::abs(one.lambda - other.lambda) > equal * std::abs(one.lambda))
        return false;
      Complex overlap = 0;
      for (unsigned int i = 0; i < one.right.size(); ++i)
        overlap += std::conj(one.right[i]) * other.right[i];
      return 1 - std::norm(overlap) < parallel;
    }

    /// Corrects all pairs at one t; false if that fails: then the pairs are of no use.
    bool correct(const ProjectedNonlinear &problem, const Complex t, Pairs &pairs)
    {
      const Pairs before  = pairs;
      const auto clusters = clusters_of(pairs);
      for (const std::vector<unsigned int> &cluster : clusters)
      {
        for (unsigned int step = 0; step < 6 && cluster.size() > 1; ++step)
        {
          Complex mean = 0;
          for (const unsigned int j : cluster)
            mean += pairs[j].lambda / double(cluster.size());
          const double change = correct_together(problem, t, mean, cluster, pairs);
          if (!std::isfinite(change) || change <= 1e-8 * std::abs(mean))
            break;
        }
        for (const unsigned int j : cluster)
        {
          double last  = std::numeric_limits<double>::infinity();
          bool settled = false;
          for (unsigned int step = 0; step < 15 && !settled; ++step)
          {
            if (!is_finite(pairs[j]) || pairs[j].lambda.imag() <= 0)
              return false;
            const double size   = std::abs(pairs[j].lambda),
                         change = correct_together(problem, t, pairs[j].lambda, {j}, pairs);
            if (!is_finite(pairs[j]))
              return false;
            // Near a double root eigenvalues settle to the root of rounding only.
            settled = change <= 1e-13 * size || (change <= 1e-9 * size && change > 0.1 * last);
            last    = change;
          }
          if (!settled)
            return false;
        }
      }
      for (const std::vector<unsigned int> &cluster : clusters)
        for (const unsigned int j : cluster)
          for (unsigned int k = 0; k < pairs.size(); ++k)
          {
            if (k == j)
              continue;
            if (are_one(pairs[j], pairs[k]))
              return false;
            const bool is_close = std::find(cluster.begin(), cluster.end(), k) != cluster.end();
            if (!is_close && 2 * std::abs(pairs[j].lambda - before[j].lambda) >
                                 std::abs(before[k].lambda - before[j].lambda))
              return false;
          }
      return true;
    }
  } // namespace

  unsigned int follow_to_exact(const ProjectedNonlinear &problem, Pairs &pairs)
  {
    constexpr double shortest = 1e-3;
    unsigned int n_steps      = 0;
    double s = 0, step = 1;
    while (s < 1)
    {
      const double next = std::min(1., s + step);
      Pairs trial       = pairs;
      if (correct(problem, Complex(next, next * (1 - next) / 5), trial))
      {
        pairs = std::move(trial);
        s     = next;
        step *= 2;
        ++n_steps;
      }
      else if ((step /= 2) < shortest)
        throw SolverError("The modes could not be followed from the problem with frozen moduli to "
                          "the one with moduli that depend on the frequency.",
                          {Failure::modes_missing});
    }
    return n_steps;
  }

  bool correct_exact(const ProjectedNonlinear &problem, Pairs &pairs)
  {
    Pairs trial = pairs;
    if (!correct(problem, 1, trial))
      return false;
    pairs = std::move(trial);
    return true;
  }
} // namespace squeal
