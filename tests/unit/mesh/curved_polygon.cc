#include "helpers.h"

#include <squeal/mesh/curved_polygon.h>

#include <deal.II/base/quadrature_lib.h>

#include <doctest/doctest.h>

#include <cmath>

namespace squeal::tests::curved_polygon_tests
{
  using namespace dealii;

  namespace
  {
    /// An arc from one angle to another, to rounding.
    PlaneCurve arc(const Point<2> &centre, const double radius, const double from, const double to)
    {
      std::vector<Point<2>> points;
      const QGaussLobatto<1> nodes(14);
      for (const Point<1> &s : nodes.get_points())
      {
        const double phi = from + s[0] * (to - from);
        points.push_back(centre + radius * Tensor<1, 2>({std::cos(phi), std::sin(phi)}));
      }
      return PlaneCurve(std::move(points));
    }
    CurvedPolygon polygon(const std::vector<Point<2>> &corners)
    {
      CurvedPolygon sides;
      for (unsigned int k = 0; k < corners.size(); ++k)
        sides.push_back(PlaneCurve({corners[k], corners[(k + 1) % corners.size()]}));
      return sides;
    }

    /// The largest error of int x^i y^j, i, j <= 2 p, against the contour integral of
    /// x^(i + 1) y^j / (i + 1) dy by many points.
    double error(const CurvedPolygon &region, const unsigned int p)
    {
      const auto points = quadrature_on(region, p);
      const QGauss<1> rule(40);
      double worst = 0;
      for (unsigned int i = 0; i <= 2 * p; ++i)
        for (unsigned int j = 0; j <= 2 * p; ++j)
        {
          double computed = 0, exact = 0;
          for (const auto &[x, weight] : points)
            computed += weight * std::pow(x[0], i) * std::pow(x[1], j);
          for (const PlaneCurve &side : region)
            for (unsigned int q = 0; q < rule.size(); ++q)
            {
              const double s   = rule.point(q)[0];
              const Point<2> x = side.at(s);
              exact += rule.weight(q) * std::pow(x[0], i + 1) / (i + 1) * std::pow(x[1], j) *
                       side.tangent(s)[1];
            }
          worst = std::max(worst, std::abs(computed - exact));
        }
      return worst;
    }
    double smallest_weight(const CurvedPolygon &region, const unsigned int p)
    {
      double smallest = 1;
      for (const auto &[x, weight] : quadrature_on(region, p))
        smallest = std::min(smallest, weight);
      return smallest;
    }
  } // namespace

  TEST_CASE("curved_polygon: parts of curves")
  {
    const PlaneCurve quarter = arc(Point<2>(0.1, 0.2), 0.5, 0, M_PI / 2),
                     middle  = quarter.part(0.25, 0.75).reversed();
    CHECK(middle.begin().distance(quarter.at(0.75)) <= 1e-15);
    CHECK(middle.end().distance(quarter.at(0.25)) <= 1e-15);
    CHECK((middle.tangent(0.5) + 0.5 * quarter.tangent(0.5)).norm() <= 1e-13);
    CHECK(std::abs(quarter.at(quarter.parameter_at(1, 0.4))[1] - 0.4) <= 1e-14);
    CHECK(relative_error(quarter.bow(), 0.5 * (1 - std::sqrt(0.5))) <= 1e-2);
    CHECK_FALSE(quarter.is_aligned());
    CHECK(arc(Point<2>(0, 1e4), 1e4, -M_PI / 2, -M_PI / 2 + 5e-5).is_aligned());
  }

