#include <squeal/contact/contact.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace squeal
{
  using namespace dealii;

  template <int dim>
  void Contact<dim>::close()
  {
    std::fill(active.begin(), active.end(), true);
    for (std::vector<bool> &points : active_points)
      std::fill(points.begin(), points.end(), true);
  }

  template <int dim>
  typename Contact<dim>::ActiveSetChange Contact<dim>::update_active_set(const MultiVector &state)
  {
    const std::vector<double> global = replicate(state);
    ActiveSetChange change;
    double size = 0; // of the displacements, for what counts as rounding
    for (unsigned int row = 0; row < space->rows.size; ++row)
      if (!is_multiplier[row])
        size = std::max(size, std::abs(global[row]));

    if (model.mortar)
    {
      // Weighted gaps int psi_j ([[u]].n - g_0) and the weights' sizes int |psi_j|.
      std::vector<double> gaps(2 * space->rows.size);
      for_each_pair(
          [&](const unsigned int, const Kinematics &k)
          {
            const std::vector<double> jump = k.at_points(k.n(), k.local_values(global));
            for (unsigned int m = 0; m < k.pad->nodes.size(); ++m)
              for (const FreeNode<dim> &node : k.pad->nodes[m])
                if (node.equations[dim] >= 0)
                  for (unsigned int q = 0; q < k.n_points; ++q)
                  {
                    const double w = node.weight * k.weights[q] * k.psi(m, q);
                    gaps[2 * node.equations[dim]] += w * (jump[q] - gap(k.positions[q]));
                    gaps[2 * node.equations[dim] + 1] += std::abs(w);
                  }
          });
      MPI_Allreduce(MPI_IN_PLACE, gaps.data(), gaps.size(), MPI_DOUBLE, MPI_SUM, space->comm);
      double largest_pressure = 0;
      for (unsigned int row = 0; row < space->rows.size; ++row)
        if (is_multiplier[row])
          largest_pressure = std::max(largest_pressure, std::abs(global[row]));
      for (unsigned int row = 0; row < space->rows.size; ++row)
        if (is_multiplier[row])
        {
          const double penetration = gaps[2 * row] / gaps[2 * row + 1];
          if (active[row])
            change.largest_tension = std::max(change.largest_tension, -scale * global[row]);
          else
            change.largest_penetration = std::max(change.largest_penetration, penetration);
          const bool now =
              active[row] ? global[row] >= -1e-12 * largest_pressure : penetration > 1e-12 * size;
          change.n_changed += now != active[row];
          change.n_active += now;
          active[row] = now;
        }
    }
    else
    {
      for_each_pair(
          [&](const unsigned int i, const Kinematics &k)
          {
            const std::vector<double> jump = k.at_points(k.n(), k.local_values(global));
            for (unsigned int q = 0; q < k.n_points; ++q)
            {
              const double penetration = jump[q] - gap(k.positions[q]);
              const bool before        = active_points[i][k.first_point + q],
                         now           = penetration > -1e-12 * size;
              if (before)
                change.largest_tension =
                    std::max(change.largest_tension, -model.penalty_stiffness * penetration);
              else
                change.largest_penetration = std::max(change.largest_penetration, penetration);
              change.n_changed += now != before;
              change.n_active += now;
              active_points[i][k.first_point + q] = now;
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
        n_active[i] = std::count(active_points[i].begin(), active_points[i].end(), true);
    MPI_Allreduce(MPI_IN_PLACE, n_active.data(), n_active.size(), MPI_UNSIGNED, MPI_SUM,
                  space->comm);
    std::vector<std::string> names;
    for (unsigned int i = 0; i < paired_interfaces().size(); ++i)
      if (n_active[i] == 0)
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
    for (unsigned int row = 0; row < active.size() && model.mortar; ++row)
      if (is_multiplier[row])
        all.push_back(row);
    return all;
  }

  template <int dim>
  std::vector<unsigned int> Contact<dim>::released_multipliers() const
  {
    std::vector<unsigned int> released;
    for (const unsigned int row : multipliers())
      if (!active[row])
        released.push_back(row);
    return released;
  }

  template <int dim>
  std::size_t Contact<dim>::active_set_hash() const
  {
    std::size_t hash = std::hash<std::vector<bool>>()(active);
    for (const std::vector<bool> &points : active_points)
      hash = 31 * hash + std::hash<std::vector<bool>>()(points);
    return Utilities::MPI::sum(hash, space->comm);
  }

  template void Contact<2>::close();
  template Contact<2>::ActiveSetChange Contact<2>::update_active_set(const MultiVector &);
  template std::vector<std::string> Contact<2>::lost_contacts() const;
  template unsigned int Contact<2>::n_active_multipliers() const;
  template std::vector<unsigned int> Contact<2>::multipliers() const;
  template std::vector<unsigned int> Contact<2>::released_multipliers() const;
  template std::size_t Contact<2>::active_set_hash() const;
  template void Contact<3>::close();
  template Contact<3>::ActiveSetChange Contact<3>::update_active_set(const MultiVector &);
  template std::vector<std::string> Contact<3>::lost_contacts() const;
  template unsigned int Contact<3>::n_active_multipliers() const;
  template std::vector<unsigned int> Contact<3>::multipliers() const;
  template std::vector<unsigned int> Contact<3>::released_multipliers() const;
  template std::size_t Contact<3>::active_set_hash() const;
} // namespace squeal
