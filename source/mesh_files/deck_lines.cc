#include <squeal/base/files.h>
#include <squeal/base/text.h>
#include <squeal/mesh_files/deck_keywords.h>
#include <squeal/mesh_files/deck_lines.h>

#include <algorithm>
#include <filesystem>
#include <map>

namespace squeal
{
  namespace
  {
    std::string trimmed(const std::string &text)
    {
      const std::size_t first = text.find_first_not_of(" \t\r"),
                        last  = text.find_last_not_of(" \t\r");
      return first == std::string::npos ? "" : text.substr(first, last - first + 1);
    }

    std::string unquoted(std::string name)
    {
      name.erase(std::remove(name.begin(), name.end(), '"'), name.end());
      return trimmed(name);
    }

    std::string capitals(std::string text)
    {
      std::transform(text.begin(), text.end(), text.begin(),
                     [](const unsigned char c) { return std::toupper(c); });
      return text;
    }

    std::string without_blanks(std::string text)
    {
      text.erase(std::remove_if(text.begin(), text.end(),
                                [](const char c) { return c == ' ' || c == '\t'; }),
                 text.end());
      return text;
    }

    /// Whether a line begins with a star and is no comment.
    bool is_keyword(const std::string &line)
    {
      return !line.empty() && line[0] == '*' && line.rfind("**", 0) != 0;
    }
  } // namespace

  std::string deck_label(const std::string &text)
  {
    return plain_name(capitals(unquoted(text)));
  }

  std::string deck_keyword(const std::string &line)
  {
    static const std::map<std::string, std::string> known = []
    {
      std::map<std::string, std::string> result;
      for (const auto &[name, meaning] : deck_keywords())
        result[without_blanks(name)] = name;
      return result;
    }();
    const std::string name = capitals(without_blanks(line.substr(0, line.find(','))));
    const auto found       = known.find(name);
    if (found != known.end())
      return found->second;
    // Another one as it is written, for messages.
    const std::string as_written = capitals(trimmed(line.substr(0, line.find(','))));
    return as_written.find(' ') == std::string::npos ? name : as_written;
  }

  std::vector<std::string> deck_fields(const std::string &line)
  {
    std::vector<std::string> fields;
    std::size_t begin = 0;
    bool is_quoted    = false;
    for (std::size_t k = 0; k < line.size(); ++k)
      if (line[k] == '"')
        is_quoted = !is_quoted && line.find('"', k + 1) != std::string::npos;
      else if (line[k] == ',' && !is_quoted)
      {
        fields.push_back(trimmed(line.substr(begin, k - begin)));
        begin = k + 1;
      }
    fields.push_back(trimmed(line.substr(begin)));
    return fields;
  }

  bool is_deck_number(const std::string &field)
  {
    return !field.empty() && field.find_first_not_of("+-0123456789") == std::string::npos;
  }

  bool names_a_node(const std::string &label)
  {
    return is_deck_number(label.substr(label.rfind('.') + 1));
  }

  void SupportBlocks::see(const std::string &keyword)
  {
    const bool is_support = keyword == "*BOUNDARY";
    n_blocks += is_support && !is_inside;
    is_inside = is_support;
  }

  std::string SupportBlocks::set_of_nodes(const std::vector<std::string> &fields) const
  {
    std::string name = "BOUNDARY-" + std::to_string(n_blocks);
    for (std::size_t k = 1; k < std::min<std::size_t>(3, fields.size()); ++k)
      if (!fields[k].empty())
        name += "-" + deck_label(fields[k]);
    return name;
  }

  DeckLines::DeckLines(std::istream &in, const std::string &filename)
      : LineReader(in, filename), deck(filename)
  {
  }

  bool DeckLines::next_as_written(std::string &line)
  {
    while (!sources.empty())
    {
      Source &source = sources.back();
      if (source.next < source.lines.size())
      {
        const Line &replayed = source.lines[source.next++];
        filename             = replayed.file;
        number               = replayed.number;
        line = text = replayed.text;
        if (source.next == source.lines.size())
          sources.pop_back();
        return true;
      }
      if (source.file.is_open() && std::getline(source.file, line))
      {
        filename = source.name;
        number   = ++source.number;
        line = text = trimmed(line);
        return true;
      }
      sources.pop_back();
    }
    filename = deck;
    number   = n_own;
    if (!LineReader::next(line))
      return false;
    n_own = number;
    text  = line;
    return true;
  }

