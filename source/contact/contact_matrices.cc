#include <squeal/contact/contact_matrices.h>
#include <squeal/contact/contact_products.h>
#include <squeal/mesh/finite_element_space.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Distributes a product over the unknowns.
    template <int dim>
    void distribute(EntryList &entries, const Contact<dim> &contact,
                    const ContactKinematics<dim> &k, const ContactProduct &product)
    {
      const DenseMatrix local =
          k.product(functions_of(product.left, k), product.c, functions_of(product.right, k));
      const std::vector<bool> &active = contact.active_set().by_row;
      if (!is_multiplier(product.right))
        k.add(entries, local);
      else if (is_multiplier(product.left))
        k.add_multipliers(entries, local, active);
      else
        k.add_coupling(entries, local, active, product.transposed_too,
                       multiplier_of(product.right));
    }
  } // namespace

  template <int dim>
  Matrix normal_matrix(const Contact<dim> &contact)
  {
    EntryList entries;
    contact.for_each_pair(
        [&](const unsigned int i, const ContactKinematics<dim> &k)
        {
          for (const ContactProduct &product : normal_products(contact, i, k))
            distribute(entries, contact, k, product);
        });
    if (contact.contact_model().mortar) // Lambda = 0 where the surfaces are apart
      for (unsigned int row = contact.spaces().first_local_multiplier;
           row < contact.spaces().first_local_tie; ++row)
        if (!contact.active_set().by_row[row])
          entries.add(row, row, contact.constraint_stiffness());
    return entries.make_matrix(contact.spaces().rows);
  }

  namespace
  {
    /// d tau/d p at every point.
    template <int dim>
    ContactPressure traction_slopes(const Contact<dim> &contact, const ContactPressure &pressure)
    {
      ContactPressure slopes = contact.uniform_pressure(0);
      contact.for_each_sliding_pair(
          [&](const unsigned int i, const ContactKinematics<dim> &k)
          {
            for (unsigned int q = 0; q < k.n_points; ++q)
              slopes[i][k.first_point + q] =
                  contact.friction(i)
                      .traction(k.speeds[q], pressure[i][k.first_point + q])
                      .d_pressure;
          });
      return slopes;
    }

    /// int c d[[u]].e Dp with a coefficient at every point.
    template <int dim>
    Matrix tangential_matrix(const Contact<dim> &contact, const ContactPressure &coefficients)
    {
      EntryList entries;
      contact.for_each_sliding_pair(
          [&](const unsigned int i, const ContactKinematics<dim> &k)
          { distribute(entries, contact, k, friction_product(contact, i, k, coefficients)); });
      return entries.make_matrix(contact.spaces().rows);
    }
  } // namespace

  template <int dim>
  Matrix friction_matrix(const Contact<dim> &contact, const ContactPressure &pressure)
  {
    return tangential_matrix(contact, traction_slopes(contact, pressure));
  }

  template <int dim>
  std::pair<double, ContactPressure> friction_slopes(const Contact<dim> &contact,
                                                     const ContactPressure &pressure)
  {
    ContactPressure slopes = traction_slopes(contact, pressure);
    double largest         = 0;
    for (const std::vector<double> &of_interface : slopes)
      for (const double slope : of_interface)
        largest = std::max(largest, std::abs(slope));
    largest = Utilities::MPI::max(largest, contact.spaces().comm);
    if (largest > 0)
      for (std::vector<double> &of_interface : slopes)
        for (double &slope : of_interface)
          slope /= largest;
    return {largest, std::move(slopes)};
  }

  template <int dim>
  template <typename Function>
  std::shared_ptr<const Matrix>
  ContactMatrices<dim>::kept_or_made(Kept &kept, const Contact<dim> &contact,
                                     const std::vector<double> &constants,
                                     const ContactPressure &coefficients, const Function &make)
  {
    int serves = kept.matrix && kept.constants == constants &&
                 kept.active == contact.active_set() && kept.coefficients == coefficients;
    MPI_Allreduce(MPI_IN_PLACE, &serves, 1, MPI_INT, MPI_MIN, contact.spaces().comm);
    if (!serves)
      kept = {contact.active_set(), constants, coefficients,
              std::make_shared<const Matrix>(make())};
    return kept.matrix;
  }

  template <int dim>
  std::shared_ptr<const Matrix> ContactMatrices<dim>::normal(const Contact<dim> &contact)
  {
    return kept_or_made(of_normal, contact, contact.constants_of_normal(), {},
                        [&]() { return normal_matrix(contact); });
  }

  template <int dim>
  std::pair<double, std::shared_ptr<const Matrix>>
  ContactMatrices<dim>::friction(const Contact<dim> &contact, const ContactPressure &pressure)
  {
    const auto [largest, slopes] = friction_slopes(contact, pressure);
    const auto make = [&contact, &slopes = slopes]() { return tangential_matrix(contact, slopes); };
    if (largest == 0)
      return {0., std::make_shared<const Matrix>(make())};
    const ContactModel<dim> &model = contact.contact_model();
    // The matrix holds the direction of sliding.
    return {largest, kept_or_made(of_friction, contact,
                                  {double(model.mortar), contact.pressure_scale(),
                                   model.penalty_stiffness, double(model.direction())},
                                  slopes, make)};
  }

  template <int dim>
  FrictionDamping friction_damping(const Contact<dim> &contact, const ContactPressure &pressure)
  {
    return ContactMatrices<dim>().damping(contact, pressure);
  }

  template <int dim>
  FrictionDamping ContactMatrices<dim>::damping(const Contact<dim> &contact,
                                                const ContactPressure &pressure)
  {
    const ContactModel<dim> &model = contact.contact_model();
    EntryList P_falling, Q_falling, dashpots;
    if (!of_turning)
      of_turning = std::make_shared<std::array<RepeatedEntries, 2>>();
    auto &[P, Q] = *of_turning;
    contact.for_each_sliding_pair(
        [&, &P = P, &Q = Q](const unsigned int i, const ContactKinematics<dim> &k)
        {
          for (const ContactProduct &product : damping_products(contact, i, k, pressure))
            if (product.origin == Origin::friction_damping)
              k.add_across(product.order == 1 ? P : Q, product.c,
                           product.right == Trace::turning_across);
            else
              distribute(product.origin == Origin::contact_damping ? dashpots
                         : product.order == 1                      ? P_falling
                                                                   : Q_falling,
                         contact, k, product);
        });
    FrictionDamping result;
    if (dim == 3)
    {
      result.P = P.make_matrix(contact.spaces().rows);
      if (model.transports)
        result.Q = Q.make_matrix(contact.spaces().rows);
    }
    if (!model.friction_is_flat())
    {
      result.P_falling = P_falling.make_matrix(contact.spaces().rows);
      if (model.transports)
        result.Q_falling = Q_falling.make_matrix(contact.spaces().rows);
    }
    if (model.normal_dashpot != 0 || model.tangential_dashpot != 0)
      result.P_dashpots = dashpots.make_matrix(contact.spaces().rows);
    return result;
  }

  template <int dim>
  TurningContact turning_contact(const Contact<dim> &contact, const ContactPressure &pressure,
                                 const bool with_friction)
  {
    const ContactModel<dim> &model = contact.contact_model();
    EntryList by_pressure, by_friction;
    contact.for_each_sliding_pair(
        [&](const unsigned int i, const ContactKinematics<dim> &k)
        {
          std::vector<double> p(k.n_points), tau(k.n_points), turn(k.n_points), slope(k.n_points);
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            const double p_0 = pressure[i][k.first_point + q], w = k.weights[q];
            p[q] = -w * p_0;
            if (with_friction)
            {
              const auto t = contact.friction(i).traction(k.speeds[q], p_0);
              tau[q]       = w * t.value;
              // (tau / v) Omega, v = |Omega| |w|: also at rest
              turn[q]  = w * t.value * model.direction() / k.radii[q];
              slope[q] = w * t.d_speed * model.angular_velocity;
            }
          }
          std::vector<double> minus_tau = tau;
          for (double &value : minus_tau)
            value *= -1;
          for (unsigned int s = 0; s < dim - 1; ++s)
          {
            const DenseMatrix &jump = s == 0 ? k.e() : k.b();
            k.add(by_pressure, k.product(jump, p, k.slopes[s][0]));
            k.add(by_pressure, k.product(k.slopes[s][0], p, jump));
            if (with_friction)
              k.add(by_friction, k.product(k.slopes[s][1], minus_tau, jump));
          }
          if (with_friction)
          {
            k.add(by_friction, k.product(k.n(), tau, k.slopes[0][0]));
            k.add(by_friction, k.product(k.e(), slope, k.moved_w[0]));
            if (dim == 3)
              k.add(by_friction, k.product(k.b(), turn, k.moved_w[1]));
          }
        },
        true);
    TurningContact result;
    result.pressure = by_pressure.make_matrix(contact.spaces().rows);
    if (with_friction)
      result.friction = by_friction.make_matrix(contact.spaces().rows);
    return result;
  }

#define SQUEAL_INSTANTIATE(dim)                                                                    \
  template Matrix normal_matrix(const Contact<dim> &);                                             \
  template Matrix friction_matrix(const Contact<dim> &, const ContactPressure &);                  \
  template std::pair<double, ContactPressure> friction_slopes(const Contact<dim> &,                \
                                                              const ContactPressure &);            \
  template FrictionDamping friction_damping(const Contact<dim> &, const ContactPressure &);        \
  template class ContactMatrices<dim>;                                                             \
  template TurningContact turning_contact(const Contact<dim> &, const ContactPressure &, bool);
  SQUEAL_INSTANTIATE(2)
  SQUEAL_INSTANTIATE(3)
#undef SQUEAL_INSTANTIATE
} // namespace squeal
