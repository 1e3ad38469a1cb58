#include "../joints/blocks.h"

#include <doctest/doctest.h>

#include <squeal/base/errors.h>
#include <squeal/mesh/coarse_mesh.h>
#include <squeal/mesh/quadratic_manifold.h>
#include <squeal/mesh_files/element_file.h>
#include <squeal/mesh_files/mesh_checks.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/fe/mapping_q.h>
#include <deal.II/grid/grid_tools.h>

#include <set>
#include <sstream>
namespace squeal::tests::element_division_tests
{
  using namespace dealii;

  namespace
  {
    MeshFile divided(const ElementFile &file, const bool circles = false)
    {
      return divide(file, [=](const unsigned int) { return circles; });
    }

    ElementFile element(const ElementShape shape, const std::vector<Point<3>> &corners)
    {
      ElementFile file;
      file.nodes = corners;
      file.elements.push_back({shape, {}, 7, 3});
      for (unsigned int v = 0; v < corners.size(); ++v)
        file.elements[0].nodes.push_back(v);
      return file;
    }

    double smallest_jacobian(const MeshFile &file)
    {
      double smallest = 1;
      for (const MeshFile::Cell &cell : file.cells)
        for (const double jacobian : corner_jacobians(file, cell))
          smallest = std::min(smallest, jacobian);
      return smallest;
    }

    /// Middle nodes for the edges of all elements, at the place of the straight middle.
    void add_middles(ElementFile &file)
    {
      std::map<std::pair<unsigned int, unsigned int>, unsigned int> middles;
      for (ElementFile::Element &element : file.elements)
        for (const auto &[v, w] : ElementFile::edges(element.shape))
        {
          const unsigned int a = element.nodes[v], b = element.nodes[w];
          const auto [middle, is_new] = middles.emplace(std::minmax(a, b), file.nodes.size());
          if (is_new)
            file.nodes.push_back(file.nodes[a] + 0.5 * (file.nodes[b] - file.nodes[a]));
          element.nodes.push_back(middle->second);
        }
    }

    /// A map of degree 2
    Point<3> bend(const Point<3> &x)
    {
      return Point<3>(x[0] + 0.1 * x[1] * x[1] - 0.05 * x[0] * x[2], x[1] + 0.1 * x[0] * x[2],
                      x[2] + 0.08 * x[0] * x[0] + 0.06 * x[1] * x[2]);
    }

