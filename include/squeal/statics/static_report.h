#pragma once

#include <squeal/statics/static_equilibrium.h>

#include <string>
#include <vector>

namespace squeal
{
  /// The steps of the active set as the screen shows them; of multipliers (@p mortar) or points.
  std::string iteration_table(const std::vector<StaticIteration> &iterations, bool mortar);
} // namespace squeal