  TEST_CASE("curved_polygon: straight sides")
  {
    const std::vector<std::vector<Point<2>>> regions = {
        {Point<2>(0, 0), Point<2>(1, 0), Point<2>(0.2, 0.9)},
        {Point<2>(0.1, 0), Point<2>(1, 0.2), Point<2>(0.8, 0.9), Point<2>(0, 0.7)},
        {Point<2>(0, 0.2), Point<2>(0.3, 0), Point<2>(0.9, 0.1), Point<2>(1, 0.8),
         Point<2>(0.4, 1)},
        {Point<2>(0.3, 0), Point<2>(0.7, 0), Point<2>(1, 0.5), Point<2>(0.7, 1), Point<2>(0.3, 1),
         Point<2>(0, 0.5)},
        // further corners on opposite sides: strips
        {Point<2>(0, 0), Point<2>(0.4, 1e-5), Point<2>(1, 0), Point<2>(1, 0.7), Point<2>(0.6, 0.7),
         Point<2>(0.3, 0.70001), Point<2>(0, 0.7)},
        // not convex
        {Point<2>(0, 0), Point<2>(1, 0), Point<2>(1, 0.3), Point<2>(0.3, 0.3), Point<2>(0.3, 1),
         Point<2>(0, 1)}};
    for (const std::vector<Point<2>> &corners : regions)
      for (const unsigned int p : {1u, 2u, 3u, 4u})
      {
        CAPTURE(corners.size());
        CAPTURE(p);
        CHECK(error(polygon(corners), p) <= 1e-14);
        CHECK(smallest_weight(polygon(corners), p) > 0);
      }
    // Cut into as few patches as there can be: 2 p + 2 points in each direction, strips p + 2.
    CHECK(quadrature_on(polygon(regions[2]), 2).size() == 2 * 36);
    CHECK(quadrature_on(polygon(regions[3]), 2).size() == 2 * 36);
    CHECK(quadrature_on(polygon(regions[4]), 2).size() == 4 * 16);
    // Two sides each way round: a star of negative and positive triangles is as good.
    CHECK(error(polygon({Point<2>(0, 0), Point<2>(1, 0), Point<2>(1, 1), Point<2>(0.7, 1),
                         Point<2>(0.7, 0.2), Point<2>(0.3, 0.2), Point<2>(0.3, 1), Point<2>(0.2, 1),
                         Point<2>(0.1, 0.9), Point<2>(0, 0.7)}),
                2) <= 1e-14);
  }

  TEST_CASE("curved_polygon: curved sides")
  {
    const double phi = 0.35;
    const Point<2> o(0, 0);
    const auto polar = [](const double r, const double angle)
    { return Point<2>(r * std::cos(angle), r * std::sin(angle)); };
    const CurvedPolygon sector = {PlaneCurve({polar(0.6, 0), polar(1, 0)}), arc(o, 1, 0, phi),
                                  PlaneCurve({polar(1, phi), polar(0.6, phi)}),
                                  arc(o, 0.6, phi, 0)},
                        piece  = {PlaneCurve({o, polar(1, 0)}), arc(o, 1, 0, phi),
                                  PlaneCurve({polar(1, phi), o})},
                        lens   = {PlaneCurve({polar(1, phi), polar(1, 0)}), arc(o, 1, 0, phi)},
                        five   = {PlaneCurve({Point<2>(0.3, 0), polar(1, 0)}), arc(o, 1, 0, phi),
                                  PlaneCurve({polar(1, phi), polar(0.6, phi)}),
                                  PlaneCurve({polar(0.6, phi), Point<2>(0.3, 0.1)}),
                                  PlaneCurve({Point<2>(0.3, 0.1), Point<2>(0.3, 0)})};
    CHECK(relative_error(signed_area(sector), phi / 2 * (1 - 0.36)) <= 1e-14);
    for (const CurvedPolygon &region : {sector, piece, lens, five})
      for (const unsigned int p : {1u, 2u, 3u, 4u})
      {
        CAPTURE(region.size());
        CAPTURE(p);
        CHECK(error(region, p) <= 1e-9);
        CHECK(smallest_weight(region, p) > 0);
      }
    CHECK(quadrature_on(sector, 3).size() == 81); // 2 p + 3 in each direction
  }

  TEST_CASE("curved_polygon: what is straight to rounding is a line, and corners on it are none")
  {
    std::vector<Point<2>> points;
    const QGaussLobatto<1> nodes(8);
    for (const Point<1> &s : nodes.get_points())
      points.emplace_back(1 - s[0] * s[0], 1); // straight, with an uneven parameter
    const CurvedPolygon region = {PlaneCurve({Point<2>(0, 0), Point<2>(0.4, 0)}),
                                  PlaneCurve({Point<2>(0.4, 0), Point<2>(1, 0)}),
                                  PlaneCurve({Point<2>(1, 0), Point<2>(1, 0)}),
                                  PlaneCurve({Point<2>(1, 0), Point<2>(1, 1)}),
                                  PlaneCurve(points),
                                  PlaneCurve({Point<2>(0, 1), Point<2>(0, 0)})};
    const CurvedPolygon square = simplified(region);
    CHECK(square.size() == 4);
    CHECK(std::all_of(square.begin(), square.end(),
                      [](const PlaneCurve &side) { return side.is_straight(); }));
    CHECK(quadrature_on(square, 2).size() == 16);
  }
} // namespace squeal::tests::curved_polygon_tests
