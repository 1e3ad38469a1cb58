#include <squeal/contact/contact.h>
#include <squeal/contact/contact_matrices.h>
#include <squeal/mesh/finite_element_space.h>

#include <algorithm>
#include <cmath>

// The contact of one mesh, in this order: what each multiplier is and which surfaces touch at
// first; tables of shape functions and the loop over pairs of faces; constraints that supports make
// superfluous; scaling of the constraints; pressures of a state; the step of the primal-dual active
// set; lists of what is closed and released.

namespace squeal
{
  using namespace dealii;

  template <int dim>
  Contact<dim>::Contact(const FiniteElementSpace<dim> &spaces, const ContactModel<dim> &model)
      : space(&spaces), model(model), element(spaces.fe.degree),
        surfaces(std::make_shared<const std::vector<PairedInterface<dim>>>(
            pair_interfaces(spaces, element))),
        active{std::vector<bool>(spaces.rows.size, true), {}, {}}
  {
    MultiVector mark(space->rows, 1);
    const auto local = [&](const unsigned int row)
    { return mark.data() + (row - space->rows.begin); };
    std::fill(local(space->first_local_multiplier), local(space->first_local_tie),
              double(Unknown::pressure));
    for (const auto node : space->nodes.locally_owned_dofs())
      if (const unsigned int row = space->stick(node); row != FiniteElementSpace<dim>::none)
        std::fill_n(local(row), dim - 1, double(Unknown::traction));
    std::fill(local(space->first_local_tie), mark.data() + mark.n_local(), double(Unknown::other));
    for (const double value : replicate(mark))
      unknowns.push_back(Unknown(int(value)));
    std::size_t n_all_points = 0;
    for (const PairedInterface<dim> &interface : paired_interfaces())
    {
      unsigned int n_points = 0;
      for (const FacePair<dim> &pair : interface.pairs)
        n_points += pair.points.size();
      active.by_point.emplace_back(n_points, true);
      n_all_points += n_points;
    }
    // Three numbers for each node
    constexpr double largest_table = 1024. * 1024. * 1024.;
    keeps_table = 3. * element.n_nodes() * n_all_points * sizeof(double) < largest_table;
    tabulate_shapes();
    if (space->geometry.has_stick())
      find_held_tractions();
  }

  template <int dim>
  template <typename Function>
  void Contact<dim>::for_each_shapes(const Function &function) const
  {
    for (unsigned int i = 0; i < paired_interfaces().size(); ++i)
    {
      const PairedInterface<dim> &interface = paired_interfaces()[i];
      unsigned int first_point              = 0;
      for (const FacePair<dim> &pair : interface.pairs)
      {
        auto shapes = std::make_shared<PairShapes<dim>>(
            element, interface.rotor_faces[pair.rotor_face], interface.pad_faces[pair.pad_face],
            pair, space->geometry, model.angular_velocity, slides(i) ? nullptr : &interface.along);
        shapes->first_point = first_point;
        first_point += pair.points.size();
        function(i, pair, std::move(shapes));
      }
    }
  }

  template <int dim>
  void Contact<dim>::tabulate_shapes()
  {
    if (!keeps_table ||
        (table && table->angular_velocity == model.angular_velocity &&
         std::signbit(table->angular_velocity) == std::signbit(model.angular_velocity)))
      return;
    auto made              = std::make_shared<TabulatedShapes>();
    made->angular_velocity = model.angular_velocity;
    for_each_shapes([&](const unsigned int i, const FacePair<dim> &,
                        std::shared_ptr<const PairShapes<dim>> shapes)
                    { made->pairs.emplace_back(i, std::move(shapes)); });
    table = std::move(made);
  }

  template <int dim>
  void Contact<dim>::for_each_pair(
      const std::function<void(unsigned int interface, const Kinematics &)> &work,
      const bool with_slopes) const
  {
    if (table && !with_slopes)
    {
      for (const auto &[interface, shapes] : table->pairs)
        work(interface, Kinematics(shapes));
      return;
    }
    for_each_shapes(
        [&](const unsigned int i, const FacePair<dim> &pair,
            std::shared_ptr<const PairShapes<dim>> shapes)
        {
          Kinematics kinematics(std::move(shapes));
          if (with_slopes)
            kinematics.add_slopes(element, pair, space->geometry);
          work(i, kinematics);
        });
  }

