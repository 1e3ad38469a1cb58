#pragma once

#include <squeal/assessment/stability.h>
#include <squeal/base/files.h>
#include <squeal/base/text.h>

#include <mpi.h>

#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  /// One field of a line of a table: its column and what stands there. Numbers have 12 digits;
  /// what is unknown or not finite is empty.
  struct Field
  {
    Field(std::string column, std::string text) : column(std::move(column)), text(std::move(text))
    {
    }
    Field(std::string column, const char *text) : column(std::move(column)), text(text) {}
    Field(std::string column, const unsigned int value)
        : column(std::move(column)), text(std::to_string(value))
    {
    }
    Field(std::string column, const double value) : column(std::move(column)), text(number(value))
    {
    }
    Field(std::string column, const std::optional<double> &value)
        : column(std::move(column)), text(number(value))
    {
    }
    std::string column, text;
  };
  /// A line. The functions that make lines are the only place that knows the columns: a default row
  /// gives the header.
  using Fields = std::vector<Field>;
  Fields operator+(Fields fields, const Fields &more);

  /// A CSV file that grows line by line; complete lines are on disk after each call. Rank 0 writes.
  class Table
  {
  public:
    /// The columns are those of any line. With @p append an existing file goes on.
    Table(const std::string &filename, const Fields &sample, MPI_Comm comm, bool append = false);
    void add(const Fields &fields);

  private:
    const std::string filename;
    const bool writes;
  };

  /// A line of modes.csv, contributions.csv and sensitivities.csv. Users rely on the first columns
  /// of modes.csv.
  Fields modes_fields(const ModeRow &row);
  /// The last columns of modes.csv.
  Fields shape_fields(const std::optional<ModeShape> &shape);
  Fields contributions_fields(unsigned int cycle, const Contribution &c);
  Fields sensitivities_fields(unsigned int cycle, unsigned int mode,
                              const ParameterDerivative &derivative, std::complex<double> d_lambda);

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
