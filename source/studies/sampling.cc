#include <squeal/studies/sampling.h>
#include <squeal/studies/study_points.h>

#include <algorithm>
#include <cmath>

// In the order of a run: points are taken from distributions or a file (study_points.h); the centre
// is solved in full and becomes the expansion point; each sample is solved by projection, its modes
// get the centre's branches and the bars of the mesh; growth rates of all samples give the
// probabilities and the sensitivity indices.
namespace squeal
{
  using Complex = std::complex<double>;
  using Scope   = ModeTracker::Scope;

  Sampling::Sampling(ParameterFile &file, Model &model, const EigensolverOptions &options,
                     const std::string &directory, const MPI_Comm comm, Log &log,
                     const ErrorEstimator &estimator)
      : Study({"samples", "sample", "samples", {"samples.csv"}}, file,
              points_of_study(file.parameters()).parameters, model, options, directory, comm, log,
              estimator),
        settings(file.parameters().sampling)
  {
    StudyPoints study = points_of_study(file.parameters());
    points            = std::move(study.points);
    n_base            = study.n_base;
    interval          = std::chrono::seconds(30);
    middle            = centre();
    varied.parameters_at(middle);
  }

  bool Sampling::has_indices() const
  {
    return settings.sensitivity_indices;
  }

  Sampling::Point Sampling::centre() const
  {
    Point result;
    if (settings.file.empty())
      for (const auto &distribution : settings.distributions())
        result.push_back(distribution.quantile(0.5));
    else
      for (unsigned int i = 0; i < varied.parameters.size(); ++i)
      {
        double sum = 0;
        for (const Point &point : points)
          sum += point[i];
        result.push_back(sum / points.size());
      }
    return result;
  }

  void Sampling::prepare()
  {
    log.progress("  centre of the samples");
    tracker.expect_scattered();
    // By parameter, where nine of ten samples are smaller
    std::vector<Point> places;
    for (unsigned int i = 0; i < middle.size(); ++i)
    {
      std::vector<double> of_samples;
      for (unsigned int k = 0; k < n_base; ++k)
        of_samples.push_back(points[k][i]);
      Point place = middle;
      place[i]    = quantile_of(of_samples, 0.9);
      if (place[i] == middle[i])
        continue;
      places.push_back(place);
      moved.emplace_back(i, place[i] - middle[i]);
    }
    effects.emplace(varied, estimator, middle, places);
    for (const Complex l : effects->centre().modes.lambda)
      frequencies.push_back(std::abs(l.imag()) / (2 * M_PI));
    expand_about_centre();
  }

  void Sampling::expand_about_centre()
  {
    EigenSolution found = tracker.solve_fully(varied.parameters_at(middle));
    tracker.set_expansion_point(varied.parameters_at(middle), found.reuse);
    is_projected = tracker.has_expansion_point(); // not for small problems
    found.reuse  = {};
    if (is_projected && !knows_terms)
      learn_terms();
    EigenSolution projected      = tracker.solve(varied.parameters_at(middle));
    const BranchPoint &at_centre = effects->centre();
    const auto transition        = tracker.transition(at_centre.modes, projected.modes);
    reduced_centre               = {};
    reduced_centre.modes         = std::move(projected.modes);
    continue_branches(transition, at_centre, varied.options.max_imaginary, reduced_centre);
    reduced_place = on_course(0, reduced_centre.modes, reduced_centre.branches, transition,
                              at_centre.modes.size());
  }

  void Sampling::learn_terms()
  {
    for (unsigned int i = 0; i < middle.size(); ++i)
    {
      Point above = middle;
      for (const Point &point : points)
        above[i] = std::max(above[i], point[i]);
      tracker.look_at(varied.parameters_at(above));
    }
    knows_terms = true;
  }

  void Sampling::Growth::include(const Growth &other)
  {
    if (!other.is_known())
      return;
    if (!is_known())
    {
      *this = other;
      return;
    }
    value = std::max(value, other.value);
    for (unsigned int side = 0; side < 2; ++side)
    {
      by_mesh[side]   = std::max(by_mesh[side], other.by_mesh[side]);
      by_solver[side] = std::max(by_solver[side], other.by_solver[side]);
    }
  }

