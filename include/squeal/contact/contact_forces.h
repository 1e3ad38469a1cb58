#pragma once

#include <squeal/contact/contact.h>
#include <squeal/linalg/complex_multi_vector.h>

#include <string>
#include <vector>

/// Forces of the contact, their resultants and their work.
namespace squeal
{
  /// What the static problem has on the right side: the initial gap, and with @p with_friction
  /// the part of the traction that is not linear in the pressure, -int (tau - p d tau/d p)
  /// d[[u]].e.
  template <int dim>
  MultiVector contact_load(const Contact<dim> &contact, const ContactPressure &pressure,
                           bool with_friction);

  /// The nonlinear contact forces (left side) of theory.md at displacements and multipliers @p
  /// state and displacement velocities @p velocity, both one column:
  ///     int p n . d[[u]] + int tau v/|v| . d[[u]],   v = (I - n n) [Omega w + (d_t + Omega
  ///     d_phi) u_R - d_t u_P],
  /// and, for mortar, the constraint int Psi ([[u]].n - g_0). The active set stays as it is. The
  /// linearised matrices are its derivatives. With a steady state @p turned_from, the directions
  /// of the forces and the contact points follow the surface from there on: x + u_R - u_R0.
  template <int dim>
  MultiVector nonlinear_forces(const Contact<dim> &contact, const MultiVector &state,
                               const MultiVector &velocity, bool with_friction,
                               const MultiVector *turned_from = nullptr);

  /// Resultants of the contact pressure on one pad, or between two other bodies.
  struct ContactResultants
  {
    std::string name;
    ContactKind kind = ContactKind::sliding;
    /// friction_force, friction_torque: on a pad the sum of the friction's size and its torque
    /// about the axis, in a stick contact the size of the tangential tractions' sum and their
    /// torque on the first body. N, N m.
    double normal_force = 0, friction_force = 0, friction_torque = 0;
    /// needed_friction: the largest tangential traction by the pressure at a node of a stick
    /// contact, where the pressure is more than a thousandth of the largest. friction: the
    /// coefficient up to which it sticks; zero: it is not known.
    double needed_friction = 0, friction = 0;
    /// Closed nodes of a stick contact that cannot stick (Contact::let_slip).
    unsigned int n_slipping = 0;
    double area             = 0;
    /// At the pad's nodes for mortar contact and a static state, else at the quadrature points.
    double max_pressure = 0, min_pressure = 0;
    double max_penetration = 0; ///< meaningful only for a computed state
  };

  /// Force, torque, area in contact; penetration if a static solution is given.
  template <int dim>
  std::vector<ContactResultants> resultants(const Contact<dim> &contact,
                                            const ContactPressure &pressure,
                                            const MultiVector *state);

  /// The work per cycle and area, J/m^2, that the increments D tau of the friction traction do on
  /// the sliding of a mode Re[u exp(j w t)], by what makes them, at every quadrature point:
  ///     W = -int_cycle D tau . D[[u_t]] dt,    J = [[u]], Dp the complex amplitudes,
  ///     friction   -pi (d tau/d p) Im[conj(J.e) Dp],
  ///     damping    -pi (tau/v) (w |J.b|^2 + Omega Im[conj(J.b) (d_phi u_R).b]),
  ///     falling    -pi (d tau/d v) (w |J.e|^2 + Omega Im[conj(J.e) (d_phi u_R).e]).
  /// Positive where energy is fed in. The integrals over the surface are the sums of -pi (d w +
  /// n) of the terms of friction() and friction_damping(): what contributions() gives by body. The
  /// mode is one column; @p with_damping tells whether the terms of the damping are there at all.
  struct FrictionWork
  {
    ContactPressure friction, damping, falling;
  };
  template <int dim>
  FrictionWork friction_work(const Contact<dim> &contact, const ComplexMultiVector &mode,
                             double omega, const ContactPressure &pressure, bool with_damping);
} // namespace squeal