  bool DeckLines::next(std::string &line)
  {
    while (next_as_written(line))
    {
      if (!is_keyword(line) || deck_keyword(line) != "*INCLUDE")
        return true;
      include(read_keyword(line));
    }
    return false;
  }

  bool DeckLines::next_keyword(DeckKeyword &keyword)
  {
    for (std::string line; next(line);)
      if (is_keyword(line))
      {
        has_keyword = true;
        keyword     = read_keyword(line);
        if ((keyword.name == "*NODE" || keyword.name == "*ELEMENT") && keyword.has("INPUT"))
          include(keyword);
        return true;
      }
      else if (!has_keyword && !line.empty() && line[0] != '*')
        fail("data without a keyword before them: '" + line.substr(0, 60) +
             "'. A keyword begins with *, a comment with **.");
    return false;
  }

  bool DeckLines::next_data(std::vector<std::string> &fields)
  {
    for (std::string line; next(line);)
      if (is_keyword(line))
      {
        replay({current()}); // the next keyword
        return false;
      }
      else if (!line.empty() && line[0] != '*')
      {
        fields = deck_fields(line);
        return true;
      }
    return false;
  }

  void DeckLines::include(const DeckKeyword &by)
  {
    constexpr std::size_t deepest = 20, most = 1000;
    if (by.value("INPUT").empty())
      fail(by.name + " needs INPUT=.");
    if (sources.size() >= deepest)
      fail("files include each other more than " + std::to_string(deepest) + " deep.");
    if (included.size() >= most)
      fail("more than " + std::to_string(most) +
           " files are included, each counted as often as it is.");
    const std::filesystem::path path(by.raw.at("INPUT"));
    const std::string full = path.is_absolute()
                                 ? path.string()
                                 : (std::filesystem::path(deck).parent_path() / path).string();
    std::ifstream file     = open_regular_file(full);
    if (path.empty() || !file.is_open())
      fail("the included file '" + full.substr(0, 200) +
           "' cannot be read. Names are relative to the deck's directory.");
    sources.emplace_back();
    sources.back().file = std::move(file);
    sources.back().name = full;
    included.push_back(full);
  }

  std::vector<std::string> files_of_deck(const std::string &filename)
  {
    std::ifstream in = open_regular_file(filename);
    if (!in.is_open() || std::filesystem::path(filename).extension() != ".inp")
      return {};
    DeckLines lines(in, filename);
    for (DeckKeyword keyword; lines.next_keyword(keyword);)
    {
    }
    std::vector<std::string> names = lines.included_files();
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
  }

  void DeckLines::replay(const std::vector<Line> &lines)
  {
    sources.emplace_back();
    sources.back().lines = lines;
  }

  std::string DeckKeyword::value(const std::string &option) const
  {
    const auto found = options.find(without_blanks(option));
    return found == options.end() ? "" : found->second;
  }

  bool DeckKeyword::has(const std::string &option) const
  {
    return options.count(without_blanks(option)) > 0;
  }

  DeckKeyword DeckLines::read_keyword(std::string line)
  {
    while (line.back() == ',') // the options go on
      line += need("the rest of " + line.substr(0, 60));
    const std::vector<std::string> fields = deck_fields(line);
    DeckKeyword keyword;
    keyword.name = deck_keyword(line);
    for (std::size_t i = 1; i < fields.size(); ++i)
    {
      const std::size_t equals = fields[i].find('=');
      const std::string option = capitals(without_blanks(fields[i].substr(0, equals))),
                        value  = equals == std::string::npos
                                     ? ""
                                     : unquoted(fields[i].substr(equals + 1));
      keyword.raw[option]      = value;
      keyword.options[option]  = deck_label(value);
    }
    return keyword;
  }
} // namespace squeal
