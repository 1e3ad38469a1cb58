#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/base/errors.h>
#include <squeal/linalg/matrix_market.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
namespace squeal::tests::matrix_market_tests
{
  namespace
  {
    /// The file as a dense matrix; entries at the same place are added.
    DenseMatrix read(const std::string &text)
    {
      const TemporaryFile temporary(text, "mtx");
      const MatrixMarketFile file = read_matrix_market(temporary.name, "Matrices/Mass");
      DenseMatrix dense(file.n_rows, file.n_columns);
      for (std::size_t k = 0; k < file.values.size(); ++k)
        dense(file.rows[k], file.columns[k]) += file.values[k];
      return dense;
    }

    bool equals(const DenseMatrix &a, const unsigned int n_rows,
                const std::vector<double> &by_columns)
    {
      return a.n_rows == n_rows && a.values == by_columns;
    }

    /// The message without the part that every message has: key, file and "line N: ".
    void check_error(const std::string &text, const unsigned int line, const std::string &part)
    {
      CAPTURE(text);
      const TemporaryFile temporary(text, "mtx");
      const std::string message =
          message_of<InputError>([&]() { read_matrix_market(temporary.name, "Matrices/Mass"); });
      CAPTURE(message);
      CHECK(contains(message, "Matrices/Mass = " + temporary.name + ", line " +
                                  std::to_string(line) + ": "));
      CHECK(contains(message, part));
    }

    const std::string coordinate = "%%MatrixMarket matrix coordinate real general\n";
  } // namespace

  TEST_CASE("matrix_market: coordinate files")
  {
    // [1 0 -2.5; 0 4e3 0] with comments, blank lines, tabs, Windows line ends, capitals in the
    // banner.
    CHECK(equals(read("%%MatrixMarket MATRIX Coordinate Real General\r\n% a comment\n\n2 3 3\n"
                      "1 1 1\n% another\n\t2  2\t4e3 \r\n1 3 -2.5"),
                 2, {1, 0, 0, 4e3, -2.5, 0}));
    // Integer field. Symmetric: the other half follows, the diagonal is not doubled.
    CHECK(equals(read("%%MatrixMarket matrix coordinate integer symmetric\n2 2 2\n1 1 5\n2 1 -3\n"),
                 2, {5, -3, -3, 0}));
    // Skew-symmetric: the other half has the opposite sign.
    CHECK(equals(read("%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 1\n2 1 7\n"), 2,
                 {0, 7, -7, 0}));
    // No entries at all: the zero matrix.
    CHECK(equals(read(coordinate + "2 2 0\n"), 2, {0, 0, 0, 0}));
  }

  TEST_CASE("matrix_market: array files are stored by columns")
  {
    CHECK(equals(read("%%MatrixMarket matrix array real general\n2 3\n1\n2\n3\n4\n5\n6\n"), 2,
                 {1, 2, 3, 4, 5, 6}));
    // Symmetric: the lower triangle with the diagonal, (1,1) (2,1) (3,1) (2,2) (3,2) (3,3).
    CHECK(equals(read("%%MatrixMarket matrix array real symmetric\n3 3\n1\n2\n3\n4\n5\n6\n"), 3,
                 {1, 2, 3, 2, 4, 5, 3, 5, 6}));
    // Skew-symmetric: without the diagonal, (2,1) (3,1) (3,2).
    CHECK(equals(read("%%MatrixMarket matrix array real skew-symmetric\n3 3\n1\n2\n3\n"), 3,
                 {0, 1, 2, -1, 0, 3, -2, -3, 0}));
  }

  TEST_CASE("matrix_market: malformed headers are errors of line 1")
  {
    check_error("", 1, "%%MatrixMarket");
    check_error("1 1 1\n1 1 1\n", 1, "%%MatrixMarket");
    check_error("%%MatrixMarket vector coordinate real general\n", 1, "%%MatrixMarket");
    check_error("%%MatrixMarket matrix sparse real general\n1 1 1\n1 1 1\n", 1, "'sparse'");
    check_error("%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 0\n", 1,
                "'complex'");
    check_error("%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n", 1, "'pattern'");
    check_error("%%MatrixMarket matrix coordinate real hermitian\n1 1 1\n1 1 1\n", 1,
                "'hermitian'");
    check_error("%%MatrixMarket matrix coordinate real\n1 1 1\n1 1 1\n", 1, "symmetry");
  }

  TEST_CASE("matrix_market: malformed sizes name their line")
  {
    check_error(coordinate, 1, "sizes");
    check_error(coordinate + "% only a comment\n", 2, "sizes");
    check_error(coordinate + "\n2 two 1\n", 3, "'2 two 1'");
    check_error(coordinate + "2 2\n", 2, "'2 2'"); // the number of entries is missing
    check_error(coordinate + "0 2 1\n1 1 1\n", 2, "positive");
    check_error(coordinate + "2 -2 1\n1 1 1\n", 2, "positive");
    check_error(coordinate + "2 2 -1\n", 2, "positive");
    check_error(coordinate + "99999999999 2 1\n1 1 1\n", 2, "rows");
  }

