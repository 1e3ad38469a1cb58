#include <squeal/contact/contact.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  template <int dim>
  Contact<dim>::Contact(const FiniteElementSpace<dim> &spaces, const ContactModel<dim> &model)
      : space(&spaces), model(model), element(spaces.fe.degree),
        surfaces(std::make_shared<const std::vector<PairedInterface<dim>>>(
            pair_interfaces(spaces, element))),
        active(spaces.rows.size, true)
  {
    MultiVector mark(space->rows, 1);
    for (unsigned int row = space->first_local_multiplier; row < space->rows.end; ++row)
      mark.data()[row - space->rows.begin] = 1;
    for (const double value : replicate(mark))
      is_multiplier.push_back(value != 0);
    std::size_t n_all_points = 0;
    for (const PairedInterface<dim> &interface : paired_interfaces())
    {
      unsigned int n_points = 0;
      for (const FacePair<dim> &pair : interface.pairs)
        n_points += pair.points.size();
      active_points.emplace_back(n_points, true);
      n_all_points += n_points;
    }
    // Three numbers for each node
    constexpr double largest_table = 1024. * 1024. * 1024.;
    keeps_table = 3. * element.n_nodes() * n_all_points * sizeof(double) < largest_table;
  }

  template <int dim>
  void Contact<dim>::for_each_pair(
      const std::function<void(unsigned int interface, const Kinematics &)> &work,
      const bool with_slopes) const
  {
    const bool keeps = keeps_table && !with_slopes;
    if (keeps && tabulated && tabulated->angular_velocity == model.angular_velocity)
    {
      for (const auto &[interface, shapes] : tabulated->pairs)
        work(interface, Kinematics(shapes));
      return;
    }
    auto table              = std::make_shared<Tabulated>();
    table->angular_velocity = model.angular_velocity;
    for (unsigned int i = 0; i < paired_interfaces().size(); ++i)
    {
      unsigned int first_point = 0;
      for (const FacePair<dim> &pair : paired_interfaces()[i].pairs)
      {
        const auto shapes = std::make_shared<PairShapes<dim>>(
            element, paired_interfaces()[i].rotor_faces[pair.rotor_face],
            paired_interfaces()[i].pad_faces[pair.pad_face], pair, space->geometry,
            model.angular_velocity);
        shapes->first_point = first_point;
        first_point += pair.points.size();
        Kinematics kinematics(shapes);
        if (with_slopes)
          kinematics.add_slopes(element, pair, space->geometry);
        work(i, kinematics);
        if (keeps)
          table->pairs.emplace_back(i, shapes);
      }
    }
    if (keeps)
      tabulated = std::move(table);
  }

  template <int dim>
  Matrix Contact<dim>::normal() const
  {
    EntryList entries;
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          std::vector<double> c = k.weights;
          for (unsigned int q = 0; q < k.n_points; ++q)
            c[q] *= model.mortar ? scale
                                 : model.penalty_stiffness * active_points[i][k.first_point + q];
          if (model.mortar)
          {
            k.add_coupling(entries, k.product(k.n(), c, k.psi), active, true);
            for (double &value : c)
              value *= -scale * model.compliance;
            if (model.compliance > 0)
              k.add_multipliers(entries, k.product(k.psi, c, k.psi), active);
          }
          else
            k.add(entries, k.product(k.n(), c, k.n()));
        });
    if (model.mortar) // Lambda = 0 where the pad has lifted off
      for (unsigned int row = space->first_local_multiplier; row < space->rows.end; ++row)
        if (!active[row])
          entries.add(row, row, constraint_stiffness);
    return entries.make_matrix(space->rows);
  }

  template <int dim>
  void Contact<dim>::scale_constraints(const double stiffness)
  {
    scale                = 1;
    scale                = stiffness / normal().infinity_norm();
    constraint_stiffness = stiffness;
  }

  template <int dim>
  Matrix Contact<dim>::friction(const Pressure &pressure) const
  {
    Pressure slopes = pressure;
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          for (unsigned int q = k.first_point; q < k.first_point + k.n_points; ++q)
            slopes[i][q] =
                model.friction.traction(k.speeds[q - k.first_point], pressure[i][q]).d_pressure;
        });
    return tangential(slopes);
  }

  template <int dim>
  Matrix Contact<dim>::tangential(const Pressure &coefficients) const
  {
    EntryList entries;
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          std::vector<double> c = k.weights;
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            const unsigned int point = k.first_point + q;
            c[q] *= coefficients[i][point] *
                    (model.mortar ? scale : model.penalty_stiffness * active_points[i][point]);
          }
          if (model.mortar)
            k.add_coupling(entries, k.product(k.e(), c, k.psi), active, false);
          else
            k.add(entries, k.product(k.e(), c, k.n()));
        });
    return entries.make_matrix(space->rows);
  }

  template <int dim>
  typename Contact<dim>::Pressure Contact<dim>::uniform_pressure(const double value) const
  {
    Pressure pressure(paired_interfaces().size());
    for_each_pair([&](const unsigned int i, const Kinematics &k)
                  { pressure[i].insert(pressure[i].end(), k.n_points, value); });
    return pressure;
  }

  template <int dim>
  typename Contact<dim>::Pressure Contact<dim>::pressure_of(const MultiVector &state) const
  {
    const std::vector<double> global = replicate(state);
    Pressure pressure(paired_interfaces().size());
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          // Mortar: p = Psi^T Lambda. Penalty: p = k_C ([[u]].n - g_0) where closed.
          std::vector<double> p = model.mortar ? k.at_points(k.psi, k.local_multipliers(global))
                                               : k.at_points(k.n(), k.local_values(global));
          for (unsigned int q = 0; q < k.n_points; ++q)
            p[q] = model.mortar ? scale * p[q]
                                : model.penalty_stiffness * (p[q] - gap(k.positions[q])) *
                                      active_points[i][k.first_point + q];
          pressure[i].insert(pressure[i].end(), p.begin(), p.end());
        });
    return pressure;
  }

  template <int dim>
  typename Contact<dim>::FrictionDamping
  Contact<dim>::friction_damping(const Pressure &pressure) const
  {
    EntryList P_falling, Q_falling;
    if (!turning_entries)
      turning_entries = std::make_shared<std::array<RepeatedEntries, 2>>();
    auto &[P, Q] = *turning_entries;
    for_each_pair(
        [&, &P = P, &Q = Q](const unsigned int i, const Kinematics &k)
        {
          std::vector<double> turning(k.n_points), slope(k.n_points);
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            // Between its nodes the pressure of a partly released face may dip below zero; friction
            // may not.
            const double p = std::max(0., pressure[i][k.first_point + q]);
            const auto tau = model.friction.traction(k.speeds[q], p);
            turning[q]     = k.weights[q] * tau.over_speed;
            slope[q]       = k.weights[q] * tau.d_speed;
          }
          const auto times_omega = [&](std::vector<double> c)
          {
            for (double &value : c)
              value *= model.angular_velocity;
            return c;
          };
          if (dim == 3) // P_perp = b b^T
          {
            k.add_product(P, k.b(), turning, k.b());
            k.add_product(Q, k.b(), times_omega(turning), k.b_phi());
          }
          if (!model.friction.is_flat())
          {
            k.add(P_falling, k.product(k.e(), slope, k.e()));
            k.add(Q_falling, k.product(k.e(), times_omega(slope), k.e_phi()));
          }
        });
    FrictionDamping result;
    if (dim == 3)
    {
      result.P = P.make_matrix(space->rows);
      result.Q = Q.make_matrix(space->rows);
    }
    if (!model.friction.is_flat())
    {
      result.P_falling = P_falling.make_matrix(space->rows);
      result.Q_falling = Q_falling.make_matrix(space->rows);
    }
    return result;
  }

  template <int dim>
  MultiVector Contact<dim>::load(const Pressure &pressure, const bool with_friction) const
  {
    std::vector<PetscInt> rows;
    std::vector<double> values;
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          std::vector<double> along_n(k.n_points), along_e(k.n_points);
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            const unsigned int point = k.first_point + q;
            const double w = k.weights[q], g = gap(k.positions[q]), p = pressure[i][point];
            const auto tau =
                with_friction ? model.friction.traction(k.speeds[q], p) : FrictionTraction();
            along_e[q] = -w * (tau.value - p * tau.d_pressure);
            if (model.mortar)
            {
              for (unsigned int m = 0; m < k.pad->nodes.size() && g != 0; ++m)
                for (const FreeNode<dim> &node : k.pad->nodes[m])
                  if (is_active(node))
                  {
                    rows.push_back(node.equations[dim]);
                    values.push_back(node.weight * scale * w * k.psi(m, q) * g);
                  }
            }
            else if (active_points[i][point])
            {
              along_n[q] = w * model.penalty_stiffness * g;
              along_e[q] += w * model.penalty_stiffness * g * tau.d_pressure;
            }
          }
          // A friction law without an offset has no part in it, and mortar no normal forces.
          const auto is_zero = [](const double c) { return c == 0; };
          if (!std::all_of(along_n.begin(), along_n.end(), is_zero))
            k.add_forces(rows, values, k.n(), along_n);
          if (!std::all_of(along_e.begin(), along_e.end(), is_zero))
            k.add_forces(rows, values, k.e(), along_e);
        });
    return sum_entries(space->rows, rows, values);
  }

  template <int dim>
  typename Contact<dim>::Turning Contact<dim>::turning(const Pressure &pressure,
                                                       const bool with_friction) const
  {
    EntryList by_pressure, by_friction;
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          std::vector<double> p(k.n_points), tau(k.n_points), turn(k.n_points), slope(k.n_points);
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            const double p_0 = std::max(0., pressure[i][k.first_point + q]), w = k.weights[q];
            p[q] = -w * p_0;
            if (with_friction)
            {
              const auto t = model.friction.traction(k.speeds[q], p_0);
              tau[q]       = w * t.value;
              turn[q]      = w * t.over_speed * model.angular_velocity;
              slope[q]     = w * t.d_speed * model.angular_velocity;
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
    Turning result;
    result.pressure = by_pressure.make_matrix(space->rows);
    if (with_friction)
      result.friction = by_friction.make_matrix(space->rows);
    return result;
  }

  template <int dim>
  MultiVector Contact<dim>::nonlinear_forces(const MultiVector &state, const MultiVector &velocity,
                                             const bool with_friction,
                                             const MultiVector *turned_from) const
  {
    const std::vector<double> u = replicate(state), u_t = replicate(velocity);
    std::vector<double> du(u.size()); // from the steady state on
    if (turned_from)
      du = replicate(*turned_from);
    for (unsigned int row = 0; row < du.size() && turned_from; ++row)
      du[row] = u[row] - du[row];
    const Pressure pressure = pressure_of(state);
    std::vector<PetscInt> rows;
    std::vector<double> values;
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          // Components along the reference basis n, e, b.
          using Components      = Tensor<1, 3>;
          const auto components = [&](const std::array<const DenseMatrix *, 3> &rows_of,
                                      const std::vector<double> &local)
          {
            std::vector<Components> result(k.n_points);
            for (unsigned int c = 0; c < 3; ++c)
              if (rows_of[c] && rows_of[c]->n_rows > 0)
              {
                const std::vector<double> component = k.at_points(*rows_of[c], local);
                for (unsigned int q = 0; q < k.n_points; ++q)
                  result[q][c] = component[q];
              }
            return result;
          };
          const std::vector<double> local = k.local_values(u), local_t = k.local_values(u_t),
                                    local_du = k.local_values(du);
          const auto jump                    = components({{&k.n(), &k.e(), &k.b()}}, local),
                     jump_t                  = components({{&k.n(), &k.e(), &k.b()}}, local_t),
                     d_phi   = components({{nullptr, &k.e_phi(), &k.b_phi()}}, local),
                     moved   = components({{nullptr, &k.e(), &k.b()}}, local_du),
                     moved_w = components({{nullptr, &k.moved_w[0], &k.moved_w[1]}}, local_du);
          std::array<std::vector<Components>, 2> slopes;
          for (unsigned int s = 0; s < 2; ++s)
            slopes[s] = components({{&k.slopes[s][0], &k.slopes[s][1], &k.slopes[s][2]}}, local_du);

          std::array<std::vector<double>, 3> force;
          std::array<std::array<std::vector<double>, 3>, 2> moved_force; // on d_a du_R
          for (unsigned int c = 0; c < 3; ++c)
          {
            force[c].resize(k.n_points);
            for (unsigned int s = 0; s < 2; ++s)
              moved_force[s][c].resize(k.n_points);
          }
          const double omega = model.angular_velocity;
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            const double p = pressure[i][k.first_point + q], w = k.weights[q];
            Components e({0, 1, 0}), b({0, 0, 1});
            e += slopes[0][q];
            b += slopes[1][q];
            Components normal = cross_product_3d(e, b); // (n, e, b) is right-handed
            normal /= normal.norm();
            // v = (I - n n) [Omega w + d_t [[u]] + Omega d_phi u_R]; e points along Omega w.
            Components v = jump_t[q] + omega * (d_phi[q] + moved_w[q]);
            v[1] += k.speeds[q];
            v[0] += k.speeds[q] * slopes[0][q][0]; // d_phi u_R . n
            if (!turned_from)
              v[0] = 0;
            v -= (v * normal) * normal;
            Components traction = p * normal;
            if (with_friction)
              traction += model.friction.traction(v.norm(), p).over_speed * v;
            for (unsigned int c = 0; c < 3; ++c)
            {
              force[c][q] = w * traction[c];
              for (unsigned int s = 0; s < 2; ++s)
                moved_force[s][c][q] = -w * traction[c] * moved[q][1 + s];
            }
            if (model.mortar)
              for (unsigned int m = 0; m < k.pad->nodes.size(); ++m)
                for (const FreeNode<dim> &node : k.pad->nodes[m])
                  if (is_active(node))
                  {
                    rows.push_back(node.equations[dim]);
                    values.push_back(node.weight * scale * w * k.psi(m, q) *
                                     (jump[q][0] - gap(k.positions[q]) - model.compliance * p));
                  }
          }
          const std::array<const DenseMatrix *, 3> basis = {{&k.n(), &k.e(), &k.b()}};
          for (unsigned int c = 0; c < dim; ++c)
          {
            k.add_forces(rows, values, *basis[c], force[c]);
            for (unsigned int s = 0; s < dim - 1 && turned_from; ++s)
              k.add_forces(rows, values, k.slopes[s][c], moved_force[s][c]);
          }
        },
        turned_from != nullptr);
    if (model.mortar)
      for (unsigned int row = space->first_local_multiplier; row < space->rows.end; ++row)
        if (!active[row])
        {
          rows.push_back(row);
          values.push_back(constraint_stiffness * u[row]);
        }
    return sum_entries(space->rows, rows, values);
  }

  template <int dim>
  std::vector<ContactResultants> Contact<dim>::resultants(const Pressure &pressure,
                                                          const MultiVector *state) const
  {
    const std::vector<double> global = state ? replicate(*state) : std::vector<double>();
    std::vector<ContactResultants> results(paired_interfaces().size());
    for (unsigned int i = 0; i < paired_interfaces().size(); ++i)
      results[i].name = paired_interfaces()[i].name;
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          ContactResultants &r = results[i];
          // Mortar: a face's part of the area in contact is that of its active shape functions.
          std::vector<double> flags(k.psi.n_rows);
          for (unsigned int m = 0; m < flags.size(); ++m)
            for (const FreeNode<dim> &node : k.pad->nodes[m])
              flags[m] += node.weight * is_active(node);
          const std::vector<double> in_contact = k.at_points(k.psi, flags);
          const std::vector<double> jump =
              state ? k.at_points(k.n(), k.local_values(global)) : std::vector<double>(k.n_points);
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            const unsigned int point = k.first_point + q;
            const double p           = pressure[i][point];
            const double friction    = k.weights[q] * model.friction.traction(k.speeds[q], p).value;
            r.area +=
                k.weights[q] * (model.mortar ? in_contact[q] : double(active_points[i][point]));
            r.normal_force += k.weights[q] * p;
            r.friction_force += friction;
            r.friction_torque += friction * k.radii[q];
            r.max_pressure    = std::max(r.max_pressure, p);
            r.min_pressure    = std::min(r.min_pressure, p);
            r.max_penetration = std::max(r.max_penetration, jump[q] - gap(k.positions[q]));
          }
        });
    for (ContactResultants &r : results)
    {
      for (double *sum : {&r.area, &r.normal_force, &r.friction_force, &r.friction_torque})
        *sum = Utilities::MPI::sum(*sum, space->comm);
      for (double *maximum : {&r.max_pressure, &r.max_penetration})
        *maximum = Utilities::MPI::max(*maximum, space->comm);
      r.min_pressure = Utilities::MPI::min(r.min_pressure, space->comm);
    }
    return results;
  }

  template class Contact<2>;
  template class Contact<3>;
} // namespace squeal
