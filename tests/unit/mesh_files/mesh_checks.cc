#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/base/errors.h>
#include <squeal/mesh_files/element_file.h>
#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/mesh_files/rigid_motions.h>

#include <sstream>
namespace squeal::tests::mesh_checks_tests
{
  using namespace dealii;

  namespace
  {
    /// A rectangle z = const as one patch, looking up or down.
    SurfaceFace<3> rectangle(const double x_0, const double x_1, const double y_0, const double y_1,
                             const double z, const bool up)
    {
      SurfaceFace<3> face;
      face.nodes       = {{x_0, y_0, z}, {x_1, y_0, z}, {x_0, y_1, z}, {x_1, y_1, z}};
      face.orientation = up ? 1 : -1;
      return face;
    }

    MeshFile cube()
    {
      MeshFile file;
      file.nodes = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                    {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
      file.cells = {{{{0, 1, 2, 3, 4, 5, 6, 7}}, 1}};
      return file;
    }
  } // namespace

  TEST_CASE("mesh checks: scaled Jacobians at the corners")
  {
    MeshFile file = cube();
    for (const double jacobian : corner_jacobians(file, file.cells[0]))
      CHECK(jacobian == 1);
    // Sheared by 60 degrees: sin 30 degrees at each corner
    for (Point<3> &x : file.nodes)
      x[0] += std::sqrt(3.) * x[1];
    for (const double jacobian : corner_jacobians(file, file.cells[0]))
      CHECK(std::abs(jacobian - 0.5) <= 1e-15);
    // Mirrored
    for (Point<3> &x : file.nodes)
      x[2] = -x[2];
    for (const double jacobian : corner_jacobians(file, file.cells[0]))
      CHECK(std::abs(jacobian + 0.5) <= 1e-15);
    // A corner on the middle of the diagonal across: flat there
    file             = cube();
    file.nodes[6]    = Point<3>(2. / 3, 2. / 3, 2. / 3); // in the plane of its three neighbours
    const auto after = corner_jacobians(file, file.cells[0]);
    CHECK(std::abs(after[7]) <= 1e-15);
    CHECK(after[0] == 1);
  }

  TEST_CASE("mesh checks: faces of surfaces of revolution")
  {
    const auto at = [](const double r, const double phi, const double z)
    { return Point<3>(r * std::cos(phi), r * std::sin(phi), z); };
    // On a plane, whatever the corners; on a cylinder; on a cone
    CHECK(distance_from_revolution(
              {{at(1, 0, 2), at(1.3, 0.1, 2), at(1.1, 0.5, 2), at(2, 1, 2)}}) <= 1e-15);
    CHECK(distance_from_revolution({{at(1, 0, 2), at(1, 0.1, 2), at(1, 0, 3), at(1, 0.1, 3)}}) <=
          1e-15);
    CHECK(distance_from_revolution({{at(1, 0, 0), at(1, 1, 0), at(2, 0, 1), at(2, 1, 1)}}) <=
          1e-15);
    // A half plane phi = const, as the end of a sector: a square's fourth corner is sqrt(1/2) off
    // its diagonal
    CHECK(
        std::abs(distance_from_revolution({{at(1, 1, 0), at(2, 1, 0), at(1, 1, 1), at(2, 1, 1)}}) -
                 std::sqrt(0.5)) <= 1e-14);
  }

  TEST_CASE("mesh checks: area of a quadrilateral with corners in any order")
  {
    // A trapezoid of height 1 between sides of 3 and 1
    std::array<Point<3>, 4> x = {
        {Point<3>(0, 0, 2), Point<3>(3, 0, 2), Point<3>(2, 1, 2), Point<3>(1, 1, 2)}};
    std::sort(x.begin(), x.end(), [](const auto &a, const auto &b) { return a[0] < b[0]; });
    do
      CHECK(std::abs(area_of(x) - 2) <= 1e-14);
    while (std::next_permutation(x.begin(), x.end(),
                                 [](const auto &a, const auto &b) { return a[0] < b[0]; }));
  }

  TEST_CASE("mesh checks: rigid motions that supports leave")
  {
    RigidMotions motions;
    CHECK(motions.n_free()[0] == 6);
    motions.hold(Point<3>(0, 0, 0), 0);
    motions.hold(Point<3>(0, 0, 0), 1);
    motions.hold(Point<3>(0, 0, 0), 2);
    CHECK(motions.n_free()[0] == 3);
    motions.hold(Point<3>(0, 0, 0), 2); // again
    CHECK(motions.n_free()[0] == 3);
    motions.hold(Point<3>(1, 0, 0), 1);
    motions.hold(Point<3>(1, 0, 0), 2);
    CHECK(motions.n_free()[0] == 1); // about x
    motions.hold(Point<3>(0.5, 0.2, 0), 2);
    CHECK(motions.n_free()[0] == 0);

    // Two bodies: the first is held at a point, then turned by springs, the second hangs on it.
    RigidMotions two(2);
    for (unsigned int c = 0; c < 3; ++c)
      two.hold(Point<3>(0.3, 0, 0), c, 0);
    CHECK(two.n_free() == std::vector<unsigned int>({3, 6}));
    CHECK(two.describe(0) == "about x, about y, about z");
    for (unsigned int c = 3; c < 6; ++c)
      two.connect(0, Point<3>(0, 0, 0), RigidMotions::ground, Point<3>(), c);
    for (unsigned int c : {0u, 1u})
      two.connect(0, Point<3>(0, 0, 0), 1, Point<3>(0, 0, 0), c);
    CHECK(two.n_free() == std::vector<unsigned int>({0, 4}));
    CHECK(two.describe(1) == "along z, about x, about y, about z");
    for (unsigned int c = 2; c < 6; ++c)
      two.connect(1, Point<3>(0, 0, 0), 0, Point<3>(0, 0, 0), c);
    CHECK(two.n_free() == std::vector<unsigned int>({0, 0}));
  }

