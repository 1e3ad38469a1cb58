#include <squeal/bars/carried_errors.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>

// Bars between two full estimates. Estimates are dear, so a sweep makes them at the ends of a
// course and carries the effects F of the discretisation along it: first the change of basis from
// place to place (Pairs), then carry_forward(), carry_back() and the blend of both,
// effects_along(). The second half is about critical values: a local pencil A(p) between two places
// (CriticalProblem), whose critical value is found again with each effect that F may have; how far
// it moves is the bar.

namespace squeal
{
  using Complex = std::complex<double>;
  using Effect  = ErrorEffects::Effect;

  ModesOnCourse on_course(const double value, const EigenPairs &modes,
                          const std::vector<unsigned int> &branches,
                          std::vector<Complex> transition, const unsigned int n_before)
  {
    ModesOnCourse result{value, modes.lambda, modes.parity, branches, {}};
    result.transition = {n_before, modes.size(), std::move(transition)};
    return result;
  }

  ErrorBounds bound_errors(const KnownEffects &known, const std::vector<Complex> &lambda,
                           const std::vector<Parity> &parity)
  {
    std::vector<Complex> of_known;
    std::vector<Parity> parity_of_known;
    for (const unsigned int number : known.modes)
    {
      of_known.push_back(lambda[number]);
      if (!parity.empty())
        parity_of_known.push_back(parity[number]);
    }
    return bound_errors(of_known, parity_of_known, known.effects);
  }

  ErrorBounds set_bars(std::vector<ModeRow> &rows, const KnownEffects &known,
                       const std::vector<Complex> &lambda, const std::vector<Parity> &parity,
                       const double tolerance)
  {
    ErrorBounds bounds = bound_errors(known, lambda, parity);
    for (unsigned int k = 0; k < known.modes.size(); ++k)
      set_bar(rows[known.modes[k]], bounds, k, tolerance);
    return bounds;
  }

  KnownEffects all_known(ErrorEffects effects)
  {
    KnownEffects result;
    result.modes.resize(effects.n_modes());
    std::iota(result.modes.begin(), result.modes.end(), 0u);
    result.effects = std::move(effects);
    return result;
  }

  namespace
  {
    constexpr double worst_condition = 1e5;

    /// The modes of two places that are on the same branches, by their numbers before, and how the
    /// one turn into the other.
    struct Pairs
    {
      std::vector<unsigned int> before, after;
      ComplexDenseMatrix c, inverse;

      /// Pairs the modes that are @p known, by their numbers before or after.
      Pairs(const ModesOnCourse &from, const ModesOnCourse &to,
            const std::vector<unsigned int> &known, const bool known_before)
      {
        for (unsigned int i = 0; i < from.branches.size(); ++i)
        {
          const auto at = std::find(to.branches.begin(), to.branches.end(), from.branches[i]);
          if (at == to.branches.end())
            continue;
          const unsigned int j = at - to.branches.begin();
          if (!std::binary_search(known.begin(), known.end(), known_before ? i : j))
            continue;
          before.push_back(i);
          after.push_back(j);
        }
        const unsigned int n = before.size();
        c                    = ComplexDenseMatrix(n, n);
        for (unsigned int j = 0; j < n; ++j)
          for (unsigned int i = 0; i < n; ++i)
            c(i, j) = to.transition(before[i], after[j]);
        inverse = LuFactors<Complex>(c, LuFactors<Complex>::ZeroPivot::becomes_rounding)
                      .solve(ComplexDenseMatrix::identity(n));
        if (!(c.largest_entry() * inverse.largest_entry() < worst_condition))
          *this = Pairs();
      }

    private:
      Pairs() = default;
    };

    /// A F B for square matrices.
    Effect transformed(const ComplexDenseMatrix &a, const Effect &f, const ComplexDenseMatrix &b)
    {
      return (a * DenseView<Complex>(f.data(), a.n_rows, a.n_rows) * b).values;
    }

