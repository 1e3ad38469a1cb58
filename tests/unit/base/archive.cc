#include <squeal/base/archive.h>
#include <squeal/base/names.h>

#include <doctest/doctest.h>

#include <cmath>

namespace squeal::tests::archive_tests
{
  namespace
  {
    SQUEAL_CHOICE(Colour, red, green)

    struct Part
    {
      unsigned int count = 0;
      std::optional<std::complex<double>> value;
      Colour colour = Colour::red;
    };
    void serialize(Archive &archive, Part &part)
    {
      archive(part.count, part.value, part.colour);
    }

    struct Record
    {
      bool is_done = false;
      std::vector<Part> parts;
      std::vector<std::array<double, 2>> points;
    };
    void serialize(Archive &archive, Record &record)
    {
      archive(record.is_done, record.parts, record.points);
    }

    const Record example = {true,
                            {{3, {}, Colour::green}, {4, std::complex<double>(1, -2), Colour::red}},
                            {{{0.5, NAN}}}};
  } // namespace

  TEST_CASE("archive: a record is what it was, to the last digit and with numbers that are none")
  {
    const std::vector<double> numbers = numbers_of(example);
    const auto record                 = record_of<Record>(numbers);
    REQUIRE(record);
    CHECK(record->is_done);
    REQUIRE(record->parts.size() == 2);
    CHECK(record->parts[0].count == 3);
    CHECK(!record->parts[0].value);
    CHECK(record->parts[0].colour == Colour::green);
    CHECK(record->parts[1].value == std::complex<double>(1, -2));
    REQUIRE(record->points.size() == 1);
    CHECK(record->points[0][0] == 0.5);
    CHECK(std::isnan(record->points[0][1]));
  }

  TEST_CASE("archive: numbers of another record are refused")
  {
    const std::vector<double> numbers = numbers_of(example);
    for (unsigned int n = 0; n < numbers.size(); ++n)
      CHECK(!record_of<Record>({numbers.begin(), numbers.begin() + n}));
    std::vector<double> more = numbers;
    more.push_back(0);
    CHECK(!record_of<Record>(more));
    // Number 1 says how many parts there are; 2 and 6 are the count and the colour of the first.
    for (const unsigned int place : {0, 1, 2, 6})
      for (const double wrong : {-1., 0.5, 1e300, double(NAN)})
      {
        std::vector<double> changed = numbers;
        changed[place]              = wrong;
        CHECK(!record_of<Record>(changed));
      }
  }
} // namespace squeal::tests::archive_tests
