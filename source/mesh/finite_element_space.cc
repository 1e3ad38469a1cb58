#include <squeal/base/errors.h>
#include <squeal/mesh/coarse_mesh.h>
#include <squeal/mesh/element_cells.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/mpi.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_values.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <string>

// distribute() numbers the unknowns of a mesh: nodes, the constraints of those that hang or are
// periodic, as their owners know them (resolve()), the shapes of cells (shape_cells()), which
// components are fixed and which nodes are in contact, stick or are tied, then equations in the
// order that the header tells, first locally, then with the offset of the rank.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    using Node        = types::global_dof_index;
    using Constraints = AffineConstraints<double>;

    /// Nodes by the ranks that own them; own ones are left out.
    std::map<unsigned int, std::vector<Node>> by_owner(IndexSet set, const IndexSet &owned,
                                                       const MPI_Comm comm)
    {
      set.subtract_set(owned);
      const auto owners = Utilities::MPI::compute_index_owner(owned, set, comm);
      std::map<unsigned int, std::vector<Node>> result;
      unsigned int i = 0;
      for (const Node node : set)
        result[owners[i++]].push_back(node);
      return result;
    }

    /// The set of some nodes. Nodes that are added one by one, in no order, are moved too often.
    IndexSet index_set(std::vector<Node> nodes, const Node size)
    {
      std::sort(nodes.begin(), nodes.end());
      nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
      IndexSet set(size);
      set.add_indices(nodes.begin(), nodes.end());
      set.compress();
      return set;
    }

    /// The constraints of the relevant nodes, in terms of free nodes. A rank alone cannot know
    /// them: what a node hangs on may itself hang on (or be the periodic image of) a node of cells
    /// that the rank does not see. Each node's owner does see all faces of that node, so its line
    /// counts; lines are asked for until none refers to a node not asked for. Collective.
    Constraints resolve(const Constraints &seen, const IndexSet &owned, const IndexSet &relevant,
                        const MPI_Comm comm)
    {
      if (Utilities::MPI::n_mpi_processes(comm) == 1)
      {
        Constraints resolved(seen);
        resolved.close();
        return resolved;
      }
      using Line = std::vector<std::pair<Node, double>>;
      std::map<Node, Line> lines;
      IndexSet known = owned;
      std::vector<Node> parents;
      for (const Node node : owned)
        if (const auto *entries = seen.get_constraint_entries(node))
        {
          lines.emplace_hint(lines.end(), node, *entries);
          for (const auto &entry : *entries)
            parents.push_back(entry.first);
        }
      IndexSet wanted = index_set(std::move(parents), owned.size());
      wanted.add_indices(relevant);
      wanted.subtract_set(known);
      while (Utilities::MPI::max(wanted.n_elements(), comm) > 0)
      {
        std::map<unsigned int, std::vector<std::pair<Node, Line>>> answers;
        for (const auto &[rank, asked] :
             Utilities::MPI::some_to_some(comm, by_owner(wanted, owned, comm)))
          for (const Node node : asked)
            if (const auto *entries = seen.get_constraint_entries(node))
              answers[rank].emplace_back(node, *entries);
        known.add_indices(wanted);
        parents.clear();
        for (const auto &[rank, received] : Utilities::MPI::some_to_some(comm, answers))
          for (const auto &[node, line] : received)
          {
            lines[node] = line;
            for (const auto &entry : line)
              parents.push_back(entry.first);
          }
        wanted = index_set(std::move(parents), owned.size());
        wanted.subtract_set(known);
      }

      Constraints resolved(known);
      for (const auto &[node, line] : lines)
      {
        resolved.add_line(node);
        resolved.add_entries(node, line);
      }
      resolved.close();
      return resolved;
    }

    /// Interpolates the nodes of cells of divided elements from the elements' own ones, for
    /// functions of a degree. What a rank sees a part of alone, none of its nodes is on. With @p
    /// at_boundary only nodes of cells at the boundary get their interpolation, and others none:
    /// of a space for integrals over whole elements and over surfaces these are never asked for.
    void add_elements(const DoFHandler<3> &nodes, const OwnElements &own, const unsigned int degree,
                      const bool at_boundary, Constraints &lines)
    {
      ElementInterpolation interpolation(nodes.get_fe().get_unit_support_points(),
                                         nodes.get_fe().degree, degree);
      std::vector<Node> local(nodes.get_fe().n_dofs_per_cell());
      for (const ElementCells &element : group_by_elements(nodes, own))
      {
        const std::vector<Node> of_element = nodes_of_element(element, own, interpolation);
        if (std::find(of_element.begin(), of_element.end(), numbers::invalid_dof_index) !=
            of_element.end())
          continue;
        for (const auto &cell : element.cells)
        {
          if (at_boundary && !cell->at_boundary())
            continue;
          const ElementInterpolation::Table &table =
              interpolation.of(own.shapes[element.element], own.cells[cell->index()].between);
          cell->get_dof_indices(local);
          for (unsigned int a = 0; a < local.size(); ++a)
          {
            if (table.own[a] >= 0 || !lines.can_store_line(local[a]) ||
                lines.is_constrained(local[a]))
              continue;
            std::vector<std::pair<Node, double>> entries;
            for (unsigned int k = 0; k < of_element.size(); ++k)
              if (table.weights(a, k) != 0)
                entries.emplace_back(of_element[k], table.weights(a, k));
            lines.add_line(local[a]);
            lines.add_entries(local[a], entries);
          }
        }
      }
      for (const auto &cell : nodes.active_cell_iterators())
        if (at_boundary && !cell->is_artificial() && cell->level() == 0 && own.has(cell->index()))
        {
          const OwnElements::Cell &of_cell = own.cells[cell->index()];
          const ElementInterpolation::Table &table =
              interpolation.of(own.shapes[of_cell.element], of_cell.between);
          cell->get_dof_indices(local);
          for (unsigned int a = 0; a < local.size(); ++a)
            if (table.own[a] < 0 && lines.can_store_line(local[a]) &&
                !lines.is_constrained(local[a]))
              lines.add_line(local[a]);
        }
    }

    /// Nodes that share a matrix entry with an own node although no cell near here has them: the
    /// free nodes of other ranks' cells whose nodes hang on an own node. Collective.
    template <int dim>
    IndexSet coupled_nodes(const DoFHandler<dim> &nodes, const Constraints &constraints,
                           const MPI_Comm comm)
    {
      const IndexSet &owned = nodes.locally_owned_dofs();
      if (Utilities::MPI::n_mpi_processes(comm) == 1)
        return IndexSet(nodes.n_dofs());
      std::vector<Node> foreign; // free nodes of other ranks on own cells with constraints
      std::vector<std::vector<Node>> cells;
      std::vector<Node> cell_nodes(nodes.get_fe().n_dofs_per_cell());
      for (const auto &cell : nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          cell->get_dof_indices(cell_nodes);
          std::set<Node> free;
          bool constrained = false;
          for (const Node node : cell_nodes)
            if (const auto *entries = constraints.get_constraint_entries(node))
            {
              constrained = true;
              for (const auto &entry : *entries)
                free.insert(entry.first);
            }
            else
              free.insert(node);
          if (constrained)
          {
            std::copy_if(free.begin(), free.end(), std::back_inserter(foreign),
                         [&](const Node node) { return !owned.is_element(node); });
            cells.emplace_back(free.begin(), free.end());
          }
        }
      std::map<Node, unsigned int> owner;
      for (const auto &[rank, list] :
           by_owner(index_set(std::move(foreign), nodes.n_dofs()), owned, comm))
        for (const Node node : list)
          owner[node] = rank;
      std::map<unsigned int, std::set<Node>> sets;
      for (const std::vector<Node> &cell : cells)
        for (const Node node : cell)
          if (const auto rank = owner.find(node); rank != owner.end())
            sets[rank->second].insert(cell.begin(), cell.end());
      std::map<unsigned int, std::vector<Node>> to_send;
      for (const auto &[rank, set] : sets)
        to_send[rank].assign(set.begin(), set.end());
      std::vector<Node> coupled;
      for (const auto &[rank, list] : Utilities::MPI::some_to_some(comm, to_send))
        coupled.insert(coupled.end(), list.begin(), list.end());
      return index_set(std::move(coupled), nodes.n_dofs());
    }

    /// Which components of nodes are fixed, and which nodes carry a multiplier.
    struct BoundaryNodes
    {
      std::vector<IndexSet> fixed; ///< by component
      IndexSet in_contact, in_tie;
      IndexSet in_stick; ///< part of those in contact
    };

    /// Looks at ghost cells, too: the only face of a node on a boundary may belong to another rank.
    template <int dim>
    BoundaryNodes find_boundary_nodes(const DoFHandler<dim> &nodes, const Geometry<dim> &geometry,
                                      const bool with_multipliers)
    {
      std::vector<std::vector<Node>> fixed(dim);
      std::vector<Node> in_contact, in_tie, in_stick, of_face(nodes.get_fe().n_dofs_per_face());
      const auto add_to = [&](std::vector<Node> &list)
      { list.insert(list.end(), of_face.begin(), of_face.end()); };
      for (const auto &cell : nodes.active_cell_iterators())
        if (!cell->is_artificial())
          for (const unsigned int f : cell->face_indices())
            if (const auto face = cell->face(f); face->at_boundary())
            {
              face->get_dof_indices(of_face);
              for (const Support<dim> &support : geometry.supports)
                if (support.boundary == face->boundary_id())
                  for (unsigned int c = 0; c < dim; ++c)
                    if (support.fixed[c])
                      add_to(fixed[c]);
              if (with_multipliers)
                for (const ContactInterface &interface : geometry.interfaces)
                  if (interface.pad_face == face->boundary_id())
                  {
                    add_to(in_contact);
                    if (interface.kind == ContactKind::stick)
                      add_to(in_stick);
                  }
              for (const TiedSurfaces &tie : geometry.ties)
                if (tie.side == face->boundary_id())
                  add_to(in_tie);
            }
      const auto set_of = [&](std::vector<Node> &list)
      { return index_set(std::move(list), nodes.n_dofs()); };
      BoundaryNodes found{{}, set_of(in_contact), set_of(in_tie), set_of(in_stick)};
      for (std::vector<Node> &list : fixed)
        found.fixed.push_back(set_of(list));
      return found;
    }

    /// The rows of this rank, after those of the ranks before it. Collective.
    RowRange rows_of(const unsigned int n_local, const MPI_Comm comm)
    {
      RowRange rows;
      rows.comm  = comm;
      rows.size  = Utilities::MPI::sum(n_local, comm);
      rows.begin = 0;
      MPI_Exscan(&n_local, &rows.begin, 1, MPI_UNSIGNED, MPI_SUM, comm);
      if (Utilities::MPI::this_mpi_process(comm) == 0)
        rows.begin = 0;
      rows.end = rows.begin + n_local;
      return rows;
    }
  } // namespace

  template <int dim>
  FiniteElementSpace<dim>::FiniteElementSpace(const Geometry<dim> &geometry,
                                              const unsigned int degree,
                                              const bool with_multipliers, const MPI_Comm comm)
      : geometry(geometry), comm(comm), mesh(std::make_shared<Mesh>(comm)), triangulation(*mesh),
        fe(degree), mapping(degree), nodes(triangulation), with_multipliers(with_multipliers),
        multiplier_degree(1)
  {
    make_coarse_mesh(geometry, triangulation);
  }

  template <int dim>
  FiniteElementSpace<dim>::FiniteElementSpace(const FiniteElementSpace &other,
                                              const unsigned int degree)
      : geometry(other.geometry), comm(other.comm), mesh(other.mesh), triangulation(*mesh),
        fe(degree), mapping(degree), nodes(triangulation), coarser(&other),
        with_multipliers(other.with_multipliers),
        multiplier_degree(degree > other.fe.degree ? 2 : 1)
  {
  }

  template <int dim>
  void FiniteElementSpace<dim>::distribute()
  {
    nodes.distribute_dofs(fe);
    const IndexSet &owned = nodes.locally_owned_dofs();
    DoFTools::extract_locally_relevant_dofs(nodes, relevant_nodes);
    Constraints seen(relevant_nodes);
    DoFTools::make_hanging_node_constraints(nodes, seen);
    Constraints of_multipliers;
    if constexpr (dim == 3)
      if (!geometry.own.empty())
      {
        of_multipliers.copy_from(seen);
        add_elements(nodes, geometry.own, multiplier_degree, is_enriched(), of_multipliers);
        add_elements(nodes, geometry.own, fe.degree, is_enriched(), seen);
      }
    hanging = resolve(seen, owned, relevant_nodes, comm);
    shape_cells(hanging);
    if (geometry.is_periodic())
      DoFTools::make_periodicity_constraints(nodes, geometry.periodic.first,
                                             geometry.periodic.second, 0, seen);
    // One rank alone knows all from the beginning.
    if (geometry.is_periodic() || Utilities::MPI::n_mpi_processes(comm) > 1)
    {
      relevant_nodes.add_indices(
          coupled_nodes(nodes, resolve(seen, owned, relevant_nodes, comm), comm));
      hanging = resolve(seen, owned, relevant_nodes, comm);
    }
    relevant_nodes = hanging.get_local_lines();
    if (!geometry.own.empty())
      multiplier_lines = resolve(of_multipliers, owned, relevant_nodes, comm);
    const Constraints &lines = lines_of(dim);

    const auto [fixed, in_contact, in_tie, in_stick] =
        find_boundary_nodes(nodes, geometry, with_multipliers);

    // Local numbers first, then the offset of this rank.
    equations.assign(dim + 1 + has_ties() + geometry.has_stick(),
                     NodeVector(owned, relevant_nodes, comm));
    unsigned int n_local = 0;
    for (NodeVector &vector : equations)
      vector = -1;
    for (const auto node : owned)
      if (!hanging.is_constrained(node))
        for (unsigned int c = 0; c < dim; ++c)
          if (!fixed[c].is_element(node))
            equations[c](node) = n_local++;
    // Rows that belong to no node are the first rank's; here they still count from zero.
    const bool is_first = Utilities::MPI::this_mpi_process(comm) == 0;
    first_point         = n_local;
    if (is_first)
      n_local = superelement(geometry.superelements.size());
    const unsigned int n_local_displacements = n_local;
    for (const auto node : owned)
      if (in_contact.is_element(node) && !lines.is_constrained(node))
      {
        equations[dim](node) = n_local++;
        if (in_stick.is_element(node))
        {
          equations.back()(node) = n_local;
          n_local += dim - 1;
        }
      }
    const unsigned int n_local_multipliers = n_local - n_local_displacements;
    for (const auto node : owned)
      if (in_tie.is_element(node) && !lines.is_constrained(node))
      {
        equations[dim + 1](node) = n_local;
        n_local += dim;
      }

    const unsigned int n_local_ties = n_local - n_local_displacements - n_local_multipliers;
    first_point_multiplier          = n_local;
    if (is_first)
      n_local = superelement_multiplier(geometry.superelements.size());
    // The first rank's rows begin at zero.
    first_point            = Utilities::MPI::broadcast(comm, first_point);
    first_point_multiplier = Utilities::MPI::broadcast(comm, first_point_multiplier);

    rows                   = rows_of(n_local, comm);
    n_displacements        = Utilities::MPI::sum(n_local_displacements, comm);
    n_multipliers          = Utilities::MPI::sum(n_local_multipliers, comm);
    n_ties                 = Utilities::MPI::sum(n_local_ties, comm);
    first_local_multiplier = rows.begin + n_local_displacements;
    first_local_tie        = first_local_multiplier + n_local_multipliers;

    for (NodeVector &vector : equations)
    {
      for (const auto node : owned)
        if (vector(node) >= 0)
          vector(node) += rows.begin;
      vector.update_ghost_values();
    }
  }

  template <int dim>
  unsigned int FiniteElementSpace<dim>::superelement(const unsigned int number) const
  {
    unsigned int row = first_point + 6 * geometry.point_joints.points.size();
    for (unsigned int k = 0; k < number; ++k)
      row += geometry.superelements[k].size();
    return row;
  }

  template <int dim>
  unsigned int FiniteElementSpace<dim>::superelement_multiplier(const unsigned int number) const
  {
    unsigned int row = first_point_multiplier + 6 * (geometry.point_joints.points.size() +
                                                     geometry.point_joints.links.size());
    for (unsigned int k = 0; k < number; ++k)
      row += 3 * geometry.superelements[k].n_held();
    return row;
  }

  template <int dim>
  void FiniteElementSpace<dim>::shape_elements_as_before()
  {
    if constexpr (dim == 3)
    {
      const OwnElements &own = geometry.own;
      if (own.empty())
        return;
      ElementInterpolation interpolation              = interpolation_of(*this, 0),
                           before                     = interpolation_of(*coarser, 0);
      const std::vector<ElementCells> elements        = group_by_elements(nodes, own),
                                      elements_before = group_by_elements(coarser->nodes, own);
      for (unsigned int e = 0; e < elements.size(); ++e)
      {
        const ElementShape shape      = own.shapes[elements[e].element];
        const std::vector<Node> here  = nodes_of_element(elements[e], own, interpolation),
                                there = nodes_of_element(elements_before[e], own, before);
        if (std::count(there.begin(), there.end(), numbers::invalid_dof_index) > 0)
          continue; // of ranks around
        const DenseMatrix functions =
            before.nodal_functions(shape, interpolation.own_places(shape));
        for (unsigned int a = 0; a < here.size(); ++a)
          if (nodes.locally_owned_dofs().is_element(here[a]))
          {
            Point<3> x;
            for (unsigned int b = 0; b < there.size(); ++b)
              x += functions(a, b) * coarser->position(there[b]);
            for (unsigned int c = 0; c < dim; ++c)
              positions[c](here[a]) = x[c];
          }
      }
    }
  }

  template <int dim>
  void FiniteElementSpace<dim>::shape_cells(const Constraints &constraints)
  {
    const MappingQ<dim> on_manifold(fe.degree);
    if (Utilities::MPI::max(constraints.n_constraints(), comm) == 0)
    {
      mapping.initialize(on_manifold, triangulation);
      return;
    }
    FEValues<dim> points(on_manifold, fe, Quadrature<dim>(fe.get_unit_support_points()),
                         update_quadrature_points);
    positions.assign(dim,
                     NodeVector(nodes.locally_owned_dofs(), constraints.get_local_lines(), comm));
    std::vector<Node> cell_nodes(fe.n_dofs_per_cell());
    for (const auto &cell : nodes.active_cell_iterators())
      if (cell->is_locally_owned())
      {
        points.reinit(cell);
        cell->get_dof_indices(cell_nodes);
        for (unsigned int a = 0; a < cell_nodes.size(); ++a)
          if (nodes.locally_owned_dofs().is_element(cell_nodes[a]))
            for (unsigned int c = 0; c < dim; ++c)
              positions[c](cell_nodes[a]) = points.quadrature_point(a)[c];
      }
    if (is_enriched())
      shape_elements_as_before();
    for (NodeVector &position : positions)
    {
      constraints.distribute(position);
      position.update_ghost_values();
    }
    mapping.initialize(triangulation,
                       [&](const typename Triangulation<dim>::cell_iterator &cell)
                       {
                         if (!cell->is_active() || cell->is_artificial())
                         {
                           points.reinit(cell);
                           return points.get_quadrature_points();
                         }
                         const typename DoFHandler<dim>::active_cell_iterator with_nodes(
                             &triangulation, cell->level(), cell->index(), &nodes);
                         with_nodes->get_dof_indices(cell_nodes);
                         std::vector<Point<dim>> result(cell_nodes.size());
                         for (unsigned int a = 0; a < cell_nodes.size(); ++a)
                           for (unsigned int c = 0; c < dim; ++c)
                             result[a][c] = positions[c](cell_nodes[a]);
                         return result;
                       });

    // A hanging node that moves off its arc by more than the thickness of its cell.
    FEValues<dim> shapes(mapping, fe, points.get_quadrature(), update_jacobians);
    unsigned int n_inverted = 0;
    for (const auto &cell : nodes.active_cell_iterators())
      if (cell->is_locally_owned() && !(cell->level() == 0 && geometry.own.has(cell->index())))
      {
        shapes.reinit(cell);
        double smallest = std::numeric_limits<double>::infinity();
        for (const unsigned int q : shapes.quadrature_point_indices())
          smallest = std::min(smallest, determinant(Tensor<2, dim>(shapes.jacobian(q))));
        n_inverted += smallest <= 0;
      }
    n_inverted = Utilities::MPI::sum(n_inverted, comm);
    if (geometry.own.empty())
      positions.clear();
    if (n_inverted > 0)
      throw SolverError("Hanging nodes on curved faces turn " + std::to_string(n_inverted) +
                        " thin cells inside out: use a higher degree or more cells around.");
  }

  namespace
  {
    std::vector<WeightedNode> expand_by(const Constraints &lines, const Node node)
    {
      if (!lines.is_constrained(node))
        return {{node, 1.}};
      std::vector<WeightedNode> result;
      for (const auto &[parent, weight] : *lines.get_constraint_entries(node))
        result.push_back({parent, weight});
      return result;
    }
  } // namespace

  template <int dim>
  std::vector<WeightedNode> FiniteElementSpace<dim>::expand(const Node node) const
  {
    return expand_by(hanging, node);
  }

  template <int dim>
  bool FiniteElementSpace<dim>::moves(const Node node, const unsigned int component) const
  {
    const std::vector<WeightedNode> parents = expand(node);
    return std::any_of(parents.begin(), parents.end(),
                       [&](const WeightedNode &parent)
                       { return equation(parent.node, component) != none; });
  }

  template <int dim>
  std::vector<WeightedNode> FiniteElementSpace<dim>::expand_multiplier(const Node node) const
  {
    return expand_by(lines_of(dim), node);
  }

  template class FiniteElementSpace<2>;
  template class FiniteElementSpace<3>;
} // namespace squeal
