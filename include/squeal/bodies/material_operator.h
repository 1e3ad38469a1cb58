#pragma once

#include <squeal/mesh/geometry.h>
#include <squeal/parameters/materials.h>

#include <vector>

namespace squeal
{
  /// k K + m M + g G + m_star M* (theory.md, section 2) on the cells of one material: what acts on
  /// their displacements in the static equilibrium is K + m_star M* + g G, in motion the
  /// coefficients of each order of the time derivative.
  struct MaterialOperator
  {
    std::vector<Body> bodies;
    Material material;
    double m_star = 0, g = 0; ///< 1/s^2 and 1/s where K has the factor 1
    double k = 1, m = 0;
  };
} // namespace squeal
