#pragma once

#include <squeal/contact/active_set.h>
#include <squeal/contact/contact_kinematics.h>
#include <squeal/parameters/friction_laws.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

// The contact of one mesh. ContactModel is what it depends on, WearState what wear has made of the
// pads, and Contact has the interfaces with their active set: steps of it, pressures of a state,
// gaps and compliances at quadrature points, the loop over pairs of faces.

namespace squeal
{
  /// The contact pressure, Pa, or another number at every quadrature point, by interface.
  using ContactPressure = std::vector<std::vector<double>>;

  /// What the contact depends on (theory.md, section 3).
  template <int dim>
  struct ContactModel
  {
    bool mortar              = true; ///< Lagrange multiplier, else penalty
    double penalty_stiffness = 0;    ///< k_C, N/m^3
    double compliance        = 0; ///< 1/k_C of a mortar pressure, m^3/N: int Psi (g - p/k_C) da = 0
    /// c_n, c_t of the closed surfaces, N s/m^3
    double normal_dashpot = 0, tangential_dashpot = 0;
    FrictionLaw friction;
    std::vector<std::pair<std::string, FrictionLaw>>
        friction_of_pads;           ///< where it differs, by name
    double angular_velocity = 0;    ///< Omega, rad/s; -0: at rest, as if it had turned backward
    bool transports         = true; ///< whether turning carries the rotor's deformation along
    std::function<double(const dealii::Point<dim> &)> initial_gap; ///< g_0 >= 0, m; empty: zero

    const FrictionLaw &friction_of(const std::string &pad) const
    {
      for (const auto &[name, law] : friction_of_pads)
        if (name == pad)
          return law;
      return friction;
    }
    /// Whether no pad's traction depends on the speed.
    bool friction_is_flat() const
    {
      return friction.is_flat() && std::all_of(friction_of_pads.begin(), friction_of_pads.end(),
                                               [](const auto &of) { return of.second.is_flat(); });
    }
    /// Whether that of a pad is not proportional to the pressure.
    bool friction_is_nonlinear() const
    {
      return friction.depends_on_pressure() ||
             std::any_of(friction_of_pads.begin(), friction_of_pads.end(),
                         [](const auto &of) { return of.second.depends_on_pressure(); });
    }
    /// The speed of w d_phi u_R in the sliding velocity.
    double convective_velocity() const
    {
      return transports ? angular_velocity : 0;
    }
    /// +1 or -1: the sliding direction e is that times w/|w|.
    int direction() const
    {
      return std::signbit(angular_velocity) ? -1 : 1;
    }
  };

  /// What wear has made of the pads (theory.md, section 3), at the quadrature points.
  struct WearState
  {
    ContactPressure depth; ///< h, m, of pads that do not wear any more: part of the gap
    /// What h grows by with the pressure in the step that follows, m^3/N; empty: not any more. Like
    /// a compliance of the contact.
    ContactPressure rate;
    double number = 0; ///< differs from that of other rates
  };

  /// The interfaces of a scene on one mesh: pairing, model and active set. The matrices built on
  /// them are in contact_matrices.h, the forces in contact_forces.h.
  ///
  /// What has lifted off contributes nothing; the row of an inactive multiplier says that it is
  /// zero. A stick contact has tangential multipliers, too, which are active where the pressure is.
  template <int dim>
  class Contact
  {
  public:
    using Kinematics = ContactKinematics<dim>;

    /// @p spaces must outlive it. Collective.
    Contact(const FiniteElementSpace<dim> &spaces, const ContactModel<dim> &model);

