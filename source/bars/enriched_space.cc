#include <squeal/bars/enriched_space.h>

#include <algorithm>

namespace squeal
{
  namespace
  {
    template <int dim>
    const FiniteElementSpace<dim> &distributed(FiniteElementSpace<dim> &space)
    {
      space.distribute();
      return space;
    }
  } // namespace

  template <int dim>
  EnrichedSpace<dim>::EnrichedSpace(const FiniteElementSpace<dim> &base)
      : base(base), fine(base, base.fe.degree + 1), n(fine.fe.n_dofs_per_cell()),
        n_fields(base.n_fields()), base_map(base), map(distributed(fine)),
        lift(interpolation(base.fe, fine.fe))
  {
    if constexpr (dim == 3)
      for (const auto &element : map.elements)
        for (const bool of_multipliers : {false, true})
          if (DenseMatrix &matrix = element_lifts[{element.shape, of_multipliers}];
              matrix.values.empty())
          {
            const unsigned int field = of_multipliers ? dim : 0;
            const std::vector<dealii::Point<3>> places =
                interpolation_of(fine, field).own_places(element.shape);
            const DenseMatrix all =
                interpolation_of(base, field).nodal_functions(element.shape, places);
            matrix = DenseMatrix(places.size(), all.n_columns); // without derivatives
            for (unsigned int b = 0; b < matrix.n_columns; ++b)
              for (unsigned int a = 0; a < matrix.n_rows; ++a)
                matrix(a, b) = all(a, b);
          }
  }

  template <int dim>
  void EnrichedSpace<dim>::lift_elements(const std::vector<Column> &columns,
                                         MultiVector &result) const
  {
    for (unsigned int e = 0; e < map.elements.size(); ++e)
      for (const bool of_multipliers : {false, true})
      {
        const DenseMatrix &matrix = element_lift(map.elements[e].shape, of_multipliers);
        const unsigned int first = of_multipliers ? dim : 0, end = of_multipliers ? n_fields : dim,
                           n_each = end - first;
        if (of_multipliers && map.elements[e].unknowns.back().field < dim)
          continue; // inside of a body
        const DenseMatrix fine_values =
            matrix * base_map.gather(base_map.elements[e], matrix.n_columns, first, end, columns);
        for (const auto &unknown : map.elements[e].unknowns)
          if (unknown.field >= first && unknown.field < end && unknown.index < result.n_local())
            for (unsigned int j = 0; j < columns.size(); ++j)
              result.column(j)[unknown.index] =
                  fine_values(unknown.node, j * n_each + unknown.field - first);
      }
  }

  template <int dim>
  void EnrichedSpace<dim>::lift_cell(const unsigned int number, const std::vector<Column> &columns,
                                     DenseMatrix &coarse, MultiVector &result) const
  {
    const unsigned int n_base = base.fe.n_dofs_per_cell(), n_columns = columns.size(),
                       n_others = n_fields - dim;
    if (coarse.n_columns != n_fields * n_columns)
      coarse = DenseMatrix(n_base, n_fields * n_columns);
    // The displacements of all columns come first.
    const auto place = [&](const unsigned int field, const unsigned int column) {
      return field < dim ? column * dim + field : dim * n_columns + column * n_others + field - dim;
    };
    std::fill(coarse.values.begin(), coarse.values.end(), 0.);
    for (unsigned int j = 0; j < n_columns; ++j)
      for (const auto &entry : base_map.cells[number])
        coarse(entry.unknown % n_base, place(entry.unknown / n_base, j)) +=
            entry.weight * columns[j].local_element(entry.index);
    const DenseMatrix fine = lift * coarse;
    for (unsigned int j = 0; j < n_columns; ++j)
      for (const auto &entry : map.cells[number])
        if (entry.direct && entry.index < result.n_local())
          result.column(j)[entry.index] = fine(entry.unknown % n, place(entry.unknown / n, j));
  }

  template <int dim>
  MultiVector EnrichedSpace<dim>::interpolate(const MultiVector &column) const
  {
    const std::vector<Column> imported = base_map.import(column);
    MultiVector result(fine.rows, 1);
    DenseMatrix coarse;
    for (unsigned int number = 0; number < map.cells.size(); ++number)
      lift_cell(number, imported, coarse, result);
    lift_elements(imported, result);
    return result;
  }

