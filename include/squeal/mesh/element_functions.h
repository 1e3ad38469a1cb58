#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/mesh/own_elements.h>

#include <deal.II/base/point.h>

#include <cstdint>
#include <vector>

namespace squeal
{
  /// The hierarchical functions of an element: those of degree p, then those that one degree more
  /// adds, which vanish at the corners.
  ///
  /// On triangles and tetrahedra with barycentric coordinates l: l_i at corners; l_i l_j times an
  /// integrated Legendre polynomial of l_j - l_i on edges; l_i l_j l_k, times differences, on
  /// faces. On lines 1 - z, z and integrated Legendre polynomials. Wedges have products of a
  /// triangle's and a line's, hexahedra of three lines' (Szabo and Babuska, Finite Element
  /// Analysis, 1991, chapter 13).
  class ElementFunctions
  {
  public:
    /// @p degree of the functions without the added ones, at most 3.
    ElementFunctions(ElementShape shape, unsigned int degree);

    unsigned int n_base() const
    {
      return first_added;
    }
    unsigned int n_added() const
    {
      return carriers.size() - first_added;
    }
    /// The corners of the edge, face or element to which an added function belongs: bit v for
    /// corner v. It vanishes on faces that do not have all of these.
    std::uint8_t carrier_of_added(const unsigned int w) const
    {
      return carriers[first_added + w];
    }
    /// Values at places in the shape's reference coordinates: one column a function.
    DenseMatrix base_at(const std::vector<dealii::Point<3>> &places) const;
    DenseMatrix added_at(const std::vector<dealii::Point<3>> &places) const;

  private:
    struct Function
    {
      /// Factors by number: one of simplex_functions(), in wedges and one of a line; or three of
      /// lines.
      std::array<unsigned int, 3> factors;
    };
    DenseMatrix at(const std::vector<dealii::Point<3>> &places, unsigned int first,
                   unsigned int end) const;

    const ElementShape shape;
    const unsigned int degree;
    std::vector<Function> functions;
    std::vector<std::uint8_t> carriers;
    unsigned int first_added = 0;
  };

  /// The corners of the edge, face or element inside of which a place lies: bit v for corner v.
  std::uint8_t carrier_of(ElementShape shape, const dealii::Point<3> &place);
} // namespace squeal