    template <typename Visit>
    void for_each(ErrorEffects &effects, const Visit &visit)
    {
      visit(effects.f);
      for (Effect &effect : effects.kinds)
        visit(effect);
      for (ErrorEffects::Alternatives &group : effects.alternatives)
        for (Effect &effect : group.effects)
          visit(effect);
    }

    /// Selects the known effects on the modes @p chosen, in this order.
    ErrorEffects of_modes(const KnownEffects &known, const std::vector<unsigned int> &chosen)
    {
      std::vector<unsigned int> members;
      for (const unsigned int mode : chosen)
        members.push_back(std::lower_bound(known.modes.begin(), known.modes.end(), mode) -
                          known.modes.begin());
      return select(known.effects, members);
    }

    /// In ascending order of the modes' numbers.
    KnownEffects in_order(std::vector<unsigned int> modes, const ErrorEffects &effects)
    {
      std::vector<unsigned int> order(modes.size());
      std::iota(order.begin(), order.end(), 0u);
      std::sort(order.begin(), order.end(),
                [&](const unsigned int a, const unsigned int b) { return modes[a] < modes[b]; });
      KnownEffects result{{}, select(effects, order)};
      for (const unsigned int k : order)
        result.modes.push_back(modes[k]);
      return result;
    }

    /// F' = C^{-1} F C.
    ///
    /// Where a mode begins or ceases to oscillate, l has passed zero and its vector's conjugate,
    /// which is none of the modes, has a part in the new one: what is carried then is the effect on
    /// l^2, which is smooth there, 2 l f.
    KnownEffects carried(const KnownEffects &known, const ModesOnCourse &source,
                         const std::vector<unsigned int> &of, const ModesOnCourse &target,
                         std::vector<unsigned int> to, const ComplexDenseMatrix &c,
                         const ComplexDenseMatrix &inverse)
    {
      ErrorEffects effects = of_modes(known, of);
      const unsigned int n = of.size();
      for_each(effects, [&](Effect &effect) { effect = transformed(inverse, effect, c); });
      for (unsigned int i = 0; i < n; ++i)
      {
        const Complex before = source.lambda[of[i]], after = target.lambda[to[i]];
        if ((before.imag() == 0) == (after.imag() == 0) || after == 0.)
          continue;
        for_each(effects,
                 [&](Effect &effect)
                 {
                   for (unsigned int j = 0; j < n; ++j)
                     effect[i + n * j] *= before / after;
                 });
      }
      return in_order(std::move(to), effects);
    }
  } // namespace

  KnownEffects carry_forward(const KnownEffects &known, const ModesOnCourse &from,
                             const ModesOnCourse &to)
  {
    const Pairs pairs(from, to, known.modes, true);
    return carried(known, from, pairs.before, to, pairs.after, pairs.c, pairs.inverse);
  }

  KnownEffects carry_back(const KnownEffects &known, const ModesOnCourse &from,
                          const ModesOnCourse &to)
  {
    const Pairs pairs(from, to, known.modes, false);
    return carried(known, to, pairs.after, from, pairs.before, pairs.inverse, pairs.c);
  }

