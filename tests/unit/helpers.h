#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/linalg/matrix_market.h>
#include <squeal/linalg/multi_vector.h>

#include <deal.II/base/mpi.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

/// What several unit tests share. Everything distributed lives on MPI_COMM_WORLD; results that are
/// compared are replicated, so that every rank takes the same branch.
namespace squeal::tests
{
  inline unsigned int this_rank()
  {
    return dealii::Utilities::MPI::this_mpi_process(MPI_COMM_WORLD);
  }

  inline unsigned int n_ranks()
  {
    return dealii::Utilities::MPI::n_mpi_processes(MPI_COMM_WORLD);
  }

  /// a += c b
  inline void add(MultiVector &a, const double c, const MultiVector &b)
  {
    for (unsigned int i = 0; i < a.n_local(); ++i)
      a.data()[i] += c * b.data()[i];
  }

  /// a + c b
  inline MultiVector sum(MultiVector a, const double c, const MultiVector &b)
  {
    add(a, c, b);
    return a;
  }

  /// |computed - expected| / scale; the scale is |expected| unless given.
  inline double relative_error(const double computed, const double expected, const double scale = 0)
  {
    return std::abs(computed - expected) / (scale > 0 ? scale : std::abs(expected));
  }

  /// The message of the exception that the function throws; empty if it throws none of that type.
  template <typename Exception, typename Function>
  std::string message_of(const Function &function)
  {
    try
    {
      function();
    }
    catch (const Exception &exception)
    {
      return exception.what();
    }
    return "";
  }

  inline bool contains(const std::string &text, const std::string &part)
  {
    return text.find(part) != std::string::npos;
  }

  /// A file with this ending that disappears. Each rank has its own.
  struct TemporaryFile
  {
    TemporaryFile(const std::string &text, const std::string &ending)
        : name((std::filesystem::temp_directory_path() /
                ("squeal-test-" + std::to_string(getpid()) + "." + ending))
                   .string())
    {
      std::ofstream(name, std::ios::binary) << text;
    }
    ~TemporaryFile()
    {
      std::filesystem::remove(name);
    }
    const std::string name;
  };

  /// A reproducible number in [-1, 1] that looks random.
  inline double scattered(const unsigned int i, const unsigned int j = 0)
  {
    return std::sin(12.9898 * (i + 1) + 78.233 * (j + 1) + 0.37 * i * j);
  }

  /// n rows in even contiguous parts, one of each rank; a rank may get none.
  inline RowRange even_rows(const unsigned int n)
  {
    RowRange rows;
    rows.comm  = MPI_COMM_WORLD;
    rows.begin = n * this_rank() / n_ranks();
    rows.end   = n * (this_rank() + 1) / n_ranks();
    rows.size  = n;
    return rows;
  }

  struct Entry
  {
    unsigned int row, column;
    double value;
  };

  inline std::vector<Entry> operator+(std::vector<Entry> a, const std::vector<Entry> &b)
  {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  }

  inline std::vector<Entry> diagonal(const unsigned int n, const double value,
                                     const unsigned int first = 0)
  {
    std::vector<Entry> entries;
    for (unsigned int i = first; i < first + n; ++i)
      entries.push_back({i, i, value});
    return entries;
  }

  /// The distributed matrix of entries that every rank knows.
  inline Matrix matrix_of(const RowRange &rows, const std::vector<Entry> &entries)
  {
    MatrixMarketFile list;
    list.n_rows = list.n_columns = rows.size;
    for (const Entry &entry : entries)
    {
      list.rows.push_back(entry.row);
      list.columns.push_back(entry.column);
      list.values.push_back(entry.value);
    }
    return distribute(list, rows);
  }

  inline MultiVector block_of(const RowRange &rows, const unsigned int n_columns,
                              const std::function<double(unsigned int, unsigned int)> &value)
  {
    MultiVector block(rows, n_columns);
    for (unsigned int j = 0; j < n_columns; ++j)
      for (unsigned int row = rows.begin; row < rows.end; ++row)
        block.column(j)[row - rows.begin] = value(row, j);
    return block;
  }

  /// A block on every rank, as a dense matrix.
  inline DenseMatrix replicated(const MultiVector &block)
  {
    const RowRange &rows = block.row_range();
    DenseMatrix all(rows.size, block.n_columns());
    for (unsigned int j = 0; j < block.n_columns(); ++j)
      for (unsigned int row = rows.begin; row < rows.end; ++row)
        all(row, j) = block.column(j)[row - rows.begin];
    MPI_Allreduce(MPI_IN_PLACE, all.values.data(), all.values.size(), MPI_DOUBLE, MPI_SUM,
                  rows.comm);
    return all;
  }

  /// A small distributed matrix on every rank.
  inline DenseMatrix replicated(const RowRange &rows, const Matrix &matrix)
  {
    const MultiVector identity =
        block_of(rows, rows.size,
                 [](const unsigned int i, const unsigned int j) { return i == j ? 1. : 0.; });
    return replicated(multiply(matrix, identity));
  }

  /// x^T A y of two columns.
  inline double bilinear_form(const MultiVector &x, const Matrix &matrix, const MultiVector &y)
  {
    return inner_product(x, multiply(matrix, y));
  }

  /// The largest entry by modulus; 0 for the empty matrix.
  inline double largest_entry(const RowRange &rows, const Matrix &matrix)
  {
    double largest = 0;
    for (unsigned int row = rows.begin; matrix && row < rows.end; ++row)
    {
      PetscInt n                = 0;
      const PetscScalar *values = nullptr;
      SQUEAL_PETSC(MatGetRow(matrix, row, &n, nullptr, &values));
      for (PetscInt k = 0; k < n; ++k)
        largest = std::max(largest, std::abs(values[k]));
      SQUEAL_PETSC(MatRestoreRow(matrix, row, &n, nullptr, &values));
    }
    return dealii::Utilities::MPI::max(largest, MPI_COMM_WORLD);
  }

  /// The largest entry of A + sign A^T relative to that of A: 0 for sign -1 if A is symmetric, for
  /// sign +1 if it is skew.
  inline double asymmetry(const RowRange &rows, const Matrix &matrix, const double sign = -1)
  {
    Mat transpose = nullptr;
    SQUEAL_PETSC(MatTranspose(matrix, MAT_INITIAL_MATRIX, &transpose));
    const Matrix owner(transpose);
    return largest_entry(rows, sum_of(rows, {{1., matrix}, {sign, owner}})) /
           largest_entry(rows, matrix);
  }
} // namespace squeal::tests
