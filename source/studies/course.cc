#include <squeal/studies/course.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  void Course::begin(const BranchPoint &point, std::vector<CriticalValue> critical)
  {
    stops.clear();
    pass(point, {}, 0, std::move(critical));
  }

  void Course::pass(const BranchPoint &point, std::vector<std::complex<double>> transition,
                    const unsigned int n_before, std::vector<CriticalValue> critical)
  {
    Stop stop;
    stop.modes =
        on_course(point.value, point.modes, point.branches, std::move(transition), n_before);
    stop.overlaps = point.overlaps;
    stop.critical = std::move(critical);
    stops.push_back(std::move(stop));
  }

  void Course::reach(const BranchPoint &point, std::vector<double> reduction_errors)
  {
    Stop &stop            = stops.back();
    stop.modes.branches   = point.branches;
    stop.overlaps         = point.overlaps;
    stop.rows             = point.rows;
    stop.reduction_errors = std::move(reduction_errors);
    stop.is_value         = true;
  }

  void Course::finish(ErrorEffects here)
  {
    std::vector<ModesOnCourse> course;
    for (const Stop &stop : stops)
      course.push_back(stop.modes);
    write(stops.size() == 1 ? std::vector<KnownEffects>{all_known(here)}
                            : effects_along(course, *effects, here));
    keep(std::move(here));
  }

  void Course::finish()
  {
    if (!stops.empty())
      write({});
  }

  void Course::write(const std::vector<KnownEffects> &known)
  {
    if (!known.empty())
      for (unsigned int s = 0; s < stops.size(); ++s)
        if (stops[s].is_value)
        {
          set_bars(stops[s].rows, known[s], stops[s].modes.lambda, stops[s].modes.parity,
                   tolerance);
          note_decided(stops[s]);
        }
    for (unsigned int s = 0; s < stops.size(); ++s)
    {
      for (const CriticalValue &critical : stops[s].critical)
        write_critical(critical, known.empty() ? std::nullopt
                                               : limited(bar_of(critical, s, known), critical));
      if (stops[s].is_value)
        write_stop(stops[s]);
    }
    // The last one begins what follows.
    stops.erase(stops.begin(), stops.end() - 1);
    stops.front().is_value = false;
    stops.front().critical.clear();
  }

  void Course::note_decided(const Stop &stop)
  {
    for (unsigned int j = 0; j < stop.rows.size(); ++j)
    {
      const double growth = stop.rows[j].growth_rate(),
                   bar    = stop.rows[j].growth_rate_error.value_or(INFINITY) +
                         (j < stop.reduction_errors.size() ? stop.reduction_errors[j] : 0);
      if (std::abs(growth) > bar)
        decided.push_back({stop.modes.value, stop.modes.branches[j], growth > 0});
    }
  }

  std::optional<CriticalBar> Course::limited(std::optional<CriticalBar> bar,
                                             const CriticalValue &critical) const
  {
    if (!bar || (critical.kind != "onset" && critical.kind != "end"))
      return bar;
    // Beside the value the branch grows on one side: a place on that side where it does, and one
    // on the other side where it does not, say that the onset lies between it and them.
    const bool grows_above = critical.slope > 0;
    double lowest = -INFINITY, highest = INFINITY;
    for (const Decided &known : decided)
      if (known.branch == unsigned(critical.branch))
      {
        if (known.value <= critical.value && known.grows != grows_above)
          lowest = std::max(lowest, known.value);
        if (known.value >= critical.value && known.grows == grows_above)
          highest = std::min(highest, known.value);
      }
    bar->lowest  = std::max(critical.value - bar->error, lowest);
    bar->highest = std::min(critical.value + bar->error, highest);
    bar->error   = std::max(critical.value - *bar->lowest, *bar->highest - critical.value);
    bar->correction =
        std::clamp(bar->correction, *bar->lowest - critical.value, *bar->highest - critical.value);
    return bar;
  }

  std::optional<CriticalBar> Course::bar_of(const CriticalValue &critical, const unsigned int stop,
                                            const std::vector<KnownEffects> &known) const
  {
    if (critical.effects)
      return bound_critical_value(critical.modes, *critical.effects, critical.mode, critical.slope);
    if (critical.modes.lambda.empty() && !critical.is_at_end) // a divergence without them
      return std::nullopt;
    const ModesOnCourse &to = stops[stop].modes;
    if (stop == 0 || critical.is_at_end) // the slope at the place itself
      return bound_critical_value(to, known[stop], critical.mode, critical.slope);
    const ModesOnCourse &from = stops[stop - 1].modes;
    if (auto bar = bound_critical_value(from, critical.modes, to, known[stop - 1], known[stop],
                                        critical.between))
      return bar;
    if (critical.other >= 0)
      return std::nullopt;
    return bound_critical_value(critical.modes,
                                carry_forward(known[stop - 1], from, critical.modes), critical.mode,
                                critical.slope);
  }
} // namespace squeal
