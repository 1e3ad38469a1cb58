#pragma once

#include <squeal/linear_algebra.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace squeal
{
  /// The entries of one row, with several values each, which grow by addition in any order and come
  /// out by ascending column: a bit per column finds them without sorting.
  class RowSums
  {
  public:
    RowSums(const unsigned int n_columns, const unsigned int n_values)
        : n_values(n_values), values(std::size_t(n_columns) * n_values), is_met(n_columns / 64 + 1),
          first_word(is_met.size())
    {
    }

    /// The values at a column, zero at first, to add to.
    double *at(const unsigned int column)
    {
      const std::size_t word = column / 64;
      is_met[word] |= std::uint64_t(1) << (column % 64);
      first_word = std::min(first_word, word);
      last_word  = std::max(last_word, word);
      return &values[std::size_t(column) * n_values];
    }

    /// Calls visit(column, values) for every column met, ascending, and starts a new row.
    template <typename Visit>
    void take(const Visit &visit)
    {
      for (std::size_t word = first_word; word <= last_word && word < is_met.size(); ++word)
      {
        for (std::uint64_t bits = is_met[word]; bits != 0; bits &= bits - 1)
        {
          const unsigned int column = 64 * word + __builtin_ctzll(bits);
          double *const at_column   = &values[std::size_t(column) * n_values];
          visit(column, static_cast<const double *>(at_column));
          std::fill_n(at_column, n_values, 0.);
        }
        is_met[word] = 0;
      }
      first_word = is_met.size();
      last_word  = 0;
    }

  private:
    const unsigned int n_values;
    std::vector<double> values;
    std::vector<std::uint64_t> is_met;
    std::size_t first_word, last_word = 0;
  };

  /// Rows of a matrix one after the other, by ascending column.
  struct CompressedRows
  {
    std::vector<PetscInt> begins = {0}, columns;
    std::vector<PetscScalar> values;

    /// An entry of the last row; zeros are not stored.
    void add(const PetscInt column, const PetscScalar value)
    {
      if (value == 0)
        return;
      columns.push_back(column);
      values.push_back(value);
    }
    void end_row()
    {
      begins.push_back(columns.size());
    }
    void reserve(const std::size_t n_entries)
    {
      columns.reserve(n_entries);
      values.reserve(n_entries);
    }
  };

  /// The matrix with these rows on this rank, columns numbered globally. Collective.
  Matrix make_matrix(const RowRange &range, const CompressedRows &rows);
} // namespace squeal