  KnownEffects blend(const KnownEffects &a, const KnownEffects &b, const double share)
  {
    if (a.modes.empty() || b.modes.empty())
      return a.modes.empty() ? b : a;
    KnownEffects result;
    std::set_union(a.modes.begin(), a.modes.end(), b.modes.begin(), b.modes.end(),
                   std::back_inserter(result.modes));
    const unsigned int n = result.modes.size();
    // The places of the union's modes in each of both, or -1.
    const auto places_in = [&](const KnownEffects &known)
    {
      std::vector<int> places;
      for (const unsigned int mode : result.modes)
      {
        const auto at = std::lower_bound(known.modes.begin(), known.modes.end(), mode);
        places.push_back(at != known.modes.end() && *at == mode ? int(at - known.modes.begin())
                                                                : -1);
      }
      return places;
    };
    const std::vector<int> in_a = places_in(a), in_b = places_in(b);
    const auto mixed = [&](const Effect &of_a, const Effect &of_b)
    {
      Effect sum(n * n);
      for (unsigned int j = 0; j < n; ++j)
        for (unsigned int i = 0; i < n; ++i)
        {
          const bool has_a = in_a[i] >= 0 && in_a[j] >= 0, has_b = in_b[i] >= 0 && in_b[j] >= 0;
          const Complex at_a = has_a ? of_a[in_a[i] + a.modes.size() * in_a[j]] : 0.,
                        at_b = has_b ? of_b[in_b[i] + b.modes.size() * in_b[j]] : 0.;
          sum[i + n * j]     = has_a && has_b ? (1 - share) * at_a + share * at_b : at_a + at_b;
        }
      return sum;
    };
    ErrorEffects &effects = result.effects;
    effects.degree        = a.effects.degree;
    effects.f             = mixed(a.effects.f, b.effects.f);
    // Kinds of cells of one mesh are the same.
    for (unsigned int k = 0; k < std::min(a.effects.kinds.size(), b.effects.kinds.size()); ++k)
      effects.kinds.push_back(mixed(a.effects.kinds[k], b.effects.kinds[k]));
    // What contact zones add to the bars adds up over groups: each end's own, by its share.
    const auto add_share = [&](const KnownEffects &of, const std::vector<int> &places,
                               const std::vector<int> &of_others, const double weight)
    {
      for (const ErrorEffects::Alternatives &group : of.effects.alternatives)
      {
        ErrorEffects::Alternatives parts{{}, group.with_likeliest, group.name};
        double largest = 0;
        for (const Effect &effect : group.effects)
        {
          parts.effects.emplace_back(n * n);
          for (unsigned int j = 0; j < n; ++j)
            for (unsigned int i = 0; i < n; ++i)
              if (places[i] >= 0 && places[j] >= 0)
              {
                const bool is_only_here = of_others[i] < 0 || of_others[j] < 0;
                const Complex part =
                    (is_only_here ? 1 : weight) * effect[places[i] + of.modes.size() * places[j]];
                parts.effects.back()[i + n * j] = part;
                largest                         = std::max(largest, std::abs(part));
              }
        }
        if (largest > 0)
          effects.alternatives.push_back(std::move(parts));
      }
    };
    add_share(a, in_a, in_b, 1 - share);
    add_share(b, in_b, in_a, share);
    return result;
  }

  std::vector<KnownEffects> effects_along(const std::vector<ModesOnCourse> &course,
                                          const ErrorEffects &first, const ErrorEffects &last)
  {
    const unsigned int n = course.size();
    std::vector<KnownEffects> result(n);
    result.front() = all_known(first);
    for (unsigned int k = 1; k < n; ++k)
      result[k] = carry_forward(result[k - 1], course[k - 1], course[k]);
    KnownEffects back   = all_known(last);
    const double length = course.back().value - course.front().value;
    for (unsigned int k = n; k-- > 0;)
    {
      result[k] = blend(result[k], back,
                        length == 0 ? 0. : (course[k].value - course.front().value) / length);
      if (k > 0)
        back = carry_back(back, course[k - 1], course[k]);
    }
    return result;
  }

  namespace
  {
    /// A_0 + q A_1 + q^2 A_2 + s E for a few modes, with q from 0 to 1 along the step.
    struct CriticalProblem
    {
      std::array<ComplexDenseMatrix, 3> a;
      double start   = 0; ///< where it is critical without E, nearly
      Complex centre = 0; ///< the eigenvalue there, or the mean of the pair
      bool is_pair   = false;

