#include <squeal/contact/contact.h>
#include <squeal/contact/contact_matrices.h>

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
    if (space->geometry.has_stick())
      find_held_tractions();
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
  }

  template <int dim>
  void Contact<dim>::for_each_pair(
      const std::function<void(unsigned int interface, const Kinematics &)> &work,
      const bool with_slopes) const
  {
    const bool keeps = keeps_table && !with_slopes;
    if (keeps && cached.shapes && cached.shapes->angular_velocity == model.angular_velocity &&
        std::signbit(cached.shapes->angular_velocity) == std::signbit(model.angular_velocity))
    {
      for (const auto &[interface, shapes] : cached.shapes->pairs)
        work(interface, Kinematics(shapes));
      return;
    }
    auto table              = std::make_shared<TabulatedShapes>();
    table->angular_velocity = model.angular_velocity;
    for (unsigned int i = 0; i < paired_interfaces().size(); ++i)
    {
      unsigned int first_point = 0;
      for (const FacePair<dim> &pair : paired_interfaces()[i].pairs)
      {
        const auto shapes = std::make_shared<PairShapes<dim>>(
            element, paired_interfaces()[i].rotor_faces[pair.rotor_face],
            paired_interfaces()[i].pad_faces[pair.pad_face], pair, space->geometry,
            model.angular_velocity, slides(i) ? nullptr : &paired_interfaces()[i].along);
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
      cached.shapes = std::move(table);
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
          for (unsigned int m = 0; m < k.pad->nodes.size(); ++m)
            for (const FreeNode<dim> &node : k.pad->nodes[m])
              for (unsigned int direction = 1; direction < dim && node.equations[dim + 1] >= 0;
                   ++direction)
                for (unsigned int q = 0; q < k.n_points; ++q)
                {
                  const Tensor<1, dim> along = k.direction(direction, q);
                  const double w             = std::abs(node.weight * k.weights[q] * k.psi(m, q));
                  double *const sum          = &sums[2 * node.multiplier(direction)];
                  sum[0] += w;
                  for (unsigned int c = 0; c < dim; ++c)
                    if (node.equations[c] < 0)
                      sum[1] += w * along[c] * along[c];
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
    for (unsigned int a = 0; a < k.pad->nodes.size(); ++a)
      for (const FreeNode<dim> &node : k.pad->nodes[a])
        share += k.psi(a, q) * node.weight * is_active(node);
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
                   (model.mortar ? p[q] : p[q] - initial_gap(i, k.positions[q]));
          pressure[i].insert(pressure[i].end(), p.begin(), p.end());
        });
    return pressure;
  }

  template <int dim>
  ActiveSetChange Contact<dim>::update_active_set(const MultiVector &state, const bool only_one)
  {
    const std::vector<double> global = replicate(state);
    ActiveSetChange change;
    double size = 0; // of the displacements, for what counts as rounding
    for (unsigned int row = 0; row < space->rows.size; ++row)
      if (unknowns[row] == Unknown::displacement)
        size = std::max(size, std::abs(global[row]));

    if (model.mortar)
    {
      // Weighted gaps int psi_j ([[u]].n - g_0 - p/k_C), what the constraints of closed contacts
      // make zero: pressures of their neighbours reach open ones. And the weights' sizes int
      // |psi_j|.
      std::vector<double> gaps(2 * space->rows.size);
      for_each_pair(
          [&](const unsigned int i, const Kinematics &k)
          {
            std::vector<double> jump = k.at_points(k.n(), k.local_values(global));
            if (model.compliance > 0)
            {
              const std::vector<double> p = k.at_points(k.psi, k.local_multipliers(global));
              for (unsigned int q = 0; q < k.n_points; ++q)
                jump[q] -= model.compliance * scale * p[q];
            }
            for (unsigned int m = 0; m < k.pad->nodes.size(); ++m)
              for (const FreeNode<dim> &node : k.pad->nodes[m])
                if (node.equations[dim] >= 0)
                  for (unsigned int q = 0; q < k.n_points; ++q)
                  {
                    const double w = node.weight * k.weights[q] * k.psi(m, q);
                    gaps[2 * node.equations[dim]] += w * (jump[q] - initial_gap(i, k.positions[q]));
                    gaps[2 * node.equations[dim] + 1] += std::abs(w);
                  }
          });
      MPI_Allreduce(MPI_IN_PLACE, gaps.data(), gaps.size(), MPI_DOUBLE, MPI_SUM, space->comm);
      double largest_pressure = 0;
      for (unsigned int row = 0; row < space->rows.size; ++row)
        if (unknowns[row] == Unknown::pressure)
          largest_pressure = std::max(largest_pressure, std::abs(global[row]));
      std::vector<unsigned int> broken;
      for (unsigned int row = 0; row < space->rows.size; ++row)
        if (unknowns[row] == Unknown::pressure)
        {
          const double penetration = gaps[2 * row] / gaps[2 * row + 1];
          if (active.by_row[row])
            change.largest_tension = std::max(change.largest_tension, -scale * global[row]);
          else
            change.largest_penetration = std::max(change.largest_penetration, penetration);
          const bool now = active.by_row[row] ? global[row] >= -1e-12 * largest_pressure
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
    }
    else
    {
      for_each_pair(
          [&](const unsigned int i, const Kinematics &k)
          {
            const std::vector<double> jump = k.at_points(k.n(), k.local_values(global));
            for (unsigned int q = 0; q < k.n_points; ++q)
            {
              const double penetration = jump[q] - initial_gap(i, k.positions[q]);
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
    }
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

  template <int dim>
  bool Contact<dim>::is_cached(const CachedMatrix &cached, const std::vector<double> &constants,
                               const ContactPressure &coefficients) const
  {
    int is = cached.matrix && cached.constants == constants && cached.active == active &&
             cached.coefficients == coefficients;
    MPI_Allreduce(MPI_IN_PLACE, &is, 1, MPI_INT, MPI_MIN, space->comm);
    return is;
  }

  template class Contact<2>;
  template class Contact<3>;
} // namespace squeal
