#include <squeal/base/csv_reader.h>
#include <squeal/base/errors.h>

#include <doctest/doctest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace squeal::tests::csv_reader_tests
{
  namespace
  {
    /// The sum of all numbers of a file with this text, or why there is none.
    std::string sum_of(const std::string &text)
    {
      const std::string name = std::filesystem::temp_directory_path().string() +
                               "/squeal-test-table-" + std::to_string(getpid());
      std::ofstream(name, std::ios::binary) << text;
      std::string result;
      try
      {
        double sum = 0;
        CsvReader reader("Section/File = table", name);
        while (reader.next())
          for (std::size_t k = 0; k < reader.columns().size(); ++k)
            sum += reader.number(k);
        result = std::to_string(sum);
      }
      catch (const InputError &error)
      {
        result = error.what();
      }
      std::filesystem::remove(name);
      return result;
    }
  } // namespace

  TEST_CASE("csv reader: blanks, empty lines and ends of lines of other systems do not matter")
  {
    CHECK(sum_of("a,b\n1,2\n3,4\n") == std::to_string(10.));
    CHECK(sum_of("\n a , b\r\n\r\n 1,\t2 \r\n  \n3,4e0") == std::to_string(10.));
    CHECK(sum_of("a\n") == std::to_string(0.));
  }

  TEST_CASE("csv reader: what is wrong is said with its line")
  {
    for (const auto &[text, message] : std::vector<std::pair<std::string, std::string>>{
             {"", "Section/File = table: the file cannot be read, is empty, or is not a regular "
                  "file."},
             {"a,b\n1,2\n\n3\n", "Section/File = table, line 4: 1 fields; the first line has 2."},
             {"a,b\n1,2,\n", "Section/File = table, line 2: 3 fields; the first line has 2."},
             {"a,b\n1,\n", "Section/File = table, line 2: '' is not a number (column b)."},
             {"a,b\n1,2x\n", "Section/File = table, line 2: '2x' is not a number (column b)."},
             {"a,b\nnan,2\n", "Section/File = table, line 2: 'nan' is not a number (column a)."},
             {"a,b\n1,1e999\n",
              "Section/File = table, line 2: '1e999' is not a number (column b)."}})
    {
      CAPTURE(text);
      CHECK(sum_of(text) == message);
    }
    CHECK_THROWS_AS(CsvReader("Key", std::filesystem::temp_directory_path().string()),
                    InputError); // a directory
  }
} // namespace squeal::tests::csv_reader_tests
