#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/linalg/matrix.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <numeric>
#include <type_traits>
#include <utility>
#include <vector>

// Sparse matrices row by row, as they are stored, and the ways to fill them: rows of PETSc's
// matrices that are read in place; rows that grow by addition (RowSums); blocks of entries whose
// places repeat from cell to cell (BlockAdder) or from step to step (RepeatedEntries). What is made
// for rows of other ranks is sent there by exchange().
namespace squeal
{
  /// Calls MPI_Alltoallv: part r of @p sent, of length lengths[r], goes to rank r. Returns what
  /// arrives, ordered by sender; @p expected gets the lengths. Collective.
  template <typename Value>
  std::vector<Value> exchange(const std::vector<Value> &sent, const std::vector<int> &lengths,
                              std::vector<int> &expected, const MPI_Comm comm)
  {
    static_assert(std::is_trivially_copyable_v<Value>);
    const unsigned int n_ranks = lengths.size();
    std::vector<int> to(n_ranks), from(n_ranks);
    expected.resize(n_ranks);
    MPI_Alltoall(lengths.data(), 1, MPI_INT, expected.data(), 1, MPI_INT, comm);
    std::partial_sum(lengths.begin(), lengths.end() - 1, to.begin() + 1);
    std::partial_sum(expected.begin(), expected.end() - 1, from.begin() + 1);
    std::vector<Value> received(from.back() + expected.back());
    MPI_Datatype type = MPI_DATATYPE_NULL;
    MPI_Type_contiguous(sizeof(Value), MPI_BYTE, &type);
    MPI_Type_commit(&type);
    MPI_Alltoallv(sent.data(), lengths.data(), to.data(), type, received.data(), expected.data(),
                  from.data(), type, comm);
    MPI_Type_free(&type);
    return received;
  }

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

    /// To add to the row. Its members are a copy, which the compiler keeps in registers: one at a
    /// time.
    class Adder
    {
    public:
      explicit Adder(RowSums &sums)
          : sums(sums), values(sums.values.data()), is_met(sums.is_met.data()),
            n_values(sums.n_values), first_word(sums.first_word), last_word(sums.last_word)
      {
      }
      ~Adder()
      {
        sums.first_word = first_word;
        sums.last_word  = last_word;
      }
      Adder(const Adder &)            = delete;
      Adder &operator=(const Adder &) = delete;

      /// The values at a column, zero at first, to add to.
      double *at(const unsigned int column)
      {
        const unsigned int word = column / 64;
        is_met[word] |= std::uint64_t(1) << (column % 64);
        first_word = std::min(first_word, word);
        last_word  = std::max(last_word, word);
        return values + std::size_t(column) * n_values;
      }

    private:
      RowSums &sums;
      double *const values;
      std::uint64_t *const is_met;
      const std::size_t n_values;
      unsigned int first_word, last_word;
    };

    /// Calls visit(column, values) for every column met, ascending, and starts a new row.
    template <typename Visit>
    void take(const Visit &visit)
    {
      for (unsigned int word = first_word; word <= last_word && word < is_met.size(); ++word)
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
    unsigned int first_word, last_word = 0;
  };

  /// Leaves numbers that a vector makes room for as they are: memory is touched only when they are
  /// written, which counts where matrices are copied.
  template <typename Number>
  struct Unfilled : std::allocator<Number>
  {
    template <typename Other>
    struct rebind
    {
      using other = Unfilled<Other>;
    };
    template <typename Other>
    void construct(Other *) noexcept
    {
    }
    template <typename Other, typename... Arguments>
    void construct(Other *at, Arguments &&...arguments)
    {
      ::new (static_cast<void *>(at)) Other(std::forward<Arguments>(arguments)...);
    }
  };

  /// Rows of a matrix one after the other, by ascending column.
  struct CompressedRows
  {
    std::vector<PetscInt> begins = {0};
    std::vector<PetscInt, Unfilled<PetscInt>> columns;
    std::vector<PetscScalar, Unfilled<PetscScalar>> values;

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
    void resize(const std::size_t n_entries)
    {
      columns.resize(n_entries);
      values.resize(n_entries);
    }
  };

  /// Y += c A X, where row k of X is column k of @p x and so for Y: a small matrix holds a vector
  /// as a row.
  void add_product(double c, const CompressedRows &a, const DenseMatrix &x, DenseMatrix &y);
  /// Y += c A^T X.
  void add_transposed_product(double c, const CompressedRows &a, const DenseMatrix &x,
                              DenseMatrix &y);

  /// The arrays of a sequential AIJ matrix, read only.
  class SequentialRows
  {
  public:
    explicit SequentialRows(Mat matrix);
    ~SequentialRows();
    SequentialRows(const SequentialRows &)            = delete;
    SequentialRows &operator=(const SequentialRows &) = delete;

