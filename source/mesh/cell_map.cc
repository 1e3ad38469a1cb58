#include <squeal/mesh/cell_map.h>
#include <squeal/mesh/element_cells.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// The elements of which this rank has a cell; the indices are equations.
    std::vector<CellMap<3>::Element> find_elements(const FiniteElementSpace<3> &spaces)
    {
      std::vector<CellMap<3>::Element> result;
      const OwnElements &own = spaces.geometry.own;
      if (own.empty())
        return result;
      std::vector<unsigned int> numbers(own.cells.size(), OwnElements::none);
      unsigned int number = 0;
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          if (cell->level() == 0)
            numbers[cell->index()] = number;
          ++number;
        }
      ElementInterpolation of_displacements = interpolation_of(spaces, 0),
                           of_multipliers   = interpolation_of(spaces, 3);
      for (ElementCells &cells : group_by_elements(spaces.nodes, own))
      {
        if (std::none_of(cells.cells.begin(), cells.cells.end(),
                         [](const auto &cell) { return cell->is_locally_owned(); }))
          continue;
        const auto first = first_cell(cells);
        CellMap<3>::Element element{cells,
                                    own.shapes[cells.element],
                                    first->is_locally_owned(),
                                    numbers[first->index()],
                                    nodes_of_element(cells, own, of_displacements),
                                    {}};
        const auto add = [&](const unsigned int begin, const unsigned int end, const auto &nodes)
        {
          for (unsigned int k = 0; k < nodes.size(); ++k)
            for (unsigned int c = begin; c < end; ++c)
              if (const unsigned int equation = spaces.field_equation(nodes[k], c);
                  equation != FiniteElementSpace<3>::none)
                element.unknowns.push_back({c, k, equation});
        };
        add(0, 3, element.nodes);
        if (spaces.n_multipliers + spaces.n_ties > 0)
          add(3, spaces.n_fields(), nodes_of_element(cells, own, of_multipliers));
        result.push_back(std::move(element));
      }
      return result;
    }
  } // namespace

  template <int dim>
  CellMap<dim>::CellMap(const FiniteElementSpace<dim> &spaces) : rows(spaces.rows)
  {
    const unsigned int n = spaces.fe.n_dofs_per_cell();
    IndexSet owned(rows.size), seen(rows.size);
    owned.add_range(rows.begin, rows.end);
    std::vector<types::global_dof_index> foreign, nodes(n);
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned())
      {
        std::vector<Entry> entries;
        is_part.push_back(cell->level() == 0 && spaces.geometry.own.has(cell->index()));
        if (is_part.back())
        {
          cells.push_back(std::move(entries));
          continue;
        }
        cell->get_dof_indices(nodes);
        for (unsigned int a = 0; a < n; ++a)
        {
          const auto add = [&](const unsigned int first, const unsigned int end,
                               const std::vector<WeightedNode> &expansion)
          {
            const bool direct = !spaces.lines_of(first).is_constrained(nodes[a]);
            for (const WeightedNode &w : expansion)
              for (unsigned int c = first; c < end; ++c)
              {
                const unsigned int equation = spaces.field_equation(w.node, c);
                if (equation == FiniteElementSpace<dim>::none)
                  continue;
                if (!rows.contains(equation))
                  foreign.push_back(equation);
                entries.push_back({c * n + a, equation, w.weight, direct});
              }
          };
          add(0, dim, spaces.expand(nodes[a]));
          add(dim, spaces.n_fields(), spaces.expand_multiplier(nodes[a]));
        }
        cells.push_back(std::move(entries));
      }
    if constexpr (dim == 3)
      elements = find_elements(spaces);
    for (const Element &element : elements)
      for (const auto &unknown : element.unknowns)
        if (!rows.contains(unknown.index))
          foreign.push_back(unknown.index);
    std::sort(foreign.begin(), foreign.end());
    seen.add_indices(foreign.begin(), std::unique(foreign.begin(), foreign.end()));
    partitioner = std::make_shared<Utilities::MPI::Partitioner>(owned, seen, rows.comm);
    for (std::vector<Entry> &entries : cells)
      for (Entry &entry : entries)
        entry.index = partitioner->global_to_local(entry.index);
    for (Element &element : elements)
      for (auto &unknown : element.unknowns)
        unknown.index = partitioner->global_to_local(unknown.index);
  }

  template <int dim>
  std::vector<Column> CellMap<dim>::zeros(const unsigned int n_columns) const
  {
    return std::vector<Column>(n_columns, Column(partitioner));
  }

  template <int dim>
  std::vector<Column> CellMap<dim>::import(const MultiVector &block) const
  {
    std::vector<Column> columns = zeros(block.n_columns());
    for (unsigned int j = 0; j < block.n_columns(); ++j)
    {
      std::copy_n(block.column(j), block.n_local(), columns[j].begin());
      columns[j].update_ghost_values();
    }
    return columns;
  }

  template <int dim>
  void CellMap<dim>::gather(const unsigned int cell, const std::vector<Column> &from,
                            DenseMatrix &to) const
  {
    std::fill(to.values.begin(), to.values.end(), 0.);
    for (unsigned int j = 0; j < from.size(); ++j)
      for (const Entry &entry : cells[cell])
        to(entry.unknown, j) += entry.weight * from[j].local_element(entry.index);
  }

  template <int dim>
  DenseMatrix CellMap<dim>::gather(const Element &element, const unsigned int n_nodes,
                                   const unsigned int first_field, const unsigned int end_field,
                                   const std::vector<Column> &from) const
  {
    const unsigned int n_fields = end_field - first_field;
    DenseMatrix result(n_nodes, n_fields * from.size());
    for (const auto &unknown : element.unknowns)
      if (unknown.field >= first_field && unknown.field < end_field)
        for (unsigned int j = 0; j < from.size(); ++j)
          result(unknown.node, j * n_fields + unknown.field - first_field) =
              from[j].local_element(unknown.index);
    return result;
  }

  template <int dim>
  DenseMatrix hierarchical_complement(const FiniteElement<dim> &fe)
  {
    const unsigned int p_plus = fe.degree, n_1d = p_plus + 1;
    const auto value = [&](const unsigned int k, const double x)
    {
      if (k < 2)
        return k == 0 ? 1 - x : x;
      // L_k - L_{k-2} vanishes at both ends
      return std::legendre(k, 2 * x - 1) - std::legendre(k - 2, 2 * x - 1);
    };
    const std::vector<Point<dim>> &points = fe.get_unit_support_points();
    std::vector<double> values;
    unsigned int n_functions = 0;
    for (unsigned int m = 0; m < Utilities::pow(n_1d, dim); ++m)
    {
      std::array<unsigned int, dim> factors;
      bool added = false;
      for (unsigned int d = 0, rest = m; d < dim; ++d, rest /= n_1d)
      {
        factors[d] = rest % n_1d;
        added |= factors[d] == p_plus;
      }
      if (!added)
        continue;
      ++n_functions;
      for (const Point<dim> &x : points)
      {
        double product = 1;
        for (unsigned int d = 0; d < dim; ++d)
          product *= value(factors[d], x[d]);
        values.push_back(std::abs(product) > 1e-12 ? product : 0.);
      }
    }
    return {fe.n_dofs_per_cell(), n_functions, std::move(values)};
  }

  template <int dim>
  DenseMatrix interpolation(const FiniteElement<dim> &from, const FiniteElement<dim> &to)
  {
    DenseMatrix matrix(to.n_dofs_per_cell(), from.n_dofs_per_cell());
    for (unsigned int a = 0; a < matrix.n_rows; ++a)
      for (unsigned int b = 0; b < matrix.n_columns; ++b)
        matrix(a, b) = from.shape_value(b, to.get_unit_support_points()[a]);
    return matrix;
  }

  template class CellMap<2>;
  template class CellMap<3>;
  template DenseMatrix interpolation<2>(const FiniteElement<2> &, const FiniteElement<2> &);
  template DenseMatrix interpolation<3>(const FiniteElement<3> &, const FiniteElement<3> &);
  template DenseMatrix hierarchical_complement<2>(const FiniteElement<2> &);
  template DenseMatrix hierarchical_complement<3>(const FiniteElement<3> &);
} // namespace squeal
