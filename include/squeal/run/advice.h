#pragma once

#include <squeal/base/errors.h>

#include <string>

namespace squeal
{
  /// What the user may change after a failure, in the words of the parameter file: the end of the
  /// message. Empty if nothing is known.
  std::string advice(const SolverError &error);
} // namespace squeal
