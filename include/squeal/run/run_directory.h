#pragma once

#include <squeal/base/file_lock.h>
#include <squeal/parameters/parameter_file.h>

#include <mpi.h>

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace squeal
{
  /// The directory of a run's results, which belongs to one run at a time (doc/reliability.md).
  ///
  /// Beside the results stands run.manifest: what the run was made from (the program, the
  /// parameters, the number of ranks, the machine's processor, every input file by its checksum),
  /// and the name of each file it has written, noted before the file is made. Files that are not in
  /// the manifest are never touched.
  class RunDirectory
  {
  public:
    struct Options
    {
      bool overwrite = false; ///< the results of another run may be replaced
      std::string program;    ///< versions of the program and its libraries
      std::string called;     ///< for the log: lines about when and how the run was started
    };

    /// Takes the directory and makes the record of the input, original.prm and parameters.prm. What
    /// an interrupted run of the same input left stays, and resumes() is true. What else an earlier
    /// run left is removed, the states first: a kill at any moment leaves no state beside a record
    /// that is not its own.
    ///
    /// Throws InputError on every rank, and has changed nothing, if another run is writing there,
    /// if without Options::overwrite results would be replaced of other parameters and another
    /// parameter file, or of other parameters and an interrupted run, if a file that no run wrote
    /// has the name of a result, or if an input file is a result of the earlier run. Collective.
    RunDirectory(const std::string &directory, const ParameterFile &file, const Options &options,
                 MPI_Comm comm);
    ~RunDirectory();
    RunDirectory(const RunDirectory &)            = delete;
    RunDirectory &operator=(const RunDirectory &) = delete;

    bool resumes() const
    {
      return resumes_;
    }
    /// Why an interrupted run is not resumed, and what is replaced; for the log.
    const std::string &message() const
    {
      return message_;
    }
    /// Notes that the run is complete. Collective.
    void finish();

  private:
    struct Manifest
    {
      /// What must be equal for a run to be resumed: lines as "input <checksum> <key> = <file>".
      std::vector<std::string> origin;
      std::vector<std::string> files; ///< in the order in which they were made
      std::set<std::string> names;    ///< of files, to look up
      bool finished = false;

      bool has(const std::string &name) const
      {
        return names.count(name) > 0;
      }
      /// False if it is known already.
      bool add(const std::string &name)
      {
        if (!names.insert(name).second)
          return false;
        files.push_back(name);
        return true;
      }
    };

    void take(const ParameterFile &file, const Options &options);
    std::vector<std::string> origin_of(const ParameterFile &file, const Options &options,
                                       const std::string &used) const;
    std::optional<Manifest> read_manifest() const;
    std::optional<Manifest> of_older_version() const;
    void write_manifest();
    /// Decides what becomes of what an @p earlier run left, of an older version of squeal or not,
    /// and removes what does not stay.
    void take_over(const Manifest &earlier, bool is_old, const ParameterFile &file,
                   const Options &options, const std::string &used);
    void refuse_foreign_results(bool exports) const;
    void refuse_own_input(const ParameterFile &file, const std::string &used) const;
    bool has_results(const Manifest &earlier) const;
    /// Why a run of these parameters is not resumed; empty if it is.
    std::string objection(const Manifest &earlier) const;
    void remove_files(const Manifest &earlier, bool only_unfinished) const;
    void note(const std::vector<std::string> &filenames);

    const std::string directory, key;
    const MPI_Comm comm;
    std::optional<FileLock> lock;
    Manifest manifest;
    bool resumes_ = false;
    std::string message_;
  };
} // namespace squeal
