#pragma once

#include <mpi.h>

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace squeal
{
  /// Writes a file that is complete or, if the run ends meanwhile, as it was before: under another
  /// name first. Throws std::runtime_error, with the system's reason, if that fails.
  void write_file(const std::string &filename, const std::function<void(std::ostream &)> &write);

  /// Adds to the end of a file what is on disk when this returns. Throws as write_file().
  void append_to_file(const std::string &filename, const std::string &text);

  /// Rank 0 writes a whole file.
  void write_text(const std::string &filename, const std::string &text, MPI_Comm comm);

  /// Numbers in a file that is complete or does not exist.
  void save_numbers(const std::string &filename, const std::vector<double> &numbers);
  /// Nothing if there is no such file or it is damaged.
  std::optional<std::vector<double>> load_numbers(const std::string &filename);

  /// The sizes of files of a directory, zero for those that do not exist: what a run that is
  /// interrupted may come back to.
  std::vector<std::uintmax_t> file_sizes(const std::string &directory,
                                         const std::vector<std::string> &names);

  /// Takes off what an interrupted run wrote after the files had these sizes: a line may have been
  /// cut. Collective.
  void cut_files(const std::string &directory, const std::vector<std::string> &names,
                 const std::vector<std::uintmax_t> &sizes, MPI_Comm comm);
} // namespace squeal
