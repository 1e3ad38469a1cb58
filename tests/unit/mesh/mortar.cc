#include "faces.h"

#include <doctest/doctest.h>
namespace squeal::tests::mortar_tests
{
  using namespace dealii;

  namespace
  {
    Plane<3> rectangle(const double x, const double y, const double width, const double height,
                       const double angle = 0)
    {
      const double c = std::cos(angle), s = std::sin(angle);
      return {
          Point<3>(x, y, 0.3),
          {{Tensor<1, 3>({width * c, width * s, 0}), Tensor<1, 3>({-height * s, height * c, 0})}}};
    }

    Plane<2> segment(const double from, const double to)
    {
      // On a line inclined by 30 degrees.
      const Tensor<1, 2> along({std::sqrt(0.75), 0.5});
      return {Point<2>(0.1, 0.2) + from * along, {{(to - from) * along}}};
    }

    /// A polynomial of total degree p whose coefficients look random.
    template <int dim>
    double polynomial(const Point<dim> &x, const unsigned int p, const unsigned int seed)
    {
      double value = 0;
      for (unsigned int i = 0; i <= p; ++i)
        for (unsigned int j = 0; i + j <= p; ++j)
          value += scattered(7 * i + j, seed) * std::pow(x[0], i) * std::pow(x[1], j);
      return value;
    }

    /// The value at a reference point of the interpolant of a function of space.
    template <int dim, typename Function>
    double interpolant(const FaceElement<dim> &element, const SurfaceFace<dim> &face,
                       const Point<dim - 1> &xi, const Function &function)
    {
      std::vector<double> values;
      element.evaluate(xi, values);
      double sum = 0;
      for (unsigned int a = 0; a < values.size(); ++a)
        sum += values[a] * function(face.nodes[a]);
      return sum;
    }

    /// Integral over faces by a Gauss rule on each, no pairing.
    template <int dim, typename Function>
    double integrate_faces(const FaceElement<dim> &element,
                           const std::vector<SurfaceFace<dim>> &faces, const Function &function)
    {
      const QGauss<dim - 1> rule(2 * element.degree() + 1);
      double sum = 0;
      for (const SurfaceFace<dim> &face : faces)
        for (unsigned int q = 0; q < rule.size(); ++q)
        {
          const auto frame = element.frame(face, rule.point(q));
          sum += rule.weight(q) * frame.measure * function(frame.x);
        }
      return sum;
    }

    /// On affine faces, if the rotor covers the pad: weights sum up to the pad's area and have its
    /// centroid; both sides see one point; integrals of products of polynomials of degree p on
    /// either side are exact.
    template <int dim>
    void check_covered(const unsigned int degree, const std::vector<SurfaceFace<dim>> &pad,
                       const std::vector<SurfaceFace<dim>> &rotor)
    {
      const FaceElement<dim> element(degree);
      const auto pairs = pair_surfaces(element, pad, rotor, 0.);
      const auto f     = [&](const Point<dim> &x) { return polynomial(x, degree, 1); };
      const auto g     = [&](const Point<dim> &x) { return polynomial(x, degree, 2); };

      double area = 0, product = 0, distance = 0, smallest_weight = 1;
      Point<dim> moment;
      for (const FacePair<dim> &pair : pairs)
        for (const PairedPoint<dim> &point : pair.points)
        {
          const SurfaceFace<dim> &pad_face   = pad[pair.pad_face],
                                 &rotor_face = rotor[pair.rotor_face];
          const Point<dim> x                 = element.frame(pad_face, point.xi_pad).x;
          area += point.weight;
          smallest_weight = std::min(smallest_weight, point.weight);
          moment += point.weight * x;
          distance = std::max(distance, x.distance(element.frame(rotor_face, point.xi_rotor).x));
          product += point.weight * interpolant(element, pad_face, point.xi_pad, f) *
                     interpolant(element, rotor_face, point.xi_rotor, g);
        }
      CHECK(smallest_weight >= 0);
      CHECK(distance <= 1e-13);
      CHECK(relative_error(area, integrate_faces(element, pad,
                                                 [](const Point<dim> &) { return 1.; })) <= 1e-12);
      for (unsigned int d = 0; d < dim; ++d)
        CHECK(
            relative_error(moment[d],
                           integrate_faces(element, pad, [&](const Point<dim> &x) { return x[d]; }),
                           area) <= 1e-12);
      CHECK(relative_error(
                product,
                integrate_faces(element, pad, [&](const Point<dim> &x) { return f(x) * g(x); }),
                area) <= 1e-12);
    }
  } // namespace

