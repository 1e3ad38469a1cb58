#include <squeal/base/errors.h>
#include <squeal/base/files.h>
#include <squeal/base/text.h>
#include <squeal/parameters/entries.h>
#include <squeal/parameters/expressions.h>
#include <squeal/parameters/parameter_file.h>

#include <deal.II/base/mpi.h>
#include <deal.II/base/parameter_handler.h>
#include <deal.II/base/patterns.h>
#include <deal.II/base/utilities.h>

#include <boost/property_tree/json_parser.hpp>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <sstream>

// From a file to Parameters::All and back. declare() lists the keys with what a reader is told of
// each; read() parses a file with those that it includes and the overrides of the command line, an
// unknown key getting the name that is nearest; vary() and choose() change values for studies; the
// rest prints what was used and the manual.

namespace squeal
{
  using dealii::Utilities::trim;

  namespace
  {
    /// Levenshtein distance without regard to case.
    unsigned int edit_distance(const std::string &a, const std::string &b)
    {
      std::vector<unsigned int> row(b.size() + 1);
      for (unsigned int j = 0; j <= b.size(); ++j)
        row[j] = j;
      for (unsigned int i = 1; i <= a.size(); ++i)
      {
        unsigned int diagonal = row[0];
        row[0]                = i;
        for (unsigned int j = 1; j <= b.size(); ++j)
        {
          const unsigned int change = diagonal + (std::tolower(a[i - 1]) != std::tolower(b[j - 1]));
          diagonal                  = row[j];
          row[j]                    = std::min({row[j] + 1, row[j - 1] + 1, change});
        }
      }
      return row[b.size()];
    }

    /// deal.II's description of a pattern without its brackets.
    std::string allowed(const std::string &pattern_description)
    {
      const auto pattern = dealii::Patterns::pattern_factory(pattern_description);
      std::string text   = pattern->description(dealii::Patterns::PatternBase::Text);
      std::replace(text.begin(), text.end(), '\n', ' ');
      const std::string smallest = "2.22507e-308";
      const std::size_t position = text.find(smallest);
      if (position != std::string::npos)
        text.replace(position, smallest.size(), "0 (excluded)");
      const std::string largest = "MAX_DOUBLE";
      for (std::size_t end = text.find(largest); end != std::string::npos; end = text.find(largest))
        text.replace(end, largest.size(), "infinity");
      return text;
    }
  } // namespace

  ParameterFile::ParameterFile()
      : all(std::make_unique<Parameters::All>()), prm(std::make_unique<dealii::ParameterHandler>())
  {
    declare();
  }

  ParameterFile::~ParameterFile() = default;

  void ParameterFile::declare()
  {
    prm->clear();
    entries.clear();
    all->declare(*prm);

    // The handler's own JSON is the one public list of its entries.
    std::ostringstream json;
    prm->print_parameters(json, dealii::ParameterHandler::KeepDeclarationOrder |
                                    dealii::ParameterHandler::JSON);
    std::istringstream in(json.str());
    boost::property_tree::ptree tree;
    boost::property_tree::read_json(in, tree);

    const auto collect = [this](const auto &self, const auto &node,
                                std::vector<std::string> section) -> void
    {
      for (const auto &[mangled, child] : node)
      {
        // deal.II writes a blank in a name as _20.
        std::string name;
        for (std::size_t i = 0; i < mangled.size(); ++i)
          if (mangled[i] == '_' && i + 2 < mangled.size())
          {
            name += char(std::stoi(mangled.substr(i + 1, 2), nullptr, 16));
            i += 2;
          }
          else
            name += mangled[i];

        if (child.get_child_optional("pattern_description"))
        {
          Entry entry;
          entry.section = section;
          entry.key     = name;
          for (const std::string &s : section)
            entry.path += s + "/";
          entry.path += name;
          entry.pattern       = child.template get<std::string>("pattern_description");
          entry.documentation = child.template get<std::string>("documentation");
          entry.default_value = child.template get<std::string>("default_value");
          entries.push_back(entry);
        }
        else
        {
          section.push_back(name);
          self(self, child, section);
          section.pop_back();
        }
      }
    };
    collect(collect, tree, {});
  }

