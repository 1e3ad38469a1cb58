#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/linalg/multi_vector.h>
#include <squeal/mesh/cell_map.h>
#include <squeal/mesh/finite_element_space.h>

#include <functional>
#include <map>
#include <utility>
#include <vector>

namespace squeal
{
  /// The space V+ of one degree more than V_h on the same mesh, and the interpolation into it.
  template <int dim>
  class EnrichedSpace
  {
  public:
    /// Collective. @p base must outlive it.
    explicit EnrichedSpace(const FiniteElementSpace<dim> &base);

    /// The functions of a cell in V+: a row a node, the dim components of a column side by side,
    /// then the other fields of all. They also go to @p result; @p coarse gets the same in V_h.
    /// Columns have ghost values.
    void lift_cell(unsigned int number, const std::vector<Column> &columns, DenseMatrix &coarse,
                   MultiVector &result) const;
    /// Lifts the functions of all elements with own polynomials of which this rank has a cell.
    void lift_elements(const std::vector<Column> &columns, MultiVector &result) const;
    /// From the own nodes of an element to those of V+: displacements, or multipliers.
    const DenseMatrix &element_lift(const ElementShape shape, const bool of_multipliers) const
    {
      return element_lifts.at({shape, of_multipliers});
    }
    /// One column, interpolated. Collective.
    MultiVector interpolate(const MultiVector &column) const;
    /// Forces on V+ as V_h sees them: the transpose of interpolate(). One column. Collective.
    MultiVector restrict_forces(const MultiVector &forces) const;
    /// The rows of points and superelements, which belong to no cell and are the same in each
    /// space.
    void copy_rows_without_cells(const std::vector<Column> &columns, MultiVector &result) const;

    const FiniteElementSpace<dim> &base; ///< V_h
    FiniteElementSpace<dim> fine;        ///< V+
    const unsigned int n;                ///< nodes of a cell of V+
    const unsigned int n_fields;         ///< of a node
    const CellMap<dim> base_map, map;    ///< of V_h and V+
    const DenseMatrix lift;              ///< from the nodes of a cell to those of V+

  private:
    std::map<std::pair<ElementShape, bool>, DenseMatrix> element_lifts;
    void restrict_element(unsigned int e, const Column &forces, const Column &counts,
                          Column &sums) const;
    /// Calls visit(local row of V_h, the same of V+).
    void for_rows_without_cells(const std::function<void(unsigned int, unsigned int)> &visit) const;
  };
} // namespace squeal
