#include <squeal/eigen/growth_search.h>
#include <squeal/linalg/find_root.h>
#include <squeal/studies/sweep.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>

namespace squeal
{
  using Complex = std::complex<double>;
  using Scope   = ModeTracker::Scope;

  namespace
  {
    /// The mode of a branch at a point, or -1.
    int index_of(const BranchPoint &point, const unsigned int branch)
    {
      const auto at = std::find(point.branches.begin(), point.branches.end(), branch);
      return at == point.branches.end() ? -1 : int(at - point.branches.begin());
    }

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
      : parameter(file.parameters().sweep.parameter),
        keeps_mesh(Parameters::Sweep::keeps_mesh(parameter)), make_model(make_model),
        study(file, {parameter}, options, directory, "sweep", "a critical value of " + parameter,
              {"sweep.csv", "critical.csv"}, comm, log),
        tracker(study.tracker), values(file.parameters().sweep.points()),
        wants_critical_values(file.parameters().sweep.critical_values), log(log),
        estimator(estimator)
  {
    tracker.set_model(model);
    const std::vector<std::string> sections = {"Rotor/", "Pads/", "Strip/", "Mesh/",
                                               "Discretization/"};
    const bool makes_mesh = make_model && std::any_of(sections.begin(), sections.end(),
                                                      [&](const std::string &section)
                                                      { return parameter.rfind(section, 0) == 0; });
    if (!keeps_mesh && !makes_mesh)
      throw InputError(
          "Sweep/Parameter = " + parameter +
          ": the equations of motion do not depend on it. Allowed are numbers of the sections "
          "Operation, Contact, Rotor, Pads, Strip, Mesh, Modal damping, Discretization, and of "
          "Matrices in the scene matrices.");
    // A value that is not allowed is refused before anything is computed.
    const double now = file.value_of(parameter);
    for (const double value : values)
      study.parameters_at({value});
    study.parameters_at({now});
  }

  void Sweep::make_mesh(const double value)
  {
    own_model.reset(); // two meshes at a time would double the memory
    own_model = make_model(study.parameters_at({value}));
    tracker.set_model(*own_model);
  }

  bool Sweep::solve(const double value, const BranchPoint *before, BranchPoint &point,
                    const Scope scope, const bool fully)
  {
    EigenSolution found = fully ? tracker.solve_fully(study.parameters_at({value}), scope)
                                : tracker.solve(study.parameters_at({value}), scope);
    point.value         = value;
    point.modes         = std::move(found.modes);
    point.reuse         = std::move(found.reuse);
    point.rows          = tracker.analyse(point.modes);
    if (found.proof.lacks_growing)
      log.line("  At " + number(value) + ": " + lacking_growth);
    bool certain = true;
    if (before)
      certain = continue_branches(*before, point);
    return certain;
  }

  bool Sweep::continue_branches(const BranchPoint &from, BranchPoint &to)
  {
    transition = tracker.transition(from.modes, to.modes);
    return squeal::continue_branches(transition, from, study.options.max_imaginary, to);
  }

  bool Sweep::is_allowed(const double value)
  {
    try
    {
      study.parameters_at({value});
      return true;
    }
    catch (const InputError &)
    {
      return false;
    }
  }

  bool Sweep::grows_beyond_disc(const Complex &lambda) const
  {
    return squeal::grows_beyond_disc(lambda, study.options.max_imaginary);
  }

  std::vector<unsigned int> Sweep::divergent_in_disc(const BranchPoint &point) const
  {
    std::vector<unsigned int> modes = divergent_modes(point.modes);
    modes.erase(std::remove_if(modes.begin(), modes.end(),
                               [&](const unsigned int j)
                               { return grows_beyond_disc(point.modes.lambda[j]); }),
                modes.end());
    return modes;
  }

