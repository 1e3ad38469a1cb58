#pragma once

#include <squeal/base/errors.h>

#include <algorithm>
#include <array>
#include <string>

namespace squeal
{
  // An enumeration has names if a function names_of(Enum), declared beside it, returns an array of
  // them in the order of the values. Parameter files, messages and tables take them from there.

  template <typename... Names>
  std::array<const char *, sizeof...(Names)> make_names(const Names... names)
  {
    return {{names...}};
  }

  /// The name of a value.
  template <typename Enum>
  std::string name_of(const Enum value)
  {
    return names_of(value)[static_cast<unsigned int>(value)];
  }

  /// All names, separated by @p separator.
  template <typename Enum>
  std::string all_names(const std::string &separator = ", ")
  {
    std::string text;
    for (const std::string name : names_of(Enum()))
      text += (text.empty() ? "" : separator) + name;
    return text;
  }

  /// The value with this name. Throws InputError, which lists the names.
  template <typename Enum>
  Enum value_named(const std::string &name)
  {
    const auto names = names_of(Enum());
    const auto at    = std::find(names.begin(), names.end(), name);
    if (at == names.end())
      throw InputError(name + ": allowed are " + all_names<Enum>() + ".");
    return Enum(at - names.begin());
  }
} // namespace squeal
