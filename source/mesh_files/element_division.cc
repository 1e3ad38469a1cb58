#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh/quadratic_manifold.h>
#include <squeal/mesh_files/element_file.h>
#include <squeal/mesh_files/element_map.h>
#include <squeal/mesh_files/joined_surfaces.h>
#include <squeal/mesh_files/mesh_checks.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

// Elements become hexahedra. The tables of the shapes come first. Divider finds which edges are
// halved, until no element asks for more, makes the new nodes, which neighbours share, and the
// cells with their curved shapes, and gives groups and faces to the parts.

namespace squeal
{
  using namespace dealii;

  bool ElementFile::Element::is_quadratic() const
  {
    return nodes.size() > n_corners(shape);
  }

  std::string ElementFile::Element::kind() const
  {
    const std::string name = shape == ElementShape::tetrahedron ? "tetrahedron"
                             : shape == ElementShape::wedge     ? "wedge"
                                                                : "hexahedron";
    return (is_quadratic() ? "quadratic " : "linear ") + name;
  }

  unsigned int ElementFile::n_corners(const ElementShape shape)
  {
    return shape == ElementShape::tetrahedron ? 4 : shape == ElementShape::wedge ? 6 : 8;
  }

  const std::vector<std::array<unsigned int, 2>> &ElementFile::edges(const ElementShape shape)
  {
    using Edges                    = std::vector<std::array<unsigned int, 2>>;
    static const Edges tetrahedron = {{{0, 1}}, {{1, 2}}, {{2, 0}}, {{0, 3}}, {{1, 3}}, {{2, 3}}},
                       wedge       = {{{0, 1}}, {{1, 2}}, {{2, 0}}, {{3, 4}}, {{4, 5}},
                                      {{5, 3}}, {{0, 3}}, {{1, 4}}, {{2, 5}}},
                       hexahedron  = {{{0, 1}}, {{1, 2}}, {{2, 3}}, {{3, 0}}, {{4, 5}}, {{5, 6}},
                                      {{6, 7}}, {{7, 4}}, {{0, 4}}, {{1, 5}}, {{2, 6}}, {{3, 7}}};
    return shape == ElementShape::tetrahedron ? tetrahedron
           : shape == ElementShape::wedge     ? wedge
                                              : hexahedron;
  }

  const std::vector<ElementFile::Face> &ElementFile::faces(const ElementShape shape)
  {
    static const std::vector<Face> tetrahedron = {{{0, 1, 2, none}},
                                                  {{0, 3, 1, none}},
                                                  {{1, 3, 2, none}},
                                                  {{2, 3, 0, none}}},
                                   wedge       = {{{0, 1, 2, none}},
                                                  {{3, 5, 4, none}},
                                                  {{0, 3, 4, 1}},
                                                  {{1, 4, 5, 2}},
                                                  {{2, 5, 3, 0}}},
                                   hexahedron(MeshFile::cell_faces.begin(),
                                              MeshFile::cell_faces.end());
    return shape == ElementShape::tetrahedron ? tetrahedron
           : shape == ElementShape::wedge     ? wedge
                                              : hexahedron;
  }

  ElementFile::Face ElementFile::face(const Element &element, const unsigned int f) const
  {
    Face result = faces(element.shape)[f];
    for (unsigned int &corner : result)
      if (corner != none)
        corner = element.nodes[corner];
    return result;
  }

  ElementFile::Face ElementFile::ascending(Face face)
  {
    std::sort(face.begin(), face.end());
    return face;
  }

  std::map<ElementFile::Face, ElementFile::Face> ElementFile::free_faces() const
  {
    std::map<Face, Face> free;
    std::set<Face> shared;
    for (const Element &element : elements)
      for (unsigned int f = 0; f < faces(element.shape).size(); ++f)
        if (const Face found = face(element, f); !free.emplace(ascending(found), found).second)
          shared.insert(ascending(found));
    for (const Face &face : shared)
      free.erase(face);
    return free;
  }

  void ElementFile::fail(const Element &element, const std::string &message) const
  {
    throw InputError(text_of("Mesh/File: ", name, ", line ", element.line, ": element ",
                             element.number, ", ", element.kind(), ", ", message));
  }

  void ElementFile::fail_beside_another(const Element &element) const
  {
    fail(element, "shares an edge or face with another element that is curved otherwise there: "
                  "linear beside quadratic elements need straight edges in between.");
  }

