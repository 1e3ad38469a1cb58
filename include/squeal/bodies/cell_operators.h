#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/mesh/element_cells.h>
#include <squeal/mesh/finite_element_space.h>
#include <squeal/parameters/materials.h>

#include <deal.II/fe/fe_values.h>

#include <petscsys.h>

#include <memory>
#include <vector>

namespace squeal
{
  /// Integrals over one cell of products of shape functions and their derivatives, all at once:
  ///
  ///     [ d_1 N ]           [ d_1 N ]^T
  ///     [ d_2 N ]           [ d_2 N ]
  /// int [ d_3 N ]           [ d_3 N ]         = one symmetric rank-k product of BLAS.
  ///     [   N   ]           [   N   ]
  ///     [ w.grad N ]        [ w.grad N ]
  ///
  /// Every matrix of a body is a combination of its n x n blocks, because the components of the
  /// displacement share the scalar shape functions N.
  template <int dim>
  class CellIntegrals
  {
  public:
    CellIntegrals(const FiniteElementSpace<dim> &spaces, bool with_transport);

    void reinit(const typename dealii::DoFHandler<dim>::active_cell_iterator &cell);
    /// Integrals over a whole element with own polynomials, of its own functions.
    void reinit(const OwnedElement &element);

    double derivatives(unsigned int j, unsigned int l, unsigned int a, unsigned int b) const
    {
      return products(j * n + a, l * n + b);
    }
    double values(unsigned int a, unsigned int b) const
    {
      return products(dim * n + a, dim * n + b);
    }
    double value_transport(unsigned int a, unsigned int b) const
    {
      return products(dim * n + a, (dim + 1) * n + b);
    }
    double transports(unsigned int a, unsigned int b) const
    {
      return products((dim + 1) * n + a, (dim + 1) * n + b);
    }

    unsigned int n; ///< functions of the cell or element

  private:
    void set_functions(unsigned int n_functions, unsigned int n_points);
    void multiply();

    unsigned int n_rows, n_points;
    const FiniteElementSpace<dim> &spaces;
    const bool with_transport;
    dealii::FEValues<dim> fe_values;
    std::unique_ptr<ElementQuadrature> elements; ///< if there are any
    std::vector<double> factors;
    DenseMatrix products;
  };

  /// The block (i, k) of the stiffness of a cell, K_ab^ik = C_ijkl int d_j N_a d_l N_b, i <= k; C
  /// as elasticity_tensor() gives it. @p block holds its *transpose*, which in columns is K in
  /// rows.
  template <int dim>
  void stiffness_block(const CellIntegrals<dim> &integrals,
                       const std::array<double, dim * dim * dim * dim> &C, unsigned int i,
                       unsigned int k, DenseMatrix &block);

  /// Where the entries of a cell go: its free nodes and, on cells with hanging nodes, the
  /// interpolation of the cell's nodes from them.
  template <int dim>
  class CellNodes
  {
  public:
    explicit CellNodes(const FiniteElementSpace<dim> &spaces)
        : local(spaces.fe.n_dofs_per_cell()), spaces(spaces)
    {
    }

    void reinit(const typename dealii::DoFHandler<dim>::active_cell_iterator &cell);
    void reinit(const OwnedElement &element);

    /// W^T A W on cells with hanging nodes, A elsewhere.
    const DenseMatrix &condense(const DenseMatrix &a);

    std::vector<dealii::types::global_dof_index> local, free;
    std::vector<std::vector<PetscInt>> equations; ///< per component; -1 (which PETSc skips): none
    bool hanging = false;
    DenseMatrix interpolation; ///< W, local nodes x free nodes; set only if some node hangs

  private:
    void find_equations();

    const FiniteElementSpace<dim> &spaces;
    DenseMatrix condensed;
  };
} // namespace squeal
