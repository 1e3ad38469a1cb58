#include <squeal/mesh_files/element_map.h>

#include <algorithm>
#include <map>
#include <utility>

// Eight elements of each. Parts are tables of places in the element; its polynomial says where
// these lie. What elements share - an edge's middle, the middle of an edge of parts - is found by
// the nodes around it, so that neighbours need not be known.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    using Places = std::vector<ElementPlace>;

    ElementPlace halfway(const ElementPlace &a, const ElementPlace &b)
    {
      return middle_of(std::array<ElementPlace, 2>{{a, b}}, std::array<unsigned int, 2>{{0, 1}});
    }

    /// The places of an element's corners.
    Places corners_of(const ElementShape shape)
    {
      Places corners(ElementFile::n_corners(shape));
      for (unsigned int v = 0; v < corners.size(); ++v)
      {
        corners[v] = {};
        if (shape == ElementShape::tetrahedron)
          corners[v][v] = 1;
        else if (shape == ElementShape::wedge)
        {
          corners[v][v % 3] = 1;
          corners[v][3]     = v / 3;
        }
        else
          for (unsigned int d = 0; d < 3; ++d)
            corners[v][d] = ElementMap::coordinate(v, d);
      }
      return corners;
    }

    /// Exchanges two corners where a tetrahedron is inside out, as places of a larger one are.
    void turn(Places &tetrahedron)
    {
      Tensor<2, 3> edges;
      for (unsigned int i = 0; i < 3; ++i)
        for (unsigned int d = 0; d < 3; ++d)
          edges[i][d] = tetrahedron[i + 1][d + 1] - tetrahedron[0][d + 1];
      if (determinant(edges) < 0)
        std::swap(tetrahedron[2], tetrahedron[3]);
    }

    /// Four at the corners; the octahedron between them is cut about its shortest diagonal, which
    /// keeps angles away from zero (J. Bey, Tetrahedral grid refinement, Computing 55, 1995).
    std::vector<Places> parts_of_tetrahedron(const ElementMap &map)
    {
      const Places corners = corners_of(ElementShape::tetrahedron);
      std::vector<Places> parts;
      for (unsigned int v = 0; v < 4; ++v)
      {
        Places part;
        for (unsigned int w = 0; w < 4; ++w)
          part.push_back(halfway(corners[v], corners[w]));
        parts.push_back(part);
      }
      // Each pair of opposite edges has a diagonal between its middles; the others turn about it.
      std::array<ElementPlace, 2> diagonal;
      std::array<ElementPlace, 4> ring;
      double shortest = INFINITY;
      for (const auto &[a, b, c, d] :
           {std::array<unsigned int, 4>{{0, 1, 2, 3}}, {{0, 2, 1, 3}}, {{0, 3, 1, 2}}})
      {
        const std::array<ElementPlace, 2> ends = {
            {halfway(corners[a], corners[b]), halfway(corners[c], corners[d])}};
        if (const double length = map.at(ends[0]).distance(map.at(ends[1])); length < shortest)
        {
          shortest = length;
          diagonal = ends;
          ring     = {{halfway(corners[a], corners[c]), halfway(corners[c], corners[b]),
                       halfway(corners[b], corners[d]), halfway(corners[d], corners[a])}};
        }
      }
      for (unsigned int i = 0; i < 4; ++i)
      {
        Places part = {diagonal[0], diagonal[1], ring[i], ring[(i + 1) % 4]};
        turn(part);
        parts.push_back(part);
      }
      return parts;
    }

    std::vector<Places> parts_of_wedge()
    {
      const Places corners = corners_of(ElementShape::wedge);
      std::vector<Places> parts;
      for (const double z : {0., 0.5})
        for (unsigned int t = 0; t < 4; ++t)
        {
          Places part;
          for (unsigned int w = 0; w < 6; ++w)
          {
            // Three triangles at the corners and the one between the middles of edges
            const unsigned int v = w % 3;
            ElementPlace place =
                t < 3 ? halfway(corners[t], corners[v]) : halfway(corners[v], corners[(v + 1) % 3]);
            place[3] = z + 0.5 * (w / 3);
            part.push_back(place);
          }
          parts.push_back(part);
        }
      return parts;
    }

    std::vector<Places> parts_of_hexahedron()
    {
      const Places corners = corners_of(ElementShape::hexahedron);
      std::vector<Places> parts;
      for (const ElementPlace &first : corners)
      {
        Places part;
        for (const ElementPlace &corner : corners)
          part.push_back(halfway(first, corner));
        parts.push_back(part);
      }
      return parts;
    }

    class Refiner
    {
    public:
      Refiner(const ElementFile &in, const std::function<bool(unsigned int)> &follows_circles)
          : in(in), follows_circles(follows_circles)
      {
        out.name        = in.name;
        out.nodes       = in.nodes;
        out.node_sets   = in.node_sets;
        out.passed_over = in.passed_over;
      }

      ElementFile refine()
      {
        for (const ElementFile::Element &element : in.elements)
          if (element.is_quadratic())
            keep_middles(element);
        for (unsigned int e = 0; e < in.elements.size(); ++e)
          divide(e);
        for (const auto &[name, elements] : in.volumes)
          for (const unsigned int e : elements)
            for (unsigned int k = 0; k < n_parts; ++k)
              out.volumes[name].push_back(n_parts * e + k);
        for (const auto &[name, faces] : in.surfaces)
          for (const ElementFile::Face &face : faces)
            add_parts(face, out.surfaces[name]);
        return std::move(out);
      }

    private:
      static constexpr unsigned int n_parts = 8;

      /// Middle nodes of the file become corners.
      void keep_middles(const ElementFile::Element &element)
      {
        const auto &edges = ElementFile::edges(element.shape);
        unsigned int next = ElementFile::n_corners(element.shape);
        const auto keep   = [&](std::vector<unsigned int> around)
        {
          for (unsigned int &corner : around)
            corner = element.nodes[corner];
          std::sort(around.begin(), around.end());
          if (next < element.nodes.size())
            between.emplace(around, element.nodes[next++]);
        };
        for (const auto &[a, b] : edges)
          keep({a, b});
        for (const ElementFile::Face &face : ElementFile::faces(element.shape))
          if (face[3] != ElementFile::none)
            keep({face.begin(), face.end()});
        if (element.shape == ElementShape::hexahedron)
          keep({0, 1, 2, 3, 4, 5, 6, 7});
      }

      /// The node at a point, which the nodes @p around name; a new one where there is none.
      unsigned int node(const ElementFile::Element &element, const ElementMap &map,
                        const Point<3> &x, const std::vector<unsigned int> &around)
      {
        const auto [known, is_new] = between.emplace(around, out.nodes.size());
        if (is_new)
          out.nodes.push_back(x);
        else if (out.nodes[known->second].distance(x) > map.tolerance())
          in.fail_beside_another(element);
        return known->second;
      }

      void divide(const unsigned int e)
      {
        const ElementFile::Element &element = in.elements[e];
        const ElementMap map(in.nodes, element, follows_circles(e));
        for (const Places &places : element.shape == ElementShape::tetrahedron
                                        ? parts_of_tetrahedron(map)
                                    : element.shape == ElementShape::wedge ? parts_of_wedge()
                                                                           : parts_of_hexahedron())
        {
          ElementFile::Element part{element.shape, {}, element.number, element.line};
          for (const ElementPlace &place : places)
          {
            const std::vector<unsigned int> corners = nodes_between(element, place);
            part.nodes.push_back(corners.size() == 1 ? corners[0]
                                                     : node(element, map, map.at(place), corners));
          }
          if (element.is_quadratic())
            add_middles(element, map, places, part);
          out.elements.push_back(part);
        }
      }

      /// Middles of a part's edges, of its quadrilaterals, and of a hexahedron itself: with all of
      /// them the part has the shape of the element. What is straight, or an arc, stays so: the
      /// polynomial's points lie on an arc, but not in the middle of its parts.
      void add_middles(const ElementFile::Element &element, const ElementMap &map,
                       const Places &places, ElementFile::Element &part)
      {
        const auto add = [&](const auto &corners)
        {
          std::vector<unsigned int> around;
          for (const unsigned int corner : corners)
            around.push_back(part.nodes[corner]);
          const ElementPlace middle = middle_of(places, corners);
          const bool is_arc =
              corners.size() == 2 && map.is_straight(corners_between(element.shape, middle));
          const Point<3> x =
              is_arc ? map.halfway(out.nodes[around[0]], out.nodes[around[1]]) : map.at(middle);
          std::sort(around.begin(), around.end());
          part.nodes.push_back(node(element, map, x, around));
        };
        for (const auto &edge : ElementFile::edges(part.shape))
          add(edge);
        if (map.is_straight())
          return;
        for (const ElementFile::Face &face : ElementFile::faces(part.shape))
          if (face[3] != ElementFile::none)
            add(face);
        if (part.shape == ElementShape::hexahedron)
          add(std::array<unsigned int, 8>{{0, 1, 2, 3, 4, 5, 6, 7}});
      }

      /// The four parts of a face. One of no element stays as it is, and is of none of the parts.
      void add_parts(const ElementFile::Face &face, std::vector<ElementFile::Face> &parts) const
      {
        const bool is_triangle = face[3] == ElementFile::none;
        const unsigned int n   = is_triangle ? 3 : 4;
        const auto middle      = [&](std::vector<unsigned int> around)
        {
          std::sort(around.begin(), around.end());
          const auto known = between.find(around);
          return known == between.end() ? ElementFile::none : known->second;
        };
        std::vector<unsigned int> middles;
        for (unsigned int v = 0; v < n; ++v)
          middles.push_back(middle({face[v], face[(v + 1) % n]}));
        const unsigned int centre = is_triangle ? middles[0] : middle({face.begin(), face.end()});
        if (centre == ElementFile::none ||
            std::count(middles.begin(), middles.end(), ElementFile::none) > 0)
        {
          parts.push_back(face);
          return;
        }
        for (unsigned int v = 0; v < n; ++v)
        {
          const unsigned int last = middles[(v + n - 1) % n];
          parts.push_back(is_triangle ? ElementFile::Face{{face[v], middles[v], last, face[3]}}
                                      : ElementFile::Face{{face[v], middles[v], centre, last}});
        }
        if (is_triangle)
          parts.push_back({{middles[0], middles[1], middles[2], face[3]}});
      }

      const ElementFile &in;
      const std::function<bool(unsigned int)> &follows_circles;
      ElementFile out;
      /// New nodes, and middle nodes of the file, by the corners around them in ascending order.
      std::map<std::vector<unsigned int>, unsigned int> between;
    };
  } // namespace

  ElementFile refine(const ElementFile &elements,
                     const std::function<bool(unsigned int)> &follows_circles)
  {
    return Refiner(elements, follows_circles).refine();
  }
} // namespace squeal
