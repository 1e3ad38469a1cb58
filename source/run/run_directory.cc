#include <squeal/base/checksum.h>
#include <squeal/base/files.h>
#include <squeal/base/log.h>
#include <squeal/base/state_file.h>
#include <squeal/mesh/fields.h>
#include <squeal/mesh_files/deck_lines.h>
#include <squeal/run/matrix_export.h>
#include <squeal/run/run_directory.h>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

// The directory of one run, in this order: names of results; texts that are compared (parameters
// without what does not matter, places of files); take(), which locks the directory, decides with
// take_over() whether an interrupted run is resumed or results are replaced, and writes the record;
// the manifest's own file; what is refused; what is removed.

namespace squeal
{
  namespace fs = std::filesystem;

  namespace
  {
    const std::string manifest_name = "run.manifest", lock_name = "run.lock",
                      first_line          = "squeal manifest 1";
    const std::vector<std::string> states = {"refinement.state", "sweep.state", "map.state",
                                             "samples.state"};
    constexpr std::size_t most_bytes      = 1 << 28;
    /// What the names of frames of animations begin with, in the manifest, too.
    const std::string in_frames = frames_directory() + "/";

    /// Whether a run may give this name to a file that it writes; @p exports: one with
    /// Output/Matrices, whose names are no one else's.
    bool is_name_of_result(const std::string &name, const bool exports)
    {
      static const std::regex pattern(
          "(modes|contributions|sensitivities|cycles|static|ladder|convergence|sweep|critical|map|"
          "border|mesh|samples|probability|indices|response)\\.csv|convergence\\.tex|log\\.txt|("
          "original|"
          "parameters)\\.prm|run\\."
          "manifest|"
          "(refinement|sweep|map|samples)\\.state|(state|mode|contact)-[0-9].*\\.(vtu|pvtu|pvd)");
      static const std::regex exported(names_of_exported_files());
      const std::string part = ".part";
      const bool is_part     = name.size() > part.size() &&
                           name.compare(name.size() - part.size(), part.size(), part) == 0;
      const std::string whole = is_part ? name.substr(0, name.size() - part.size()) : name;
      return std::regex_match(whole, pattern) || (exports && std::regex_match(whole, exported));
    }

    bool is_there(const fs::path &path)
    {
      return fs::symlink_status(path).type() != fs::file_type::not_found;
    }

    /// Whether the run writes files for other programs.
    bool exports(const Parameters::Output &output)
    {
      return output.matrices || !output.superelement.empty();
    }

    struct InputFile
    {
      std::string key, name;
    };

    /// Every file that the parameters name and the run reads.
    std::vector<InputFile> input_files(const Parameters::All &prm)
    {
      std::vector<InputFile> all;
      if (prm.scene == Scene::mesh)
      {
        all.push_back({"Mesh/File", prm.mesh.file});
        for (const std::string &included : files_of_deck(prm.mesh.file))
          all.push_back({"Mesh/File includes", included});
        for (const auto &element : prm.joints.list_of_superelements())
          for (const std::string ending : {"-K.mtx", "-M.mtx", "-D.mtx", "-nodes.csv"})
            if (ending != "-D.mtx" || fs::exists(element.files + ending))
              all.push_back({"Joints/Superelements", element.files + ending});
      }
      if (prm.scene == Scene::matrices)
      {
        all.insert(all.end(), {{"Matrices/Mass", prm.matrices.mass},
                               {"Matrices/Velocity", prm.matrices.velocity},
                               {"Matrices/Stiffness", prm.matrices.stiffness},
                               {"Matrices/Circulatory", prm.matrices.circulatory}});
        for (const auto &matrix : prm.matrices.viscoelastic)
          all.push_back({"Matrices/Viscoelastic", matrix.stiffness});
      }
      else if (prm.has_damping())
        for (const Parameters::BodyMaterial &body : prm.materials())
          all.push_back({body.section + "/Material/Modulus table", body.material.modulus_table});
      all.push_back({"Refinement/Reference", prm.refinement.reference});
      all.push_back({"Sampling/File", prm.sampling.file});
      all.erase(std::remove_if(all.begin(), all.end(),
                               [](const InputFile &file) { return file.name.empty(); }),
                all.end());
      return all;
    }