  template <int dim>
  MultiVector EnrichedSpace<dim>::restrict_forces(const MultiVector &forces) const
  {
    // What acts on a node is divided among the cells that have it.
    std::vector<Column> counts = map.zeros(1), sums = base_map.zeros(1);
    for (const auto &cell : map.cells)
      for (const auto &entry : cell)
        if (entry.direct)
          counts[0].local_element(entry.index) += 1;
    for (const auto &element : map.elements)
      for (const auto &unknown : element.unknowns)
        if (element.mine)
          counts[0].local_element(unknown.index) += 1;
    counts[0].compress(dealii::VectorOperation::add);
    counts[0].update_ghost_values();
    const std::vector<Column> imported = map.import(forces);
    DenseMatrix fine(n, n_fields);
    for (unsigned int number = 0; number < map.cells.size(); ++number)
    {
      std::fill(fine.values.begin(), fine.values.end(), 0.);
      for (const auto &entry : map.cells[number])
        if (entry.direct)
          fine.values[entry.unknown] =
              imported[0].local_element(entry.index) / counts[0].local_element(entry.index);
      const DenseMatrix coarse = lift.transpose() * fine;
      for (const auto &entry : base_map.cells[number])
        sums[0].local_element(entry.index) += entry.weight * coarse.values[entry.unknown];
    }
    for (unsigned int e = 0; e < map.elements.size(); ++e)
      if (map.elements[e].mine)
        restrict_element(e, imported[0], counts[0], sums[0]);
    sums[0].compress(dealii::VectorOperation::add);
    MultiVector result(base.rows, 1);
    std::copy_n(sums[0].begin(), result.n_local(), result.data());
    for_rows_without_cells([&](const unsigned int of_base, const unsigned int of_fine)
                           { result.data()[of_base] = forces.data()[of_fine]; });
    return result;
  }

  /// Adds an element's part of restrict_forces().
  template <int dim>
  void EnrichedSpace<dim>::restrict_element(const unsigned int e, const Column &forces,
                                            const Column &counts, Column &sums) const
  {
    for (const bool of_multipliers : {false, true})
    {
      const DenseMatrix &matrix = element_lift(map.elements[e].shape, of_multipliers);
      const unsigned int first = of_multipliers ? dim : 0, end = of_multipliers ? n_fields : dim;
      DenseMatrix of_fine(matrix.n_rows, end - first);
      for (const auto &unknown : map.elements[e].unknowns)
        if (unknown.field >= first && unknown.field < end)
          of_fine(unknown.node, unknown.field - first) =
              forces.local_element(unknown.index) / counts.local_element(unknown.index);
      const DenseMatrix of_base = matrix.transpose() * of_fine;
      for (const auto &unknown : base_map.elements[e].unknowns)
        if (unknown.field >= first && unknown.field < end)
          sums.local_element(unknown.index) += of_base(unknown.node, unknown.field - first);
    }
  }

  template <int dim>
  void EnrichedSpace<dim>::for_rows_without_cells(
      const std::function<void(unsigned int, unsigned int)> &visit) const
  {
    if (!base.has_nodeless_rows() || dealii::Utilities::MPI::this_mpi_process(fine.comm) != 0)
      return;
    for (unsigned int i = base.first_point; i < base.first_local_multiplier; ++i)
      visit(i, fine.first_point + i - base.first_point);
    for (unsigned int i = base.first_point_multiplier; i < base.rows.end; ++i)
      visit(i, fine.first_point_multiplier + i - base.first_point_multiplier);
  }

  template <int dim>
  void EnrichedSpace<dim>::copy_rows_without_cells(const std::vector<Column> &columns,
                                                   MultiVector &result) const
  {
    for_rows_without_cells(
        [&](const unsigned int of_base, const unsigned int of_fine)
        {
          for (unsigned int j = 0; j < columns.size(); ++j)
            result.column(j)[of_fine] = columns[j].local_element(of_base);
        });
  }

  template class EnrichedSpace<2>;
  template class EnrichedSpace<3>;
} // namespace squeal
