#include "chains.h"

#include <squeal/base/csv_reader.h>

#include <doctest/doctest.h>

namespace squeal::tests::csv_reader_tests
{
  namespace
  {
    /// The sum of all numbers of a file with this text.
    double sum_of(const TemporaryDirectory &directory, const std::string &text)
    {
      const std::string name =
          text_of(directory.name, "/", dealii::Utilities::MPI::this_mpi_process(MPI_COMM_WORLD));
      std::ofstream(name, std::ios::binary) << text;
      double sum = 0;
      CsvReader reader("Section/File = table", name);
      while (reader.next())
        for (std::size_t k = 0; k < reader.columns().size(); ++k)
          sum += reader.number(k);
      return sum;
    }
  } // namespace

  TEST_CASE("csv reader: blanks, empty lines and ends of lines of other systems do not matter")
  {
    const TemporaryDirectory directory;
    CHECK(sum_of(directory, "a,b\n1,2\n3,4\n") == 10);
    CHECK(sum_of(directory, "\n a , b\r\n\r\n 1,\t2 \r\n  \n3,4e0") == 10);
    CHECK(sum_of(directory, "a\n") == 0);
  }

  TEST_CASE("csv reader: what is wrong is said with its line")
  {
    const TemporaryDirectory directory;
    for (const auto &[text, message] : std::vector<std::pair<std::string, std::string>>{
             {"", "Section/File = table: the file cannot be read, is empty"},
             {"a,b\n1,2\n\n3\n", "table, line 4: 1 fields; the first line has 2."},
             {"a,b\n1,2,\n", "table, line 2: 3 fields; the first line has 2."},
             {"a,b\n1,\n", "table, line 2: '' is not a number (column b)."},
             {"a,b\n1,2x\n", "table, line 2: '2x' is not a number (column b)."},
             {"a,b\nnan,2\n", "table, line 2: 'nan' is not a number (column a)."},
             {"a,b\n1,1e999\n", "table, line 2: '1e999' is not a number (column b)."}})
    {
      CAPTURE(text);
      CHECK(contains(message_of<InputError>([&, &text = text]() { sum_of(directory, text); }),
                     message));
    }
    CHECK(contains(message_of<InputError>([&]() { CsvReader("Key", directory.name); }),
                   "not a regular file")); // a directory
  }
} // namespace squeal::tests::csv_reader_tests
