#pragma once

#include <squeal/linalg/dense.h>

#include <deal.II/base/point.h>

#include <array>
#include <cstdint>
#include <map>
#include <vector>

namespace squeal
{
  enum class ElementShape
  {
    tetrahedron,
    wedge,
    hexahedron
  };

  /// The corners of a shape in its reference coordinates: of a tetrahedron the last three
  /// barycentric ones, of a wedge the last two of its triangle and the height, of a hexahedron
  /// those of the unit cube. Corners turn about faces as those of Abaqus do.
  const std::vector<dealii::Point<3>> &reference_corners(ElementShape shape);

  /// Elements that are divided into cells, though displacements are the element's own polynomials.
  ///
  /// A cell's vertex lies in the middle of some corners of its element, so that it is known by the
  /// set of these: bit v for corner v.
  struct OwnElements
  {
    static constexpr unsigned int none = -1;
    struct Cell
    {
      unsigned int element                = none;
      std::array<std::uint8_t, 8> between = {}; ///< by vertex, in the order of the cell's vertices
    };
    std::vector<ElementShape> shapes; ///< by element
    std::vector<Cell> cells;          ///< by cell of the coarse mesh; empty: there are no elements

    bool empty() const
    {
      return shapes.empty();
    }
    bool has(const unsigned int cell) const
    {
      return !empty() && cells[cell].element != none;
    }
  };

  /// How the nodes of the cells of divided elements follow from the elements' own nodes
  /// (theory.md, section 13).
  ///
  /// A polynomial of degree p on an element is one of degree p in each coordinate of each of its
  /// cells, because barycentric coordinates are linear in each coordinate of a cell. So the
  /// element's functions are among those of the cells; as many of the cells' nodes as there are
  /// functions are the element's own, and all others are interpolated from these.
  class ElementInterpolation
  {
  public:
    /// For cells with nodes at @p points of the unit cell, which are those of FE_Q of degree @p
    /// cell_degree, and functions of degree @p degree, at most 4, of the elements.
    ElementInterpolation(std::vector<dealii::Point<3>> points, unsigned int cell_degree,
                         unsigned int degree);

    struct Table
    {
      std::vector<int> own; ///< by node of the cell: its number among the element's, or -1
      DenseMatrix weights;  ///< (node of the cell, node of the element)
      /// The nodes of the cell and of the element in the shape's reference coordinates.
      std::vector<dealii::Point<3>> places, own_places;
    };
    const Table &of(ElementShape shape, const std::array<std::uint8_t, 8> &between);
    /// The element's own nodes in the shape's reference coordinates. All edges are halved.
    std::vector<dealii::Point<3>> own_places(ElementShape shape) const
    {
      return own_places(shape, {{true, true, true}});
    }
    /// Values of the functions that are 1 at one own node and 0 at the others, then their
    /// derivatives along the three reference coordinates: (field n + place, own node).
    DenseMatrix nodal_functions(ElementShape shape,
                                const std::vector<dealii::Point<3>> &places) const;

  private:
    std::vector<dealii::Point<3>> own_places(ElementShape shape,
                                             const std::array<bool, 3> &halved) const;
    std::vector<double> line(bool halved) const;
    /// Monomials, or with a direction their derivatives along it: (place, monomial).
    DenseMatrix functions_at(ElementShape shape, const std::vector<dealii::Point<3>> &places,
                             int direction = -1) const;

    const std::vector<dealii::Point<3>> points;
    const unsigned int cell_degree, degree;
    std::map<std::pair<ElementShape, std::array<std::uint8_t, 8>>, Table> tables;
  };
} // namespace squeal
