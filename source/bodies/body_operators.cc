#include <squeal/bodies/body_operators.h>
#include <squeal/bodies/cell_operators.h>
#include <squeal/linalg/compressed_rows.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/lac/dynamic_sparsity_pattern.h>
#include <deal.II/lac/sparsity_tools.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>

// Assembly of the bodies' matrices M, D, G, M*, K (theory.md, section 2). First where the blocks of
// a cell go in a matrix whose pattern is made exactly once; then one pass over the cells of a
// material for all matrices that are wanted; the stiffness by elastic constant; loads by pressure.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Where the blocks of a cell go in matrices of one pattern: all components coupled, or each
    /// component with itself only.
    template <int dim>
    class CellPlaces
    {
    public:
      explicit CellPlaces(const bool coupled) : coupled(coupled) {}

      /// @p blocks of any of the matrices.
      void reinit(const CellNodes<dim> &cell_nodes, const BlockAdder &blocks)
      {
        n        = cell_nodes.free.size();
        unknowns = cell_nodes.equations;
        for (unsigned int c = 1; c < dim && coupled; ++c)
          unknowns[0].insert(unknowns[0].end(), unknowns[c].begin(), unknowns[c].end());
        unknowns.resize(coupled ? 1 : dim);
        places.clear();
        for (const std::vector<PetscInt> &group : unknowns)
          places.push_back(blocks.places(group));
      }
      /// Adds A(a, b) between component i of node a and component k of node b. DenseMatrix is
      /// column-major and rows are expected, hence the transposed roles; all callers state their
      /// own symmetry.
      void add(const unsigned int i, const unsigned int k, const DenseMatrix &transposed,
               BlockAdder &blocks) const
      {
        const unsigned int group = coupled ? 0 : i;
        blocks.add(unknowns[group], places[group], coupled ? i * n : 0, coupled ? k * n : 0, n,
                   transposed.values.data());
      }

    private:
      const bool coupled;
      unsigned int n = 0;
      std::vector<std::vector<PetscInt>> unknowns, places; ///< by group of components
    };

    /// A matrix of zeros with the exact pattern of the bodies' cells: all components coupled, or
    /// each component with itself only.
    template <int dim>
    Matrix zero_matrix(const FiniteElementSpace<dim> &spaces, const DynamicSparsityPattern &graph,
                       const bool coupled)
    {
      const RowRange &rows = spaces.rows;
      // Looked up once: each node has some hundred neighbours.
      std::vector<std::array<unsigned int, dim>> equations(spaces.nodes.n_dofs());
      for (const auto node : spaces.relevant_nodes)
        for (unsigned int c = 0; c < dim; ++c)
          equations[node][c] = spaces.equation(node, c);
      constexpr unsigned int none = FiniteElementSpace<dim>::none;

      CompressedRows pattern;
      pattern.begins.assign(rows.n_local() + 1, 0);
      // Calls visit(row, column).
      const auto for_entries = [&](const auto node, const auto &visit)
      {
        for (unsigned int k = 0; k < graph.row_length(node); ++k)
          for (unsigned int d = 0; d < dim; ++d)
            if (const unsigned int column = equations[graph.column_number(node, k)][d];
                column != none)
              for (unsigned int c = coupled ? 0 : d; c < (coupled ? dim : d + 1); ++c)
                if (equations[node][c] != none)
                  visit(equations[node][c] - rows.begin, column);
      };
      for (const auto node : spaces.nodes.locally_owned_dofs())
        for_entries(node, [&](const unsigned int row, unsigned int) { ++pattern.begins[row + 1]; });
      std::partial_sum(pattern.begins.begin(), pattern.begins.end(), pattern.begins.begin());
      pattern.resize(pattern.begins.back());
      std::fill(pattern.values.begin(), pattern.values.end(), 0.);
      std::vector<PetscInt> ends(pattern.begins.begin(), pattern.begins.end() - 1);
      for (const auto node : spaces.nodes.locally_owned_dofs())
        for_entries(node, [&](const unsigned int row, const unsigned int column)
                    { pattern.columns[ends[row]++] = column; });
      for (unsigned int row = 0; row < rows.n_local(); ++row)
      {
        const auto first = pattern.columns.begin() + pattern.begins[row],
                   last  = pattern.columns.begin() + pattern.begins[row + 1];
        if (!std::is_sorted(first, last))
          std::sort(first, last);
      }
      Matrix matrix = make_matrix(rows, std::move(pattern));
      SQUEAL_PETSC(MatSetOption(matrix, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE));
      return matrix;
    }

    Matrix zeros_like(const Matrix &other)
    {
      Mat mat = nullptr;
      SQUEAL_PETSC(MatDuplicate(other, MAT_DO_NOT_COPY_VALUES, &mat));
      return Matrix(mat);
    }

    /// Adds int B C B^T of a cell.
    template <int dim>
    void add_stiffness(const CellIntegrals<dim> &integrals, CellNodes<dim> &cell_nodes,
                       const std::array<double, dim * dim * dim * dim> &tensor,
                       const CellPlaces<dim> &places, BlockAdder &blocks)
    {
      const unsigned int n = integrals.n;
      DenseMatrix block(n, n);
      // The block (k, i) of the stiffness is the transpose of (i, k): what is filled here is the
      // transpose of what is added.
      for (unsigned int i = 0; i < dim; ++i)
        for (unsigned int k = i; k < dim; ++k)
        {
          stiffness_block(integrals, tensor, i, k, block);
          places.add(i, k, cell_nodes.condense(block), blocks);
          if (i != k)
          {
            for (unsigned int a = 0; a < n; ++a)
              for (unsigned int b = 0; b < a; ++b)
                std::swap(block(b, a), block(a, b));
            places.add(k, i, cell_nodes.condense(block), blocks);
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

    /// Calls visit(cell) for the bodies' cells of this rank, visit(element) for its elements with
    /// own polynomials.
    template <int dim, typename Visit>
    void for_pieces(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                    const Visit &visit)
    {
      const auto belongs = [&](const types::material_id id)
      { return std::find(bodies.begin(), bodies.end(), id) != bodies.end(); };
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned() && belongs(cell->material_id()) &&
            !(cell->level() == 0 && spaces.geometry.own.has(cell->index())))
          visit(cell);
      if constexpr (dim == 3)
        for (const OwnedElement &element : owned_elements(spaces))
          if (belongs(element.material_id))
            visit(element);
    }

    /// Calls visit() at each of the bodies' cells of this rank, to which the others are set.
    template <int dim, typename Visit>
    void for_cells(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                   CellIntegrals<dim> &integrals, CellNodes<dim> &cell_nodes, const Visit &visit)
    {
      const auto visit_it = [&](const auto &cell)
      {
        integrals.reinit(cell);
        cell_nodes.reinit(cell);
        visit();
      };
      for_pieces(spaces, bodies, visit_it);
    }

    template <int dim>
    DynamicSparsityPattern node_graph(const FiniteElementSpace<dim> &spaces,
                                      const std::vector<Body> &bodies)
    {
      DynamicSparsityPattern graph(spaces.nodes.n_dofs(), spaces.nodes.n_dofs(),
                                   spaces.relevant_nodes);
      CellNodes<dim> cell_nodes(spaces);
      for_pieces(spaces, bodies,
                 [&](const auto &cell)
                 {
                   cell_nodes.reinit(cell);
                   std::vector<types::global_dof_index> sorted = cell_nodes.free;
                   std::sort(sorted.begin(), sorted.end());
                   for (const auto node : sorted)
                     graph.add_entries(node, sorted.begin(), sorted.end(), true);
                 });
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
    const auto C                       = elasticity_tensor<dim>(material);
    const auto C_v   = elasticity_tensor(ElasticModuli<dim>(material.viscosity, material.axis));
    const double rho = material.density;
    const bool with_transport = choice.G || choice.M_star;

    // One pattern each for all that couples components and all that does not
    Matrix K, V, M, G, M_star;
    std::unique_ptr<BlockAdder> to_K, to_V, to_M, to_G, to_M_star;
    const auto make = [&](Matrix &matrix, std::unique_ptr<BlockAdder> &blocks, const Matrix &other,
                          const bool coupled)
    {
      matrix = other ? zeros_like(other) : zero_matrix(spaces, graph, coupled);
      blocks = std::make_unique<BlockAdder>(matrix, spaces.rows);
    };
    if (choice.K)
      make(K, to_K, {}, true);
    if (choice.V)
      make(V, to_V, K, true);
    if (choice.M)
      make(M, to_M, {}, false);
    if (choice.G)
      make(G, to_G, M, false);
    if (choice.M_star)
      make(M_star, to_M_star, M ? M : G, false);
    // Any of the matrices of one pattern tells the places.
    const BlockAdder *const coupled_blocks    = to_K ? to_K.get() : to_V.get(),
                            *const own_blocks = to_M   ? to_M.get()
                                                : to_G ? to_G.get()
                                                       : to_M_star.get();
    CellPlaces<dim> coupled_places(true), own_places(false);

    CellIntegrals<dim> integrals(spaces, with_transport);
    CellNodes<dim> cell_nodes(spaces);
    DenseMatrix block;
    const auto add_cell = [&]()
    {
      const unsigned int n = integrals.n;
      if (block.n_rows != n)
        block = DenseMatrix(n, n);
      if (coupled_blocks)
        coupled_places.reinit(cell_nodes, *coupled_blocks);
      if (own_blocks)
        own_places.reinit(cell_nodes, *own_blocks);
      if (to_K)
        add_stiffness(integrals, cell_nodes, C, coupled_places, *to_K);
      if (to_V)
        add_stiffness(integrals, cell_nodes, C_v, coupled_places, *to_V);

      // The same for every component
      const auto add_each_component =
          [&](const std::unique_ptr<BlockAdder> &blocks, const auto &entry)
      {
        if (!blocks)
          return;
        for (unsigned int a = 0; a < n; ++a)
          for (unsigned int b = 0; b < n; ++b)
            block(b, a) = rho * entry(a, b);
        const DenseMatrix &condensed = cell_nodes.condense(block);
        for (unsigned int c = 0; c < dim; ++c)
          own_places.add(c, c, condensed, *blocks);
      };
      // M_ab = int rho N_a N_b
      add_each_component(to_M, [&](const unsigned int a, const unsigned int b)
                         { return integrals.values(a, b); });
      // G_ab = 1/2 int rho (N_a d_phi N_b - d_phi N_a N_b)
      add_each_component(
          to_G, [&](const unsigned int a, const unsigned int b)
          { return (integrals.value_transport(a, b) - integrals.value_transport(b, a)) / 2; });
      // M*_ab = int rho d_phi N_a d_phi N_b
      add_each_component(to_M_star, [&](const unsigned int a, const unsigned int b)
                         { return integrals.transports(a, b); });
    };
    for_cells(spaces, bodies, integrals, cell_nodes, add_cell);
    for (std::unique_ptr<BlockAdder> *blocks : {&to_K, &to_V, &to_M, &to_G, &to_M_star})
      blocks->reset();
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
      matrices.push_back(matrices.empty() ? zero_matrix(spaces, graph, true)
                                          : zeros_like(matrices.front()));
      tensors.push_back(elasticity_tensor(component.law));
    }
    std::vector<std::unique_ptr<BlockAdder>> blocks;
    for (const Matrix &matrix : matrices)
      blocks.push_back(std::make_unique<BlockAdder>(matrix, spaces.rows));
    CellPlaces<dim> places(true);
    CellIntegrals<dim> integrals(spaces, false);
    CellNodes<dim> cell_nodes(spaces);
    for_cells(spaces, bodies, integrals, cell_nodes,
              [&]()
              {
                places.reinit(cell_nodes, *blocks.front());
                for (unsigned int k = 0; k < matrices.size(); ++k)
                  add_stiffness(integrals, cell_nodes, tensors[k], places, *blocks[k]);
              });
    blocks.clear();
    std::vector<std::shared_ptr<const Matrix>> result;
    for (Matrix &matrix : matrices)
      result.push_back(shared_matrix(matrix));
    return result;
  }

  template <int dim>
  MultiVector assemble_pressure_load(const FiniteElementSpace<dim> &spaces,
                                     const std::function<double(const PressureLoad<dim> &)> &factor)
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
              const double scale = factor ? factor(pressure_load) : 1;
              for (unsigned int a = 0; a < n; ++a)
              {
                // f_a = int -p n N_a
                Tensor<1, dim> force;
                for (const unsigned int q : fe_values.quadrature_point_indices())
                  force -= scale * pressure_load.pressure(fe_values.quadrature_point(q)) *
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
  template MultiVector
  assemble_pressure_load<2>(const FiniteElementSpace<2> &,
                            const std::function<double(const PressureLoad<2> &)> &);
  template MultiVector
  assemble_pressure_load<3>(const FiniteElementSpace<3> &,
                            const std::function<double(const PressureLoad<3> &)> &);
} // namespace squeal
