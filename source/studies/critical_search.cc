#include <squeal/base/text.h>
#include <squeal/eigen/growth_search.h>
#include <squeal/linalg/find_root.h>
#include <squeal/studies/critical_search.h>

#include <algorithm>
#include <cmath>
#include <map>

// A critical value is the root of a smooth function of the parameter, found by Newton's method
// within a bracket (find_root.h). What changes its sign between two points tells which:
//   at()            a mode that is marginal at a point itself and crosses the axis there,
//   divergence()    det Q, where the number of growing real eigenvalues becomes odd or even,
//   onset()         Re l of one branch,
//   coalescence()   the squared half difference of two branches.
// Every evaluation solves the model for the modes near those expected.
namespace squeal
{
  using Complex = std::complex<double>;

  bool CriticalSearch::grows_beyond_disc(const Complex &lambda) const
  {
    return squeal::grows_beyond_disc(lambda, varied.options.max_imaginary);
  }

  std::vector<unsigned int> CriticalSearch::divergent_in_disc(const BranchPoint &point) const
  {
    std::vector<unsigned int> modes = divergent_modes(point.modes);
    modes.erase(std::remove_if(modes.begin(), modes.end(),
                               [&](const unsigned int j)
                               { return grows_beyond_disc(point.modes.lambda[j]); }),
                modes.end());
    return modes;
  }

  std::vector<CriticalValue> CriticalSearch::between(const BranchPoint &from, const BranchPoint &to)
  {
    std::vector<CriticalValue> found = at(to, &from, to.value - from.value);
    // Two at a time are born by a pair of growing modes that becomes real, or leave like that.
    const bool has_divergence =
        (divergent_in_disc(from).size() + divergent_in_disc(to).size()) % 2 == 1;
    if (has_divergence)
      if (auto critical = divergence(from, to))
        found.push_back(std::move(*critical));
    for (unsigned int i = 0; i < from.branches.size(); ++i)
      search_branch(from, to, i, has_divergence, found);
    return found;
  }

  void CriticalSearch::search_branch(const BranchPoint &from, const BranchPoint &to,
                                     const unsigned int i, const bool has_divergence,
                                     std::vector<CriticalValue> &found)
  {
    // Steps in between would not see what grows beyond the disc.
    const auto is_followed = [&](const unsigned int k)
    {
      const int at = to.index_of(from.branches[k]);
      return at >= 0 && !grows_beyond_disc(from.modes.lambda[k]) &&
             !grows_beyond_disc(to.modes.lambda[at]);
    };
    if (!is_followed(i))
      return;
    const Complex a = from.modes.lambda[i], b = to.modes.lambda[to.index_of(from.branches[i])];
    // A mode that has become real by passing zero is a divergence.
    const bool became_real = (a.imag() == 0) != (b.imag() == 0) && has_divergence;
    if (!varied.is_marginal(a) && !varied.is_marginal(b) && a.real() * b.real() < 0 && !became_real)
      found.push_back(onset(from, to, from.branches[i]));
    // A pair whose mean and difference squared are real (up to the common factor of the motion)
    // meets where the squared difference changes its sign.
    const auto squared_half_difference = [](const Complex x, const Complex y)
    { return (x - y) * (x - y) / 4.; };
    const auto is_real = [](const Complex x) { return std::abs(x.imag()) <= 1e-3 * std::abs(x); };
    for (unsigned int k = i + 1; k < from.branches.size(); ++k)
      if (is_followed(k))
      {
        const Complex before = squared_half_difference(a, from.modes.lambda[k]),
                      after  = squared_half_difference(
                           b, to.modes.lambda[to.index_of(from.branches[k])]);
        if (is_real(before) && is_real(after) && before.real() * after.real() < 0)
          found.push_back(coalescence(from, to, from.branches[i], from.branches[k]));
      }
  }

