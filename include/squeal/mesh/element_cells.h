#pragma once

#include <squeal/mesh/finite_element_space.h>

#include <deal.II/dofs/dof_handler.h>

#include <algorithm>
#include <map>
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

  /// The cell whose rank an element belongs to: that with the lowest number in the coarse mesh.
  inline const dealii::DoFHandler<3>::active_cell_iterator &first_cell(const ElementCells &element)
  {
    return *std::min_element(element.cells.begin(), element.cells.end(),
                             [](const auto &a, const auto &b) { return a->index() < b->index(); });
  }

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

  /// An element with own polynomials whose first cell is this rank's.
  struct OwnedElement
  {
    ElementShape shape;
    dealii::types::material_id material_id;
    std::vector<dealii::types::global_dof_index> nodes; ///< own ones of displacements
  };
  std::vector<OwnedElement> owned_elements(const FiniteElementSpace<3> &spaces);

  /// Quadrature on whole elements with own polynomials, exact up to degree 2 p + 3 for functions of
  /// degree p on straight ones.
  class ElementQuadrature
  {
  public:
    /// @p spaces have the positions of nodes: elements are polynomials through these.
    explicit ElementQuadrature(const FiniteElementSpace<3> &spaces);

    struct Reference
    {
      std::vector<dealii::Point<3>> points;
      std::vector<double> weights;
      DenseMatrix functions; ///< of the space, ElementInterpolation::nodal_functions()
    };
    const Reference &reference(ElementShape shape);

    /// The points of an element, the inverse Jacobians (e, d): d xi_e / d x_d, the weights. Throws
    /// SolverError where the element is turned inside out.
    void reinit(ElementShape shape, const std::vector<dealii::types::global_dof_index> &nodes);
    std::vector<dealii::Point<3>> points;
    std::vector<dealii::Tensor<2, 3>> inverse;
    std::vector<double> jxw;

    ElementInterpolation interpolation; ///< of displacements

  private:
    const FiniteElementSpace<3> &spaces;
    std::map<ElementShape, Reference> references;
  };
} // namespace squeal
