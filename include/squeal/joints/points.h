#pragma once

#include <squeal/linalg/matrix.h>

#include <deal.II/base/point.h>

#include <array>
#include <memory>
#include <vector>

namespace squeal
{
  template <int dim>
  class FiniteElementSpace;

  /// The points of a scene on one mesh, with their masses, springs, dashpots and rigid links
  /// (theory.md, section 11). A point's motions r = (r_t, r_r) are unknowns, defined by
  /// multipliers,
  ///
  ///     r_t = 1/|A| int_A u da,   r_r = J^{-1} int_A (x - x_c) x u da,
  ///     J = int_A |x - x_c|^2 1 - (x - x_c)(x - x_c)^T da,
  ///
  /// so that no row couples all nodes of a surface with all of another. The unknown of a rotation
  /// is L r_r with the point's @p lengths: then all unknowns are lengths.
  struct Points
  {
    std::shared_ptr<const Matrix> mass, damping; ///< null: there are none
    std::shared_ptr<const Matrix> stiffness;     ///< springs, definitions and links; or null
    unsigned int n_active = 0;                   ///< multipliers that define or link
    std::vector<dealii::Point<3>> places;        ///< x_c, m
    std::vector<double> lengths;                 ///< L, m
  };

  /// Assembles the points. Rows of definitions are as large as those of the bodies' @p stiffness,
  /// N/m. Throws SolverError where a surface is a line. Collective.
  template <int dim>
  Points assemble_points(const FiniteElementSpace<dim> &spaces, double stiffness);
} // namespace squeal
