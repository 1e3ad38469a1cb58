#pragma once

#include <squeal/assessment/stability.h>

#include <string>
#include <vector>

namespace squeal
{
  /// Says, in a line that begins with "Warning", that the rotor turns faster than one of its waves
  /// by the modes and their shapes; empty if it does not. @p speed is the angular velocity, rad/s.
  std::string doubt_about_critical_speed(const std::vector<ModeRow> &modes, double speed,
                                         bool has_stress_stiffness);
} // namespace squeal
