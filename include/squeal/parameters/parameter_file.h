#pragma once

#include <squeal/parameters/parameters.h>

#include <deal.II/base/parameter_handler.h>

#include <mpi.h>

#include <functional>
#include <iosfwd>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace squeal
{
  /// A parameter file with its overrides, read strictly: an unknown key is an error that names the
  /// file, the line, the section, and the nearest known key.
  class ParameterFile
  {
  public:
    /// All parameters at their defaults.
    ParameterFile();
    ~ParameterFile();

    /// Reads @p filename, then applies @p overrides of the form "Section/Key=value", then checks
    /// the rules across keys. A line "include name" outside of subsections stands for the file of
    /// that name, relative to the one that includes it; numbers may be expressions (2*pi*3), and a
    /// value in quotes may hold a #. Throws InputError.
    ///
    /// Rank 0 reads, since a pipe can be read once only; 16 MiB at most. Collective.
    void read(const std::string &filename, const std::vector<std::string> &overrides,
              MPI_Comm comm = MPI_COMM_SELF);

    /// Reads a text as if it were in the file of that name; it may not include others. Throws
    /// InputError.
    void read_text(const std::string &filename, const std::string &text);

    const Parameters::All &parameters() const
    {
      return *all;
    }

    /// The present value of a number. Throws InputError, naming the nearest key, if there is none
    /// of that path or if it is not a number.
    double value_of(const std::string &path) const;
    /// Sets numbers, all of them before the rules are checked; parameters() then refers to the new
    /// values. Passes the checks of a run of its own: Parameters::All::check() and those of
    /// also_check(). Throws InputError, with the old values again.
    void vary(const std::vector<std::string> &paths, const std::vector<double> &values);

    /// Sets any key and checks as vary() does. Throws InputError.
    void choose(const std::string &path, const std::string &value);

    /// Adds a check of what a study makes of the parameters. It throws InputError for what a run of
    /// its own would refuse beside the rules across keys.
    void also_check(std::function<void(const Parameters::All &)> check)
    {
      checks.push_back(std::move(check));
    }

    /// The name of the file that was read.
    const std::string &name() const
    {
      return name_;
    }
    /// The names of all files that were read: that one and those that it includes.
    std::vector<std::string> names_of_files() const
    {
      std::vector<std::string> names;
      for (const auto &[name, text] : texts)
        names.push_back(name);
      return names;
    }
    /// The text of the file, byte for byte.
    const std::string &original_text() const
    {
      return original;
    }

    /// All parameters used, as a parameter file.
    void print_used(std::ostream &out) const;

    /// Every key with default, unit and allowed values. @p format is prm, json or md.
    void print_manual(std::ostream &out, const std::string &format) const;

    /// Prints the manual's entries, for reading, of the keys whose path holds @p part, in any case.
    /// Throws InputError if there is none.
    void print_keys(std::ostream &out, const std::string &part) const;

  private:
    struct Entry
    {
      std::vector<std::string> section;
      std::string key;
      std::string path; ///< Section/.../Key
      std::string pattern;
      std::string documentation;
      std::string default_value;
    };

    /// Takes files by name and text, the first being the one that was asked for, and overrides.
    void take(const std::vector<std::string> &names_and_texts,
              const std::vector<std::string> &overrides);
    /// Declares the keys of all parameters.
    void declare();
    const Entry &entry_of(const std::string &path, const std::string &where) const;
    /// A sentence about what may have been meant by an unknown key; empty where nothing is alike.
    std::string suggestion(const std::string &path) const;
    /// A file whose text was read, included by others.
    void parse_text(const std::string &filename, std::vector<std::string> includers);
    void set(const std::string &path, const std::string &value, const std::string &where);
    /// Sets the pressure of one surface in the list Mesh/Pressures.
    void set_pressure(const std::string &path, const std::string &value, const std::string &where);
    /// Checks as a run of its own does. Throws InputError.
    void check_all();

    std::map<std::string, std::string> texts; ///< of the files read, by name
    std::unique_ptr<Parameters::All> all;
    std::unique_ptr<dealii::ParameterHandler> prm; ///< whose entries are members of all
    std::vector<Entry> entries;
    std::vector<std::function<void(const Parameters::All &)>> checks; ///< of also_check()
    std::string name_, original;
  };
} // namespace squeal