    std::string processor()
    {
      std::ifstream in("/proc/cpuinfo");
      for (std::string line; std::getline(in, line);)
        if (line.rfind("model name", 0) == 0)
          return line.substr(std::min(line.size(), line.find(':') + 2));
      return "unknown";
    }

    /// Values by "Section/Key" of a text that ParameterFile::print_used() wrote.
    std::map<std::string, std::string> values_of(const std::string &text)
    {
      std::map<std::string, std::string> values;
      std::vector<std::string> sections;
      std::istringstream in(text);
      for (std::string line; std::getline(in, line);)
      {
        line                     = dealii::Utilities::trim(line);
        const std::size_t equals = line.find('=');
        if (line.rfind("subsection ", 0) == 0)
          sections.push_back(line.substr(11) + "/");
        else if (line == "end" && !sections.empty())
          sections.pop_back();
        else if (line.rfind("set ", 0) == 0 && equals != std::string::npos)
        {
          std::string path;
          for (const std::string &section : sections)
            path += section;
          values[path + dealii::Utilities::trim(line.substr(4, equals - 4))] =
              dealii::Utilities::trim(line.substr(equals + 1));
        }
      }
      return values;
    }

    /// In what two runs differ, the first three keys: "Contact/Friction/Coefficient = 0.6 there,
    /// 0.4 now".
    std::string differences(const std::string &there, const std::string &now)
    {
      const auto a = values_of(there), b = values_of(now);
      std::string text;
      unsigned int n = 0;
      for (const auto &[path, value] : b)
        if (const auto other = a.find(path); other != a.end() && other->second != value && ++n <= 3)
          text += (n > 1 ? "; " : "") + path + " = " + other->second + " there, " + value + " now";
      return text.empty() ? "" : " (" + text + (n > 3 ? "; and others" : "") + ")";
    }

    /// What the tables depend on: not where they are.
    std::string without_directory(const std::string &text)
    {
      // Line by line, since std::regex takes stack for each character of a match.
      std::string result;
      for (std::size_t begin = 0, end = 0; begin < text.size(); begin = end)
      {
        end                    = std::min(text.find('\n', begin), text.size() - 1) + 1;
        const std::size_t word = std::min(text.find_first_not_of(" \t", begin), end);
        if (text.compare(word, 13, "set Directory") != 0)
          result.append(text, begin, end - begin);
      }
      return result;
    }

    /// What the modes depend on: not what of them is written.
    std::string without_output(const std::string &text)
    {
      const std::string begin = "\nsubsection Output\n", end = "\nend\n";
      const std::size_t first = text.find(begin);
      if (first == std::string::npos)
        return text;
      const std::size_t last = text.find(end, first);
      return text.substr(0, first + 1) +
             (last == std::string::npos ? "" : text.substr(last + end.size()));
    }

    /// The one place of a file, however it is named; empty for a pipe, which is another one each
    /// time.
    std::string place_of(const std::string &filename)
    {
      std::error_code code;
      return fs::is_regular_file(filename, code) ? fs::canonical(filename, code).string() : "";
    }

    /// The lines of a manifest that tell what a run was made from, before those of the input files.
    enum Line : unsigned int
    {
      program_line,
      model_line,
      parameters_line,
      ranks_line,
      processor_line,
      file_line,
      n_lines
    };

    std::string text_or_nothing(const fs::path &file)
    {
      return fs::is_regular_file(file) ? read_whole_file(file.string(), most_bytes) : "";
    }
  } // namespace

  RunDirectory::RunDirectory(const std::string &directory, const ParameterFile &file,
                             const Options &options, const MPI_Comm comm)
      : directory(directory), key("Output/Directory = " + directory), comm(comm)
  {
    std::string error;
    if (is_rank_zero(comm))
      try
      {
        take(file, options);
      }
      catch (const InputError &e)
      {
        error = e.what();
      }
      catch (const Locked &holder)
      {
        error = key + ": another run is writing there, " + holder.what() +
                ". Wait until it has ended, or choose another Output/Directory.";
      }
      catch (const std::exception &e)
      {
        error = key + ": " + e.what();
      }
    error    = dealii::Utilities::MPI::broadcast(comm, error);
    resumes_ = dealii::Utilities::MPI::broadcast(comm, resumes_);
    if (!error.empty())
    {
      set_file_observer({});
      throw InputError(error);
    }
  }

