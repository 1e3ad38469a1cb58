#pragma once

#include <squeal/parameters/parameters.h>

#include <string>

namespace squeal
{
  /// Lists what a deck that is read as a mesh says about loads, supports, contact and joints, and
  /// of which the parameter file names nothing: a warning, or nothing.
  std::string doubts_about_deck(const Parameters::All &parameters);
} // namespace squeal
