#include <squeal/bars/convergence.h>

#include <deal.II/base/convergence_table.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace squeal
{
  namespace
  {
    /// Three successive meshes: the values of one quantity and the sizes.
    struct Triple
    {
      std::array<double, 3> x, h;

      std::optional<double> order() const
      {
        return observed_order((x[0] - x[1]) / (x[1] - x[2]), h[0], h[1], h[2]);
      }
      double limit(const double q) const
      {
        return x[2] + (x[2] - x[1]) / (std::pow(h[1] / h[2], q) - 1);
      }
    };

    /// The limit of the last of several values, if their order is stable.
    std::optional<double> extrapolate(const std::vector<double> &x, const std::vector<double> &h,
                                      const std::optional<double> &order_of_eigenvalue,
                                      const unsigned int degree)
    {
      const unsigned int n = x.size();
      if (n < 3)
        return {};
      const auto triple = [&](const unsigned int end) {
        return Triple{{{x[end - 3], x[end - 2], x[end - 1]}},
                      {{h[end - 3], h[end - 2], h[end - 1]}}};
      };
      const std::optional<double> q      = triple(n).order(),
                                  before = n > 3 ? triple(n - 1).order() : order_of_eigenvalue;
      if (!q || !before || *q < 0.5 || *q > 2 * degree + 0.5 || std::abs(*q - *before) > *q / 3)
        return {};
      return triple(n).limit(*q);
    }

    double frequency(const std::complex<double> &lambda)
    {
      return std::abs(lambda.imag()) / (2 * M_PI);
    }

    /// The reference's value of each mode, or -1. A reference may be the truth, near the corrected
    /// value, or made on a mesh like this, near the computed one.
    std::vector<int> match_reference(const std::vector<ModeRow> &rows,
                                     const std::vector<std::complex<double>> &reference)
    {
      std::vector<std::vector<double>> costs(rows.size());
      for (unsigned int j = 0; j < rows.size(); ++j)
        for (const std::complex<double> &lambda : reference)
          costs[j].push_back(
              std::min(std::norm(rows[j].lambda - lambda),
                       std::norm(rows[j].corrected.value_or(rows[j].lambda) - lambda)));
      return assign(costs, reference.size());
    }
  } // namespace

  std::optional<double> observed_order(const double ratio, const double h0, const double h1,
                                       const double h2)
  {
    if (!(std::isfinite(ratio) && h0 > h1 && h1 > h2))
      return {};
    // (s^q - 1)/(1 - t^-q) with s = h0/h1, t = h1/h2 grows with q.
    const auto ratio_of = [&](const double q)
    { return std::expm1(q * std::log(h0 / h1)) / -std::expm1(-q * std::log(h1 / h2)); };
    double low = 1e-6, high = 30;
    if (!(ratio > ratio_of(low) && ratio < ratio_of(high)))
      return {};
    for (unsigned int step = 0; step < 60; ++step)
    {
      const double middle                     = (low + high) / 2;
      (ratio_of(middle) < ratio ? low : high) = middle;
    }
    return (low + high) / 2;
  }

  std::vector<ConvergenceRow> convergence_rows(const std::vector<std::vector<ModeRow>> &cycles,
                                               const std::vector<unsigned int> &dofs,
                                               const std::vector<double> &mesh_sizes,
                                               const unsigned int degree,
                                               const std::vector<std::complex<double>> &reference)
  {
    std::vector<ConvergenceRow> rows;
    if (cycles.empty())
      return rows;
    const std::vector<ModeRow> &finest = cycles.back();
    std::vector<std::vector<int>> match;
    for (const auto &cycle : cycles)
      match.push_back(match_modes(finest, cycle));
    const std::vector<int> match_of_reference = match_reference(finest, reference);

    for (unsigned int m = 0; m < finest.size(); ++m)
    {
      // Of the meshes up to the present one that follow each other without a gap.
      std::vector<std::complex<double>> lambda;
      std::vector<double> growth_rates, frequencies, sizes;
      for (unsigned int c = 0; c < cycles.size(); ++c)
      {
        if (match[c][m] < 0)
        {
          lambda.clear();
          growth_rates.clear();
          frequencies.clear();
          sizes.clear();
          continue;
        }
        ConvergenceRow row;
        row.mode   = cycles[c][match[c][m]];
        row.number = finest[m].mode;
        row.dofs   = dofs[c];
        if (match_of_reference[m] >= 0)
          row.reference = reference[match_of_reference[m]];
        lambda.push_back(row.mode.lambda);
        growth_rates.push_back(row.mode.growth_rate());
        frequencies.push_back(row.mode.frequency());
        sizes.push_back(mesh_sizes[c]);
        const unsigned int n = lambda.size();
        if (n >= 2)
        {
          const double change = std::abs(lambda[n - 1] - lambda[n - 2]);
          row.change          = change / std::abs(lambda[n - 1]);
          if (n >= 3)
            row.rate = observed_order(std::abs(lambda[n - 2] - lambda[n - 3]) / change,
                                      sizes[n - 3], sizes[n - 2], sizes[n - 1]);
        }
        row.extrapolated_growth_rate = extrapolate(growth_rates, sizes, row.rate, degree);
        row.extrapolated_frequency   = extrapolate(frequencies, sizes, row.rate, degree);
        rows.push_back(row);
      }
    }
    return rows;
  }

  Fields convergence_fields(const ConvergenceRow &row)
  {
    const ModeRow &mode = row.mode;
    std::optional<double> f, g, f_error, g_error;
    if (row.reference)
    {
      f       = frequency(*row.reference);
      g       = row.reference->real();
      f_error = std::abs(mode.frequency() - *f);
      g_error = std::abs(mode.growth_rate() - *g);
    }
    // Bar / true error; x/0 is left out.
    const auto effectivity =
        [](const std::optional<double> &bar, const std::optional<double> &error)
    { return bar && error ? std::optional<double>(*bar / *error) : std::nullopt; };
    return {{"mode", row.number},
            {"cycle", mode.cycle},
            {"dofs", row.dofs},
            {"frequency_hz", mode.frequency()},
            {"growth_rate_1_per_s", mode.growth_rate()},
            {"frequency_error_hz", mode.frequency_error},
            {"growth_rate_error_1_per_s", mode.growth_rate_error},
            {"corrected_frequency_hz", mode.corrected_frequency()},
            {"corrected_growth_rate_1_per_s", mode.corrected_growth_rate()},
            {"change", row.change},
            {"rate", row.rate},
            {"extrapolated_frequency_hz", row.extrapolated_frequency},
            {"extrapolated_growth_rate_1_per_s", row.extrapolated_growth_rate},
            {"reference_frequency_hz", f},
            {"reference_growth_rate_1_per_s", g},
            {"true_frequency_error_hz", f_error},
            {"true_growth_rate_error_1_per_s", g_error},
            {"frequency_effectivity", effectivity(mode.frequency_error, f_error)},
            {"growth_rate_effectivity", effectivity(mode.growth_rate_error, g_error)}};
  }

  std::string convergence_table(const std::vector<ConvergenceRow> &rows)
  {
    if (rows.empty())
      return "";
    dealii::ConvergenceTable table;
    for (const ConvergenceRow &row : rows)
    {
      table.add_value("mode", row.number);
      table.add_value("cycle", row.mode.cycle);
      table.add_value("unknowns", row.dofs);
      table.add_value("frequency, Hz", row.mode.frequency());
      table.add_value("growth rate, 1/s", row.mode.growth_rate());
      table.add_value("change", row.change ? formatted("%.2e", *row.change) : "-");
      table.add_value("rate", row.rate ? formatted("%.2f", *row.rate) : "-");
    }
    table.set_precision("frequency, Hz", 5);
    table.set_precision("growth rate, 1/s", 5);
    std::ostringstream text;
    table.write_text(text, dealii::TableHandler::org_mode_table);
    return text.str();
  }

  namespace
  {
    /// A number in math mode, since a minus sign in text is a hyphen.
    std::string math(const double value, const char *format)
    {
      const std::string digits = formatted(format, value);
      const auto exponent      = digits.find('e');
      if (exponent == std::string::npos)
        return "$" + digits + "$";
      return "$" + digits.substr(0, exponent) + " \\cdot 10^{" +
             std::to_string(std::stoi(digits.substr(exponent + 1))) + "}$";
    }

    std::string math(const std::optional<double> &value, const char *format)
    {
      return value ? math(*value, format) : "--";
    }
  } // namespace

  std::string convergence_tex(const std::vector<ConvergenceRow> &rows)
  {
    // A tabular does not break over pages: a new one begins when a page is full.
    constexpr unsigned int lines_per_page = 42;
    const std::string head =
        "\\begin{tabular}{rrrrrrrr}\n"
        "  \\toprule\n"
        "  mode & mesh & unknowns & frequency, Hz & $\\pm$ & growth rate, 1/s & $\\pm$ & rate "
        "\\\\\n"
        "  \\midrule\n";
    const std::string foot = "  \\bottomrule\n\\end{tabular}\n";
    std::string text       = "% Modes over the meshes, +- error bars. For a document with "
                             "\\usepackage{booktabs}: \\input{convergence.tex}\n";
    text += head;
    unsigned int n_lines = 0;
    for (unsigned int i = 0; i < rows.size(); ++i)
    {
      const ConvergenceRow &row = rows[i];
      const bool is_new         = i == 0 || row.number != rows[i - 1].number;
      if (is_new && i > 0)
      {
        unsigned int size = 0;
        while (i + size < rows.size() && rows[i + size].number == row.number)
          ++size;
        if (n_lines + size > lines_per_page)
        {
          text += foot + "\n\\clearpage\n" + head;
          n_lines = 0;
        }
        else
          text += "  \\addlinespace\n";
      }
      text += "  " + (is_new ? std::to_string(row.number) : "") + " & " +
              std::to_string(row.mode.cycle) + " & " + std::to_string(row.dofs) + " & " +
              math(row.mode.frequency(), "%.4f") + " & " + math(row.mode.frequency_error, "%.1e") +
              " & " + math(row.mode.growth_rate(), "%.4f") + " & " +
              math(row.mode.growth_rate_error, "%.1e") + " & " + math(row.rate, "%.2f") + " \\\\\n";
      ++n_lines;
    }
    return text + foot;
  }
} // namespace squeal
