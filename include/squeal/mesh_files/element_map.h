#pragma once

#include <squeal/mesh_files/element_file.h>

#include <array>
#include <cstdint>
#include <vector>

namespace squeal
{
  /// A place in an element: barycentric coordinates of a tetrahedron; of a wedge those of its
  /// triangle and the height in [0, 1]; coordinates of a hexahedron in the unit cube.
  using ElementPlace = std::array<double, 4>;

  /// Finds the corners between which a place lies: bit v for corner v.
  std::uint8_t corners_between(ElementShape shape, const ElementPlace &place);
  /// Finds the corners of an element between which a place lies, as nodes in ascending order.
  std::vector<unsigned int> nodes_between(const ElementFile::Element &element,
                                          const ElementPlace &place);

  /// Finds the middle of some places of an element, by their numbers in a list.
  template <typename Places, std::size_t n>
  ElementPlace middle_of(const Places &places, const std::array<unsigned int, n> &some)
  {
    ElementPlace middle{};
    for (const unsigned int number : some)
      for (unsigned int k = 0; k < 4; ++k)
        middle[k] += places[number][k] / n;
    return middle;
  }

  /// The polynomial of degree 2 of an element: three coordinates, and the distance from the z axis
  /// for elements that follow circles about it.
  class ElementMap
  {
  public:
    ElementMap(const std::vector<dealii::Point<3>> &all_nodes, const ElementFile::Element &element,
               bool on_circle);

    /// Finds whether edges and faces between these corners, bit v for corner v, are straight, or on
    /// circles, but for the digits of the file.
    bool is_straight(std::uint8_t among = all_corners) const;
    /// Finds the middle of a straight line, or of an arc.
    dealii::Point<3> halfway(const dealii::Point<3> &a, const dealii::Point<3> &b) const;
    dealii::Point<3> at(const ElementPlace &place) const;
    /// Bounds what the digits of a file may miss at a place that two elements have.
    double tolerance() const
    {
      return 1e-5 * size;
    }
    /// Coordinate @p d of a corner of the unit hexahedron: 0 or 1.
    static unsigned int coordinate(unsigned int corner, unsigned int d);

  private:
    using Value = std::array<double, 4>;
    /// How far the middle node of an edge or a face is from where it would be straight.
    struct Sagitta
    {
      std::uint8_t corners; ///< of the edge or face
      double size;
    };
    static constexpr std::uint8_t all_corners = 0xff;

    static void add(Value &sum, double factor, const Value &value);
    dealii::Point<3> placed(const Value &value) const;
    /// A triangle's or tetrahedron's polynomial of degree 2; its edges come first in the table.
    void add_simplex(Value &value, const ElementPlace &place, unsigned int n, double factor,
                     unsigned int first_corner, unsigned int first_edge) const;
    void add_hexahedron(Value &value, const ElementPlace &place) const;

    const ElementShape shape;
    const bool on_circle;
    std::vector<Value> corners, middles, quadrilaterals;
    Value centre{};
    double size = 0; ///< the longest edge
    std::vector<Sagitta> sagittas;
  };
} // namespace squeal
