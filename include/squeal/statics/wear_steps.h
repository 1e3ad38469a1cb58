#pragma once

#include <string>
#include <vector>

namespace squeal
{
  /// What a pad has lost after a step of bedding in.
  struct WearOfPad
  {
    std::string name;
    double volume = 0, largest_depth = 0, open_area = 0, largest_pressure = 0; ///< m^3, m, m^2, Pa
  };

  /// A step of bedding in (theory.md, section 3).
  struct WearStep
  {
    double distance;        ///< slid since the pads were new, m
    double pressure_change; ///< largest since the step before, relative to the largest
    std::vector<WearOfPad> of_pads;
  };
} // namespace squeal
