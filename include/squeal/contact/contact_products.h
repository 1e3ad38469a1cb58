#pragma once

#include <squeal/contact/contact.h>
#include <squeal/equations/equations_of_motion.h>

#include <vector>

/// The contact's terms of the equations of motion (theory.md, section 3) on one pair of faces, as
/// sums over its points of products of two functions of the unknowns. contact_matrices.h makes
/// matrices of them; where only their effect on vectors is wanted none is needed.
namespace squeal
{
  /// What is tested, or what acts, at a point of the surface.
  enum class Trace
  {
    normal,         ///< [[u]].n
    along,          ///< [[u]].e
    across,         ///< [[u]].b
    turning_along,  ///< (d_phi u_R).e
    turning_across, ///< (d_phi u_R).b
    pressure,       ///< Psi^T Lambda
    traction_along, ///< the same of the tangential tractions of a stick contact
    traction_across
  };

  inline bool is_multiplier(const Trace trace)
  {
    return trace >= Trace::pressure;
  }
  /// Which multiplier of a node (FreeNode::multiplier).
  inline unsigned int multiplier_of(const Trace trace)
  {
    return unsigned(trace) - unsigned(Trace::pressure);
  }

  /// Rows over the pair's local displacements, or over the pad's nodes, columns over its points.
  template <int dim>
  const DenseMatrix &functions_of(const Trace trace, const ContactKinematics<dim> &k)
  {
    switch (trace)
    {
    case Trace::normal:
      return k.n();
    case Trace::along:
      return k.e();
    case Trace::across:
      return k.b();
    case Trace::turning_along:
      return k.e_phi();
    case Trace::turning_across:
      return k.b_phi();
    default:
      return k.psi;
    }
  }

  /// sum_q c_q left(:, q) right(:, q)^T of a matrix of that order, with the quadrature's weights
  /// in c; with its transpose on demand. Only active multipliers count.
  struct ContactProduct
  {
    Origin origin;
    unsigned int order; ///< 0: position, 1: velocity
    Trace left, right;
    std::vector<double> c;
    bool transposed_too = false;
  };

  /// N: penalty int d[[u]].n k_C D[[u]].n, mortar the two off-diagonal blocks and, with
  /// compliance, -1/k_C int Psi Psi^T. A stick contact has such blocks along e and b, too.
  template <int dim>
  std::vector<ContactProduct> normal_products(const Contact<dim> &contact,
                                              const unsigned int interface,
                                              const ContactKinematics<dim> &k)
  {
    const ContactModel<dim> &model = contact.contact_model();
    std::vector<double> c          = k.weights;
    for (unsigned int q = 0; q < k.n_points; ++q)
      c[q] *= contact.pressure_per_unknown(interface, k.first_point + q);
    if (!model.mortar)
      return {{Origin::contact, 0, Trace::normal, Trace::normal, std::move(c)}};
    std::vector<ContactProduct> products = {
        {Origin::contact, 0, Trace::normal, Trace::pressure, c, true}};
    if (contact.sticks(interface))
    {
      products.push_back({Origin::contact, 0, Trace::along, Trace::traction_along, c, true});
      if (dim == 3)
        products.push_back({Origin::contact, 0, Trace::across, Trace::traction_across, c, true});
    }
    if (contact.is_compliant())
    {
      for (unsigned int q = 0; q < k.n_points; ++q)
        c[q] *= -contact.pressure_scale() * contact.compliance(interface, k.first_point + q);
      products.push_back({Origin::contact, 0, Trace::pressure, Trace::pressure, std::move(c)});
    }
    return products;
  }

  /// mu T: int (d tau/d p) d[[u]].e Dp, with @p slopes for d tau/d p at every point. The pair
  /// slides.
  template <int dim>
  ContactProduct friction_product(const Contact<dim> &contact, const unsigned int interface,
                                  const ContactKinematics<dim> &k, const ContactPressure &slopes)
  {
    std::vector<double> c = k.weights;
    for (unsigned int q = 0; q < k.n_points; ++q)
      c[q] *= slopes[interface][k.first_point + q] *
              contact.pressure_per_unknown(interface, k.first_point + q);
    return {Origin::friction, 0, Trace::along,
            contact.contact_model().mortar ? Trace::pressure : Trace::normal, std::move(c)};
  }

  /// P_R and Q_R: those of the turning direction, int (tau/v) d[[u]].P_perp ... with
  /// P_perp = b b^T, and those of the law's slope, int (d tau/d v) (d[[u]].e)(e. ...). And of the
  /// closed surface's dashpots, int c_n (d[[u]].n)(n. ...) + c_t d[[u]].(I - n n^T) ... . The pair
  /// slides.
  template <int dim>
  std::vector<ContactProduct>
  damping_products(const Contact<dim> &contact, const unsigned int interface,
                   const ContactKinematics<dim> &k, const ContactPressure &pressure)
  {
    const ContactModel<dim> &model = contact.contact_model();
    std::vector<double> turning(k.n_points), slope(k.n_points);
    for (unsigned int q = 0; q < k.n_points; ++q)
    {
      // Between its nodes the pressure of a partly released face may dip below zero. It is taken as
      // it is, as in N and T: cut off at zero it would have a kink inside of the face, which no
      // quadrature sees, and more than the pad's normal force.
      const auto tau =
          contact.friction(interface).traction(k.speeds[q], pressure[interface][k.first_point + q]);
      turning[q] = k.weights[q] * tau.over_speed;
      slope[q]   = k.weights[q] * tau.d_speed;
    }
    std::vector<ContactProduct> products;
    const auto add =
        [&](const Origin origin, const Trace jump, const Trace turned, std::vector<double> c)
    {
      products.push_back({origin, 1, jump, jump, c});
      if (!model.transports)
        return;
      for (double &value : c)
        value *= model.convective_velocity();
      products.push_back({origin, 0, jump, turned, std::move(c)});
    };
    if (dim == 3)
      add(Origin::friction_damping, Trace::across, Trace::turning_across, std::move(turning));
    if (!model.friction_is_flat())
      add(Origin::falling_friction, Trace::along, Trace::turning_along, std::move(slope));
    const auto add_dashpot = [&](const double constant, const Trace jump)
    {
      if (constant == 0)
        return;
      std::vector<double> c = k.weights;
      for (unsigned int q = 0; q < k.n_points; ++q)
        c[q] *= constant * contact.closed_share(interface, k, q);
      products.push_back({Origin::contact_damping, 1, jump, jump, std::move(c)});
    };
    add_dashpot(model.normal_dashpot, Trace::normal);
    add_dashpot(model.tangential_dashpot, Trace::along);
    if (dim == 3)
      add_dashpot(model.tangential_dashpot, Trace::across);
    return products;
  }
} // namespace squeal