  TEST_CASE("mortar: flat surfaces in three dimensions")
  {
    // Pad [0.2, 1.2] x [0.1, 0.9] on rotors that cover it.
    const Plane<3> pad     = rectangle(0.2, 0.1, 1, 0.8);
    const Plane<3> turned  = rectangle(0.5, 0, 1, 0.8, M_PI / 6);
    const Plane<3> sheared = {Point<3>(-0.6, -0.1, 0.3),
                              {{Tensor<1, 3>({2.2, 0.1, 0}), Tensor<1, 3>({0.6, 1.2, 0})}}};
    const Plane<3> flipped = {pad.corner, {{pad.edges[1], pad.edges[0]}}};

    // n_1 x n_2 faces of the pad on m_1 x m_2 faces of the rotor
    const auto check = [](const Plane<3> &of_pad, const unsigned int n_1, const unsigned int n_2,
                          const Plane<3> &of_rotor, const unsigned int m_1, const unsigned int m_2)
    {
      for (const unsigned int p : {1u, 2u, 3u})
      {
        CAPTURE(p);
        check_covered<3>(p, grid<3>(p, n_1, n_2, of_pad), grid<3>(p, m_1, m_2, of_rotor));
      }
    };
    SUBCASE("matching meshes")
    {
      check(pad, 3, 2, pad, 3, 2);
    }
    SUBCASE("the rotor finer, nested and not")
    {
      check(pad, 2, 2, pad, 6, 4);
      check(pad, 2, 2, pad, 7, 5);
    }
    SUBCASE("the pad finer, nested and not")
    {
      check(pad, 6, 4, pad, 2, 2);
      check(pad, 7, 5, pad, 2, 2);
    }
    SUBCASE("a larger rotor with shifted edges")
    {
      check(pad, 4, 3, rectangle(-0.113, -0.271, 1.7, 1.6), 5, 6);
      // shifted by less than rounding, and by little more
      check(pad, 4, 3, rectangle(0.2 - 0.25 - 1e-16, 0.1 - 0.8 / 3, 1.25, 0.8 * 5. / 3), 5, 5);
      check(pad, 4, 4, rectangle(-0.05 - 1e-9, -0.1 + 1e-12, 1.5, 1.2), 6, 6);
    }
    SUBCASE("a pad turned by 30 degrees")
    {
      check(turned, 3, 4, rectangle(-0.1, -0.1, 1.7, 1.5), 5, 6);
      check(turned, 1, 1, rectangle(-0.1, -0.1, 1.7, 1.5), 4, 4);
    }
    SUBCASE("parallelograms, and faces whose parametrisation has the other sense")
    {
      check(flipped, 3, 2, sheared, 4, 5);
      check(flipped, 3, 2, pad, 4, 4);
    }
  }

  TEST_CASE("mortar: one face against a thousand")
  {
    // 32 x 32 faces on one side, one on the other; all of the thousand are found.
    const Plane<3> pad = rectangle(0, 0, 1, 1);
    const auto one = grid<3>(2, 1, 1, pad), thousand = grid<3>(2, 32, 32, pad);
    check_covered<3>(2, one, thousand);
    check_covered<3>(2, thousand, one);
    CHECK(pair_surfaces(FaceElement<3>(2), one, thousand, 0.).size() == 1024);
    CHECK(pair_surfaces(FaceElement<3>(2), thousand, one, 0.).size() == 1024);
    // A small face in the middle of a large one, and of nothing else.
    check_covered<3>(2, grid<3>(2, 1, 1, rectangle(0.511, 0.513, 1e-3, 1e-3)), one);
  }

