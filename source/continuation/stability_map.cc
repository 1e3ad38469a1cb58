#include <squeal/continuation/stability_map.h>
#include <squeal/continuation/sweep.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    const std::vector<std::string> tables = {"map.csv", "border.csv"};
  }

  StabilityMap::StabilityMap(ParameterFile &file, Model &model, const EigensolverOptions &options,
                             const std::string &directory, const MPI_Comm comm, Log &log)
      : file(file), parameters{{file.parameters().sweep.parameter,
                                file.parameters().sweep.second_parameter}},
        values{{file.parameters().sweep.points(), file.parameters().sweep.second_points()}},
        options(options), directory(directory), comm(comm), log(log),
        follower(options, file.parameters().eigenproblem.solver)
  {
    follower.set_model(model);
    for (unsigned int k = 0; k < 2; ++k)
    {
      file.value_of(parameters[k]);
      if (!Parameters::Sweep::keeps_mesh(parameters[k]))
        throw InputError((k == 0 ? "Sweep/Parameter = " : "Sweep/Second parameter = ") +
                         parameters[k] +
                         ": a stability map keeps the mesh. Allowed are numbers of the sections "
                         "Operation, Contact, Rotor/Material, Pads/Material, Matrices, and "
                         "Pads/Pressure.");
    }
  }

  // Positions.

  double StabilityMap::parameter_at(const unsigned int k, const double position) const
  {
    const std::vector<double> &v = values[k];
    const unsigned int i         = std::clamp(int(std::floor(position)), 0, int(v.size()) - 2);
    return position == i + 1. ? v[i + 1] : v[i] + (position - i) * (v[i + 1] - v[i]);
  }

  double StabilityMap::cell_size(const unsigned int k, const double position) const
  {
    const std::vector<double> &v = values[k];
    const unsigned int i         = std::clamp(int(std::floor(position)), 0, int(v.size()) - 2);
    return v[i + 1] - v[i];
  }

  StabilityMap::Position StabilityMap::position_of(const unsigned int point) const
  {
    const unsigned int n = values[0].size(), row = point / n, i = point % n;
    return {{double(row % 2 == 0 ? i : n - 1 - i), double(row)}};
  }

  namespace
  {
    double distance(const std::array<double, 2> &a, const std::array<double, 2> &b)
    {
      return std::hypot(a[0] - b[0], a[1] - b[1]);
    }

    std::array<double, 2> between(const std::array<double, 2> &a, const std::array<double, 2> &b,
                                  const double t)
    {
      return {{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])}};
    }

    /// The distance of a point from a piece of a curve.
    double distance(const std::array<double, 2> &x, const std::array<double, 2> &a,
                    const std::array<double, 2> &b)
    {
      const double length = distance(a, b);
      if (length == 0)
        return distance(x, a);
      const double t = ((x[0] - a[0]) * (b[0] - a[0]) + (x[1] - a[1]) * (b[1] - a[1])) / length;
      return distance(x, between(a, b, std::clamp(t / length, 0., 1.)));
    }
  } // namespace

  // Solving.

  void StabilityMap::anchor(const Position &at)
  {
    const Parameters::All &parameters = parameters_at(at);
    follower.anchor(parameters, follower.solve_fully(parameters));
  }

  const Parameters::All &StabilityMap::parameters_at(const Position &at)
  {
    for (unsigned int k = 0; k < 2; ++k)
      file.vary(parameters[k], parameter_at(k, at[k]));
    return file.parameters();
  }

  StabilityMap::Evaluation StabilityMap::evaluate(const Position &at, const Complex expected)
  {
    const auto nearest = [&](const Modes &modes, const Complex l)
    {
      const std::vector<unsigned int> chosen = nearest_partners({l}, modes.lambda);
      if (chosen.empty())
        throw SolverError("A mode was lost in the search for the border of stability.");
      return chosen.front();
    };
    Evaluation result;
    const Modes modes       = follower.solve(parameters_at(at));
    const unsigned int mode = nearest(modes, expected);
    result.lambda           = modes.lambda[mode];
    result.value            = result.lambda.real();
    std::array<bool, 2> known{};
    for (unsigned int k = 0; k < 2; ++k)
      if (const auto slopes = follower.sensitivities(parameters[k], modes); !slopes.empty())
      {
        result.slope[k] = slopes[mode] * cell_size(k, at[k]);
        known[k]        = true;
      }
    for (unsigned int k = 0; k < 2; ++k)
    {
      if (!known[k]) // the terms cannot be differentiated by it
      {
        const double h     = at[k] > 0.5 ? -1e-4 : 1e-4;
        Position shifted   = at;
        shifted[k]         = at[k] + h;
        const Modes beside = follower.solve(parameters_at(shifted));
        result.slope[k]    = (beside.lambda[nearest(beside, result.lambda)] - result.lambda) / h;
      }
      result.gradient[k] = result.slope[k].real();
    }
    return result;
  }

  StabilityMap::Evaluation StabilityMap::evaluate_divergence(const Position &at,
                                                             const StaticInstability &instability)
  {
    const QuadraticEigenproblem &problem = follower.assemble(parameters_at(at));
    std::vector<ParameterDerivative> derivatives;
    for (const std::string &parameter : parameters)
    {
      const auto of_parameter = follower.derivatives(parameter);
      derivatives.push_back(of_parameter.empty() ? ParameterDerivative{parameter, 0, {}}
                                                 : of_parameter.front());
    }
    const auto here = instability.evaluate(problem, derivatives);
    if (here.value == 0) // exactly on the border: the gradient is that of a point beside it
    {
      constexpr double beside = 1e-6;
      Evaluation result =
          evaluate_divergence({{at[0] + (at[0] > 0.5 ? -beside : beside), at[1]}}, instability);
      result.value = 0;
      return result;
    }
    Evaluation result;
    result.value = here.value;
    for (unsigned int k = 0; k < 2; ++k)
      result.gradient[k] = here.derivatives[k] * cell_size(k, at[k]);
    return result;
  }

  // The grid.

  void StabilityMap::write(const Position &at, const Modes &modes)
  {
    const std::vector<ModeRow> rows = follower.analyse(modes);
    unsigned int n_unstable         = 0;
    for (const ModeRow &row : rows)
      n_unstable += row.verdict == "flutter" || row.verdict == "divergence";
    const auto worst = std::max_element(rows.begin(), rows.end(),
                                        [](const ModeRow &a, const ModeRow &b)
                                        { return a.growth_rate() < b.growth_rate(); });
    const bool none  = worst == rows.end();
    map_csv->add({number(parameter_at(0, at[0]), 15), number(parameter_at(1, at[1]), 15),
                  std::to_string(n_unstable), none ? "" : number(worst->growth_rate()),
                  none ? "" : number(worst->frequency()), none ? "" : worst->verdict});
    log.progress("  " + parameters[0] + " = " + number(parameter_at(0, at[0])) + ", " +
                 parameters[1] + " = " + number(parameter_at(1, at[1])) + ": " +
                 std::to_string(n_unstable) + " unstable");
  }

  void StabilityMap::add_divergence(const unsigned int before, const unsigned int now,
                                    const Modes &modes)
  {
    const Position from = position_of(before), to = position_of(now);
    const auto n_divergent = [](const std::vector<Complex> &lambda)
    {
      return std::count_if(lambda.begin(), lambda.end(),
                           [](const Complex l) { return l.imag() == 0 && l.real() > 0; });
    };
    const auto n_before = n_divergent(eigenvalues[before]), n_now = n_divergent(modes.lambda);
    if ((n_before + n_now) % 2 == 0)
      return;
    const Position &end = n_now > n_before ? to : from;
    const Modes at_end  = follower.whole(follower.solve(parameters_at(end)));
    const StaticInstability instability(follower.assemble(parameters_at(end)), at_end,
                                        divergent_modes(at_end).front());
    const auto along = [&](const double t)
    {
      const Evaluation at = evaluate_divergence(between(from, to, t), instability);
      return std::make_pair(at.value, at.gradient[0] * (to[0] - from[0]) +
                                          at.gradient[1] * (to[1] - from[1]));
    };
    const std::optional<Root> root = find_root(0, 1, along);
    if (!root)
      return;
    BorderPoint point;
    point.at         = between(from, to, std::clamp(root->value, 0., 1.));
    point.accuracy   = root->accuracy;
    point.divergence = true;
    crossings.push_back(point);
  }

  void StabilityMap::add_crossing(const unsigned int before, const unsigned int now,
                                  const Complex l_before, const Complex l_now)
  {
    const Position from = position_of(before), to = position_of(now);
    const auto slope_of = [&](const Evaluation &at)
    { return at.slope[0] * (to[0] - from[0]) + at.slope[1] * (to[1] - from[1]); };
    struct Known
    {
      double t;
      Complex lambda, slope;
    };
    std::vector<Known> known = {{0, l_before, l_now - l_before}, {1, l_now, l_now - l_before}};
    const auto along         = [&](const double t)
    {
      const auto nearest = std::min_element(known.begin(), known.end(),
                                            [&](const Known &a, const Known &b)
                                            { return std::abs(a.t - t) < std::abs(b.t - t); });
      const Evaluation at =
          evaluate(between(from, to, t), nearest->lambda + nearest->slope * (t - nearest->t));
      known.push_back({t, at.lambda, slope_of(at)});
      return std::make_pair(at.value, known.back().slope.real());
    };
    Root root;
    if (l_before.real() * l_now.real() < 0 && !is_marginal(l_before) && !is_marginal(l_now))
      root = find_root(0, l_before.real(), 1, l_now.real(), along);
    else
    {
      // The border runs through the point that is marginal.
      const double t             = is_marginal(l_before) ? 0 : 1;
      const auto [growth, slope] = along(t);
      root                       = {t - growth / slope, std::abs(growth / slope), 1};
    }
    // Where two modes meet, the search may have gone from the one to the other: no root there.
    if (std::abs(known.back().lambda.real()) > 1e-6 * std::abs(known.back().lambda))
      return;
    // Without damping a mode stays marginal up to where it meets another: no border of Re l = 0.
    if (std::abs(known.back().slope.real()) <= 1e-4 * std::abs(known.back().slope))
      return;
    BorderPoint point;
    point.at       = between(from, to, std::clamp(root.value, 0., 1.));
    point.accuracy = root.accuracy;
    point.lambda   = {0, known.back().lambda.imag()};
    crossings.push_back(point);
  }

  void StabilityMap::find_crossings(const unsigned int before, const unsigned int now,
                                    const Modes &modes)
  {
    const std::vector<Complex> &a = eigenvalues[before], &b = modes.lambda;
    std::vector<std::vector<double>> cost(a.size(), std::vector<double>(b.size()));
    for (unsigned int i = 0; i < a.size(); ++i)
      for (unsigned int j = 0; j < b.size(); ++j)
        cost[i][j] = std::norm(a[i] - b[j]);
    const std::vector<int> partners = assign(cost, b.size());
    const auto grows = [&](const Complex l) { return l.real() > 0 && !is_marginal(l); };
    for (unsigned int i = 0; i < a.size(); ++i)
      if (const int j = partners[i];
          j >= 0 && a[i].imag() > 0 && b[j].imag() > 0 && grows(a[i]) != grows(b[j]))
        add_crossing(before, now, a[i], b[j]);
    add_divergence(before, now, modes);
  }

  void StabilityMap::walk_grid()
  {
    const unsigned int n = values[0].size(), n_points = n * values[1].size();
    for (unsigned int point = eigenvalues.size(); point < n_points; ++point)
    {
      const Position at = position_of(point);
      const Modes modes = follower.solve(parameters_at(at));
      write(at, modes);
      if (point % n > 0)
        find_crossings(point - 1, point, modes);
      if (point >= n) // the neighbour in the row before, which was walked the other way
        find_crossings(2 * (point / n) * n - 1 - point, point, modes);
      eigenvalues.push_back(modes.lambda);
      if (follower.is_whole(modes))
      {
        follower.anchor(parameters_at(at), modes);
        save();
      }
      if (point % n == n - 1)
        log.line("  " + parameters[1] + " = " + number(parameter_at(1, at[1])) + ": " +
                 std::to_string(crossings.size()) + " crossings of the border so far");
    }
  }

  // The border.

  /// Newton's method along the gradient, or along one axis if the other coordinate is held.
  bool StabilityMap::correct(const BorderTest &test, Position &at, const int held,
                             Evaluation &result, double &accuracy)
  {
    constexpr unsigned int max_iterations = 10;
    for (unsigned int i = 0; i < max_iterations; ++i)
    {
      result     = test(at);
      Position g = result.gradient;
      if (held >= 0)
        g[held] = 0;
      const double square = g[0] * g[0] + g[1] * g[1];
      if (result.value != 0 && !(square > 0))
        return false;
      const double factor = result.value == 0 ? 0 : result.value / square;
      for (unsigned int k = 0; k < 2; ++k)
        at[k] -= factor * (result.value == 0 ? 0 : g[k]);
      accuracy = std::abs(factor) * std::sqrt(square > 0 ? square : 0);
      if (accuracy > 1)
        return false;
      if (accuracy <= 1e-9)
        return true;
    }
    return false;
  }

  bool StabilityMap::inside(const Position &at, const double margin) const
  {
    for (unsigned int k = 0; k < 2; ++k)
      if (at[k] < -margin || at[k] > values[k].size() - 1 + margin)
        return false;
    return true;
  }

  int StabilityMap::clip(const Position &from, Position &to) const
  {
    int held = -1;
    for (unsigned int k = 0; k < 2; ++k)
    {
      const double last = values[k].size() - 1, wanted = std::clamp(to[k], 0., last);
      if (wanted == to[k])
        continue;
      const double t = (wanted - from[k]) / (to[k] - from[k]);
      to             = between(from, to, t);
      to[k]          = wanted;
      held           = k;
    }
    return held;
  }

  /// One step along the border; false at its end.
  bool StabilityMap::step(const BorderPoint &last, const Evaluation &here, Position &tangent,
                          double &length, BorderPoint &next, Evaluation &there)
  {
    for (; length >= shortest_step; length /= 2)
      try
      {
        Position at = {{last.at[0] + length * tangent[0], last.at[1] + length * tangent[1]}};
        int held    = clip(last.at, at);
        if (distance(at, last.at) < 1e-6)
          return false; // at the edge of the map
        const BorderTest test = test_from(last, here);
        bool good             = correct(test, at, held, there, next.accuracy);
        if (good && !inside(at, 1e-9)) // back onto the edge that it left by
        {
          held = clip(last.at, at);
          good = held >= 0 && correct(test, at, held, there, next.accuracy);
        }
        const Position &g = there.gradient;
        const double size = std::hypot(g[0], g[1]);
        Position turned   = {{-g[1] / size, g[0] / size}};
        double cosine     = turned[0] * tangent[0] + turned[1] * tangent[1];
        if (cosine < 0)
        {
          turned = {{-turned[0], -turned[1]}};
          cosine = -cosine;
        }
        if (!good || !inside(at, 1e-9) || distance(at, last.at) > longest_step || cosine < 0.8)
          continue;
        next.at         = {{std::clamp(at[0], 0., values[0].size() - 1.),
                            std::clamp(at[1], 0., values[1].size() - 1.)}};
        next.lambda     = last.divergence ? 0. : Complex(0, there.lambda.imag());
        next.divergence = last.divergence;
        tangent         = turned;
        at_edge         = held >= 0;
        return true;
      }
      catch (const SolverError &)
      {
        // A mode was lost, or there is no steady state: nearer.
      }
    log.line("  The border cannot be followed beyond " + parameters[0] + " = " +
             number(parameter_at(0, last.at[0])) + ", " + parameters[1] + " = " +
             number(parameter_at(1, last.at[1])) + ".");
    return false;
  }

  StabilityMap::BorderTest StabilityMap::test_from(const BorderPoint &last, const Evaluation &here)
  {
    if (last.divergence)
      return [this](const Position &at) { return evaluate_divergence(at, *instability); };
    return [this, &last, &here](const Position &at)
    {
      return evaluate(at, last.lambda + here.slope[0] * (at[0] - last.at[0]) +
                              here.slope[1] * (at[1] - last.at[1]));
    };
  }

  std::vector<StabilityMap::BorderPoint> StabilityMap::trace(const BorderPoint &seed)
  {
    if (seed.divergence)
    {
      // A divergent mode beside the seed: towards one of the four sides there is one. (At the seed
      // itself Q is singular.)
      instability.reset();
      for (const Position &side : {Position{{0.1, 0}}, {{-0.1, 0}}, {{0, 0.1}}, {{0, -0.1}}})
      {
        const Position at = {{seed.at[0] + side[0], seed.at[1] + side[1]}};
        if (instability || !inside(at, 0))
          continue;
        anchor(at);
        const Modes modes = follower.whole(follower.solve(parameters_at(at)));
        const auto real   = divergent_modes(modes);
        if (!real.empty())
          instability = std::make_unique<StaticInstability>(follower.assemble(parameters_at(at)),
                                                            modes, real.front());
      }
      if (!instability)
        return {seed};
    }
    const Evaluation start         = seed.divergence ? evaluate_divergence(seed.at, *instability)
                                                     : evaluate(seed.at, seed.lambda);
    const unsigned int most_points = 20 * (values[0].size() + values[1].size());
    std::vector<BorderPoint> curve = {seed};
    for (const double sign : {1., -1.})
    {
      const double size = std::hypot(start.gradient[0], start.gradient[1]);
      Position tangent  = {{-sign * start.gradient[1] / size, sign * start.gradient[0] / size}};
      double length     = longest_step;
      Evaluation here   = start;
      at_edge           = false;
      BorderPoint last  = seed, next;
      Evaluation there;
      while (!at_edge && curve.size() < most_points &&
             step(last, here, tangent, length, next, there))
      {
        curve.push_back(next);
        last   = next;
        here   = std::move(there);
        length = std::min(0.9 * longest_step, 1.5 * length);
        if (curve.size() > 4 && distance(last.at, seed.at) < 0.9 * longest_step)
        {
          curve.push_back(seed); // closed
          return curve;
        }
      }
      std::reverse(curve.begin(), curve.end()); // the seed is at the end now
    }
    return curve;
  }

  void StabilityMap::trace_border()
  {
    for (BorderPoint &seed : crossings)
    {
      if (seed.done)
        continue;
      // A curve depends on its seed alone, whatever was solved before.
      if (!seed.divergence)
        anchor(seed.at);
      const std::vector<BorderPoint> curve = trace(seed);
      for (const BorderPoint &point : curve)
        border_csv->add({std::to_string(n_curves), point.divergence ? "divergence" : "flutter",
                         number(parameter_at(0, point.at[0]), 15),
                         number(parameter_at(1, point.at[1]), 15),
                         number(point.lambda.imag() / (2 * M_PI)), number(point.accuracy)});
      log.line("  Border curve " + std::to_string(n_curves) + ": " + std::to_string(curve.size()) +
               " points, " +
               (seed.divergence ? "divergence"
                                : "flutter at " + number(seed.lambda.imag() / (2 * M_PI)) + " Hz"));
      ++n_curves;
      // The other crossings on this curve.
      for (BorderPoint &other : crossings)
        for (unsigned int i = 0; i + 1 < curve.size() && !other.done; ++i)
          other.done = other.divergence == seed.divergence &&
                       distance(other.at, curve[i].at, curve[i + 1].at) < 0.1 &&
                       std::abs(other.lambda - curve[i].lambda) <=
                           0.05 * std::abs(curve[i].lambda) +
                               2 * std::abs(curve[i + 1].lambda - curve[i].lambda);
      seed.done = true;
      save();
    }
  }

  // Files.

  void StabilityMap::save() const
  {
    MPI_Barrier(comm);
    std::vector<double> state;
    for (const std::uintmax_t size : file_sizes(directory, tables))
      state.push_back(size);
    const std::vector<double> varying_terms = follower.varying_terms();
    state.insert(state.end(), {double(n_curves), double(varying_terms.size())});
    state.insert(state.end(), varying_terms.begin(), varying_terms.end());
    state.push_back(eigenvalues.size());
    for (const std::vector<Complex> &list : eigenvalues)
    {
      state.push_back(list.size());
      for (const Complex l : list)
        state.insert(state.end(), {l.real(), l.imag()});
    }
    for (const BorderPoint &point : crossings)
      state.insert(state.end(), {point.at[0], point.at[1], point.lambda.imag(), point.accuracy,
                                 double(point.divergence), double(point.done)});
    int rank = 0;
    MPI_Comm_rank(comm, &rank);
    if (rank == 0)
      save_numbers(state_file(), state);
    MPI_Barrier(comm);
  }

  bool StabilityMap::resume()
  {
    const std::optional<std::vector<double>> state = load_numbers(state_file());
    int good                                       = state && state->size() > tables.size() + 3;
    MPI_Allreduce(MPI_IN_PLACE, &good, 1, MPI_INT, MPI_MIN, comm);
    if (!good)
      return false;
    auto at  = state->begin() + tables.size();
    n_curves = *at++;
    std::vector<double> varying_terms(*at++);
    for (double &number : varying_terms)
      number = *at++;
    eigenvalues.resize(*at++);
    for (std::vector<Complex> &list : eigenvalues)
    {
      list.resize(*at++);
      for (Complex &l : list)
      {
        l = {at[0], at[1]};
        at += 2;
      }
    }
    for (; at != state->end(); at += 6)
      crossings.push_back({{{at[0], at[1]}}, {0, at[2]}, at[3], at[4] != 0, at[5] != 0});
    cut_files(directory, tables, {state->begin(), state->begin() + tables.size()}, comm);
    log.line("Resumed after " + std::to_string(eigenvalues.size()) + " points and " +
             std::to_string(n_curves) + " curves.");
    anchor(position_of(eigenvalues.size() - 1));
    follower.keep_apart(varying_terms);
    return true;
  }

  void StabilityMap::run()
  {
    const std::array<double, 2> original = {
        {file.value_of(parameters[0]), file.value_of(parameters[1])}};
    const bool resumed = resume();
    map_csv            = std::make_unique<Table>(
        directory + "/map.csv",
        "first_value,second_value,unstable_modes,growth_rate_1_per_s,frequency_hz,verdict", comm,
        resumed);
    border_csv = std::make_unique<Table>(
        directory + "/border.csv",
        "curve,kind,first_value,second_value,frequency_hz,accuracy_cells", comm, resumed);
    log.line("\nStability map over " + parameters[0] + " and " + parameters[1] + ", " +
             std::to_string(values[0].size()) + " x " + std::to_string(values[1].size()) +
             " points");
    walk_grid();
    trace_border();
    for (unsigned int k = 0; k < 2; ++k)
      file.vary(parameters[k], original[k]);
    MPI_Barrier(comm);
    std::error_code ignored;
    std::filesystem::remove(state_file(), ignored);
  }
} // namespace squeal
