#pragma once

#include <fstream>
#include <string>
#include <vector>

namespace squeal
{
  /// Reads a file of comma-separated values line by line. The first line names the columns; each
  /// other one has as many fields. Blanks around fields and empty lines are passed over, an empty
  /// field at the end counts. All errors are InputError, which begins with @p what and the line.
  class CsvReader
  {
  public:
    /// Opens the file and reads the names. @p what is the key and its value.
    CsvReader(const std::string &what, const std::string &filename);

    const std::vector<std::string> &columns() const
    {
      return names;
    }
    /// The number of a column, or how many there are if none has this name.
    std::size_t find(const std::string &column) const;

    /// Goes to the next line; false at the end of the file.
    bool next();
    const std::string &field(const std::size_t column) const
    {
      return fields[column];
    }
    /// The finite number in a field of this line.
    double number(std::size_t column) const;

    /// What messages about this line begin with.
    const std::string &place() const
    {
      return place_;
    }
    [[noreturn]] void fail(const std::string &message) const;

  private:
    const std::string what;
    std::ifstream in;
    std::vector<std::string> names, fields;
    unsigned int line_number = 0;
    std::string place_;
  };
} // namespace squeal