  TEST_CASE("matrix_market: malformed entries name their line")
  {
    check_error(coordinate + "2 2 2\n1 1 1\n", 3, "entry 2 of 2");
    check_error(coordinate + "% c\n2 2 1\n1 1 1\n\n2 2 2\n", 6, "more entries");
    check_error(coordinate + "2 2 1\n1 1\n", 3, "'1 1'");
    check_error(coordinate + "2 2 1\n1 1 one\n", 3, "'1 1 one'");
    check_error(coordinate + "2 2 1\n1 1 1 1\n", 3, "'1 1 1 1'");
    check_error(coordinate + "2 2 1\n1.5 1 1\n", 3, "'1.5 1 1'");
    check_error(coordinate + "2 2 1\na 1 1\n", 3, "'a 1 1'");
    check_error(coordinate + "2 2 2\n1 1 1\n3 1 1\n", 4, "(3, 1)");
    check_error(coordinate + "2 2 1\n0 1 1\n", 3, "(0, 1)");
    check_error(coordinate + "2 2 1\n1 1 nan\n", 3, "finite");
    check_error(coordinate + "2 2 1\n1 1 1e999\n", 3, "finite");
    check_error("%%MatrixMarket matrix array real general\n2 1\n1\nx\n", 4, "'x'");
    check_error("%%MatrixMarket matrix array real general\n2 1\n1 2\n", 3, "'1 2'");
    check_error("%%MatrixMarket matrix array real general\n2 1\n1\n", 3, "entry 2 of 2");
  }

  // Each of these files contradicts itself.
  TEST_CASE("matrix_market: a skew-symmetric file has no diagonal")
  {
    // A^T = -A needs A(1, 1) = 0.
    check_error("%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 1\n1 1 3\n", 3,
                "(1, 1)");
  }

  TEST_CASE("matrix_market: a symmetric file lists the lower triangle only")
  {
    // Both halves listed would double the off-diagonal entries.
    check_error("%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 2 1\n2 1 1\n", 3,
                "(1, 2)");
  }

  TEST_CASE("matrix_market: a symmetric matrix is square")
  {
    check_error("%%MatrixMarket matrix coordinate real symmetric\n2 3 1\n1 3 1\n", 2, "square");
  }

  TEST_CASE("matrix_market: nothing may follow the sizes")
  {
    check_error(coordinate + "2 2 1 7\n1 1 1\n", 2, "'2 2 1 7'");
  }

  TEST_CASE("matrix_market: a column number with a decimal point")
  {
    // Not row 1, column 2, value 0.5.
    check_error(coordinate + "2 2 1\n1 2.5\n", 3, "'1 2.5'");
  }

  TEST_CASE("matrix_market: a file that cannot be read names the key")
  {
    const std::string message =
        message_of<InputError>([]() { read_matrix_market("/nowhere/mass.mtx", "Matrices/Mass"); });
    CHECK(contains(message, "Matrices/Mass = /nowhere/mass.mtx"));
  }

  TEST_CASE("matrix_market: distribute gives each rank its rows, repeated entries are added")
  {
    // T(i, j) = i + 2 j on a tridiagonal pattern, plus 10 in one corner and the entry (0, 0) twice.
    const unsigned int n = 7;
    const RowRange rows  = even_rows(n);
    std::vector<Entry> entries;
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int j = i > 0 ? i - 1 : 0; j < std::min(n, i + 2); ++j)
        entries.push_back({i, j, i + 2. * j});
    entries.push_back({0, n - 1, 10.});
    entries.push_back({0, 0, 1.5});
    entries.push_back({0, 0, 1.5});
    const DenseMatrix T = replicated(rows, matrix_of(rows, entries));
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int j = 0; j < n; ++j)
      {
        const bool near = i + 1 >= j && j + 1 >= i;
        CHECK(T(i, j) == (i == 0 && j == 0       ? 3.
                          : i == 0 && j == n - 1 ? 10.
                          : near                 ? i + 2. * j
                                                 : 0.));
      }
  }

  TEST_CASE("matrix_market: what is written is read back to the last bit, the ranks' entries in "
            "their order")
  {
    // Each rank has the diagonal of its rows and one entry beside it, of numbers without a short
    // form.
    const unsigned int n = 7;
    const RowRange rows  = even_rows(n);
    MatrixMarketFile own;
    own.n_rows    = n;
    own.n_columns = n + 1;
    for (unsigned int i = rows.begin; i < rows.end; ++i)
      for (unsigned int j = i; j < i + 2; ++j)
      {
        own.rows.push_back(i);
        own.columns.push_back(j);
        own.values.push_back((i % 2 == 0 ? 1. : -1e-300) / (3. + i + j));
      }
    const std::string name = "written_by_unit_test.mtx";
    write_matrix_market(name, own, {"a comment"}, rows.comm);
    MPI_Barrier(rows.comm);
    const MatrixMarketFile read = read_matrix_market(name, "Key");
    MPI_Barrier(rows.comm);
    std::remove(name.c_str());
    CHECK(read.n_rows == n);
    CHECK(read.n_columns == n + 1);
    REQUIRE(read.values.size() == 2 * n);
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int k = 2 * i; k < 2 * i + 2; ++k)
      {
        const unsigned int j = i + k - 2 * i;
        CHECK(read.rows[k] == int(i));
        CHECK(read.columns[k] == int(j));
        CHECK(read.values[k] == (i % 2 == 0 ? 1. : -1e-300) / (3. + i + j));
      }
  }
} // namespace squeal::tests::matrix_market_tests
