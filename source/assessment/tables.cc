#include <squeal/assessment/tables.h>
#include <squeal/base/log.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

namespace squeal
{
  namespace
  {
    std::string line_of(const std::vector<std::string> &texts)
    {
      std::string line;
      for (const std::string &text : texts)
        line += (&text == &texts.front() ? "" : ",") + text;
      return line + "\n";
    }
  } // namespace

  Table::Table(const std::string &filename, const Fields &sample, const MPI_Comm comm,
               const bool append)
      : filename(filename), writes(is_rank_zero(comm))
  {
    if (!writes || (append && std::filesystem::exists(filename)))
      return;
    std::vector<std::string> names;
    for (const Field &field : sample)
      names.push_back(field.column);
    write_file(filename, [&](std::ostream &out) { out << line_of(names); });
  }

  void Table::add(const Fields &fields)
  {
    if (!writes)
      return;
    std::vector<std::string> texts;
    for (const Field &field : fields)
      texts.push_back(field.text);
    append_to_file(filename, line_of(texts));
  }

  Fields operator+(Fields fields, const Fields &more)
  {
    fields.insert(fields.end(), more.begin(), more.end());
    return fields;
  }

  Fields modes_fields(const ModeRow &row)
  {
    return {{"cycle", row.cycle},
            {"mode", row.mode},
            {"growth_rate_1_per_s", row.growth_rate()},
            {"frequency_hz", row.frequency()},
            {"damping_ratio", row.damping_ratio()},
            {"verdict", name_of(row.verdict)},
            {"growth_rate_error_1_per_s", row.growth_rate_error},
            {"frequency_error_hz", row.frequency_error},
            {"backward_error", row.backward_error},
            {"condition_number", row.condition_number},
            {"d_1_per_s", row.d},
            {"g_1_per_s", row.g},
            {"k_1_per_s2", row.k},
            {"n_1_per_s2", row.n},
            {"rayleigh_defect", row.rayleigh_defect},
            {"criterion_1_per_s4", row.criterion},
            {"left_backward_error", row.left_backward_error},
            {"corrected_growth_rate_1_per_s", row.corrected_growth_rate()},
            {"corrected_frequency_hz", row.corrected_frequency()},
            {"mirror", name_of(row.parity)}};
  }

  Fields shape_fields(const std::optional<ModeShape> &shape)
  {
    const auto field      = [&](const double x) { return shape ? number(x, 6) : ""; };
    const auto count      = [&](const unsigned int n) { return shape ? std::to_string(n) : ""; };
    const ModeShape known = shape.value_or(ModeShape());
    return {{"shape", shape ? name_of(known) : ""},
            {"nodal_diameters", count(known.nodal_diameters)},
            {"nodal_circles", count(known.nodal_circles)},
            {"rotor_share", field(known.rotor_share)},
            {"axial_share", field(known.axial_share)},
            {"order_share", field(known.order_share)},
            {"travelling", field(known.travelling)}};
  }

  Fields contributions_fields(const unsigned int cycle, const Contribution &c)
  {
    return {{"cycle", cycle},
            {"mode", c.mode},
            {"origin", c.origin},
            {"body", c.body},
            {"d_1_per_s", c.d},
            {"g_1_per_s", c.g},
            {"k_1_per_s2", c.k},
            {"n_1_per_s2", c.n},
            {"growth_rate_1_per_s", c.growth_rate},
            {"energy_per_cycle_j", c.energy}};
  }

  Fields sensitivities_fields(const unsigned int cycle, const unsigned int mode,
                              const ParameterDerivative &derivative,
                              const std::complex<double> d_lambda)
  {
    const double growth = d_lambda.real(), frequency = d_lambda.imag() / (2 * M_PI),
                 value = derivative.value;
    return {{"cycle", cycle},
            {"mode", mode},
            {"parameter", derivative.parameter},
            {"value", value},
            {"d_growth_rate_1_per_s", growth},
            {"d_frequency_hz", frequency},
            {"relative_d_growth_rate_1_per_s", value * growth},
            {"relative_d_frequency_hz", value * frequency}};
  }

