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

// Reading: a banner, the line of sizes, then entries, one a line; each step is a function, and each
// error names the line. Writing: the own entries of all ranks, one rank after the other and in
// pieces, with as many digits as make numbers the same when they are read.

namespace squeal
{
  namespace
  {
    /// The lines of a file, and errors that name the present one.
    class Lines
    {
    public:
      Lines(const std::string &filename, const std::string &key)
          : place(key + " = " + filename), in(open_regular_file(filename))
      {
        if (!in.is_open())
          throw InputError(place + ": the file cannot be read.");
      }
      [[noreturn]] void fail(const std::string &what) const
      {
        throw InputError(place + ", line " + std::to_string(number) + ": " + what);
      }
      /// Goes to the first one.
      void begin()
      {
        std::getline(in, text);
        ++number;
      }
      /// Goes to the next one that is neither empty nor a comment. False at the end.
      bool advance()
      {
        while (std::getline(in, text))
        {
          ++number;
          if (text.find('\0') != std::string::npos)
            fail("there is a NUL byte: the file is damaged.");
          if (text.find_first_not_of(" \t\r") != std::string::npos && text[0] != '%')
            return true;
        }
        return false;
      }
      void need(const std::string &expected)
      {
        if (!advance())
          fail("the file ends where " + expected + " is expected.");
      }

      std::string text; ///< of the present one

    private:
      const std::string place;
      std::ifstream in;
      unsigned int number = 0;
    };

    /// What comes before the entries.
    struct Layout
    {
      bool coordinate = false, symmetric = false, skew = false;
      std::string symmetry; ///< its name
      long long n_rows = 0, n_columns = 0, n_entries = 0;
    };

    Layout read_banner(Lines &lines)
    {
      lines.begin();
      std::string &line = lines.text;
      std::transform(line.begin(), line.end(), line.begin(), ::tolower);
      std::istringstream words(line);
      std::string banner, object, format, field;
      Layout layout;
      words >> banner >> object >> format >> field >> layout.symmetry;
      layout.coordinate = format == "coordinate";
      layout.symmetric  = layout.symmetry == "symmetric";
      layout.skew       = layout.symmetry == "skew-symmetric";
      if (banner != "%%matrixmarket" || object != "matrix")
        lines.fail("the first line must be '%%MatrixMarket matrix coordinate real general' or the "
                   "like.");
      if (!layout.coordinate && format != "array")
        lines.fail("the format '" + format + "' is not known; allowed are coordinate and array.");
      if (field != "real" && field != "integer")
        lines.fail("the field '" + field + "' is not supported; allowed are real and integer.");
      if (layout.symmetry != "general" && !layout.symmetric && !layout.skew)
        lines.fail("the symmetry '" + layout.symmetry +
                   "' is not supported; allowed are general, symmetric, skew-symmetric.");
      return layout;
    }

    void read_sizes(Lines &lines, Layout &layout, const long long n_bytes)
    {
      lines.need("the line of sizes");
      const std::string &line = lines.text;
      std::istringstream sizes(line);
      long long &n_rows = layout.n_rows, &n_columns = layout.n_columns,
                &n_entries = layout.n_entries;
      std::string more;
      if (!(sizes >> n_rows >> n_columns) || (layout.coordinate && !(sizes >> n_entries)) ||
          sizes >> more || n_rows < 1 || n_columns < 1 || n_entries < 0 || n_rows > 100000000 ||
          n_columns > 100000000)
        lines.fail("expected the numbers of rows, columns" +
                   std::string(layout.coordinate ? " and entries" : "") +
                   ", all positive; found '" + line + "'.");
      if ((layout.symmetric || layout.skew) && n_rows != n_columns)
        lines.fail("a " + layout.symmetry + " matrix must be square; found '" + line + "'.");
      if (!layout.coordinate)
        for (long long j = 0; j < n_columns; ++j)
          n_entries += layout.symmetric ? n_rows - j : layout.skew ? n_rows - j - 1 : n_rows;
      // An entry is a line of at least two bytes (array) or six (coordinate).
      const long long least_bytes = layout.coordinate ? 6 : 2;
      if (n_entries > n_bytes / least_bytes + 1)
        lines.fail("the file of " + std::to_string(n_bytes) + " bytes is too short for " +
                   std::to_string(n_entries) + " entries.");
    }

    /// Row and column, counted from 1, and value.
    struct Entry
    {
      long long i, j;
      double value;
    };

    /// Reads the present line; in an array its place is that of @p expected.
    Entry read_entry(const Lines &lines, const Layout &layout, const Entry &expected)
    {
      const char *text = lines.text.c_str();
      Entry entry      = expected;
      bool good        = true;
      if (layout.coordinate)
      {
        char *end = nullptr;
        entry.i   = std::strtoll(text, &end, 10);
        good      = end != text;
        text      = end;
        entry.j   = std::strtoll(text, &end, 10);
        good      = good && end != text && std::isspace(static_cast<unsigned char>(*end));
        text      = end;
      }
      std::string word(text);
      word.erase(0, word.find_first_not_of(" \t"));
      word.erase(word.find_last_not_of(" \t\r") + 1);
      const std::optional<double> number = decimal_number(word);
      if (!good || !number)
        lines.fail(std::string(word.empty() ? "" : "the value is not a finite number; ") +
                   "expected '" + (layout.coordinate ? "row column value" : "value") +
                   "', found '" + lines.text + "'.");
      entry.value       = *number;
      const long long i = entry.i, j = entry.j;
      const auto complain = [&](const std::string &what)
      { lines.fail("the entry (" + std::to_string(i) + ", " + std::to_string(j) + ") " + what); };
      if (i < 1 || i > layout.n_rows || j < 1 || j > layout.n_columns)
        complain("lies outside of the matrix.");
      if ((layout.symmetric && i < j) || (layout.skew && i <= j))
        complain("of a " + layout.symmetry + " matrix does not lie below the diagonal" +
                 (layout.symmetric ? " or on it." : "."));
      return entry;
    }

    /// The place after another one in an array, which is stored by columns.
    Entry next_place(Entry place, const Layout &layout)
    {
      if (++place.i > layout.n_rows)
      {
        ++place.j;
        place.i = layout.symmetric ? place.j : layout.skew ? place.j + 1 : 1;
      }
      return place;
    }
  } // namespace

  MatrixMarketFile read_matrix_market(const std::string &filename, const std::string &key)
  {
    Lines lines(filename, key);
    Layout layout = read_banner(lines);
    read_sizes(lines, layout, std::filesystem::file_size(filename));
    MatrixMarketFile file;
    file.n_rows    = layout.n_rows;
    file.n_columns = layout.n_columns;
    const auto add = [&](const long long i, const long long j, const double value)
    {
      file.rows.push_back(i - 1);
      file.columns.push_back(j - 1);
      file.values.push_back(value);
    };
    Entry place{layout.skew ? 2 : 1, 1, 0};
    for (long long k = 0; k < layout.n_entries; ++k, place = next_place(place, layout))
    {
      lines.need("entry " + std::to_string(k + 1) + " of " + std::to_string(layout.n_entries));
      const auto [i, j, value] = read_entry(lines, layout, place);
      add(i, j, value);
      if ((layout.symmetric || layout.skew) && i != j)
        add(j, i, layout.skew ? -value : value);
    }
    if (lines.advance())
      lines.fail("there are more entries than the " + std::to_string(layout.n_entries) +
                 " announced.");
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
