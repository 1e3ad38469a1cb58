#pragma once

#include <squeal/mesh_files/mesh_file.h>

#include <fstream>
#include <list>
#include <map>

namespace squeal
{
  /// Returns a label of a deck in capitals, without blanks at the ends, without quotes, and plain
  /// (plain_name()).
  std::string deck_label(const std::string &text);

  /// Returns the keyword of a line that begins with a star, in capitals, its words separated by one
  /// blank however they are written: *SOLIDSECTION is *SOLID SECTION.
  std::string deck_keyword(const std::string &line);

  /// Fields between commas that are not quoted; an empty one at the end means that the data go on
  /// in the next line.
  std::vector<std::string> deck_fields(const std::string &line);

  /// Whether a field is an integer, as nodes and elements are named.
  bool is_deck_number(const std::string &field);
  /// Whether a label is a node's number, or instance.number.
  bool names_a_node(const std::string &label);

  /// Names sets for the nodes that supports give by their numbers: one for each range of components
  /// of a row of *BOUNDARY keywords.
  class SupportBlocks
  {
  public:
    /// Takes notice of the next keyword.
    void see(const std::string &keyword);
    /// The set of the node in a data line of *BOUNDARY.
    std::string set_of_nodes(const std::vector<std::string> &fields) const;

  private:
    unsigned int n_blocks = 0;
    bool is_inside        = false;
  };

  /// A line that begins with a star: the keyword and its options.
  struct DeckKeyword
  {
    std::string name;                           ///< with the star
    std::map<std::string, std::string> options; ///< by names without blanks
    std::map<std::string, std::string> raw;     ///< values as they are written

    bool has(const std::string &option) const;
    /// Empty where there is none.
    std::string value(const std::string &option) const;
  };

  /// Reads a deck of Abaqus or CalculiX, line by line or block by block: a keyword and its data.
  /// Files that it includes stand where they are included, so that their first lines may be data of
  /// the keyword before; a part's lines can be read again.
  class DeckLines : public LineReader
  {
  public:
    struct Line
    {
      std::string text, file;
      unsigned int number;
    };

    DeckLines(std::istream &in, const std::string &filename);

    /// Reads the next keyword, with lines on which its options go on; passes over what is left of
    /// the data of the one before. Returns false at the end. Throws InputError for data without a
    /// keyword before them.
    bool next_keyword(DeckKeyword &keyword);
    /// Reads the next line of data of the present keyword; comments and empty lines are passed
    /// over. Returns false where there is none.
    bool next_data(std::vector<std::string> &fields);

    /// Reads the next line, of an included file where a line includes one.
    bool next(std::string &line) override;
    /// Reads these lines first.
    void replay(const std::vector<Line> &lines);
    /// The current line.
    Line current() const
    {
      return {text, filename, number};
    }

    /// The names of files in the order in which they were included.
    const std::vector<std::string> &included_files() const
    {
      return included;
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
    bool next_as_written(std::string &line);
    DeckKeyword read_keyword(std::string line);
    /// Goes on in the file of INPUT=, relative to the deck's directory, and then comes back.
    void include(const DeckKeyword &by);

    const std::string deck;
    unsigned int n_own = 0;    ///< lines of the deck itself
    std::list<Source> sources; ///< the innermost last
    std::vector<std::string> included;
    std::string text;
    bool has_keyword = false; ///< has read one
  };

  /// Lists the files that a deck includes, each once; none for a file of another ending. Throws
  /// InputError if one cannot be read.
  std::vector<std::string> files_of_deck(const std::string &filename);
} // namespace squeal
