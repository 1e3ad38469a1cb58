#pragma once

#include <squeal/base/checksum.h>

#include <mpi.h>

#include <optional>
#include <string>
#include <vector>

namespace squeal
{
  /// What an interrupted run resumes from: a list of numbers, and how long its tables were then.
  ///
  /// The file has a version and a checksum. It names its tables, each with its length and the
  /// checksum of that much, so that a table that somebody changed is found out. When the state is
  /// on the disk, so is what it marks of the tables.
  class StateFile
  {
  public:
    /// <name>.state beside the tables, whose names are relative to the directory.
    StateFile(const std::string &directory, const std::string &name,
              const std::vector<std::string> &tables);

    /// Rank 0 writes. Collective; throws std::runtime_error.
    void save(const std::vector<double> &numbers, MPI_Comm comm);
    /// Reads the numbers and cuts the tables to what they were: a line may be incomplete. Nothing
    /// if there is no state, or if objection() has one. Collective.
    std::optional<std::vector<double>> resume(MPI_Comm comm);
    /// Rank 0 removes the file: there is nothing left to resume. Collective.
    void remove(MPI_Comm comm) const;

    /// Why a state file cannot be resumed from: it is damaged, of another version, or its tables
    /// were changed; empty if it can be. For one rank.
    static std::string objection(const std::string &directory, const std::string &filename);

  private:
    const std::string directory, filename;
    const std::vector<std::string> tables;
    std::vector<FileMark> marks; ///< of the tables, when they were looked at last
  };
} // namespace squeal
