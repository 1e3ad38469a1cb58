#include <squeal/studies/course.h>

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
    for (unsigned int s = 0; s < stops.size(); ++s)
    {
      Stop &stop = stops[s];
      for (const CriticalValue &critical : stop.critical)
        write_critical(critical, known.empty() ? std::nullopt : bar_of(critical, s, known));
      if (!stop.is_value)
        continue;
      if (!known.empty())
        set_bars(stop.rows, known[s], stop.modes.lambda, stop.modes.parity, tolerance);
      write_stop(stop);
    }
    // The last one begins what follows.
    stops.erase(stops.begin(), stops.end() - 1);
    stops.front().is_value = false;
    stops.front().critical.clear();
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
