#include <squeal/assessment/enriched_space.h>

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
    DenseMatrix fine(n, coarse.n_columns);
    gemm(false, 1, lift, coarse, 0, fine);
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
  void EnrichedSpace<dim>::copy_rows_without_cells(const std::vector<Column> &columns,
                                                   MultiVector &result) const
  {
    if (!base.has_nodeless_rows() || dealii::Utilities::MPI::this_mpi_process(fine.comm) != 0)
      return;
    const unsigned int n_points      = base.first_local_multiplier - base.first_point,
                       n_multipliers = base.rows.end - base.first_point_multiplier;
    for (unsigned int j = 0; j < columns.size(); ++j)
    {
      const auto copy = [&](const unsigned int from, const unsigned int to, const unsigned int n)
      { std::copy_n(columns[j].begin() + from, n, result.column(j) + to); };
      copy(base.first_point, fine.first_point, n_points);
      copy(base.first_point_multiplier, fine.first_point_multiplier, n_multipliers);
    }
  }

  template class EnrichedSpace<2>;
  template class EnrichedSpace<3>;
} // namespace squeal