  namespace
  {
    class Divider
    {
    public:
      Divider(const ElementFile &in, const std::function<bool(unsigned int)> &follows_circles,
              const bool keep_own)
          : in(in), follows_circles(follows_circles), keep_own(keep_own)
      {
        out.name                 = in.name;
        out.nodes                = in.nodes;
        out.division.passed_over = in.passed_over;
      }

      MeshFile divide()
      {
        count();
        halve_edges();
        parts.resize(in.elements.size());
        for (unsigned int e = 0; e < in.elements.size(); ++e)
          divide_element(e);
        if (!out.own.empty())
          out.own.cells.resize(out.cells.size());
        check_neighbours();
        carry_groups();
        return std::move(out);
      }

    private:
      void count()
      {
        std::vector<bool> has_element(in.nodes.size());
        for (const ElementFile::Element &element : in.elements)
        {
          ++out.division.n_elements[element.kind()];
          out.division.n_linear_simplices +=
              element.shape != ElementShape::hexahedron && !element.is_quadratic();
          for (const unsigned int node : element.nodes)
            has_element[node] = true;
        }
        out.division.n_nodes = std::count(has_element.begin(), has_element.end(), true);
      }

      static std::uint64_t key(const unsigned int a, const unsigned int b)
      {
        return (std::uint64_t(std::min(a, b)) << 32) + std::max(a, b);
      }

      /// Joins all edges of elements that share some with tetrahedra or wedges, of which these
      /// elements are the ones that keep their polynomials: nodes of edges that are halved here and
      /// whole there would not be the same.
      void join_bodies_of_simplices(Groups &classes)
      {
        Groups bodies(in.nodes.size());
        for (const ElementFile::Element &element : in.elements)
          for (const unsigned int node : element.nodes)
            bodies.join(node, element.nodes[0]);
        std::set<unsigned int> with_simplices;
        for (const ElementFile::Element &element : in.elements)
          if (element.shape != ElementShape::hexahedron)
            with_simplices.insert(bodies.of(element.nodes[0]));
        keeps_own.resize(in.elements.size());
        for (unsigned int e = 0; e < in.elements.size(); ++e)
        {
          const std::vector<unsigned int> &nodes = in.elements[e].nodes;
          keeps_own[e]                           = with_simplices.count(bodies.of(nodes[0])) > 0;
          const auto &edges                      = ElementFile::edges(in.elements[e].shape);
          for (const auto &[a, b] : edges)
            if (keeps_own[e])
              classes.join(edge_numbers.at(key(nodes[a], nodes[b])),
                           edge_numbers.at(key(nodes[edges[0][0]], nodes[edges[0][1]])));
        }
      }

      /// Edges of triangles are halved, and those of elements whose cells have no shape of their
      /// own and are bent otherwise; with them all that lie across quadrilaterals.
      void halve_edges()
      {
        std::vector<bool> is_bent(in.elements.size());
        for (unsigned int e = 0; e < in.elements.size(); ++e)
          is_bent[e] = in.elements[e].is_quadratic() && follows_circles(e) &&
                       !ElementMap(in.nodes, in.elements[e], true).is_straight();
        if (std::all_of(in.elements.begin(), in.elements.end(),
                        [](const auto &element)
                        { return element.shape == ElementShape::hexahedron; }) &&
            std::find(is_bent.begin(), is_bent.end(), true) == is_bent.end())
          return;
        for (const ElementFile::Element &element : in.elements)
          for (const auto &[a, b] : ElementFile::edges(element.shape))
            edge_numbers.emplace(key(element.nodes[a], element.nodes[b]), edge_numbers.size());
        Groups classes(edge_numbers.size());
        std::vector<bool> is_first(edge_numbers.size()); // for its own sake
        for (unsigned int e = 0; e < in.elements.size(); ++e)
          if (is_bent[e])
            for (const auto &[a, b] : ElementFile::edges(in.elements[e].shape))
              is_first[edge_numbers.at(key(in.elements[e].nodes[a], in.elements[e].nodes[b]))] =
                  true;
        for (const ElementFile::Element &element : in.elements)
          for (unsigned int f = 0; f < ElementFile::faces(element.shape).size(); ++f)
          {
            const ElementFile::Face face = in.face(element, f);
            if (face[3] == ElementFile::none)
              for (unsigned int v = 0; v < 3; ++v)
                is_first[edge_numbers.at(key(face[v], face[(v + 1) % 3]))] = true;
            else
              for (unsigned int v = 0; v < 2; ++v)
                classes.join(edge_numbers.at(key(face[v], face[v + 1])),
                             edge_numbers.at(key(face[v + 2], face[(v + 3) % 4])));
          }
        if (keep_own)
          join_bodies_of_simplices(classes);
        std::vector<bool> class_is_halved(edge_numbers.size());
        for (unsigned int edge = 0; edge < is_first.size(); ++edge)
          if (is_first[edge])
            class_is_halved[classes.of(edge)] = true;
        halved.resize(edge_numbers.size());
        for (unsigned int edge = 0; edge < halved.size(); ++edge)
          halved[edge] = class_is_halved[classes.of(edge)];
      }

