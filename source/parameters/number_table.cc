#include <squeal/base/csv_reader.h>
#include <squeal/base/errors.h>
#include <squeal/parameters/number_table.h>

#include <cmath>

namespace squeal
{
  NumberTable read_number_table(const std::string &key, const std::string &filename,
                                const NumberTableRules &rules)
  {
    CsvReader reader(key, filename);
    const std::size_t missing = reader.columns().size();
    std::vector<std::size_t> columns;
    NumberTable table;
    for (const std::string &name : rules.columns)
    {
      columns.push_back(reader.find(name));
      if (columns.back() == missing)
        reader.fail("there is no column " + name + ". " + rules.needed);
    }
    for (const std::string &name : rules.optional_columns)
    {
      columns.push_back(reader.find(name));
      table.has_optional_column.push_back(columns.back() < missing);
    }
    while (reader.next())
    {
      if (table.rows.size() == rules.most_rows)
        reader.fail("there are more than " + std::to_string(rules.most_rows) + rules.too_many);
      std::vector<double> row;
      for (const std::size_t column : columns)
      {
        row.push_back(column == missing ? 0 : reader.number(column));
        if (std::abs(row.back()) > rules.largest)
          reader.fail(reader.columns()[column] + " = " + reader.field(column) + rules.too_large);
      }
      table.rows.push_back(std::move(row));
      table.places.push_back(reader.place());
    }
    return table;
  }
} // namespace squeal
