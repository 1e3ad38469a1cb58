#pragma once

#include <squeal/base/names.h>

#include <array>
#include <string>

namespace squeal
{
  /// How a mode, or a whole sector of modes, looks in the mirror of the rotor's mid-plane.
  enum class Parity
  {
    none, ///< not known, or there is no mirror
    symmetric,
    antisymmetric
  };
  inline std::array<std::string, 3> names_of(Parity)
  {
    return {{"", "symmetric", "antisymmetric"}};
  }
} // namespace squeal
