#include <squeal/base/files.h>
#include <squeal/mesh_files/deck_lines.h>

#include <algorithm>
#include <filesystem>

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

    std::string unquoted(const std::string &text)
    {
      std::string name = trimmed(text);
      name.erase(std::remove(name.begin(), name.end(), '"'), name.end());
      return name;
    }

    /// Whether a line begins with a star and is no comment.
    bool is_keyword(const std::string &line)
    {
      return !line.empty() && line[0] == '*' && line.rfind("**", 0) != 0;
    }
  } // namespace

  std::string deck_label(const std::string &text)
  {
    std::string name = unquoted(text);
    std::transform(name.begin(), name.end(), name.begin(),
                   [](const unsigned char c) { return std::toupper(c); });
    return name;
  }

  std::vector<std::string> deck_fields(const std::string &line)
  {
    std::vector<std::string> fields;
    std::size_t begin = 0;
    for (std::size_t comma = line.find(','); comma != std::string::npos;
         comma             = line.find(',', begin))
    {
      fields.push_back(trimmed(line.substr(begin, comma - begin)));
      begin = comma + 1;
    }
    fields.push_back(trimmed(line.substr(begin)));
    return fields;
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
      if (!is_keyword(line) || deck_label(deck_fields(line)[0]) != "*INCLUDE")
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
        fail("data without a keyword before them: '" + line.substr(0, 60) + "'.");
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
    constexpr std::size_t deepest = 20;
    if (by.value("INPUT").empty())
      fail(by.name + " needs INPUT=.");
    if (sources.size() >= deepest)
      fail("files include each other more than " + std::to_string(deepest) + " deep.");
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
  }

  void DeckLines::replay(const std::vector<Line> &lines)
  {
    sources.emplace_back();
    sources.back().lines = lines;
  }

  std::string DeckKeyword::value(const std::string &option) const
  {
    const auto found = options.find(option);
    return found == options.end() ? "" : found->second;
  }

  DeckKeyword DeckLines::read_keyword(std::string line)
  {
    while (line.back() == ',') // the options go on
      line += need("the rest of " + line.substr(0, 60));
    const std::vector<std::string> fields = deck_fields(line);
    DeckKeyword keyword;
    keyword.name = deck_label(fields[0]);
    for (std::size_t i = 1; i < fields.size(); ++i)
    {
      const std::size_t equals = fields[i].find('=');
      const std::string option = deck_label(fields[i].substr(0, equals)),
                        value  = equals == std::string::npos
                                     ? ""
                                     : unquoted(fields[i].substr(equals + 1));
      keyword.raw[option]      = value;
      keyword.options[option]  = deck_label(value);
    }
    return keyword;
  }
} // namespace squeal