  namespace
  {
    /// The largest number of a section "Part <number>" of a parameter file, or of a path with it,
    /// as far as numbers are sensible: other ones are unknown keys.
    std::size_t last_part(const std::string &text)
    {
      constexpr std::size_t most_parts = 200;
      const std::string word           = "Part ";
      std::size_t last                 = 0;
      for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1))
      {
        const std::size_t begin = at + word.size(),
                          end = std::min(text.find_first_not_of("0123456789", begin), text.size());
        if (end > begin && end - begin <= 3 && text[begin] != '0')
          if (const std::size_t part = std::stoul(text.substr(begin, end - begin));
              part <= most_parts)
            last = std::max(last, part);
      }
      return last;
    }

    /// Limits one file, and all text that is parsed where each file stands wherever it is included.
    constexpr std::size_t most_bytes = 1 << 24;

    /// The content of a parameter file. Throws InputError.
    std::string text_of_file(const std::string &filename, const bool is_included)
    {
      try
      {
        const std::string text = is_included ? read_whole_file(filename, most_bytes)
                                             : read_whole_file_or_pipe(filename, most_bytes);
        return text.substr(text.rfind(byte_order_mark, 0) == 0 ? byte_order_mark.size() : 0);
      }
      catch (const std::runtime_error &reason)
      {
        throw InputError(filename + ": the parameter file cannot be read. " + reason.what());
      }
    }

    /// The file that a line "include name" of another one names, beside which it lies.
    std::string included_file(const std::string &name, const std::string &by)
    {
      return (std::filesystem::path(by).parent_path() / name).lexically_normal().string();
    }

    /// A line up to its comment. A # between quotes begins none.
    std::string without_comment(const std::string &line)
    {
      bool is_quoted = false;
      for (std::size_t k = 0; k < line.size(); ++k)
        if (line[k] == '"')
          is_quoted = !is_quoted && line.find('"', k + 1) != std::string::npos;
        else if (line[k] == '#' && !is_quoted)
          return trim(line.substr(0, k));
      return trim(line);
    }

    /// A value without the quotes around it.
    std::string unquoted(const std::string &value)
    {
      const std::size_t n = value.size();
      return n >= 2 && value[0] == '"' && value.find('"', 1) == n - 1 ? value.substr(1, n - 2)
                                                                      : value;
    }

    /// The names of the lines "include name" of a text.
    std::vector<std::string> included_names(const std::string &text)
    {
      std::vector<std::string> names;
      std::istringstream in(text);
      for (std::string line; std::getline(in, line);)
      {
        const std::string words = without_comment(line);
        if (const std::size_t gap = words.find_first_of(" \t");
            gap != std::string::npos && words.substr(0, gap) == "include" && words.back() != '\\')
          names.push_back(trim(words.substr(gap)));
      }
      return names;
    }

    /// Adds a file and those that it includes, name and text by turns. Throws InputError, also if
    /// there are too many: files that include each other.
    void read_with_included(const std::string &filename, std::vector<std::string> &names_and_texts)
    {
      constexpr std::size_t most_files = 100;
      for (std::size_t i = 0; i < names_and_texts.size(); i += 2)
        if (names_and_texts[i] == filename)
          return;
      if (names_and_texts.size() >= 2 * most_files)
        throw InputError(filename + ": more than " + std::to_string(most_files) +
                         " files are included.");
      const std::string text = text_of_file(filename, !names_and_texts.empty());
      names_and_texts.insert(names_and_texts.end(), {filename, text});
      for (const std::string &name : included_names(text))
        read_with_included(included_file(name, filename), names_and_texts);
    }

    /// Refuses files whose parts, each standing wherever it is included, are too much to parse:
    /// each of thirty files may include the next one twice. What includes itself is refused when it
    /// is parsed.
    class Expansion
    {
    public:
      explicit Expansion(const std::vector<std::string> &names_and_texts)
      {
        for (std::size_t i = 0; i < names_and_texts.size(); i += 2)
          files[names_and_texts[i]] = {names_and_texts[i + 1].size(),
                                       included_names(names_and_texts[i + 1])};
      }

      void add(const std::string &filename, std::vector<std::string> includers = {})
      {
        constexpr unsigned int most_files = 1000;
        const File &file                  = files.at(filename);
        ++n_files;
        n_bytes += file.n_bytes;
        if (n_files > most_files || n_bytes > most_bytes)
          throw InputError(filename + ": it is included so often that there are more than " +
                           std::to_string(most_files) + " files or " + std::to_string(most_bytes) +
                           " bytes to read.");
        includers.push_back(filename);
        for (const std::string &name : file.includes)
          if (const std::string included = included_file(name, filename);
              std::count(includers.begin(), includers.end(), included) == 0)
            add(included, includers);
      }

    private:
      struct File
      {
        std::size_t n_bytes = 0;
        std::vector<std::string> includes;
      };
      std::map<std::string, File> files;
      unsigned int n_files = 0;
      std::size_t n_bytes  = 0;
    };
  } // namespace

  void ParameterFile::read(const std::string &filename, const std::vector<std::string> &overrides,
                           const MPI_Comm comm)
  {
    std::string error;
    std::vector<std::string> names_and_texts;
    name_ = filename;
    if (dealii::Utilities::MPI::this_mpi_process(comm) == 0)
      try
      {
        read_with_included(filename, names_and_texts);
        Expansion(names_and_texts).add(filename);
      }
      catch (const InputError &e)
      {
        error = e.what();
      }
    error           = dealii::Utilities::MPI::broadcast(comm, error);
    names_and_texts = dealii::Utilities::MPI::broadcast(comm, names_and_texts);
    if (!error.empty())
      throw InputError(error);
    take(names_and_texts, overrides);
  }

  void ParameterFile::read_text(const std::string &filename, const std::string &text)
  {
    name_ = filename;
    take({filename, text}, {});
  }

  void ParameterFile::take(const std::vector<std::string> &names_and_texts,
                           const std::vector<std::string> &overrides)
  {
    const std::string &filename = name_;
    original                    = names_and_texts[1];
    // Sections of parts are as many as are used.
    std::size_t n_parts = 0;
    texts.clear();
    for (std::size_t i = 0; i < names_and_texts.size(); i += 2)
    {
      texts[names_and_texts[i]] = names_and_texts[i + 1];
      n_parts                   = std::max(n_parts, last_part(names_and_texts[i + 1]));
    }
    for (const std::string &override_text : overrides)
      n_parts = std::max(n_parts, last_part(override_text));
    if (n_parts > all->mesh.parts.size())
    {
      all = std::make_unique<Parameters::All>();
      all->mesh.parts.resize(n_parts);
      declare();
    }
    parse_text(filename, {});

    for (const std::string &override_text : overrides)
    {
      const std::size_t equals = override_text.find('=');
      if (equals == std::string::npos)
        throw InputError("--set \"" + override_text + "\": expected \"Section/Key=value\".");
      if (override_text.find_first_of("\n\r") != std::string::npos ||
          without_comment(override_text) != trim(override_text))
        throw InputError("--set \"" + override_text +
                         "\": a # begins a comment in parameter files, but for one between "
                         "quotes, and a value ends with its line: parameters.prm could not "
                         "reproduce this run.");
      set(trim(override_text.substr(0, equals)), unquoted(trim(override_text.substr(equals + 1))),
          "--set \"" + override_text + "\"");
    }

    try
    {
      all->check();
    }
    catch (const InputError &error)
    {
      throw InputError(filename + ": " + error.what());
    }
  }

  void ParameterFile::parse_text(const std::string &filename, std::vector<std::string> includers)
  {
    includers.push_back(filename);
    std::vector<std::string> section;
    std::istringstream in(texts.at(filename));
    std::string line;
    std::string section_start;
    unsigned int line_number = 0;
    while (std::getline(in, line))
    {
      ++line_number;
      const std::string where = filename + ":" + std::to_string(line_number);

      line = without_comment(line);
      // As in deal.II: a line that ends with a backslash goes on in the next one.
      while (!line.empty() && line.back() == '\\')
      {
        line.pop_back();
        line = trim(line);
        std::string next;
        if (!std::getline(in, next))
          break;
        ++line_number;
        line += " " + without_comment(next);
      }
      const auto first_gap = line.find_first_of(" \t");
      const auto word      = line.substr(0, first_gap);
      const auto rest      = first_gap == std::string::npos ? "" : trim(line.substr(first_gap));

      if (line.empty())
        continue;
      else if (word == "subsection")
      {
        section.push_back(rest);
        section_start = where;
      }
      else if (word == "end" && rest.empty())
      {
        if (section.empty())
          throw InputError(where + ": this 'end' closes no subsection.");
        // A key inside of an unknown section has been refused before; this is for an empty one.
        if (std::none_of(entries.begin(), entries.end(),
                         [&](const Entry &e)
                         {
                           return e.section.size() >= section.size() &&
                                  std::equal(section.begin(), section.end(), e.section.begin());
                         }))
          throw InputError(section_start + ": unknown subsection '" + section.back() +
                           "'. All keys: squeal --print-parameters=md");
        section.pop_back();
      }
      else if (word == "set")
      {
        const std::size_t equals = rest.find('=');
        if (equals == std::string::npos)
          throw InputError(where + ": expected 'set Key = value', found '" + line + "'.");
        std::string path;
        for (const std::string &s : section)
          path += s + "/";
        set(path + trim(rest.substr(0, equals)), unquoted(trim(rest.substr(equals + 1))), where);
      }
      else if (word == "include" && !rest.empty())
      {
        if (!section.empty())
          throw InputError(where +
                           ": an 'include' stands outside of subsections; this one is in '" +
                           section.back() + "'.");
        const std::string included = included_file(rest, filename);
        if (std::count(includers.begin(), includers.end(), included) > 0)
          throw InputError(where + ": " + included + " includes itself.");
        if (texts.count(included) == 0) // the line goes on in the next one
          throw InputError(where + ": the name of an included file stands in the same line.");
        parse_text(included, includers);
      }
      else
        throw InputError(where + ": expected 'subsection', 'end', 'set Key = value' or 'include " +
                         "file', found '" + line + "'.");
    }
    if (!section.empty())
      throw InputError(filename + ": the subsection '" + section.back() + "' has no 'end'.");
  }

  const ParameterFile::Entry &ParameterFile::entry_of(const std::string &path,
                                                      const std::string &where) const
  {
    const auto entry = std::find_if(entries.begin(), entries.end(),
                                    [&](const Entry &e) { return e.path == path; });
    if (entry == entries.end())
    {
      // The distance of names takes their lengths' product.
      constexpr std::size_t longest = 200;
      if (path.size() > longest)
        throw InputError(where + ": unknown key '" + path.substr(0, longest) + "...' of " +
                         std::to_string(path.size()) +
                         " characters. All keys: squeal --print-parameters=md");
      throw InputError(where + ": unknown key '" + path + "'." + suggestion(path) +
                       " All keys: squeal --print-parameters=md");
    }
    return *entry;
  }

  std::string ParameterFile::suggestion(const std::string &path) const
  {
    const auto split = [](const std::string &whole)
    {
      const std::size_t slash = whole.rfind('/');
      return slash == std::string::npos
                 ? std::make_pair(std::string(), whole)
                 : std::make_pair(whole.substr(0, slash), whole.substr(slash + 1));
    };
    const auto [section, key] = split(path);
    const auto alike          = [](const std::string &a, const std::string &b, const unsigned int n)
    { return n * edit_distance(a, b) <= std::max(a.size(), b.size()); };
    // Spelt alike in the same section; the same key elsewhere; a path spelt alike; a key spelt
    // alike elsewhere. What is only nearest of all says nothing.
    const Entry *best = nullptr;
    std::pair<unsigned int, unsigned int> least{4, 0};
    std::string there;
    std::vector<std::string> elsewhere; // the same key
    for (const Entry &e : entries)
    {
      const std::string own      = split(e.path).first;
      const unsigned int of_path = edit_distance(e.path, path), of_key = edit_distance(e.key, key);
      const bool same_section = edit_distance(own, section) == 0;
      std::pair<unsigned int, unsigned int> rank{4, 0};
      if (same_section && alike(e.key, key, 3))
        rank = {0, of_key};
      else if (of_key == 0)
      {
        rank = {1, of_path};
        elsewhere.push_back(e.path);
      }
      else if (alike(e.path, path, 5))
        rank = {2, of_path};
      else if (alike(e.key, key, 3))
        rank = {3, 100 * of_key + of_path};
      if (rank < least)
      {
        least = rank;
        best  = &e;
      }
      if (same_section)
        there += (there.empty() ? "" : ", ") + e.key;
    }
    // A key that few sections have may be meant in any of them; one of many in the nearest.
    constexpr unsigned int few = 3;
    if (least.first == 1 && elsewhere.size() > 1 && elsewhere.size() <= few)
    {
      std::string keys;
      for (const std::string &known : elsewhere)
        keys += (keys.empty() ? "'" : ", '") + known + "'";
      return " There are " + keys + ".";
    }
    if (best)
      return " The nearest known key is '" + best->path + "'.";
    return there.empty()
               ? ""
               : " None is spelt alike. " +
                     (section.empty() ? "What is outside of sections" : "The section " + section) +
                     " has: " + there + ".";
  }

  namespace
  {
    /// The surface of a path Mesh/Pressures/surface; empty: another path.
    std::string surface_of(const std::string &path)
    {
      const std::string start = Parameters::Mesh::pressure_path;
      return path.rfind(start, 0) == 0 ? path.substr(start.size()) : "";
    }
  } // namespace

  void ParameterFile::set_pressure(const std::string &path, const std::string &value,
                                   const std::string &where)
  {
    std::optional<double> number = Parameters::to_number(value);
    if (!number)
      number = constant_expression(value);
    if (!number)
      throw InputError(where + ": " + path + " = " + value +
                       ": not allowed. Allowed: a pressure in Pa.");
    const Entry &list = entry_of("Mesh/Pressures", where);
    Parameters::Mesh mesh;
    mesh.pressures = prm->get(list.section, list.key);
    set(list.path, mesh.pressures_with(surface_of(path), *number, where), where);
  }

  void ParameterFile::set(const std::string &path, const std::string &value,
                          const std::string &where)
  {
    if (!surface_of(path).empty())
      return set_pressure(path, value, where);
    const Entry *entry = &entry_of(path, where);
    // Lists are taken apart in a time that grows like the square of their length.
    constexpr std::size_t longest = 1 << 16;
    if (value.size() > longest)
      throw InputError(where + ": the value of " + path + " has " + std::to_string(value.size()) +
                       " characters; allowed are " + std::to_string(longest) + ".");
    const auto is_allowed = [&](const std::string &text)
    { return dealii::Patterns::pattern_factory(entry->pattern)->match(text); };
    std::string used = value;
    if (!is_allowed(value) &&
        (entry->pattern.rfind("[Double", 0) == 0 || entry->pattern.rfind("[Integer", 0) == 0))
      if (const std::optional<double> number = constant_expression(value))
        used = squeal::number(*number, 17);
    if (!is_allowed(used))
      throw InputError(where + ": " + path + " = " + value + ": not allowed. Allowed: " +
                       allowed(entry->pattern) + " " + entry->documentation);

    for (const std::string &s : entry->section)
      prm->enter_subsection(s);
    prm->set(entry->key, used);
    for (unsigned int i = 0; i < entry->section.size(); ++i)
      prm->leave_subsection();
  }

  double ParameterFile::value_of(const std::string &path) const
  {
    // Expressions of the position or the speed; a number is one.
    if (const std::string surface = surface_of(path); !surface.empty())
    {
      for (const auto &[name, pressure] : all->mesh.surface_pressures)
        if (name == surface)
          return pressure;
      all->mesh.pressures_with(surface, 0, "Sweep/Parameter"); // throws
    }
    const std::set<std::string> expressions = {"Pads/Pressure profile", "Contact/Initial gap",
                                               "Contact/Friction/Expression",
                                               "Contact/Wear/Sliding distance"};
    const Entry &entry                      = entry_of(path, "Sweep/Parameter");
    const std::string text                  = prm->get(entry.section, entry.key);
    if (entry.pattern.rfind("[Double", 0) != 0 && entry.pattern.rfind("[Integer", 0) != 0 &&
        expressions.count(path) == 0)
      throw InputError("Sweep/Parameter = " + path +
                       ": its value is not a number but a choice, a "
                       "name or a list; only numbers can be varied.");
    if (const std::optional<double> value = Parameters::to_number(text))
      return *value;
    throw InputError("Sweep/Parameter = " + path + ": its value " + text + " is not a number.");
  }

  void ParameterFile::vary(const std::vector<std::string> &paths, const std::vector<double> &values)
  {
    std::vector<double> before;
    for (const std::string &path : paths)
      before.push_back(value_of(path));
    const auto set_all = [&](const std::vector<double> &to)
    {
      for (unsigned int k = 0; k < paths.size(); ++k)
        set(paths[k], number(to[k], 17), "Sweep/Values");
    };
    try
    {
      set_all(values);
      check_all();
    }
    catch (const InputError &)
    {
      set_all(before);
      all->check(); // it also works out what follows from the values
      throw;
    }
  }

  void ParameterFile::choose(const std::string &path, const std::string &value)
  {
    set(path, value, path);
    check_all();
  }

  void ParameterFile::check_all()
  {
    all->check();
    for (const auto &check : checks)
      check(*all);
  }

  void ParameterFile::print_used(std::ostream &out) const
  {
    out << "# All parameters of a run of squeal " SQUEAL_VERSION
           ". This file reproduces the run.\n";
    std::ostringstream text;
    prm->print_parameters(text, dealii::ParameterHandler::KeepDeclarationOrder |
                                    dealii::ParameterHandler::ShortPRM);
    // A value with a #, as a file's name may be, was quoted, and is again.
    std::istringstream lines(text.str());
    for (std::string line; std::getline(lines, line);)
    {
      const std::size_t value = line.find("= ") + 2;
      const bool has_hash = trim(line).rfind("set ", 0) == 0 && line.find('#') != std::string::npos;
      out << (has_hash ? line.substr(0, value) + "\"" + line.substr(value) + "\"" : line) << "\n";
    }
  }

  void ParameterFile::print_manual(std::ostream &out, const std::string &format) const
  {
    using dealii::ParameterHandler;
    if (format == "prm")
      prm->print_parameters(out, ParameterHandler::KeepDeclarationOrder | ParameterHandler::PRM);
    else if (format == "json")
      prm->print_parameters(out, ParameterHandler::KeepDeclarationOrder | ParameterHandler::JSON);
    else if (format == "md")
    {
      out << "| key | default | allowed | meaning |\n|---|---|---|---|\n";
      for (const Entry &entry : entries)
      {
        std::string row = allowed(entry.pattern) + " \n " + entry.documentation;
        for (std::size_t bar = row.find('|'); bar != std::string::npos;
             bar             = row.find('|', bar + 2))
          row.insert(bar, "\\"); // a bar inside of a cell
        row.replace(row.find('\n'), 1, "|");
        out << "| " << entry.path << " | " << entry.default_value << " | " << row << " |\n";
      }
    }
    else
      throw InputError("--print-parameters=" + format + ": allowed are prm, json, md.");
  }

  void ParameterFile::print_keys(std::ostream &out, const std::string &part) const
  {
    const auto lower = [](std::string text)
    {
      std::transform(text.begin(), text.end(), text.begin(),
                     [](const unsigned char c) { return std::tolower(c); });
      return text;
    };
    bool found = false;
    for (const Entry &entry : entries)
      if (lower(entry.path).find(lower(part)) != std::string::npos)
      {
        out << (found ? "\n" : "") << entry.path << " = " << entry.default_value << "\n  "
            << entry.documentation << "\n  Allowed: " << allowed(entry.pattern) << "\n";
        found = true;
      }
    if (!found)
      throw InputError("--help " + part + ": no key's path holds this." + suggestion(part) +
                       " All keys: squeal --print-parameters=md");
  }
} // namespace squeal
