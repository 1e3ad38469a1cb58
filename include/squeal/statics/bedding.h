#pragma once

#include <squeal/statics/static_equilibrium.h>
#include <squeal/statics/wear_steps.h>

#include <functional>
#include <vector>

namespace squeal
{
  /// Archard's law, dh/dt = k p v^beta, and how far pads slide at the mean radius of the contact.
  struct WearLaw
  {
    double coefficient, speed_exponent, distance;
  };

  /// Wears the pads of a contact in, from new ones on, by implicit Euler steps in the sliding
  /// distance s that grow from step to step (theory.md, section 3):
  ///     int psi ([[u]].n - g_0 - h - (dh/ds)(p) ds) = 0,   h += (dh/ds)(p) ds,
  /// in each of which what wears is a compliance of the contact. @p equilibrium solves at the
  /// contact's present wear. Leaves the contact with the depth. Collective.
  template <int dim>
  std::vector<WearStep> bed_in(Contact<dim> &contact, const WearLaw &law,
                               const std::function<StaticEquilibrium()> &equilibrium);

  /// The depth of another contact's wear at the points of @p contact, of the same mesh and elements
  /// of another degree.
  template <int dim>
  void take_wear(const Contact<dim> &other, Contact<dim> &contact);
} // namespace squeal
