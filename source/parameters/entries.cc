#include <squeal/base/errors.h>
#include <squeal/parameters/entries.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

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

  bool read_numbers(const std::string &text, std::vector<double> &numbers)
  {
    numbers.clear();
    for (const std::string &word : split_string_list(text, ' '))
      if (!word.empty())
      {
        try
        {
          numbers.push_back(dealii::Utilities::string_to_double(word));
        }
        catch (const dealii::ExceptionBase &)
        {
          return false;
        }
        if (!std::isfinite(numbers.back()))
          return false;
      }
    return !numbers.empty();
  }

  std::vector<double> list_or_range(const std::string &key, const std::string &values)
  {
    const bool is_range = values.find(':') != std::string::npos;
    std::vector<double> numbers;
    for (const std::string &word :
         dealii::Utilities::split_string_list(values, is_range ? ':' : ','))
      try
      {
        numbers.push_back(dealii::Utilities::string_to_double(word));
      }
      catch (const std::exception &)
      {
        numbers.push_back(std::numeric_limits<double>::quiet_NaN());
      }
    const bool finite = std::all_of(numbers.begin(), numbers.end(),
                                    [](const double x) { return std::isfinite(x); });
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
