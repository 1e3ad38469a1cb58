#include <squeal/mesh/nearest_point.h>

#include <doctest/doctest.h>

#include <cmath>
namespace squeal::tests::nearest_point_tests
{
  using namespace dealii;

  namespace
  {
    /// Quarters of a cylinder about z of radius 2, of height 1, as patches of degree 2 whose middle
    /// nodes lie on it.
    std::vector<SurfaceFace<3>> cylinder(const unsigned int n)
    {
      std::vector<SurfaceFace<3>> faces(n);
      for (unsigned int f = 0; f < n; ++f)
        for (const double z : {0., 0.5, 1.})
          for (const double a : {0., 0.5, 1.})
          {
            const double angle = 2 * M_PI * (f + a) / n;
            faces[f].nodes.emplace_back(2 * std::cos(angle), 2 * std::sin(angle), z);
          }
      return faces;
    }
  } // namespace

  TEST_CASE("nearest_point: plane, edge, cylinder")
  {
    const FaceElement<3> linear(1), quadratic(2);
    SurfaceFace<3> square, next;
    for (const double y : {0., 2.})
      for (const double x : {0., 1.})
      {
        square.nodes.emplace_back(x, y, 0);
        next.nodes.emplace_back(x + 1, y, 0);
      }
    // Over the second face: x = 1.25 is a quarter of it, y = 0.5 a quarter of two.
    NearestPoint found = nearest_point(linear, {square, next}, Point<3>(1.25, 0.5, 0.3));
    CHECK(found.face == 1);
    CHECK(found.xi.distance(Point<2>(0.25, 0.25)) <= 1e-14);
    CHECK(std::abs(found.distance - 0.3) <= 1e-14);
    // Beyond an edge, 3 along x and 4 upwards from it: distance 5. On the common edge the first
    // face is taken.
    found = nearest_point(linear, {square, next}, Point<3>(-3, 1, 4));
    CHECK(found.face == 0);
    CHECK(found.xi.distance(Point<2>(0, 0.5)) <= 1e-14);
    CHECK(std::abs(found.distance - 5) <= 1e-13);
    CHECK(nearest_point(linear, {square, next}, Point<3>(1, 1, 0)).face == 0);
    CHECK(nearest_point(linear, {}, Point<3>(1, 1, 0)).face == static_cast<unsigned int>(-1));
    // Inside of a cylinder at radius 1.5: 0.5 away, up to the patches' own distance from it (48 of
    // them: 1e-6).
    for (const double angle : {0.1, 2., 5.})
    {
      found = nearest_point(quadratic, cylinder(48),
                            Point<3>(1.5 * std::cos(angle), 1.5 * std::sin(angle), 0.25));
      CHECK(found.face == static_cast<unsigned int>(angle / (2 * M_PI) * 48));
      CHECK(std::abs(found.distance - 0.5) <= 2e-6);
      CHECK(std::abs(found.xi[1] - 0.25) <= 1e-12);
    }
  }
} // namespace squeal::tests::nearest_point_tests