      bool is_halved(const unsigned int a, const unsigned int b) const
      {
        const auto edge = edge_numbers.find(key(a, b));
        return edge != edge_numbers.end() && halved[edge->second];
      }

      /// The places of the corners of the cells that an element is divided into.
      std::vector<std::array<ElementPlace, 8>> cells_of(const ElementFile::Element &element) const
      {
        std::vector<std::array<ElementPlace, 8>> cells;
        const auto along = [&](const unsigned int a, const unsigned int b)
        {
          return is_halved(element.nodes[a], element.nodes[b]) ? std::vector<double>{0, 0.5, 1}
                                                               : std::vector<double>{0, 1};
        };
        // The centre of some corners of a simplex
        const auto centre = [](const std::vector<unsigned int> &corners)
        {
          ElementPlace place{};
          for (const unsigned int corner : corners)
            place[corner] = 1. / corners.size();
          return place;
        };
        if (element.shape == ElementShape::tetrahedron)
        {
          // Each corner with the others so that these turn about it in one way
          for (const auto &[v, a, b, c] : {std::array<unsigned int, 4>{{0, 1, 2, 3}},
                                           {{1, 0, 3, 2}},
                                           {{2, 3, 0, 1}},
                                           {{3, 2, 1, 0}}})
            cells.push_back(
                {{centre({v}), centre({v, a}), centre({v, a, b}), centre({v, b}), centre({v, c}),
                  centre({v, a, c}), centre({0, 1, 2, 3}), centre({v, b, c})}});
          return cells;
        }
        if (element.shape == ElementShape::wedge)
        {
          const std::vector<double> z = along(0, 3);
          for (unsigned int k = 0; k + 1 < z.size(); ++k)
            for (unsigned int v = 0; v < 3; ++v)
            {
              const std::array<ElementPlace, 4> quadrilateral = {
                  {centre({v}), centre({v, (v + 1) % 3}), centre({0, 1, 2}),
                   centre({v, (v + 2) % 3})}};
              std::array<ElementPlace, 8> cell;
              for (unsigned int w = 0; w < 8; ++w)
              {
                cell[w]    = quadrilateral[w % 4];
                cell[w][3] = z[k + w / 4];
              }
              cells.push_back(cell);
            }
          return cells;
        }
        const std::array<std::vector<double>, 3> x = {{along(0, 1), along(0, 3), along(0, 4)}};
        for (unsigned int k = 0; k + 1 < x[2].size(); ++k)
          for (unsigned int j = 0; j + 1 < x[1].size(); ++j)
            for (unsigned int i = 0; i + 1 < x[0].size(); ++i)
            {
              std::array<ElementPlace, 8> cell;
              for (unsigned int w = 0; w < 8; ++w)
                cell[w] = {{x[0][i + ElementMap::coordinate(w, 0)],
                            x[1][j + ElementMap::coordinate(w, 1)],
                            x[2][k + ElementMap::coordinate(w, 2)], 0}};
              cells.push_back(cell);
            }
        return cells;
      }

      /// Enters a divided element whose displacements stay its own polynomials.
      void keep_element(const ElementShape shape,
                        const std::vector<std::array<ElementPlace, 8>> &places)
      {
        for (unsigned int k = 0; k < places.size(); ++k)
        {
          OwnElements::Cell cell;
          cell.element = out.own.shapes.size();
          for (unsigned int v = 0; v < 8; ++v)
            cell.between[v] = corners_between(shape, places[k][v]);
          out.own.cells.resize(out.cells.size() - places.size() + k);
          out.own.cells.push_back(cell);
        }
        out.own.shapes.push_back(shape);
      }

