#include <squeal/displacement_operator.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/matrix_free/fe_evaluation.h>

#include <algorithm>

namespace squeal
{
  using namespace dealii;

  template <int dim>
  DisplacementOperator<dim>::Law::Law(const MaterialOperator &part)
      : m_star(part.material.density * part.m_star), g(part.material.density * part.g),
        mass(part.material.density * part.m), is_elastic(part.k != 0)
  {
    const ElasticModuli<dim> moduli(part.material);
    for (unsigned int i = 0; i < dim; ++i)
      for (unsigned int j = 0; j < dim; ++j)
      {
        l[i][j] = part.k * moduli.l[i][j];
        m[i][j] = part.k * moduli.m[i][j];
      }
  }

  template <int dim>
  DisplacementOperator<dim>::DisplacementOperator(const Spaces<dim> &spaces,
                                                  const std::vector<MaterialOperator> &parts)
      : spaces(spaces), laws(parts.begin(), parts.end()), cells(std::make_shared<Cells>()),
        diagonal_(spaces.rows, 1)
  {
    cells->number_of_part.assign(spaces.geometry.parts.size(), numbers::invalid_unsigned_int);
    for (unsigned int k = 0; k < parts.size(); ++k)
      for (const Body body : parts[k].bodies)
        cells->number_of_part[body] = k;

    // Cells that are computed side by side are of one part.
    typename MatrixFree<dim>::AdditionalData data;
    data.tasks_parallel_scheme = MatrixFree<dim>::AdditionalData::none;
    data.mapping_update_flags =
        update_values | update_gradients | update_JxW_values | update_quadrature_points;
    data.cell_vectorization_categories_strict = true;
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      data.cell_vectorization_category.push_back(
          cell->is_locally_owned() ? cells->number_of_part[cell->material_id()] : 0);
    cells->data.reinit(spaces.mapping, spaces.nodes, spaces.hanging,
                       QGauss<1>(spaces.fe.degree + 1), data);
    for (unsigned int batch = 0; batch < cells->data.n_cell_batches(); ++batch)
      cells->number_of_batch.push_back(
          cells->number_of_part[cells->data.get_cell_iterator(batch, 0)->material_id()]);
    for (Vectors *vectors : {&cells->from, &cells->to})
    {
      vectors->reinit(dim);
      for (unsigned int c = 0; c < dim; ++c)
        cells->data.initialize_dof_vector(vectors->block(c));
      vectors->collect_sizes();
    }
    number_rows(*cells);
    tabulate_transport(*cells);
    compute_diagonal();
  }

  template <int dim>
  DisplacementOperator<dim>::DisplacementOperator(const DisplacementOperator &other,
                                                  const std::vector<MaterialOperator> &parts)
      : spaces(other.spaces), laws(parts.begin(), parts.end()), cells(other.cells)
  {
    tabulate_transport(*cells);
  }

  template <int dim>
  void DisplacementOperator<dim>::number_rows(Cells &cells) const
  {
    cells.place_of_row.resize(spaces.first_local_multiplier - spaces.rows.begin);
    unsigned int n_nodes = 0;
    for (const auto node : spaces.nodes.locally_owned_dofs())
    {
      for (unsigned int c = 0; c < dim; ++c)
        if (const unsigned int row = spaces.equation(node, c); row != Spaces<dim>::none)
          cells.place_of_row[row - spaces.rows.begin] = {c, n_nodes};
      ++n_nodes;
    }
  }

  template <int dim>
  void DisplacementOperator<dim>::tabulate_transport(Cells &cells) const
  {
    if (!cells.transport.empty() ||
        std::none_of(laws.begin(), laws.end(), [](const Law &law) { return law.turns(); }))
      return;
    FEEvaluation<dim, -1, 0, dim> values(cells.data);
    cells.n_points = values.n_q_points;
    cells.transport.resize(cells.data.n_cell_batches() * cells.n_points);
    for (unsigned int batch = 0; batch < cells.data.n_cell_batches(); ++batch)
    {
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
            cells.transport[batch * cells.n_points + q][d][lane] = w[d];
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
      const Tensor<1, dim, Number> &u, const double g, Tensor<1, dim, Number> &force,
      Tensor<2, dim, Number> &flux) const
  {
    for (unsigned int i = 0; i < dim; ++i)
    {
      const Number turned = gradient[i] * w;
      flux[i] += (m_star * turned - (g / 2) * u[i]) * w;
      force[i] += (g / 2) * turned;
    }
  }

  template <int dim>
  void DisplacementOperator<dim>::add_cells(Vectors &sum, const Vectors &x,
                                            const std::pair<unsigned int, unsigned int> &batches,
                                            const bool transposed) const
  {
    FEEvaluation<dim, -1, 0, dim> u(cells->data);
    for (unsigned int batch = batches.first; batch < batches.second; ++batch)
    {
      const Law &law   = laws[cells->number_of_batch[batch]];
      const bool has_u = law.needs_values(), has_grad = law.needs_gradients(), turns = law.turns();
      const auto flags = (has_u ? EvaluationFlags::values : EvaluationFlags::nothing) |
                         (has_grad ? EvaluationFlags::gradients : EvaluationFlags::nothing);
      if (!has_u && !has_grad)
        continue;
      // G is skew, all others are symmetric.
      const double g = transposed ? -law.g : law.g;
      u.reinit(batch);
      u.read_dof_values(x);
      u.evaluate(flags);
      for (const unsigned int q : u.quadrature_point_indices())
      {
        Tensor<1, dim, Number> value, force;
        Tensor<2, dim, Number> gradient, flux;
        if (has_u)
        {
          value = u.get_value(q);
          force = law.mass * value;
        }
        if (has_grad)
        {
          gradient = u.get_gradient(q);
          if (law.is_elastic)
            flux = law.stress(gradient);
        }
        if (turns)
          law.add_transport(cells->transport[batch * cells->n_points + q], gradient, value, g,
                            force, flux);
        if (has_grad)
          u.submit_gradient(flux, q);
        if (has_u)
          u.submit_value(force, q);
      }
      u.integrate(flags);
      u.distribute_local_to_global(sum);
    }
  }

  template <int dim>
  Block DisplacementOperator<dim>::multiply(const Block &x, const bool transposed) const
  {
    const auto &place = cells->place_of_row;
    Block y(spaces.rows, x.n_columns());
    for (unsigned int k = 0; k < x.n_columns(); ++k)
    {
      cells->from = 0;
      for (unsigned int i = 0; i < place.size(); ++i)
        cells->from.block(place[i].first).local_element(place[i].second) = x.column(k)[i];
      cells->data.template cell_loop<Vectors, Vectors>(
          [&](const MatrixFree<dim> &, Vectors &to, const Vectors &from,
              const std::pair<unsigned int, unsigned int> &batches)
          { add_cells(to, from, batches, transposed); },
          cells->to, cells->from, true);
      for (unsigned int i = 0; i < place.size(); ++i)
        y.column(k)[i] = cells->to.block(place[i].first).local_element(place[i].second);
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
      const Law &law = laws[cells->number_of_part[cell->material_id()]];
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
