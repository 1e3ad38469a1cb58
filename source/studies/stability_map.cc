#include <squeal/eigen/growth_search.h>
#include <squeal/linalg/find_root.h>
#include <squeal/studies/stability_map.h>
#include <squeal/studies/study_points.h>

#include <algorithm>
#include <cmath>
#include <fstream>

// In the order of a run: effects of the mesh are estimated at the centre and the corners; the grid
// is walked, and between neighbours the crossings of the border are located; from each crossing
// that lies on no curve yet a curve is traced, by steps along its tangent and Newton's method back
// onto it; the map is sorted. Positions are in cells of the grid.
namespace squeal
{
  using Complex = std::complex<double>;
  using Scope   = ModeTracker::Scope;

  StabilityMap::StabilityMap(ParameterFile &file, Model &model, const EigensolverOptions &options,
                             const std::string &directory, const MPI_Comm comm, Log &log,
                             const ErrorEstimator &estimator)
      : Study({"map", "point", "the border of stability", {"map.csv", "border.csv"}}, file,
              {file.parameters().sweep.parameter, file.parameters().sweep.second_parameter}, model,
              options, directory, comm, log, estimator),
        values{{file.parameters().sweep.points(), file.parameters().sweep.second_points()}}
  {
    points_of_study(file.parameters()); // refuses what changes the mesh
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

    /// The unit vector across a gradient.
    std::array<double, 2> tangent_of(const std::array<double, 2> &g)
    {
      const double size = std::hypot(g[0], g[1]);
      return {{-g[1] / size, g[0] / size}};
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

  void StabilityMap::set_expansion_point(const Position &at, const Scope scope)
  {
    const Parameters::All &parameters = varied.parameters_at(values_at(at));
    tracker.set_expansion_point(parameters, tracker.solve_fully(parameters, scope).reuse);
  }

  StabilityMap::Evaluation StabilityMap::evaluate(const Position &at, const Complex expected)
  {
    auto here = varied.evaluate(values_at(at), {expected});
    Evaluation result;
    result.lambda      = here.lambda[0];
    result.modes       = std::move(here.modes);
    result.mode        = here.numbers[0];
    result.value       = result.lambda.real();
    result.uncertainty = here.uncertainty;
    for (unsigned int k = 0; k < 2; ++k)
    {
      if (!here.derivatives[k].empty())
        result.slope[k] = here.derivatives[k][0] * cell_size(k, at[k]);
      else // the terms cannot be differentiated by it
      {
        const double h   = at[k] > 0.5 ? -1e-4 : 1e-4;
        Position shifted = at;
        shifted[k]       = at[k] + h;
        const EigenPairs beside =
            tracker.solve(varied.parameters_at(values_at(shifted)), Scope::disc).modes;
        const unsigned int mode = varied.nearest(beside, {result.lambda}).front();
        result.slope[k]         = (beside.lambda[mode] - result.lambda) / h;
      }
      result.gradient[k] = result.slope[k].real();
    }
    return result;
  }

  StabilityMap::Evaluation StabilityMap::evaluate(const Position &at,
                                                  const StaticInstability &instability)
  {
    const auto here = varied.evaluate(instability, values_at(at));
    Evaluation result;
    if (here.value == 0) // exactly on the boundary: the gradient is that of a point beside it
    {
      constexpr double beside = 1e-6;
      result       = evaluate({{at[0] + (at[0] > 0.5 ? -beside : beside), at[1]}}, instability);
      result.value = 0;
      return result;
    }
    result.value = here.value;
    for (unsigned int k = 0; k < 2; ++k)
      if (std::isfinite(here.derivatives[k]))
        result.gradient[k] = here.derivatives[k] * cell_size(k, at[k]);
    return result;
  }

  // The grid.

  Fields StabilityMap::map_fields(const Position &at, const GrowthSummary &summary) const
  {
    const auto &worst = summary.worst;
    return {{varied.parameters[0], number(parameter_at(0, at[0]), 15)},
            {varied.parameters[1], number(parameter_at(1, at[1]), 15)},
            {"unstable_modes", summary.field(summary.n_unstable)},
            {"undecided_modes", summary.field(summary.n_undecided)},
            {"growth_rate_1_per_s", worst ? number(worst->growth_rate()) : ""},
            {"growth_rate_error_1_per_s", worst ? number(worst->growth_rate_error) : ""},
            {"frequency_hz", worst ? number(worst->frequency()) : ""},
            {"verdict", worst ? name_of(worst->verdict) : ""}};
  }

  Fields StabilityMap::border_fields(const unsigned int curve, const BoundaryPoint &point) const
  {
    Fields fields = {
        {"curve", curve},
        {"kind", point.divergence ? "divergence" : "flutter"},
        {varied.parameters[0], number(parameter_at(0, point.at[0]), 15)},
        {varied.parameters[1], number(parameter_at(1, point.at[1]), 15)},
        {"frequency_hz", point.lambda.imag() / (2 * M_PI)},
        {"other_growing_modes", point.n_growing ? std::to_string(*point.n_growing) : ""},
        {"accuracy_cells", point.accuracy()},
        {"search_error_cells", point.search_error},
        {"reduction_error_cells", point.reduction_error},
        {"mesh_error_cells", point.bar ? number(point.bar->error, 6) : ""}};
    for (unsigned int k = 0; k < 2; ++k)
    {
      const double shift = point.bar ? point.bar->correction * point.across[k] : 0,
                   half  = point.bar ? point.bar->error + point.accuracy() : 0,
                   there = std::clamp(point.at[k] + shift, -0.5, values[k].size() - 0.5);
      fields.push_back({"corrected_" + varied.parameters[k],
                        point.bar ? number(parameter_at(k, there), 15) : ""});
      fields.push_back(
          {"band_" + varied.parameters[k],
           point.bar ? number(half * point.across[k] * cell_size(k, point.at[k]), 6) : ""});
    }
    return fields;
  }

  void StabilityMap::write(const Position &at, const EigenPairs &modes)
  {
    std::vector<ModeRow> rows = tracker.analyse(modes);
    if (effects)
      set_bars(rows, effects->on(shares_at(at), modes), modes.lambda, modes.parity,
               varied.options.tolerance);
    map_csv->add(map_fields(at, GrowthSummary(rows)));
    count_modes(rows.size());
  }

  void StabilityMap::sort_map() const
  {
    if (!is_rank_zero(comm))
      return;
    const std::string filename = directory + "/map.csv";
    std::ifstream file(filename);
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);)
      lines.push_back(line);
    file.close();
    const unsigned int n = values[0].size();
    for (unsigned int first = 1 + n; first + n <= lines.size(); first += 2 * n) // every other row
      std::reverse(lines.begin() + first, lines.begin() + first + n);
    write_file(filename,
               [&](std::ostream &out)
               {
                 for (const std::string &line : lines)
                   out << line << '\n';
               });
  }

