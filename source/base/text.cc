#include <squeal/base/text.h>

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace squeal
{
  std::string formatted(const char *format, ...)
  {
    va_list values, again;
    va_start(values, format);
    va_copy(again, values);
    std::string text(std::vsnprintf(nullptr, 0, format, values), '\0');
    std::vsnprintf(text.data(), text.size() + 1, format, again);
    va_end(again);
    va_end(values);
    return text;
  }

  std::string plain_name(const std::string &name)
  {
    std::string plain;
    for (const unsigned char c : name)
      if (c < 0x20 || std::strchr("#:,\\\"", c))
        plain += formatted("%%%02X", c);
      else
        plain += c;
    return plain;
  }

  std::optional<double> decimal_number(const std::string &word)
  {
    std::string text;
    for (const char c : word)
      if (c == 'd' || c == 'D')
        text += 'e';
      else
      {
        if ((c == '+' || c == '-') && !text.empty() && text.back() != 'e' && text.back() != 'E')
          text += 'e';
        text += c;
      }
    // strtod knows hexadecimal numbers, nan and inf, too.
    if (text.empty() || text.find_first_not_of("0123456789+-.eE") != std::string::npos)
      return {};
    char *end          = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    return end == text.c_str() + text.size() && std::isfinite(value) ? std::optional<double>(value)
                                                                     : std::nullopt;
  }

  std::string number(const double value, const int n_digits)
  {
    return std::isfinite(value) ? formatted("%.*g", n_digits, value) : "";
  }

  std::string number(const std::optional<double> &value)
  {
    return value ? number(*value) : "";
  }

  std::string with_bar(const double value, const int n_decimals, const int width,
                       const std::optional<double> &bar, const bool in_digits)
  {
    constexpr int longest = 8;
    const std::string as_it_is =
        in_digits ? formatted("%*.5g", width, value) : formatted("%*.*f", width, n_decimals, value);
    if (!bar)
      return as_it_is;
    // The place of the bar's second digit once it is rounded: 9.96 becomes 10.
    const std::string two_digits = formatted("%.1e", *bar);
    const int place              = *bar > 0 && std::isfinite(*bar)
                                       ? std::stoi(two_digits.substr(two_digits.find('e') + 1)) - 1
                                       : -longest;
    if (place <= -longest || place >= longest)
      return as_it_is + " +- " + formatted("%-8.2g", *bar);
    const int decimals   = std::max(-place, 0);
    const double unit    = std::pow(10., place);
    const double rounded = unit * std::round(value / unit) + 0.; // + 0.: no -0
    return formatted("%*.*f +- %-8.*f", width, decimals, rounded, decimals, std::stod(two_digits));
  }
} // namespace squeal
