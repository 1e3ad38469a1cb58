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

  /// A name that parameter files and tables can hold: # (a comment there), the separators : and ,
  /// and \ " and control characters become % and two hexadecimal digits.
  std::string plain_name(const std::string &name);

  /// The finite decimal number that is all of a word, or nothing for any other text. Exponents may
  /// be as Fortran writes them: 1.25D+05, 1.25+05.
  std::optional<double> decimal_number(const std::string &word);

  /// A number with 12 significant digits, or as many as asked for; an empty field if it is unknown
  /// or not finite.
  std::string number(double value, int n_digits = 12);
  std::string number(const std::optional<double> &value);

  /// A value of @p width characters, rounded to its bar, which has two digits: 1890 +- 120, not
  /// 1885.547 +- 1.2e+02. Without a bar it has @p n_decimals decimals or, if @p in_digits, five
  /// digits, however small it is.
  std::string with_bar(double value, int n_decimals, int width, const std::optional<double> &bar,
                       bool in_digits = false);
} // namespace squeal