  void StabilityMap::add_divergence(const unsigned int before, const unsigned int now,
                                    const EigenPairs &modes)
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
    const Position &end     = n_now > n_before ? to : from;
    const EigenPairs at_end = tracker.solve(varied.parameters_at(values_at(end))).modes;
    const auto instability  = varied.instability_of(values_at(end), at_end);
    const auto along        = [&](const double t)
    {
      const Evaluation at = evaluate(between(from, to, t), instability);
      return std::make_pair(at.value, at.gradient[0] * (to[0] - from[0]) +
                                          at.gradient[1] * (to[1] - from[1]));
    };
    const std::optional<Root> root = find_root(0, 1, along);
    if (!root)
      return;
    BoundaryPoint point;
    point.at           = between(from, to, std::clamp(root->value, 0., 1.));
    point.search_error = root->accuracy;
    point.divergence   = true;
    crossings.push_back(point);
  }

  bool StabilityMap::locate_crossing(const Position &from, const Position &to,
                                     const Complex l_before, const Complex l_now,
                                     std::vector<BoundaryPoint> &found)
  {
    EigenvaluePredictor predictor(0, l_before, 1, l_now);
    double uncertainty = 0;
    const auto along   = [&](const double t)
    {
      const Evaluation at = evaluate(between(from, to, t), predictor(t));
      const Complex slope = at.slope[0] * (to[0] - from[0]) + at.slope[1] * (to[1] - from[1]);
      predictor.add({t, at.lambda, slope});
      uncertainty = at.uncertainty;
      return std::make_pair(at.value, slope.real());
    };
    Root root;
    if (l_before.real() * l_now.real() < 0 && !varied.is_marginal(l_before) &&
        !varied.is_marginal(l_now))
      root = find_root(0, l_before.real(), 1, l_now.real(), along);
    else
    {
      // The border runs through the point that is marginal.
      const double t             = varied.is_marginal(l_before) ? 0 : 1;
      const auto [growth, slope] = along(t);
      root                       = {t - growth / slope, std::abs(growth / slope), 1};
    }
    const EigenvaluePredictor::Known &last = predictor.last();
    // Where two modes meet, the search may have gone from the one to the other: no root there.
    if (std::abs(last.lambda.real()) > 1e-6 * std::abs(last.lambda))
      return false;
    // Without damping a mode stays marginal up to where it meets another: no boundary of Re l = 0.
    if (std::abs(last.slope.real()) <= 1e-4 * std::abs(last.slope))
      return true;
    BoundaryPoint point;
    point.at              = between(from, to, std::clamp(root.value, 0., 1.));
    point.search_error    = root.accuracy;
    point.reduction_error = uncertainty / std::abs(last.slope.real());
    point.lambda          = {0, last.lambda.imag()};
    found.push_back(point);
    return true;
  }

  void StabilityMap::find_flutter(const Position &from, const Position &to,
                                  const std::vector<Complex> &a, const std::vector<Complex> &b,
                                  const unsigned int halvings)
  {
    std::vector<std::vector<double>> cost(a.size(), std::vector<double>(b.size()));
    for (unsigned int i = 0; i < a.size(); ++i)
      for (unsigned int j = 0; j < b.size(); ++j)
        cost[i][j] = std::norm(a[i] - b[j]);
    const std::vector<int> partners = assign(cost, b.size());
    const auto grows = [&](const Complex l) { return l.real() > 0 && !varied.is_marginal(l); };
    std::vector<BoundaryPoint> found;
    bool all_located = true;
    for (unsigned int i = 0; i < a.size(); ++i)
      if (const int j = partners[i];
          j >= 0 && a[i].imag() > 0 && b[j].imag() > 0 && grows(a[i]) != grows(b[j]))
        all_located = locate_crossing(from, to, a[i], b[j], found) && all_located;
    if (all_located || halvings == 0)
    {
      crossings.insert(crossings.end(), found.begin(), found.end());
      return;
    }
    // Modes that meet on the way are told apart on a shorter one.
    const Position middle = between(from, to, 0.5);
    const std::vector<Complex> there =
        tracker.solve(varied.parameters_at(values_at(middle)), Scope::disc).modes.lambda;
    find_flutter(from, middle, a, there, halvings - 1);
    find_flutter(middle, to, there, b, halvings - 1);
  }

  void StabilityMap::find_crossings(const unsigned int before, const unsigned int now,
                                    const EigenPairs &modes)
  {
    if (std::count(left_out.begin(), left_out.end(), before) > 0)
      return;
    constexpr unsigned int most_halvings = 6;
    // A mode whose growth ends does so in the disc, in which alone modes are followed.
    const auto of_disc = [&](std::vector<Complex> lambda)
    {
      lambda.erase(std::remove_if(lambda.begin(), lambda.end(),
                                  [&](const Complex &l)
                                  { return grows_beyond_disc(l, varied.options.max_imaginary); }),
                   lambda.end());
      return lambda;
    };
    find_flutter(position_of(before), position_of(now), of_disc(eigenvalues[before]),
                 of_disc(modes.lambda), most_halvings);
    add_divergence(before, now, modes);
  }

  void StabilityMap::prepare()
  {
    if (!estimator)
      return;
    log.progress("  centre of the map");
    const double n = values[0].size() - 1, m = values[1].size() - 1;
    const Position centre = {{n / 2, m / 2}};
    // Where signs change rest may lie, and effects grow without bound.
    std::vector<double> between_signs = values_at(centre);
    for (unsigned int k = 0; k < 2; ++k)
      if (values[k].front() * values[k].back() < 0)
        between_signs[k] = 0;
    try
    {
      varied.parameters_at(between_signs);
    }
    catch (const InputError &)
    {
      log.line("\nThis map has no error bars: " + varied.parameters[0] + " = " +
               number(between_signs[0]) + " with " + varied.parameters[1] + " = " +
               number(between_signs[1]) +
               " is not allowed, and effects of the mesh are not interpolated across it.");
      return;
    }
    const std::array<Position, 4> corners = {{{{0, 0}}, {{n, 0}}, {{n, m}}, {{0, m}}}};
    std::vector<std::vector<double>> places;
    for (const Position &corner : corners)
      places.push_back(values_at(corner));
    effects.emplace(varied, estimator, values_at(centre), places);
  }

  std::vector<double> StabilityMap::shares_at(const Position &p) const
  {
    const double n = values[0].size() - 1, m = values[1].size() - 1;
    const Position centre                 = {{n / 2, m / 2}};
    const std::array<Position, 4> corners = {{{{0, 0}}, {{n, 0}}, {{n, m}}, {{0, m}}}};
    std::vector<double> result(4, 0.);
    double least = -HUGE_VAL;
    for (unsigned int k = 0; k < 4; ++k)
    {
      const Position &a = corners[k], &b = corners[(k + 1) % 4];
      const auto cross = [&](const Position &u, const Position &v)
      { return (u[0] - centre[0]) * (v[1] - centre[1]) - (u[1] - centre[1]) * (v[0] - centre[0]); };
      const double area = cross(a, b), of_a = cross(p, b) / area, of_b = cross(a, p) / area,
                   smallest = std::min({of_a, of_b, 1 - of_a - of_b});
      if (smallest <= least)
        continue;
      least = smallest;
      std::fill(result.begin(), result.end(), 0.);
      result[k]           = of_a;
      result[(k + 1) % 4] = of_b;
    }
    return result;
  }

  void StabilityMap::solve(const unsigned int point)
  {
    const unsigned int n      = values[0].size();
    const Position at         = position_of(point);
    const EigenSolution found = tracker.solve(varied.parameters_at(values_at(at)));
    const EigenPairs &modes   = found.modes;
    write(at, modes);
    if (found.proof.lacks_growing)
      log.line("  At " + number(parameter_at(0, at[0])) + ", " + number(parameter_at(1, at[1])) +
               ": " + lacking_growth);
    if (point % n > 0)
      find_crossings(point - 1, point, modes);
    if (point >= n) // the neighbour in the row before, which was walked the other way
      find_crossings(2 * (point / n) * n - 1 - point, point, modes);
    eigenvalues.push_back(modes.lambda);
    is_full = tracker.is_whole(modes);
    if (is_full)
    {
      tracker.set_expansion_point(varied.parameters_at(values_at(at)), found.reuse);
      varying_terms = tracker.varying_terms();
    }
    if (point % n == n - 1)
      log.line("  " + varied.parameters[1] + " = " + number(parameter_at(1, at[1])) + ": " +
               std::to_string(crossings.size()) + " crossings of the border so far");
  }

  /// Its line has no modes: every point has one, as the map is sorted by them.
  bool StabilityMap::leave_out(const unsigned int point)
  {
    map_csv->add(map_fields(position_of(point), GrowthSummary({})));
    eigenvalues.emplace_back();
    left_out.push_back(point);
    is_full = false;
    return left_out.size() < n_points();
  }

  // The boundaries.

  bool StabilityMap::correct(const BoundaryFunction &function, Position &at, const int held,
                             Evaluation &result, BoundaryPoint &point)
  {
    constexpr unsigned int max_iterations = 10;
    for (unsigned int i = 0; i < max_iterations; ++i)
    {
      result     = function(at);
      Position g = result.gradient;
      if (held >= 0)
        g[held] = 0;
      const double square = g[0] * g[0] + g[1] * g[1];
      point.search_error = point.reduction_error = 0;
      if (!(square > 0))
        return result.value == 0;
      const double factor = result.value / square;
      for (unsigned int k = 0; k < 2; ++k)
        at[k] -= factor * g[k];
      point.search_error = std::abs(factor) * std::sqrt(square);
      if (point.search_error > 1)
        return false;
      if (point.search_error <= 1e-9)
      {
        point.reduction_error = result.uncertainty / std::sqrt(square);
        return true;
      }
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

  bool StabilityMap::step(const BoundaryPoint &last, const BoundaryFunction &function,
                          Position &tangent, double &length, BoundaryPoint &next, Evaluation &there)
  {
    for (; length >= shortest_step; length /= 2)
      try
      {
        Position at = {{last.at[0] + length * tangent[0], last.at[1] + length * tangent[1]}};
        int held    = clip(last.at, at);
        if (distance(at, last.at) < 1e-6)
          return false; // at the edge of the map
        bool good = correct(function, at, held, there, next);
        if (good && !inside(at, 1e-9)) // back onto the edge that it left by
        {
          held = clip(last.at, at);
          good = held >= 0 && correct(function, at, held, there, next);
        }
        Position turned = tangent_of(there.gradient);
        double cosine   = turned[0] * tangent[0] + turned[1] * tangent[1];
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
      catch (const NoLoad &)
      {
      }
    log.line("  The border cannot be followed beyond " + varied.parameters[0] + " = " +
             number(parameter_at(0, last.at[0])) + ", " + varied.parameters[1] + " = " +
             number(parameter_at(1, last.at[1])) + ".");
    return false;
  }

  std::unique_ptr<StaticInstability> StabilityMap::instability_beside(const Position &at)
  {
    // Towards one of the four sides there is a divergent mode; at the point itself Q is singular.
    for (const Position &side : {Position{{0.1, 0}}, {{-0.1, 0}}, {{0, 0.1}}, {{0, -0.1}}})
    {
      const Position beside = {{at[0] + side[0], at[1] + side[1]}};
      if (!inside(beside, 0))
        continue;
      set_expansion_point(beside, Scope::disc);
      const EigenPairs modes =
          tracker.solve(varied.parameters_at(values_at(beside)), Scope::disc).modes;
      if (!divergent_modes(modes).empty())
        return std::make_unique<StaticInstability>(varied.instability_of(values_at(beside), modes));
    }
    return nullptr;
  }

  std::optional<CriticalBar> StabilityMap::bar_of(const Position &at, const EigenPairs &modes,
                                                  const unsigned int mode, const double slope) const
  {
    if (!effects)
      return std::nullopt;
    return bound_critical_value(on_course(0, modes, {}, {}, 0), effects->on(shares_at(at), modes),
                                mode, slope);
  }

  void StabilityMap::assess(BoundaryPoint &point, const Evaluation &there)
  {
    const double slope = std::hypot(there.gradient[0], there.gradient[1]);
    if (!(slope > 0))
      return;
    point.across = {{there.gradient[0] / slope, there.gradient[1] / slope}};
    if (point.divergence)
    {
      assess_divergence(point);
      return;
    }
    point.n_growing = 0;
    for (unsigned int j = 0; j < there.modes.size(); ++j)
      *point.n_growing += j != there.mode && there.modes.lambda[j].real() > 0 &&
                          !varied.is_marginal(there.modes.lambda[j]);
    point.bar = bar_of(point.at, there.modes, there.mode, slope);
  }

  void StabilityMap::assess_divergence(BoundaryPoint &point)
  {
    if (!effects)
      return;
    constexpr double beside = 0.05; // cells
    for (const double sign : {1., -1.})
    {
      const Position at = {{point.at[0] + sign * beside * point.across[0],
                            point.at[1] + sign * beside * point.across[1]}};
      if (!inside(at, 0))
        continue;
      const EigenPairs modes =
          tracker.solve(varied.parameters_at(values_at(at)), Scope::disc).modes;
      const std::vector<unsigned int> divergent = divergent_modes(modes);
      if (divergent.empty())
        continue;
      const Evaluation there = evaluate(at, modes.lambda[divergent.front()]);
      double slope           = 0;
      for (unsigned int k = 0; k < 2; ++k)
        slope += there.gradient[k] * point.across[k];
      point.n_growing = divergent.size() - 1;
      for (const std::complex<double> l : modes.lambda)
        *point.n_growing += l.imag() > 0 && l.real() > 0 && !varied.is_marginal(l);
      point.bar = bar_of(at, there.modes, there.mode, slope);
      return;
    }
  }

  std::vector<StabilityMap::BoundaryPoint> StabilityMap::trace(const BoundaryPoint &crossing)
  {
    BoundaryPoint seed = crossing;
    std::unique_ptr<StaticInstability> instability;
    // A curve depends on its seed alone, whatever was solved before.
    if (!seed.divergence)
      set_expansion_point(seed.at, Scope::disc);
    else if (instability = instability_beside(seed.at); !instability)
      return {seed};
    BoundaryPoint last = seed, next;
    Evaluation here;
    const BoundaryFunction function = [&](const Position &at)
    {
      return instability ? evaluate(at, *instability)
                         : evaluate(at, last.lambda + here.slope[0] * (at[0] - last.at[0]) +
                                            here.slope[1] * (at[1] - last.at[1]));
    };
    const Evaluation start = function(seed.at);
    assess(seed, start);
    const unsigned int most_points   = 20 * (values[0].size() + values[1].size());
    std::vector<BoundaryPoint> curve = {seed};
    for (const double sign : {1., -1.})
    {
      Position tangent = tangent_of(start.gradient);
      tangent          = {{sign * tangent[0], sign * tangent[1]}};
      double length    = longest_step;
      at_edge          = false;
      last             = seed;
      here             = start;
      Evaluation there;
      while (!at_edge && curve.size() < most_points &&
             step(last, function, tangent, length, next, there))
      {
        assess(next, there);
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

  bool StabilityMap::is_on(const std::vector<BoundaryPoint> &curve, const BoundaryPoint &point)
  {
    for (unsigned int i = 0; i + 1 < curve.size(); ++i)
      if (point.divergence == curve[i].divergence &&
          distance(point.at, curve[i].at, curve[i + 1].at) < 0.1 &&
          std::abs(point.lambda - curve[i].lambda) <=
              0.05 * std::abs(curve[i].lambda) +
                  2 * std::abs(curve[i + 1].lambda - curve[i].lambda))
        return true;
    return false;
  }

  void StabilityMap::trace_boundaries()
  {
    for (BoundaryPoint &seed : crossings)
    {
      if (seed.done)
        continue;
      const std::vector<BoundaryPoint> curve = trace(seed);
      for (const BoundaryPoint &point : curve)
        border_csv->add(border_fields(n_curves, point));
      log.line("  Border curve " + std::to_string(n_curves) + ": " + std::to_string(curve.size()) +
               " points, " +
               (seed.divergence ? "divergence"
                                : "flutter at " + number(seed.lambda.imag() / (2 * M_PI)) + " Hz"));
      ++n_curves;
      for (BoundaryPoint &other : crossings)
        other.done = other.done || is_on(curve, other);
      seed.done     = true;
      varying_terms = tracker.varying_terms();
      save();
    }
  }

  std::string StabilityMap::take_up()
  {
    if (eigenvalues.size() != n_done || n_curves > crossings.size())
      return not_of_this();
    set_expansion_point(position_of(n_done - 1), Scope::window);
    tracker.keep_apart(varying_terms);
    return "";
  }

  void StabilityMap::open(const bool resumed)
  {
    map_csv    = table("map.csv", map_fields({}, GrowthSummary({})), resumed);
    border_csv = table("border.csv", border_fields(0, {}), resumed);
    log.line(text_of("\nStability map over ", varied.parameters[0], " and ", varied.parameters[1],
                     ", ", values[0].size(), " x ", values[1].size(), " points"));
  }

  void StabilityMap::conclude()
  {
    trace_boundaries();
    sort_map();
  }
} // namespace squeal