    /// Multipliers are stored as p = pressure_scale * Lambda and constraint rows are multiplied by
    /// it, so that the rows of the saddle point's constraints are as large as those of the given
    /// stiffness. Call it before assembly.
    void scale_constraints(double stiffness);
    double pressure_scale() const
    {
      return scale;
    }
    /// The diagonal entry of the row of a released multiplier.
    double constraint_stiffness() const
    {
      return stiffness_of_constraints;
    }
    /// Takes the scaling of the same interfaces on another space.
    void scale_as(const Contact &other)
    {
      scale                    = other.scale;
      stiffness_of_constraints = other.stiffness_of_constraints;
    }
    /// The pressure of a unit multiplier (mortar) or penetration (penalty) at a point.
    double pressure_per_unknown(const unsigned int interface, const unsigned int point) const
    {
      return model.mortar ? scale
                          : penalty_stiffness(interface, point) * active.by_point[interface][point];
    }

    ContactPressure uniform_pressure(double value) const;
    /// The pressure of a static solution (one column).
    ContactPressure pressure_of(const MultiVector &state) const;

    /// Releases multipliers (mortar) or points (penalty) in tension and closes released ones that
    /// penetrate: a step of the primal-dual active set. @p only_one: of multipliers that break the
    /// conditions, the last one only; one that sticks slips before it is released. Collective.
    ActiveSetChange update_active_set(const MultiVector &state, bool only_one = false);
    const ActiveSet &active_set() const
    {
      return active;
    }
    /// The surfaces touch everywhere again.
    void close();
    /// Closes or releases the multipliers of these equations, the same on all ranks.
    void set_closed(const std::vector<unsigned int> &equations, const bool closed)
    {
      for (const unsigned int equation : equations)
        active.by_row[equation] = closed;
    }
    /// Releases a quadrature point of this rank (penalty).
    void release_point(const unsigned int interface, const unsigned int point)
    {
      active.by_point[interface][point] = false;
    }
    /// How far a quadrature point is closed, 0 to 1: of a mortar pressure the sum of the active
    /// nodes' shape functions.
    double closed_share(unsigned int interface, const Kinematics &k, unsigned int q) const;
    /// Whether the multiplier of that equation is active.
    bool is_closed(const unsigned int equation) const
    {
      return active.by_row[equation];
    }
    bool is_active(const FreeNode<dim> &node, const unsigned int direction = 0) const
    {
      return Kinematics::is_active(active.by_row, node, direction);
    }

    /// The equation of a pressure and those of the tangential tractions that are there only with
    /// it: none where it slips.
    std::vector<unsigned int> with_tractions(unsigned int pressure) const;
    /// Lets a pressure of a stick contact slip from now on, without tangential tractions.
    void let_slip(unsigned int pressure);

    /// Names of the pads without any active multiplier or point. Collective.
    std::vector<std::string> lost_contacts() const;
    unsigned int n_active_multipliers() const;
    /// The rows of the released multipliers, pressures and tangential tractions, the same on all
    /// ranks.
    std::vector<unsigned int> released_multipliers() const;
    /// The rows of all multipliers, the same on all ranks; none for penalty.
    std::vector<unsigned int> multipliers() const;

    const FiniteElementSpace<dim> &spaces() const
    {
      return *space;
    }
    const std::vector<PairedInterface<dim>> &paired_interfaces() const
    {
      return *surfaces;
    }
    const FaceElement<dim> &face_element() const
    {
      return element;
    }
    const ContactModel<dim> &contact_model() const
    {
      return model;
    }
    /// Another friction law, speed, stiffness on the same surfaces with the same active set.
    void set_model(const ContactModel<dim> &other)
    {
      model = other;
      tabulate_shapes();
    }
    /// g_0, m: between the pads and the rotor.
    double initial_gap(const unsigned int interface, const dealii::Point<dim> &x) const
    {
      return model.initial_gap && slides(interface) ? model.initial_gap(x) : 0.;
    }
    /// g_0 + h, m: the gap of worn pads at a quadrature point.
    double gap(const unsigned int interface, const Kinematics &k, const unsigned int q) const
    {
      const double gap = initial_gap(interface, k.positions[q]);
      return wear && slides(interface) ? gap + wear->depth[interface][k.first_point + q] : gap;
    }
    /// What the pressure of a mortar contact gives way at a quadrature point, m^3/N.
    double compliance(const unsigned int interface, const unsigned int point) const
    {
      return wears() ? model.compliance + wear->rate[interface][point] : model.compliance;
    }
    bool is_compliant() const
    {
      return model.compliance > 0 || wears();
    }
    /// Whether pads wear in the present step.
    bool wears() const
    {
      return wear && !wear->rate.empty();
    }
    /// Null: the pads are new, or what they have lost does not matter.
    const WearState *worn() const
    {
      return wear.get();
    }
    void set_wear(std::shared_ptr<const WearState> state)
    {
      wear = std::move(state);
    }
    const FrictionLaw &friction(const unsigned int interface) const
    {
      return model.friction_of(paired_interfaces()[interface].name);
    }
    bool slides(const unsigned int interface) const
    {
      return paired_interfaces()[interface].kind == ContactKind::sliding;
    }
    bool sticks(const unsigned int interface) const
    {
      return paired_interfaces()[interface].kind == ContactKind::stick;
    }

