#include <squeal/studies/sweep.h>

#include <algorithm>

namespace squeal
{
  using Complex = std::complex<double>;
  using Scope   = ModeTracker::Scope;

  namespace
  {
    /// Branches are counted as modes are, from 1: at the first value both numbers are the same.
    unsigned int number_of(const unsigned int branch)
    {
      return branch + 1;
    }

    Fields sweep_fields(const double value, const unsigned int branch, const ModeRow &row,
                        const double overlap, const double reduction_error)
    {
      return Fields{{"parameter", value}, {"branch", number_of(branch)}} + modes_fields(row) +
             Fields{{"overlap", overlap > 0 ? number(overlap) : ""},
                    {"reduction_error_1_per_s", reduction_error}};
    }
  } // namespace

  Sweep::Sweep(ParameterFile &file, Model &model, const ModelFactory &make_model,
               const EigensolverOptions &options, const std::string &directory, const MPI_Comm comm,
               Log &log, const ErrorEstimator &estimator)
      : Study({"sweep",
               "value",
               "a critical value of " + file.parameters().sweep.parameter,
               {"sweep.csv", "critical.csv"}},
              file, {file.parameters().sweep.parameter}, model, options, directory, comm, log,
              estimator),
        parameter(varied.parameters.front()), values(file.parameters().sweep.points()),
        wants_critical_values(file.parameters().sweep.critical_values),
        path(varied, make_model, comm, log), search(varied, this->estimator, log),
        course(
            options.tolerance,
            [this](const CriticalValue &critical, const std::optional<CriticalBar> &bar)
            { write(critical, bar); },
            [this](const Course::Stop &stop) { write(stop); })
  {
  }

  std::string Sweep::take_up()
  {
    if (last.value != values[n_done - 1] || last.branches.size() != last.overlaps.size())
      return not_of_this();
    BranchPoint here = path.solve(last.value, Scope::window, true);
    if (here.modes.size() != last.branches.size())
      return text_of("at ", parameter, " = ", number(last.value), " there are ", here.modes.size(),
                     " modes, there were ", last.branches.size(), ".");
    here.n_branches = last.n_branches;
    here.branches   = std::move(last.branches);
    here.overlaps   = std::move(last.overlaps);
    last            = std::move(here);
    course.begin(last);
    if (path.keeps_mesh())
      tracker.set_expansion_point(varied.parameters_at({last.value}), last.reuse);
    if (estimator)
      course.keep(estimate_errors());
    if (path.keeps_mesh())
      tracker.keep_apart(varying_terms);
    last.reuse = {};
    has_begun  = true;
    return "";
  }

  void Sweep::open(const bool resumed)
  {
    sweep_csv = table("sweep.csv", sweep_fields(0, 0, {}, 0, 0), resumed);
    if (wants_critical_values && !path.keeps_mesh())
      log.line("\nCritical values are not located: " + parameter +
               " changes the mesh. The log says between which values a growth rate changes its "
               "sign.");
    if (wants_critical_values && path.keeps_mesh())
      critical_csv = table("critical.csv", critical_fields({}, {}), resumed);
    log.line("\nSweep over " + parameter + "\n           value   modes   unstable   " +
             (estimator ? "undecided   " : "") + "largest growth rate, 1/s");
  }

  void Sweep::solve(const unsigned int point)
  {
    try
    {
      advance(point);
      settle();
    }
    catch (const SolverError &)
    {
      course.finish(); // what was found is written, without the bars that are not known
      throw;
    }
  }

  void Sweep::conclude()
  {
    tell_full_solutions(critical_csv ? " and the critical ones" : "");
  }

  void Sweep::advance(const unsigned int point)
  {
    BranchPoint next = solve_value(values[point]);
    if (!has_begun)
    {
      has_begun = true;
      Path::begin_branches(next);
      course.begin(next, critical_csv && values.size() > 1
                             ? search.at(next, nullptr, values[1] - values[0])
                             : std::vector<CriticalValue>());
    }
    else if (!path.keeps_mesh())
    {
      path.advance_on_new_mesh(last, next);
      course.begin(next);
    }
    else
      next = path.advance(last, std::move(next),
                          [&](const BranchPoint &from, const BranchPoint &to,
                              const std::vector<Complex> &transition)
                          {
                            course.pass(to, transition, from.modes.size(),
                                        critical_csv ? search.between(from, to)
                                                     : std::vector<CriticalValue>());
                          });
    last = std::move(next);
    std::vector<double> reduction_errors;
    for (unsigned int j = 0; j < last.modes.size(); ++j)
      reduction_errors.push_back(varied.uncertainty(last.modes, j));
    course.reach(last, std::move(reduction_errors));
    if (!estimator)
      course.finish();
  }

  BranchPoint Sweep::solve_value(const double value)
  {
    constexpr std::chrono::minutes longest(15);
    BranchPoint point =
        path.solve(value, Scope::window, is_state_older_than(longest) || wants_bars(value));
    if (estimator && !tracker.is_whole(point.modes) && are_effects_of_another_contact())
      point = path.solve(value, Scope::window, true);
    return point;
  }

