#include <squeal/bodies/displacement_operator.h>
#include <squeal/mesh/cell_map.h>

#include <deal.II/base/polynomial.h>
#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_tools.h>

#include <algorithm>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    template <int dim>
    std::vector<CellLaw<dim>> laws_of(const std::vector<MaterialOperator> &parts)
    {
      std::vector<CellLaw<dim>> laws;
      for (const MaterialOperator &part : parts)
      {
        const ElasticModuli<dim> moduli(part.material);
        const double density = part.material.density;
        CellLaw<dim> law;
        law.m_star     = density * part.m_star;
        law.g          = density * part.g;
        law.mass       = density * part.m;
        law.is_elastic = part.k != 0;
        for (unsigned int i = 0; i < dim; ++i)
          for (unsigned int j = 0; j < dim; ++j)
          {
            law.l[i][j] = part.k * moduli.l[i][j];
            law.m[i][j] = part.k * moduli.m[i][j];
          }
        laws.push_back(law);
      }
      return laws;
    }

    /// Values or derivatives at the points (rows) of the polynomials through the nodes.
    std::vector<double> polynomials_at(const std::vector<Point<1>> &nodes,
                                       const std::vector<Point<1>> &points,
                                       const unsigned int derivative)
    {
      const auto polynomials = Polynomials::generate_complete_Lagrange_basis(nodes);
      std::vector<double> result, value_and_derivative(2);
      for (const Point<1> &x : points)
        for (const auto &polynomial : polynomials)
        {
          polynomial.value(x[0], value_and_derivative);
          result.push_back(value_and_derivative[derivative]);
        }
      return result;
    }
  } // namespace

  template <int dim>
  DisplacementOperator<dim>::DisplacementOperator(const FiniteElementSpace<dim> &spaces,
                                                  const std::vector<MaterialOperator> &parts)
      : spaces(spaces), laws(laws_of<dim>(parts)), cells(std::make_shared<Cells>()),
        diagonal_(spaces.rows, 1)
  {
    cells->number_of_part.assign(spaces.geometry.parts.size(), numbers::invalid_unsigned_int);
    for (unsigned int k = 0; k < parts.size(); ++k)
      for (const Body body : parts[k].bodies)
        cells->number_of_part[body] = k;
    make_batches();
    tabulate_indices();
    tabulate_geometry();
    tabulate_transport();
    compute_diagonal();
  }

  template <int dim>
  DisplacementOperator<dim>::DisplacementOperator(const DisplacementOperator &other,
                                                  const std::vector<MaterialOperator> &parts)
      : spaces(other.spaces), laws(laws_of<dim>(parts)), cells(other.cells)
  {
    tabulate_transport();
  }

  template <int dim>
  void DisplacementOperator<dim>::make_batches()
  {
    CellBatches<dim> &batches = cells->batches;
    batches.degree            = spaces.fe.degree;
    std::vector<unsigned int> open(laws.size(), numbers::invalid_unsigned_int);
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned())
      {
        const unsigned int part = cells->number_of_part[cell->material_id()];
        unsigned int &batch     = open[part];
        if (batch == numbers::invalid_unsigned_int || cells->members[batch].size() == n_lanes)
        {
          batch = cells->members.size();
          cells->members.emplace_back();
          batches.laws.push_back(part);
        }
        cells->members[batch].push_back(cell);
      }
  }

  template <int dim>
  void DisplacementOperator<dim>::tabulate_indices()
  {
    const CellMap<dim> map(spaces);
    cells->partitioner        = map.zeros(1)[0].get_partitioner();
    CellBatches<dim> &batches = cells->batches;
    const unsigned int n = spaces.fe.n_dofs_per_cell(), n_places = n * dim * n_lanes,
                       n_batches = cells->members.size();
    const auto position = FETools::hierarchic_to_lexicographic_numbering<dim>(batches.degree);
    constexpr unsigned int none = numbers::invalid_unsigned_int;
    batches.indices.assign(std::size_t(n_batches) * n_places, none);
    batches.without_entry.resize(n_batches);
    batches.shares.resize(n_batches);

    // The map has the own cells in the order of the mesh, which that of the batches keeps.
    std::vector<unsigned int> number_in_map(spaces.triangulation.n_active_cells());
    unsigned int n_own = 0;
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned())
        number_in_map[cell->active_cell_index()] = n_own++;
    for (unsigned int batch = 0; batch < n_batches; ++batch)
    {
      unsigned int *indices = batches.indices.data() + std::size_t(batch) * n_places;
      for (unsigned int lane = 0; lane < cells->members[batch].size(); ++lane)
        for (const auto &entry :
             map.cells[number_in_map[cells->members[batch][lane]->active_cell_index()]])
          if (const unsigned int c = entry.unknown / n; c < dim) // others are multipliers
          {
            const unsigned int place = (position[entry.unknown % n] * dim + c) * n_lanes + lane;
            if (entry.direct)
              indices[place] = entry.index;
            else
              batches.shares[batch].push_back({place, entry.index, entry.weight});
          }
      for (unsigned int place = 0; place < n_places; ++place)
        if (indices[place] == none)
        {
          batches.without_entry[batch].push_back(place);
          indices[place] = 0;
        }
    }
    // Not even that one exists where every component is fixed.
    if (cells->partitioner->locally_owned_size() + cells->partitioner->n_ghost_indices() == 0)
      batches.laws.clear();
  }

  template <int dim>
  void DisplacementOperator<dim>::for_each_lane(
      const UpdateFlags flags,
      const std::function<void(unsigned int, unsigned int, const CellValues &)> &visit) const
  {
    CellValues values(spaces.mapping, spaces.fe, QGauss<dim>(spaces.fe.degree + 1), flags);
    for (unsigned int batch = 0; batch < cells->members.size(); ++batch)
      for (unsigned int lane = 0; lane < n_lanes; ++lane)
      {
        const auto &members = cells->members[batch];
        values.reinit(members[lane < members.size() ? lane : 0]);
        visit(batch, lane, values);
      }
  }

  template <int dim>
  void DisplacementOperator<dim>::tabulate_geometry()
  {
    CellBatches<dim> &batches     = cells->batches;
    const unsigned int n_points_1 = batches.degree + 1, n_points = batches.n_points();
    const std::vector<Point<1>> points = QGauss<1>(n_points_1).get_points();
    batches.interpolation   = polynomials_at(QGaussLobatto<1>(n_points_1).get_points(), points, 0);
    batches.differentiation = polynomials_at(points, points, 1);
    const std::size_t n     = std::size_t(cells->members.size()) * n_points * n_lanes;
    batches.weights.resize(n);
    batches.inverse_jacobians.resize(n * dim * dim);
    for_each_lane(
        update_JxW_values | update_inverse_jacobians,
        [&](const unsigned int batch, const unsigned int lane, const CellValues &values)
        {
          for (unsigned int q = 0; q < n_points; ++q)
          {
            const std::size_t point = std::size_t(batch) * n_points + q;
            batches.weights[point * n_lanes + lane] =
                lane < cells->members[batch].size() ? values.JxW(q) : 0.;
            for (unsigned int d = 0; d < dim; ++d)
              for (unsigned int i = 0; i < dim; ++i)
                batches.inverse_jacobians[((point * dim + d) * dim + i) * n_lanes + lane] =
                    values.inverse_jacobian(q)[d][i];
          }
        });
  }

  template <int dim>
  void DisplacementOperator<dim>::tabulate_transport()
  {
    CellBatches<dim> &batches = cells->batches;
    if (!batches.transport.empty() ||
        std::none_of(laws.begin(), laws.end(), [](const auto &law) { return law.turns(); }))
      return;
    const unsigned int n_points = batches.n_points();
    batches.transport.resize(batches.weights.size() * dim);
    for_each_lane(
        update_quadrature_points | update_inverse_jacobians,
        [&](const unsigned int batch, const unsigned int lane, const CellValues &values)
        {
          for (unsigned int q = 0; q < n_points; ++q)
          {
            const Tensor<1, dim> w = apply_transformation(
                values.inverse_jacobian(q), spaces.geometry.transport(values.quadrature_point(q)));
            for (unsigned int d = 0; d < dim; ++d)
              batches.transport[((std::size_t(batch) * n_points + q) * dim + d) * n_lanes + lane] =
                  w[d];
          }
        });
  }

  template <int dim>
  MultiVector DisplacementOperator<dim>::multiply(const MultiVector &x, const bool transposed) const
  {
    // G is skew, all others are symmetric.
    std::vector<CellLaw<dim>> given = laws;
    for (CellLaw<dim> &law : given)
      law.g *= transposed ? -1 : 1;
    MultiVector y(spaces.rows, x.n_columns());
    std::vector<const double *> from;
    std::vector<double *> to;
    if (Utilities::MPI::n_mpi_processes(spaces.comm) == 1)
    {
      for (unsigned int j = 0; j < x.n_columns(); ++j)
      {
        from.push_back(x.column(j));
        to.push_back(y.column(j));
      }
      add_products(cells->batches, given, from, to);
      return y;
    }
    std::vector<Column> inputs(x.n_columns(), Column(cells->partitioner)), outputs = inputs;
    for (unsigned int j = 0; j < x.n_columns(); ++j)
    {
      std::copy_n(x.column(j), x.n_local(), inputs[j].begin());
      inputs[j].update_ghost_values();
      from.push_back(inputs[j].begin());
      to.push_back(outputs[j].begin());
    }
    add_products(cells->batches, given, from, to);
    for (unsigned int j = 0; j < x.n_columns(); ++j)
    {
      outputs[j].compress(VectorOperation::add);
      std::copy_n(outputs[j].begin(), y.n_local(), y.column(j));
    }
    return y;
  }

  template <int dim>
  void DisplacementOperator<dim>::compute_diagonal()
  {
    FEValues<dim> shapes(spaces.mapping, spaces.fe, QGauss<dim>(spaces.fe.degree + 1),
                         update_gradients | update_quadrature_points | update_JxW_values);
    std::vector<types::global_dof_index> cell_nodes(spaces.fe.n_dofs_per_cell());
    std::vector<PetscInt> rows;
    std::vector<PetscScalar> values;
    for (const auto &cell : spaces.nodes.active_cell_iterators())
    {
      if (!cell->is_locally_owned())
        continue;
      const CellLaw<dim> &law = laws[cells->number_of_part[cell->material_id()]];
      shapes.reinit(cell);
      cell->get_dof_indices(cell_nodes);
      for (unsigned int a = 0; a < cell_nodes.size(); ++a)
      {
        Tensor<1, dim> entry;
        for (const unsigned int q : shapes.quadrature_point_indices())
        {
          const Tensor<1, dim> gradient = shapes.shape_grad(a, q);
          const double turned =
              law.m_star != 0 ? spaces.geometry.transport(shapes.quadrature_point(q)) * gradient
                              : 0;
          for (unsigned int i = 0; i < dim; ++i)
          {
            double density = law.m_star * turned * turned +
                             (law.l[i][i] + law.m[i][i]) * gradient[i] * gradient[i];
            for (unsigned int j = 0; j < dim; ++j)
              density += law.m[i][j] * gradient[j] * gradient[j];
            entry[i] += density * shapes.JxW(q);
          }
        }
        for (const WeightedNode &w : spaces.expand(cell_nodes[a]))
          for (unsigned int c = 0; c < dim; ++c)
          {
            rows.push_back(static_cast<int>(spaces.equation(w.node, c)));
            values.push_back(w.weight * w.weight * entry[c]);
          }
      }
    }
    diagonal_ = sum_entries(spaces.rows, rows, values);
  }

  template class DisplacementOperator<2>;
  template class DisplacementOperator<3>;
} // namespace squeal