    /// Calls the function with the kinematics of each pair of faces. They are made anew for each
    /// call with slopes, and where their table would be too large.
    void for_each_pair(const std::function<void(unsigned int interface, const Kinematics &)> &work,
                       bool with_slopes = false) const;
    /// Calls the function for the pads on the rotor only: for what has friction.
    void for_each_sliding_pair(
        const std::function<void(unsigned int interface, const Kinematics &)> &work,
        bool with_slopes = false) const;

    /// What the matrix N depends on but for the active set.
    std::vector<double> constants_of_normal() const
    {
      return {double(model.mortar),     scale,
              stiffness_of_constraints, model.penalty_stiffness,
              model.compliance,         wears() ? wear->number : 0};
    }

  private:
    /// k_C of the formulation penalty, with what wears in series.
    double penalty_stiffness(const unsigned int interface, const unsigned int point) const
    {
      const double k = model.penalty_stiffness;
      return wears() ? k / (1 + k * wear->rate[interface][point]) : k;
    }
    /// Steps of the active set for mortar and for penalty. Differences up to rounding of @p size,
    /// m, that of the displacements, count for nothing.
    ActiveSetChange update_multipliers(const std::vector<double> &state, double size,
                                       bool only_one);
    ActiveSetChange update_points(const std::vector<double> &state, double size);
    /// How far surfaces overlap on average about each pressure, m: int psi_j ([[u]].n - g_0 -
    /// p/k_C), what the constraints of closed contacts make zero (pressures of their neighbours
    /// reach open ones), by int |psi_j|.
    std::vector<double> mean_penetrations(const std::vector<double> &state) const;

    /// The shape functions of all pairs of faces at one speed.
    struct TabulatedShapes
    {
      double angular_velocity;
      /// With the interface's number.
      std::vector<std::pair<unsigned int, std::shared_ptr<const PairShapes<dim>>>> pairs;
    };
    /// Makes the table for the present speed, unless it is there or would be too large.
    void tabulate_shapes();
    /// Calls the function with the shape functions of each pair of faces, made anew.
    template <typename Function>
    void for_each_shapes(const Function &function) const;

    const FiniteElementSpace<dim> *space;
    ContactModel<dim> model;
    FaceElement<dim> element;
    std::shared_ptr<const std::vector<PairedInterface<dim>>> surfaces; ///< shared with copies
    enum class Unknown : char
    {
      displacement,
      pressure,
      traction, ///< tangential, of a stick contact; they follow their pressure
      held,     ///< the same along what a support holds: it is zero
      other
    };
    void find_held_tractions();
    std::vector<Unknown> unknowns; ///< by equation
    ActiveSet active;
    double scale = 1, stiffness_of_constraints = 1;
    bool keeps_table = true;
    std::shared_ptr<const TabulatedShapes> table; ///< shared with copies of that speed
    std::shared_ptr<const WearState> wear;        ///< shared with copies
  };
} // namespace squeal
