#include <squeal/mesh/element_cells.h>

#include <algorithm>

namespace squeal
{
  using namespace dealii;

  std::vector<ElementCells> group_by_elements(const DoFHandler<3> &nodes, const OwnElements &own)
  {
    using Cell = DoFHandler<3>::active_cell_iterator;
    std::vector<std::pair<unsigned int, Cell>> cells;
    for (const auto &cell : nodes.active_cell_iterators())
      if (!cell->is_artificial() && cell->level() == 0 && own.has(cell->index()))
        cells.emplace_back(own.cells[cell->index()].element, cell);
    std::stable_sort(cells.begin(), cells.end(),
                     [](const auto &a, const auto &b) { return a.first < b.first; });
    std::vector<ElementCells> result;
    for (const auto &[element, cell] : cells)
    {
      if (result.empty() || result.back().element != element)
        result.push_back({element, {}});
      result.back().cells.push_back(cell);
    }
    return result;
  }

  std::vector<types::global_dof_index> nodes_of_element(const ElementCells &element,
                                                        const OwnElements &own,
                                                        ElementInterpolation &interpolation)
  {
    std::vector<types::global_dof_index> result, local;
    for (const auto &cell : element.cells)
    {
      const ElementInterpolation::Table &table =
          interpolation.of(own.shapes[element.element], own.cells[cell->index()].between);
      local.resize(table.own.size());
      cell->get_dof_indices(local);
      result.resize(table.own_places.size(), numbers::invalid_dof_index);
      for (unsigned int a = 0; a < local.size(); ++a)
        if (table.own[a] >= 0)
          result[table.own[a]] = local[a];
    }
    return result;
  }
} // namespace squeal
