#pragma once

#include <squeal/contact.h>

#include <string>

namespace squeal
{
  /// Writes the static state on the pads' contact faces as contact-<cycle>.pvtu:
  /// contact_pressure_pa, gap_m
  /// (>= 0 where the surfaces are apart), status (1 closed, 0 open) and friction_traction_pa on the
  /// rotor, at the faces' nodes. Collective.
  template <int dim>
  void write_contact(const Spaces<dim> &spaces, const Contact<dim> &contact, const Block &state,
                     bool with_friction, const std::string &directory, unsigned int cycle);
} // namespace squeal
