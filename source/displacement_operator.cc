#include <squeal/displacement_operator.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/matrix_free/fe_evaluation.h>

#include <algorithm>

namespace squeal
{
  using namespace dealii;

  template <int dim>
  DisplacementOperator<dim>::DisplacementOperator(const Spaces<dim> &spaces,
                                                  const std::vector<StaticBody> &bodies)
      : spaces(spaces), law_of_part(spaces.geometry.parts.size(), numbers::invalid_unsigned_int),
        diagonal_(spaces.rows, 1)
  {
    for (const StaticBody &body : bodies)
    {
      for (const Body part : body.bodies)
        law_of_part[part] = laws.size();
      const ElasticModuli<dim> moduli(body.material);
      const double rho = body.material.density;
      laws.push_back({moduli.l, moduli.m, rho * body.m_star, rho * body.g});
    }

    // Cells that are computed side by side are of one body.
    typename MatrixFree<dim>::AdditionalData data;
    data.tasks_parallel_scheme = MatrixFree<dim>::AdditionalData::none;
    data.mapping_update_flags =
        update_values | update_gradients | update_JxW_values | update_quadrature_points;
    data.cell_vectorization_categories_strict = true;
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      data.cell_vectorization_category.push_back(
          cell->is_locally_owned() ? law_of_part[cell->material_id()] : 0);
    cells.reinit(spaces.mapping, spaces.nodes, spaces.hanging, QGauss<1>(spaces.fe.degree + 1),
                 data);
    for (Vectors *vectors : {&from, &to})
    {
      vectors->reinit(dim);
      for (unsigned int c = 0; c < dim; ++c)
        cells.initialize_dof_vector(vectors->block(c));
      vectors->collect_sizes();
    }
    tabulate();
    compute_diagonal();
  }

  template <int dim>
  void DisplacementOperator<dim>::tabulate()
  {
    place_of_row.resize(spaces.first_local_multiplier - spaces.rows.begin);
    unsigned int n_nodes = 0;
    for (const auto node : spaces.nodes.locally_owned_dofs())
    {
      for (unsigned int c = 0; c < dim; ++c)
        if (const unsigned int row = spaces.equation(node, c); row != Spaces<dim>::none)
          place_of_row[row - spaces.rows.begin] = {c, n_nodes};
      ++n_nodes;
    }

    FEEvaluation<dim, -1, 0, dim> values(cells);
    const bool turns = std::any_of(laws.begin(), laws.end(),
                                   [](const Law &law) { return law.m_star != 0 || law.g != 0; });
    if (turns)
      transport.resize(cells.n_cell_batches() * values.n_q_points);
    for (unsigned int batch = 0; batch < cells.n_cell_batches(); ++batch)
    {
      law_of_batch.push_back(law_of_part[cells.get_cell_iterator(batch, 0)->material_id()]);
      if (!turns)
        continue;
      values.reinit(batch);
      for (const unsigned int q : values.quadrature_point_indices())
      {
        const Point<dim, Number> points = values.quadrature_point(q);
        for (unsigned int lane = 0; lane < Number::size(); ++lane)
        {
          Point<dim> x;
          for (unsigned int d = 0; d < dim; ++d)
            x[d] = points[d][lane];
          const Tensor<1, dim> w = spaces.geometry.transport(x);
          for (unsigned int d = 0; d < dim; ++d)
            transport[batch * values.n_q_points + q][d][lane] = w[d];
        }
      }
    }
  }

  /// s_ij = d_ij sum_k l_ik d_k u_k + m_ij (d_j u_i + d_i u_j), tested with d_j v_i
  template <int dim>
  DEAL_II_ALWAYS_INLINE inline Tensor<2, dim, typename DisplacementOperator<dim>::Number>
  DisplacementOperator<dim>::Law::stress(const Tensor<2, dim, Number> &gradient) const
  {
    Tensor<2, dim, Number> s;
    for (unsigned int i = 0; i < dim; ++i)
    {
      s[i][i] = (2 * m[i][i]) * gradient[i][i];
      for (unsigned int k = 0; k < dim; ++k)
        s[i][i] += l[i][k] * gradient[k][k];
      for (unsigned int j = 0; j < i; ++j)
        s[i][j] = s[j][i] = m[i][j] * (gradient[i][j] + gradient[j][i]);
    }
    return s;
  }

  /// M*:  m_star rho (w . grad u) (w . grad v)
  /// G:   g rho/2 [(w . grad u) . v - u . (w . grad v)]
  template <int dim>
  DEAL_II_ALWAYS_INLINE inline void DisplacementOperator<dim>::Law::add_transport(
      const Tensor<1, dim, Number> &w, const Tensor<2, dim, Number> &gradient,
      Tensor<1, dim, Number> &value, Tensor<2, dim, Number> &flux) const
  {
    for (unsigned int i = 0; i < dim; ++i)
    {
      const Number turned = gradient[i] * w, u = value[i];
      flux[i] += (m_star * turned - (g / 2) * u) * w;
      value[i] = (g / 2) * turned;
    }
  }

  template <int dim>
  void
  DisplacementOperator<dim>::apply_cells(const MatrixFree<dim> &, Vectors &sum, const Vectors &x,
                                         const std::pair<unsigned int, unsigned int> &batches) const
  {
    FEEvaluation<dim, -1, 0, dim> u(cells);
    for (unsigned int batch = batches.first; batch < batches.second; ++batch)
    {
      const Law &law  = laws[law_of_batch[batch]];
      const bool skew = law.g != 0, turns = skew || law.m_star != 0;
      const auto flags =
          skew ? EvaluationFlags::gradients | EvaluationFlags::values : EvaluationFlags::gradients;
      u.reinit(batch);
      u.read_dof_values(x);
      u.evaluate(flags);
      for (const unsigned int q : u.quadrature_point_indices())
      {
        const Tensor<2, dim, Number> gradient = u.get_gradient(q);
        Tensor<2, dim, Number> flux           = law.stress(gradient);
        Tensor<1, dim, Number> value;
        if (skew)
          value = u.get_value(q);
        if (turns)
          law.add_transport(transport[batch * u.n_q_points + q], gradient, value, flux);
        u.submit_gradient(flux, q);
        if (skew)
          u.submit_value(value, q);
      }
      u.integrate(flags);
      u.distribute_local_to_global(sum);
    }
  }

  template <int dim>
  Block DisplacementOperator<dim>::multiply(const Block &x) const
  {
    from = 0;
    for (unsigned int i = 0; i < place_of_row.size(); ++i)
      from.block(place_of_row[i].first).local_element(place_of_row[i].second) = x.data()[i];
    cells.cell_loop(&DisplacementOperator::apply_cells, this, to, from, true);
    Block y(spaces.rows, 1);
    for (unsigned int i = 0; i < place_of_row.size(); ++i)
      y.data()[i] = to.block(place_of_row[i].first).local_element(place_of_row[i].second);
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
      const Law &law = laws[law_of_part[cell->material_id()]];
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
