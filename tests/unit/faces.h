#pragma once

#include "helpers.h"

#include <deal.II/base/quadrature_lib.h>

#include <squeal/mesh/mortar.h>

/// Surfaces for the tests of their faces and of the pairing.
namespace squeal::tests
{
  using dealii::Point;
  using dealii::QGaussLobatto;
  using dealii::Tensor;

  /// The Lagrange interpolant of a parametrised patch.
  template <int dim, typename Map>
  SurfaceFace<dim> face_of(const unsigned int degree, const Map &map)
  {
    // Lexicographic: the first coordinate runs fastest.
    SurfaceFace<dim> face;
    const std::vector<Point<1>> points = QGaussLobatto<1>(degree + 1).get_points();
    for (unsigned int j = 0; j < (dim == 3 ? points.size() : 1); ++j)
      for (unsigned int i = 0; i < points.size(); ++i)
      {
        Point<dim - 1> xi;
        xi[0] = points[i][0];
        if (dim == 3)
          xi[dim - 2] = points[j][0];
        face.nodes.push_back(map(xi));
      }
    return face;
  }

  /// n_1 (x n_2) patches of the image of the unit interval (square).
  template <int dim, typename Map>
  std::vector<SurfaceFace<dim>> grid(const unsigned int degree, const unsigned int n_1,
                                     const unsigned int n_2, const Map &map)
  {
    std::vector<SurfaceFace<dim>> faces;
    for (unsigned int j = 0; j < (dim == 3 ? n_2 : 1); ++j)
      for (unsigned int i = 0; i < n_1; ++i)
        faces.push_back(face_of<dim>(degree,
                                     [&](Point<dim - 1> xi)
                                     {
                                       xi[0] = (i + xi[0]) / n_1;
                                       if (dim == 3)
                                         xi[dim - 2] = (j + xi[dim - 2]) / n_2;
                                       return map(xi);
                                     }));
    return faces;
  }

  /// An affine image of the unit interval (square): corner, edges.
  template <int dim>
  struct Plane
  {
    Point<dim> corner;
    std::array<Tensor<1, dim>, dim - 1> edges;

    Point<dim> operator()(const Point<dim - 1> &xi) const
    {
      Point<dim> x = corner;
      for (unsigned int d = 0; d < dim - 1; ++d)
        x += xi[d] * edges[d];
      return x;
    }
  };
} // namespace squeal::tests
