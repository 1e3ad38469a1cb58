#pragma once

#include <deal.II/base/point.h>

#include <array>
#include <map>
#include <vector>

namespace squeal
{
  /// Cells whose edges and faces are curved: polynomials of degree 2 in each coordinate of the unit
  /// cell. Points are kept by the vertices between which they lie, so that cells that share a face
  /// share its shape, whatever the order of their vertices.
  struct QuadraticCells
  {
    std::map<std::array<unsigned int, 2>, dealii::Point<3>> edges; ///< vertices ascending
    std::map<std::array<unsigned int, 4>, dealii::Point<3>> faces; ///< vertices ascending
    std::map<unsigned int, dealii::Point<3>> cells;                ///< the centres of curved cells

    /// Returns these shapes with other numbers of vertices.
    QuadraticCells renumbered(const std::vector<unsigned int> &number) const;
    /// The 27 points of a curved cell with the given vertices (order of deal.II), x first.
    std::array<dealii::Point<3>, 27> points(unsigned int cell,
                                            const std::array<dealii::Point<3>, 8> &corners,
                                            const std::array<unsigned int, 8> &vertices) const;
    bool empty() const
    {
      return cells.empty();
    }
  };
} // namespace squeal
