#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/parameters/entries.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace squeal::Parameters
{
  using dealii::Utilities::split_string_list;

  std::vector<std::vector<std::string>> entries_of(const std::string &text)
  {
    std::vector<std::vector<std::string>> result;
    if (text.empty())
      return result;
    for (const std::string &entry : split_string_list(text, ','))
      result.push_back(split_string_list(entry, ':'));
    return result;
  }

  std::optional<double> to_number(const std::string &word)
  {
    return decimal_number(dealii::Utilities::trim(word));
  }

  bool read_numbers(const std::string &text, std::vector<double> &numbers)
  {
    numbers.clear();
    for (const std::string &word : split_string_list(text, ' '))
      if (!word.empty())
      {
        const std::optional<double> value = to_number(word);
        if (!value)
          return false;
        numbers.push_back(*value);
      }
    return !numbers.empty();
  }

  std::vector<double> list_or_range(const std::string &key, const std::string &values)
  {
    const bool is_range = values.find(':') != std::string::npos;
    std::vector<double> numbers;
    bool finite = true;
    for (const std::string &word : split_string_list(values, is_range ? ':' : ','))
    {
      const std::optional<double> value = to_number(word);
      finite                            = finite && value;
      numbers.push_back(value.value_or(0));
    }
    if (!finite || numbers.empty() ||
        (is_range && (numbers.size() != 3 || numbers[2] < 2 ||
                      numbers[2] != std::floor(numbers[2]) || numbers[2] > 100000)))
      throw InputError(key + " = " + values +
                       ": allowed are a list of numbers 0, 0.1, 0.2 or a range first : last : "
                       "number with a number of at least 2.");
    if (is_range)
    {
      const double first = numbers[0], last = numbers[1];
      const unsigned int n = numbers[2];
      numbers.clear();
      for (unsigned int i = 0; i < n; ++i)
        numbers.push_back(i + 1 == n ? last : first + i * (last - first) / (n - 1));
    }
    const bool up   = std::adjacent_find(numbers.begin(), numbers.end(),
                                         std::greater_equal<double>()) == numbers.end(),
               down = std::adjacent_find(numbers.begin(), numbers.end(),
                                         std::less_equal<double>()) == numbers.end();
    if (!up && !down)
      throw InputError(key + " = " + values + ": the values must rise or fall, none twice.");
    return numbers;
  }
} // namespace squeal::Parameters
