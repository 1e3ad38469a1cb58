#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/studies/interpolated_effects.h>

#include <algorithm>
#include <numeric>

namespace squeal
{
  InterpolatedEffects::InterpolatedEffects(VariedModel &varied, const ErrorEstimator &estimator,
                                           const Point &centre, const std::vector<Point> &places)
      : varied(varied)
  {
    ModeTracker &tracker = varied.tracker;
    EigenSolution found  = tracker.solve_fully(varied.parameters_at(centre));
    at_centre.modes      = std::move(found.modes);
    at_centre.n_branches = at_centre.modes.size();
    at_centre.branches.resize(at_centre.n_branches);
    std::iota(at_centre.branches.begin(), at_centre.branches.end(), 0u);
    course = on_course(0, at_centre.modes, at_centre.branches, {}, 0);
    if (!estimator)
      return;
    effects     = tracker.estimate_errors(estimator, varied.parameters_at(centre), at_centre.modes,
                                          found.reuse);
    found.reuse = {}; // two factorisations would double the memory
    for (const Point &place : places)
    {
      std::string where;
      for (unsigned int i = 0; i < place.size(); ++i)
        if (place[i] != centre[i])
          where += (where.empty() ? "" : ", ") + varied.parameters[i] + " = " + number(place[i], 6);
      varied.options.progress("  error bars at " + where);
      EigenSolution shifted;
      try
      {
        shifted = tracker.solve_fully(varied.parameters_at(place));
      }
      catch (const NoLoad &)
      {
        at_places.emplace_back(); // the centre must serve
        continue;
      }
      BranchPoint there;
      there.modes           = std::move(shifted.modes);
      const auto transition = tracker.transition(at_centre.modes, there.modes);
      continue_branches(transition, at_centre, varied.options.max_imaginary, there);
      const KnownEffects known = all_known(tracker.estimate_errors(
          estimator, varied.parameters_at(place), there.modes, shifted.reuse));
      const ModesOnCourse at =
          on_course(1, there.modes, there.branches, transition, at_centre.modes.size());
      at_places.push_back(carry_back(known, course, at));
    }
  }

  KnownEffects InterpolatedEffects::at(const Shares &share) const
  {
    KnownEffects known = all_known(effects);
    for (unsigned int i = 0; i < at_places.size(); ++i)
    {
      const KnownEffects &there = at_places[i];
      // A mode has left, or the place carries no load: the centre must serve.
      if (there.modes.size() != known.modes.size())
        continue;
      const auto add = [&](auto &sum, const auto &of_place, const auto &of_centre)
      {
        for (std::size_t k = 0; k < sum.size(); ++k)
          sum[k] += share[i] * (of_place[k] - of_centre[k]);
      };
      add(known.effects.f, there.effects.f, effects.f);
      for (std::size_t k = 0; k < effects.kinds.size() && k < there.effects.kinds.size(); ++k)
        add(known.effects.kinds[k], there.effects.kinds[k], effects.kinds[k]);
      const auto &groups = there.effects.alternatives, &own = effects.alternatives;
      for (std::size_t g = 0; g < groups.size() && g < own.size(); ++g)
        for (std::size_t a = 0; a < groups[g].effects.size() && a < own[g].effects.size(); ++a)
          add(known.effects.alternatives[g].effects[a], groups[g].effects[a], own[g].effects[a]);
    }
    // Between two places effects are as far from linear as a quarter of their difference, bent by
    // s (1 - s): where they cancel on the way the bar must not vanish.
    constexpr double bend = 0.25;
    for (unsigned int i = 0; i < at_places.size(); ++i)
    {
      const KnownEffects &there = at_places[i];
      const double weight       = bend * whole_effect(effects.degree) * share[i] * (1 - share[i]);
      if (there.modes.size() != known.modes.size() || weight == 0)
        continue;
      ErrorEffects::Effect bent(effects.f.size());
      for (std::size_t k = 0; k < bent.size(); ++k)
        bent[k] = weight * (there.effects.f[k] - effects.f[k]);
      known.effects.alternatives.push_back({{std::move(bent)}, false, "between values"});
    }
    return known;
  }

  KnownEffects InterpolatedEffects::on(const Shares &shares, const EigenPairs &modes) const
  {
    std::vector<std::complex<double>> transition =
        varied.tracker.transition(at_centre.modes, modes);
    BranchPoint here;
    here.modes.lambda = modes.lambda; // branches need no more
    continue_branches(transition, at_centre, varied.options.max_imaginary, here);
    return carry_forward(
        at(shares), course,
        on_course(0, modes, here.branches, std::move(transition), at_centre.modes.size()));
  }
} // namespace squeal
