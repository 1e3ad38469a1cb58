#include <squeal/bodies/body_operators.h>
#include <squeal/bodies/cell_operators.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/lac/dynamic_sparsity_pattern.h>
#include <deal.II/lac/sparsity_tools.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Adds A(a, b) between component i of node a and component k of node b. DenseMatrix is
    /// column-major and PETSc expects rows, hence the transposed roles; all callers state their own
    /// symmetry.
    template <int dim>
    void add_block(const Matrix &matrix, const CellNodes<dim> &cell_nodes, const unsigned int i,
                   const unsigned int k, const DenseMatrix &transposed)
    {
      const auto &rows = cell_nodes.equations[i], &columns = cell_nodes.equations[k];
      SQUEAL_PETSC(MatSetValues(matrix, rows.size(), rows.data(), columns.size(), columns.data(),
                                transposed.values.data(), ADD_VALUES));
    }

    /// Empty matrices with the exact pattern of the bodies' cells: all components coupled, or each
    /// component with itself only.
    template <int dim>
    std::pair<std::vector<PetscInt>, std::vector<PetscInt>>
    count_row_entries(const FiniteElementSpace<dim> &spaces, const DynamicSparsityPattern &graph,
                      const bool coupled)
    {
      const RowRange &rows = spaces.rows;
      std::vector<PetscInt> diagonal(rows.n_local()), off_diagonal(rows.n_local());
      for (const auto node : spaces.nodes.locally_owned_dofs())
        for (unsigned int c = 0; c < dim; ++c)
        {
          const unsigned int row = spaces.equation(node, c);
          if (row == FiniteElementSpace<dim>::none)
            continue;
          for (unsigned int k = 0; k < graph.row_length(node); ++k)
            for (unsigned int d = 0; d < dim; ++d)
              if (coupled || c == d)
              {
                const unsigned int column = spaces.equation(graph.column_number(node, k), d);
                if (column != FiniteElementSpace<dim>::none)
                  ++(rows.contains(column) ? diagonal : off_diagonal)[row - rows.begin];
              }
        }
      return {diagonal, off_diagonal};
    }

    template <int dim>
    Matrix empty_matrix(const FiniteElementSpace<dim> &spaces, const DynamicSparsityPattern &graph,
                        const bool coupled)
    {
      const auto [diagonal, off_diagonal] = count_row_entries(spaces, graph, coupled);
      return make_matrix(spaces.rows, diagonal, off_diagonal);
    }

    /// Adds int B C B^T of a cell.
    template <int dim>
    void add_stiffness(const CellIntegrals<dim> &integrals, CellNodes<dim> &cell_nodes,
                       const std::array<double, dim * dim * dim * dim> &tensor,
                       const Matrix &matrix)
    {
      const unsigned int n = integrals.n;
      DenseMatrix block(n, n);
      // The block (k, i) of the stiffness is the transpose of (i, k). PETSc reads rows, the block
      // is stored by columns: what is filled here is the transpose of what is added.
      for (unsigned int i = 0; i < dim; ++i)
        for (unsigned int k = i; k < dim; ++k)
        {
          stiffness_block(integrals, tensor, i, k, block);
          add_block(matrix, cell_nodes, i, k, cell_nodes.condense(block));
          if (i != k)
          {
            for (unsigned int a = 0; a < n; ++a)
              for (unsigned int b = 0; b < a; ++b)
                std::swap(block(b, a), block(a, b));
            add_block(matrix, cell_nodes, k, i, cell_nodes.condense(block));
          }
        }
    }

    std::shared_ptr<const Matrix> shared_matrix(Matrix &matrix)
    {
      if (!matrix)
        return {};
      compress(matrix);
      return std::make_shared<const Matrix>(std::move(matrix));
    }

    /// Calls visit() at each of the bodies' cells of this rank.
    template <int dim, typename Visit>
    void for_cells(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                   CellIntegrals<dim> &integrals, CellNodes<dim> &cell_nodes, const Visit &visit)
    {
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned() &&
            std::find(bodies.begin(), bodies.end(), cell->material_id()) != bodies.end())
        {
          integrals.reinit(cell);
          cell_nodes.reinit(cell);
          visit();
        }
    }

    template <int dim>
    DynamicSparsityPattern node_graph(const FiniteElementSpace<dim> &spaces,
                                      const std::vector<Body> &bodies)
    {
      DynamicSparsityPattern graph(spaces.nodes.n_dofs(), spaces.nodes.n_dofs(),
                                   spaces.relevant_nodes);
      CellNodes<dim> cell_nodes(spaces);
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned() &&
            std::find(bodies.begin(), bodies.end(), cell->material_id()) != bodies.end())
        {
          cell_nodes.reinit(cell);
          std::vector<types::global_dof_index> sorted = cell_nodes.free;
          std::sort(sorted.begin(), sorted.end());
          for (const auto node : sorted)
            graph.add_entries(node, sorted.begin(), sorted.end(), true);
        }
      SparsityTools::distribute_sparsity_pattern(graph, spaces.nodes.locally_owned_dofs(),
                                                 spaces.comm, spaces.relevant_nodes);
      return graph;
    }
  } // namespace

  template <int dim>
  BodyMatrices assemble_body(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                             const Material &material, const bool with_transport)
  {
    return assemble_body(spaces, bodies, material,
                         BodyMatrixChoice{true, true, with_transport, with_transport});
  }

  template <int dim>
  BodyMatrices assemble_body(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                             const Material &material, const BodyMatrixChoice &choice)
  {
    if (!choice.M && !choice.K && !choice.G && !choice.M_star && !choice.V)
      return {};
    const DynamicSparsityPattern graph = node_graph(spaces, bodies);
    const auto new_matrix              = [&](const bool wanted, const bool coupled)
    { return wanted ? empty_matrix(spaces, graph, coupled) : Matrix(); };
    Matrix K = new_matrix(choice.K, true), M = new_matrix(choice.M, false),
           G = new_matrix(choice.G, false), M_star = new_matrix(choice.M_star, false),
           V = new_matrix(choice.V, true);

    const auto C     = elasticity_tensor<dim>(material);
    const auto C_v   = elasticity_tensor(ElasticModuli<dim>(material.viscosity, material.axis));
    const double rho = material.density;
    CellIntegrals<dim> integrals(spaces, choice.G || choice.M_star);
    CellNodes<dim> cell_nodes(spaces);
    const unsigned int n = integrals.n;
    DenseMatrix block(n, n);

    const auto add_cell = [&]()
    {
      if (K)
        add_stiffness(integrals, cell_nodes, C, K);
      if (V)
        add_stiffness(integrals, cell_nodes, C_v, V);

      // The same for every component
      const auto add_each_component = [&](const Matrix &matrix, const auto &entry)
      {
        if (!matrix)
          return;
        for (unsigned int a = 0; a < n; ++a)
          for (unsigned int b = 0; b < n; ++b)
            block(b, a) = rho * entry(a, b);
        const DenseMatrix &condensed = cell_nodes.condense(block);
        for (unsigned int c = 0; c < dim; ++c)
          add_block(matrix, cell_nodes, c, c, condensed);
      };
      // M_ab = int rho N_a N_b
      add_each_component(M, [&](const unsigned int a, const unsigned int b)
                         { return integrals.values(a, b); });
      // G_ab = 1/2 int rho (N_a d_phi N_b - d_phi N_a N_b)
      add_each_component(
          G, [&](const unsigned int a, const unsigned int b)
          { return (integrals.value_transport(a, b) - integrals.value_transport(b, a)) / 2; });
      // M*_ab = int rho d_phi N_a d_phi N_b
      add_each_component(M_star, [&](const unsigned int a, const unsigned int b)
                         { return integrals.transports(a, b); });
    };
    for_cells(spaces, bodies, integrals, cell_nodes, add_cell);
    return {shared_matrix(M), shared_matrix(K), shared_matrix(G), shared_matrix(M_star),
            shared_matrix(V)};
  }

  template <int dim>
  std::vector<std::shared_ptr<const Matrix>>
  assemble_stiffnesses(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                       const Material &material)
  {
    const DynamicSparsityPattern graph = node_graph(spaces, bodies);
    std::vector<Matrix> matrices;
    std::vector<std::array<double, dim * dim * dim * dim>> tensors;
    for (const ElasticComponent<dim> &component : elastic_components<dim>(material))
    {
      matrices.push_back(empty_matrix(spaces, graph, true));
      tensors.push_back(elasticity_tensor(component.law));
    }
    CellIntegrals<dim> integrals(spaces, false);
    CellNodes<dim> cell_nodes(spaces);
    for_cells(spaces, bodies, integrals, cell_nodes,
              [&]()
              {
                for (unsigned int k = 0; k < matrices.size(); ++k)
                  add_stiffness(integrals, cell_nodes, tensors[k], matrices[k]);
              });
    std::vector<std::shared_ptr<const Matrix>> result;
    for (Matrix &matrix : matrices)
      result.push_back(shared_matrix(matrix));
    return result;
  }

  template <int dim>
  MultiVector assemble_pressure_load(const FiniteElementSpace<dim> &spaces)
  {
    std::vector<PetscInt> rows;
    std::vector<double> values;
    const unsigned int n = spaces.fe.n_dofs_per_cell();
    FEFaceValues<dim> fe_values(spaces.mapping, spaces.fe, QGauss<dim - 1>(spaces.fe.degree + 1),
                                update_values | update_normal_vectors | update_quadrature_points |
                                    update_JxW_values);
    std::vector<types::global_dof_index> cell_nodes(n);
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned())
        for (const unsigned int f : cell->face_indices())
          for (const PressureLoad<dim> &pressure_load : spaces.geometry.loads)
            if (cell->face(f)->at_boundary() &&
                cell->face(f)->boundary_id() == pressure_load.boundary)
            {
              fe_values.reinit(cell, f);
              cell->get_dof_indices(cell_nodes);
              for (unsigned int a = 0; a < n; ++a)
              {
                // f_a = int -p n N_a
                Tensor<1, dim> force;
                for (const unsigned int q : fe_values.quadrature_point_indices())
                  force -= pressure_load.pressure(fe_values.quadrature_point(q)) *
                           fe_values.JxW(q) * fe_values.shape_value(a, q) *
                           fe_values.normal_vector(q);
                for (const WeightedNode &w : spaces.expand(cell_nodes[a]))
                  for (unsigned int c = 0; c < dim; ++c)
                  {
                    rows.push_back(static_cast<int>(spaces.equation(w.node, c)));
                    values.push_back(w.weight * force[c]);
                  }
              }
            }
    return sum_entries(spaces.rows, rows, values);
  }

  template BodyMatrices assemble_body<2>(const FiniteElementSpace<2> &, const std::vector<Body> &,
                                         const Material &, const BodyMatrixChoice &);
  template BodyMatrices assemble_body<3>(const FiniteElementSpace<3> &, const std::vector<Body> &,
                                         const Material &, const BodyMatrixChoice &);
  template BodyMatrices assemble_body<2>(const FiniteElementSpace<2> &, const std::vector<Body> &,
                                         const Material &, bool);
  template std::vector<std::shared_ptr<const Matrix>>
  assemble_stiffnesses<2>(const FiniteElementSpace<2> &, const std::vector<Body> &,
                          const Material &);
  template BodyMatrices assemble_body<3>(const FiniteElementSpace<3> &, const std::vector<Body> &,
                                         const Material &, bool);
  template std::vector<std::shared_ptr<const Matrix>>
  assemble_stiffnesses<3>(const FiniteElementSpace<3> &, const std::vector<Body> &,
                          const Material &);
  template MultiVector assemble_pressure_load<2>(const FiniteElementSpace<2> &);
  template MultiVector assemble_pressure_load<3>(const FiniteElementSpace<3> &);
} // namespace squeal
