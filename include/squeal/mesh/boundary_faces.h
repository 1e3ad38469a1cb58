#pragma once

#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_values.h>

#include <set>

namespace squeal
{
  /// Calls function(cell, values) for this rank's faces with one of the boundary ids, with what is
  /// wanted at points that integrate products of two functions there.
  template <int dim, typename Function>
  void for_boundary_faces(const FiniteElementSpace<dim> &spaces,
                          const std::set<dealii::types::boundary_id> &boundaries,
                          const dealii::UpdateFlags wanted, const Function &function)
  {
    dealii::FEFaceValues<dim> values(spaces.mapping, spaces.fe,
                                     dealii::QGauss<dim - 1>(spaces.fe.degree + 2), wanted);
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned())
        for (const unsigned int f : cell->face_indices())
          if (cell->face(f)->at_boundary() && boundaries.count(cell->face(f)->boundary_id()) > 0)
          {
            values.reinit(cell, f);
            function(cell, values);
          }
  }
} // namespace squeal
