#pragma once

#include <squeal/contact/contact.h>
#include <squeal/contact/contact_forces.h>

#include <functional>
#include <string>

namespace squeal
{
  /// Writes the static state on the pads' contact faces as contact-<cycle>.pvtu:
  /// contact_pressure_pa, gap_m
  /// (>= 0 where the surfaces are apart), status (1 closed, 0 open) and friction_traction_pa on the
  /// rotor, at the faces' nodes. Collective.
  template <int dim>
  void write_contact(const FiniteElementSpace<dim> &spaces, const Contact<dim> &contact,
                     const MultiVector &state, bool with_friction, const std::string &directory,
                     unsigned int cycle);

  /// A pressure that is known without a state, at a point of a pad's surface with the rotor's
  /// normal there.
  template <int dim>
  using KnownPressure = std::function<double(unsigned int interface, const dealii::Point<dim> &x,
                                             const dealii::Tensor<1, dim> &normal)>;
  /// Writes a known pressure likewise, without gaps.
  template <int dim>
  void write_contact(const FiniteElementSpace<dim> &spaces, const Contact<dim> &contact,
                     const KnownPressure<dim> &pressure, bool with_friction,
                     const std::string &directory, unsigned int cycle);

  /// Values at the quadrature points as a field on the pads' faces, by interface and face its
  /// values at the face's nodes: the combination f_h of the face's shape functions with
  ///     int psi (f_h - f) da = 0.
  /// They sum to one, so that f_h has the integral of f on every face.
  template <int dim>
  std::vector<std::vector<std::vector<double>>> project_to_faces(const Contact<dim> &contact,
                                                                 const ContactPressure &values);

  /// Writes where friction feeds energy into a mode, or takes it out, as
  /// mode-<cycle>-<mode>-contact.pvtu: the work per cycle and area, J/m^2, as a sum
  /// friction_work_j_per_m2 and by what causes it: pressure_work (mu times the change of pressure),
  /// direction_work (the turning sliding direction), speed_work (the slope mu'). Collective.
  template <int dim>
  void write_friction_work(const FiniteElementSpace<dim> &spaces, const Contact<dim> &contact,
                           const FrictionWork &work, const std::string &directory,
                           unsigned int cycle, unsigned int mode);
} // namespace squeal
