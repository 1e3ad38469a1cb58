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
    sums[0].compress(dealii::VectorOperation::add);
    MultiVector result(base.rows, 1);
    std::copy_n(sums[0].begin(), result.n_local(), result.data());
    for_rows_without_cells([&](const unsigned int of_base, const unsigned int of_fine)
                           { result.data()[of_base] = forces.data()[of_fine]; });
    return result;
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