  TEST_CASE("mortar: flat surfaces in two dimensions")
  {
    for (const unsigned int p : {1u, 2u, 3u})
    {
      CAPTURE(p);
      check_covered<2>(p, grid<2>(p, 4, 1, segment(0, 1)), grid<2>(p, 4, 1, segment(0, 1)));
      check_covered<2>(p, grid<2>(p, 3, 1, segment(0, 1)), grid<2>(p, 8, 1, segment(0, 1)));
      check_covered<2>(p, grid<2>(p, 8, 1, segment(0, 1)), grid<2>(p, 3, 1, segment(0, 1)));
      check_covered<2>(p, grid<2>(p, 5, 1, segment(0, 1)), grid<2>(p, 7, 1, segment(-0.13, 1.27)));
      check_covered<2>(p, grid<2>(p, 1, 1, segment(0, 1)), grid<2>(p, 1000, 1, segment(0, 1)));
      check_covered<2>(p, grid<2>(p, 1000, 1, segment(0, 1)), grid<2>(p, 1, 1, segment(0, 1)));
      check_covered<2>(p, grid<2>(p, 3, 1, segment(1, 0)),
                       grid<2>(p, 5, 1, segment(-0.1, 1.1))); // other sense
    }
  }

  TEST_CASE("mortar: what the rotor does not cover is left out")
  {
    // The pad [0, 1]^2 overlaps the rotor [0.3, 1.3] x [-0.5, 0.6] on 0.7 x 0.6; centroid (0.65,
    // 0.3).
    const FaceElement<3> element(2);
    const auto pad = grid<3>(2, 3, 3, rectangle(0, 0, 1, 1));
    const auto pairs =
        pair_surfaces(element, pad, grid<3>(2, 4, 5, rectangle(0.3, -0.5, 1, 1.1)), 0.);
    double area = 0, moment_x = 0, moment_y = 0;
    for (const FacePair<3> &pair : pairs)
      for (const PairedPoint<3> &point : pair.points)
      {
        const Point<3> x = element.frame(pad[pair.pad_face], point.xi_pad).x;
        area += point.weight;
        moment_x += point.weight * x[0];
        moment_y += point.weight * x[1];
      }
    CHECK(relative_error(area, 0.42) <= 1e-12);
    CHECK(relative_error(moment_x, 0.42 * 0.65) <= 1e-12);
    CHECK(relative_error(moment_y, 0.42 * 0.3) <= 1e-12);

    // Surfaces that only touch at an edge, and surfaces far above each other, make no pairs.
    CHECK(pair_surfaces(element, pad, grid<3>(2, 2, 2, rectangle(1, 0, 1, 1)), 0.).empty());
    Plane<3> above = rectangle(0, 0, 1, 1);
    above.corner[2] += 5;
    CHECK(pair_surfaces(element, pad, grid<3>(2, 2, 2, above), 0.).empty());
    CHECK_FALSE(pair_surfaces(element, pad, grid<3>(2, 2, 2, above), 5.).empty());
  }