  template <int dim>
  void Contact<dim>::for_each_sliding_pair(
      const std::function<void(unsigned int interface, const Kinematics &)> &work,
      const bool with_slopes) const
  {
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          if (slides(i))
            work(i, k);
        },
        with_slopes);
  }

  /// Where a support fixes the first side along a tangential direction, it has that traction: two
  /// would share it in any proportion.
  template <int dim>
  void Contact<dim>::find_held_tractions()
  {
    // int |psi| and int |psi| sum of e_c^2 over the fixed components c, by equation
    std::vector<double> sums(2 * space->rows.size);
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          if (!sticks(i))
            return;
          for (unsigned int m = 0; m < k.pad->free.size(); ++m)
          {
            const FreeNode<dim> &node = k.pad->free[m];
            for (unsigned int direction = 1; direction < dim && node.equations[dim + 1] >= 0;
                 ++direction)
              for (unsigned int q = 0; q < k.n_points; ++q)
              {
                const Tensor<1, dim> along = k.direction(direction, q);
                const double w             = std::abs(k.weights[q] * k.psi(m, q));
                double *const sum          = &sums[2 * node.multiplier(direction)];
                sum[0] += w;
                for (unsigned int c = 0; c < dim; ++c)
                  if (!node.moves[c])
                    sum[1] += w * along[c] * along[c];
              }
          }
        });
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), sums.size(), MPI_DOUBLE, MPI_SUM, space->comm);
    for (unsigned int row = 0; row < space->rows.size; ++row)
      if (sums[2 * row + 1] > sums[2 * row] / 2)
        unknowns[row] = Unknown::held;
    close();
  }

  template <int dim>
  void Contact<dim>::close()
  {
    active.close();
    for (unsigned int row = 0; row < unknowns.size(); ++row)
      if (unknowns[row] == Unknown::held)
        active.by_row[row] = false;
  }

  template <int dim>
  std::vector<unsigned int> Contact<dim>::with_tractions(const unsigned int pressure) const
  {
    std::vector<unsigned int> rows = {pressure};
    if (active.slipping.count(pressure) > 0)
      return rows;
    for (unsigned int row = pressure + 1;
         row < unknowns.size() &&
         (unknowns[row] == Unknown::traction || unknowns[row] == Unknown::held);
         ++row)
      if (unknowns[row] == Unknown::traction)
        rows.push_back(row);
    return rows;
  }

  template <int dim>
  void Contact<dim>::let_slip(const unsigned int pressure)
  {
    std::vector<unsigned int> tractions = with_tractions(pressure);
    tractions.erase(tractions.begin()); // the pressure
    set_closed(tractions, false);
    active.slipping.insert(pressure);
  }

  template <int dim>
  void Contact<dim>::scale_constraints(const double stiffness)
  {
    scale                    = 1;
    scale                    = stiffness / normal_matrix(*this).infinity_norm();
    stiffness_of_constraints = stiffness;
  }

  template <int dim>
  ContactPressure Contact<dim>::uniform_pressure(const double value) const
  {
    ContactPressure pressure(paired_interfaces().size());
    for_each_pair([&](const unsigned int i, const Kinematics &k)
                  { pressure[i].insert(pressure[i].end(), k.n_points, value); });
    return pressure;
  }

  template <int dim>
  double Contact<dim>::closed_share(const unsigned int interface, const Kinematics &k,
                                    const unsigned int q) const
  {
    if (!model.mortar)
      return active.by_point[interface][k.first_point + q];
    double share = 0;
    for (unsigned int a = 0; a < k.pad->free.size(); ++a)
      share += k.psi(a, q) * is_active(k.pad->free[a]);
    return share;
  }

  template <int dim>
  ContactPressure Contact<dim>::pressure_of(const MultiVector &state) const
  {
    const std::vector<double> global = replicate(state);
    ContactPressure pressure(paired_interfaces().size());
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          // Mortar: p = Psi^T Lambda. Penalty: p = k_C ([[u]].n - g_0) where closed.
          std::vector<double> p = model.mortar ? k.at_points(k.psi, k.local_multipliers(global))
                                               : k.at_points(k.n(), k.local_values(global));
          for (unsigned int q = 0; q < k.n_points; ++q)
            p[q] = pressure_per_unknown(i, k.first_point + q) *
                   (model.mortar ? p[q] : p[q] - gap(i, k, q));
          pressure[i].insert(pressure[i].end(), p.begin(), p.end());
        });
    return pressure;
  }

  template <int dim>
  ActiveSetChange Contact<dim>::update_active_set(const MultiVector &state, const bool only_one)
  {
    const std::vector<double> global = replicate(state);
    double size                      = 0; // of the displacements, for what counts as rounding
    for (unsigned int row = 0; row < space->rows.size; ++row)
      if (unknowns[row] == Unknown::displacement)
        size = std::max(size, std::abs(global[row]));

    return model.mortar ? update_multipliers(global, size, only_one) : update_points(global, size);
  }

  template <int dim>
  std::vector<double> Contact<dim>::mean_penetrations(const std::vector<double> &state) const
  {
    std::vector<double> gaps(2 * space->rows.size); // and weights
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          std::vector<double> jump = k.at_points(k.n(), k.local_values(state));
          if (is_compliant())
          {
            const std::vector<double> p = k.at_points(k.psi, k.local_multipliers(state));
            for (unsigned int q = 0; q < k.n_points; ++q)
              jump[q] -= compliance(i, k.first_point + q) * scale * p[q];
          }
          for (unsigned int m = 0; m < k.pad->free.size(); ++m)
            if (const int row = k.pad->free[m].equations[dim]; row >= 0)
              for (unsigned int q = 0; q < k.n_points; ++q)
              {
                const double w = k.weights[q] * k.psi(m, q);
                gaps[2 * row] += w * (jump[q] - gap(i, k, q));
                gaps[2 * row + 1] += std::abs(w);
              }
        });
    MPI_Allreduce(MPI_IN_PLACE, gaps.data(), gaps.size(), MPI_DOUBLE, MPI_SUM, space->comm);
    std::vector<double> result(space->rows.size);
    for (unsigned int row = 0; row < space->rows.size; ++row)
      if (unknowns[row] == Unknown::pressure)
        result[row] = gaps[2 * row] / gaps[2 * row + 1];
    return result;
  }

  template <int dim>
  ActiveSetChange Contact<dim>::update_multipliers(const std::vector<double> &state,
                                                   const double size, const bool only_one)
  {
    const std::vector<double> penetrations = mean_penetrations(state);
    double largest_pressure                = 0;
    for (unsigned int row = 0; row < space->rows.size; ++row)
      if (unknowns[row] == Unknown::pressure)
        largest_pressure = std::max(largest_pressure, std::abs(state[row]));
    ActiveSetChange change;
    std::vector<unsigned int> broken;
    for (unsigned int row = 0; row < space->rows.size; ++row)
      if (unknowns[row] == Unknown::pressure)
      {
        const double penetration = penetrations[row];
        if (active.by_row[row])
          change.largest_tension = std::max(change.largest_tension, -scale * state[row]);
        else
          change.largest_penetration = std::max(change.largest_penetration, penetration);
        const bool now = active.by_row[row] ? state[row] >= -1e-12 * largest_pressure
                                            : penetration > 1e-12 * size;
        change.n_active += now;
        if (now != active.by_row[row])
          broken.push_back(row);
      }
    change.n_changed = broken.size();
    if (only_one && !broken.empty())
      broken = {broken.back()};
    for (const unsigned int row : broken)
      if (only_one && active.by_row[row] && with_tractions(row).size() > 1)
        let_slip(row);
      else
        set_closed(with_tractions(row), !active.by_row[row]);
    return change;
  }

  template <int dim>
  ActiveSetChange Contact<dim>::update_points(const std::vector<double> &state, const double size)
  {
    ActiveSetChange change;
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          const std::vector<double> jump = k.at_points(k.n(), k.local_values(state));
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            const double penetration = jump[q] - gap(i, k, q);
            const bool before        = active.by_point[i][k.first_point + q],
                       now           = penetration > -1e-12 * size;
            if (before)
              change.largest_tension =
                  std::max(change.largest_tension, -model.penalty_stiffness * penetration);
            else
              change.largest_penetration = std::max(change.largest_penetration, penetration);
            change.n_changed += now != before;
            change.n_active += now;
            active.by_point[i][k.first_point + q] = now;
          }
        });
    change.n_changed           = Utilities::MPI::sum(change.n_changed, space->comm);
    change.n_active            = Utilities::MPI::sum(change.n_active, space->comm);
    change.largest_tension     = Utilities::MPI::max(change.largest_tension, space->comm);
    change.largest_penetration = Utilities::MPI::max(change.largest_penetration, space->comm);
    return change;
  }

  template <int dim>
  std::vector<std::string> Contact<dim>::lost_contacts() const
  {
    std::vector<unsigned int> n_active(paired_interfaces().size());
    for (unsigned int i = 0; i < paired_interfaces().size(); ++i)
      if (model.mortar)
      {
        for (const ContactFace<dim> &face : paired_interfaces()[i].pad_faces)
          for (const auto &nodes : face.nodes)
            for (const FreeNode<dim> &node : nodes)
              n_active[i] += is_active(node);
      }
      else
        n_active[i] = std::count(active.by_point[i].begin(), active.by_point[i].end(), true);
    MPI_Allreduce(MPI_IN_PLACE, n_active.data(), n_active.size(), MPI_UNSIGNED, MPI_SUM,
                  space->comm);
    std::vector<std::string> names;
    for (unsigned int i = 0; i < paired_interfaces().size(); ++i)
      if (n_active[i] == 0 && slides(i))
        names.push_back(paired_interfaces()[i].name);
    return names;
  }

  template <int dim>
  unsigned int Contact<dim>::n_active_multipliers() const
  {
    return multipliers().size() - released_multipliers().size();
  }

  template <int dim>
  std::vector<unsigned int> Contact<dim>::multipliers() const
  {
    std::vector<unsigned int> all;
    for (unsigned int row = 0; row < active.by_row.size() && model.mortar; ++row)
      if (unknowns[row] == Unknown::pressure || unknowns[row] == Unknown::traction)
        all.push_back(row);
    return all;
  }

  template <int dim>
  std::vector<unsigned int> Contact<dim>::released_multipliers() const
  {
    std::vector<unsigned int> released;
    for (const unsigned int row : multipliers())
      if (!active.by_row[row])
        released.push_back(row);
    return released;
  }

  template class Contact<2>;
  template class Contact<3>;
} // namespace squeal
