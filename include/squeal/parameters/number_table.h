#pragma once

#include <string>
#include <vector>

namespace squeal
{
  /// What a table of numbers must be like.
  struct NumberTableRules
  {
    std::vector<std::string> columns;          ///< wanted, in this order
    std::vector<std::string> optional_columns; ///< after them, if the file has them
    std::string needed;                        ///< "Needed are ..." of a missing column
    double largest;                            ///< size of a number
    std::string too_large;                     ///< why a larger one is none
    std::size_t most_rows;
    std::string too_many; ///< what to do about more
  };

  /// The wanted columns of a file of comma separated values whose first line has names.
  struct NumberTable
  {
    std::vector<std::vector<double>> rows;
    std::vector<std::string> places;       ///< of each row, as messages begin
    std::vector<bool> has_optional_column; ///< by optional column; numbers of missing ones are 0
  };
  /// Throws InputError, which names @p key, line and column. Other columns are passed over.
  NumberTable read_number_table(const std::string &key, const std::string &filename,
                                const NumberTableRules &rules);
} // namespace squeal