    const std::vector<Point<3>> corner_tetrahedron = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const std::vector<Point<3>> wedge              = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0},
                                                      {0, 0, 2}, {1, 0, 2}, {0, 1, 2}};

    /// A hexahedron 0 < x < 1, two wedges 1 < x < 2 with their axes along y, and on each of their
    /// triangles y = 1 a tetrahedron with the apex y = 2.
    ElementFile mixed()
    {
      ElementFile file;
      for (unsigned int k = 0; k < 2; ++k)
        for (unsigned int j = 0; j < 2; ++j)
          for (unsigned int i = 0; i < 3; ++i)
            file.nodes.emplace_back(i, j, k);
      const auto node = [](const unsigned int i, const unsigned int j, const unsigned int k)
      { return i + 3 * j + 6 * k; };
      const unsigned int apex = file.nodes.size();
      file.nodes.emplace_back(1.5, 2, 0.5);
      file.elements.push_back({ElementShape::hexahedron,
                               {node(0, 0, 0), node(1, 0, 0), node(1, 1, 0), node(0, 1, 0),
                                node(0, 0, 1), node(1, 0, 1), node(1, 1, 1), node(0, 1, 1)},
                               1,
                               1});
      const std::array<std::array<std::array<unsigned int, 2>, 3>, 2> triangles = {
          {{{{{1, 0}}, {{2, 1}}, {{2, 0}}}}, {{{{1, 0}}, {{1, 1}}, {{2, 1}}}}}};
      for (const auto &triangle : triangles) // (x, z), turning so that the wedge goes along +y
      {
        std::vector<unsigned int> nodes;
        for (const unsigned int j : {0u, 1u})
          for (const unsigned int v : {0u, 2u, 1u})
            nodes.push_back(node(triangle[v][0], j, triangle[v][1]));
        file.elements.push_back({ElementShape::wedge, nodes, 2, 2});
        file.elements.push_back(
            {ElementShape::tetrahedron, {nodes[3], nodes[4], nodes[5], apex}, 3, 3});
      }
      for (unsigned int e = 0; e < file.elements.size(); ++e)
        file.volumes["all"].push_back(e);
      return file;
    }

    Geometry<3> geometry_of(MeshFile file)
    {
      Geometry<3> geometry;
      geometry.parts = {{rotor_body, 0, false}};
      std::vector<unsigned int> number(file.nodes.size(), numbers::invalid_unsigned_int);
      for (MeshFile::Cell &cell : file.cells)
      {
        if (corner_jacobians(file, cell)[0] < 0)
          for (unsigned int v = 0; v < 4; ++v)
            std::swap(cell.nodes[v], cell.nodes[v + 4]);
        CoarseCell<3> data;
        data.material_id = rotor_body;
        for (unsigned int v = 0; v < 8; ++v)
        {
          const unsigned int node = cell.nodes[lexicographic_corners[v]];
          if (number[node] == numbers::invalid_unsigned_int)
          {
            number[node] = geometry.vertices.size();
            geometry.vertices.push_back(file.nodes[node]);
          }
          data.vertices[v] = number[node];
        }
        geometry.cells.push_back(data);
      }
      geometry.quadratic = file.quadratic.renumbered(number);
      REQUIRE(order_consistently(geometry.cells));
      return geometry;
    }

    /// A linear displacement has a constant stress: K u = 0 at all nodes inside.
    void check_patch(const Geometry<3> &geometry, const unsigned int degree, const bool hanging)
    {
      CAPTURE(degree);
      CAPTURE(hanging);
      FiniteElementSpace<3> spaces(geometry, degree, true, MPI_COMM_WORLD);
      spaces.distribute();
      if (hanging)
        refine_every_second(spaces, {rotor_body});
      const Matrix K        = patch_stiffness(spaces, {rotor_body});
      const MultiVector x   = patch_displacement(spaces, {rotor_body}, patch_gradient());
      const Balance balance = balance_of(spaces, multiply(K, x), MultiVector(spaces.rows, 1));
      CHECK(balance.n_checked >= 3);
      CHECK(balance.largest <= 1e-10 * balance.largest_force);
    }

    /// Of cells, by the divergence of x / 3 over their faces: what is left of faces that two cells
    /// share shows that these are not the same.
    double volume(const Geometry<3> &geometry)
    {
      Triangulation<3> triangulation;
      make_coarse_mesh(geometry, triangulation);
      return GridTools::volume(triangulation);
    }

    unsigned int n_boundary_faces(const Geometry<3> &geometry)
    {
      Triangulation<3> triangulation;
      make_coarse_mesh(geometry, triangulation);
      unsigned int n = 0;
      for (const auto &cell : triangulation.active_cell_iterators())
        for (const unsigned int f : cell->face_indices())
          n += cell->face(f)->at_boundary();
      return n;
    }
  } // namespace

  TEST_CASE("element division: tetrahedra and wedges")
  {
    // theory.md, section 8: 0.71 of a regular tetrahedron, 0.44 of a corner. By hand: at a face's
    // centre of the regular one edges to two middles of edges and to the cell's centre, the latter
    // at right angles, the others at 120 degrees: sin 120 = 0.87; at the cell's centre edges to
    // three faces' centres with cosines -1/3: sqrt(1 - 3/9 - 2/27) = 0.77; at a corner cosines 1/2:
    // sqrt(1 - 3/4 + 1/4) = 1/sqrt 2; at a middle of an edge edges at right angles to it, with the
    // dihedral angle, whose sine is sqrt(8)/3 = 0.94.
    const MeshFile regular = divided(
        element(ElementShape::tetrahedron, {{1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}}));
    CHECK(regular.cells.size() == 4);
    CHECK(std::abs(smallest_jacobian(regular) - std::sqrt(0.5)) <= 1e-14);
    const MeshFile corner = divided(element(ElementShape::tetrahedron, corner_tetrahedron));
    CHECK(std::abs(smallest_jacobian(corner) - 0.44) <= 0.005);
    CHECK(corner.nodes.size() == 4 + 6 + 4 + 1);
    CHECK(std::abs(volume(geometry_of(corner)) - 1. / 6) <= 1e-15);
    CHECK(n_boundary_faces(geometry_of(corner)) == 12);

    const MeshFile three = divided(element(ElementShape::wedge, wedge));
    CHECK(three.cells.size() == 3);
    CHECK(three.nodes.size() == 2 * (3 + 3 + 1));
    CHECK(std::abs(volume(geometry_of(three)) - 1) <= 1e-14);
    CHECK(n_boundary_faces(geometry_of(three)) == 12);
  }

  TEST_CASE("element division: mixed elements hang together, and groups follow")
  {
    ElementFile file = mixed();
    // Two wedges of area 1/2 and height 1, two tetrahedra of a base 1/2 and the height 1
    file.surfaces["begin"] = {file.face(file.elements[0], 5)}; // x = 0
    file.surfaces["end"]   = {file.face(file.elements[2], 1)}; // a side of the first tetrahedron
    file.surfaces["none"]  = {{{0, 1, 12, ElementFile::none}}};
    for (const bool quadratic : {false, true})
    {
      if (quadratic)
        add_middles(file);
      const MeshFile mesh = divided(file);
      // Triangles have edges along x and z and across, but none along y: the hexahedron, which
      // shares edges along z, becomes two.
      CHECK(mesh.cells.size() == 2 + 2 * 3 + 2 * 4);
      CHECK(mesh.division.n_divided == 5);
      CHECK(mesh.volumes.at("all").size() == mesh.cells.size());
      CHECK(mesh.surfaces.at("begin").size() == 2);
      CHECK(mesh.surfaces.at("end").size() == 3);
      const Geometry<3> geometry = geometry_of(mesh);
      CHECK(std::abs(volume(geometry) - (2 + 2 * 0.5 / 3)) <= 1e-13);
      // Hexahedron: 5 faces of which 1 is whole and ... counted: x = 0: 2, y: 2 + 2, z: 1 + 1.
      // Wedges: y = 0: 3 + 3, z = 0, z = 1, x = 2: 2 each. Tetrahedra: 2 sides of 3 faces each; the
      // one that they share is inside.
      CHECK(n_boundary_faces(geometry) == 8 + 12 + 12);
      std::set<MeshFile::Face> faces;
      for (unsigned int c = 0; c < mesh.cells.size(); ++c)
        for (unsigned int f = 0; f < 6; ++f)
          faces.insert(mesh.face(c, f));
      for (const char *name : {"begin", "end"})
        for (const MeshFile::Face &face : mesh.surfaces.at(name))
          CHECK(faces.count(face) == 1);
      for (const MeshFile::Face &face : mesh.surfaces.at("none"))
        CHECK(faces.count(face) == 0);
    }
  }

  TEST_CASE("element division: constant stress on divided and mixed meshes, with hanging nodes")
  {
    const Geometry<3> geometry = geometry_of(divided(mixed()));
    for (const unsigned int degree : {1u, 2u, 3u})
      for (const bool hanging : {false, true})
        check_patch(geometry, degree, hanging);
  }

  TEST_CASE("element division: cells have the shape that middle nodes give an element")
  {
    // Elements of degree 2 with straight edges before a map of degree 2 have it exactly.
    for (ElementFile file : {element(ElementShape::tetrahedron, corner_tetrahedron),
                             element(ElementShape::wedge, wedge),
                             element(ElementShape::hexahedron, {{0, 0, 0},
                                                                {1, 0, 0},
                                                                {1, 1, 0},
                                                                {0, 1, 0},
                                                                {0, 0, 1},
                                                                {1, 0, 1},
                                                                {1, 1, 1},
                                                                {0, 1, 1}})})
    {
      add_middles(file);
      const Geometry<3> straight = geometry_of(divided(file));
      CHECK(straight.quadratic.empty());
      for (Point<3> &x : file.nodes)
        x = bend(x);
      const MeshFile divided_file = divided(file);
      const Geometry<3> bent      = geometry_of(divided_file);
      REQUIRE(bent.cells.size() == straight.cells.size());
      CHECK(divided_file.division.n_curved == 1);
      CHECK(bent.quadratic.cells.size() == bent.cells.size());
      // Points of the mapping of degree 2, also of cells that are refined, are images of those of
      // the straight ones.
      Triangulation<3> before, after;
      make_coarse_mesh(straight, before);
      make_coarse_mesh(bent, after);
      for (unsigned int level = 0; level < 2; ++level)
      {
        const FE_Q<3> fe(2);
        const MappingQ<3> mapping(2);
        FEValues<3> a(mapping, fe, QGauss<3>(3), update_quadrature_points),
            b(mapping, fe, QGauss<3>(3), update_quadrature_points);
        double furthest = 0;
        auto other      = after.begin_active();
        for (const auto &cell : before.active_cell_iterators())
        {
          a.reinit(cell);
          b.reinit(other++);
          for (unsigned int q = 0; q < a.n_quadrature_points; ++q)
            furthest =
                std::max(furthest, bend(a.quadrature_point(q)).distance(b.quadrature_point(q)));
        }
        CHECK(furthest <= 1e-14);
        before.refine_global();
        after.refine_global();
      }
    }
  }

  TEST_CASE("element division: constant stress in bent cells, with hanging nodes")
  {
    // Of cells with the shape of degree 2 the forces of a constant stress are integrated exactly.
    ElementFile file = mixed();
    add_middles(file);
    for (Point<3> &x : file.nodes)
      x = bend(0.5 * x);
    const MeshFile bent = divided(file);
    CHECK(bent.division.n_curved == 5);
    const Geometry<3> geometry = geometry_of(bent);
    for (const unsigned int degree : {1u, 2u, 3u})
      for (const bool hanging : {false, true})
        check_patch(geometry, degree, hanging);
  }

  TEST_CASE(
      "element division: points of bent cells are found, far from the origin and in thin ones")
  {
    ElementFile file = element(
        ElementShape::hexahedron,
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}});
    add_middles(file);
    for (Point<3> &x : file.nodes)
    {
      x = bend(x);
      x = Point<3>(1 + 1e-3 * x[0], 2 + 1e-3 * x[1], 3 + 1e-5 * x[2]);
    }
    const MeshFile bent = divided(file);
    std::array<Point<3>, 8> corners;
    std::array<unsigned int, 8> vertices{};
    for (unsigned int v = 0; v < 8; ++v)
    {
      vertices[v] = bent.cells[0].nodes[lexicographic_corners[v]];
      corners[v]  = bent.nodes[vertices[v]];
    }
    const QuadraticManifold manifold(bent.quadratic.points(0, corners, vertices));
    for (unsigned int k = 0; k < 125; ++k)
    {
      const Point<3> xi(k % 5 / 4., k / 5 % 5 / 4., k / 25 / 4.);
      // Coordinates of some metres have steps of 4e-16, which is 4e-11 of the thickness.
      CHECK(manifold.pull_back(manifold.push_forward(xi)).distance(xi) <= 1e-10);
    }
  }

  TEST_CASE("element division: new corners of bodies that follow circles lie on them")
  {
    // A tetrahedron with a face on the cylinder r = 1
    ElementFile file         = element(ElementShape::tetrahedron, {{1, 0, 0},
                                                                   {std::cos(0.4), std::sin(0.4), 0},
                                                                   {std::cos(0.2), std::sin(0.2), 0.3},
                                                                   {0.6, 0.1, 0.1}});
    file.surfaces["outside"] = {{{0, 1, 2, ElementFile::none}}};
    const MeshFile flat = divided(file), round = divided(file, true);
    for (const MeshFile *mesh : {&flat, &round})
    {
      double furthest = 0;
      for (const MeshFile::Face &face : mesh->surfaces.at("outside"))
        for (const unsigned int node : face)
          furthest = std::max(furthest,
                              std::abs(1 - std::hypot(mesh->nodes[node][0], mesh->nodes[node][1])));
      if (mesh == &round)
        CHECK(furthest <= 1e-15);
      else
        CHECK(furthest > 1e-2);
    }
  }

  TEST_CASE("element refinement: eight parts that have the element's shape, and groups follow")
  {
    ElementFile file = mixed();
    for (const bool quadratic : {false, true})
    {
      if (quadratic)
        add_middles(file);
      file.surfaces["begin"]  = {file.face(file.elements[0], 5)}; // x = 0
      file.surfaces["end"]    = {file.face(file.elements[2], 1)}; // a triangle
      file.surfaces["none"]   = {{{0, 1, 12, ElementFile::none}}};
      const auto straight     = [](const unsigned int) { return false; };
      const ElementFile parts = refine(file, straight);
      CHECK(parts.elements.size() == 8 * file.elements.size());
      CHECK(parts.volumes.at("all").size() == parts.elements.size());
      CHECK(parts.free_faces().size() == 4 * file.free_faces().size());
      const auto free_faces = parts.free_faces();
      for (const char *name : {"begin", "end"})
      {
        CHECK(parts.surfaces.at(name).size() == 4);
        for (const ElementFile::Face &face : parts.surfaces.at(name))
          CHECK(free_faces.count(ElementFile::ascending(face)) == 1);
      }
      CHECK(parts.surfaces.at("none") == file.surfaces.at("none"));
      // No part is inside out: all have the volume of the whole together.
      CHECK(std::abs(volume(geometry_of(divided(parts))) - (2 + 2 * 0.5 / 3)) <= 1e-13);
      check_patch(geometry_of(divided(parts)), 2, false);
    }
    // Nodes of parts are images of those of the parts before the element was bent by a map of
    // degree 2.
    const ElementFile before = refine(file, [](const unsigned int) { return false; });
    for (Point<3> &x : file.nodes)
      x = bend(0.5 * x);
    const ElementFile after = refine(file, [](const unsigned int) { return false; });
    // What is bent has the middles of its faces and of itself, too.
    CHECK(after.nodes.size() > before.nodes.size());
    for (const Point<3> &y : before.nodes)
    {
      double nearest = 1;
      for (const Point<3> &x : after.nodes)
        nearest = std::min(nearest, x.distance(bend(0.5 * y)));
      CHECK(nearest <= 1e-14);
    }
    check_patch(geometry_of(divided(after)), 2, false);
  }

  TEST_CASE("element refinement: new nodes of bodies that follow circles lie on them")
  {
    // A sector of 60 degrees stays one that its corners tell: no part is divided for its bend.
    ElementFile sector = element(ElementShape::hexahedron, {{1, 0, 0},
                                                            {2, 0, 0},
                                                            {1, std::sqrt(3.), 0},
                                                            {0.5, std::sqrt(0.75), 0},
                                                            {1, 0, 1},
                                                            {2, 0, 1},
                                                            {1, std::sqrt(3.), 1},
                                                            {0.5, std::sqrt(0.75), 1}});
    add_middles(sector);
    for (Point<3> &x : sector.nodes)
    {
      const double r = std::hypot(x[0], x[1]), wanted = r < 1.1 ? 1 : r < 1.6 ? 1.5 : 2;
      x = Point<3>(x[0] * wanted / r, x[1] * wanted / r, x[2]);
    }
    const auto all = [](const unsigned int) { return true; };
    CHECK(divided(sector, true).cells.size() == 1);
    CHECK(divided(refine(refine(sector, all), all), true).cells.size() == 64);

    ElementFile file         = element(ElementShape::tetrahedron, {{1, 0, 0},
                                                                   {std::cos(0.4), std::sin(0.4), 0},
                                                                   {std::cos(0.2), std::sin(0.2), 0.3},
                                                                   {0.6, 0.1, 0.1}});
    file.surfaces["outside"] = {{{0, 1, 2, ElementFile::none}}};
    const ElementFile parts  = refine(file, [](const unsigned int) { return true; });
    for (const ElementFile::Face &face : parts.surfaces.at("outside"))
      for (unsigned int v = 0; v < 3; ++v)
        CHECK(std::abs(1 - std::hypot(parts.nodes[face[v]][0], parts.nodes[face[v]][1])) <= 1e-15);
  }

  TEST_CASE("element division: flat elements, and neighbours of another shape, are refused")
  {
    ElementFile flat = element(ElementShape::tetrahedron, corner_tetrahedron);
    flat.nodes[3]    = Point<3>(0.3, 0.3, 0);
    CHECK_THROWS_WITH_AS(divided(flat), doctest::Contains("line 3: element 7"), InputError);
    CHECK_THROWS_WITH_AS(divided(flat), doctest::Contains("flat or folded"), InputError);

    // A linear beside a quadratic tetrahedron whose common edge is bent
    ElementFile pair = element(ElementShape::tetrahedron, corner_tetrahedron);
    add_middles(pair);
    pair.nodes[4] += Point<3>(0, -0.1, 0);
    pair.nodes.emplace_back(0.2, -1, 0.2);
    pair.elements.push_back({ElementShape::tetrahedron, {0, 1, 3, 10}, 8, 4});
    CHECK_THROWS_WITH_AS(divided(pair), doctest::Contains("line 4: element 8"), InputError);

    // Hexahedra that stay whole: a linear one above a bent one, before it and after it in the file
    ElementFile hexahedra = element(
        ElementShape::hexahedron,
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}});
    add_middles(hexahedra);
    hexahedra.nodes[12] += Point<3>(0, -0.1, 0); // of the edge 4, 5
    for (const double x : {0., 1.})
      for (const double y : {0., 1.})
        hexahedra.nodes.emplace_back(x, y, 2);
    hexahedra.elements.push_back({ElementShape::hexahedron, {4, 5, 6, 7, 20, 22, 23, 21}, 8, 4});
    for (const bool first : {false, true})
    {
      if (first)
        std::swap(hexahedra.elements[0], hexahedra.elements[1]);
      CHECK_THROWS_WITH_AS(divided(hexahedra), doctest::Contains("line 4: element 8"), InputError);
    }
    hexahedra.nodes[12] -= Point<3>(0, -0.1, 0);
    CHECK(divided(hexahedra).cells.size() == 2);

    // Middle nodes so far from the middles that the polynomial turns back
    ElementFile folded = element(
        ElementShape::hexahedron,
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}});
    add_middles(folded);
    folded.nodes[8][0] = 0.8; // beyond 3/4 of the edge 0, 1
    CHECK_THROWS_WITH_AS(divided(folded), doctest::Contains("flat or folded"), InputError);
  }

  TEST_CASE("element division: a deck's parts are those of the flat deck, moved and turned")
  {
    const std::string mesh = "1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
                             "*ELEMENT, TYPE=C3D4, ELSET=Solid\n1, 1, 2, 3, 4\n"
                             "*NSET, NSET=base\n1, 2, 3\n";
    std::istringstream in("*HEADING\n*PART, NAME=Corner\n*NODE\n" + mesh +
                          "*END PART\n*ASSEMBLY, NAME=all\n"
                          "*INSTANCE, NAME=one, PART=Corner\n*END INSTANCE\n"
                          "*INSTANCE, NAME=two, PART=Corner\n5, 0, 0\n5, 0, 0, 5, 0, 1, 90\n"
                          "*END INSTANCE\n"
                          "*ELSET, ELSET=_S_S1, INTERNAL, INSTANCE=two\n1,\n"
                          "*SURFACE, NAME=S, TYPE=ELEMENT\n_S_S1, S1\n"
                          "*ELSET, ELSET=both\none.Solid, two.1\n*END ASSEMBLY\n");
    ElementFile file;
    read_abaqus(in, file);
    REQUIRE(file.elements.size() == 2);
    REQUIRE(file.nodes.size() == 8);
    // (1, 0, 0) is moved to (6, 0, 0) and turned about the line x = 5, y = 0 by a right angle.
    CHECK(file.nodes[1].distance(Point<3>(1, 0, 0)) == 0);
    CHECK(file.nodes[5].distance(Point<3>(5, 1, 0)) <= 1e-15);
    CHECK(file.nodes[6].distance(Point<3>(4, 0, 0)) <= 1e-15);
    using List = std::vector<unsigned int>;
    CHECK(file.volumes.at("ONE") == List{0});
    CHECK(file.volumes.at("TWO.SOLID") == List{1});
    CHECK(file.volumes.at("BOTH") == List{0, 1});
    CHECK(file.volumes.count("_S_S1") == 0);
    CHECK(file.surfaces.at("S") == std::vector<ElementFile::Face>{{{4, 5, 6, ElementFile::none}}});
    CHECK(file.node_sets.at("TWO.BASE") == List{4, 5, 6});
  }

  TEST_CASE(
      "element division: sets that preprocessors make for the faces of a surface are no volumes")
  {
    // _TOP_S1 serves the surface TOP, marked as internal or not; _left and SOLID_S1 are users' own.
    std::istringstream in("*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
                          "*ELEMENT, TYPE=C3D4, ELSET=Solid\n1, 1, 2, 3, 4\n"
                          "*ELSET, ELSET=_TOP_S1\n1,\n*ELSET, ELSET=_left\n1,\n"
                          "*ELSET, ELSET=Solid_S1\n1,\n"
                          "*SURFACE, NAME=TOP, TYPE=ELEMENT\n_TOP_S1, S1\n"
                          "*SURFACE, NAME=other, TYPE=ELEMENT\n_left, S2\nSolid_S1, S1\n");
    ElementFile file;
    read_abaqus(in, file);
    CHECK(file.volumes.count("_TOP_S1") == 0);
    CHECK(file.volumes.count("_LEFT") == 1);
    CHECK(file.volumes.count("SOLID_S1") == 1);
    CHECK(file.surfaces.at("TOP") ==
          std::vector<ElementFile::Face>{{{0, 1, 2, ElementFile::none}}});
  }

  TEST_CASE("element division: surfaces of a deck are faces of solids, their free ones, or shells")
  {
    // Two tetrahedra with a common face 1 2 3 under a shell on the face 0 1 2
    std::istringstream in("*NODE\n1, 0\n2, 1,\n3, 0, 1\n4, , , 1\n5, 1, 1, 1\n"
                          "*ELEMENT, TYPE=C3D4, ELSET=Solid\n1, 1, 2, 3, 4\n2, 2, 3, 4, 5\n"
                          "*ELEMENT, TYPE=S3, ELSET=Shell\n7, 1, 2, 3\n"
                          "*SURFACE, NAME=SKIN\nSolid,\n*SURFACE, NAME=SECOND\n2\n"
                          "*SURFACE, NAME=UP\nShell, SPOS\n*SURFACE, NAME=BOTH\nShell\n1, S2\n");
    ElementFile file;
    read_abaqus(in, file);
    CHECK(file.nodes[3] == Point<3>(0, 0, 1)); // coordinates left out are zero
    const auto sorted = [&](const std::string &name)
    {
      std::set<std::set<unsigned int>> faces;
      for (const ElementFile::Face &face : file.surfaces.at(name))
        faces.insert({face.begin(), face.begin() + 3});
      CHECK(faces.size() == file.surfaces.at(name).size());
      return faces;
    };
    using Faces = std::set<std::set<unsigned int>>;
    CHECK(sorted("SECOND") == Faces{{1, 2, 4}, {1, 3, 4}, {2, 3, 4}});
    CHECK(sorted("SKIN") ==
          Faces{{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 4}, {1, 3, 4}, {2, 3, 4}});
    CHECK(sorted("UP") == Faces{{0, 1, 2}});
    CHECK(sorted("BOTH") == Faces{{0, 1, 2}, {0, 1, 3}});
  }
} // namespace squeal::tests::element_division_tests
