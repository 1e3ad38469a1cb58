#include <squeal/base/errors.h>
#include <squeal/base/files.h>
#include <squeal/parameters/number_table.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <cmath>
#include <fstream>

namespace squeal
{
  namespace
  {
    std::vector<std::string> fields_of(std::string text)
    {
      if (!text.empty() && text.back() == '\r')
        text.pop_back();
      std::vector<std::string> fields = dealii::Utilities::split_string_list(text, ',');
      // An empty field at the end counts.
      if (!text.empty() && text.back() == ',')
        fields.emplace_back();
      return fields;
    }
  } // namespace

  NumberTable read_number_table(const std::string &key, const std::string &filename,
                                const NumberTableRules &rules)
  {
    std::ifstream in = open_regular_file(filename);
    std::string line;
    if (!in.is_open() || !std::getline(in, line))
      throw InputError(key + ": the file cannot be read, is empty, or is not a regular file.");
    const std::vector<std::string> header = fields_of(line);
    std::vector<std::size_t> places; // of the columns; beyond the header: missing
    NumberTable table;
    for (const std::string &name : rules.columns)
    {
      places.push_back(std::find(header.begin(), header.end(), name) - header.begin());
      if (places.back() == header.size())
        throw InputError(key + ", line 1: there is no column " + name + ". " + rules.needed);
    }
    for (const std::string &name : rules.optional_columns)
    {
      places.push_back(std::find(header.begin(), header.end(), name) - header.begin());
      table.has_optional_column.push_back(places.back() < header.size());
    }

    for (unsigned int number = 2; std::getline(in, line); ++number)
    {
      if (line.find_first_not_of(" \t\r") == std::string::npos)
        continue;
      const std::vector<std::string> fields = fields_of(line);
      const std::string place               = key + ", line " + std::to_string(number) + ": ";
      if (fields.size() != header.size())
        throw InputError(place + std::to_string(fields.size()) + " fields, the header has " +
                         std::to_string(header.size()) + ".");
      if (table.rows.size() == rules.most_rows)
        throw InputError(place + "there are more than " + std::to_string(rules.most_rows) +
                         rules.too_many);
      std::vector<double> row;
      for (const std::size_t i : places)
      {
        double x = i < fields.size() ? NAN : 0;
        try
        {
          if (i < fields.size())
            x = dealii::Utilities::string_to_double(fields[i]);
        }
        catch (const std::exception &)
        {
        }
        if (!std::isfinite(x))
          throw InputError(place + header[i] + " = " + fields[i] + " is not a number.");
        if (std::abs(x) > rules.largest)
          throw InputError(place + header[i] + " = " + fields[i] + rules.too_large);
        row.push_back(x);
      }
      table.rows.push_back(std::move(row));
      table.places.push_back(place);
    }
    return table;
  }
} // namespace squeal
