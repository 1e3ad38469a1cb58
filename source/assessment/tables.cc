#include <squeal/assessment/tables.h>
#include <squeal/base/errors.h>
#include <squeal/base/log.h>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace squeal
{
  namespace
  {
    std::string formatted(const char *format, const double value)
    {
      char text[64];
      std::snprintf(text, sizeof(text), format, value);
      return text;
    }
  } // namespace

  std::string number(const double value, const int n_digits)
  {
    return std::isfinite(value) ? formatted(("%." + std::to_string(n_digits) + "g").c_str(), value)
                                : "";
  }

  std::string number(const std::optional<double> &value)
  {
    return value ? number(*value) : "";
  }

  namespace
  {
    /// Results of an earlier run, which must not be taken for those of the next.
    bool is_result(const std::filesystem::path &path)
    {
      const std::string name = path.filename(), extension = path.extension();
      static const std::vector<std::string> names = {
          "modes.csv",  "contributions.csv", "sensitivities.csv", "cycles.csv", "static.csv",
          "ladder.csv", "convergence.csv",   "convergence.tex",   "sweep.csv",  "critical.csv",
          "map.csv",    "border.csv",        "mesh.csv",          "log.txt",    "report.html"};
      static const std::vector<std::string> extensions = {".vtu", ".pvtu", ".pvd", ".state"};
      return std::count(names.begin(), names.end(), name) > 0 ||
             std::count(extensions.begin(), extensions.end(), extension) > 0;
    }

    /// On one rank.
    bool make_run_directory(const std::filesystem::path &directory, const ParameterFile &file)
    {
      const std::string key = "Output/Directory = " + directory.string();
      std::error_code code;
      std::filesystem::create_directories(directory, code);
      if (code)
        throw InputError(key + ": the directory cannot be made (" + code.message() + ").");
      try
      {
        std::ostringstream used;
        file.print_used(used);
        // A run of the same parameters that was interrupted is resumed.
        const std::filesystem::path record = directory / "parameters.prm";
        std::ostringstream before;
        if (std::filesystem::exists(record))
          before << std::ifstream(record, std::ios::binary).rdbuf();
        bool resumable = false;
        for (const auto &entry : std::filesystem::directory_iterator(directory))
          resumable |= entry.path().extension() == ".state" && before.str() == used.str();
        write_file(directory / "original.prm",
                   [&](std::ostream &out) { out << file.original_text(); });
        write_file(record, [&](std::ostream &out) { out << used.str(); });
        for (const auto &entry : std::filesystem::directory_iterator(directory))
          if (entry.path().extension() == ".part" || (!resumable && is_result(entry.path())))
            std::filesystem::remove(entry.path());
        return resumable;
      }
      catch (const std::exception &error)
      {
        throw InputError(key + ": " + error.what());
      }
    }
  } // namespace

  bool start_run_directory(const std::string &directory, const ParameterFile &file,
                           const MPI_Comm comm)
  {
    std::string error;
    bool resumable = false;
    if (is_rank_zero(comm))
      try
      {
        resumable = make_run_directory(directory, file);
      }
      catch (const std::exception &e)
      {
        error = e.what();
      }
    error = dealii::Utilities::MPI::broadcast(comm, error);
    if (!error.empty())
      throw InputError(error);
    return dealii::Utilities::MPI::broadcast(comm, resumable);
  }

  Table::Table(const std::string &filename, const std::string &header, const MPI_Comm comm,
               const bool append)
      : filename(filename), writes(is_rank_zero(comm))
  {
    if (writes && !(append && std::filesystem::exists(filename)))
      write_file(filename, [&](std::ostream &out) { out << header << '\n'; });
  }

  void Table::add(const std::vector<std::string> &fields)
  {
    if (!writes)
      return;
    std::string line;
    for (const std::string &field : fields)
      line += (line.empty() && &field == &fields.front() ? "" : ",") + field;
    append_to_file(filename, line + "\n");
  }

  const char *modes_header =
      "cycle,mode,growth_rate_1_per_s,frequency_hz,damping_ratio,verdict,"
      "growth_rate_error_1_per_s,frequency_error_hz,backward_error,condition_number,"
      "d_1_per_s,g_1_per_s,k_1_per_s2,n_1_per_s2,rayleigh_defect,criterion_1_per_s4,"
      "left_backward_error,corrected_growth_rate_1_per_s,corrected_frequency_hz,mirror";

  const char *contributions_header =
      "cycle,mode,origin,body,d_1_per_s,g_1_per_s,k_1_per_s2,n_1_per_s2,growth_rate_1_per_s,"
      "energy_per_cycle_j";

  const char *sensitivities_header =
      "cycle,mode,parameter,value,d_growth_rate_1_per_s,d_frequency_hz,"
      "relative_d_growth_rate_1_per_s,relative_d_frequency_hz";

  std::vector<std::string> contributions_fields(const unsigned int cycle, const Contribution &c)
  {
    return {std::to_string(cycle),
            std::to_string(c.mode),
            c.origin,
            c.body,
            number(c.d),
            number(c.g),
            number(c.k),
            number(c.n),
            number(c.growth_rate),
            number(c.energy)};
  }

  std::vector<std::string> sensitivities_fields(const unsigned int cycle, const unsigned int mode,
                                                const ParameterDerivative &derivative,
                                                const std::complex<double> d_lambda)
  {
    const double growth = d_lambda.real(), frequency = d_lambda.imag() / (2 * M_PI),
                 value = derivative.value;
    return {std::to_string(cycle),  std::to_string(mode),     derivative.parameter,
            number(value),          number(growth),           number(frequency),
            number(value * growth), number(value * frequency)};
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
      text +=
          "  Mode " + std::to_string(mode) + ", growth rate " + formatted("%.5f", total) + " 1/s =";
      for (const auto &[origin, growth] : sums)
        if (std::abs(growth) > 1e-6 * largest)
          text += " " + formatted("%+.5f", growth) + " " + origin;
      text += "\n";
    }
    return text;
  }

  std::string ladder_table(const std::vector<std::string> &stages,
                           const std::vector<std::vector<ModeRow>> &rows)
  {
    std::string text = "  mode   frequency, Hz";
    char field[80];
    for (const std::string &stage : stages)
    {
      std::snprintf(field, sizeof(field), "   %20s", stage.c_str());
      text += field;
    }
    text += "\n";
    std::vector<std::vector<int>> partners;
    for (const auto &stage : rows)
      partners.push_back(match_modes(rows.back(), stage));
    for (unsigned int j = 0; j < rows.back().size(); ++j)
    {
      std::snprintf(field, sizeof(field), "  %4u   %13.3f", rows.back()[j].mode,
                    rows.back()[j].frequency());
      text += field;
      for (unsigned int s = 0; s < rows.size(); ++s)
      {
        const int partner = partners[s][j];
        if (partner < 0)
          std::snprintf(field, sizeof(field), "   %20s", "-");
        else
          std::snprintf(field, sizeof(field), "   %10.3f %9s", rows[s][partner].growth_rate(),
                        name_of(rows[s][partner].verdict).c_str());
        text += field;
      }
      text += "\n";
    }
    return text;
  }

  std::vector<std::string> modes_fields(const ModeRow &row)
  {
    return {std::to_string(row.cycle),
            std::to_string(row.mode),
            number(row.growth_rate()),
            number(row.frequency()),
            number(row.damping_ratio()),
            name_of(row.verdict),
            number(row.growth_rate_error),
            number(row.frequency_error),
            number(row.backward_error),
            number(row.condition_number),
            number(row.d),
            number(row.g),
            number(row.k),
            number(row.n),
            number(row.rayleigh_defect),
            number(row.criterion),
            number(row.left_backward_error),
            row.corrected ? number(row.corrected->real()) : "",
            row.corrected ? number(std::abs(row.corrected->imag()) / (2 * M_PI)) : "",
            name_of(row.parity)};
  }

  namespace
  {
    /// A bar beside a value with @p n_decimals decimals: two digits of a small one, never more
    /// decimals than make sense.
    std::string with_bar(const double value, const int n_decimals, const int width,
                         const std::optional<double> &bar)
    {
      char text[80];
      std::snprintf(text, sizeof(text), "%*.*f", width, n_decimals, value);
      std::string field = text;
      if (!bar)
        return field;
      std::snprintf(text, sizeof(text), *bar >= 10 ? "%.0f" : "%.2g", *bar);
      const std::string padded = std::string(text) + std::string(8, ' ');
      return field + " +- " + padded.substr(0, std::max<std::size_t>(8, std::string(text).size()));
    }
  } // namespace

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
      const bool unstable = row.is_unstable();
      char line[240];
      std::snprintf(line, sizeof(line),
                    bars ? "%s %4u   %s   %s   %13.3e   %12.1e   %9.2e   %s\n"
                         : "%s %4u   %s   %s   %13.3e   %14.1e   %9.2e   %s\n",
                    unstable ? ">" : " ", row.mode,
                    with_bar(row.frequency(), 4, bars ? 11 : 13, row.frequency_error).c_str(),
                    with_bar(row.growth_rate(), 5, bars ? 14 : 16, row.growth_rate_error).c_str(),
                    row.damping_ratio(), row.backward_error, row.condition_number.value_or(0),
                    name_of(row.verdict).c_str());
      text += line;
    }
    return text;
  }
} // namespace squeal
