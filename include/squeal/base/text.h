#pragma once

#include <optional>
#include <sstream>
#include <string>

namespace squeal
{
  /// Words and numbers as one text; numbers with six digits.
  template <typename... Parts>
  std::string text_of(const Parts &...parts)
  {
    std::ostringstream text;
    (text << ... << parts);
    return text.str();
  }

  /// What printf would print.
  std::string formatted(const char *format, ...) __attribute__((format(printf, 1, 2)));

  /// A number with 12 significant digits, or as many as asked for; an empty field if it is unknown
  /// or not finite.
  std::string number(double value, int n_digits = 12);
  std::string number(const std::optional<double> &value);
} // namespace squeal
