#pragma once

#include <string>

namespace squeal
{
  /// Returns the frequency, Hz, below which the brake of a parameter file has at least @p n_modes
  /// modes: counted by inertia in the elastic brake, contacts closed, on elements of degree 1,
  /// whose frequencies are too high. Needs PETSc. Throws InputError, SolverError.
  double window_of_modes(const std::string &filename, const std::string &text,
                         unsigned int n_modes);
} // namespace squeal
