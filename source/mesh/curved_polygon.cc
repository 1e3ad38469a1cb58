#include <squeal/mesh/curved_polygon.h>

#include <deal.II/base/polynomial.h>
#include <deal.II/base/quadrature_lib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

// Quadrature on a polygon with curved sides. First the curves: points, derivatives, parts.
// quadrature_on() cuts a polygon into strips along an axis where it can (strips_of()), else along
// lines between corners into parts of at most four sides (on_parts()); each is a Coons patch. Where
// weights would not be positive, a fan of triangles about the mean corner takes their place.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    using QuadraturePoints = std::vector<std::pair<Point<2>, double>>;

    double cross(const Tensor<1, 2> &a, const Tensor<1, 2> &b)
    {
      return a[0] * b[1] - a[1] * b[0];
    }

    /// Lagrange polynomials of n Gauss-Lobatto nodes.
    const std::vector<Polynomials::Polynomial<double>> &lagrange_basis(const unsigned int n)
    {
      thread_local std::map<unsigned int, std::vector<Polynomials::Polynomial<double>>> bases;
      auto &basis = bases[n];
      if (basis.empty())
        basis = Polynomials::generate_complete_Lagrange_basis(QGaussLobatto<1>(n).get_points());
      return basis;
    }

    PlaneCurve line(const Point<2> &a, const Point<2> &b)
    {
      return PlaneCurve({a, b});
    }
  } // namespace

  PlaneCurve::PlaneCurve(std::vector<Point<2>> points)
      : points(std::make_shared<const std::vector<Point<2>>>(std::move(points)))
  {
  }

  Point<2> PlaneCurve::at(const double s) const
  {
    const double x = first + s * (last - first);
    if (is_straight())
      return (1 - x) * points->front() + x * Tensor<1, 2>(points->back());
    const auto &basis = lagrange_basis(points->size());
    Point<2> result;
    for (unsigned int i = 0; i < points->size(); ++i)
      result += basis[i].value(x) * Tensor<1, 2>((*points)[i]);
    return result;
  }

  Tensor<1, 2> PlaneCurve::tangent(const double s) const
  {
    if (is_straight())
      return (last - first) * (points->back() - points->front());
    const auto &basis = lagrange_basis(points->size());
    Tensor<1, 2> result;
    for (unsigned int i = 0; i < points->size(); ++i)
    {
      std::array<double, 2> value;
      basis[i].value(first + s * (last - first), 1, value.data());
      result += (last - first) * value[1] * Tensor<1, 2>((*points)[i]);
    }
    return result;
  }

  PlaneCurve PlaneCurve::part(const double from, const double to) const
  {
    PlaneCurve result = *this;
    result.first      = first + from * (last - first);
    result.last       = first + to * (last - first);
    return result;
  }

  double PlaneCurve::parameter_at(const unsigned int d, const double x) const
  {
    const double at_begin = begin()[d], at_end = end()[d];
    double s = (x - at_begin) / (at_end - at_begin);
    for (unsigned int step = 0; step < 10 && !is_straight(); ++step)
    {
      const double change = (x - at(s)[d]) / tangent(s)[d];
      s += change;
      if (!(std::abs(change) > 1e-15))
        break;
    }
    return s;
  }

  double PlaneCurve::bow() const
  {
    const Tensor<1, 2> chord = end() - begin();
    double largest           = 0;
    for (unsigned int i = 1; i < points->size() && !is_straight(); ++i)
      largest = std::max(largest, std::abs(cross(chord, at(double(i) / points->size()) - begin())));
    return largest > 0 ? largest / chord.norm() : 0;
  }

  bool PlaneCurve::is_aligned() const
  {
    Point<2> before = begin();
    for (unsigned int i = 1; i < points->size(); ++i)
    {
      const Point<2> now     = at(double(i) / (points->size() - 1));
      const Tensor<1, 2> run = now - before;
      if (std::min(std::abs(run[0]), std::abs(run[1])) > 1e-3 * run.norm())
        return false;
      before = now;
    }
    return true;
  }

  /// 1/2 of the contour integral of x times dx
  double signed_area(const CurvedPolygon &polygon)
  {
    double area = 0;
    for (const PlaneCurve &side : polygon)
      if (side.is_straight())
        area += cross(side.begin(), side.end()) / 2;
      else
      {
        static const QGauss<1> rule(12); // beyond any degree that faces have
        for (unsigned int q = 0; q < rule.size(); ++q)
        {
          const double s = rule.point(q)[0];
          area += rule.weight(q) * cross(side.at(s), side.tangent(s)) / 2;
        }
      }
    return area;
  }

  CurvedPolygon simplified(const CurvedPolygon &polygon)
  {
    CurvedPolygon sides;
    for (const PlaneCurve &side : polygon)
    {
      const Point<2> a = side.begin(), b = side.end();
      if (a.distance(b) <= 1e-13)
        continue;
      sides.push_back(side.bow() <= 1e-12 ? line(a, b) : side);
    }
    const auto joins = [](const PlaneCurve &before, const PlaneCurve &after)
    {
      if (!before.is_straight() || !after.is_straight())
        return false;
      const Tensor<1, 2> e = before.tangent(0), f = after.tangent(0);
      return e * f > 0 && std::abs(cross(e, f)) <= 1e-12 * e.norm() * f.norm();
    };
    CurvedPolygon result;
    for (const PlaneCurve &side : sides)
      if (!result.empty() && joins(result.back(), side))
        result.back() = line(result.back().begin(), side.end());
      else
        result.push_back(side);
    if (result.size() > 1 && joins(result.back(), result.front()))
    {
      result.front() = line(result.back().begin(), result.front().end());
      result.pop_back();
    }
    return result;
  }

  namespace
  {
    bool is_aligned(const CurvedPolygon &polygon)
    {
      return std::all_of(polygon.begin(), polygon.end(),
                         [](const PlaneCurve &side) { return side.is_aligned(); });
    }

    /// Points of a product rule on the patch of four sides,
    ///     x(s, t) = (1 - t) c_0(s) + t c_2(1 - s) + (1 - s) c_3(1 - t) + s c_1(t)
    ///               - (1 - s)(1 - t) P_0 - s (1 - t) P_1 - s t P_2 - (1 - s) t P_3
    /// with their corners P. Sides may be points.
    /// S.A. Coons, Surfaces for computer-aided design of space forms, MIT MAC-TR-41, 1967.
    QuadraturePoints coons_patch(const std::array<PlaneCurve, 4> &sides, const unsigned int p)
    {
      constexpr double small_bow = 1e-5; // of a pad's face: no rule sees it
      bool curved = false, aligned = true;
      for (const PlaneCurve &side : sides)
      {
        curved |= side.bow() > small_bow;
        // A point has no direction: triangles are oblique.
        aligned &= side.is_aligned() && side.begin() != side.end();
      }
      // Slivers between edges that nearly match: what a rule leaves of them is less than rounding.
      constexpr double small_area = 1e-6;
      const bool is_sliver =
          std::abs(signed_area({sides[0], sides[1], sides[2], sides[3]})) < small_area;
      const QGauss<1> rule(is_sliver ? p + 2 : (aligned ? p + 2 : 2 * p + 2) + curved);
      const unsigned int n = rule.size();
      struct Place
      {
        Point<2> x;
        Tensor<1, 2> tangent; ///< along s or t
      };
      std::array<std::vector<Place>, 4> places;
      for (unsigned int k = 0; k < 4; ++k)
        for (unsigned int i = 0; i < n; ++i)
        {
          const double s = k < 2 ? rule.point(i)[0] : 1 - rule.point(i)[0];
          places[k].push_back({sides[k].at(s), (k < 2 ? 1 : -1) * sides[k].tangent(s)});
        }
      std::array<Tensor<1, 2>, 4> corners;
      for (unsigned int k = 0; k < 4; ++k)
        corners[k] = sides[k].begin();
      QuadraturePoints points;
      for (unsigned int j = 0; j < n; ++j)
        for (unsigned int i = 0; i < n; ++i)
        {
          const double s = rule.point(i)[0], t = rule.point(j)[0];
          const Place &low = places[0][i], &high = places[2][i], &left = places[3][j],
                      &right = places[1][j];
          const Point<2> x((1 - t) * low.x + t * Tensor<1, 2>(high.x) +
                           (1 - s) * Tensor<1, 2>(left.x) + s * Tensor<1, 2>(right.x) -
                           (1 - s) * (1 - t) * corners[0] - s * (1 - t) * corners[1] -
                           s * t * corners[2] - (1 - s) * t * corners[3]);
          const Tensor<1, 2> x_s = (1 - t) * low.tangent + t * high.tangent + (right.x - left.x) -
                                   (1 - t) * (corners[1] - corners[0]) -
                                   t * (corners[2] - corners[3]),
                             x_t = (1 - s) * left.tangent + s * right.tangent + (high.x - low.x) -
                                   (1 - s) * (corners[3] - corners[0]) -
                                   s * (corners[2] - corners[1]);
          points.emplace_back(x, rule.weight(i) * rule.weight(j) * cross(x_s, x_t));
        }
      return points;
    }

    /// The quadrature on a polygon with two to four sides.
    QuadraturePoints on_patch(const CurvedPolygon &polygon, const unsigned int p)
    {
      const auto corner = [&](const unsigned int k)
      { return line(polygon[k].begin(), polygon[k].begin()); };
      if (polygon.size() == 4)
        return coons_patch({{polygon[0], polygon[1], polygon[2], polygon[3]}}, p);
      if (polygon.size() == 3) // the point is opposite to a curved side
      {
        const unsigned int k =
            std::find_if(polygon.begin(), polygon.end(),
                         [](const PlaneCurve &side) { return !side.is_straight(); }) -
            polygon.begin();
        return coons_patch(
            {{polygon[(k + 2) % 3], polygon[k % 3], polygon[(k + 1) % 3], corner((k + 2) % 3)}}, p);
      }
      return coons_patch({{polygon[0], corner(1), polygon[1], corner(0)}}, p);
    }

    bool is_positive(const QuadraturePoints &points)
    {
      return std::all_of(points.begin(), points.end(),
                         [](const auto &point) { return point.second > 0; });
    }

    /// A chain of sides that runs along an axis, cut at parts of its way.
    class Chain
    {
    public:
      Chain(const CurvedPolygon &sides, const unsigned int along)
          : sides(sides), along(along), first(sides.front().begin()[along]),
            last(sides.back().end()[along])
      {
      }
      double part_of(const Point<2> &x) const
      {
        return (x[along] - first) / (last - first);
      }
      const CurvedPolygon &all() const
      {
        return sides;
      }
      /// Between two parts, on one side.
      PlaneCurve between(const double from, const double to) const
      {
        unsigned int i = 0;
        while (i + 1 < sides.size() && part_of(sides[i].end()) <= (from + to) / 2)
          ++i;
        const auto parameter = [&](const double part)
        { return sides[i].parameter_at(along, first + part * (last - first)); };
        return sides[i].part(part_of(sides[i].begin()) == from ? 0 : parameter(from),
                             part_of(sides[i].end()) == to ? 1 : parameter(to));
      }

    private:
      const CurvedPolygon sides;
      const unsigned int along;
      const double first, last; ///< coordinates of the ends
    };

    /// A polygon whose sides run along the axes with further corners on two opposite sides only:
    /// cut across there into patches of four sides. Empty if it is another one.
    std::vector<CurvedPolygon> strips_of(const CurvedPolygon &polygon)
    {
      const unsigned int n = polygon.size();
      if (n < 5 || !is_aligned(polygon))
        return {};
      for (unsigned int along = 0; along < 2; ++along)
      {
        std::vector<unsigned int> across;
        for (unsigned int i = 0; i < n; ++i)
        {
          const Tensor<1, 2> run = polygon[i].end() - polygon[i].begin();
          if (std::abs(run[1 - along]) > std::abs(run[along]))
            across.push_back(i);
        }
        if (across.size() != 2)
          continue;
        // Both chains in the direction of the first
        CurvedPolygon low, high;
        for (unsigned int i = across[0] + 1; i != across[1]; ++i)
          low.push_back(polygon[i]);
        for (unsigned int i = across[0] + n - 1; i != across[1]; --i)
          high.push_back(polygon[i % n].reversed());
        if (low.empty() || high.empty())
          continue;
        const Chain first(low, along), second(high, along);
        std::vector<double> parts = {0, 1};
        for (const Chain *chain : {&first, &second})
          for (unsigned int i = 1; i < chain->all().size(); ++i)
            parts.push_back(chain->part_of(chain->all()[i].begin()));
        std::sort(parts.begin(), parts.end());
        parts.erase(std::unique(parts.begin(), parts.end(),
                                [](const double a, const double b) { return b - a <= 1e-13; }),
                    parts.end());
        std::vector<CurvedPolygon> strips;
        for (unsigned int k = 0; k + 1 < parts.size(); ++k)
        {
          const PlaneCurve below = first.between(parts[k], parts[k + 1]),
                           above = second.between(parts[k], parts[k + 1]);
          strips.push_back(
              {below, k + 2 == parts.size() ? polygon[across[1]] : line(below.end(), above.end()),
               above.reversed(), k == 0 ? polygon[across[0]] : line(above.begin(), below.begin())});
        }
        return strips;
      }
      return {};
    }

    /// Cuts along straight lines between corners, short ones first, until every part has at most
    /// four sides. No points if some weight is not positive then.
    QuadraturePoints on_parts(const CurvedPolygon &polygon, const unsigned int p)
    {
      const unsigned int n = polygon.size();
      if (n <= 4)
      {
        QuadraturePoints points = on_patch(polygon, p);
        return is_positive(points) ? points : QuadraturePoints();
      }
      std::vector<std::pair<double, unsigned int>> cuts; // length, first side
      for (unsigned int i = 0; i < n; ++i)
        cuts.emplace_back(polygon[i].begin().distance(polygon[(i + 3) % n].begin()), i);
      std::sort(cuts.begin(), cuts.end());
      for (const auto &[length, start] : cuts)
      {
        CurvedPolygon cut, rest;
        for (unsigned int i = 0; i < n; ++i)
          (i < 3 ? cut : rest).push_back(polygon[(start + i) % n]);
        cut.push_back(line(cut.back().end(), cut.front().begin()));
        rest.push_back(line(rest.back().end(), rest.front().begin()));
        QuadraturePoints points = on_parts(cut, p);
        if (points.empty())
          continue;
        const QuadraturePoints others = on_parts(rest, p);
        if (others.empty())
          continue;
        points.insert(points.end(), others.begin(), others.end());
        return points;
      }
      return {};
    }
  } // namespace

  QuadraturePoints quadrature_on(const CurvedPolygon &polygon, const unsigned int p)
  {
    QuadraturePoints points;
    for (const CurvedPolygon &strip : strips_of(polygon))
    {
      const QuadraturePoints of_strip = on_patch(strip, p);
      points.insert(points.end(), of_strip.begin(), of_strip.end());
    }
    if (!points.empty() && is_positive(points))
      return points;
    // Of many sides there are too many ways to cut.
    constexpr unsigned int most_sides = 8;
    if (polygon.size() <= most_sides)
      if (points = on_parts(polygon, p); !points.empty())
        return points;

    points.clear();
    Point<2> centre;
    for (const PlaneCurve &side : polygon)
      centre += Tensor<1, 2>(side.begin()) / double(polygon.size());
    for (const PlaneCurve &side : polygon)
    {
      const QuadraturePoints of_triangle =
          on_patch({side, line(side.end(), centre), line(centre, side.begin())}, p);
      points.insert(points.end(), of_triangle.begin(), of_triangle.end());
    }
    return points;
  }
} // namespace squeal
