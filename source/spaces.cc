#include <squeal/spaces.h>

#include <deal.II/dofs/dof_tools.h>

namespace squeal
{
  using namespace dealii;

  template <int dim>
  Spaces<dim>::Spaces(const Geometry<dim> &geometry, const unsigned int degree,
                      const bool with_multipliers, const MPI_Comm comm)
      : geometry(geometry), comm(comm), triangulation(comm), fe(degree), mapping(degree),
        nodes(triangulation), with_multipliers(with_multipliers)
  {
    geometry.make_coarse_mesh(triangulation);
  }

  template <int dim>
  void Spaces<dim>::distribute()
  {
    mapping.initialize(MappingQ<dim>(fe.degree), triangulation);
    nodes.distribute_dofs(fe);
    DoFTools::extract_locally_relevant_dofs(nodes, relevant_nodes);
    hanging.clear();
    hanging.reinit(relevant_nodes);
    DoFTools::make_hanging_node_constraints(nodes, hanging);
    if (geometry.is_periodic())
      DoFTools::make_periodicity_constraints(nodes, geometry.periodic.first,
                                             geometry.periodic.second, 0, hanging);
    hanging.close();
    // The nodes that others hang on may belong to cells beyond the ghost layer (chains of
    // constraints).
    for (const auto &line : hanging.get_lines())
      for (const auto &[node, weight] : line.entries)
        if (!relevant_nodes.is_element(node))
          relevant_nodes.add_index(node);
    relevant_nodes.compress();

    // Which components are fixed, and which nodes carry a multiplier. Ghost cells are looked at
    // too: the only face of a node on a boundary may belong to another rank.
    std::vector<IndexSet> fixed(dim, IndexSet(nodes.n_dofs()));
    IndexSet in_contact(nodes.n_dofs());
    std::vector<types::global_dof_index> face_nodes(fe.n_dofs_per_face());
    for (const auto &cell : nodes.active_cell_iterators())
      if (!cell->is_artificial())
        for (const unsigned int f : cell->face_indices())
          if (cell->face(f)->at_boundary())
          {
            cell->face(f)->get_dof_indices(face_nodes);
            for (const Support<dim> &support : geometry.supports)
              if (support.boundary == cell->face(f)->boundary_id())
                for (unsigned int c = 0; c < dim; ++c)
                  if (support.fixed[c])
                    fixed[c].add_indices(face_nodes.begin(), face_nodes.end());
            if (with_multipliers)
              for (const ContactInterface &interface : geometry.interfaces)
                if (interface.pad_face == cell->face(f)->boundary_id())
                  in_contact.add_indices(face_nodes.begin(), face_nodes.end());
          }
    in_contact.compress();
    for (IndexSet &set : fixed)
      set.compress();

    // Local numbers first, then the offset of this rank.
    const IndexSet &owned = nodes.locally_owned_dofs();
    equations.assign(dim + 1, NodeVector(owned, relevant_nodes, comm));
    unsigned int n_local = 0, n_local_displacements = 0;
    for (NodeVector &vector : equations)
      vector = -1;
    for (const auto node : owned)
      if (!hanging.is_constrained(node))
        for (unsigned int c = 0; c < dim; ++c)
          if (!fixed[c].is_element(node))
            equations[c](node) = n_local++;
    n_local_displacements = n_local;
    for (const auto node : owned)
      if (in_contact.is_element(node) && !hanging.is_constrained(node))
        equations[dim](node) = n_local++;

    rows.comm  = comm;
    rows.size  = Utilities::MPI::sum(n_local, comm);
    rows.begin = 0;
    MPI_Exscan(&n_local, &rows.begin, 1, MPI_UNSIGNED, MPI_SUM, comm);
    if (Utilities::MPI::this_mpi_process(comm) == 0)
      rows.begin = 0;
    rows.end               = rows.begin + n_local;
    n_displacements        = Utilities::MPI::sum(n_local_displacements, comm);
    n_multipliers          = rows.size - n_displacements;
    first_local_multiplier = rows.begin + n_local_displacements;

    for (NodeVector &vector : equations)
    {
      for (const auto node : owned)
        if (vector(node) >= 0)
          vector(node) += rows.begin;
      vector.update_ghost_values();
    }
  }

  template <int dim>
  std::vector<WeightedNode> Spaces<dim>::expand(const types::global_dof_index node) const
  {
    if (!hanging.is_constrained(node))
      return {{node, 1.}};
    std::vector<WeightedNode> result;
    for (const auto &[parent, weight] : *hanging.get_constraint_entries(node))
      result.push_back({parent, weight});
    return result;
  }

  template class Spaces<2>;
  template class Spaces<3>;
} // namespace squeal