      ComplexDenseMatrix at(const double q, const Effect &effect, const double s) const
      {
        ComplexDenseMatrix sum(a[0].n_rows, a[0].n_rows);
        for (std::size_t k = 0; k < effect.size(); ++k)
          sum.values[k] =
              a[0].values[k] + q * a[1].values[k] + q * q * a[2].values[k] + s * effect[k];
        return sum;
      }

      /// The step of Newton's method at q; the eigenvalue is followed.
      double newton_step(const double q, const Effect &effect, const double s, Complex &near) const
      {
        if (is_pair)
        {
          // ((l_i - l_j)/2)^2 is smooth in q, its derivative a difference.
          const auto discriminant = [&](const double place)
          {
            const std::vector<Complex> values    = general_eigen(at(place, effect, s)).values;
            const std::vector<unsigned int> pair = nearest(values, near, 2);
            near                                 = (values[pair[0]] + values[pair[1]]) / 2.;
            return std::pow((values[pair[0]] - values[pair[1]]) / 2., 2).real();
          };
          constexpr double h = 1e-4;
          const double here  = discriminant(q);
          return -here * h / (discriminant(q + h) - here);
        }
        const DenseEigenpairs pairs = general_eigen(at(q, effect, s), true);
        const unsigned int k = nearest(pairs.values, near, 1).front(), n = a[0].n_rows;
        Complex along = 0, product = 0;
        for (unsigned int j = 0; j < n; ++j)
        {
          product += std::conj(pairs.left(j, k)) * pairs.right(j, k);
          for (unsigned int i = 0; i < n; ++i)
            along +=
                std::conj(pairs.left(i, k)) * (a[1](i, j) + 2 * q * a[2](i, j)) * pairs.right(j, k);
        }
        near = pairs.values[k];
        return -near.real() / (along / product).real();
      }

      /// How far an effect moves the place where it is critical: the effect grows from zero, and
      /// the place follows it by Newton's method.
      std::optional<double> moved_by(const Effect &effect) const
      {
        constexpr unsigned int n_stages = 4, max_iterations = 40;
        constexpr double farthest = 1e4, small = 1e-7;
        double q = start, without = start;
        Complex near = centre;
        for (unsigned int stage = 0; stage <= n_stages; ++stage)
        {
          bool converged = false;
          for (unsigned int i = 0; i < max_iterations && !converged; ++i)
          {
            const double dq      = newton_step(q, effect, double(stage) / n_stages, near),
                         longest = std::max(1., std::abs(q - without));
            if (!std::isfinite(dq) || std::abs(q) > farthest)
              return std::nullopt;
            q += std::clamp(dq, -longest, longest);
            converged = std::abs(dq) <= small * (1 + std::abs(q));
          }
          if (!converged)
            return std::nullopt;
          if (stage == 0)
            without = q;
        }
        return q - without;
      }

      static std::vector<unsigned int> nearest(const std::vector<Complex> &values,
                                               const Complex &to, const unsigned int number)
      {
        std::vector<unsigned int> order(values.size());
        std::iota(order.begin(), order.end(), 0u);
        std::partial_sort(order.begin(), order.begin() + number, order.end(),
                          [&](const unsigned int a, const unsigned int b)
                          { return std::abs(values[a] - to) < std::abs(values[b] - to); });
        order.resize(number);
        return order;
      }
    };
  } // namespace

  namespace
  {
    /// The operator A(p) between two places in the modes of the first one, and what is known there.
    struct Step
    {
      std::vector<unsigned int> modes; ///< numbers at its beginning
      std::vector<Complex> lambda;
      std::array<ComplexDenseMatrix, 3> a; ///< A_0 + q A_1 + q^2 A_2
      ErrorEffects effects;                ///< at the critical value
    };

    /// A of another place in the modes of the first one.
    ComplexDenseMatrix operator_of(const ModesOnCourse &other, const Pairs &pairs)
    {
      const unsigned int n = pairs.after.size();
      ComplexDenseMatrix l(n, n);
      for (unsigned int k = 0; k < n; ++k)
        l(k, k) = other.lambda[pairs.after[k]];
      return pairs.c * l * pairs.inverse;
    }

