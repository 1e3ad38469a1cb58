#include <squeal/assessment/tables.h>
#include <squeal/mesh/cell_map.h>
#include <squeal/run/refinement.h>

#include <deal.II/distributed/grid_refinement.h>
#include <deal.II/lac/vector.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace squeal
{
  using namespace dealii;

  std::vector<double> refinement_indicators(const std::vector<ModeRow> &rows,
                                            const EigenvalueErrors &errors, const double tolerance)
  {
    std::vector<double> weights;
    bool is_open = false;
    for (unsigned int j = 0; j < rows.size(); ++j)
    {
      const double size = std::abs(rows[j].lambda), allowed = tolerance * size;
      double weight = 0;
      if (tolerance > 0)
        weight = std::hypot(errors.bounds.growth_rate[j], errors.bounds.imaginary[j]) > allowed
                     ? 1 / allowed
                     : 0;
      else if (rows[j].verdict == Verdict::undecided)
        weight = 1 / std::max(std::abs(rows[j].lambda.real()), 1e-6 * size);
      weights.push_back(weight);
      is_open |= weight > 0;
    }
    std::vector<double> result;
    for (const auto &parts : errors.cells)
    {
      double sum = 0;
      for (unsigned int j = 0; j < rows.size(); ++j)
        sum += weights[j] * std::abs(parts[j]);
      if (is_open)
        result.push_back(sum);
    }
    return result;
  }

  template <int dim>
  std::vector<double> cells_at_contact_edge(const Contact<dim> &contact)
  {
    const FiniteElementSpace<dim> &spaces = contact.spaces();
    const unsigned int n_nodes            = spaces.fe.n_dofs_per_cell();
    const CellMap<dim> map(spaces);
    std::vector<Column> closed = map.zeros(1);
    for (const unsigned int row : contact.multipliers())
      if (spaces.rows.contains(row))
        closed[0].local_element(row - spaces.rows.begin) = contact.is_closed(row);
    closed[0].update_ghost_values();
    std::vector<double> result;
    for (const auto &entries : map.cells)
    {
      bool has_closed = false, has_open = false;
      for (const auto &entry : entries)
        if (entry.unknown / n_nodes == dim)
          (closed[0].local_element(entry.index) > 0 ? has_closed : has_open) = true;
      result.push_back(has_closed && has_open);
    }
    const double largest = result.empty() ? 0 : *std::max_element(result.begin(), result.end());
    if (Utilities::MPI::max(largest, spaces.comm) == 0)
      result.clear();
    return result;
  }

  template <int dim>
  void flag_cells(Mesh<dim> &mesh, const std::vector<double> &by_cell)
  {
    constexpr double bulk = 0.7;
    dealii::Vector<float> criteria(mesh.n_active_cells());
    unsigned int number = 0;
    for (const auto &cell : mesh.active_cell_iterators())
      if (cell->is_locally_owned())
        criteria(cell->active_cell_index()) = by_cell[number++];
    parallel::distributed::GridRefinement::refine_and_coarsen_fixed_fraction(mesh, criteria, bulk,
                                                                             0.);
  }

  template <int dim>
  double growth_by_flags(const Mesh<dim> &mesh)
  {
    unsigned int n_flagged = 0;
    for (const auto &cell : mesh.active_cell_iterators())
      n_flagged += cell->is_locally_owned() && cell->refine_flag_set();
    n_flagged            = Utilities::MPI::sum(n_flagged, mesh.get_communicator());
    const double n_cells = mesh.n_global_active_cells();
    return 1 + (std::pow(2., dim) - 1) * n_flagged / n_cells;
  }

  template <int dim>
  CellNames divide(Mesh<dim> &mesh)
  {
    CellNames own, all;
    for (const auto &cell : mesh.active_cell_iterators())
      if (cell->is_locally_owned() && cell->refine_flag_set())
        own.push_back(cell->id().template to_binary<dim>());
    for (const CellNames &of_rank : Utilities::MPI::all_gather(mesh.get_communicator(), own))
      all.insert(all.end(), of_rank.begin(), of_rank.end());
    mesh.execute_coarsening_and_refinement();
    return all;
  }

  template <int dim>
  void divide_again(Mesh<dim> &mesh, const CellNames &names)
  {
    if (names.empty())
      return;
    const std::set<CellId::binary_type> divided(names.begin(), names.end());
    for (const auto &cell : mesh.active_cell_iterators())
      if (cell->is_locally_owned() && divided.count(cell->id().template to_binary<dim>()) > 0)
        cell->set_refine_flag();
    mesh.execute_coarsening_and_refinement();
  }

  template std::vector<double> cells_at_contact_edge(const Contact<2> &);
  template std::vector<double> cells_at_contact_edge(const Contact<3> &);
  template void flag_cells(Mesh<2> &, const std::vector<double> &);
  template void flag_cells(Mesh<3> &, const std::vector<double> &);
  template double growth_by_flags(const Mesh<2> &);
  template double growth_by_flags(const Mesh<3> &);
  template CellNames divide(Mesh<2> &);
  template CellNames divide(Mesh<3> &);
  template void divide_again(Mesh<2> &, const CellNames &);
  template void divide_again(Mesh<3> &, const CellNames &);

  double RefinementBudget::predict(double Mesh::*value, const double n_unknowns,
                                   const double first_exponent) const
  {
    const Mesh &last = meshes.back();
    double exponent  = first_exponent;
    if (meshes.size() > 1)
    {
      const Mesh &before = meshes[meshes.size() - 2];
      if (last.n_unknowns > before.n_unknowns && before.*value > 0)
        exponent =
            std::log(last.*value / before.*value) / std::log(last.n_unknowns / before.n_unknowns);
    }
    return last.*value * std::pow(n_unknowns / last.n_unknowns, std::clamp(exponent, 1., 2.));
  }

  std::string RefinementBudget::objection(const double n_unknowns) const
  {
    const std::string start =
        "No further mesh: it would have about " + number(std::round(n_unknowns)) + " unknowns";
    if (n_unknowns > limits.maximum_unknowns)
      return start + ", more than Refinement/Maximum unknowns = " +
             std::to_string(limits.maximum_unknowns) + ".";
    if (meshes.empty())
      return "";
    if (limits.maximum_time > 0)
    {
      double so_far = 0;
      for (const Mesh &mesh : meshes)
        so_far += mesh.seconds;
      const double time = so_far + predict(&Mesh::seconds, n_unknowns, 1.5);
      if (time > limits.maximum_time)
        return start + " and end about " + number(time, 3) +
               " s after the start of the run, later than Refinement/Maximum time = " +
               number(limits.maximum_time) + " s.";
    }
    const double memory = predict(&Mesh::memory, n_unknowns, 4. / 3);
    if (limits.maximum_memory > 0 && memory > limits.maximum_memory)
      return start + " and need about " + number(memory, 3) +
             " GiB, more than Refinement/Maximum memory = " + number(limits.maximum_memory) +
             " GiB.";
    return "";
  }
} // namespace squeal