  std::string contributions_table(const std::vector<Contribution> &contributions,
                                  const std::vector<unsigned int> &modes)
  {
    std::string text;
    for (const unsigned int mode : modes)
    {
      std::vector<std::pair<std::string, double>> sums;
      double total = 0;
      for (const Contribution &c : contributions)
        if (c.mode == mode)
        {
          const auto known = std::find_if(sums.begin(), sums.end(),
                                          [&](const auto &sum) { return sum.first == c.origin; });
          (known == sums.end() ? sums.emplace_back(c.origin, 0.) : *known).second += c.growth_rate;
          total += c.growth_rate;
        }
      std::sort(sums.begin(), sums.end(),
                [](const auto &a, const auto &b) { return a.second > b.second; });
      double largest = 0;
      for (const auto &[origin, growth] : sums)
        largest = std::max(largest, std::abs(growth));
      // Small ones would be zeros.
      const bool is_small = largest < 0.1;
      text += "  Mode " + std::to_string(mode) + ", growth rate " +
              formatted(is_small ? "%.5g" : "%.5f", total) + " 1/s =";
      for (const auto &[origin, growth] : sums)
        if (std::abs(growth) > 1e-6 * largest)
          text += " " + formatted(is_small ? "%+.5g" : "%+.5f", growth) + " " + origin;
      text += "\n";
    }
    return text;
  }

  std::string ladder_table(const std::vector<std::string> &stages,
                           const std::vector<std::vector<ModeRow>> &rows)
  {
    std::string text = "  mode   frequency, Hz";
    for (const std::string &stage : stages)
      text += formatted("   %20s", stage.c_str());
    text += "\n";
    std::vector<std::vector<int>> partners;
    for (const auto &stage : rows)
      partners.push_back(match_modes(rows.back(), stage));
    for (unsigned int j = 0; j < rows.back().size(); ++j)
    {
      text += formatted("  %4u   %13.3f", rows.back()[j].mode, rows.back()[j].frequency());
      for (unsigned int s = 0; s < rows.size(); ++s)
        if (const int partner = partners[s][j]; partner < 0)
          text += formatted("   %20s", "-");
        else
          text += formatted("   %10.3f %9s", rows[s][partner].growth_rate(),
                            name_of(rows[s][partner].verdict).c_str());
      text += "\n";
    }
    return text;
  }

  std::string modes_table(const std::vector<ModeRow> &rows)
  {
    const bool bars = std::any_of(rows.begin(), rows.end(),
                                  [](const ModeRow &row)
                                  { return row.growth_rate_error || row.frequency_error; });
    std::string text =
        bars ? "  mode   frequency, Hz +- bar      growth rate, 1/s +- bar      damping ratio   "
               "backw. error   condition   verdict\n"
             : "  mode   frequency, Hz   growth rate, 1/s   damping ratio   backward error   "
               "condition   verdict\n";
    for (const ModeRow &row : rows)
    {
      text += formatted(bars ? "%s %4u   %s   %s   %13.3e   %12.1e   %9.2e   %s\n"
                             : "%s %4u   %s   %s   %13.3e   %14.1e   %9.2e   %s\n",
                        row.is_unstable() ? ">" : " ", row.mode,
                        with_bar(row.frequency(), 4, bars ? 11 : 13, row.frequency_error).c_str(),
                        with_bar(row.growth_rate(), 5, bars ? 14 : 16, row.growth_rate_error,
                                 row.is_unstable() && row.growth_rate() < 1e-3)
                            .c_str(),
                        row.damping_ratio(), row.backward_error, row.condition_number.value_or(0),
                        name_of(row.verdict).c_str());
    }
    return text;
  }
} // namespace squeal