  KnownEffects Sampling::effects_at(const Point &point, const BranchPoint &modes) const
  {
    std::vector<double> shares;
    for (const auto &[i, distance] : moved)
      shares.push_back((point[i] - middle[i]) / distance);
    const KnownEffects of_reduced =
        carry_forward(effects->at(shares), effects->place(), reduced_place);
    const ModesOnCourse to = on_course(1, modes.modes, modes.branches,
                                       tracker.transition(reduced_centre.modes, modes.modes),
                                       reduced_centre.modes.size());
    return carry_forward(of_reduced, reduced_place, to);
  }

  void Sampling::solve(const unsigned int sample)
  {
    const unsigned int n_full = tracker.n_full_solutions();
    BranchPoint here;
    EigenSolution found = tracker.solve(varied.parameters_at(points[sample]));
    was_full            = tracker.n_full_solutions() > n_full;
    here.modes          = std::move(found.modes);
    here.rows           = tracker.analyse(here.modes);
    continue_branches(tracker.transition(reduced_centre.modes, here.modes), reduced_centre,
                      varied.options.max_imaginary, here);
    Outcome outcome;
    outcome.branches.resize(frequencies.size());
    std::vector<double> bars(here.modes.size(), 0.);
    if (estimator)
    {
      const KnownEffects known = effects_at(points[sample], here);
      const ErrorBounds bounds = set_bars(here.rows, known, here.modes.lambda, here.modes.parity,
                                          varied.options.tolerance);
      for (unsigned int k = 0; k < known.modes.size(); ++k)
        bars[known.modes[k]] = bounds.growth_rate[k];
    }
    for (unsigned int j = 0; j < here.modes.size(); ++j)
    {
      const Complex l        = here.modes.lambda[j];
      const double by_solver = varied.uncertainty(here.modes, j);
      Growth growth;
      growth.value        = varied.is_undamped(l) ? std::min(l.real(), 0.) : l.real();
      growth.by_mesh[0]   = growth.value - bars[j];
      growth.by_mesh[1]   = growth.value + bars[j];
      growth.by_solver[0] = growth.value - by_solver;
      growth.by_solver[1] = varied.is_undamped(l) ? growth.value : growth.value + by_solver;
      if (here.branches[j] < outcome.branches.size())
        outcome.branches[here.branches[j]] = growth;
      outcome.largest.include(growth);
    }
    samples_csv->add(sample_fields(sample, here, outcome));
    count_modes(here.modes.size());
    outcomes.push_back(std::move(outcome));
    // Which terms vary is learnt by samples.
    if (is_projected && (!tracker.has_expansion_point() || (was_full && tracker.is_full())))
      expand_about_centre();
    else if (tracker.is_crowded())
      reduced_centre.modes = tracker.restart(reduced_centre.modes);
  }

  bool Sampling::leave_out(const unsigned int sample)
  {
    outcomes.emplace_back();
    outcomes.back().branches.resize(frequencies.size());
    return sample + 1 < n_points() || n_with_modes() > 0;
  }

  unsigned int Sampling::n_with_modes() const
  {
    const std::size_t n =
        std::min<std::size_t>(outcomes.size(), has_indices() ? 2 * n_base : n_base);
    return std::count_if(outcomes.begin(), outcomes.begin() + n,
                         [](const Outcome &outcome) { return outcome.largest.is_known(); });
  }

