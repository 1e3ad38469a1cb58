#include <squeal/mesh_files/element_map.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  std::uint8_t corners_between(const ElementShape shape, const ElementPlace &place)
  {
    std::uint8_t set = 0;
    for (unsigned int v = 0; v < ElementFile::n_corners(shape); ++v)
    {
      bool takes_part = true;
      if (shape == ElementShape::tetrahedron)
        takes_part = place[v] > 0;
      else if (shape == ElementShape::wedge)
        takes_part = place[v % 3] > 0 && (v < 3 ? place[3] < 1 : place[3] > 0);
      else
        for (unsigned int d = 0; d < 3; ++d)
          takes_part =
              takes_part && (ElementMap::coordinate(v, d) == 0 ? place[d] < 1 : place[d] > 0);
      if (takes_part)
        set |= 1u << v;
    }
    return set;
  }

  std::vector<unsigned int> nodes_between(const ElementFile::Element &element,
                                          const ElementPlace &place)
  {
    std::vector<unsigned int> nodes;
    for (unsigned int v = 0; v < ElementFile::n_corners(element.shape); ++v)
      if (corners_between(element.shape, place) >> v & 1)
        nodes.push_back(element.nodes[v]);
    std::sort(nodes.begin(), nodes.end());
    return nodes;
  }

  ElementMap::ElementMap(const std::vector<Point<3>> &all_nodes,
                         const ElementFile::Element &element, const bool on_circle)
      : shape(element.shape), on_circle(on_circle)
  {
    std::vector<Value> nodes;
    for (const unsigned int node : element.nodes)
    {
      const Point<3> &x = all_nodes[node];
      nodes.push_back({{x[0], x[1], x[2], std::hypot(x[0], x[1])}});
    }
    const unsigned int n_corners = ElementFile::n_corners(shape);
    corners.assign(nodes.begin(), nodes.begin() + n_corners);
    const auto &edges = ElementFile::edges(shape);
    const bool middle = element.is_quadratic();
    for (unsigned int e = 0; e < edges.size(); ++e)
    {
      const Value &a = corners[edges[e][0]], &b = corners[edges[e][1]];
      Value straight{};
      add(straight, 0.5, a);
      add(straight, 0.5, b);
      middles.push_back(middle ? nodes[n_corners + e] : straight);
      size = std::max(size, std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
      sagittas.push_back({1u << edges[e][0] | 1u << edges[e][1],
                          placed(straight).distance(placed(middles.back()))});
    }
    if (shape == ElementShape::tetrahedron)
      return;
    unsigned int next = n_corners + edges.size();
    for (const auto &face : ElementFile::faces(shape))
      if (face[3] != ElementFile::none)
      {
        // Serendipity: a quarter of the corners less than half of the middles
        Value centre{};
        for (unsigned int e = 0; e < edges.size(); ++e)
          if (std::count(face.begin(), face.end(), edges[e][0]) > 0 &&
              std::count(face.begin(), face.end(), edges[e][1]) > 0)
            add(centre, 0.5, middles[e]);
        for (const unsigned int corner : face)
          add(centre, -0.25, corners[corner]);
        if (next < nodes.size())
        {
          std::uint8_t around = 0;
          for (const unsigned int corner : face)
            around |= 1u << corner;
          sagittas.push_back({around, placed(centre).distance(placed(nodes[next]))});
          centre = nodes[next];
        }
        ++next;
        quadrilaterals.push_back(centre);
      }
    if (shape == ElementShape::wedge)
      return;
    for (const Value &corner : corners)
      add(centre, -0.25, corner);
    for (const Value &edge : middles)
      add(centre, 0.25, edge);
    if (next < nodes.size())
      centre = nodes[next];
  }

  bool ElementMap::is_straight(const std::uint8_t among) const
  {
    return std::none_of(sagittas.begin(), sagittas.end(),
                        [&](const Sagitta &known)
                        { return (known.corners & ~among) == 0 && known.size > 1e-6 * size; });
  }

  Point<3> ElementMap::halfway(const Point<3> &a, const Point<3> &b) const
  {
    Value value{};
    for (const Point<3> &x : {a, b})
      add(value, 0.5, {{x[0], x[1], x[2], std::hypot(x[0], x[1])}});
    return placed(value);
  }

  namespace
  {
    /// Polynomials of degree 2 that are 1 at 0, 1/2 and 1.
    std::array<double, 3> line(const double s)
    {
      return {{(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)}};
    }

  } // namespace

  Point<3> ElementMap::at(const ElementPlace &place) const
  {
    Value value{};
    if (shape == ElementShape::tetrahedron)
      add_simplex(value, place, 4, 1, 0, 0);
    else if (shape == ElementShape::wedge)
    {
      const std::array<double, 3> up = line(place[3]);
      add_simplex(value, place, 3, up[0], 0, 0);
      add_simplex(value, place, 3, up[2], 3, 3);
      // Between both triangles: edges upwards and middles of quadrilaterals
      for (unsigned int i = 0; i < 3; ++i)
      {
        add(value, up[1] * place[i] * (2 * place[i] - 1), middles[6 + i]);
        add(value, up[1] * 4 * place[i] * place[(i + 1) % 3], quadrilaterals[i]);
      }
    }
    else
      add_hexahedron(value, place);
    return placed(value);
  }

  void ElementMap::add(Value &sum, const double factor, const Value &value)
  {
    for (unsigned int k = 0; k < 4; ++k)
      sum[k] += factor * value[k];
  }

  Point<3> ElementMap::placed(const Value &value) const
  {
    Point<3> x(value[0], value[1], value[2]);
    const double r = std::hypot(x[0], x[1]);
    if (on_circle && r > 0)
      for (unsigned int d = 0; d < 2; ++d)
        x[d] *= value[3] / r;
    return x;
  }

  void ElementMap::add_simplex(Value &value, const ElementPlace &place, const unsigned int n,
                               const double factor, const unsigned int first_corner,
                               const unsigned int first_edge) const
  {
    for (unsigned int i = 0; i < n; ++i)
      add(value, factor * place[i] * (2 * place[i] - 1), corners[first_corner + i]);
    const auto &edges = ElementFile::edges(shape);
    for (unsigned int e = first_edge; e < first_edge + (n == 3 ? 3 : 6); ++e)
      add(value, factor * 4 * place[edges[e][0] - first_corner] * place[edges[e][1] - first_corner],
          middles[e]);
  }

  void ElementMap::add_hexahedron(Value &value, const ElementPlace &place) const
  {
    std::array<std::array<double, 3>, 3> values{};
    for (unsigned int d = 0; d < 3; ++d)
      values[d] = line(place[d]);
    // A point that lies between corners has the coordinate 1/2 where these differ.
    const auto weight = [&](const auto &between)
    {
      double product = 1;
      for (unsigned int d = 0; d < 3; ++d)
      {
        const unsigned int low = coordinate(between[0], d);
        const bool differs =
            std::any_of(between.begin(), between.end(),
                        [&](const unsigned int corner) { return coordinate(corner, d) != low; });
        product *= values[d][differs ? 1 : 2 * low];
      }
      return product;
    };
    for (unsigned int v = 0; v < 8; ++v)
      add(value, weight(std::array<unsigned int, 1>{{v}}), corners[v]);
    for (unsigned int e = 0; e < 12; ++e)
      add(value, weight(ElementFile::edges(shape)[e]), middles[e]);
    for (unsigned int f = 0; f < 6; ++f)
      add(value, weight(ElementFile::faces(shape)[f]), quadrilaterals[f]);
    add(value, weight(std::array<unsigned int, 8>{{0, 1, 2, 3, 4, 5, 6, 7}}), centre);
  }

  unsigned int ElementMap::coordinate(const unsigned int corner, const unsigned int d)
  {
    return d == 2 ? corner / 4 : d == 1 ? corner % 4 / 2 : (corner % 4 + 1) / 2 % 2;
  }
} // namespace squeal