  BranchPoint Sweep::advance(const BranchPoint &from, const double value, const Scope scope,
                             const unsigned int n_halvings, std::optional<BranchPoint> known)
  {
    if (!keeps_mesh)
      return advance_on_new_mesh(from, value);
    BranchPoint to;
    bool certain = false;
    if (known)
    {
      to = std::move(*known);
      tracker.assemble(study.parameters_at({value}));
      certain = continue_branches(from, to);
    }
    else
    {
      const bool is_value = n_halvings == 0;
      certain = solve(value, &from, to, scope, is_value && (is_state_old() || wants_bars(value)));
      if (is_value && estimator && !tracker.is_whole(to.modes) && are_effects_of_another_contact())
        certain = solve(value, &from, to, scope, true);
    }
    if (!certain && n_halvings < max_halvings && is_allowed((from.value + value) / 2))
    {
      const BranchPoint middle =
          advance(from, (from.value + value) / 2, Scope::disc, n_halvings + 1);
      if (!tracker.is_whole(to.modes))
        return advance(middle, value, scope, n_halvings + 1);
      const std::vector<unsigned int> straight = to.branches;
      to = advance(middle, value, scope, n_halvings + 1, std::move(to));
      // The way by the middle leads through the disc only.
      for (unsigned int j = 0; j < straight.size(); ++j)
        if (grows_beyond_disc(to.modes.lambda[j]) && straight[j] < from.n_branches &&
            index_of(to, straight[j]) < 0)
          to.branches[j] = straight[j];
      return to;
    }
    if (!certain)
      log.line(
          "  Branches between " + number(from.value) + " and " + number(value) +
          " meet or come too close to be told apart by their vectors: continued by the nearest "
          "eigenvalues.");
    // The search for critical values compares modes, too.
    const std::vector<Complex> of_step = transition;
    if (wants_critical_values)
      find_critical_values(from, to);
    pass(to, of_step, from.modes.size());
    return to;
  }

  bool Sweep::wants_bars(const double value) const
  {
    constexpr std::size_t many = 10;
    return estimator && (value == values.back() ||
                         (values.size() >= many && value == values[values.size() / 2]));
  }

  BranchPoint Sweep::advance_on_new_mesh(const BranchPoint &from, const double value)
  {
    BranchPoint to;
    make_mesh(value);
    solve(value, nullptr, to, Scope::window);
    const RowRange &old_rows = from.modes.right.row_range(), &new_rows = to.modes.right.row_range();
    int same = old_rows.begin == new_rows.begin && old_rows.end == new_rows.end &&
               old_rows.size == new_rows.size;
    MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, study.comm);
    const bool certain = same && continue_branches(from, to);
    if (!same)
      continue_by_eigenvalues(from, to);
    if (!certain)
      log.line("  Branches between " + number(from.value) + " and " + number(value) +
               (same ? " are not told apart with certainty by their vectors."
                     : " are continued by the nearest eigenvalues: the mesh has " +
                           std::to_string(new_rows.size) + " unknowns instead of " +
                           std::to_string(old_rows.size) + "."));
    for (unsigned int i = 0; i < from.branches.size(); ++i)
      if (const int at = index_of(to, from.branches[i]); at >= 0)
      {
        const Complex a = from.modes.lambda[i], b = to.modes.lambda[at];
        if (!study.is_marginal(a) && !study.is_marginal(b) && a.real() * b.real() < 0)
          log.line("  The growth rate of branch " + std::to_string(number_of(from.branches[i])) +
                   " changes its sign between " + number(from.value) + " and " + number(value) +
                   ".");
      }
    stops.clear();
    pass(to, {}, 0);
    return to;
  }

  void Sweep::pass(const BranchPoint &point, std::vector<Complex> from_before,
                   const unsigned int n_before)
  {
    stops.push_back(
        {on_course(point.value, point.modes, point.branches, std::move(from_before), n_before),
         point.overlaps,
         {},
         {},
         false,
         std::move(located)});
    located.clear();
  }

  void Sweep::reach(const BranchPoint &point)
  {
    Stop &stop          = stops.back();
    stop.modes.branches = point.branches;
    stop.overlaps       = point.overlaps;
    stop.rows           = point.rows;
    stop.is_value       = true;
    stop.reduction_errors.clear();
    for (unsigned int j = 0; j < point.rows.size(); ++j)
      stop.reduction_errors.push_back(study.uncertainty(point.modes, j));
    if (!estimator)
      write_course({});
  }

  std::vector<ModesOnCourse> Sweep::course() const
  {
    std::vector<ModesOnCourse> result;
    for (const Stop &stop : stops)
      result.push_back(stop.modes);
    return result;
  }

  void Sweep::estimate_errors(const BranchPoint &point)
  {
    log.progress("  error bars at " + parameter + " = " + number(point.value, 6));
    ErrorEffects here = tracker.estimate_errors(estimator, study.parameters_at({point.value}),
                                                point.modes, point.reuse);
    write_course(stops.size() == 1 ? std::vector<KnownEffects>{all_known(here)}
                                   : effects_along(course(), *effects, here));
    keep_effects(std::move(here));
  }