      /// The node at a place of an element. Inner ones belong to the element alone.
      unsigned int node_at(const ElementFile::Element &element, const ElementMap &map,
                           const ElementPlace &place, unsigned int &inner)
      {
        const std::vector<unsigned int> corners = nodes_between(element, place);
        if (corners.size() == 1)
          return corners[0];
        const Point<3> x = map.at(place);
        if (corners.size() == ElementFile::n_corners(element.shape))
        {
          if (inner == ElementFile::none)
          {
            inner = out.nodes.size();
            out.nodes.push_back(x);
          }
          return inner;
        }
        const auto [shared, is_new] = shared_nodes.emplace(corners, out.nodes.size());
        if (is_new)
          out.nodes.push_back(x);
        else if (out.nodes[shared->second].distance(x) > map.tolerance())
          in.fail_beside_another(element);
        return shared->second;
      }

      void divide_element(const unsigned int e)
      {
        const ElementFile::Element &element = in.elements[e];
        const auto places                   = cells_of(element);
        if (places.size() == 1 && !element.is_quadratic())
        {
          MeshFile::Cell cell{{}, element.number};
          std::copy_n(element.nodes.begin(), 8, cell.nodes.begin());
          parts[e].push_back(out.cells.size());
          out.cells.push_back(cell);
          return;
        }
        const ElementMap map(in.nodes, element, follows_circles(e));
        const bool has_shape = !follows_circles(e) && !map.is_straight();
        unsigned int inner   = ElementFile::none;
        double low = 1, high = -1;
        const auto add = [&](const auto &jacobians)
        {
          for (const double jacobian : jacobians)
          {
            low  = std::min(low, jacobian);
            high = std::max(high, jacobian);
          }
        };
        for (const std::array<ElementPlace, 8> &place : places)
        {
          MeshFile::Cell cell{{}, element.number};
          for (unsigned int v = 0; v < 8; ++v)
            cell.nodes[v] = node_at(element, map, place[v], inner);
          add(corner_jacobians(out, cell));
          if (has_shape)
            add(shape_cell(element, cell, place, map).scaled_jacobians());
          parts[e].push_back(out.cells.size());
          out.cells.push_back(cell);
        }
        out.division.n_divided += places.size() > 1;
        if (!keeps_own.empty() && keeps_own[e] && places.size() > 1)
          keep_element(element.shape, places);
        out.division.n_curved += has_shape;
        // A hexahedron that stays one is looked at with the others, as the file has it.
        if ((places.size() > 1 || has_shape) && !(low > 0 || high < 0))
          in.fail(element, text_of("is flat or folded: the hexahedra that it is divided into have "
                                   "scaled Jacobians from ",
                                   low, " to ", high, "; all must be positive."));
      }

      /// Some corners of a cell by their nodes, ascending.
      template <std::size_t n>
      static std::array<unsigned int, n> nodes_of(const MeshFile::Cell &cell,
                                                  std::array<unsigned int, n> some)
      {
        for (unsigned int &corner : some)
          corner = cell.nodes[corner];
        std::sort(some.begin(), some.end());
        return some;
      }

      /// Gives the next cell the points of the element's polynomial between its corners.
      QuadraticManifold shape_cell(const ElementFile::Element &element, const MeshFile::Cell &cell,
                                   const std::array<ElementPlace, 8> &corners,
                                   const ElementMap &map)
      {
        QuadraticCells &shapes = out.quadratic;
        const auto add         = [&](auto &points, const auto &some)
        {
          const Point<3> x            = map.at(middle_of(corners, some));
          const auto [shared, is_new] = points.emplace(nodes_of(cell, some), x);
          if (!is_new && shared->second.distance(x) > map.tolerance())
            in.fail_beside_another(element);
        };
        for (const auto &edge : ElementFile::edges(ElementShape::hexahedron))
          add(shapes.edges, edge);
        for (const auto &face : MeshFile::cell_faces)
          add(shapes.faces, face);
        const unsigned int number = out.cells.size();
        shapes.cells[number] =
            map.at(middle_of(corners, std::array<unsigned int, 8>{{0, 1, 2, 3, 4, 5, 6, 7}}));
        std::array<Point<3>, 8> places;
        std::array<unsigned int, 8> vertices{};
        for (unsigned int v = 0; v < 8; ++v)
        {
          vertices[v] = cell.nodes[lexicographic_corners[v]];
          places[v]   = out.nodes[vertices[v]];
        }
        return QuadraticManifold(shapes.points(number, places, vertices));
      }