  TEST_CASE("mortar: products of single shape functions on pieces of axis-parallel faces")
  {
    // Piecewise polynomials with kinks (and jumps) at all edges: int N_a N_b over the common
    // rectangle of a pad face and a rotor face, against a product of one-dimensional Gauss rules on
    // that rectangle.
    const double x_pad = 0.2, y_pad = 0.1, x_rotor = -0.1, y_rotor = -0.2;
    const double w_pad = 0.5, h_pad = 0.4, w_rotor = 0.35, h_rotor = 0.3; // of one face
    const unsigned int n = 2, n_rotor = 5;
    for (const unsigned int p : {1u, 2u, 3u})
    {
      CAPTURE(p);
      const FaceElement<3> element(p);
      const auto pad   = grid<3>(p, n, n, rectangle(x_pad, y_pad, n * w_pad, n * h_pad));
      const auto rotor = grid<3>(p, n_rotor, n_rotor,
                                 rectangle(x_rotor, y_rotor, n_rotor * w_rotor, n_rotor * h_rotor));
      const auto pairs = pair_surfaces(element, pad, rotor, 0.);
      const QGauss<2> rule(p + 2);
      double worst = 0;
      std::vector<double> on_pad, on_rotor;
      for (const FacePair<3> &pair : pairs)
      {
        DenseMatrix computed(element.n_nodes(), element.n_nodes()), exact = computed;
        for (const PairedPoint<3> &point : pair.points)
        {
          element.evaluate(point.xi_pad, on_pad);
          element.evaluate(point.xi_rotor, on_rotor);
          for (unsigned int a = 0; a < on_pad.size(); ++a)
            for (unsigned int b = 0; b < on_rotor.size(); ++b)
              computed(a, b) += point.weight * on_pad[a] * on_rotor[b];
        }
        const double x_s = x_pad + (pair.pad_face % n) * w_pad,
                     y_s = y_pad + (pair.pad_face / n) * h_pad;
        const double x_m = x_rotor + (pair.rotor_face % n_rotor) * w_rotor,
                     y_m = y_rotor + (pair.rotor_face / n_rotor) * h_rotor;
        const double x_0 = std::max(x_s, x_m), x_1 = std::min(x_s + w_pad, x_m + w_rotor);
        const double y_0 = std::max(y_s, y_m), y_1 = std::min(y_s + h_pad, y_m + h_rotor);
        CHECK(x_1 > x_0);
        CHECK(y_1 > y_0);
        for (unsigned int q = 0; q < rule.size(); ++q)
        {
          const double x = x_0 + (x_1 - x_0) * rule.point(q)[0],
                       y = y_0 + (y_1 - y_0) * rule.point(q)[1];
          element.evaluate(Point<2>((x - x_s) / w_pad, (y - y_s) / h_pad), on_pad);
          element.evaluate(Point<2>((x - x_m) / w_rotor, (y - y_m) / h_rotor), on_rotor);
          for (unsigned int a = 0; a < on_pad.size(); ++a)
            for (unsigned int b = 0; b < on_rotor.size(); ++b)
              exact(a, b) += rule.weight(q) * (x_1 - x_0) * (y_1 - y_0) * on_pad[a] * on_rotor[b];
        }
        for (std::size_t k = 0; k < exact.values.size(); ++k)
          worst = std::max(worst, std::abs(computed.values[k] - exact.values[k]));
      }
      CHECK(worst <= 1e-14);
      // The edges cut the pad at x = 0.25, 0.6, 0.7, 0.95 and y = 0.1, 0.4, 0.5, 0.7: 5 x 4 pieces.
      CHECK(pairs.size() == 20);
    }
  }

  namespace
  {
    /// Two rotor faces meet along the line x = 0.4 + 0.3 y, which cuts the unit square, the pad,
    /// into two trapezoids. Returns the largest error of int N_a N_b over the left one, where with
    /// x = s (0.4 + 0.3 y) the integrand is a polynomial of degree 2 p in s and 4 p + 1 in y.
    double error_on_trapezoid(const unsigned int p)
    {
      const FaceElement<3> element(p);
      const auto pad     = grid<3>(p, 1, 1, rectangle(0, 0, 1, 1));
      const auto sheared = [](const double x)
      {
        return Plane<3>{Point<3>(x - 0.03, -0.1, 0.3),
                        {{Tensor<1, 3>({2.4, 0, 0}), Tensor<1, 3>({0.36, 1.2, 0})}}};
      };
      std::vector<SurfaceFace<3>> rotor = grid<3>(p, 1, 1, sheared(-2));
      rotor.push_back(grid<3>(p, 1, 1, sheared(0.4))[0]);
      const auto pairs = pair_surfaces(element, pad, rotor, 0.);
      CHECK(pairs.size() == 2);

      DenseMatrix computed(element.n_nodes(), element.n_nodes()), exact = computed;
      std::vector<double> on_pad, on_rotor;
      const auto add = [&](DenseMatrix &sum, const double weight, const Point<2> &xi_pad,
                           const Point<2> &xi_rotor)
      {
        element.evaluate(xi_pad, on_pad);
        element.evaluate(xi_rotor, on_rotor);
        for (unsigned int a = 0; a < on_pad.size(); ++a)
          for (unsigned int b = 0; b < on_rotor.size(); ++b)
            sum(a, b) += weight * on_pad[a] * on_rotor[b];
      };
      for (const FacePair<3> &pair : pairs)
        if (pair.rotor_face == 0)
          for (const PairedPoint<3> &point : pair.points)
            add(computed, point.weight, point.xi_pad, point.xi_rotor);
      const QGauss<2> rule(2 * p + 1);
      for (unsigned int q = 0; q < rule.size(); ++q)
      {
        const double y = rule.point(q)[1], width = 0.4 + 0.3 * y, x = width * rule.point(q)[0];
        add(exact, rule.weight(q) * width, Point<2>(x, y),
            Point<2>((x + 2 - 0.3 * y) / 2.4, (y + 0.1) / 1.2));
      }
      double worst = 0;
      for (std::size_t k = 0; k < exact.values.size(); ++k)
        worst = std::max(worst, std::abs(computed.values[k] - exact.values[k]));
      return worst;
    }
  } // namespace

