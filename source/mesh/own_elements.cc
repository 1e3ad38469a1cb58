#include <squeal/mesh/own_elements.h>

#include <deal.II/base/quadrature_lib.h>

#include <algorithm>
#include <cmath>

// Own nodes of an element are nodes of its cells, chosen by their places so that neighbours choose
// alike: on an edge by whether it is halved, on a triangle by its degree. The interpolation is
// V(places) V(own places)^{-1} with a Vandermonde matrix V of monomials.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    constexpr double same_place = 1e-8;

    unsigned int find(const std::vector<Point<3>> &places, const Point<3> &x)
    {
      unsigned int k = 0;
      while (k < places.size() && places[k].distance(x) > same_place)
        ++k;
      return k;
    }

    /// Monomials x^i y^j z^k: of all three coordinates together up to a degree, of the first two
    /// together, or of each.
    std::vector<std::array<unsigned int, 3>> exponents(const ElementShape shape,
                                                       const unsigned int degree)
    {
      std::vector<std::array<unsigned int, 3>> result;
      for (unsigned int k = 0; k <= degree; ++k)
        for (unsigned int j = 0; j <= degree; ++j)
          for (unsigned int i = 0; i <= degree; ++i)
            if (shape == ElementShape::hexahedron ||
                i + j + (shape == ElementShape::tetrahedron ? k : 0) <= degree)
              result.push_back({{i, j, k}});
      return result;
    }

    /// Where a triangle of a degree has nodes besides those of its edges, barycentric.
    std::vector<std::array<double, 3>> inside_triangle(const unsigned int degree)
    {
      if (degree < 3)
        return {};
      if (degree == 3)
        return {{{1. / 3, 1. / 3, 1. / 3}}};
      // The centres of the three quadrilaterals that it is divided into
      std::vector<std::array<double, 3>> result;
      for (unsigned int v = 0; v < 3; ++v)
      {
        std::array<double, 3> place{{5. / 24, 5. / 24, 5. / 24}};
        place[v] = 7. / 12;
        result.push_back(place);
      }
      return result;
    }
  } // namespace

  const std::vector<Point<3>> &reference_corners(const ElementShape shape)
  {
    using Corners                    = std::vector<Point<3>>;
    static const Corners tetrahedron = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                         wedge = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}},
                         hexahedron = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                       {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    return shape == ElementShape::tetrahedron ? tetrahedron
           : shape == ElementShape::wedge     ? wedge
                                              : hexahedron;
  }

  ElementInterpolation::ElementInterpolation(std::vector<Point<3>> points,
                                             const unsigned int cell_degree,
                                             const unsigned int degree)
      : points(std::move(points)), cell_degree(cell_degree), degree(degree)
  {
    Assert(degree >= 1 && degree <= 4 && degree <= cell_degree, ExcNotImplemented());
  }

  /// The nodes of an edge: of its two halves' nodes those next to where it would have its own.
  std::vector<double> ElementInterpolation::line(const bool halved) const
  {
    const std::vector<Point<1>> whole   = QGaussLobatto<1>(degree + 1).get_points(),
                                of_cell = QGaussLobatto<1>(cell_degree + 1).get_points();
    std::vector<double> available, result;
    for (const Point<1> &x : of_cell)
      for (unsigned int half = 0; half < (halved ? 2 : 1); ++half)
        available.push_back(halved ? (half + x[0]) / 2 : x[0]);
    for (const Point<1> &x : whole)
      result.push_back(*std::min_element(available.begin(), available.end(),
                                         [&](const double a, const double b)
                                         { return std::abs(a - x[0]) < std::abs(b - x[0]); }));
    return result;
  }

  std::vector<Point<3>> ElementInterpolation::own_places(const ElementShape shape,
                                                         const std::array<bool, 3> &halved) const
  {
    std::vector<Point<3>> result;
    const auto add = [&](const Point<3> &x)
    {
      if (find(result, x) == result.size())
        result.push_back(x);
    };
    if (shape == ElementShape::hexahedron)
    {
      for (const double z : line(halved[2]))
        for (const double y : line(halved[1]))
          for (const double x : line(halved[0]))
            add(Point<3>(x, y, z));
      return result;
    }
    // Edges and inner nodes of the triangles among the corners a, b, c
    const std::vector<Point<3>> &corners = reference_corners(shape);
    const auto add_triangle = [&](const std::array<unsigned int, 3> &of, const Tensor<1, 3> &shift)
    {
      for (unsigned int v = 0; v < 3; ++v)
        for (const double s : line(true))
          add(Point<3>((1 - s) * corners[of[v]] + s * corners[of[(v + 1) % 3]] + shift));
      for (const auto &place : inside_triangle(degree))
        add(Point<3>(place[0] * corners[of[0]] + place[1] * corners[of[1]] +
                     place[2] * corners[of[2]] + shift));
    };
    if (shape == ElementShape::wedge)
    {
      for (const double z : line(halved[2]))
        add_triangle({{0, 1, 2}}, Point<3>(0, 0, z));
      return result;
    }
    for (const auto &face :
         {std::array<unsigned int, 3>{{0, 1, 2}}, {{0, 1, 3}}, {{0, 2, 3}}, {{1, 2, 3}}})
      add_triangle(face, Tensor<1, 3>());
    if (degree == 4)
      add(Point<3>(0.25, 0.25, 0.25));
    return result;
  }

  DenseMatrix ElementInterpolation::functions_at(const ElementShape shape,
                                                 const std::vector<Point<3>> &places,
                                                 const int direction) const
  {
    const auto monomials = exponents(shape, degree);
    DenseMatrix result(places.size(), monomials.size());
    for (unsigned int m = 0; m < monomials.size(); ++m)
      for (unsigned int a = 0; a < places.size(); ++a)
      {
        double product = 1;
        for (int d = 0; d < 3; ++d)
        {
          const int k = monomials[m][d];
          product *= d != direction ? std::pow(places[a][d], k)
                     : k == 0       ? 0
                                    : k * std::pow(places[a][d], k - 1);
        }
        result(a, m) = product;
      }
    return result;
  }

  DenseMatrix ElementInterpolation::nodal_functions(const ElementShape shape,
                                                    const std::vector<Point<3>> &places) const
  {
    // V(places) V(own places)^{-1}, and with derivatives of V
    const unsigned int n     = places.size();
    const DenseMatrix of_own = functions_at(shape, own_places(shape)).transpose();
    DenseMatrix all(of_own.n_rows, 4 * n);
    for (int field = 0; field < 4; ++field)
    {
      const DenseMatrix values = functions_at(shape, places, field - 1);
      for (unsigned int q = 0; q < n; ++q)
        for (unsigned int m = 0; m < values.n_columns; ++m)
          all(m, field * n + q) = values(q, m);
    }
    return solve(of_own, std::move(all)).transpose();
  }

  const ElementInterpolation::Table &
  ElementInterpolation::of(const ElementShape shape, const std::array<std::uint8_t, 8> &between)
  {
    const auto [found, is_new] = tables.try_emplace({shape, between});
    Table &table               = found->second;
    if (!is_new)
      return table;

    // The cell's vertices and from them its nodes
    const std::vector<Point<3>> &corners = reference_corners(shape);
    std::array<Point<3>, 8> vertices;
    for (unsigned int v = 0; v < 8; ++v)
    {
      unsigned int n = 0;
      for (unsigned int corner = 0; corner < corners.size(); ++corner)
        if (between[v] >> corner & 1)
        {
          vertices[v] += corners[corner];
          ++n;
        }
      vertices[v] /= n;
    }
    std::array<bool, 3> halved;
    for (unsigned int d = 0; d < 3; ++d)
    {
      double low = 1, high = 0;
      for (const Point<3> &x : vertices)
      {
        low  = std::min(low, x[d]);
        high = std::max(high, x[d]);
      }
      halved[d] = high - low < 0.75;
    }
    for (const Point<3> &xi : points)
    {
      Point<3> x;
      for (unsigned int v = 0; v < 8; ++v)
        x += vertices[v] * ((v & 1 ? xi[0] : 1 - xi[0]) * (v & 2 ? xi[1] : 1 - xi[1]) *
                            (v & 4 ? xi[2] : 1 - xi[2]));
      table.places.push_back(x);
    }

    table.own_places = own_places(shape, halved);
    // W = V(places) V(own places)^{-1}
    table.weights = solve(functions_at(shape, table.own_places).transpose(),
                          functions_at(shape, table.places).transpose())
                        .transpose();
    for (double &weight : table.weights.values)
      if (std::abs(weight) < 1e-12)
        weight = 0;
    for (const Point<3> &place : table.places)
    {
      const unsigned int k = find(table.own_places, place);
      table.own.push_back(k < table.own_places.size() ? static_cast<int>(k) : -1);
    }
    return table;
  }
} // namespace squeal
