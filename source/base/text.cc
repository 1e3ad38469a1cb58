#include <squeal/base/text.h>

#include <cmath>
#include <cstdarg>
#include <cstdio>

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

  std::string number(const double value, const int n_digits)
  {
    return std::isfinite(value) ? formatted("%.*g", n_digits, value) : "";
  }

  std::string number(const std::optional<double> &value)
  {
    return value ? number(*value) : "";
  }
} // namespace squeal
