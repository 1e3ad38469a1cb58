#include <squeal/assessment/stability.h>
#include <squeal/base/text.h>
#include <squeal/run/bar_report.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace squeal
{
  namespace
  {
    const std::string more_degree = "one degree more", edge = "edge of contact",
                      edge_of_joint = "edge of ";

    bool is_of(const BarPart &part, const std::string &cause)
    {
      return part.cause.rfind(cause, 0) == 0;
    }

    /// "0.62 one degree more (0.58 pad, 0.1 rotor), 0.3 edge of contact (0.3 upper pad)": largest
    /// first, without what is small beside the bar.
    std::string text_of_parts(const std::vector<BarPart> &parts, const unsigned int j,
                              const double bar)
    {
      constexpr double small = 0.05; // of the bar
      // The edge of a joint has a line of its own.
      const auto has_line = [&](const std::string &at)
      {
        return std::any_of(parts.begin(), parts.end(),
                           [&](const BarPart &part) { return part.cause == edge_of_joint + at; });
      };
      const auto listed = [&](const bool whole, const std::string &cause)
      {
        std::vector<const BarPart *> chosen;
        for (const BarPart &part : parts)
          if (part.at.empty() == whole && is_of(part, cause) &&
              part.growth_rate[j] >= small * bar && (whole || !has_line(part.at)))
            chosen.push_back(&part);
        std::stable_sort(chosen.begin(), chosen.end(),
                         [&](const BarPart *a, const BarPart *b)
                         { return a->growth_rate[j] > b->growth_rate[j]; });
        return chosen;
      };
      std::string text;
      for (const BarPart *part : listed(true, ""))
      {
        text +=
            text_of(text.empty() ? "" : ", ", number(part->growth_rate[j], 2), " ", part->cause);
        std::string places;
        for (const BarPart *at : listed(false, part->cause))
          places += text_of(places.empty() ? "" : ", ", number(at->growth_rate[j], 2), " ", at->at);
        text += places.empty() ? "" : " (" + places + ")";
      }
      return text;
    }

    /// What an undecided bar has most of, and where that is, as far as it is known: at each place
    /// that has half as much as the largest.
    struct MainPart
    {
      std::string cause, at;
      unsigned int n_places;
    };
    MainPart main_part(const std::vector<BarPart> &parts, const unsigned int j)
    {
      const BarPart *whole = &parts[0]; // which come before those of bodies and contacts
      for (const BarPart &part : parts)
        if (part.at.empty() && part.growth_rate[j] > whole->growth_rate[j])
          whole = &part;
      // Levels of an edge have their places in common; kinds of cells are those of one degree more.
      for (const BarPart &part : parts)
        if (whole->cause == edge_of_joint + part.at)
          return {edge, part.at, 1};
      MainPart result{is_of(*whole, edge)       ? edge
                      : is_of(*whole, "unlike") ? more_degree
                                                : whole->cause,
                      "", 0};
      double largest = 0;
      for (const BarPart &part : parts)
        if (!part.at.empty() && is_of(part, result.cause))
          largest = std::max(largest, part.growth_rate[j]);
      for (const BarPart &part : parts)
        if (!part.at.empty() && is_of(part, result.cause) && part.growth_rate[j] > largest / 2)
          result.at += (result.n_places++ > 0 ? ", " : "") + part.at;
      return result;
    }

    std::string remedy(const MainPart &part, const Parameters::All &prm, const NextDegree &next)
    {
      const unsigned int p    = prm.discretization.degree;
      const std::string finer = prm.scene == Scene::mesh ? "smaller elements (Mesh/Refinements)"
                                                         : "more cells",
                        higher =
                            text_of("Discretization/Degree = ", p + 1, " (about ",
                                    number(next.n_unknowns, 2), " unknowns",
                                    next.memory_mib > 0
                                        ? text_of(", ", number(next.memory_mib / 1024, 2), " GiB")
                                        : "",
                                    ")");
      if (part.cause == edge && part.n_places > 0)
        return text_of("smaller elements where ", part.at,
                       part.n_places > 1 ? " lift off" : " lifts off",
                       ", or Refinement/Contact edge levels");
      if (part.cause == more_degree)
        return text_of(finer, " in ", part.n_places > 0 ? part.at : "all bodies", ", or ", higher);
      return higher;
    }
  } // namespace

  Fields bar_fields(const unsigned int cycle, const unsigned int mode, const BarPart &part,
                    const unsigned int j)
  {
    const bool is_sample = part.growth_rate.empty();
    return {{"cycle", cycle},
            {"mode", mode},
            {"cause", part.cause},
            {"at", part.at},
            {"growth_rate_1_per_s", is_sample ? 0 : part.growth_rate[j]},
            {"frequency_hz", is_sample ? 0 : part.imaginary[j] / (2 * M_PI)}};
  }

  std::string describe_bars(const std::vector<ModeRow> &rows, const std::vector<BarPart> &parts,
                            const Parameters::All &prm, const NextDegree &next)
  {
    constexpr unsigned int most = 10;
    if (parts.empty())
      return {};
    std::string lines;
    std::map<std::string, std::string> modes_by_remedy;
    unsigned int n_lines = 0;
    for (unsigned int j = 0; j < rows.size(); ++j)
    {
      const bool is_undecided = rows[j].verdict == Verdict::undecided;
      if (!is_undecided && !rows[j].is_unstable())
        continue;
      const double bar = rows[j].growth_rate_error.value_or(0);
      if (n_lines++ < most)
        lines += text_of("  Mode ", rows[j].mode, ", ", name_of(rows[j].verdict), ", ",
                         number(rows[j].lambda.real(), 4), " +- ", number(bar, 3),
                         " 1/s: ", text_of_parts(parts, j, bar), "\n");
      if (is_undecided)
      {
        std::string &modes = modes_by_remedy[remedy(main_part(parts, j), prm, next)];
        modes += text_of(modes.empty() ? "" : ", ", rows[j].mode);
      }
    }
    if (lines.empty())
      return {};
    if (n_lines > most)
      lines += text_of("  and ", n_lines - most, " more: bars.csv\n");
    for (const auto &[what, modes] : modes_by_remedy)
      lines += text_of("To decide mode", modes.find(',') == std::string::npos ? " " : "s ", modes,
                       ": ", what, ".\n");
    return "What the bars are made of, each part alone, 1/s\n" + lines;
  }

  std::string describe_margins(const std::vector<ModeRow> &rows, std::vector<VerdictMargin> margins)
  {
    constexpr unsigned int most_lines = 10, most_parameters = 3;
    constexpr double far = 1; // doubled: derivatives say nothing of that
    margins.erase(std::remove_if(margins.begin(), margins.end(),
                                 [](const VerdictMargin &margin)
                                 { return !(std::abs(margin.relative_change) < far); }),
                  margins.end());
    std::stable_sort(margins.begin(), margins.end(),
                     [](const VerdictMargin &a, const VerdictMargin &b)
                     { return std::abs(a.relative_change) < std::abs(b.relative_change); });
    std::vector<unsigned int> shown;
    for (unsigned int j = 0; j < rows.size() && shown.size() < most_lines; ++j)
      if (rows[j].is_unstable() || rows[j].verdict == Verdict::undecided)
        shown.push_back(j);
    if (shown.empty() && !rows.empty())
      shown = {least_stable(rows)};
    std::string lines;
    for (const unsigned int j : shown)
    {
      std::string changes;
      unsigned int n = 0;
      for (const VerdictMargin &margin : margins)
        if (margin.row == j && n < most_parameters)
          changes += text_of(n++ > 0 ? ", " : "", margin.parameter, " ",
                             formatted("%+.2g %%", 100 * margin.relative_change));
      lines += text_of("  Mode ", rows[j].mode, ", ", name_of(rows[j].verdict), ": ",
                       changes.empty() ? "no parameter within its double" : changes, "\n");
    }
    return lines.empty()
               ? lines
               : "The growth rate is zero, by derivatives of single parameters, at\n" + lines;
  }
} // namespace squeal