  Fields Sampling::sample_fields(const unsigned int sample, const BranchPoint &modes,
                                 const Outcome &outcome) const
  {
    Fields fields{{"sample", sample + 1}};
    for (unsigned int i = 0; i < varied.parameters.size(); ++i)
      fields.push_back({varied.parameters[i], points.empty() ? 0 : points[sample][i]});
    const GrowthSummary summary(modes.rows);
    const auto worst = std::max_element(modes.rows.begin(), modes.rows.end(),
                                        [](const ModeRow &a, const ModeRow &b)
                                        { return a.growth_rate() < b.growth_rate(); });
    const bool any   = worst != modes.rows.end();
    const int branch = any ? int(modes.branches[worst - modes.rows.begin()]) : -1;
    fields =
        std::move(fields) +
        Fields{{"modes", unsigned(modes.rows.size())},
               {"unstable_modes", summary.field(summary.n_unstable)},
               {"undecided_modes", summary.field(summary.n_undecided)},
               {"solved_fully", unsigned(was_full)},
               {"branch",
                branch >= 0 && branch < int(frequencies.size()) ? std::to_string(branch + 1) : ""},
               {"frequency_hz", any ? number(worst->frequency()) : ""},
               {"growth_rate_1_per_s", any ? number(worst->growth_rate()) : ""},
               {"reduction_error_1_per_s",
                any ? number(varied.uncertainty(modes.modes, worst - modes.rows.begin())) : ""},
               {"mesh_error_1_per_s",
                any && worst->growth_rate_error ? number(*worst->growth_rate_error) : ""}};
    for (unsigned int b = 0; b < frequencies.size(); ++b)
      fields.push_back({"growth_rate_of_branch_" + std::to_string(b + 1) + "_1_per_s",
                        b < outcome.branches.size() ? number(outcome.branches[b].value) : ""});
    return fields;
  }

  std::string Sampling::take_up()
  {
    const bool fits = outcomes.size() == n_done &&
                      std::all_of(outcomes.begin(), outcomes.end(),
                                  [&](const Outcome &outcome)
                                  { return outcome.branches.size() == frequencies.size(); });
    return fits ? "" : not_of_this();
  }

  void Sampling::open(const bool resumed)
  {
    samples_csv = table("samples.csv", sample_fields(0, {}, {}), resumed);
    // The uninterrupted run's basis had grown by the samples before.
    if (resumed && is_projected)
      log.line(
          "The basis of the projection begins anew: the last digits of the samples that follow "
          "differ from those of an uninterrupted run, within reduction_error_1_per_s.");
    log.line(text_of("\n", points.size(), " samples of ", varied.parameters.size(),
                     " uncertain numbers, ", frequencies.size(), " branches"));
  }

  const Sampling::Growth &Sampling::growth_of(const unsigned int sample, const int branch) const
  {
    return branch < 0 ? outcomes[sample].largest : outcomes[sample].branches[branch];
  }

  std::vector<double> Sampling::growth_rates(const int branch, const unsigned int first,
                                             const unsigned int n) const
  {
    std::vector<double> result;
    for (unsigned int k = first; k < first + n; ++k)
      result.push_back(growth_of(k, branch).value);
    return result;
  }

  Fields Sampling::probability_fields(const int branch) const
  {
    unsigned int n_known = 0, n_grow = 0, of_mesh[2] = {0, 0}, of_solver[2] = {0, 0};
    const unsigned int n = n_with_modes();
    std::vector<double> rates;
    double mean = 0, square = 0;
    for (unsigned int k = 0; n > 0 && k < (has_indices() ? 2 * n_base : n_base); ++k)
    {
      const Growth &growth = growth_of(k, branch);
      if (!growth.is_known())
        continue;
      ++n_known;
      rates.push_back(growth.value);
      n_grow += growth.value > 0;
      for (unsigned int side = 0; side < 2; ++side)
      {
        of_mesh[side] += growth.by_mesh[side] > 0;
        of_solver[side] += growth.by_solver[side] > 0;
      }
    }
    for (const double rate : rates)
      mean += rate / n_known;
    for (const double rate : rates)
      square += (rate - mean) * (rate - mean) / n_known;
    // A mode that has left the window, or is none of the centre's, does not grow on this branch.
    const Share share = share_of(n_grow, n);
    const auto off_by = [&](const unsigned int(&hits)[2])
    {
      return double(std::max(n_grow - std::min(n_grow, hits[0]),
                             hits[1] - std::min(n_grow, hits[1]))) /
             std::max(n, 1u);
    };
    const auto field = [&](const double x) { return n_known > 0 ? number(x) : ""; };
    return {{"branch", branch < 0 ? "any" : std::to_string(branch + 1)},
            {"frequency_hz", branch < 0 || frequencies.empty() ? "" : number(frequencies[branch])},
            {"samples", n},
            {"samples_with_branch", n_known},
            {"probability", n > 0 ? number(share.value) : ""},
            {"sampling_error", n > 0 ? number(share.error) : ""},
            {"reduction_error", n > 0 ? number(off_by(of_solver)) : ""},
            {"mesh_error", n > 0 && estimator ? number(off_by(of_mesh)) : ""},
            {"growth_rate_mean_1_per_s", field(mean)},
            {"growth_rate_deviation_1_per_s", field(std::sqrt(square))},
            {"growth_rate_5_percent_1_per_s", field(quantile_of(rates, 0.05))},
            {"growth_rate_50_percent_1_per_s", field(quantile_of(rates, 0.5))},
            {"growth_rate_95_percent_1_per_s", field(quantile_of(rates, 0.95))}};
  }

