#pragma once

#include <string>

namespace squeal
{
  /// What a deck of Abaqus or CalculiX says beside its mesh, as a commented parameter file:
  /// materials and sections, ties, contact, friction, supports, pressure, springs, dashpots,
  /// masses. What was passed over is listed at its end, by line. @p rotor: the volume group that
  /// turns; empty: the one with a name like rotor or disc; none: parts are studied alone. Throws
  /// InputError.
  std::string parameters_of_deck(const std::string &filename, const std::string &rotor);
} // namespace squeal
