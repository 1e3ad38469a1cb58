#pragma once

#include <squeal/contact/contact_kinematics.h>
#include <squeal/eigen/eigenproblem.h>
#include <squeal/parameters/friction_laws.h>

#include <array>
#include <functional>
#include <memory>
#include <utility>

namespace squeal
{
  /// What the contact depends on (theory.md, section 3).
  template <int dim>
  struct ContactModel
  {
    bool mortar              = true; ///< Lagrange multiplier, else penalty
    double penalty_stiffness = 0;    ///< k_C, N/m^3
    double compliance        = 0; ///< 1/k_C of a mortar pressure, m^3/N: int Psi (g - p/k_C) da = 0
    FrictionLaw friction;
    double angular_velocity = 0;                                   ///< Omega, rad/s
    std::function<double(const dealii::Point<dim> &)> initial_gap; ///< g_0 >= 0, m; empty: zero
  };

  /// Resultants of the contact pressure on one pad.
  struct ContactResultants
  {
    std::string name;
    double normal_force = 0, friction_force = 0, friction_torque = 0;
    double area = 0, max_pressure = 0, min_pressure = 0;
    double max_penetration = 0; ///< meaningful only for a computed state
  };

  /// The interfaces of a scene on one mesh: pairing, active set, and the matrices built on them.
  ///
  /// The active set tells where the surfaces touch: by multiplier for mortar, by quadrature point
  /// for penalty. At first they touch everywhere. What has lifted off contributes nothing; the row
  /// of an inactive multiplier says that it is zero.
  template <int dim>
  class Contact
  {
  public:
    Contact(const FiniteElementSpace<dim> &spaces, const ContactModel<dim> &model);

    /// Whether N is the same up to the active set.
    bool has_constraints_of(const Contact &other) const
    {
      return constants_of_normal() == other.constants_of_normal();
    }

    /// Multipliers are stored as p = pressure_scale * Lambda and constraint rows are multiplied by
    /// it, so that the rows of the saddle point's constraints are as large as those of the given
    /// stiffness. Call it before assembly.
    void scale_constraints(double stiffness);
    double pressure_scale() const
    {
      return scale;
    }
    /// The scaling of the same interfaces on another space.
    void scale_as(const Contact &other)
    {
      scale                = other.scale;
      constraint_stiffness = other.constraint_stiffness;
    }

    /// N: penalty int d[[u]].n k_C D[[u]].n, mortar the two off-diagonal blocks and, with
    /// compliance, -1/k_C int Psi Psi^T.
    Matrix normal() const;

    /// The steady pressure p_0, Pa, at every quadrature point of every interface.
    using Pressure = std::vector<std::vector<double>>;
    Pressure uniform_pressure(double value) const;
    /// From a static solution (one column).
    Pressure pressure_of(const MultiVector &state) const;

    /// The friction term: int (d tau/d p) d[[u]].e Dp, that is mu T where mu does not depend on the
    /// pressure.
    Matrix friction(const Pressure &pressure) const;

    /// N and the friction term as multiples of matrices that stay the same as long as only that
    /// changes: sweeps over the friction coefficient assemble neither.
    std::shared_ptr<const Matrix> shared_normal() const;
    std::pair<double, std::shared_ptr<const Matrix>>
    shared_friction(const Pressure &pressure) const;
    /// The largest |d tau/d p| and, at every point, d tau/d p as its share: shared_friction()'s
    /// matrix depends on the shares only.
    std::pair<double, Pressure> friction_slopes(const Pressure &pressure) const;

    /// P_R and Q_R: those of the turning direction, int (tau/v) d[[u]].P_perp ..., and those of the
    /// law's slope, int (d tau/d v) (d[[u]].e)(e. ...). Empty where they vanish.
    struct FrictionDamping
    {
      Matrix P, Q, P_falling, Q_falling;
    };
    FrictionDamping friction_damping(const Pressure &pressure) const;

    /// The work per cycle and area, J/m^2, that the increments D tau of the friction traction do on
    /// the sliding of a mode Re[u exp(j w t)], by what makes them, at every quadrature point:
    ///     W = -int_cycle D tau . D[[u_t]] dt,    J = [[u]], Dp the complex amplitudes,
    ///     friction   -pi (d tau/d p) Im[conj(J.e) Dp],
    ///     damping    -pi (tau/v) (w |J.b|^2 + Omega Im[conj(J.b) (d_phi u_R).b]),
    ///     falling    -pi (d tau/d v) (w |J.e|^2 + Omega Im[conj(J.e) (d_phi u_R).e]).
    /// Positive where energy is fed in. The integrals over the surface are the sums of -pi (d w +
    /// n) of the terms of friction() and friction_damping(): what contributions() gives by body. @p
    /// re and @p im are one column each; @p with_damping tells whether those terms are there at
    /// all.
    struct FrictionWork
    {
      Pressure friction, damping, falling;
    };
    FrictionWork friction_work(const MultiVector &re, const MultiVector &im, double omega,
                               const Pressure &pressure, bool with_damping) const;

    /// What turns with the surface (Prestress/Turning contact): the normal and the sliding
    /// direction turn with the rotor's surface, and the contact point moves along it,
    ///     Dn = -e s_e - b s_b,   De = n s_e + b (...),   s_a = n.(d_a Du_R),
    ///     int [p_0 Dn + tau_0 De] . d[[u]]  -  int (p_0 n + tau_0 e) . (d_a du_R) D[[u]].a
    ///     + int (tau_0/v_0 P_perp + tau_0' e e) d[[u]] . Omega Dw,   Dw = -W D[[u]]_tangential.
    /// The in-plane turning of e by d_phi u_R is that of Q_R. A conservative problem has a
    /// symmetric stiffness: that of the pressure is, because the moving contact point belongs to
    /// the turning normal.
    struct Turning
    {
      Matrix pressure, friction; ///< friction is empty without
    };
    Turning turning(const Pressure &pressure, bool with_friction) const;

