#include <squeal/bodies/cell_operators.h>
#include <squeal/bodies/displacement_multigrid.h>
#include <squeal/linalg/petsc_vector_view.h>
#include <squeal/mesh/cell_map.h>

#include <deal.II/dofs/dof_tools.h>
#include <deal.II/lac/dynamic_sparsity_pattern.h>
#include <deal.II/lac/sparsity_tools.h>

#include <petscksp.h>

#include <algorithm>

// Multigrid for the displacements without a matrix of the present degree, in this order: the matrix
// of elements of degree 1 on the same mesh and its rigid-body motions; interpolation between both
// degrees; products with the matrix-free operator for PETSc; the algebraic cycle on degree 1
// (GAMG or BoomerAMG); set_up() with the contact's part, and the Chebyshev smoother around it.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// The rows of a component of a cell's nodes of degree 1; -1: fixed.
    template <int dim>
    std::vector<PetscInt> coarse_rows_of(const CellNodes<dim> &nodes, const unsigned int c)
    {
      std::vector<PetscInt> rows;
      for (unsigned int a = 0; a < nodes.free.size(); ++a)
        rows.push_back(nodes.equations[c][a] < 0 ? -1 : PetscInt(dim * nodes.free[a] + c));
      return rows;
    }
  } // namespace

  template <int dim>
  DisplacementMultigrid<dim>::DisplacementMultigrid(const FiniteElementSpace<dim> &spaces,
                                                    const std::vector<MaterialOperator> &bodies,
                                                    const DisplacementOperator<dim> &stiffness,
                                                    const Multigrid algebraic)
      : spaces(spaces), algebraic(algebraic), coarse(spaces, 1), fine{stiffness, nullptr, {}, 0}
  {
    coarse.distribute();
    const IndexSet &owned = coarse.nodes.locally_owned_dofs();
    coarse_rows.comm      = spaces.comm;
    coarse_rows.size      = dim * owned.size();
    coarse_rows.begin     = owned.n_elements() > 0 ? dim * owned.nth_index_in_set(0) : 0;
    coarse_rows.end       = coarse_rows.begin + dim * owned.n_elements();
    interpolation         = make_interpolation();
    of_bodies             = assemble_coarse(bodies);
  }

  template <int dim>
  DisplacementMultigrid<dim>::~DisplacementMultigrid()
  {
    destroy();
  }

  template <int dim>
  void DisplacementMultigrid<dim>::destroy()
  {
    if (cycle)
      PCDestroy(&cycle);
  }

  template <int dim>
  Matrix DisplacementMultigrid<dim>::new_coarse_matrix() const
  {
    const IndexSet &owned = coarse.nodes.locally_owned_dofs();
    DynamicSparsityPattern graph(owned.size(), owned.size(), coarse.relevant_nodes);
    DoFTools::make_sparsity_pattern(coarse.nodes, graph, coarse.hanging, true);
    SparsityTools::distribute_sparsity_pattern(graph, owned, coarse.comm, coarse.relevant_nodes);
    std::vector<PetscInt> diagonal, off_diagonal;
    for (const auto node : owned)
    {
      PetscInt n_own = 0;
      for (unsigned int k = 0; k < graph.row_length(node); ++k)
        n_own += owned.is_element(graph.column_number(node, k));
      diagonal.insert(diagonal.end(), dim, dim * n_own);
      off_diagonal.insert(off_diagonal.end(), dim, dim * (graph.row_length(node) - n_own));
    }
    Mat mat = nullptr;
    SQUEAL_PETSC(MatCreate(coarse.comm, &mat));
    Matrix matrix(mat);
    const PetscInt n = coarse_rows.n_local(), n_global = coarse_rows.size;
    SQUEAL_PETSC(MatSetSizes(mat, n, n, n_global, n_global));
    SQUEAL_PETSC(MatSetBlockSize(mat, dim));
    SQUEAL_PETSC(MatSetType(mat, MATAIJ));
    SQUEAL_PETSC(MatSeqAIJSetPreallocation(mat, 0, diagonal.data()));
    SQUEAL_PETSC(MatMPIAIJSetPreallocation(mat, 0, diagonal.data(), 0, off_diagonal.data()));
    return matrix;
  }

  template <int dim>
  Matrix
  DisplacementMultigrid<dim>::assemble_coarse(const std::vector<MaterialOperator> &bodies) const
  {
    Matrix matrix = new_coarse_matrix();
    CellIntegrals<dim> integrals(coarse, false);
    CellNodes<dim> cell_nodes(coarse);
    DenseMatrix block(integrals.n, integrals.n);
    const auto add_block =
        [&](const std::vector<PetscInt> &rows, const std::vector<PetscInt> &columns)
    {
      SQUEAL_PETSC(MatSetValues(matrix, rows.size(), rows.data(), columns.size(), columns.data(),
                                cell_nodes.condense(block).values.data(), ADD_VALUES));
    };
    double largest = 0;
    for (const auto &cell : coarse.nodes.active_cell_iterators())
    {
      if (!cell->is_locally_owned())
        continue;
      const auto is_of = [&](const MaterialOperator &body)
      {
        return std::find(body.bodies.begin(), body.bodies.end(), cell->material_id()) !=
               body.bodies.end();
      };
      const auto C =
          elasticity_tensor<dim>(std::find_if(bodies.begin(), bodies.end(), is_of)->material);
      integrals.reinit(cell);
      cell_nodes.reinit(cell);
      // As in assemble_body(): the block holds the transpose of what is added.
      for (unsigned int i = 0; i < dim; ++i)
        for (unsigned int k = i; k < dim; ++k)
        {
          stiffness_block(integrals, C, i, k, block);
          const auto rows = coarse_rows_of(cell_nodes, i), columns = coarse_rows_of(cell_nodes, k);
          add_block(rows, columns);
          for (unsigned int a = 0; a < integrals.n; ++a)
          {
            largest = std::max(largest, block(a, a));
            for (unsigned int b = 0; b < a; ++b)
              std::swap(block(b, a), block(a, b));
          }
          if (i != k)
            add_block(columns, rows);
        }
    }
    // Fixed components and hanging nodes are zero.
    largest = Utilities::MPI::max(largest, coarse.comm);
    for (const auto node : coarse.nodes.locally_owned_dofs())
      for (unsigned int c = 0; c < dim; ++c)
        if (coarse.equation(node, c) == FiniteElementSpace<dim>::none)
          SQUEAL_PETSC(MatSetValue(matrix, dim * node + c, dim * node + c, largest, ADD_VALUES));
    compress(matrix);
    return matrix;
  }

  template <int dim>
  void DisplacementMultigrid<dim>::set_rigid_body_motions(const Matrix &matrix) const
  {
    MultiVector positions(coarse_rows, 1);
    for (const auto &cell : coarse.nodes.active_cell_iterators())
      if (cell->is_locally_owned())
        for (const unsigned int v : cell->vertex_indices())
          for (unsigned int c = 0; c < dim; ++c)
            if (const unsigned int row = dim * cell->vertex_dof_index(v, 0) + c;
                coarse_rows.contains(row))
              positions.data()[row - coarse_rows.begin] = cell->vertex(v)[c];
    const PetscVectorView borrowed(coarse_rows, positions.data());
    SQUEAL_PETSC(VecSetBlockSize(borrowed, dim));
    MatNullSpace motions = nullptr;
    SQUEAL_PETSC(MatNullSpaceCreateRigidBody(borrowed, &motions));
    SQUEAL_PETSC(MatSetNearNullSpace(matrix, motions));
    SQUEAL_PETSC(MatNullSpaceDestroy(&motions));
  }

  /// A node of degree p, in any of its cells, is a combination of the cell's vertices.
  template <int dim>
  Matrix DisplacementMultigrid<dim>::make_interpolation() const
  {
    const DenseMatrix from_vertices = squeal::interpolation(coarse.fe, spaces.fe);
    const IndexSet &owned           = spaces.nodes.locally_owned_dofs();
    std::vector<bool> visited(owned.n_elements());
    std::vector<types::global_dof_index> nodes(spaces.fe.n_dofs_per_cell()),
        vertices(coarse.fe.n_dofs_per_cell());
    std::vector<PetscInt> rows, columns;
    std::vector<PetscScalar> values;
    auto coarse_cell = coarse.nodes.begin_active();
    for (const auto &cell : spaces.nodes.active_cell_iterators())
    {
      if (cell->is_locally_owned())
      {
        cell->get_dof_indices(nodes);
        coarse_cell->get_dof_indices(vertices);
        for (unsigned int a = 0; a < nodes.size(); ++a)
        {
          if (!owned.is_element(nodes[a]) || visited[owned.index_within_set(nodes[a])] ||
              spaces.hanging.is_constrained(nodes[a]))
            continue;
          visited[owned.index_within_set(nodes[a])] = true;
          for (unsigned int v = 0; v < vertices.size(); ++v)
            if (std::abs(from_vertices(a, v)) > 1e-12)
              for (const WeightedNode &w : coarse.expand(vertices[v]))
                for (unsigned int c = 0; c < dim; ++c)
                {
                  const unsigned int row = spaces.equation(nodes[a], c);
                  if (row == FiniteElementSpace<dim>::none ||
                      coarse.equation(w.node, c) == FiniteElementSpace<dim>::none)
                    continue;
                  rows.push_back(row);
                  columns.push_back(dim * w.node + c);
                  values.push_back(w.weight * from_vertices(a, v));
                }
        }
      }
      ++coarse_cell;
    }
    Mat mat = nullptr;
    SQUEAL_PETSC(MatCreate(spaces.comm, &mat));
    Matrix matrix(mat);
    SQUEAL_PETSC(MatSetSizes(mat, spaces.rows.n_local(), coarse_rows.n_local(), spaces.rows.size,
                             coarse_rows.size));
    SQUEAL_PETSC(MatSetType(mat, MATAIJ));
    SQUEAL_PETSC(MatSetPreallocationCOO(mat, rows.size(), rows.data(), columns.data()));
    SQUEAL_PETSC(MatSetValuesCOO(mat, values.data(), ADD_VALUES));
    return matrix;
  }

  template <int dim>
  PetscErrorCode DisplacementMultigrid<dim>::multiply(Mat mat, Vec in, Vec out)
  {
    Fine *fine = nullptr;
    PetscCall(MatShellGetContext(mat, &fine));
    MultiVector x(fine->diagonal.row_range(), 1);
    const PetscScalar *from = nullptr;
    PetscCall(VecGetArrayRead(in, &from));
    std::copy_n(from, x.n_local(), x.data());
    PetscCall(VecRestoreArrayRead(in, &from));
    // Contact sees displacements only; the rows of multipliers say that these stay what they are.
    std::vector<double> multipliers(x.data() + fine->n_displacements, x.data() + x.n_local());
    std::fill(x.data() + fine->n_displacements, x.data() + x.n_local(), 0.);
    const MultiVector y = fine->stiffness.multiply(x);
    {
      const PetscVectorView displacements(x.row_range(), x.data());
      PetscCall(MatMult(fine->contact, displacements, out));
    }
    PetscScalar *to = nullptr;
    PetscCall(VecGetArray(out, &to));
    for (unsigned int i = 0; i < fine->n_displacements; ++i)
      to[i] += y.data()[i];
    std::copy(multipliers.begin(), multipliers.end(), to + fine->n_displacements);
    PetscCall(VecRestoreArray(out, &to));
    return 0;
  }

  template <int dim>
  PetscErrorCode DisplacementMultigrid<dim>::get_diagonal(Mat mat, Vec out)
  {
    Fine *fine = nullptr;
    PetscCall(MatShellGetContext(mat, &fine));
    PetscScalar *to = nullptr;
    PetscCall(VecGetArrayWrite(out, &to));
    std::copy_n(fine->diagonal.data(), fine->diagonal.n_local(), to);
    PetscCall(VecRestoreArrayWrite(out, &to));
    return 0;
  }

  template <int dim>
  void DisplacementMultigrid<dim>::set_algebraic(PC pc) const
  {
    SQUEAL_PETSC(PCSetOperators(pc, with_contact, with_contact));
    SQUEAL_PETSC(PCSetOptionsPrefix(pc, "static_"));
    SQUEAL_PETSC(PCSetType(pc, algebraic == Multigrid::gamg ? PCGAMG
                               : algebraic == Multigrid::ml ? PCML
                                                            : PCHYPRE));
    const auto set = [](const std::string &key, const char *value)
    { SQUEAL_PETSC(PetscOptionsSetValue(nullptr, ("-static_" + key).c_str(), value)); };
    if (algebraic == Multigrid::gamg)
      // Bodies are a few cells thick: aggregates of neighbours, not of neighbours' neighbours.
      set("pc_gamg_aggressive_coarsening", "0");
    else if (algebraic == Multigrid::boomeramg)
    {
      // Interpolation that knows the rotations (Baker, Kolev, Yang 2010).
      SQUEAL_PETSC(PCHYPRESetType(pc, "boomeramg"));
      set("pc_hypre_boomeramg_nodal_coarsen", "4");
      set("pc_hypre_boomeramg_vec_interp_variant", "2");
      set("pc_hypre_boomeramg_strong_threshold", "0.5");
    }
    SQUEAL_PETSC(PCSetFromOptions(pc));
  }

  template <int dim>
  void DisplacementMultigrid<dim>::set_up(const Matrix &contact)
  {
    destroy();
    Mat added = nullptr, sum = nullptr;
    SQUEAL_PETSC(MatPtAP(contact, interpolation, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &added));
    const Matrix of_contact(added);
    SQUEAL_PETSC(MatDuplicate(of_bodies, MAT_COPY_VALUES, &sum));
    with_contact = Matrix(sum);
    SQUEAL_PETSC(MatAXPY(sum, 1, added, DIFFERENT_NONZERO_PATTERN));
    SQUEAL_PETSC(MatSetBlockSize(sum, dim));
    SQUEAL_PETSC(MatSetOption(sum, MAT_SPD, PETSC_TRUE));
    set_rigid_body_motions(with_contact);

    SQUEAL_PETSC(PCCreate(spaces.comm, &cycle));
    if (spaces.fe.degree == 1)
      set_algebraic(cycle);
    else
    {
      set_fine_matrix(contact);
      set_cycle();
    }
    SQUEAL_PETSC(PCSetUp(cycle));
  }

  template <int dim>
  void DisplacementMultigrid<dim>::set_fine_matrix(const Matrix &contact)
  {
    fine.contact         = contact;
    fine.n_displacements = spaces.first_local_multiplier - spaces.rows.begin;
    fine.diagonal        = MultiVector(spaces.rows, 1);
    SQUEAL_PETSC(MatGetDiagonal(contact, PetscVectorView(spaces.rows, fine.diagonal.data())));
    for (unsigned int i = 0; i < fine.n_displacements; ++i)
      fine.diagonal.data()[i] += fine.stiffness.diagonal().data()[i];
    std::fill(fine.diagonal.data() + fine.n_displacements,
              fine.diagonal.data() + fine.diagonal.n_local(), 1.);
    Mat shell        = nullptr;
    const PetscInt n = spaces.rows.n_local(), n_global = spaces.rows.size;
    SQUEAL_PETSC(MatCreateShell(spaces.comm, n, n, n_global, n_global, &fine, &shell));
    fine_matrix = Matrix(shell);
    SQUEAL_PETSC(MatShellSetOperation(shell, MATOP_MULT, reinterpret_cast<void (*)()>(multiply)));
    SQUEAL_PETSC(MatShellSetOperation(shell, MATOP_GET_DIAGONAL,
                                      reinterpret_cast<void (*)()>(get_diagonal)));
  }

  template <int dim>
  void DisplacementMultigrid<dim>::set_cycle()
  {
    // Degree 1 is cheap beside the products on degree p.
    constexpr unsigned int smoothing_steps = 3, algebraic_cycles = 2;
    // Chebyshev's interval is [smallest, largest] times the estimated largest eigenvalue.
    constexpr double smallest = 0.1, largest = 1.1;
    SQUEAL_PETSC(PCSetOperators(cycle, fine_matrix, fine_matrix));
    SQUEAL_PETSC(PCSetOptionsPrefix(cycle, "fine_"));
    SQUEAL_PETSC(PCSetType(cycle, PCMG));
    SQUEAL_PETSC(PCMGSetLevels(cycle, 2, nullptr));
    SQUEAL_PETSC(PCMGSetGalerkin(cycle, PC_MG_GALERKIN_NONE));
    SQUEAL_PETSC(PCMGSetInterpolation(cycle, 1, interpolation));
    SQUEAL_PETSC(PCMGSetNumberSmooth(cycle, smoothing_steps));
    KSP smoother = nullptr, below = nullptr;
    PC pc = nullptr;
    SQUEAL_PETSC(PCMGGetSmoother(cycle, 1, &smoother));
    SQUEAL_PETSC(KSPSetOperators(smoother, fine_matrix, fine_matrix));
    SQUEAL_PETSC(KSPSetType(smoother, KSPCHEBYSHEV));
    SQUEAL_PETSC(KSPChebyshevEstEigSet(smoother, 0, smallest, 0, largest));
    SQUEAL_PETSC(KSPGetPC(smoother, &pc));
    SQUEAL_PETSC(PCSetType(pc, PCJACOBI));
    SQUEAL_PETSC(PCMGGetCoarseSolve(cycle, &below));
    SQUEAL_PETSC(KSPSetOperators(below, with_contact, with_contact));
    SQUEAL_PETSC(KSPSetType(below, KSPRICHARDSON));
    SQUEAL_PETSC(KSPSetNormType(below, KSP_NORM_NONE));
    SQUEAL_PETSC(
        KSPSetTolerances(below, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, algebraic_cycles));
    SQUEAL_PETSC(KSPGetPC(below, &pc));
    set_algebraic(pc);
    SQUEAL_PETSC(PCSetFromOptions(cycle));
  }

  template <int dim>
  MultiVector DisplacementMultigrid<dim>::apply(const MultiVector &right_hand_side) const
  {
    MultiVector b = right_hand_side, x(spaces.rows, 1);
    std::fill(b.data() + (spaces.first_local_multiplier - spaces.rows.begin),
              b.data() + b.n_local(), 0.);
    const PetscVectorView in(spaces.rows, b.data()), out(spaces.rows, x.data());
    if (spaces.fe.degree > 1)
    {
      SQUEAL_PETSC(PCApply(cycle, in, out));
      return x;
    }
    MultiVector b_1(coarse_rows, 1), x_1(coarse_rows, 1);
    const PetscVectorView in_1(coarse_rows, b_1.data()), out_1(coarse_rows, x_1.data());
    SQUEAL_PETSC(MatMultTranspose(interpolation, in, in_1));
    SQUEAL_PETSC(PCApply(cycle, in_1, out_1));
    SQUEAL_PETSC(MatMult(interpolation, out_1, out));
    return x;
  }

  template class DisplacementMultigrid<2>;
  template class DisplacementMultigrid<3>;
} // namespace squeal
