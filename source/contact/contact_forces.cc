#include <squeal/contact/contact_forces.h>
#include <squeal/mesh/finite_element_space.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>

// Forces of the contact as integrals over the pairs of faces, in this order: the right side of the
// static problem; the nonlinear forces whose derivatives the matrices are; resultants on a pad; the
// work of friction in a mode, by what causes it.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Rows and values that are summed to a vector.
    struct Forces
    {
      std::vector<PetscInt> rows;
      std::vector<double> values;
    };

    /// Adds int Psi f of the active multipliers of a direction (0: pressures) at a point q.
    template <int dim>
    void add_constraint(const Contact<dim> &contact, const ContactKinematics<dim> &k,
                        const unsigned int q, const unsigned int direction, const double f,
                        Forces &forces)
    {
      for (unsigned int m = 0; m < k.pad->free.size(); ++m)
        if (const FreeNode<dim> &node = k.pad->free[m]; contact.is_active(node, direction))
        {
          forces.rows.push_back(node.multiplier(direction));
          forces.values.push_back(contact.pressure_scale() * k.weights[q] * k.psi(m, q) * f);
        }
    }
  } // namespace

  template <int dim>
  MultiVector contact_load(const Contact<dim> &contact, const ContactPressure &pressure,
                           const bool with_friction)
  {
    const ContactModel<dim> &model = contact.contact_model();
    Forces forces;
    contact.for_each_pair(
        [&](const unsigned int i, const ContactKinematics<dim> &k)
        {
          std::vector<double> along_n(k.n_points), along_e(k.n_points);
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            const unsigned int point = k.first_point + q;
            const double w = k.weights[q], g = contact.gap(i, k, q), p = pressure[i][point];
            const auto tau = with_friction && contact.slides(i)
                                 ? contact.friction(i).traction(k.speeds[q], p)
                                 : FrictionTraction();
            along_e[q]     = -w * (tau.value - p * tau.d_pressure);
            if (model.mortar && g != 0)
              add_constraint(contact, k, q, 0, g, forces);
            else if (!model.mortar && contact.active_set().by_point[i][point])
            {
              along_n[q] = w * contact.pressure_per_unknown(i, point) * g;
              along_e[q] += along_n[q] * tau.d_pressure;
            }
          }
          // A friction law without an offset has no part in it, and mortar no normal forces.
          const auto is_zero = [](const double c) { return c == 0; };
          if (!std::all_of(along_n.begin(), along_n.end(), is_zero))
            k.add_forces(forces.rows, forces.values, k.n(), along_n);
          if (!std::all_of(along_e.begin(), along_e.end(), is_zero))
            k.add_forces(forces.rows, forces.values, k.e(), along_e);
        });
    return sum_entries(contact.spaces().rows, forces.rows, forces.values);
  }

  namespace
  {
    /// How the points of a pair move, by components along the reference basis n, e, b.
    template <int dim>
    struct PairMotion
    {
      using Components = Tensor<1, 3>;
      using Field      = std::vector<Components>; ///< by point

      /// The displacements @p u, their velocities and, from a steady state on, @p du.
      PairMotion(const ContactKinematics<dim> &k, const std::vector<double> &u,
                 const std::vector<double> &u_t, const std::vector<double> &du)
      {
        const std::vector<double> local = k.local_values(u), local_t = k.local_values(u_t),
                                  local_du = k.local_values(du);
        jump                               = components(k, {{&k.n(), &k.e(), &k.b()}}, local);
        jump_t                             = components(k, {{&k.n(), &k.e(), &k.b()}}, local_t);
        d_phi   = components(k, {{nullptr, &k.e_phi(), &k.b_phi()}}, local);
        moved   = components(k, {{nullptr, &k.e(), &k.b()}}, local_du);
        moved_w = components(k, {{nullptr, &k.moved_w[0], &k.moved_w[1]}}, local_du);
        for (unsigned int s = 0; s < 2; ++s)
          slopes[s] =
              components(k, {{&k.slopes[s][0], &k.slopes[s][1], &k.slopes[s][2]}}, local_du);
      }

      Field jump, jump_t, d_phi, moved, moved_w;
      std::array<Field, 2> slopes;

    private:
      static Field components(const ContactKinematics<dim> &k,
                              const std::array<const DenseMatrix *, 3> &rows_of,
                              const std::vector<double> &local)
      {
        Field result(k.n_points);
        for (unsigned int c = 0; c < 3; ++c)
          if (rows_of[c] && rows_of[c]->n_rows > 0)
          {
            const std::vector<double> component = k.at_points(*rows_of[c], local);
            for (unsigned int q = 0; q < k.n_points; ++q)
              result[q][c] = component[q];
          }
        return result;
      }
    };

    /// The traction p n + tau v/|v| at a point, with
    ///     v = (I - n n) [Omega w + d_t [[u]] + Omega d_phi u_R];   e points along Omega w.
    template <int dim>
    Tensor<1, 3> traction_at(const Contact<dim> &contact, const unsigned int interface,
                             const ContactKinematics<dim> &k, const unsigned int q,
                             const PairMotion<dim> &motion, const double p,
                             const bool with_friction, const bool turns)
    {
      const ContactModel<dim> &model = contact.contact_model();
      Tensor<1, 3> e({0, 1, 0}), b({0, 0, 1});
      e += motion.slopes[0][q];
      b += motion.slopes[1][q];
      Tensor<1, 3> normal = cross_product_3d(e, b); // (n, e, b) is right-handed
      normal /= normal.norm();
      Tensor<1, 3> v = motion.jump_t[q] + model.convective_velocity() * motion.d_phi[q] +
                       model.angular_velocity * motion.moved_w[q];
      v[1] += k.speeds[q];
      v[0] += k.speeds[q] * motion.slopes[0][q][0]; // d_phi u_R . n
      if (!turns)
        v[0] = 0;
      v -= (v * normal) * normal;
      Tensor<1, 3> traction = p * normal;
      if (with_friction && contact.slides(interface))
        traction += contact.friction(interface).traction(v.norm(), p).over_speed * v;
      return traction;
    }
  } // namespace

  template <int dim>
  MultiVector nonlinear_forces(const Contact<dim> &contact, const MultiVector &state,
                               const MultiVector &velocity, const bool with_friction,
                               const MultiVector *turned_from)
  {
    const ContactModel<dim> &model = contact.contact_model();
    const std::vector<double> u = replicate(state), u_t = replicate(velocity);
    std::vector<double> du(u.size()); // from the steady state on
    if (turned_from)
      du = replicate(*turned_from);
    for (unsigned int row = 0; row < du.size() && turned_from; ++row)
      du[row] = u[row] - du[row];
    const ContactPressure pressure = contact.pressure_of(state);
    Forces forces;
    const auto add_pair = [&](const unsigned int i, const ContactKinematics<dim> &k)
    {
      const PairMotion<dim> motion(k, u, u_t, du);
      std::array<std::vector<double>, 3> force;
      std::array<std::array<std::vector<double>, 3>, 2> moved_force; // on d_a du_R
      for (unsigned int c = 0; c < 3; ++c)
      {
        force[c].resize(k.n_points);
        for (unsigned int s = 0; s < 2; ++s)
          moved_force[s][c].resize(k.n_points);
      }
      for (unsigned int q = 0; q < k.n_points; ++q)
      {
        const double p = pressure[i][k.first_point + q], w = k.weights[q];
        const Tensor<1, 3> traction =
            traction_at(contact, i, k, q, motion, p, with_friction, turned_from != nullptr);
        for (unsigned int c = 0; c < 3; ++c)
        {
          force[c][q] = w * traction[c];
          for (unsigned int s = 0; s < 2; ++s)
            moved_force[s][c][q] = -w * traction[c] * motion.moved[q][1 + s];
        }
        if (model.mortar)
          add_constraint(contact, k, q, 0,
                         motion.jump[q][0] - contact.gap(i, k, q) -
                             contact.compliance(i, k.first_point + q) * p,
                         forces);
      }
      for (unsigned int direction = 1; direction < dim && contact.sticks(i); ++direction)
      {
        // int T . d[[u]] and int Psi [[u]].e, and the same along b
        const std::vector<double> T =
            k.at_points(k.psi, k.local_multipliers(u, &contact.active_set().by_row, direction));
        for (unsigned int q = 0; q < k.n_points; ++q)
        {
          force[direction][q] += k.weights[q] * contact.pressure_scale() * T[q];
          add_constraint(contact, k, q, direction, motion.jump[q][direction], forces);
        }
      }
      const std::array<const DenseMatrix *, 3> basis = {{&k.n(), &k.e(), &k.b()}};
      for (unsigned int c = 0; c < dim; ++c)
      {
        k.add_forces(forces.rows, forces.values, *basis[c], force[c]);
        for (unsigned int s = 0; s < dim - 1 && turned_from; ++s)
          k.add_forces(forces.rows, forces.values, k.slopes[s][c], moved_force[s][c]);
      }
    };
    contact.for_each_pair(add_pair, turned_from != nullptr);
    if (model.mortar)
      for (unsigned int row = contact.spaces().first_local_multiplier;
           row < contact.spaces().first_local_tie; ++row)
        if (!contact.active_set().by_row[row])
        {
          forces.rows.push_back(row);
          forces.values.push_back(contact.constraint_stiffness() * u[row]);
        }
    return sum_entries(contact.spaces().rows, forces.rows, forces.values);
  }

  namespace
  {
    /// The largest |T|/p of a stick contact's closed nodes where p is not near zero. Collective.
    template <int dim>
    double needed_friction(const Contact<dim> &contact, const unsigned int interface,
                           const std::vector<double> &state)
    {
      constexpr double near_zero = 1e-3;
      double largest_pressure = 0, largest_ratio = 0;
      for (const bool is_second_pass : {false, true})
      {
        for (const ContactFace<dim> &face : contact.paired_interfaces()[interface].pad_faces)
          for (const auto &nodes : face.nodes)
            for (const FreeNode<dim> &node : nodes)
            {
              if (!contact.is_active(node))
                continue;
              const double p = state[node.multiplier(0)];
              if (!is_second_pass)
                largest_pressure = std::max(largest_pressure, p);
              else if (p > near_zero * largest_pressure)
              {
                double square = 0;
                for (unsigned int direction = 1; direction < dim; ++direction)
                  if (contact.is_active(node, direction))
                    square += std::pow(state[node.multiplier(direction)], 2);
                largest_ratio = std::max(largest_ratio, std::sqrt(square) / p);
              }
            }
        largest_pressure = Utilities::MPI::max(largest_pressure, contact.spaces().comm);
      }
      return Utilities::MPI::max(largest_ratio, contact.spaces().comm);
    }

    /// The closed nodes of a contact that slip. Collective.
    template <int dim>
    unsigned int n_slipping(const Contact<dim> &contact, const unsigned int interface)
    {
      const std::set<unsigned int> &slipping = contact.active_set().slipping;
      if (slipping.empty())
        return 0;
      std::vector<char> is_here(slipping.size());
      for (const ContactFace<dim> &face : contact.paired_interfaces()[interface].pad_faces)
        for (const auto &nodes : face.nodes)
          for (const FreeNode<dim> &node : nodes)
            if (node.equations[dim] >= 0 && contact.is_active(node))
              if (const auto found = slipping.find(node.equations[dim]); found != slipping.end())
                is_here[std::distance(slipping.begin(), found)] = 1;
      MPI_Allreduce(MPI_IN_PLACE, is_here.data(), is_here.size(), MPI_CHAR, MPI_MAX,
                    contact.spaces().comm);
      return std::count(is_here.begin(), is_here.end(), 1);
    }
  } // namespace

  namespace
  {
    /// Adds a pair's area, pressure and friction. Without a @p state nothing is known of
    /// penetration.
    template <int dim>
    void add_pressures(const Contact<dim> &contact, const unsigned int interface,
                       const ContactKinematics<dim> &k, const std::vector<double> &pressure,
                       const std::vector<double> *state, ContactResultants &r)
    {
      const bool mortar = contact.contact_model().mortar;
      // Mortar: a face's part of the area in contact is that of the shape functions of its
      // active nodes.
      std::vector<double> flags(k.psi.n_rows);
      for (unsigned int m = 0; m < flags.size(); ++m)
        flags[m] = contact.is_active(k.pad->free[m]);
      const std::vector<double> in_contact = k.at_points(k.psi, flags);
      const std::vector<double> jump =
          state ? k.at_points(k.n(), k.local_values(*state)) : std::vector<double>(k.n_points);
      const auto extend = [&r](const double p)
      {
        r.max_pressure = std::max(r.max_pressure, p);
        r.min_pressure = std::min(r.min_pressure, p);
      };
      // Where quadrature points lie depends on how the faces are numbered; nodes do not.
      const bool at_nodes = mortar && state;
      if (at_nodes)
        for (const double multiplier : k.local_multipliers(*state))
          extend(contact.pressure_per_unknown(interface, k.first_point) * multiplier);
      for (unsigned int q = 0; q < k.n_points; ++q)
      {
        const unsigned int point = k.first_point + q;
        const double p           = pressure[point];
        if (!at_nodes)
          extend(p);
        const double friction =
            contact.slides(interface)
                ? k.weights[q] * contact.friction(interface).traction(k.speeds[q], p).value
                : 0;
        r.area += k.weights[q] * (mortar ? in_contact[q]
                                         : double(contact.active_set().by_point[interface][point]));
        r.normal_force += k.weights[q] * p;
        r.friction_force += friction;
        r.friction_torque += friction * k.radii[q];
        r.max_penetration = std::max(r.max_penetration, jump[q] - contact.gap(interface, k, q));
      }
    }

    /// Adds the tangential tractions of a pair that sticks: their sum and, in 3D, their torque.
    /// Signs are those of forces on the first body: with [[u]] = u_2 - u_1 the left side has -T
    /// there.
    template <int dim>
    void add_tractions(const Contact<dim> &contact, const ContactKinematics<dim> &k,
                       const std::vector<double> &state, Tensor<1, dim> &sum, double &torque)
    {
      for (unsigned int direction = 1; direction < dim; ++direction)
      {
        const std::vector<double> T =
            k.at_points(k.psi, k.local_multipliers(state, &contact.active_set().by_row, direction));
        for (unsigned int q = 0; q < k.n_points; ++q)
        {
          const Tensor<1, dim> force =
              k.weights[q] * contact.pressure_scale() * T[q] * k.direction(direction, q);
          sum += force;
          if (dim == 3)
            torque += k.positions[q][0] * force[1] - k.positions[q][1] * force[0];
        }
      }
    }

    /// Makes what is known on each rank that of all ranks.
    void sum_over_ranks(ContactResultants &r, const MPI_Comm comm)
    {
      for (double *sum : {&r.area, &r.normal_force, &r.friction_force, &r.friction_torque})
        *sum = Utilities::MPI::sum(*sum, comm);
      for (double *maximum : {&r.max_pressure, &r.max_penetration})
        *maximum = Utilities::MPI::max(*maximum, comm);
      r.min_pressure = Utilities::MPI::min(r.min_pressure, comm);
    }
  } // namespace

  template <int dim>
  std::vector<ContactResultants>
  resultants(const Contact<dim> &contact, const ContactPressure &pressure, const MultiVector *state)
  {
    const std::vector<double> global = state ? replicate(*state) : std::vector<double>();
    std::vector<ContactResultants> results(contact.paired_interfaces().size());
    std::vector<Tensor<1, dim>> tangential(results.size());
    for (unsigned int i = 0; i < contact.paired_interfaces().size(); ++i)
    {
      results[i].name     = contact.paired_interfaces()[i].name;
      results[i].kind     = contact.paired_interfaces()[i].kind;
      results[i].friction = contact.paired_interfaces()[i].friction;
    }
    contact.for_each_pair(
        [&](const unsigned int i, const ContactKinematics<dim> &k)
        {
          ContactResultants &r = results[i];
          add_pressures(contact, i, k, pressure[i], state ? &global : nullptr, r);
          if (state && contact.sticks(i))
            add_tractions(contact, k, global, tangential[i], r.friction_torque);
        });
    if (state)
      for (unsigned int i = 0; i < results.size(); ++i)
        if (contact.sticks(i))
        {
          results[i].needed_friction = needed_friction(contact, i, global);
          results[i].n_slipping      = n_slipping(contact, i);
        }
    for (ContactResultants &r : results)
      sum_over_ranks(r, contact.spaces().comm);
    for (unsigned int i = 0; i < results.size(); ++i)
      if (contact.sticks(i))
        results[i].friction_force =
            Tensor<1, dim>(Utilities::MPI::sum(tangential[i], contact.spaces().comm)).norm();
    return results;
  }

  template <int dim>
  FrictionWork friction_work(const Contact<dim> &contact, const ComplexMultiVector &mode,
                             const double omega, const ContactPressure &pressure,
                             const bool with_damping)
  {
    const ContactModel<dim> &model                  = contact.contact_model();
    using Complex                                   = std::complex<double>;
    const std::array<std::vector<double>, 2> global = {{replicate(mode.re), replicate(mode.im)}};
    FrictionWork work;
    for (ContactPressure *part : {&work.friction, &work.damping, &work.falling})
      part->resize(contact.paired_interfaces().size());
    contact.for_each_pair(
        [&](const unsigned int i, const ContactKinematics<dim> &k)
        {
          const std::array<std::vector<double>, 2> local = {
              {k.local_values(global[0]), k.local_values(global[1])}};
          const auto amplitude =
              [&](const DenseMatrix &rows, const std::array<std::vector<double>, 2> &unknowns)
          {
            std::vector<Complex> result(k.n_points);
            const std::vector<double> of_re = k.at_points(rows, unknowns[0]),
                                      of_im = k.at_points(rows, unknowns[1]);
            for (unsigned int q = 0; q < k.n_points; ++q)
              result[q] = {of_re[q], of_im[q]};
            return result;
          };
          const auto along_e = amplitude(k.e(), local), along_b = amplitude(k.b(), local),
                     phi_e = amplitude(k.e_phi(), local), phi_b = amplitude(k.b_phi(), local);
          const std::vector<bool> &active = contact.active_set().by_row;
          std::vector<Complex> dp =
              model.mortar ? amplitude(k.psi, {{k.local_multipliers(global[0], &active),
                                                k.local_multipliers(global[1], &active)}})
                           : amplitude(k.n(), local);
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            if (!contact.slides(i))
            {
              for (ContactPressure *part : {&work.friction, &work.damping, &work.falling})
                (*part)[i].push_back(0.);
              continue;
            }
            const unsigned int point = k.first_point + q;
            const double p_0         = pressure[i][point];
            dp[q] *= contact.pressure_per_unknown(i, point);
            const auto law     = contact.friction(i).traction(k.speeds[q], p_0);
            const auto of_slip = [&](const double slope, const Complex jump, const Complex d_phi)
            {
              return -M_PI * slope *
                     (omega * std::norm(jump) +
                      model.convective_velocity() * std::imag(std::conj(jump) * d_phi));
            };
            work.friction[i].push_back(-M_PI * law.d_pressure *
                                       std::imag(std::conj(along_e[q]) * dp[q]));
            work.damping[i].push_back(
                with_damping && dim == 3 ? of_slip(law.over_speed, along_b[q], phi_b[q]) : 0.);
            work.falling[i].push_back(with_damping && !model.friction_is_flat()
                                          ? of_slip(law.d_speed, along_e[q], phi_e[q])
                                          : 0.);
          }
        });
    return work;
  }

#define SQUEAL_INSTANTIATE(dim)                                                                    \
  template MultiVector contact_load(const Contact<dim> &, const ContactPressure &, bool);          \
  template MultiVector nonlinear_forces(const Contact<dim> &, const MultiVector &,                 \
                                        const MultiVector &, bool, const MultiVector *);           \
  template std::vector<ContactResultants> resultants(                                              \
      const Contact<dim> &, const ContactPressure &, const MultiVector *);                         \
  template FrictionWork friction_work(const Contact<dim> &, const ComplexMultiVector &, double,    \
                                      const ContactPressure &, bool);
  SQUEAL_INSTANTIATE(2)
  SQUEAL_INSTANTIATE(3)
#undef SQUEAL_INSTANTIATE
} // namespace squeal
