#pragma once

#include <squeal/contact/contact_forces.h>
#include <squeal/parameters/parameters.h>

#include <string>
#include <vector>

/// Whether the pads of a steady state are pressed like those of a brake.
namespace squeal
{
  /// Throws NoLoad with the reason if a pad carries no force in a computed state with friction.
  void need_load(const Parameters::All &parameters, const std::vector<ContactResultants> &pads);

  /// Throws NoLoad where there is no static state, since loads act across the axis only.
  [[noreturn]] void refuse_load_across_axis(const Parameters::All &parameters);

  /// Lines about pressures and forces that are unusual; each begins with "Warning".
  std::vector<std::string> doubts_about_load(const Parameters::All &parameters,
                                             const std::vector<ContactResultants> &pads);
} // namespace squeal