  TEST_CASE("mesh checks: contact pairs")
  {
    const std::vector<SurfaceFace<3>> rotor = {rectangle(0, 1, 0, 2, 3, true),
                                               rectangle(1, 3, 0, 2, 3, true)};
    const auto check                        = [&](const SurfaceFace<3> &pad)
    { return check_contact_pair("", "pad", {pad}, "rotor", rotor, 0.); };
    // Across both faces of the rotor, 3e-5 apart: allowed is 1e-4 of sqrt 5
    const auto inside = check(rectangle(0.5, 2.5, 0.5, 1.5, 3 + 3e-5, false));
    CHECK(std::abs(inside.overlap - 2) <= 1e-12);
    CHECK(std::abs(inside.pad_area - 2) <= 1e-14);
    CHECK(std::abs(inside.gap - 3e-5) <= 1e-12);
    CHECK(std::abs(inside.least_cover - 1) <= 1e-12);
    // A quarter beyond the edge
    CHECK(std::abs(check(rectangle(1.5, 3.5, 0.5, 1.5, 3, false)).least_cover - 0.75) <= 1e-12);

    const auto message = [&](const SurfaceFace<3> &pad)
    { return message_of<InputError>([&]() { check(pad); }); };
    CHECK(contains(message(rectangle(2.5, 4.5, 0.5, 1.5, 3, false)), "25 % of the pad's face"));
    CHECK(contains(message(rectangle(0.5, 2.5, 0.5, 1.5, 3.01, false)), "a gap of 0.01"));
    CHECK(contains(message(rectangle(0.5, 2.5, 0.5, 1.5, 2.99, false)), "an overlap of 0.01"));
    CHECK(contains(message(rectangle(0.5, 2.5, 0.5, 1.5, 3, true)), "same direction"));
    SurfaceFace<3> oblique = rectangle(0.5, 2.5, 0.5, 1.5, 3, false);
    oblique.nodes[0][2] += 0.01;
    CHECK(contains(message(oblique), "plane"));
  }

  TEST_CASE("mesh files: Gmsh and Abaqus text gives the same cube")
  {
    std::istringstream gmsh(
        "$MeshFormat\n2.2 0 "
        "8\n$EndMeshFormat\n$Comments\nanything\n$EndComments\n$PhysicalNames\n2\n"
        "2 1 \"the top\"\n3 2 \"body\"\n$EndPhysicalNames\n$Nodes\n8\n1 0 0 0\n2 1 0 0\n3 1 1 0\n"
        "4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n$EndNodes\n$Elements\n3\n1 15 2 0 1 1\n"
        "2 3 2 1 1 5 6 7 8\n3 5 2 2 1 1 2 3 4 5 6 7 8\n$EndElements\n");
    std::istringstream abaqus(
        "*Heading\r\n cube\r\n*NODE, NSET=all\r\n1, 0, 0, 0\r\n2, 1, 0, 0\r\n3, 1, 1, 0\r\n4, 0, "
        "1, "
        "0\r\n5, 0, 0, 1\r\n6, 1, 0, 1\r\n7, 1, 1, 1\r\n8, 0, 1, 1\r\n*ELEMENT, TYPE=C3D8R,\r\n"
        "ELSET=Body\r\n3, 1, 2, 3, 4,\r\n5, 6, 7, 8\r\n*SURFACE, NAME=\"The top\"\r\nBODY, "
        "S2\r\n*STEP\r\n1, 2\r\n");
    ElementFile of_gmsh, of_abaqus;
    read_gmsh(gmsh, of_gmsh);
    read_abaqus(abaqus, of_abaqus);
    const auto straight = [](const unsigned int) { return false; };
    const MeshFile a = divide(of_gmsh, straight), b = divide(of_abaqus, straight);
    for (const MeshFile *file : {&a, &b})
    {
      REQUIRE(file->cells.size() == 1);
      REQUIRE(file->nodes.size() == 8);
      CHECK(file->cells[0].number == 3);
      for (unsigned int v = 0; v < 8; ++v)
        CHECK(file->nodes[file->cells[0].nodes[v]] == cube().nodes[v]);
    }
    CHECK(a.volumes.at("body") == std::vector<unsigned int>{0});
    CHECK(b.volumes.at("BODY") == std::vector<unsigned int>{0});
    CHECK(a.surfaces.at("the top") == std::vector<MeshFile::Face>{{{4, 5, 6, 7}}});
    CHECK(b.surfaces.at("THE TOP") == a.surfaces.at("the top"));
    CHECK(b.node_sets.at("ALL").size() == 8);
  }
} // namespace squeal::tests::mesh_checks_tests