  std::vector<CriticalValue> CriticalSearch::at(const BranchPoint &point, const BranchPoint *before,
                                                const double direction)
  {
    if (std::none_of(point.modes.lambda.begin(), point.modes.lambda.end(),
                     [&](const Complex l) { return varied.is_marginal(l); }))
      return {};
    std::vector<CriticalValue> found;
    const std::vector<Complex> slopes =
        tracker.sensitivities(varied.parameters.front(), point.modes);
    for (unsigned int j = 0; j < slopes.size(); ++j)
    {
      const Complex lambda = point.modes.lambda[j], slope = slopes[j];
      // A mode that stays marginal has a slope along the imaginary axis, up to rounding; at a
      // double root it has none.
      if (!varied.is_marginal(lambda) || !std::isfinite(std::abs(slope)) ||
          std::abs(slope.real()) <= 1e-4 * std::abs(slope) ||
          std::abs(slope.real() * direction) <= 100 * varied.options.tolerance * std::abs(lambda))
        continue;
      const int at = before ? before->index_of(point.branches[j]) : -1;
      // It comes from the other side, or is only touching the axis.
      if (at >= 0 && before->modes.lambda[at].real() * slope.real() * direction > 0)
        continue;
      CriticalValue result;
      result.kind         = slope.real() * direction > 0 ? "onset" : "end";
      result.branch       = point.branches[j];
      const double step   = -lambda.real() / slope.real();
      result.value        = point.value + step;
      result.lambda       = lambda + slope * step;
      result.search_error = std::abs(step);
      result.mode         = j;
      result.slope        = slope.real();
      result.is_at_end    = true;
      found.push_back(result);
    }
    return found;
  }

  std::optional<CriticalValue> CriticalSearch::divergence(const BranchPoint &from,
                                                          const BranchPoint &to)
  {
    const std::vector<unsigned int> before = divergent_in_disc(from), after = divergent_in_disc(to);
    const BranchPoint &divergent = after.size() > before.size() ? to : from;
    const unsigned int mode      = after.size() > before.size() ? after.front() : before.front();
    const StaticInstability instability = varied.instability_of({divergent.value}, divergent.modes);
    const auto evaluate                 = [&](const double value)
    {
      const auto at = varied.evaluate(instability, {value});
      return std::make_pair(at.value, at.derivatives.front());
    };
    const std::optional<Root> root = find_root(from.value, to.value, evaluate);
    if (!root)
    {
      log.line("  A mode begins or ends to grow without oscillation between " + number(from.value) +
               " and " + number(to.value) + ", but the stiffness is not singular there.");
      return std::nullopt;
    }
    CriticalValue result;
    result.kind           = after.size() > before.size() ? "divergence" : "divergence_end";
    result.branch         = divergent.branches[mode];
    result.value          = root->value;
    result.search_error   = root->accuracy;
    result.iterations     = root->iterations;
    constexpr double near = 0.02, at_end = 1; // shares of the way
    if (estimator && !find_effects(divergent.value, divergent.modes.lambda[mode], near, result))
      find_effects(divergent.value, divergent.modes.lambda[mode], at_end, result);
    return result;
  }

  /// Effect and derivative of l^2, which is smooth at a divergence, are in the same ratio: near the
  /// root, for l^2 bends, but where the two solutions +-l are told apart and known.
  bool CriticalSearch::find_effects(const double value, const Complex lambda, const double share,
                                    CriticalValue &divergence)
  {
    const double beside    = divergence.value + share * (value - divergence.value);
    const Complex expected = std::sqrt(share) * lambda;
    VariedModel::Evaluation at;
    try
    {
      at = varied.evaluate({beside}, {expected});
    }
    catch (const SolverError &) // no modes
    {
      return false;
    }
    if (at.derivatives[0].empty() ||
        !(std::abs(at.lambda[0] - expected) < 0.5 * std::abs(expected)))
      return false;
    divergence.modes.value  = beside;
    divergence.modes.lambda = at.modes.lambda;
    divergence.modes.parity = at.modes.parity;
    divergence.mode         = at.numbers[0];
    divergence.slope        = at.derivatives[0][0].real();
    divergence.effects =
        all_known(tracker.estimate_errors(estimator, varied.parameters_at({beside}), at.modes, {}));
    return true;
  }

  CriticalValue CriticalSearch::onset(const BranchPoint &from, const BranchPoint &to,
                                      const unsigned int branch)
  {
    const Complex first = from.modes.lambda[from.index_of(branch)],
                  last  = to.modes.lambda[to.index_of(branch)];
    EigenvaluePredictor predictor(from.value, first, to.value, last);
    VariedModel::Evaluation at;
    const auto growth_rate = [&](const double p)
    {
      at                  = varied.evaluate({p}, {predictor(p)});
      const Complex slope = at.derivatives[0].empty() ? std::nan("") : at.derivatives[0][0];
      predictor.add({p, at.lambda[0], slope, at.uncertainty});
      return std::make_pair(at.lambda[0].real(), slope.real());
    };
    const Root root = find_root(from.value, first.real(), to.value, last.real(), growth_rate);
    // What the estimated error of the eigenvalue itself moves the value by
    const EigenvaluePredictor::Known &at_root = predictor.last();
    const double slope                        = std::abs(at_root.slope.real());
    CriticalValue result;
    result.kind            = first.real() < 0 ? "onset" : "end";
    result.branch          = branch;
    result.value           = root.value;
    result.search_error    = root.accuracy;
    result.reduction_error = slope > 0 ? at_root.uncertainty / slope : 0;
    result.iterations      = root.iterations;
    result.lambda          = at_root.lambda;
    result.slope           = at_root.slope.real();
    keep_modes(from, at, at_root.at, result);
    return result;
  }

