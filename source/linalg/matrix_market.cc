#include <squeal/base/files.h>
#include <squeal/base/log.h>
#include <squeal/base/text.h>
#include <squeal/linalg/matrix_market.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace squeal
{
  MatrixMarketFile read_matrix_market(const std::string &filename, const std::string &key)
  {
    std::ifstream in = open_regular_file(filename);
    if (!in.is_open())
      throw InputError(key + " = " + filename + ": the file cannot be read.");
    const long long n_bytes  = std::filesystem::file_size(filename);
    unsigned int line_number = 0;
    std::string line;
    const auto fail = [&](const std::string &what)
    {
      throw InputError(key + " = " + filename + ", line " + std::to_string(line_number) + ": " +
                       what);
    };
    const auto next_line = [&](const std::string &expected)
    {
      while (std::getline(in, line))
      {
        ++line_number;
        if (line.find('\0') != std::string::npos)
          fail("there is a NUL byte: the file is damaged.");
        if (line.find_first_not_of(" \t\r") != std::string::npos && line[0] != '%')
          return;
      }
      fail("the file ends where " + expected + " is expected.");
    };

    std::getline(in, line);
    ++line_number;
    std::transform(line.begin(), line.end(), line.begin(), ::tolower);
    std::istringstream header(line);
    std::string banner, object, format, field, symmetry;
    header >> banner >> object >> format >> field >> symmetry;
    if (banner != "%%matrixmarket" || object != "matrix")
      fail("the first line must be '%%MatrixMarket matrix coordinate real general' or the like.");
    if (format != "coordinate" && format != "array")
      fail("the format '" + format + "' is not known; allowed are coordinate and array.");
    if (field != "real" && field != "integer")
      fail("the field '" + field + "' is not supported; allowed are real and integer.");
    const bool symmetric = symmetry == "symmetric", skew = symmetry == "skew-symmetric";
    if (symmetry != "general" && !symmetric && !skew)
      fail("the symmetry '" + symmetry +
           "' is not supported; allowed are general, symmetric, "
           "skew-symmetric.");

    MatrixMarketFile file;
    next_line("the line of sizes");
    std::istringstream sizes(line);
    long long n_rows = 0, n_columns = 0, n_entries = 0;
    const bool coordinate = format == "coordinate";
    std::string more;
    if (!(sizes >> n_rows >> n_columns) || (coordinate && !(sizes >> n_entries)) || sizes >> more ||
        n_rows < 1 || n_columns < 1 || n_entries < 0 || n_rows > 100000000 || n_columns > 100000000)
      fail("expected the numbers of rows, columns" + std::string(coordinate ? " and entries" : "") +
           ", all positive; found '" + line + "'.");
    if ((symmetric || skew) && n_rows != n_columns)
      fail("a " + symmetry + " matrix must be square; found '" + line + "'.");
    if (!coordinate)
      for (long long j = 0; j < n_columns; ++j)
        n_entries += symmetric ? n_rows - j : skew ? n_rows - j - 1 : n_rows;
    // An entry is a line of at least two bytes (array) or six (coordinate).
    const long long least_bytes = coordinate ? 6 : 2;
    if (n_entries > n_bytes / least_bytes + 1)
      fail("the file of " + std::to_string(n_bytes) + " bytes is too short for " +
           std::to_string(n_entries) + " entries.");
    file.n_rows    = n_rows;
    file.n_columns = n_columns;

    long long array_row = skew ? 1 : 0, array_column = 0;
    for (long long k = 0; k < n_entries; ++k)
    {
      next_line("entry " + std::to_string(k + 1) + " of " + std::to_string(n_entries));
      const char *text = line.c_str();
      char *end        = nullptr;
      long long i = array_row + 1, j = array_column + 1;
      bool good = true;
      if (coordinate)
      {
        i    = std::strtoll(text, &end, 10);
        good = end != text;
        text = end;
        j    = std::strtoll(text, &end, 10);
        good = good && end != text && std::isspace(static_cast<unsigned char>(*end));
        text = end;
      }
      else if (++array_row == n_rows)
      {
        ++array_column;
        array_row = symmetric ? array_column : skew ? array_column + 1 : 0;
      }
      std::string word(text);
      word.erase(0, word.find_first_not_of(" \t"));
      word.erase(word.find_last_not_of(" \t\r") + 1);
      const std::optional<double> number = decimal_number(word);
      if (!good || !number)
        fail(std::string(word.empty() ? "" : "the value is not a finite number; ") + "expected '" +
             (coordinate ? "row column value" : "value") + "', found '" + line + "'.");
      if (i < 1 || i > n_rows || j < 1 || j > n_columns)
        fail("the entry (" + std::to_string(i) + ", " + std::to_string(j) +
             ") lies outside of the matrix.");
      if ((symmetric && i < j) || (skew && i <= j))
        fail("the entry (" + std::to_string(i) + ", " + std::to_string(j) + ") of a " + symmetry +
             " matrix does not lie below the diagonal" + (symmetric ? " or on it." : "."));
      file.rows.push_back(i - 1);
      file.columns.push_back(j - 1);
      file.values.push_back(*number);
      if ((symmetric || skew) && i != j)
      {
        file.rows.push_back(j - 1);
        file.columns.push_back(i - 1);
        file.values.push_back(skew ? -*number : *number);
      }
    }
    while (std::getline(in, line))
    {
      ++line_number;
      if (line.find_first_not_of(" \t\r") != std::string::npos && line[0] != '%')
        fail("there are more entries than the " + std::to_string(n_entries) + " announced.");
    }
    return file;
  }

  Matrix distribute(const MatrixMarketFile &file, const RowRange &rows)
  {
    std::vector<PetscInt> i, j;
    std::vector<double> values;
    for (std::size_t k = 0; k < file.values.size(); ++k)
      if (rows.contains(file.rows[k]))
      {
        i.push_back(file.rows[k]);
        j.push_back(file.columns[k]);
        values.push_back(file.values[k]);
      }
    Mat mat = nullptr;
    SQUEAL_PETSC(MatCreate(rows.comm, &mat));
    Matrix matrix(mat);
    SQUEAL_PETSC(MatSetSizes(mat, rows.n_local(), rows.n_local(), rows.size, rows.size));
    SQUEAL_PETSC(MatSetType(mat, MATAIJ));
    SQUEAL_PETSC(MatSetPreallocationCOO(mat, i.size(), i.data(), j.data()));
    SQUEAL_PETSC(MatSetValuesCOO(mat, values.data(), ADD_VALUES));
    return matrix;
  }

  namespace
  {
    template <typename Number>
    void append(std::string &text, const Number value)
    {
      std::array<char, 32> digits;
      const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value);
      text.append(digits.data(), end.ptr);
    }

    std::string header(const std::string &kind, const std::vector<std::string> &comments)
    {
      std::string text = "%%MatrixMarket matrix " + kind + " general\n";
      for (const std::string &comment : comments)
        text += "% " + comment + "\n";
      return text;
    }
  } // namespace

  std::string exact_text(const double value)
  {
    std::string text;
    append(text, value);
    return text;
  }

  void write_matrix_market(const std::string &filename, const MatrixMarketFile &own,
                           const std::vector<std::string> &comments, const MPI_Comm comm)
  {
    std::uint64_t n_entries = own.values.size();
    MPI_Allreduce(MPI_IN_PLACE, &n_entries, 1, MPI_UINT64_T, MPI_SUM, comm);
    constexpr std::size_t entries_of_piece = 100000;
    std::size_t next                       = 0;
    std::string text                       = is_rank_zero(comm)
                                                 ? header("coordinate real", comments) + std::to_string(own.n_rows) +
                                 " " + std::to_string(own.n_columns) + " " +
                                 std::to_string(n_entries) + "\n"
                                                 : "";
    const auto next_piece                  = [&]()
    {
      const std::size_t end = std::min(next + entries_of_piece, own.values.size());
      for (; next < end; ++next)
      {
        append(text, own.rows[next] + 1);
        text += ' ';
        append(text, own.columns[next] + 1);
        text += ' ';
        append(text, own.values[next]);
        text += '\n';
      }
      return std::exchange(text, {});
    };
    write_in_pieces(filename, next_piece, comm);
  }

  void write_matrix_market(const std::string &filename,
                           const std::vector<std::vector<std::complex<double>>> &columns,
                           const std::vector<std::string> &comments, const MPI_Comm comm)
  {
    if (!is_rank_zero(comm))
      return;
    write_file(filename,
               [&](std::ostream &out)
               {
                 out << header("array complex", comments)
                     << (columns.empty() ? 0 : columns.front().size()) << " " << columns.size()
                     << "\n";
                 for (const auto &column : columns)
                   for (const std::complex<double> &value : column)
                   {
                     std::string line;
                     append(line, value.real());
                     line += ' ';
                     append(line, value.imag());
                     out << line << '\n';
                   }
               });
  }
} // namespace squeal
