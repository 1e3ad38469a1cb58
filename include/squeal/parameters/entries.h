#pragma once

#include <optional>
#include <string>
#include <vector>

namespace squeal::Parameters
{
  /// The entries of a list "a : b : 1 2 3, c : ...", each as its words between colons; none of an
  /// empty text.
  std::vector<std::vector<std::string>> entries_of(const std::string &text);

  /// A finite number, or nothing for any other text.
  std::optional<double> to_number(const std::string &word);

  /// Finite numbers between blanks; false for anything else.
  bool read_numbers(const std::string &text, std::vector<double> &numbers);

  /// The numbers of a list "0, 0.1, 0.2" or a range "first : last : number", which rise or fall.
  /// Throws InputError with the key.
  std::vector<double> list_or_range(const std::string &key, const std::string &values);
} // namespace squeal::Parameters