  RunDirectory::~RunDirectory()
  {
    set_file_observer({});
  }

  void RunDirectory::take(const ParameterFile &file, const Options &options)
  {
    std::ostringstream printed;
    file.print_used(printed);
    const std::string used = printed.str();
    manifest.origin        = origin_of(file, options, used);

    std::error_code code;
    fs::create_directories(directory, code);
    if (code)
      throw InputError(key + ": the directory cannot be made (" + code.message() + ").");
    lock.emplace(directory + "/" + lock_name);

    std::optional<Manifest> earlier = read_manifest();
    const bool is_old               = !earlier.has_value();
    if (is_old)
      earlier = of_older_version();
    const std::vector<std::string> origin = manifest.origin;
    if (earlier)
      manifest = *earlier;
    manifest.origin = origin;
    refuse_foreign_results(exports(file.parameters().output));
    refuse_own_input(file, used);
    if (earlier)
      take_over(*earlier, is_old, file, options, used);
    if (!resumes_)
    {
      manifest        = {};
      manifest.origin = origin;
      for (const std::string name : {"original.prm", "parameters.prm", "log.txt"})
        manifest.add(name);
    }
    write_manifest();
    set_file_observer([this](const std::vector<std::string> &names) { note(names); });
    write_file(directory + "/original.prm",
               [&](std::ostream &out) { out << file.original_text(); });
    write_file(directory + "/parameters.prm", [&](std::ostream &out) { out << used; });
  }

  void RunDirectory::take_over(const Manifest &earlier, const bool is_old,
                               const ParameterFile &file, const Options &options,
                               const std::string &used)
  {
    const std::string record = text_or_nothing(fs::path(directory) / "parameters.prm");
    const bool same          = is_old ? without_output(record) == without_output(used)
                                      : earlier.origin[model_line] == manifest.origin[model_line];
    const bool was_interrupted =
        !earlier.finished &&
        std::any_of(states.begin(), states.end(),
                    [&](const std::string &state)
                    { return earlier.has(state) && is_there(directory + "/" + state); });
    // Who changes a parameter file and runs it again wants the new results; what can be resumed
    // may have taken days.
    const bool same_file = earlier.origin[file_line] == manifest.origin[file_line] &&
                           !place_of(file.name()).empty() && !was_interrupted;
    if (!same && has_results(earlier))
    {
      const std::string whose = "the results of another run" + differences(record, used);
      if (!same_file && !options.overwrite)
        throw InputError(key + ": it holds " + whose +
                         ". They are not replaced unless you say so: add --overwrite, or name "
                         "another Output/Directory (--set Output/Directory=...).");
      message_ = "Replaced: " + whose + ".\n";
    }
    if (same && was_interrupted)
    {
      const std::string reason =
          is_old ? "it was of an older version of squeal." : objection(earlier);
      resumes_ = reason.empty();
      if (!resumes_)
        message_ = "The interrupted run in this directory is not resumed, this one begins anew: " +
                   reason + "\n";
    }
    remove_files(earlier, resumes_);
  }

  std::vector<std::string> RunDirectory::origin_of(const ParameterFile &file,
                                                   const Options &options,
                                                   const std::string &used) const
  {
    std::vector<std::string> origin = {
        "program " + Checksum().add(options.program).text(),
        "model " + Checksum().add(without_output(used)).text(),
        "parameters " + Checksum().add(without_directory(used)).text(),
        "ranks " + std::to_string(dealii::Utilities::MPI::n_mpi_processes(comm)),
        "processor " + processor(),
        "parameter file " + place_of(file.name())};
    for (const auto &[name_of_key, name] : input_files(file.parameters()))
    {
      if (!fs::is_regular_file(name))
        throw InputError(name_of_key + " = " + name + ": the file cannot be read" +
                         (is_there(name) ? ": it is not a regular file." : "."));
      origin.push_back("input " + Checksum(mark_of(name).checksum).text() + " " + name_of_key +
                       " = " + name);
    }
    return origin;
  }

