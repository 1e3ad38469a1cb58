#pragma once

#include <squeal/linalg/matrix.h>

#include <memory>

namespace squeal
{
  template <int dim>
  class FiniteElementSpace;

  /// The superelements of a scene on one mesh (theory.md, section 11). Their coordinates v are
  /// unknowns with the given matrices; the displacement v_n of each node that is held is that of
  /// the point x_n of the surfaces that is nearest to it,
  ///
  ///     v_n - sum_a N_a(x_n) u_a = 0,
  ///
  /// with three multipliers, the forces there: rows are as sparse as the shape functions.
  struct Superelements
  {
    std::shared_ptr<const Matrix> mass, damping; ///< null: there are none
    std::shared_ptr<const Matrix> stiffness;     ///< or null
    std::shared_ptr<const Matrix> holding;       ///< what holds the nodes; or null
    unsigned int n_active = 0;                   ///< multipliers
  };

  /// Assembles the superelements. Rows that hold nodes are as large as those of the bodies'
  /// @p stiffness, N/m. Collective.
  template <int dim>
  Superelements assemble_superelements(const FiniteElementSpace<dim> &spaces, double stiffness);
} // namespace squeal