  CriticalValue CriticalSearch::coalescence(const BranchPoint &from, const BranchPoint &to,
                                            const unsigned int branch, const unsigned int other)
  {
    const auto pair = [&](const BranchPoint &point)
    {
      return std::vector<Complex>{point.modes.lambda[point.index_of(branch)],
                                  point.modes.lambda[point.index_of(other)]};
    };
    const auto discriminant = [](const std::vector<Complex> &l)
    { return ((l[0] - l[1]) * (l[0] - l[1]) / 4.).real(); };
    const std::vector<Complex> low = pair(from), high = pair(to);
    const double range             = std::abs(to.value - from.value);
    std::map<double, double> known = {{from.value, discriminant(low)},
                                      {to.value, discriminant(high)}};
    struct
    {
      double value;
      Complex difference, mean, slope; ///< of the pair
      double of_eigenvalues;           ///< by what their own errors move the root
    } last{};
    VariedModel::Evaluation at;
    const auto function = [&](const double p)
    {
      // Expected is the mean of the chord and, between the nearest values, a linear discriminant.
      const double share = (p - from.value) / (to.value - from.value);
      const Complex mean = (low[0] + low[1]) / 2. * (1 - share) + (high[0] + high[1]) / 2. * share;
      auto above         = std::next(known.begin());
      while (above->first < p && std::next(above) != known.end())
        ++above;
      const auto below = std::prev(above);
      const double d   = below->second + (above->second - below->second) * (p - below->first) /
                                           (above->first - below->first);
      const Complex half = std::sqrt(Complex(d));
      at                 = varied.evaluate({p}, {mean + half, mean - half});
      const std::vector<Complex> slopes =
          at.derivatives[0].empty() ? std::vector<Complex>(2, std::nan("")) : at.derivatives[0];
      const Complex difference = at.lambda[0] - at.lambda[1];
      const double value       = discriminant(at.lambda),
                   slope       = (difference * (slopes[0] - slopes[1]) / 2.).real();
      known[p]                 = value;
      // They move the discriminant by |l_1 - l_2| / 2 times the sum of their errors.
      const double of_eigenvalues =
          std::isfinite(slope) && slope != 0
              ? std::abs(difference) / 2 * at.uncertainty / std::abs(slope)
              : 0;
      last = {p, difference, (at.lambda[0] + at.lambda[1]) / 2., (slopes[0] + slopes[1]) / 2.,
              of_eigenvalues};
      return std::make_pair(value, slope);
    };
    // The discriminant is smooth: the error of the last step is of the order of its square. Nearer
    // to the double root the eigenvalues themselves lose half of their digits, so this is where to
    // stop.
    const auto is_converged = [&](const double p, const double step)
    {
      return std::abs(last.difference) <= 2e-3 * std::abs(last.mean) &&
             step * step <= 1e-9 * range * std::max(std::abs(p), range);
    };
    const Root root = find_root(from.value, discriminant(low), to.value, discriminant(high),
                                function, is_converged);
    CriticalValue result;
    result.kind   = "coalescence";
    result.branch = branch;
    result.other  = other;
    result.value  = root.value;
    result.search_error =
        std::max(root.accuracy * root.accuracy / range, 1e-12 * std::abs(root.value));
    result.reduction_error = last.of_eigenvalues;
    result.lambda          = last.mean + last.slope * (root.value - last.value);
    result.iterations      = root.iterations;
    keep_modes(from, at, last.value, result);
    return result;
  }

  void CriticalSearch::keep_modes(const BranchPoint &from, const VariedModel::Evaluation &at,
                                  const double value, CriticalValue &critical) const
  {
    if (!estimator)
      return;
    std::vector<Complex> to_here = tracker.transition(from.modes, at.modes);
    BranchPoint here;
    here.modes = at.modes;
    squeal::continue_branches(to_here, from, varied.options.max_imaginary, here);
    critical.modes =
        on_course(value, at.modes, here.branches, std::move(to_here), from.modes.size());
    critical.mode          = at.numbers[0];
    CriticalModes &between = critical.between;
    between.mode           = from.index_of(critical.branch);
    if (critical.other >= 0)
      between.other = from.index_of(critical.other);
    between.lambda = critical.lambda;
  }
} // namespace squeal
