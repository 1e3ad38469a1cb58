#include <squeal/continuation/sweep.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    const std::vector<std::string> tables = {"sweep.csv", "critical.csv"};

    /// The mode of a branch at a point, or -1.
    int index_of(const BranchPoint &point, const unsigned int branch)
    {
      const auto at = std::find(point.branches.begin(), point.branches.end(), branch);
      return at == point.branches.end() ? -1 : int(at - point.branches.begin());
    }
  } // namespace

  Sweep::Sweep(ParameterFile &file, Model &model, const ModelFactory &make_model,
               const EigensolverOptions &options, const std::string &directory, const MPI_Comm comm,
               Log &log)
      : file(file), make_model(make_model), parameter(file.parameters().sweep.parameter),
        keeps_mesh(Parameters::Sweep::keeps_mesh(parameter)), options(options),
        directory(directory), comm(comm), log(log),
        follower(options, file.parameters().eigenproblem.solver)
  {
    follower.set_model(model);
    file.value_of(parameter);
    const std::vector<std::string> sections = {"Rotor/", "Pads/", "Strip/", "Mesh/",
                                               "Discretization/"};
    const bool makes_mesh = make_model && std::any_of(sections.begin(), sections.end(),
                                                      [&](const std::string &section)
                                                      { return parameter.rfind(section, 0) == 0; });
    if (!keeps_mesh && !makes_mesh)
      throw InputError(
          "Sweep/Parameter = " + parameter +
          ": the equations of motion do not depend on it. Allowed are numbers of the sections "
          "Operation, Contact, Rotor, Pads, Strip, Mesh, Discretization, and of Matrices in the "
          "scene matrices.");
  }

  const Parameters::All &Sweep::parameters_at(const double value)
  {
    file.vary(parameter, value);
    return file.parameters();
  }

  void Sweep::make_mesh(const double value)
  {
    own_model.reset(); // two meshes at a time would double the memory
    own_model = make_model(parameters_at(value));
    follower.set_model(*own_model);
  }

  bool Sweep::solve(const double value, const BranchPoint *before, BranchPoint &point,
                    const bool fully)
  {
    point.value = value;
    point.modes =
        fully ? follower.solve_fully(parameters_at(value)) : follower.solve(parameters_at(value));
    point.rows   = follower.analyse(point.modes);
    bool certain = true;
    if (before)
      certain = follower.continue_branches(*before, point);
    return certain;
  }

  BranchPoint Sweep::advance(const BranchPoint &from, const double value,
                             const unsigned int n_halvings)
  {
    if (!keeps_mesh)
      return advance_on_new_mesh(from, value);
    BranchPoint to;
    const bool certain = solve(value, &from, to, n_halvings == 0 && is_state_old());
    if (!certain && n_halvings < max_halvings)
    {
      const BranchPoint middle = advance(from, (from.value + value) / 2, n_halvings + 1);
      return advance(middle, value, n_halvings + 1);
    }
    if (!certain)
      log.line(
          "  Branches between " + number(from.value) + " and " + number(value) +
          " meet or come too close to be told apart by their vectors: continued by the nearest "
          "eigenvalues.");
    if (file.parameters().sweep.critical_values)
      find_critical_values(from, to);
    return to;
  }

  BranchPoint Sweep::advance_on_new_mesh(const BranchPoint &from, const double value)
  {
    BranchPoint to;
    make_mesh(value);
    solve(value, nullptr, to);
    const RowRange &old_rows = from.modes.re.row_range(), &new_rows = to.modes.re.row_range();
    int same = old_rows.begin == new_rows.begin && old_rows.end == new_rows.end &&
               old_rows.size == new_rows.size;
    MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, comm);
    const bool certain = same && follower.continue_branches(from, to);
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
        if (!is_marginal(a) && !is_marginal(b) && a.real() * b.real() < 0)
          log.line("  The growth rate of branch " + std::to_string(from.branches[i]) +
                   " changes its sign between " + number(from.value) + " and " + number(value) +
                   ".");
      }
    return to;
  }

  void Sweep::write(const BranchPoint &point)
  {
    const std::vector<ModeRow> &rows = point.rows;
    unsigned int n_unstable          = 0;
    for (unsigned int j = 0; j < rows.size(); ++j)
    {
      std::vector<std::string> fields = {number(point.value), std::to_string(point.branches[j])};
      const auto of_mode              = modes_fields(rows[j]);
      fields.insert(fields.end(), of_mode.begin(), of_mode.end());
      fields.push_back(point.overlaps[j] > 0 ? number(point.overlaps[j]) : "");
      sweep_csv->add(fields);
      n_unstable += rows[j].verdict == "flutter" || rows[j].verdict == "divergence";
    }
    const auto worst = std::max_element(rows.begin(), rows.end(),
                                        [](const ModeRow &a, const ModeRow &b)
                                        { return a.growth_rate() < b.growth_rate(); });
    char text[160];
    std::snprintf(
        text, sizeof(text), "  %14.6g   %5zu   %8u   %s", point.value, rows.size(), n_unstable,
        worst == rows.end()
            ? "-"
            : (number(worst->growth_rate()) + " at " + number(worst->frequency()) + " Hz").c_str());
    log.line(text);
  }

  void Sweep::settle(BranchPoint &point)
  {
    if (!follower.is_whole(point.modes))
    {
      if (follower.is_crowded())
        point.modes = follower.restart(point.modes);
      return;
    }
    if (keeps_mesh)
      follower.anchor(parameters_at(point.value), point.modes);
    MPI_Barrier(comm);
    std::vector<double> state = {point.value, double(point.n_branches)};
    for (const std::uintmax_t size : file_sizes(directory, tables))
      state.push_back(size);
    for (unsigned int j = 0; j < point.branches.size(); ++j)
      state.insert(state.end(), {double(point.branches[j]), point.overlaps[j]});
    int rank = 0;
    MPI_Comm_rank(comm, &rank);
    if (rank == 0)
      save_numbers(state_file(), state);
    last_saved = std::chrono::steady_clock::now();
    MPI_Barrier(comm);
  }

  bool Sweep::is_state_old() const
  {
    constexpr std::chrono::minutes longest(15);
    int is_old = std::chrono::steady_clock::now() - last_saved > longest;
    MPI_Bcast(&is_old, 1, MPI_INT, 0, comm);
    return is_old;
  }

  bool Sweep::resume(BranchPoint &last, unsigned int &n_done)
  {
    const std::vector<double> points               = file.parameters().sweep.points();
    const std::optional<std::vector<double>> state = load_numbers(state_file());
    const unsigned int n_head                      = 2 + tables.size();
    int good                                       = state && state->size() >= n_head &&
               std::count(points.begin(), points.end(), state->front()) > 0;
    MPI_Allreduce(MPI_IN_PLACE, &good, 1, MPI_INT, MPI_MIN, comm);
    if (!good)
      return false;
    last.value      = (*state)[0];
    last.n_branches = (*state)[1];
    for (unsigned int k = n_head; k + 1 < state->size(); k += 2)
    {
      last.branches.push_back((*state)[k]);
      last.overlaps.push_back((*state)[k + 1]);
    }
    if (!keeps_mesh)
      make_mesh(last.value);
    last.modes = follower.solve_fully(parameters_at(last.value));
    last.rows  = follower.analyse(last.modes);
    if (last.modes.lambda.size() != last.branches.size())
      return false; // of another problem
    if (keeps_mesh)
      follower.anchor(parameters_at(last.value), last.modes);
    n_done = std::find(points.begin(), points.end(), last.value) - points.begin() + 1;
    cut_files(directory, tables, {state->begin() + 2, state->begin() + n_head}, comm);
    log.line("Resumed after " + std::to_string(n_done) + " of " + std::to_string(points.size()) +
             " values: " + parameter + " = " + number(last.value) + ".");
    return true;
  }

  void Sweep::run()
  {
    const std::vector<double> points = file.parameters().sweep.points();
    const double original            = file.value_of(parameter);
    BranchPoint last;
    unsigned int n_done = 0;
    const bool resumed  = resume(last, n_done);
    sweep_csv           = std::make_unique<Table>(
        directory + "/sweep.csv", std::string("parameter,branch,") + modes_header + ",overlap",
        comm, resumed);
    const bool critical_values = file.parameters().sweep.critical_values;
    if (critical_values && !keeps_mesh)
      log.line("\nCritical values are not located: " + parameter +
               " changes the mesh. The log says between which values a growth rate changes its "
               "sign.");
    if (critical_values && keeps_mesh)
      critical_csv = std::make_unique<Table>(
          directory + "/critical.csv",
          "kind,parameter,value,accuracy,frequency_hz,growth_rate_1_per_s,branch,other_branch,"
          "iterations",
          comm, resumed);
    log.line("\nSweep over " + parameter +
             "\n           value   modes   unstable   largest growth "
             "rate, 1/s");
    for (unsigned int k = n_done; k < points.size(); ++k)
    {
      if (k == 0)
      {
        if (!keeps_mesh)
          make_mesh(points[0]);
        solve(points[0], nullptr, last);
        last.n_branches = last.modes.lambda.size();
        for (unsigned int j = 0; j < last.n_branches; ++j)
          last.branches.push_back(j);
        last.overlaps.assign(last.n_branches, 0.);
        if (critical_csv && points.size() > 1)
          find_critical_values_at(last, nullptr, points[1] - points[0]);
      }
      else
      {
        BranchPoint next = advance(last, points[k], 0);
        last             = std::move(next);
      }
      write(last);
      settle(last);
    }
    log.line("  " + std::to_string(follower.n_full_solutions()) + " full solutions for " +
             std::to_string(points.size() - n_done) + " values" +
             (critical_csv ? " and the critical ones" : "") + "; bases were restarted " +
             std::to_string(follower.n_restarts()) + " times.");
    const ModeTracker::Seconds &seconds = follower.seconds();
    char text[160];
    std::snprintf(text, sizeof(text),
                  "  Processor seconds: contact and static states %.1f, counting %.1f, projection "
                  "%.1f, full solutions %.1f.",
                  seconds.assembly, seconds.counting, seconds.projection, seconds.full);
    log.line(text);
    file.vary(parameter, original);
    MPI_Barrier(comm);
    std::error_code ignored;
    std::filesystem::remove(state_file(), ignored);
  }

  Sweep::Evaluation Sweep::evaluate(const double value, const std::vector<Complex> &expected)
  {
    const Modes modes = follower.solve(parameters_at(value));
    Evaluation result;
    const std::vector<unsigned int> chosen = nearest_partners(expected, modes.lambda);
    if (chosen.size() < expected.size())
      throw SolverError("A mode was lost in the search for a critical value of " + parameter + ".");
    const std::vector<Complex> derivatives = follower.sensitivities(parameter, modes);
    for (const unsigned int j : chosen)
    {
      result.lambda.push_back(modes.lambda[j]);
      result.uncertainty +=
          modes.condition[j] * modes.backward_error[j] * std::abs(modes.lambda[j]);
      result.derivative.push_back(derivatives.empty() ? Complex(std::nan(""), 0) : derivatives[j]);
    }
    return result;
  }

  void Sweep::report(const Critical &critical)
  {
    critical_csv->add(
        {critical.kind, parameter, number(critical.value, 15), number(critical.accuracy),
         number(std::abs(critical.lambda.imag()) / (2 * M_PI)), number(critical.lambda.real()),
         std::to_string(critical.branch), critical.other < 0 ? "" : std::to_string(critical.other),
         std::to_string(critical.iterations)});
    log.line("  Critical: " + critical.kind + " of branch " + std::to_string(critical.branch) +
             (critical.other < 0 ? "" : " with branch " + std::to_string(critical.other)) + " at " +
             parameter + " = " + number(critical.value) + " (+- " + number(critical.accuracy) +
             "), " + number(std::abs(critical.lambda.imag()) / (2 * M_PI)) + " Hz");
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
      // A mode that has become real by passing zero is a divergence.
      const bool became_real =
          (a.imag() == 0) != (b.imag() == 0) &&
          (divergent_modes(from.modes).size() + divergent_modes(to.modes).size()) % 2 == 1;
      if (!is_marginal(a) && !is_marginal(b) && a.real() * b.real() < 0 && !became_real)
        report(onset(from, to, from.branches[i]));
      for (unsigned int k = i + 1; k < from.branches.size(); ++k)
      {
        const int at_k = index_of(to, from.branches[k]);
        if (at_k < 0)
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
                     [&](const Complex l) { return is_marginal(l); }))
      return;
    const std::vector<Complex> slopes = follower.sensitivities(parameter, point.modes);
    for (unsigned int j = 0; j < slopes.size(); ++j)
    {
      const Complex lambda = point.modes.lambda[j], slope = slopes[j];
      // A mode that stays marginal has a slope along the imaginary axis, up to rounding; at a
      // double root it has none.
      if (!is_marginal(lambda) || !std::isfinite(std::abs(slope)) ||
          std::abs(slope.real()) <= 1e-4 * std::abs(slope) ||
          std::abs(slope.real() * direction) <= 100 * options.tolerance * std::abs(lambda))
        continue;
      const int at = before ? index_of(*before, point.branches[j]) : -1;
      // It comes from the other side, or is only touching the axis.
      if (at >= 0 && before->modes.lambda[at].real() * slope.real() * direction > 0)
        continue;
      Critical result;
      result.kind       = slope.real() * direction > 0 ? "onset" : "end";
      result.branch     = point.branches[j];
      const double step = -lambda.real() / slope.real();
      result.value      = point.value + step;
      result.lambda     = lambda + slope * step;
      result.accuracy   = std::abs(step);
      report(result);
    }
  }

  void Sweep::find_divergence(const BranchPoint &from, const BranchPoint &to)
  {
    const std::vector<unsigned int> before = divergent_modes(from.modes),
                                    after  = divergent_modes(to.modes);
    // Two at a time are born by a pair of growing modes that becomes real, or leave like that.
    if ((before.size() + after.size()) % 2 == 0)
      return;
    const BranchPoint &divergent = after.size() > before.size() ? to : from;
    const unsigned int mode      = after.size() > before.size() ? after.front() : before.front();
    const StaticInstability instability(follower.assemble(parameters_at(divergent.value)),
                                        follower.whole(divergent.modes), mode);
    const auto evaluate = [&](const double value)
    {
      const QuadraticEigenproblem &problem = follower.assemble(parameters_at(value));
      const auto at = instability.evaluate(problem, follower.derivatives(parameter));
      return std::make_pair(at.value,
                            at.derivatives.empty() ? std::nan("") : at.derivatives.front());
    };
    const std::optional<Root> root = find_root(from.value, to.value, evaluate);
    if (!root)
    {
      log.line("  A mode begins or ends to grow without oscillation between " + number(from.value) +
               " and " + number(to.value) + ", but the stiffness is not singular there.");
      return;
    }
    Critical result;
    result.kind       = after.size() > before.size() ? "divergence" : "divergence_end";
    result.branch     = divergent.branches[mode];
    result.value      = root->value;
    result.accuracy   = root->accuracy;
    result.iterations = root->iterations;
    report(result);
  }

  Sweep::Critical Sweep::onset(const BranchPoint &from, const BranchPoint &to,
                               const unsigned int branch)
  {
    struct Known
    {
      double value;
      Complex lambda, derivative;
      double uncertainty; ///< of lambda
    };
    const Complex first      = from.modes.lambda[index_of(from, branch)],
                  last       = to.modes.lambda[index_of(to, branch)],
                  chord      = (last - first) / (to.value - from.value);
    std::vector<Known> known = {{from.value, first, chord, 0}, {to.value, last, chord, 0}};
    const auto function      = [&](const double p)
    {
      const auto nearest = std::min_element(known.begin(), known.end(),
                                            [&](const Known &a, const Known &b) {
                                              return std::abs(a.value - p) < std::abs(b.value - p);
                                            });
      const Evaluation at =
          evaluate(p, {nearest->lambda + nearest->derivative * (p - nearest->value)});
      known.push_back({p, at.lambda[0],
                       std::isfinite(at.derivative[0].real()) ? at.derivative[0] : chord,
                       at.uncertainty});
      return std::make_pair(at.lambda[0].real(), at.derivative[0].real());
    };
    const Root root = find_root(from.value, first.real(), to.value, last.real(), function);
    Critical result;
    result.kind   = first.real() < 0 ? "onset" : "end";
    result.branch = branch;
    result.value  = root.value;
    // That of the search, and what the estimated error of the eigenvalue itself moves it by.
    const Known &at_root  = known.back();
    const double slope    = std::abs(at_root.derivative.real());
    const double of_value = slope > 0 ? at_root.uncertainty / slope : 0;
    result.accuracy       = root.accuracy + of_value;
    result.iterations     = root.iterations;
    result.lambda         = known.back().lambda;
    return result;
  }

  Sweep::Critical Sweep::coalescence(const BranchPoint &from, const BranchPoint &to,
                                     const unsigned int branch, const unsigned int other)
  {
    const auto pair = [&](const BranchPoint &point)
    {
      std::vector<Complex> lambda;
      for (const unsigned int b : {branch, other})
        lambda.push_back(
            point.modes.lambda[std::find(point.branches.begin(), point.branches.end(), b) -
                               point.branches.begin()]);
      return lambda;
    };
    const auto discriminant = [](const std::vector<Complex> &l)
    { return ((l[0] - l[1]) * (l[0] - l[1]) / 4.).real(); };
    Critical result;
    result.kind   = "coalescence";
    result.branch = branch;
    result.other  = other;
    double low = from.value, high = to.value;
    const std::vector<Complex> low_pair = pair(from), high_pair = pair(to);
    double low_d = discriminant(low_pair), high_d = discriminant(high_pair);
    double p = low - low_d * (high - low) / (high_d - low_d);
    for (result.iterations = 1; result.iterations <= 30; ++result.iterations)
    {
      const double share = (p - from.value) / (to.value - from.value);
      const Complex mean = (low_pair[0] + low_pair[1]) / 2. * (1 - share) +
                           (high_pair[0] + high_pair[1]) / 2. * share;
      const double d           = low_d + (high_d - low_d) * (p - low) / (high - low);
      const Complex half       = std::sqrt(Complex(d));
      const Evaluation at      = evaluate(p, {mean + half, mean - half});
      const Complex difference = at.lambda[0] - at.lambda[1],
                    change     = at.derivative[0] - at.derivative[1];
      const double value = discriminant(at.lambda), slope = (difference * change / 2.).real();
      if (value * low_d > 0)
      {
        low   = p;
        low_d = value;
      }
      else
      {
        high   = p;
        high_d = value;
      }
      double next   = std::isfinite(slope) && slope != 0
                          ? p - value / slope
                          : low - low_d * (high - low) / (high_d - low_d);
      result.lambda = (at.lambda[0] + at.lambda[1]) / 2. +
                      (at.derivative[0] + at.derivative[1]) / 2. * (next - p);
      const double step = std::abs(next - p), range = std::abs(to.value - from.value);
      // The discriminant is smooth: the error of the last step is of the order of its square.
      // Nearer to the double root the eigenvalues themselves lose half of their digits, so this is
      // where to stop.
      const bool near = std::abs(difference) <= 2e-3 * std::abs(at.lambda[0]);
      // The eigenvalues' own errors move the discriminant by |l_1 - l_2| / 2 times their sum.
      const double of_eigenvalues =
          std::isfinite(slope) && slope != 0
              ? std::abs(difference) / 2 * at.uncertainty / std::abs(slope)
              : 0;
      result.accuracy = std::max(step * step / range, 1e-12 * std::abs(next)) + of_eigenvalues;
      const bool done = near && step * step <= 1e-9 * range * std::max(std::abs(p), range);
      if (!done && (next - low) * (next - high) > 0) // Newton left the interval
        next = (low + high) / 2;
      p = next;
      if (done)
        break;
    }
    result.value = p;
    return result;
  }
} // namespace squeal