  TEST_CASE("mortar: products of single shape functions on trapezoids")
  {
    for (const unsigned int p : {1u, 2u, 3u})
      CHECK(error_on_trapezoid(p) <= 1e-14);
  }

  TEST_CASE("mortar: annular faces with different arcs")
  {
    // Both sides interpolate circles by polynomials of their own arcs: the sum of the weights is
    // still the area of the pad's faces, because the pieces tile its reference squares. Area and
    // centroid are those of the sector up to the approximation of its arcs: angle (b^2 - a^2)/2,
    // and r_s A = (2/3) sin(angle/2) (b^3 - a^3).
    const auto sector = [](const double a, const double b, const double from, const double to)
    {
      return [=](const Point<2> &xi)
      {
        const double r = a + (b - a) * xi[0], phi = (from + (to - from) * xi[1]) * M_PI / 180;
        return Point<3>(r * std::cos(phi), r * std::sin(phi), 0.006);
      };
    };
    const double a = 0.09, b = 0.14, angle = 50 * M_PI / 180;
    for (const unsigned int p : {2u, 3u})
      for (const unsigned int n_rotor : {4u, 9u, 20u}) // arcs of 22.5, 10 and 4.5 degrees
        for (const unsigned int n_pad : {2u, 7u})      // arcs of 25 and 7.1 degrees
        {
          CAPTURE(p);
          CAPTURE(n_rotor);
          CAPTURE(n_pad);
          const FaceElement<3> element(p);
          const auto pad   = grid<3>(p, 2, n_pad, sector(a, b, -25, 25));
          const auto rotor = grid<3>(p, 3, n_rotor, sector(0.05, 0.15, -43, 47));
          double area = 0, moment = 0, distance = 0;
          for (const FacePair<3> &pair : pair_surfaces(element, pad, rotor, 0.))
            for (const PairedPoint<3> &point : pair.points)
            {
              const Point<3> x = element.frame(pad[pair.pad_face], point.xi_pad).x;
              area += point.weight;
              moment += point.weight * x[0];
              distance = std::max(
                  distance, x.distance(element.frame(rotor[pair.rotor_face], point.xi_rotor).x));
            }
          CHECK(relative_error(
                    area, integrate_faces(element, pad, [](const Point<3> &) { return 1.; })) <=
                1e-12);
          CHECK(relative_error(moment, integrate_faces(element, pad,
                                                       [](const Point<3> &x) { return x[0]; })) <=
                1e-12);
          CHECK(distance <= 1e-14);
          const double tolerance = n_pad == 2 ? 2e-4 : 1e-6;
          CHECK(relative_error(area, angle / 2 * (b * b - a * a)) <= tolerance);
          CHECK(relative_error(moment, 2. / 3 * std::sin(angle / 2) * (b * b * b - a * a * a)) <=
                tolerance);
        }
  }

