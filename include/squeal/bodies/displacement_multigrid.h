#pragma once

#include <squeal/bodies/displacement_operator.h>
#include <squeal/parameters/choices.h>

#include <petscpc.h>

#include <memory>
#include <string>
#include <vector>

namespace squeal
{
  /// A preconditioner for the displacements of the static equilibrium: one V-cycle from degree p to
  /// degree 1 on the same mesh, where algebraic multigrid that knows the rigid-body motions goes
  /// on. Smoothing on degree p is Chebyshev's iteration with the diagonal (Adams, Brezina, Hu,
  /// Tuminaro 2003): it needs products only. With p = 1, algebraic multigrid alone.
  ///
  /// The matrix of degree 1 has an unknown for each component of each node, so that its blocks are
  /// those of nodes; the rows of fixed components and of hanging nodes say that these are zero.
  template <int dim>
  class DisplacementMultigrid
  {
  public:
    /// @p spaces and @p stiffness must outlive it unchanged.
    DisplacementMultigrid(const FiniteElementSpace<dim> &spaces,
                          const std::vector<MaterialOperator> &bodies,
                          const DisplacementOperator<dim> &stiffness, Multigrid algebraic);
    ~DisplacementMultigrid();
    DisplacementMultigrid(const DisplacementMultigrid &)            = delete;
    DisplacementMultigrid &operator=(const DisplacementMultigrid &) = delete;

    /// Sets the cycle up for the stiffness and that of contact, a symmetric matrix of whose rows
    /// and columns those of displacements are taken. It must stay until the next call.
    void set_up(const Matrix &contact);

    /// One cycle; zero in the rows of multipliers.
    MultiVector apply(const MultiVector &right_hand_side) const;

    /// The number of unknowns of degree 1.
    unsigned int n_coarse() const
    {
      return coarse_rows.size;
    }

  private:
    /// What the fine matrix is made of, for PETSc to call back to.
    struct Fine
    {
      const DisplacementOperator<dim> &stiffness;
      Mat contact = nullptr;
      MultiVector diagonal;
      unsigned int n_displacements = 0; ///< rows of this rank
    };
    static PetscErrorCode multiply(Mat mat, Vec in, Vec out);
    static PetscErrorCode get_diagonal(Mat mat, Vec out);

    Matrix new_coarse_matrix() const;
    Matrix assemble_coarse(const std::vector<MaterialOperator> &bodies) const;
    Matrix make_interpolation() const;
    void set_rigid_body_motions(const Matrix &matrix) const;
    void set_fine_matrix(const Matrix &contact);
    void set_cycle();
    void set_algebraic(PC pc) const;
    void destroy();

    const FiniteElementSpace<dim> &spaces;
    const Multigrid algebraic;
    FiniteElementSpace<dim> coarse;
    RowRange coarse_rows;
    Matrix interpolation; ///< degree p from degree 1
    Matrix of_bodies;     ///< of degree 1
    Matrix with_contact;  ///< of degree 1
    Matrix fine_matrix;   ///< a shell
    Fine fine;
    PC cycle = nullptr;
  };
} // namespace squeal
