#include <squeal/bodies/prestress.h>
#include <squeal/linalg/dense.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_values.h>

#include <algorithm>

namespace squeal
{
  using namespace dealii;

  template <int dim>
  MultiVector assemble_centrifugal_load(const FiniteElementSpace<dim> &spaces,
                                        const std::vector<Body> &bodies, const Material &material,
                                        const double angular_velocity)
  {
    std::vector<PetscInt> rows;
    std::vector<double> values;
    FEValues<dim> fe_values(spaces.mapping, spaces.fe, QGauss<dim>(spaces.fe.degree + 1),
                            update_values | update_quadrature_points | update_JxW_values);
    std::vector<types::global_dof_index> cell_nodes(spaces.fe.n_dofs_per_cell());
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned() &&
          std::find(bodies.begin(), bodies.end(), cell->material_id()) != bodies.end())
      {
        fe_values.reinit(cell);
        cell->get_dof_indices(cell_nodes);
        for (unsigned int a = 0; a < cell_nodes.size(); ++a)
        {
          Tensor<1, dim> force;
          for (const unsigned int q : fe_values.quadrature_point_indices())
          {
            const Point<dim> &x    = fe_values.quadrature_point(q);
            const Tensor<1, dim> w = spaces.geometry.transport(x);
            // (w.grad) w, exact because w is affine
            const Tensor<1, dim> acceleration = spaces.geometry.transport(x + w) - w;
            force -= material.density * angular_velocity * angular_velocity * fe_values.JxW(q) *
                     fe_values.shape_value(a, q) * acceleration;
          }
          for (const WeightedNode &node : spaces.expand(cell_nodes[a]))
            for (unsigned int c = 0; c < dim; ++c)
            {
              rows.push_back(static_cast<int>(spaces.equation(node.node, c)));
              values.push_back(node.weight * force[c]);
            }
        }
      }
    return sum_entries(spaces.rows, rows, values);
  }

  template <int dim>
  Matrix assemble_stress_stiffness(const FiniteElementSpace<dim> &spaces,
                                   const std::vector<Body> &bodies, const Material &material,
                                   const MultiVector &state)
  {
    const std::vector<double> u_0 = replicate(state);
    const auto C                  = elasticity_tensor<dim>(material);
    const unsigned int n          = spaces.fe.n_dofs_per_cell();
    EntryList entries;
    FEValues<dim> fe_values(spaces.mapping, spaces.fe, QGauss<dim>(spaces.fe.degree + 1),
                            update_gradients | update_JxW_values);
    std::vector<types::global_dof_index> cell_nodes(n);
    for (const auto &cell : spaces.nodes.active_cell_iterators())
    {
      if (!cell->is_locally_owned() ||
          std::find(bodies.begin(), bodies.end(), cell->material_id()) == bodies.end())
        continue;
      fe_values.reinit(cell);
      cell->get_dof_indices(cell_nodes);
      std::vector<std::vector<WeightedNode>> expansions;
      std::vector<Tensor<1, dim>> u(n);
      for (unsigned int a = 0; a < n; ++a)
      {
        expansions.push_back(spaces.expand(cell_nodes[a]));
        for (const WeightedNode &node : expansions.back())
          for (unsigned int c = 0; c < dim; ++c)
          {
            const unsigned int row = spaces.equation(node.node, c);
            if (row != FiniteElementSpace<dim>::none)
              u[a][c] += node.weight * u_0[row];
          }
      }

      // s_ab = int sigma_jl d_j N_a d_l N_b, the same for every component
      DenseMatrix s(n, n);
      for (const unsigned int q : fe_values.quadrature_point_indices())
      {
        Tensor<2, dim> gradient; // d_l u_k
        for (unsigned int a = 0; a < n; ++a)
          gradient += outer_product(u[a], fe_values.shape_grad(a, q));
        Tensor<2, dim> stress; // sigma_ij = C_ijkl d_l u_k; table[i][k][j][l]
        for (unsigned int i = 0; i < dim; ++i)
          for (unsigned int k = 0; k < dim; ++k)
            for (unsigned int j = 0; j < dim; ++j)
              for (unsigned int l = 0; l < dim; ++l)
                stress[i][j] += C[((i * dim + k) * dim + j) * dim + l] * gradient[k][l];
        for (unsigned int a = 0; a < n; ++a)
        {
          const Tensor<1, dim> flux = fe_values.JxW(q) * stress * fe_values.shape_grad(a, q);
          for (unsigned int b = 0; b <= a; ++b)
            s(a, b) += flux * fe_values.shape_grad(b, q);
        }
      }
      for (unsigned int a = 0; a < n; ++a)
        for (unsigned int b = 0; b < n; ++b)
          for (const WeightedNode &row : expansions[a])
            for (const WeightedNode &column : expansions[b])
              for (unsigned int c = 0; c < dim; ++c)
                entries.add(static_cast<int>(spaces.equation(row.node, c)),
                            static_cast<int>(spaces.equation(column.node, c)),
                            row.weight * column.weight * (a >= b ? s(a, b) : s(b, a)));
    }
    return entries.make_matrix(spaces.rows);
  }

  template MultiVector assemble_centrifugal_load<2>(const FiniteElementSpace<2> &,
                                                    const std::vector<Body> &, const Material &,
                                                    double);
  template MultiVector assemble_centrifugal_load<3>(const FiniteElementSpace<3> &,
                                                    const std::vector<Body> &, const Material &,
                                                    double);
  template Matrix assemble_stress_stiffness<2>(const FiniteElementSpace<2> &,
                                               const std::vector<Body> &, const Material &,
                                               const MultiVector &);
  template Matrix assemble_stress_stiffness<3>(const FiniteElementSpace<3> &,
                                               const std::vector<Body> &, const Material &,
                                               const MultiVector &);
} // namespace squeal