      /// Cells without a shape of their own must have the edges that their neighbours give them.
      void check_neighbours() const
      {
        if (out.quadratic.empty())
          return;
        for (unsigned int e = 0; e < in.elements.size(); ++e)
        {
          if (out.quadratic.cells.count(parts[e][0]) > 0)
            continue;
          const ElementFile::Element &element = in.elements[e];
          const auto places                   = cells_of(element);
          const ElementMap map(in.nodes, element, follows_circles(e));
          for (unsigned int k = 0; k < places.size(); ++k)
            for (const auto &edge : ElementFile::edges(ElementShape::hexahedron))
            {
              const auto shared = out.quadratic.edges.find(nodes_of(out.cells[parts[e][k]], edge));
              if (shared != out.quadratic.edges.end() &&
                  shared->second.distance(map.at(middle_of(places[k], edge))) > map.tolerance())
                in.fail_beside_another(element);
            }
        }
      }

      /// The node between corners, or none where no element has been divided there.
      unsigned int shared_node(std::vector<unsigned int> corners) const
      {
        std::sort(corners.begin(), corners.end());
        const auto node = shared_nodes.find(corners);
        return node == shared_nodes.end() ? ElementFile::none : node->second;
      }

      /// The faces of cells that a face is divided into. One of no element becomes one of no cell.
      std::vector<MeshFile::Face> faces_of(const ElementFile::Face &face) const
      {
        std::vector<MeshFile::Face> result;
        const auto add = [&](MeshFile::Face corners)
        {
          std::sort(corners.begin(), corners.end());
          result.push_back(corners);
        };
        if (face[3] == ElementFile::none)
        {
          const unsigned int centre = shared_node({face[0], face[1], face[2]});
          for (unsigned int v = 0; v < 3; ++v)
          {
            const unsigned int a = face[v], b = face[(v + 1) % 3], c = face[(v + 2) % 3];
            const unsigned int ab = shared_node({a, b}), ca = shared_node({c, a});
            const bool exists =
                centre != ElementFile::none && ab != ElementFile::none && ca != ElementFile::none;
            add(exists ? MeshFile::Face{{a, ab, centre, ca}} : MeshFile::Face{{a, b, c, c}});
          }
          return result;
        }
        const auto [a, b, c, d] = face;
        const unsigned int ab = shared_node({a, b}), bc = shared_node({b, c}),
                           cd = shared_node({c, d}), da = shared_node({d, a}),
                           centre   = shared_node({a, b, c, d});
        constexpr unsigned int none = ElementFile::none;
        if (centre != none && ab != none && bc != none && cd != none && da != none)
        {
          add({{a, ab, centre, da}});
          add({{ab, b, bc, centre}});
          add({{centre, bc, c, cd}});
          add({{da, centre, cd, d}});
        }
        else if (ab != none && cd != none)
        {
          add({{a, ab, cd, d}});
          add({{ab, b, c, cd}});
        }
        else if (bc != none && da != none)
        {
          add({{a, b, bc, da}});
          add({{da, bc, c, d}});
        }
        else
          add(face);
        return result;
      }

      void carry_groups()
      {
        for (const auto &[name, elements] : in.volumes)
          for (const unsigned int e : elements)
            out.volumes[name].insert(out.volumes[name].end(), parts[e].begin(), parts[e].end());
        for (const auto &[name, faces] : in.surfaces)
          for (const ElementFile::Face &face : faces)
            for (const MeshFile::Face &part : faces_of(face))
              out.surfaces[name].push_back(part);
        for (auto &[name, cells] : out.volumes)
          std::sort(cells.begin(), cells.end());
        for (auto &[name, faces] : out.surfaces)
        {
          std::sort(faces.begin(), faces.end());
          faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
        }
        out.node_sets = in.node_sets;
      }

      const ElementFile &in;
      const std::function<bool(unsigned int)> &follows_circles;
      const bool keep_own;
      std::vector<bool> keeps_own; ///< by element; empty: none
      MeshFile out;
      std::unordered_map<std::uint64_t, unsigned int> edge_numbers;
      std::vector<bool> halved;                                       ///< by edge
      std::map<std::vector<unsigned int>, unsigned int> shared_nodes; ///< by corners
      std::vector<std::vector<unsigned int>> parts;                   ///< cells of each element
    };
  } // namespace

  MeshFile divide(const ElementFile &elements,
                  const std::function<bool(unsigned int)> &follows_circles, const bool keep_own)
  {
    return Divider(elements, follows_circles, keep_own).divide();
  }
} // namespace squeal