  void Sweep::keep_effects(ErrorEffects found)
  {
    effects                  = std::move(found);
    n_constraints_of_effects = tracker.n_constraints();
  }

  bool Sweep::are_effects_of_another_contact() const
  {
    const unsigned int now = tracker.n_constraints(), before = n_constraints_of_effects;
    constexpr double much = 0.03;
    return std::max(now, before) - std::min(now, before) > much * before;
  }

  void Sweep::write_course(const std::vector<KnownEffects> &known)
  {
    for (unsigned int s = 0; s < stops.size(); ++s)
    {
      for (const Critical &critical : stops[s].critical)
        write(critical, known.empty() ? std::nullopt : bar_of(critical, s, known));
      if (!known.empty() && stops[s].is_value)
        set_bars(stops[s].rows, known[s], stops[s].modes.lambda, stops[s].modes.parity,
                 study.options.tolerance);
      if (stops[s].is_value)
        write(stops[s]);
    }
    // The last one begins what follows.
    stops.erase(stops.begin(), stops.end() - 1);
    stops.front().is_value = false;
    stops.front().critical.clear();
  }

  void Sweep::write(const Stop &stop)
  {
    const std::vector<ModeRow> &rows = stop.rows;
    for (unsigned int j = 0; j < rows.size(); ++j)
      sweep_csv->add(sweep_fields(stop.modes.value, stop.modes.branches[j], rows[j],
                                  stop.overlaps[j], stop.reduction_errors[j]));
    const GrowthSummary summary(rows);
    log.line(
        formatted("  %14.6g   %5zu   %8u   ", stop.modes.value, rows.size(), summary.n_unstable) +
        (estimator ? formatted("%9u   ", summary.n_undecided) : "") +
        (summary.worst ? number(summary.worst->growth_rate()) + " at " +
                             number(summary.worst->frequency()) + " Hz"
                       : "-"));
  }

