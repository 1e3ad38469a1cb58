#pragma once

#include <squeal/contact/contact.h>

#include <string>
#include <vector>

namespace squeal
{
  /// The exponents of dh/dt = k p^alpha v^beta.
  struct WearExponents
  {
    double of_pressure = 1, of_speed = 1;
  };

  /// The steady pressure of pads that are worn until it does not change any more (theory.md,
  /// section 3). Worn depth then grows as a rigid motion of the bodies that supports and joints
  /// leave free, V = sum_j A_j v_j, so that
  ///     p = (V.n / r^beta)^(1/alpha) where that is positive, else 0: worn free,
  /// n the rotor's normal, r the speed per unit of turning. The A_j balance the virtual work of
  /// loads, pressure and friction in each free motion,
  ///     L(v_j) + int (p n + tau e).v_j = 0.
  /// Neither moduli nor meshes enter but by these integrals.
  template <int dim>
  class WornPressure
  {
  public:
    /// @p load is that on the bodies, one column. The contact is closed. Throws SolverError.
    /// Collective.
    WornPressure(const Contact<dim> &contact, const WearExponents &exponents,
                 const MultiVector &load, bool with_friction);

    /// At the quadrature points, of the same brake on any mesh, Pa.
    ContactPressure on(const Contact<dim> &contact) const;
    /// At a point of a pad's surface; @p normal is the rotor's there.
    double at(const Geometry<dim> &geometry, unsigned int interface, const dealii::Point<dim> &x,
              const dealii::Tensor<1, dim> &normal) const;
    /// The largest at the nodes of a pad's faces that touch the rotor. Collective.
    double largest(const Contact<dim> &contact, unsigned int interface) const;
    /// Opens the contact where the pads are worn free. Collective.
    void release(Contact<dim> &contact) const;

    /// V of each pad, in the order of the contact's interfaces. Scaled so that p is in Pa and r in
    /// m (in two dimensions 1).
    const std::vector<RigidMotion<dim>> &approach() const
    {
      return motions;
    }
    /// Whether a pad is worn free somewhere.
    bool is_open(const unsigned int interface) const
    {
      return open[interface];
    }
    /// The pressure on a plane pad as a formula of x, y and r with its numbers.
    std::string formula(unsigned int interface) const;

  private:
    double at(double approach, double radius) const;
    /// Calls the function with V.n at each point of a pair of faces.
    void for_each_approach(
        const Contact<dim> &contact,
        const std::function<void(unsigned int interface, const ContactKinematics<dim> &,
                                 const std::vector<double> &approach)> &work) const;

    WearExponents exponents;
    std::vector<RigidMotion<dim>> motions;
    std::vector<dealii::Tensor<1, dim>> normals; ///< mean ones, of the rotor
    std::vector<bool> open;
  };
} // namespace squeal