  SensitivityIndices Sampling::indices_of(const int branch, const unsigned int parameter) const
  {
    return sensitivity_indices(growth_rates(branch, 0, n_base),
                               growth_rates(branch, n_base, n_base),
                               growth_rates(branch, (2 + parameter) * n_base, n_base));
  }

  Fields Sampling::indices_fields(const int branch, const unsigned int parameter,
                                  const SensitivityIndices &indices) const
  {
    return {{"branch", branch < 0 ? "any" : std::to_string(branch + 1)},
            {"parameter", varied.parameters[parameter]},
            {"first_order", indices.first_order.value},
            {"first_order_error", indices.first_order.error},
            {"total", indices.total.value},
            {"total_error", indices.total.error}};
  }

  void Sampling::conclude()
  {
    write_probabilities();
    if (has_indices())
      write_indices();
    tell_full_solutions(", the centre and bars");
  }

  void Sampling::write_probabilities() const
  {
    const auto probability = table("probability.csv", probability_fields(-1), false);
    const unsigned int n   = n_with_modes();
    if (n == 0)
    {
      for (int branch = -1; branch < int(frequencies.size()); ++branch)
        probability->add(probability_fields(branch));
      log.line("\n  No sample has a mode: there is no probability.");
      return;
    }
    log.line("\n  branch   frequency, Hz   probability of growth   +- samples    +- solver      "
             "+- mesh   growth rate, 1/s: 5 %, 50 %, 95 %");
    for (int branch = -1; branch < int(frequencies.size()); ++branch)
    {
      const Fields fields = probability_fields(branch);
      probability->add(fields);
      const auto value = [&](const std::string &column)
      {
        const auto at = std::find_if(fields.begin(), fields.end(),
                                     [&](const Field &field) { return field.column == column; });
        return at->text.empty() ? std::nan("") : std::stod(at->text);
      };
      if (branch >= 0 && value("probability") == 0 &&
          !(value("mesh_error") > 0 || value("reduction_error") > 0))
        continue;
      log.line(formatted(
          "  %6s   %13s   %21.4f   %10.4f   %10.4f   %10.4f   %.5g, %.5g, %.5g",
          branch < 0 ? "any" : std::to_string(branch + 1).c_str(),
          branch < 0 ? "" : number(frequencies[branch], 6).c_str(), value("probability"),
          value("sampling_error"), value("reduction_error"), estimator ? value("mesh_error") : 0.,
          value("growth_rate_5_percent_1_per_s"), value("growth_rate_50_percent_1_per_s"),
          value("growth_rate_95_percent_1_per_s")));
    }
    log.line("  Branches that grow at none of " + std::to_string(n) +
             " samples with modes, nor may, are in probability.csv only." +
             (estimator ? "" : " There are no bars of the mesh."));
  }

  void Sampling::write_indices() const
  {
    const auto indices_csv = table("indices.csv", indices_fields(-1, 0, {}), false);
    log.line("\n  Shares of the variance of the largest growth rate: first order, total");
    for (int branch = -1; branch < int(frequencies.size()); ++branch)
      for (unsigned int i = 0; i < varied.parameters.size(); ++i)
      {
        const SensitivityIndices indices = indices_of(branch, i);
        indices_csv->add(indices_fields(branch, i, indices));
        if (branch < 0)
          log.line(formatted("  %8.3f +- %.3f   %8.3f +- %.3f   ", indices.first_order.value,
                             indices.first_order.error, indices.total.value, indices.total.error) +
                   varied.parameters[i]);
      }
  }
} // namespace squeal