  std::optional<RunDirectory::Manifest> RunDirectory::read_manifest() const
  {
    const std::string filename = directory + "/" + manifest_name;
    if (!is_there(filename))
      return std::nullopt;
    std::istringstream in(read_whole_file(filename, most_bytes));
    Manifest result;
    std::string line;
    const auto fail = [&]()
    {
      throw InputError(key + ": " + manifest_name +
                       " is damaged, so that nobody knows which files there are results of a run. "
                       "Name another Output/Directory, or remove what you do not need.");
    };
    if (!std::getline(in, line) || line != first_line)
      fail();
    Checksum sum;
    while (std::getline(in, line) && line.rfind("checksum ", 0) != 0)
    {
      sum.add(line + "\n");
      result.origin.push_back(line);
    }
    if (line != "checksum " + sum.text() || result.origin.size() < n_lines)
      fail();
    while (std::getline(in, line))
    {
      // The last line may have been cut by a kill: what it names was not made then.
      if (in.eof())
        break;
      const std::string name = line.substr(std::min<std::size_t>(5, line.size()));
      if (line == "finished")
        result.finished = true;
      else if (line.rfind("file ", 0) == 0 &&
               name.find('/', name.rfind(in_frames, 0) == 0 ? in_frames.size() : 0) ==
                   std::string::npos)
        result.add(name);
    }
    return result;
  }

  std::optional<RunDirectory::Manifest> RunDirectory::of_older_version() const
  {
    const fs::path record = fs::path(directory) / "parameters.prm";
    if (!fs::is_regular_file(record) ||
        !fs::is_regular_file(fs::path(directory) / "original.prm") ||
        text_or_nothing(record).rfind("# All parameters of a run of squeal", 0) != 0)
      return std::nullopt;
    Manifest result;
    result.origin.assign(n_lines, "");
    for (const auto &entry : fs::directory_iterator(directory))
      if (const std::string name = entry.path().filename().string(); is_name_of_result(name, false))
        result.add(name);
    return result;
  }

  void RunDirectory::write_manifest()
  {
    std::string origin, files;
    for (const std::string &line : manifest.origin)
      origin += line + "\n";
    for (const std::string &name : manifest.files)
      files += "file " + name + "\n";
    write_file(directory + "/" + manifest_name,
               [&](std::ostream &out)
               {
                 out << first_line << "\n"
                     << origin << "checksum " << Checksum().add(origin).text() << "\n"
                     << files;
               });
  }

  void RunDirectory::refuse_foreign_results(const bool exports) const
  {
    std::set<std::string> own = manifest.names;
    for (const std::string &name : manifest.files)
      own.insert(name + ".part");
    for (const std::string &name : {manifest_name, lock_name})
      own.insert(name);
    // A kill leaves the beginning of a manifest.
    const std::string unfinished = directory + "/" + manifest_name + ".part";
    if (const std::string text =
            is_there(unfinished) ? read_whole_file(unfinished, most_bytes) : "";
        text.compare(0, first_line.size(), first_line, 0,
                     std::min(text.size(), first_line.size())) == 0)
      own.insert(manifest_name + ".part");
    const auto refuse_those_in = [&](const std::string &begin)
    {
      for (const auto &entry : fs::directory_iterator(directory + "/" + begin))
        if (const std::string name = entry.path().filename().string();
            is_name_of_result(name, exports) && own.count(begin + name) == 0)
          throw InputError(key + ": there is a file " + begin + name +
                           ", which no run of squeal wrote there, but this one may. It is not "
                           "touched: move it, or name another Output/Directory.");
    };
    refuse_those_in("");
    const fs::path frames = fs::path(directory) / frames_directory();
    if (!is_there(frames))
      return;
    if (!fs::is_directory(fs::symlink_status(frames)))
      throw InputError(key + ": '" + frames_directory() +
                       "' there is no directory; this run may put frames of animations there. "
                       "Move it, or name another Output/Directory.");
    refuse_those_in(in_frames);
  }