    std::optional<Step> step_between(const ModesOnCourse &from, const ModesOnCourse &to,
                                     const KnownEffects &at_from, const KnownEffects &at_to,
                                     const double share)
    {
      const KnownEffects back  = carry_back(at_to, from, to),
                         mixed = blend(at_from, back, std::clamp(share, 0., 1.));
      const Pairs pairs(from, to, mixed.modes, true);
      if (pairs.before.empty())
        return std::nullopt;
      Step step;
      step.modes           = pairs.before;
      step.effects         = of_modes(mixed, pairs.before);
      const unsigned int n = step.modes.size();
      for (ComplexDenseMatrix &part : step.a)
        part = ComplexDenseMatrix(n, n);
      for (unsigned int k = 0; k < n; ++k)
      {
        step.lambda.push_back(from.lambda[step.modes[k]]);
        step.a[0](k, k) = step.lambda.back();
      }
      step.a[1] = operator_of(to, pairs);
      step.a[1] -= step.a[0];
      return step;
    }

    /// Makes the chord a parabola through a third place, which lies well within and where vectors
    /// are not nearly parallel.
    void bend(const ModesOnCourse &from, const ModesOnCourse &at, const double share, Step &step)
    {
      constexpr double near_end = 0.02, condition = 100;
      const Pairs pairs(from, at, step.modes, true);
      if (share < near_end || share > 1 - near_end || pairs.before != step.modes ||
          pairs.c.largest_entry() * pairs.inverse.largest_entry() > condition)
        return;
      const ComplexDenseMatrix a = operator_of(at, pairs);
      for (std::size_t k = 0; k < a.values.size(); ++k)
      {
        const Complex off = (a.values[k] - step.a[0].values[k] - share * step.a[1].values[k]) /
                            (share * (share - 1));
        step.a[1].values[k] -= off;
        step.a[2].values[k] = off;
      }
    }

    /// Places in a step of a critical mode, or of both of a pair, and of those near it, the nearest
    /// first: a few, and of its parity alone. Empty if the step does not know the mode.
    std::vector<unsigned int> nearest_modes(const Step &step, const std::vector<Parity> &parity,
                                            const CriticalModes &critical)
    {
      constexpr unsigned int largest         = 10;
      const std::vector<unsigned int> &modes = step.modes;
      const auto place_of                    = [&](const int number)
      { return std::find(modes.begin(), modes.end(), unsigned(number)) - modes.begin(); };
      const unsigned int mode = place_of(critical.mode);
      const int other         = critical.other < 0 ? -1 : int(place_of(critical.other));
      if (mode == modes.size() || other == int(modes.size()))
        return {};
      std::vector<unsigned int> order(modes.size());
      std::iota(order.begin(), order.end(), 0u);
      const auto parity_of = [&](const unsigned int k)
      { return parity.empty() ? Parity::none : parity[modes[k]]; };
      const auto distance = [&](const unsigned int k)
      {
        if (k == mode || int(k) == other)
          return -1.;
        return parity_of(k) != parity_of(mode) ? std::numeric_limits<double>::infinity()
                                               : std::abs(step.lambda[k] - step.lambda[mode]);
      };
      std::sort(order.begin(), order.end(),
                [&](const unsigned int a, const unsigned int b)
                { return distance(a) < distance(b); });
      while (order.size() > largest || std::isinf(distance(order.back())))
        order.pop_back();
      return order;
    }

    /// The rows and columns of these numbers.
    ComplexDenseMatrix part_of(const ComplexDenseMatrix &a,
                               const std::vector<unsigned int> &numbers)
    {
      const unsigned int m = numbers.size();
      ComplexDenseMatrix part(m, m);
      for (unsigned int i = 0; i < m; ++i)
        for (unsigned int j = 0; j < m; ++j)
          part(i, j) = a(numbers[i], numbers[j]);
      return part;
    }

