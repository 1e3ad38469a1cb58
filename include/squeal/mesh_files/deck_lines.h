#pragma once

#include <squeal/mesh_files/mesh_file.h>

#include <fstream>
#include <list>
#include <map>

namespace squeal
{
  /// The lines of a deck of Abaqus or CalculiX in the order in which they count: files that it
  /// includes stand where they are included, and a part's lines can be read again.
  class DeckLines : public LineReader
  {
  public:
    struct Line
    {
      std::string text, file;
      unsigned int number;
    };

    DeckLines(std::istream &in, const std::string &filename);

    bool next(std::string &line) override;
    /// Goes on in another file and then comes back; @p name is relative to the deck's directory.
    void include(const std::string &name);
    /// Reads these lines first.
    void replay(const std::vector<Line> &lines);
    /// The current line.
    Line current() const
    {
      return {text, filename, number};
    }

  private:
    struct Source
    {
      std::ifstream file;
      std::string name;
      unsigned int number = 0;
      std::vector<Line> lines; ///< where there is no file
      std::size_t next = 0;
    };
    const std::string deck;
    unsigned int n_own = 0;    ///< lines of the deck itself
    std::list<Source> sources; ///< the innermost last
    std::string text;
  };

  /// Keywords and labels of decks: capitals, no blanks at the ends, no quotes.
  std::string deck_label(const std::string &text);

  /// Fields between commas; an empty one at the end means that the data go on in the next line.
  std::vector<std::string> deck_fields(const std::string &line);

  /// A line that begins with a star: the keyword and its options.
  struct DeckKeyword
  {
    std::string name; ///< with the star
    std::map<std::string, std::string> options;
    std::map<std::string, std::string> raw; ///< values as they are written

    bool has(const std::string &option) const
    {
      return options.count(option) > 0;
    }
    /// Empty where there is none.
    std::string value(const std::string &option) const;
  };

  /// The keyword of a line, with lines on which its options go on.
  DeckKeyword read_keyword(DeckLines &lines, std::string line);
} // namespace squeal