  std::optional<CriticalBar> Sweep::bar_of(const Critical &critical, const unsigned int stop,
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

  void Sweep::tell_progress(const unsigned int k, const unsigned int n_before)
  {
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const unsigned int n_done = k - n_before;
    std::string text = "  value " + std::to_string(k + 1) + " of " + std::to_string(values.size());
    if (n_done > 0)
      text += formatted(", about %.0f s to go", seconds / n_done * (values.size() - k));
    log.progress(text);
  }

  void Sweep::settle(BranchPoint &point)
  {
    if (!tracker.is_whole(point.modes))
    {
      if (tracker.is_crowded())
        point.modes = tracker.restart(point.modes);
      return;
    }
    if (keeps_mesh)
      tracker.set_expansion_point(study.parameters_at({point.value}), point.reuse);
    if (estimator)
      estimate_errors(point);
    point.reuse = {}; // the factors are the model's now
    // The terms that are known to vary are projected apart, also in a run that resumes here.
    const std::vector<double> varying_terms = tracker.varying_terms();
    tracker.keep_apart(varying_terms);
    std::vector<double> state = {point.value, double(point.n_branches),
                                 double(varying_terms.size())};
    state.insert(state.end(), varying_terms.begin(), varying_terms.end());
    for (unsigned int j = 0; j < point.branches.size(); ++j)
      state.insert(state.end(), {double(point.branches[j]), point.overlaps[j]});
    study.save(state);
    last_saved = std::chrono::steady_clock::now();
  }

  bool Sweep::is_state_old() const
  {
    constexpr std::chrono::minutes longest(15);
    int is_old = std::chrono::steady_clock::now() - last_saved > longest;
    MPI_Bcast(&is_old, 1, MPI_INT, 0, study.comm);
    return is_old;
  }

  bool Sweep::resume(BranchPoint &last, unsigned int &n_done)
  {
    const std::optional<std::vector<double>> state = study.resume();
    if (!state)
      return false;
    BranchPoint point;
    const auto is_number = [](const double x) { return x >= 0 && x < 1e9 && x == std::floor(x); };
    const auto fail      = [&](const std::string &reason)
    {
      log.line("The sweep that was interrupted is not resumed, it begins anew: " + reason);
      return false;
    };
    if (state->size() < 3 || !is_number((*state)[1]) || !is_number((*state)[2]) ||
        (*state)[2] > state->size() - 3 ||
        std::count(values.begin(), values.end(), state->front()) == 0)
      return fail("sweep.state is not of this sweep.");
    const unsigned int n_varying = (*state)[2], first_branch = 3 + n_varying;
    const std::vector<double> varying_terms(state->begin() + 3, state->begin() + first_branch);
    point.value      = (*state)[0];
    point.n_branches = (*state)[1];
    for (unsigned int k = first_branch; k + 1 < state->size(); k += 2)
    {
      if (!is_number((*state)[k]))
        return fail("sweep.state is not of this sweep.");
      point.branches.push_back((*state)[k]);
      point.overlaps.push_back((*state)[k + 1]);
    }
    if (!keeps_mesh)
      make_mesh(point.value);
    EigenSolution found = tracker.solve_fully(study.parameters_at({point.value}), Scope::window);
    point.modes         = std::move(found.modes);
    point.rows          = tracker.analyse(point.modes);
    if (point.modes.lambda.size() != point.branches.size())
      return fail("at " + parameter + " = " + number(point.value) + " there are " +
                  std::to_string(point.modes.lambda.size()) + " modes, there were " +
                  std::to_string(point.branches.size()) + ".");
    pass(point, {}, 0);
    if (keeps_mesh)
      tracker.set_expansion_point(study.parameters_at({point.value}), found.reuse);
    if (estimator)
      keep_effects(tracker.estimate_errors(estimator, study.parameters_at({point.value}),
                                           point.modes, found.reuse));
    if (keeps_mesh)
      tracker.keep_apart(varying_terms);
    n_done = std::find(values.begin(), values.end(), point.value) - values.begin() + 1;
    last   = std::move(point);
    log.line("Resumed after " + std::to_string(n_done) + " of " + std::to_string(values.size()) +
             " values: " + parameter + " = " + number(last.value) + ".");
    return true;
  }

  void Sweep::run()
  {
    BranchPoint last;
    unsigned int n_done = 0;
    const bool resumed  = resume(last, n_done);
    sweep_csv           = std::make_unique<Table>(study.directory + "/sweep.csv",
                                        sweep_fields(0, 0, {}, 0, 0), study.comm, resumed);
    if (wants_critical_values && !keeps_mesh)
      log.line("\nCritical values are not located: " + parameter +
               " changes the mesh. The log says between which values a growth rate changes its "
               "sign.");
    if (wants_critical_values && keeps_mesh)
      critical_csv = std::make_unique<Table>(study.directory + "/critical.csv",
                                             critical_fields({}, {}), study.comm, resumed);
    log.line("\nSweep over " + parameter + "\n           value   modes   unstable   " +
             (estimator ? "undecided   " : "") + "largest growth rate, 1/s");
    try
    {
      walk(last, n_done);
    }
    catch (const SolverError &)
    {
      // What was found is written, without the bars that are not known.
      if (!stops.empty())
        write_course({});
      throw;
    }
    log.line("  " + std::to_string(tracker.n_full_solutions()) + " full solutions for " +
             std::to_string(values.size() - n_done) + " values" +
             (critical_csv ? " and the critical ones" : "") + "; bases were restarted " +
             std::to_string(tracker.n_restarts()) + " times.");
    const ModeTracker::Seconds &seconds = tracker.seconds();
    log.line(formatted("  Processor seconds: contact and static states %.1f, counting %.1f, "
                       "projection %.1f, full solutions %.1f",
                       seconds.assembly, seconds.counting, seconds.projection, seconds.full) +
             (estimator ? formatted(", error bars %.1f.", seconds.bars) : "."));
    study.finish();
  }

  void Sweep::walk(BranchPoint &last, const unsigned int n_done)
  {
    for (unsigned int k = n_done; k < values.size(); ++k)
    {
      tell_progress(k, n_done);
      if (k == 0)
      {
        if (!keeps_mesh)
          make_mesh(values[0]);
        solve(values[0], nullptr, last, Scope::window);
        last.n_branches = last.modes.lambda.size();
        for (unsigned int j = 0; j < last.n_branches; ++j)
          last.branches.push_back(j);
        last.overlaps.assign(last.n_branches, 0.);
        if (critical_csv && values.size() > 1)
          find_critical_values_at(last, nullptr, values[1] - values[0]);
        pass(last, {}, 0);
      }
      else
      {
        BranchPoint next = advance(last, values[k], Scope::window);
        last             = std::move(next);
      }
      reach(last);
      settle(last);
    }
  }

  Fields Sweep::critical_fields(const Critical &critical,
                                const std::optional<CriticalBar> &bar) const
  {
    const auto of_bar = [&](const double x) { return bar ? number(x, 15) : ""; };
    return {{"kind", critical.kind},
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
            {"corrected_value", of_bar(critical.value + (bar ? bar->correction : 0))}};
  }

  void Sweep::report(Critical critical)
  {
    located.push_back(std::move(critical));
  }

  void Sweep::write(const Critical &critical, const std::optional<CriticalBar> &bar)
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
               number(critical.value + bar->correction, 4) + ")";
    }
    log.line(
        "  Critical: " + critical.kind + " of branch " +
        std::to_string(number_of(critical.branch)) +
        (critical.other < 0 ? "" : " with branch " + std::to_string(number_of(critical.other))) +
        " at " + parameter + " = " + value + ", " +
        number(std::abs(critical.lambda.imag()) / (2 * M_PI)) + " Hz");
  }

  void Sweep::keep_modes(const BranchPoint &from, const ParameterStudy::Evaluation &at,
                         const double value, Critical &critical)
  {
    if (!estimator)
      return;
    std::vector<Complex> to_here = tracker.transition(from.modes, at.modes);
    BranchPoint here;
    here.modes = at.modes;
    squeal::continue_branches(to_here, from, study.options.max_imaginary, here);
    critical.modes =
        on_course(value, at.modes, here.branches, std::move(to_here), from.modes.size());
    critical.mode          = at.numbers[0];
    CriticalModes &between = critical.between;
    between.mode           = index_of(from, critical.branch);
    if (critical.other >= 0)
      between.other = index_of(from, critical.other);
    between.lambda = critical.lambda;
  }

  void Sweep::find_critical_values(const BranchPoint &from, const BranchPoint &to)
  {
    find_critical_values_at(to, &from, to.value - from.value);
    find_divergence(from, to);
    // A pair whose mean and difference squared are real (up to the common factor of the motion)
    // meets where the squared difference changes its sign.
    const auto squared_half_difference = [](const Complex a, const Complex b)
    { return (a - b) * (a - b) / 4.; };

    for (unsigned int i = 0; i < from.branches.size(); ++i)
    {
      const int at = index_of(to, from.branches[i]);
      if (at < 0)
        continue;
      const Complex a = from.modes.lambda[i], b = to.modes.lambda[at];
      if (grows_beyond_disc(a) || grows_beyond_disc(b)) // steps in between would not see it
        continue;
      // A mode that has become real by passing zero is a divergence.
      const bool became_real =
          (a.imag() == 0) != (b.imag() == 0) &&
          (divergent_in_disc(from).size() + divergent_in_disc(to).size()) % 2 == 1;
      if (!study.is_marginal(a) && !study.is_marginal(b) && a.real() * b.real() < 0 && !became_real)
        report(onset(from, to, from.branches[i]));
      for (unsigned int k = i + 1; k < from.branches.size(); ++k)
      {
        const int at_k = index_of(to, from.branches[k]);
        if (at_k < 0)
          continue;
        if (grows_beyond_disc(from.modes.lambda[k]) || grows_beyond_disc(to.modes.lambda[at_k]))
          continue;
        const Complex before = squared_half_difference(a, from.modes.lambda[k]),
                      after  = squared_half_difference(b, to.modes.lambda[at_k]);
        const auto is_real   = [](const Complex x)
        { return std::abs(x.imag()) <= 1e-3 * std::abs(x); };
        if (is_real(before) && is_real(after) && before.real() * after.real() < 0)
          report(coalescence(from, to, from.branches[i], from.branches[k]));
      }
    }
  }

  void Sweep::find_critical_values_at(const BranchPoint &point, const BranchPoint *before,
                                      const double direction)
  {
    if (std::none_of(point.modes.lambda.begin(), point.modes.lambda.end(),
                     [&](const Complex l) { return study.is_marginal(l); }))
      return;
    const std::vector<Complex> slopes = tracker.sensitivities(parameter, point.modes);
    for (unsigned int j = 0; j < slopes.size(); ++j)
    {
      const Complex lambda = point.modes.lambda[j], slope = slopes[j];
      // A mode that stays marginal has a slope along the imaginary axis, up to rounding; at a
      // double root it has none.
      if (!study.is_marginal(lambda) || !std::isfinite(std::abs(slope)) ||
          std::abs(slope.real()) <= 1e-4 * std::abs(slope) ||
          std::abs(slope.real() * direction) <= 100 * study.options.tolerance * std::abs(lambda))
        continue;
      const int at = before ? index_of(*before, point.branches[j]) : -1;
      // It comes from the other side, or is only touching the axis.
      if (at >= 0 && before->modes.lambda[at].real() * slope.real() * direction > 0)
        continue;
      Critical result;
      result.kind         = slope.real() * direction > 0 ? "onset" : "end";
      result.branch       = point.branches[j];
      const double step   = -lambda.real() / slope.real();
      result.value        = point.value + step;
      result.lambda       = lambda + slope * step;
      result.search_error = std::abs(step);
      result.mode         = j;
      result.slope        = slope.real();
      result.is_at_end    = true;
      report(result);
    }
  }

  void Sweep::find_divergence(const BranchPoint &from, const BranchPoint &to)
  {
    const std::vector<unsigned int> before = divergent_in_disc(from), after = divergent_in_disc(to);
    // Two at a time are born by a pair of growing modes that becomes real, or leave like that.
    if ((before.size() + after.size()) % 2 == 0)
      return;
    const BranchPoint &divergent = after.size() > before.size() ? to : from;
    const unsigned int mode      = after.size() > before.size() ? after.front() : before.front();
    const StaticInstability instability = study.instability_of({divergent.value}, divergent.modes);
    const auto evaluate                 = [&](const double value)
    {
      const auto at = study.evaluate(instability, {value});
      return std::make_pair(at.value, at.derivatives.front());
    };
    const std::optional<Root> root = find_root(from.value, to.value, evaluate);
    if (!root)
    {
      log.line("  A mode begins or ends to grow without oscillation between " + number(from.value) +
               " and " + number(to.value) + ", but the stiffness is not singular there.");
      return;
    }
    Critical result;
    result.kind           = after.size() > before.size() ? "divergence" : "divergence_end";
    result.branch         = divergent.branches[mode];
    result.value          = root->value;
    result.search_error   = root->accuracy;
    result.iterations     = root->iterations;
    constexpr double near = 0.02, at_end = 1; // shares of the way
    if (estimator && !find_effects(divergent.value, divergent.modes.lambda[mode], near, result))
      find_effects(divergent.value, divergent.modes.lambda[mode], at_end, result);
    report(result);
  }

  /// Of l^2, which is smooth at a divergence, effect and derivative are in the same ratio: near the
  /// root, for l^2 bends, but where the two solutions +-l are told apart and known.
  bool Sweep::find_effects(const double value, const Complex lambda, const double share,
                           Critical &divergence)
  {
    const double beside    = divergence.value + share * (value - divergence.value);
    const Complex expected = std::sqrt(share) * lambda;
    ParameterStudy::Evaluation at;
    try
    {
      at = study.evaluate({beside}, {expected});
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
        all_known(tracker.estimate_errors(estimator, study.parameters_at({beside}), at.modes, {}));
    return true;
  }

  Sweep::Critical Sweep::onset(const BranchPoint &from, const BranchPoint &to,
                               const unsigned int branch)
  {
    const Complex first = from.modes.lambda[index_of(from, branch)],
                  last  = to.modes.lambda[index_of(to, branch)];
    EigenvaluePredictor predictor(from.value, first, to.value, last);
    ParameterStudy::Evaluation at;
    const auto growth_rate = [&](const double p)
    {
      at                  = study.evaluate({p}, {predictor(p)});
      const Complex slope = at.derivatives[0].empty() ? std::nan("") : at.derivatives[0][0];
      predictor.add({p, at.lambda[0], slope, at.uncertainty});
      return std::make_pair(at.lambda[0].real(), slope.real());
    };
    const Root root = find_root(from.value, first.real(), to.value, last.real(), growth_rate);
    // What the estimated error of the eigenvalue itself moves the value by
    const EigenvaluePredictor::Known &at_root = predictor.last();
    const double slope                        = std::abs(at_root.slope.real());
    Critical result;
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

  Sweep::Critical Sweep::coalescence(const BranchPoint &from, const BranchPoint &to,
                                     const unsigned int branch, const unsigned int other)
  {
    const auto pair = [&](const BranchPoint &point)
    {
      return std::vector<Complex>{point.modes.lambda[index_of(point, branch)],
                                  point.modes.lambda[index_of(point, other)]};
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
    ParameterStudy::Evaluation at;
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
      at                 = study.evaluate({p}, {mean + half, mean - half});
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
    Critical result;
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
} // namespace squeal
