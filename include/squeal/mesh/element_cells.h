#pragma once

#include <squeal/mesh/finite_element_space.h>

#include <deal.II/dofs/dof_handler.h>

#include <vector>

namespace squeal
{
  /// The cells of an element with own polynomials, as one rank sees them.
  struct ElementCells
  {
    unsigned int element;
    std::vector<dealii::DoFHandler<3>::active_cell_iterator> cells; ///< own and ghost ones
  };

  /// Groups own and ghost cells by elements, which come in ascending order.
  std::vector<ElementCells> group_by_elements(const dealii::DoFHandler<3> &nodes,
                                              const OwnElements &own);

  /// The element's own nodes. Those of cells that the rank does not see are invalid.
  std::vector<dealii::types::global_dof_index>
  nodes_of_element(const ElementCells &element, const OwnElements &own,
                   ElementInterpolation &interpolation);

  /// How a field's nodes of cells follow from the elements' own nodes.
  inline ElementInterpolation interpolation_of(const FiniteElementSpace<3> &spaces,
                                               const unsigned int field)
  {
    return {spaces.fe.get_unit_support_points(), spaces.fe.degree,
            spaces.degree_on_elements(field)};
  }
} // namespace squeal