  TEST_CASE("mortar: a curved oblique face meets only the faces that it touches")
  {
    // A cell at the end of a pad beside a round piston, its edges straight in polar coordinates, on
    // a polar grid. The polynomial of degree 4 through its nodes turns back some cells away, so
    // that a far face was found on this one, with points 1.09 faces outside. The pieces tile the
    // face, and no point lies outside of its rotor face (but for the fans about a concave arc).
    const auto polar = [](const double r, const double phi)
    { return Point<3>(r * std::cos(phi), r * std::sin(phi), 0); };
    const double degree_of_arc = numbers::PI / 180;
    for (unsigned int p = 2; p <= 5; ++p)
    {
      const FaceElement<3> element(p);
      const QGaussLobatto<1> nodes(p + 1);
      const auto face = [&](const auto &place)
      {
        SurfaceFace<3> result;
        for (unsigned int j = 0; j <= p; ++j)
          for (unsigned int i = 0; i <= p; ++i)
            result.nodes.push_back(place(nodes.point(i)[0], nodes.point(j)[0]));
        return result;
      };
      const double corners[4][2] = {{95.1841015064, 16.7120735127},
                                    {94.1757124172, 5.83792092692},
                                    {91, 28},
                                    {91, 9.33333328071}};
      std::vector<SurfaceFace<3>> rotor_faces;
      const std::vector<SurfaceFace<3>> pad_faces = {face(
          [&](const double s, const double t)
          {
            const double weights[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
            double r = 0, phi = 0;
            for (unsigned int v = 0; v < 4; ++v)
            {
              r += weights[v] * corners[v][0];
              phi += weights[v] * corners[v][1];
            }
            return polar(r, phi * degree_of_arc);
          })};
      for (unsigned int j = 0; j < 36; ++j)
        for (unsigned int i = 0; i < 4; ++i)
          rotor_faces.push_back(
              face([&](const double s, const double t)
                   { return polar(88 + 13 * (i + s), (j + t) * 10 * degree_of_arc); }));
      std::vector<double> paired(pad_faces.size());
      double outside = 0;
      for (const FacePair<3> &pair : pair_surfaces(element, pad_faces, rotor_faces, 0.))
        for (const PairedPoint<3> &point : pair.points)
        {
          paired[pair.pad_face] += point.weight;
          for (unsigned int d = 0; d < 2; ++d)
            outside = std::max({outside, -point.xi_rotor[d], point.xi_rotor[d] - 1});
        }
      CHECK(outside <= 0.05);
      const QGauss<2> quadrature(2 * p + 4);
      for (unsigned int f = 0; f < pad_faces.size(); ++f)
      {
        double area = 0;
        for (unsigned int q = 0; q < quadrature.size(); ++q)
          area += quadrature.weight(q) * element.frame(pad_faces[f], quadrature.point(q)).measure;
        CHECK(relative_error(paired[f], area) <= 1e-9);
      }
    }
  }

  TEST_CASE("mortar: cuts follow curved edges")
  {
    // Annular rotor faces inside of one square pad face of width 0.4: each piece is a whole rotor
    // face, of four sides of which two are curved, with one product rule. A function that vanishes
    // on the outline of the rotor and has kinks inside is integrated as by the rotor's own rule.
    const FaceElement<3> element(2);
    const auto pad    = grid<3>(2, 1, 1, rectangle(-0.2, -0.2, 0.4, 0.4));
    const auto sector = [](const Point<2> &xi)
    {
      const double r = 0.05 + 0.1 * xi[0], phi = (-40 + 90 * xi[1]) * M_PI / 180;
      return Point<3>(r * std::cos(phi), r * std::sin(phi), 0.3);
    };
    const auto hat = [](const Point<3> &x)
    {
      const double r = std::hypot(x[0], x[1]), phi = std::atan2(x[1], x[0]) * 180 / M_PI;
      return (r - 0.05) * (0.15 - r) * 100 * std::min(phi + 40, 50 - phi) / 45;
    };
    const auto rotor = grid<3>(2, 2, 4, sector);
    const auto pairs = pair_surfaces(element, pad, rotor, 0.);
    const QGauss<2> rule(6);
    double computed = 0, exact = 0;
    CHECK(pairs.size() == rotor.size());
    for (const FacePair<3> &pair : pairs)
    {
      const SurfaceFace<3> &face = rotor[pair.rotor_face];
      double area                = 0;
      for (const PairedPoint<3> &point : pair.points)
      {
        area += point.weight;
        computed += point.weight * interpolant(element, face, point.xi_rotor, hat);
      }
      for (unsigned int q = 0; q < rule.size(); ++q)
        exact += rule.weight(q) * element.frame(face, rule.point(q)).measure *
                 interpolant(element, face, rule.point(q), hat);
      CHECK(relative_error(area, integrate_faces<3>(element, {face},
                                                    [](const Point<3> &) { return 1.; })) <= 1e-12);
      CHECK(pair.points.size() == 49); // 2 p + 3 in each direction
    }
    CHECK(relative_error(computed, exact) <= 1e-12);
  }
} // namespace squeal::tests::mortar_tests
