#pragma once

#include <squeal/base/errors.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <string>
#include <vector>

/// An enumeration whose values have their own names: SQUEAL_CHOICE(Scene, brake, strip) declares
/// enum class Scene { brake, strip } and the table of its names.
#define SQUEAL_CHOICE(Enum, ...)                                                                   \
  enum class Enum                                                                                  \
  {                                                                                                \
    __VA_ARGS__                                                                                    \
  };                                                                                               \
  inline const std::vector<std::string> &names_of(Enum)                                            \
  {                                                                                                \
    static const std::vector<std::string> names = squeal::split_names(#__VA_ARGS__);               \
    return names;                                                                                  \
  }

namespace squeal
{
  // An enumeration has names if a function names_of(Enum), declared beside it, returns them in the
  // order of the values. Parameter files, messages and tables take them from there.

  inline std::vector<std::string> split_names(const char *list)
  {
    std::istringstream words(list);
    std::vector<std::string> names;
    for (std::string word; std::getline(words >> std::ws, word, ',');)
      names.push_back(word);
    return names;
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
    for (const std::string &name : names_of(Enum()))
      text += (text.empty() ? "" : separator) + name;
    return text;
  }

  /// The value with this name. Throws InputError, which lists the names.
  template <typename Enum>
  Enum value_named(const std::string &name)
  {
    const auto &names = names_of(Enum());
    const auto at     = std::find(names.begin(), names.end(), name);
    if (at == names.end())
      throw InputError(name + ": allowed are " + all_names<Enum>() + ".");
    return Enum(at - names.begin());
  }
} // namespace squeal
