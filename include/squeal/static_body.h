#pragma once

#include <squeal/geometry.h>

#include <vector>

namespace squeal
{
  /// What acts on the displacements of the cells of one material in the static equilibrium:
  /// K + m_star M* + g G of theory.md, section 2.
  struct StaticBody
  {
    std::vector<Body> bodies;
    Material material;
    double m_star = 0, g = 0; ///< factors of M* and G, 1/s^2 and 1/s
  };
} // namespace squeal