  bool Sweep::wants_bars(const double value) const
  {
    constexpr std::size_t many = 10;
    return estimator && (value == values.back() ||
                         (values.size() >= many && value == values[values.size() / 2]));
  }

  bool Sweep::are_effects_of_another_contact() const
  {
    const unsigned int now = tracker.n_constraints(), before = n_constraints_of_effects;
    constexpr double much = 0.03;
    return std::max(now, before) - std::min(now, before) > much * before;
  }

  ErrorEffects Sweep::estimate_errors()
  {
    log.progress("  error bars at " + parameter + " = " + number(last.value, 6));
    ErrorEffects effects = tracker.estimate_errors(estimator, varied.parameters_at({last.value}),
                                                   last.modes, last.reuse);
    n_constraints_of_effects = tracker.n_constraints();
    return effects;
  }

  void Sweep::settle()
  {
    if (!tracker.is_whole(last.modes))
    {
      if (tracker.is_crowded())
        last.modes = tracker.restart(last.modes);
      return;
    }
    if (path.keeps_mesh())
      tracker.set_expansion_point(varied.parameters_at({last.value}), last.reuse);
    if (estimator)
      course.finish(estimate_errors());
    last.reuse = {}; // the factors are the model's now
    // The terms that are known to vary are projected apart, also in a run that resumes here: bytes
    // of tables are equal then, by which tests tell that nothing of a state is lost. Without it
    // eigenvalues agreed to 1e-12 (sweep over the pads' modulus), those of maps to 7e-11.
    varying_terms = tracker.varying_terms();
  }

  void Sweep::write(const Course::Stop &stop)
  {
    const std::vector<ModeRow> &rows = stop.rows;
    for (unsigned int j = 0; j < rows.size(); ++j)
      sweep_csv->add(sweep_fields(stop.modes.value, stop.modes.branches[j], rows[j],
                                  stop.overlaps[j], stop.reduction_errors[j]));
    const GrowthSummary summary(rows);
    count_modes(rows.size());
    const auto shown = [&](const unsigned int n) { return summary.worst ? summary.field(n) : "-"; };
    log.line(formatted("  %14.6g   %5zu   %8s   ", stop.modes.value, rows.size(),
                       shown(summary.n_unstable).c_str()) +
             (estimator ? formatted("%9s   ", shown(summary.n_undecided).c_str()) : "") +
             (summary.worst ? number(summary.worst->growth_rate()) + " at " +
                                  number(summary.worst->frequency()) + " Hz"
                            : "-"));
  }

  Fields Sweep::critical_fields(const CriticalValue &critical,
                                const std::optional<CriticalBar> &bar) const
  {
    const auto of_bar = [&](const double x) { return bar ? number(x, 15) : ""; };
    return {
        {"kind", critical.kind},
        {"parameter", parameter},
        {"value", number(critical.value, 15)},
        {"accuracy", critical.accuracy()},
        {"frequency_hz", std::abs(critical.lambda.imag()) / (2 * M_PI)},
        {"growth_rate_1_per_s", critical.lambda.real()},
        {"branch", number_of(critical.branch)},
        {"other_branch", critical.other < 0 ? "" : std::to_string(number_of(critical.other))},
        {"iterations", critical.iterations},
        {"search_error", critical.search_error},
        {"reduction_error", critical.reduction_error},
        {"mesh_error", bar ? number(bar->error, 6) : ""},
        {"corrected_value", of_bar(critical.value + (bar ? bar->correction : 0))},
        {"lowest_value", bar ? number(bar->lowest.value_or(critical.value - bar->error), 9) : ""},
        {"highest_value",
         bar ? number(bar->highest.value_or(critical.value + bar->error), 9) : ""}};
  }

  void Sweep::write(const CriticalValue &critical, const std::optional<CriticalBar> &bar)
  {
    critical_csv->add(critical_fields(critical, bar));
    std::string value = number(critical.value) + " (+- " + number(critical.accuracy(), 2) + ")";
    if (estimator && !bar)
      value += ", bar of the mesh not known";
    if (bar)
    {
      value = with_bar(critical.value, 12, 0, bar->error + critical.accuracy());
      value.erase(value.find_last_not_of(' ') + 1);
      value += " (mesh +- " + number(bar->error, 2) + ", search and reduction +- " +
               number(critical.accuracy(), 2) + "; corrected " +
               number(critical.value + bar->correction, 4) +
               (bar->lowest
                    ? text_of("; from ", number(*bar->lowest, 4), " to ", number(*bar->highest, 4))
                    : "") +
               ")";
    }
    log.line(
        "  Critical: " + critical.kind + " of branch " +
        std::to_string(number_of(critical.branch)) +
        (critical.other < 0 ? "" : " with branch " + std::to_string(number_of(critical.other))) +
        " at " + parameter + " = " + value + ", " +
        number(std::abs(critical.lambda.imag()) / (2 * M_PI)) + " Hz");
  }
} // namespace squeal
