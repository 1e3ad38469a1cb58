#pragma once

#include <squeal/contact/contact.h>

#include <array>
#include <memory>
#include <utility>
#include <vector>

/// The contact's terms of the equations of motion (theory.md, section 3) at its active set.
namespace squeal
{
  /// N: penalty int d[[u]].n k_C D[[u]].n, mortar the two off-diagonal blocks and, with
  /// compliance, -1/k_C int Psi Psi^T. A stick contact has such blocks along e and b, too.
  template <int dim>
  Matrix normal_matrix(const Contact<dim> &contact);

  /// The friction term: int (d tau/d p) d[[u]].e Dp, that is mu T where mu does not depend on the
  /// pressure.
  template <int dim>
  Matrix friction_matrix(const Contact<dim> &contact, const ContactPressure &pressure);

  /// The largest |d tau/d p| and, at every point, d tau/d p as its share: the matrix of
  /// ContactMatrices::friction() depends on the shares only.
  template <int dim>
  std::pair<double, ContactPressure> friction_slopes(const Contact<dim> &contact,
                                                     const ContactPressure &pressure);

  /// P_R and Q_R: those of the turning direction, int (tau/v) d[[u]].P_perp ..., and those of the
  /// law's slope, int (d tau/d v) (d[[u]].e)(e. ...). Empty where they vanish; without transport
  /// there is no Q_R.
  struct FrictionDamping
  {
    Matrix P, Q, P_falling, Q_falling, P_dashpots;
  };
  template <int dim>
  FrictionDamping friction_damping(const Contact<dim> &contact, const ContactPressure &pressure);

  /// The matrices of one contact, kept from one state to the next: sweeps over the friction
  /// coefficient assemble neither N nor T. What is asked for is always that of the contact given;
  /// a copy keeps what there was until then. All are collective.
  template <int dim>
  class ContactMatrices
  {
  public:
    /// normal_matrix(), the one of before if neither the active set nor its constants have changed.
    std::shared_ptr<const Matrix> normal(const Contact<dim> &contact);
    /// The friction term as a multiple of a matrix, the one of before if only that has changed.
    std::pair<double, std::shared_ptr<const Matrix>> friction(const Contact<dim> &contact,
                                                              const ContactPressure &pressure);
    /// friction_damping(), made in the places of the matrices before.
    FrictionDamping damping(const Contact<dim> &contact, const ContactPressure &pressure);

  private:
    /// A matrix and what it was made with.
    struct Kept
    {
      ActiveSet active;
      std::vector<double> constants;
      ContactPressure coefficients;
      std::shared_ptr<const Matrix> matrix;
    };
    /// The matrix of the present active set with these constants and coefficients, made by the
    /// function if the one that is kept is another.
    template <typename Function>
    static std::shared_ptr<const Matrix>
    kept_or_made(Kept &kept, const Contact<dim> &contact, const std::vector<double> &constants,
                 const ContactPressure &coefficients, const Function &make);

    Kept of_normal, of_friction;
    /// P and Q of the turning direction, which every value of a sweep asks for: shared by copies,
    /// because what a call leaves in them are places alone.
    std::shared_ptr<std::array<RepeatedEntries, 2>> of_turning;
  };

  /// What turns with the surface (Prestress/Turning contact): the normal and the sliding
  /// direction turn with the rotor's surface, and the contact point moves along it,
  ///     Dn = -e s_e - b s_b,   De = n s_e + b (...),   s_a = n.(d_a Du_R),
  ///     int [p_0 Dn + tau_0 De] . d[[u]]  -  int (p_0 n + tau_0 e) . (d_a du_R) D[[u]].a
  ///     + int (tau_0/v_0 P_perp + tau_0' e e) d[[u]] . Omega Dw,   Dw = -W D[[u]]_tangential.
  /// The in-plane turning of e by d_phi u_R is that of Q_R. A conservative problem has a
  /// symmetric stiffness: that of the pressure is, because the moving contact point belongs to
  /// the turning normal.
  struct TurningContact
  {
    Matrix pressure, friction; ///< friction is empty without
  };
  template <int dim>
  TurningContact turning_contact(const Contact<dim> &contact, const ContactPressure &pressure,
                                 bool with_friction);
} // namespace squeal