    /// What the static problem has on the right side: the initial gap, and with @p with_friction
    /// the part of the traction that is not linear in the pressure, -int (tau - p d tau/d p)
    /// d[[u]].e.
    MultiVector load(const Pressure &pressure, bool with_friction) const;

    /// The nonlinear contact forces (left side) of theory.md at displacements and multipliers @p
    /// state and displacement velocities @p velocity, both one column:
    ///     int p n . d[[u]] + int tau v/|v| . d[[u]],   v = (I - n n) [Omega w + (d_t + Omega
    ///     d_phi) u_R - d_t u_P],
    /// and, for mortar, the constraint int Psi ([[u]].n - g_0). The active set stays as it is. The
    /// linearised matrices are its derivatives. With a steady state @p turned_from, the directions
    /// of the forces and the contact points follow the surface from there on: x + u_R - u_R0.
    MultiVector nonlinear_forces(const MultiVector &state, const MultiVector &velocity,
                                 bool with_friction,
                                 const MultiVector *turned_from = nullptr) const;

    /// Primal-dual active set: multipliers in tension are released, released ones that penetrate
    /// are closed.
    struct ActiveSetChange
    {
      unsigned int n_changed = 0, n_active = 0;
      double largest_tension     = 0; ///< of an active multiplier, Pa
      double largest_penetration = 0; ///< of an inactive multiplier (mean weighted gap), m
    };
    ActiveSetChange update_active_set(const MultiVector &state);

    /// Names of the interfaces without any active multiplier or point.
    std::vector<std::string> lost_contacts() const;
    unsigned int n_active_multipliers() const;
    /// The rows of the released multipliers, the same on all ranks.
    std::vector<unsigned int> released_multipliers() const;
    /// The rows of all multipliers, the same on all ranks; none for penalty.
    std::vector<unsigned int> multipliers() const;
    /// A number that tells active sets apart.
    std::size_t active_set_hash() const;

    /// Force, torque, area in contact; penetration if a static solution is given.
    std::vector<ContactResultants> resultants(const Pressure &pressure,
                                              const MultiVector *state) const;

    const std::vector<PairedInterface<dim>> &paired_interfaces() const
    {
      return *surfaces;
    }
    const FaceElement<dim> &face_element() const
    {
      return element;
    }
    /// Another friction law, speed, stiffness on the same surfaces with the same active set.
    void set_model(const ContactModel<dim> &other)
    {
      model = other;
    }
    /// The surfaces touch everywhere again.
    void close();
    /// Closes or releases the multipliers of these equations, the same on all ranks.
    void set_closed(const std::vector<unsigned int> &equations, const bool closed)
    {
      for (const unsigned int equation : equations)
        active[equation] = closed;
    }
    const ContactModel<dim> &contact_model() const
    {
      return model;
    }
    /// Whether the multiplier of that equation is active.
    bool is_closed(const unsigned int equation) const
    {
      return active[equation];
    }
    bool is_active(const FreeNode<dim> &node) const
    {
      return ContactKinematics<dim>::is_active(active, node);
    }

  private:
    using Kinematics = ContactKinematics<dim>;

    /// Calls the function with the kinematics of each pair of faces. What they are made of is kept
    /// for the next time unless that is too much in all. With slopes they are made anew.
    void for_each_pair(const std::function<void(unsigned int interface, const Kinematics &)> &work,
                       bool with_slopes = false) const;

    /// int c d[[u]].e Dp with a coefficient at every point.
    Matrix tangential(const Pressure &coefficients) const;

    double gap(const dealii::Point<dim> &x) const
    {
      return model.initial_gap ? model.initial_gap(x) : 0.;
    }

    const FiniteElementSpace<dim> *space;
    ContactModel<dim> model;
    FaceElement<dim> element;
    /// Shared with copies, as is what is tabulated on it.
    std::shared_ptr<const std::vector<PairedInterface<dim>>> surfaces;
    struct Tabulated
    {
      double angular_velocity;
      /// With the interface's number.
      std::vector<std::pair<unsigned int, std::shared_ptr<const PairShapes<dim>>>> pairs;
    };
    mutable std::shared_ptr<const Tabulated> tabulated;
    bool keeps_table = true;
    /// The matrices of the last call and what they were made with.
    struct Kept
    {
      std::vector<bool> active;
      std::vector<std::vector<bool>> active_points;
      std::vector<double> constants;
      Pressure coefficients;
      std::shared_ptr<const Matrix> matrix;
      bool is_of(const Contact &contact, const std::vector<double> &present) const
      {
        return matrix && constants == present && active == contact.active &&
               active_points == contact.active_points;
      }
    };
    mutable Kept kept_normal, kept_friction;
    /// P and Q of the turning direction, which every value of a sweep asks for.
    mutable std::shared_ptr<std::array<RepeatedEntries, 2>> turning_entries;
    std::vector<double> constants_of_normal() const
    {
      return {double(model.mortar), scale, constraint_stiffness, model.penalty_stiffness,
              model.compliance};
    }
    double scale                = 1;
    double constraint_stiffness = 1;
    std::vector<bool> is_multiplier;              ///< by equation
    std::vector<bool> active;                     ///< by equation; mortar
    std::vector<std::vector<bool>> active_points; ///< by interface and point of this rank; penalty
  };
} // namespace squeal