  void RunDirectory::refuse_own_input(const ParameterFile &file, const std::string &used) const
  {
    std::vector<InputFile> inputs = input_files(file.parameters());
    for (const std::string &name : file.names_of_files())
      if (name != file.name())
        inputs.push_back({"The included file", name});
      else if (file.original_text() != used)
        inputs.push_back({"The parameter file", name});
    const bool with_exports = exports(file.parameters().output);
    const auto is_result    = [&](const fs::path &path)
    {
      std::error_code ignored;
      const fs::path parent = path.parent_path().empty() ? fs::path(".") : path.parent_path();
      const std::string own = path.filename().string();
      return fs::equivalent(parent, directory, ignored) &&
             (manifest.has(own) || is_name_of_result(own, with_exports));
    };
    for (const auto &[name_of_key, name] : inputs)
      // A link may lie elsewhere, and what it leads to here.
      if (const std::string place = place_of(name); is_result(name) || is_result(place))
        throw InputError(name_of_key + " = " + name +
                         ": this run would replace it by results of its own, since it lies in " +
                         key + ". Copy it to another place, or name another Output/Directory.");
  }

  bool RunDirectory::has_results(const Manifest &earlier) const
  {
    std::vector<std::string> worth = {"modes.csv", "ladder.csv", "sweep.csv", "map.csv",
                                      "samples.csv"};
    worth.insert(worth.end(), states.begin(), states.end());
    return earlier.finished ||
           std::any_of(worth.begin(), worth.end(),
                       [&](const std::string &name)
                       { return earlier.has(name) && is_there(directory + "/" + name); });
  }

  std::string RunDirectory::objection(const Manifest &earlier) const
  {
    const std::vector<std::string> &then = earlier.origin, &now = manifest.origin;
    if (then[program_line] != now[program_line])
      return "it was of another version of squeal or of its libraries.";
    if (then[parameters_line] != now[parameters_line])
      return "it wrote other files (section Output).";
    if (then[ranks_line] != now[ranks_line])
      return "it had " + then[ranks_line] + ", now " + now[ranks_line] + ".";
    if (then[processor_line] != now[processor_line])
      return "it ran on another " + then[processor_line] + ", now " + now[processor_line] +
             ", whose digits differ.";
    for (const std::string &line : now)
      if (line.rfind("input ", 0) == 0 && std::count(then.begin(), then.end(), line) == 0)
        return "the file of " + line.substr(std::min<std::size_t>(23, line.size())) +
               " has changed since.";
    for (const std::string &state : states)
      if (earlier.has(state) && is_there(directory + "/" + state))
        if (const std::string reason = StateFile::objection(directory, state); !reason.empty())
          return reason;
    return "";
  }

  void RunDirectory::remove_files(const Manifest &earlier, const bool only_unfinished) const
  {
    const auto remove = [&](const std::string &name)
    {
      for (const std::string &file : {name, name + ".part"})
        if (const fs::path path = fs::path(directory) / file;
            (!only_unfinished || file != name) && is_there(path) &&
            !fs::is_directory(fs::symlink_status(path)))
          fs::remove(path);
    };
    // Without a state nothing can be resumed under another record.
    for (const std::string &state : states)
      if (earlier.has(state))
        remove(state);
    sync_to_disk(directory);
    for (const std::string &name : earlier.files)
      remove(name);
    const fs::path frames = fs::path(directory) / frames_directory();
    if (fs::is_directory(fs::symlink_status(frames)) && fs::is_empty(frames))
      fs::remove(frames);
    sync_to_disk(directory);
  }

  void RunDirectory::note(const std::vector<std::string> &filenames)
  {
    const fs::path own_parent = (fs::path(directory) / manifest_name).parent_path();
    std::string lines;
    for (const std::string &filename : filenames)
    {
      const fs::path path(filename);
      const bool is_frame    = path.parent_path() == own_parent / frames_directory();
      const std::string name = (is_frame ? in_frames : "") + path.filename().string();
      if ((is_frame || path.parent_path() == own_parent) && name != manifest_name &&
          manifest.add(name))
        lines += "file " + name + "\n";
    }
    if (lines.empty())
      return;
    append_to_file(directory + "/" + manifest_name, lines);
    sync_to_disk(directory + "/" + manifest_name);
  }

  void RunDirectory::finish()
  {
    if (!is_rank_zero(comm))
      return;
    append_to_file(directory + "/" + manifest_name, "finished\n");
    sync_to_disk(directory + "/" + manifest_name);
  }
} // namespace squeal
