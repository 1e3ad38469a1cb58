#include "faces.h"

#include <doctest/doctest.h>
namespace squeal::tests::face_element_tests
{
  using namespace dealii;

  TEST_CASE_TEMPLATE("face_element: shape functions of faces", Dimension,
                     std::integral_constant<int, 2>, std::integral_constant<int, 3>)
  {
    // N_a(x_b) = delta_ab for the Gauss-Lobatto nodes in lexicographic order; sum N_a = 1; the
    // gradients are those of a central difference with h = 1e-6, whose error is h^2 |N'''|/6 < 1e-8
    // and eps |N|/h < 1e-9.
    constexpr int dim = Dimension::value;
    for (const unsigned int degree : {1u, 2u, 3u, 5u})
    {
      CAPTURE(degree);
      const FaceElement<dim> element(degree);
      CHECK(element.degree() == degree);
      CHECK(element.n_nodes() == (dim == 3 ? (degree + 1) * (degree + 1) : degree + 1));
      std::vector<double> values, before, after;
      std::vector<typename FaceElement<dim>::Gradient> gradients;

      double worst      = 0;
      const auto points = QGaussLobatto<dim - 1>(degree + 1).get_points();
      for (unsigned int b = 0; b < points.size(); ++b)
      {
        element.evaluate(points[b], values);
        for (unsigned int a = 0; a < values.size(); ++a)
          worst = std::max(worst, std::abs(values[a] - (a == b)));
      }
      CHECK(worst <= 1e-13);

      for (unsigned int k = 0; k < 5; ++k)
      {
        Point<dim - 1> xi; // some outside of the square
        for (unsigned int d = 0; d < dim - 1; ++d)
          xi[d] = 0.5 + 0.7 * scattered(k, d);
        element.evaluate(xi, values, &gradients);
        double sum = 0;
        Tensor<1, dim - 1> sum_of_gradients;
        for (unsigned int a = 0; a < values.size(); ++a)
        {
          sum += values[a];
          sum_of_gradients += gradients[a];
        }
        CHECK(std::abs(sum - 1) <= 1e-12);
        CHECK(sum_of_gradients.norm() <= 1e-11);
        const double h = 1e-6;
        for (unsigned int d = 0; d < dim - 1; ++d)
        {
          Tensor<1, dim - 1> step;
          step[d] = h;
          element.evaluate(xi - step, before);
          element.evaluate(xi + step, after);
          for (unsigned int a = 0; a < values.size(); ++a)
            CHECK(std::abs(gradients[a][d] - (after[a] - before[a]) / (2 * h)) <= 1e-7);
        }
      }
    }
  }

  TEST_CASE("face_element: the frame of a face")
  {
    // A parallelogram with edges (2, 0, 0) and (1, 3, 0): area 6, normal e_z, and -e_z with the
    // other orientation.
    const Plane<3> plane = {Point<3>(1, 2, 3),
                            {{Tensor<1, 3>({2, 0, 0}), Tensor<1, 3>({1, 3, 0})}}};
    const FaceElement<3> element(2);
    SurfaceFace<3> face = face_of<3>(2, plane);
    auto frame          = element.frame(face, Point<2>(0.25, 0.5));
    CHECK((frame.x - Point<3>(2, 3.5, 3)).norm() <= 1e-15);
    CHECK((frame.tangents[0] - plane.edges[0]).norm() <= 1e-14);
    CHECK((frame.tangents[1] - plane.edges[1]).norm() <= 1e-14);
    CHECK(relative_error(frame.measure, 6) <= 1e-15);
    CHECK((frame.normal - Tensor<1, 3>({0., 0., 1.})).norm() <= 1e-15);
    face.orientation = -1;
    CHECK((element.frame(face, Point<2>(0.25, 0.5)).normal - Tensor<1, 3>({0., 0., -1.})).norm() <=
          1e-15);

    // In two dimensions the normal is the tangent turned clockwise: (3, 4)/5 -> (4, -3)/5.
    const Plane<2> line = {Point<2>(1, 1), {{Tensor<1, 2>({3., 4.})}}};
    const FaceElement<2> element_2d(3);
    const auto frame_2d = element_2d.frame(face_of<2>(3, line), Point<1>(0.5));
    CHECK(relative_error(frame_2d.measure, 5) <= 1e-14);
    CHECK((frame_2d.normal - Tensor<1, 2>({0.8, -0.6})).norm() <= 1e-14);
  }

  TEST_CASE("face_element: project inverts frame, on the face, beside it, and above it")
  {
    // A point of the surface, and one lifted along the normal by less than the radius of curvature,
    // belong to the reference point they were made from.
    const auto annulus = [](const Point<2> &xi)
    {
      const double r = 0.05 + 0.02 * xi[0], phi = 0.3 + 0.4 * xi[1];
      return Point<3>(r * std::cos(phi), r * std::sin(phi), 0.006);
    };
    const auto bowl = [](const Point<2> &xi)
    {
      return Point<3>(xi[0] + 0.2 * xi[1], xi[1] - 0.1 * xi[0] * xi[1],
                      0.2 * xi[0] * xi[0] + 0.1 * xi[1]);
    };
    const auto check = [](const unsigned int degree, const SurfaceFace<3> &face)
    {
      CAPTURE(degree);
      const FaceElement<3> element(degree);
      for (const double s : {-0.2, 0., 0.4, 1., 1.3})
        for (const double t : {-0.2, 0., 0.7, 1., 1.1})
          for (const double height : {0., 0.003})
          {
            const Point<2> xi(s, t);
            const auto frame     = element.frame(face, xi);
            const Point<2> found = element.project(face, frame.x + height * frame.normal);
            CHECK(found.distance(xi) <= 1e-10);
          }
    };
    for (const unsigned int degree : {1u, 2u, 3u})
    {
      check(degree, face_of<3>(degree, annulus));
      check(degree, face_of<3>(degree, bowl));
    }

    const FaceElement<2> element(2);
    const SurfaceFace<2> arc = face_of<2>(2, [](const Point<1> &xi)
                                          { return Point<2>(std::cos(xi[0]), std::sin(xi[0])); });
    for (const double s : {-0.2, 0., 0.4, 1., 1.2})
    {
      const auto frame = element.frame(arc, Point<1>(s));
      CHECK(element.project(arc, frame.x - 0.01 * frame.normal).distance(Point<1>(s)) <= 1e-10);
    }
  }
} // namespace squeal::tests::face_element_tests
