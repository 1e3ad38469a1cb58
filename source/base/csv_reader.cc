#include <squeal/base/csv_reader.h>
#include <squeal/base/errors.h>
#include <squeal/base/files.h>
#include <squeal/base/text.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace squeal
{
  CsvReader::CsvReader(const std::string &what, const std::string &filename)
      : what(what), in(open_regular_file(filename))
  {
    if (!in.is_open() || !next())
      throw InputError(what + ": the file cannot be read, is empty, or is not a regular file.");
    for (const std::string &name : fields)
      if (!name.empty() && std::count(fields.begin(), fields.end(), name) > 1)
        fail("the column '" + name + "' is there twice.");
    names = std::move(fields);
  }

  std::size_t CsvReader::find(const std::string &column) const
  {
    return std::find(names.begin(), names.end(), column) - names.begin();
  }

  bool CsvReader::next()
  {
    const char *const blanks = " \t\r";
    fields.clear();
    std::string line;
    do
    {
      if (!std::getline(in, line))
        return false;
      ++line_number;
    } while (line.find_first_not_of(blanks) == std::string::npos);
    place_ = what + ", line " + std::to_string(line_number) + ": ";
    if (line.find('\0') != std::string::npos)
      fail("there is a NUL, as no text has.");
    for (std::size_t begin = 0, end = 0; end != std::string::npos; begin = end + 1)
    {
      end               = line.find(',', begin);
      std::string field = line.substr(begin, end - begin);
      field.erase(0, field.find_first_not_of(blanks));
      field.erase(field.find_last_not_of(blanks) + 1);
      fields.push_back(std::move(field));
    }
    if (!names.empty() && fields.size() != names.size())
      fail(std::to_string(fields.size()) + " fields; the first line has " +
           std::to_string(names.size()) + ".");
    return true;
  }

  double CsvReader::number(const std::size_t column) const
  {
    const std::optional<double> value = decimal_number(fields[column]);
    if (!value)
      fail("'" + fields[column].substr(0, 60) + "' is not a number (column " + names[column] +
           ").");
    return *value;
  }

  void CsvReader::fail(const std::string &message) const
  {
    throw InputError(place_ + message);
  }
} // namespace squeal
