#pragma once

#include <squeal/assessment/stability.h>
#include <squeal/base/files.h>
#include <squeal/parameters/parameter_file.h>

#include <mpi.h>

#include <string>
#include <vector>

namespace squeal
{
  /// A number with 12 significant digits, or as many as asked for; an empty field if it is unknown
  /// or not finite.
  std::string number(double value, int n_digits = 12);
  std::string number(const std::optional<double> &value);

  /// Makes the directory and its record of the input: original.prm and parameters.prm. Results of
  /// an earlier run are removed, unless it had the same parameters and was interrupted: then they
  /// stay, and the return value is true. Collective; throws InputError on every rank if the
  /// directory cannot be written.
  bool start_run_directory(const std::string &directory, const ParameterFile &file, MPI_Comm comm);

  /// A CSV file that grows line by line; complete lines are on disk after each call. Rank 0 writes.
  class Table
  {
  public:
    /// With @p append an existing file goes on.
    Table(const std::string &filename, const std::string &header, MPI_Comm comm,
          bool append = false);
    void add(const std::vector<std::string> &fields);

  private:
    const std::string filename;
    const bool writes;
  };

  /// The header of modes.csv, as the first columns that users rely on, and one line of it.
  extern const char *modes_header;
  std::vector<std::string> modes_fields(const ModeRow &row);

  /// Headers and lines of contributions.csv and sensitivities.csv.
  extern const char *contributions_header, *sensitivities_header;
  std::vector<std::string> contributions_fields(unsigned int cycle, const Contribution &c);
  std::vector<std::string> sensitivities_fields(unsigned int cycle, unsigned int mode,
                                                const ParameterDerivative &derivative,
                                                std::complex<double> d_lambda);

  /// The verdicts of several stages side by side: one line per mode of the last stage, with its
  /// partners in the others.
  std::string ladder_table(const std::vector<std::string> &stages,
                           const std::vector<std::vector<ModeRow>> &rows);

  /// Why the given modes grow or decay: their growth rates as sums over the origins.
  std::string contributions_table(const std::vector<Contribution> &contributions,
                                  const std::vector<unsigned int> &modes);

  /// The table of modes as the screen shows it, with error bars where there are any.
  std::string modes_table(const std::vector<ModeRow> &rows);
} // namespace squeal
