#include <squeal/mesh/element_functions.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// A function of a triangle or tetrahedron: the corners that carry it, its degree, and its
    /// number among those of both.
    struct SimplexFunction
    {
      std::vector<unsigned int> corners;
      unsigned int degree, number;
    };

    /// The functions of a simplex with n corners up to a degree of 4, by degree.
    std::vector<SimplexFunction> simplex_functions(const unsigned int n, const unsigned int degree)
    {
      std::vector<SimplexFunction> result;
      const auto add = [&](const std::vector<unsigned int> &corners, const unsigned int d,
                           const unsigned int n_functions)
      {
        for (unsigned int number = 0; number < n_functions; ++number)
          result.push_back({corners, d, number});
      };
      for (unsigned int d = 1; d <= degree; ++d)
      {
        for (unsigned int i = 0; i < n && d == 1; ++i)
          add({i}, d, 1);
        for (unsigned int i = 0; i < n && d >= 2; ++i)
          for (unsigned int j = i + 1; j < n; ++j)
            add({i, j}, d, 1);
        for (unsigned int i = 0; i < n && d >= 3; ++i)
          for (unsigned int j = i + 1; j < n; ++j)
            for (unsigned int k = j + 1; k < n; ++k)
              add({i, j, k}, d, d - 2);
        if (n == 4 && d == 4)
          add({0, 1, 2, 3}, d, 1);
      }
      return result;
    }

    /// Integrated Legendre polynomial of degree k over l_i l_j, as a homogeneous polynomial:
    /// x = l_j - l_i, t = l_i + l_j.
    double edge_kernel(const unsigned int degree, const double x, const double t)
    {
      return degree == 2 ? 1 : degree == 3 ? x : x * x - t * t / 5;
    }

    double value(const SimplexFunction &f, const std::vector<double> &l)
    {
      double product = 1;
      for (const unsigned int corner : f.corners)
        product *= l[corner];
      if (f.corners.size() == 2)
        product *= edge_kernel(f.degree, l[f.corners[1]] - l[f.corners[0]],
                               l[f.corners[0]] + l[f.corners[1]]);
      if (f.corners.size() == 3 && f.degree == 4)
        product *= l[f.corners[1 + f.number]] - l[f.corners[f.number]];
      return product;
    }

    /// Number k of a line: 1 - x, x, then of degree k.
    double line_value(const unsigned int k, const double x)
    {
      return k == 0 ? 1 - x : k == 1 ? x : x * (1 - x) * edge_kernel(k, 2 * x - 1, 1);
    }

    std::vector<double> barycentric(const unsigned int n, const Point<3> &x)
    {
      std::vector<double> l(n);
      l[0] = 1;
      for (unsigned int v = 1; v < n; ++v)
        l[0] -= l[v] = x[v - 1];
      return l;
    }

    /// The ends of a line that carry its function k: bit 0 the lower, bit 1 the upper.
    unsigned int ends_of(const unsigned int k)
    {
      return k == 0 ? 1 : k == 1 ? 2 : 3;
    }

    /// The corners of a hexahedron at given ends in each direction.
    std::uint8_t corners_at(const std::array<unsigned int, 3> &ends)
    {
      const std::vector<Point<3>> &corners = reference_corners(ElementShape::hexahedron);
      std::uint8_t set                     = 0;
      for (unsigned int v = 0; v < 8; ++v)
      {
        bool is_there = true;
        for (unsigned int d = 0; d < 3; ++d)
          is_there = is_there && (ends[d] & (corners[v][d] > 0.5 ? 2 : 1));
        set |= is_there ? 1u << v : 0;
      }
      return set;
    }

    std::uint8_t wedge_corners(const std::vector<unsigned int> &of_triangle,
                               const unsigned int ends)
    {
      std::uint8_t set = 0;
      for (const unsigned int v : of_triangle)
        set |= (ends & 1 ? 1u << v : 0) | (ends & 2 ? 1u << (3 + v) : 0);
      return set;
    }
  } // namespace

  ElementFunctions::ElementFunctions(const ElementShape shape, const unsigned int degree)
      : shape(shape), degree(degree)
  {
    const std::vector<SimplexFunction> simplex =
        shape == ElementShape::hexahedron
            ? std::vector<SimplexFunction>()
            : simplex_functions(shape == ElementShape::tetrahedron ? 4 : 3, degree + 1);
    for (const bool added : {false, true})
    {
      if (added)
        first_added = functions.size();
      const auto add = [&](const Function &f, const std::uint8_t carrier, const bool is_added)
      {
        if (is_added == added)
        {
          functions.push_back(f);
          carriers.push_back(carrier);
        }
      };
      if (shape == ElementShape::hexahedron)
        for (unsigned int m = 0; m < (degree + 2) * (degree + 2) * (degree + 2); ++m)
        {
          const std::array<unsigned int, 3> k = {
              {m % (degree + 2), m / (degree + 2) % (degree + 2), m / (degree + 2) / (degree + 2)}};
          add({k}, corners_at({{ends_of(k[0]), ends_of(k[1]), ends_of(k[2])}}),
              *std::max_element(k.begin(), k.end()) == degree + 1);
        }
      for (unsigned int f = 0; f < simplex.size(); ++f)
        if (shape == ElementShape::tetrahedron)
        {
          std::uint8_t carrier = 0;
          for (const unsigned int v : simplex[f].corners)
            carrier |= 1u << v;
          add({{{f, 0, 0}}}, carrier, simplex[f].degree == degree + 1);
        }
        else
          for (unsigned int k = 0; k < degree + 2; ++k)
            add({{{f, k, 0}}}, wedge_corners(simplex[f].corners, ends_of(k)),
                simplex[f].degree == degree + 1 || k == degree + 1);
    }
  }

  DenseMatrix ElementFunctions::at(const std::vector<Point<3>> &places, const unsigned int first,
                                   const unsigned int end) const
  {
    const unsigned int n_corners               = shape == ElementShape::tetrahedron ? 4 : 3;
    const std::vector<SimplexFunction> simplex = shape == ElementShape::hexahedron
                                                     ? std::vector<SimplexFunction>()
                                                     : simplex_functions(n_corners, degree + 1);
    DenseMatrix result(places.size(), end - first);
    for (unsigned int a = 0; a < places.size(); ++a)
    {
      const Point<3> &x           = places[a];
      const std::vector<double> l = barycentric(n_corners, x);
      for (unsigned int f = first; f < end; ++f)
      {
        const auto &k = functions[f].factors;
        result(a, f - first) =
            shape == ElementShape::hexahedron
                ? line_value(k[0], x[0]) * line_value(k[1], x[1]) * line_value(k[2], x[2])
            : shape == ElementShape::tetrahedron ? value(simplex[k[0]], l)
                                                 : value(simplex[k[0]], l) * line_value(k[1], x[2]);
      }
    }
    for (double &v : result.values)
      if (std::abs(v) < 1e-13)
        v = 0;
    return result;
  }

  DenseMatrix ElementFunctions::base_at(const std::vector<Point<3>> &places) const
  {
    return at(places, 0, first_added);
  }

  DenseMatrix ElementFunctions::added_at(const std::vector<Point<3>> &places) const
  {
    return at(places, first_added, functions.size());
  }

  std::uint8_t carrier_of(const ElementShape shape, const Point<3> &place)
  {
    constexpr double near = 1e-9;
    const auto ends       = [&](const double x) { return x < near ? 1u : x > 1 - near ? 2u : 3u; };
    if (shape == ElementShape::hexahedron)
      return corners_at({{ends(place[0]), ends(place[1]), ends(place[2])}});
    const std::vector<double> l = barycentric(shape == ElementShape::tetrahedron ? 4 : 3, place);
    std::vector<unsigned int> corners;
    for (unsigned int v = 0; v < l.size(); ++v)
      if (l[v] > near)
        corners.push_back(v);
    if (shape == ElementShape::wedge)
      return wedge_corners(corners, ends(place[2]));
    std::uint8_t set = 0;
    for (const unsigned int v : corners)
      set |= 1u << v;
    return set;
  }
} // namespace squeal