    /// a + factor b.
    Effect sum_of(Effect a, const double factor, const Effect &b)
    {
      for (std::size_t k = 0; k < a.size(); ++k)
        a[k] += factor * b[k];
      return a;
    }

    /// How far effects move the critical value, as in bound_errors(); places are shares of a step
    /// of this length.
    std::optional<CriticalBar> bar_of(const CriticalProblem &problem, const ErrorEffects &effects,
                                      const double length)
    {
      const double factor = whole_effect(effects.degree);
      Effect all          = effects.f;
      for (Complex &entry : all)
        entry *= factor;
      const std::optional<double> seen         = problem.moved_by(effects.f),
                                  corrected    = problem.moved_by(correcting(effects)),
                                  extrapolated = problem.moved_by(all);
      if (!seen || !corrected || !extrapolated)
        return std::nullopt;
      UncertainChange change;
      change.include(*seen);
      change.include(*extrapolated);
      // How much further a multiple of another effect moves it
      const auto further = [&](const Effect &effect, const double share)
      {
        std::optional<double> moved = problem.moved_by(sum_of(all, share, effect));
        if (moved)
          *moved -= *extrapolated;
        return moved;
      };
      double by_kinds = 0;
      for (const Effect &kind : effects.kinds)
      {
        const std::optional<double> more = further(kind, unequal_parts * factor),
                                    less = further(kind, -unequal_parts * factor);
        if (!more || !less)
          return std::nullopt;
        by_kinds += std::max(std::abs(*more), std::abs(*less));
      }
      change.set_parts(by_kinds);
      for (const ErrorEffects::Alternatives &group : effects.alternatives)
      {
        std::vector<double> changes;
        for (const Effect &effect : group.effects)
          if (const std::optional<double> moved = further(effect, 1))
            changes.push_back(*moved);
          else
            return std::nullopt;
        change.add(group, changes);
      }
      CriticalBar result;
      result.correction = *corrected * length;
      result.error      = change.bound() * std::abs(length);
      return result;
    }
  } // namespace

  std::optional<CriticalBar> bound_critical_value(const ModesOnCourse &from,
                                                  const ModesOnCourse &at, const ModesOnCourse &to,
                                                  const KnownEffects &at_from,
                                                  const KnownEffects &at_to,
                                                  const CriticalModes &critical)
  {
    const double length = to.value - from.value, share = (at.value - from.value) / length;
    std::optional<Step> whole = step_between(from, to, at_from, at_to, share);
    if (!whole)
      return std::nullopt;
    if (critical.other < 0)
      bend(from, at, share, *whole);
    const std::vector<unsigned int> order = nearest_modes(*whole, from.parity, critical);
    if (order.empty())
      return std::nullopt;
    CriticalProblem problem;
    for (unsigned int power = 0; power < 3; ++power)
      problem.a[power] = part_of(whole->a[power], order);
    problem.start   = share;
    problem.centre  = critical.lambda;
    problem.is_pair = critical.other >= 0;
    return bar_of(problem, select(whole->effects, order), length);
  }

  std::optional<CriticalBar> bound_critical_value(const ModesOnCourse &at,
                                                  const KnownEffects &known,
                                                  const unsigned int mode, const double slope)
  {
    const auto place = std::lower_bound(known.modes.begin(), known.modes.end(), mode);
    if (place == known.modes.end() || *place != mode || slope == 0)
      return std::nullopt;
    const ErrorBounds bounds = bound_errors(known, at.lambda, at.parity);
    const unsigned int k     = place - known.modes.begin();
    return CriticalBar{-bounds.correction[k].real() / slope,
                       bounds.growth_rate[k] / std::abs(slope)};
  }
} // namespace squeal
