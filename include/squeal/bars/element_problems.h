#pragma once

#include <squeal/bars/enriched_space.h>
#include <squeal/bars/local_problems.h>
#include <squeal/mesh/element_cells.h>
#include <squeal/mesh/element_functions.h>

#include <map>
#include <vector>

namespace squeal
{
  /// Sets up the local problems of elements with own polynomials (OwnElements): on all cells of an
  /// element together, with the functions that one degree more adds to the element (theory.md,
  /// section 6). Pressures and tractions have those of degree 2.
  class ElementProblems
  {
  public:
    using Element = CellMap<3>::Element;

    /// @p local has the parts of contacts and ties.
    ElementProblems(const EnrichedSpace<3> &space, CellResiduals<3> &integrals,
                    LocalProblems<3> &local);

    /// How stiffly the element resists forces at its unknowns, as LocalProblems::resistance().
    std::vector<double> resistance(const Element &element, const Material &material);
    /// Unknowns are field times n_functions() plus function.
    LocalProblem make(const Element &element, const Material &material);
    /// The matrix with the element's functions of V_h giving way, as YieldingCells::soften().
    DenseMatrix soften(const Element &element, const LocalProblem &problem,
                       const Material &material);
    unsigned int n_functions(ElementShape shape);
    /// Values of the added functions of a field at own nodes: (own node, function).
    const DenseMatrix &values(ElementShape shape, unsigned int field);

  private:
    /// Holds a shape's functions by their values and derivatives.
    struct Functions
    {
      ElementFunctions moves, multipliers;
      DenseMatrix moves_at_nodes, multipliers_at_nodes; ///< (own node, function)
      DenseMatrix base_at_nodes;
      /// For CellResiduals::stiffness(): of the added functions, and of these with V_h's after
      /// them.
      DenseMatrix derivatives_of_moves, derivatives_of_all;
      std::vector<std::uint8_t> carrier_of_node;
      unsigned int n_functions; ///< of the more numerous ones
    };
    /// Holds the functions by their values at a cell's nodes, (node of the cell, function), for
    /// each way in which the cell's vertices lie in its element.
    struct OnCell
    {
      DenseMatrix moves, multipliers;
    };
    Functions &functions_of(ElementShape shape);
    OnCell &on_cell(const Element &element, const LocalProblems<3>::CellIterator &cell);
    const std::array<std::uint8_t, 8> &between(const LocalProblems<3>::CellIterator &cell) const
    {
      return space.base.geometry.own.cells[cell->index()].between;
    }
    /// Tells which functions, by component and number, move no node without an equation. @p
    /// at_nodes has their values: (own node, function).
    static std::vector<bool> free_functions(const Element &element, const DenseMatrix &at_nodes);
    /// The stiffness of the added functions, or with @p with_base of those and V_h's.
    DenseMatrix stiffness_of(const Element &element, const Material &material, bool with_base);
    /// The corners of an element's face on which a cell's face lies.
    std::uint8_t corners_of(const LocalProblems<3>::CellIterator &cell, unsigned int face) const;
    void add_pressures(const Element &element, std::uint8_t corners, std::vector<int> &kept);

    const EnrichedSpace<3> &space;
    CellResiduals<3> &integrals;
    LocalProblems<3> &local;
    ElementInterpolation of_displacements, of_multipliers;
    dealii::FEFaceValues<3> face_values;
    std::map<ElementShape, Functions> functions;
    std::map<std::pair<ElementShape, std::array<std::uint8_t, 8>>, OnCell> cells;
  };
} // namespace squeal
