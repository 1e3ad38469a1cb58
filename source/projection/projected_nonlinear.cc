#include <squeal/base/errors.h>
#include <squeal/projection/projected_nonlinear.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Eigenvalues this close, relatively, are corrected together.
    constexpr double close_neighbours = 2e-3;

    /// Whether a mode grows without oscillating. It says so exactly, since there f is another one.
    bool diverges(const Complex l)
    {
      return l.imag() == 0 && l.real() > 0;
    }

    /// The numbers of pairs whose eigenvalues hang together by close neighbours.
    std::vector<std::vector<unsigned int>> clusters_of(const std::vector<Complex> &lambda)
    {
      std::vector<std::vector<unsigned int>> clusters;
      std::vector<bool> taken(lambda.size(), false);
      for (unsigned int first = 0; first < lambda.size(); ++first)
      {
        if (taken[first])
          continue;
        std::vector<unsigned int> cluster = {first};
        taken[first]                      = true;
        for (unsigned int k = 0; k < cluster.size(); ++k)
          for (unsigned int j = 0; j < lambda.size(); ++j)
            if (const Complex l = lambda[cluster[k]];
                !taken[j] && !diverges(l) && !diverges(lambda[j]) &&
                std::abs(lambda[j] - l) <= close_neighbours * std::abs(l))
            {
              taken[j] = true;
              cluster.push_back(j);
            }
        clusters.push_back(std::move(cluster));
      }
      return clusters;
    }

    /// The pairs of a cluster, corrected together at one l. Returns the largest change.
    double correct_together(const SmallProblem &problem, const Complex t, const Complex l,
                            const std::vector<unsigned int> &cluster, SmallPairs &pairs)
    {
      const unsigned int n = problem.size(), k = cluster.size();
      const ComplexDenseMatrix at = problem.at(l, t), slope = problem.derivative(l, t);
      using Factors             = LuFactors<Complex>;
      constexpr auto zero       = Factors::ZeroPivot::becomes_rounding;
      constexpr auto transposed = DenseView<Complex>::Form::transposed;
      const Factors factors(at, zero);
      ComplexDenseMatrix v = factors.solve(slope * pairs.right.columns(cluster)),
                         w = factors.solve(slope.transpose() * pairs.left.columns(cluster),
                                           transposed);
      v.normalise();
      w.normalise();
      // W^T T V v = theta W^T T' V v
      const Factors of_slope(w.transpose() * (slope * v), zero);
      DenseEigenpairs local = general_eigen(of_slope.solve(w.transpose() * (at * v)), true);
      // Left vectors of the pencil: u^H S^{-1} B = theta u^H with S = W^T T' V gives S^{-T}
      // conj(u).
      const ComplexDenseMatrix x = (v * local.right).normalise(),
                               y = (w * of_slope.solve(local.left.conjugate(), transposed))
                                       .normalise();
      // In the order of before, so that the changes are those of modes.
      std::vector<unsigned int> order(k), before(k);
      std::iota(order.begin(), order.end(), 0u);
      std::iota(before.begin(), before.end(), 0u);
      std::sort(order.begin(), order.end(),
                [&](const unsigned int i, const unsigned int j)
                { return local.values[i].imag() > local.values[j].imag(); });
      std::sort(before.begin(), before.end(),
                [&](const unsigned int i, const unsigned int j)
                { return pairs.lambda[cluster[i]].imag() < pairs.lambda[cluster[j]].imag(); });
      double change = 0;
      for (unsigned int j = 0; j < k; ++j)
      {
        const unsigned int number = cluster[before[j]];
        const Complex next        = l - local.values[order[j]];
        change                    = std::max(change, std::abs(next - pairs.lambda[number]));
        pairs.lambda[number]      = next;
        std::copy_n(x.column(order[j]), n, pairs.right.column(number));
        std::copy_n(y.column(order[j]), n, pairs.left.column(number));
      }
      return change;
    }

    bool is_finite(const Complex l)
    {
      return std::isfinite(l.real()) && std::isfinite(l.imag());
    }

    bool are_one(const SmallPairs &pairs, const unsigned int j, const unsigned int k)
    {
      constexpr double equal = 1e-9, parallel = 1e-10;
      if (std::abs(pairs.lambda[j] - pairs.lambda[k]) > equal * std::abs(pairs.lambda[j]))
        return false;
      const ComplexDenseMatrix overlap =
          pairs.right.columns(j, 1).adjoint() * pairs.right.columns(k, 1);
      return 1 - std::norm(overlap(0, 0)) < parallel;
    }

    /// The pair that cannot be corrected, and the one that it comes too near to, or itself.
    struct Obstacle
    {
      unsigned int pair, other;
    };

    /// Corrects a pair by itself. Returns whether it settles.
    bool correct_alone(const SmallProblem &problem, const Complex t, const unsigned int j,
                       SmallPairs &pairs)
    {
      Complex &l             = pairs.lambda[j];
      const bool stays_real  = diverges(l);
      const Complex of_terms = stays_real ? t.real() : t;
      double last            = std::numeric_limits<double>::infinity();
      for (unsigned int step = 0; step < 15; ++step)
      {
        if (!is_finite(l) || !(stays_real ? diverges(l) : l.imag() > 0))
          return false;
        const double size   = std::abs(l),
                     change = correct_together(problem, of_terms, l, {j}, pairs);
        if (!is_finite(l))
          return false;
        // Near a double root eigenvalues settle to the root of rounding only.
        if (change <= 1e-13 * size || (change <= 1e-9 * size && change > 0.1 * last))
          return true;
        last = change;
      }
      return false;
    }

    /// Corrects all pairs at one t. If that fails, they are of no use, and what is in the way is
    /// returned.
    std::optional<Obstacle> correct(const SmallProblem &problem, const Complex t, SmallPairs &pairs)
    {
      const std::vector<Complex> before = pairs.lambda;
      const auto clusters               = clusters_of(before);
      for (const std::vector<unsigned int> &cluster : clusters)
      {
        for (unsigned int step = 0; step < 6 && cluster.size() > 1; ++step)
        {
          Complex mean = 0;
          for (const unsigned int j : cluster)
            mean += pairs.lambda[j] / double(cluster.size());
          const double change = correct_together(problem, t, mean, cluster, pairs);
          if (!std::isfinite(change) || change <= 1e-8 * std::abs(mean))
            break;
        }
        for (const unsigned int j : cluster)
          if (!correct_alone(problem, t, j, pairs))
            return Obstacle{j, j};
      }
      for (const std::vector<unsigned int> &cluster : clusters)
        for (const unsigned int j : cluster)
          for (unsigned int k = 0; k < pairs.size(); ++k)
          {
            if (k == j)
              continue;
            const bool is_close = std::find(cluster.begin(), cluster.end(), k) != cluster.end();
            if (are_one(pairs, j, k) || (!is_close && 2 * std::abs(pairs.lambda[j] - before[j]) >
                                                          std::abs(before[k] - before[j])))
              return Obstacle{j, k};
          }
      return std::nullopt;
    }

    double damping_ratio(const Complex l)
    {
      return -l.real() / std::abs(l);
    }

    /// Leaves out the pair in the way that is damped more strongly. Returns whether there is one
    /// that is nearly overdamped.
    bool leave_out_overdamped(const Obstacle &obstacle, SmallPairs &pairs,
                              std::vector<unsigned int> &kept)
    {
      const unsigned int j =
          damping_ratio(pairs.lambda[obstacle.pair]) >= damping_ratio(pairs.lambda[obstacle.other])
              ? obstacle.pair
              : obstacle.other;
      if (!(damping_ratio(pairs.lambda[j]) > nearly_overdamped))
        return false;
      std::vector<unsigned int> others(pairs.size());
      std::iota(others.begin(), others.end(), 0u);
      others.erase(others.begin() + j);
      kept.erase(kept.begin() + j);
      pairs = pairs.select(others);
      return true;
    }
  } // namespace

  Followed follow_to_exact(const SmallProblem &problem, SmallPairs &pairs)
  {
    constexpr double shortest = 1e-3, after_loss = 0.1;
    Followed result;
    result.kept.resize(pairs.size());
    std::iota(result.kept.begin(), result.kept.end(), 0u);
    double s = 0, step = 1;
    while (s < 1)
    {
      const double next = std::min(1., s + step);
      SmallPairs trial  = pairs;
      const std::optional<Obstacle> obstacle =
          correct(problem, Complex(next, next * (1 - next) / 5), trial);
      if (!obstacle)
      {
        pairs = std::move(trial);
        s     = next;
        step *= 2;
        ++result.n_steps;
      }
      else if ((step /= 2) < shortest)
      {
        if (!leave_out_overdamped(*obstacle, pairs, result.kept))
          throw SolverError("The modes could not be followed from the problem with frozen moduli "
                            "to the one with moduli that depend on the frequency.",
                            {Failure::modes_may_come_in});
        step = after_loss;
      }
    }
    return result;
  }

  bool correct_exact(const SmallProblem &problem, SmallPairs &pairs)
  {
    SmallPairs trial = pairs;
    if (correct(problem, 1, trial))
      return false;
    pairs = std::move(trial);
    return true;
  }
} // namespace squeal