    /// Calls visit(column, value) for the entries of a row.
    template <typename Visit>
    void for_entries(const PetscInt row, const Visit &visit) const
    {
      for (PetscInt k = begins[row]; k < begins[row + 1]; ++k)
        visit(columns[k], values[k]);
    }
    std::size_t n_entries() const
    {
      return begins[n_rows];
    }

    PetscInt n_rows        = 0;
    const PetscInt *begins = nullptr, *columns = nullptr;
    const PetscScalar *values = nullptr;

  private:
    Mat matrix;
  };

  /// This rank's rows of an AIJ matrix, read only: faster than row by row from PETSc, which sorts
  /// those that are distributed.
  class LocalRows
  {
  public:
    LocalRows(Mat matrix, const RowRange &range);

    /// Calls visit(column, value) for the entries of a row, in no order. Rows and columns are
    /// numbered globally.
    template <typename Visit>
    void for_entries(const PetscInt row, const Visit &visit) const
    {
      own->for_entries(row - begin, [&](const PetscInt column, const PetscScalar value)
                       { visit(begin + column, value); });
      if (coupled)
        coupled->for_entries(row - begin, [&](const PetscInt column, const PetscScalar value)
                             { visit(coupled_columns[column], value); });
    }
    std::size_t n_entries() const
    {
      return own->n_entries() + (coupled ? coupled->n_entries() : 0);
    }

  private:
    const PetscInt begin;
    std::unique_ptr<const SequentialRows> own, coupled; ///< columns of this rank and of others
    const PetscInt *coupled_columns = nullptr;
  };

  /// Adds small dense blocks to an assembled AIJ matrix that has all their places: where row and
  /// column are this rank's, into its array, without a search for each of them. While it exists
  /// nobody else may change the matrix, which is to be compressed afterwards.
  class BlockAdder
  {
  public:
    BlockAdder(const Matrix &matrix, const RowRange &range);
    ~BlockAdder();
    BlockAdder(const BlockAdder &)            = delete;
    BlockAdder &operator=(const BlockAdder &) = delete;

    /// Where the entries between some unknowns are in the array of a matrix, row by row; none (-1)
    /// for those of other ranks and for numbers below zero. Matrices of one pattern have the same.
    std::vector<PetscInt> places(const std::vector<PetscInt> &unknowns) const;

    /// Adds a block of n x n entries, stored by rows, between the unknowns from @p first_row and
    /// those from @p first_column on; places() tells where.
    void add(const std::vector<PetscInt> &unknowns, const std::vector<PetscInt> &places,
             unsigned int first_row, unsigned int first_column, unsigned int n,
             const PetscScalar *block);

  private:
    const Matrix &matrix;
    const PetscInt begin, end;
    Mat own;
    const SequentialRows rows; ///< of own
    PetscScalar *values = nullptr;
  };

  /// The matrix with these rows on this rank, columns numbered globally. On one rank it keeps the
  /// arrays and does not copy them. Collective.
  Matrix make_matrix(const RowRange &range, CompressedRows rows);

  /// to := to + c A in the places that it has. If A has others on some rank, false: then what has
  /// become of the matrix is of no use. Collective.
  bool add_in_place(const RowRange &range, double c, const Matrix &a, const Matrix &to);

  /// A + c B; quick where B has no places of its own. Collective.
  Matrix sum_in_places(const RowRange &range, const Matrix &a, double c, const Matrix &b);

  /// Entries of a matrix that is made again and again: of the same places in the same order, with
  /// other values. The third time the places need not be looked for any more. Zeros are not stored.
  class RepeatedEntries
  {
  public:
    /// Entries with a negative row or column are skipped.
    void add(const int row, const int column, const double value)
    {
      if (row < 0 || column < 0)
        return;
      if (n_made == 0)
        once.add(row, column, value);
      else if (n_made == 1)
        recorded.push_back({key(row, column), value});
      else
        sums[places.at(n_added++)] += value; // more entries than before throw std::out_of_range
    }
    /// Collective. The next matrix begins empty.
    Matrix make_matrix(const RowRange &range);

  private:
    static std::uint64_t key(const std::uint64_t row, const std::uint64_t column)
    {
      return row << 32 | column;
    }
    static unsigned int row_of(const std::uint64_t key)
    {
      return key >> 32;
    }
    static unsigned int column_of(const std::uint64_t key)
    {
      return key & 0xffffffffu;
    }
    void find_places();

    unsigned int n_made = 0;
    EntryList once;
    std::vector<std::pair<std::uint64_t, double>> recorded;
    std::vector<std::uint64_t> keys;  ///< of the distinct places, ascending
    std::vector<unsigned int> places; ///< of each entry, among them
    std::vector<double> sums;         ///< by place
    std::size_t n_added = 0;
  };
} // namespace squeal
