#include <squeal/base/errors.h>
#include <squeal/mesh/mortar.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/base/utilities.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  template <int dim>
  FaceElement<dim>::FaceElement(const unsigned int degree)
      : p(degree), n(Utilities::pow(degree + 1, dim - 1)),
        basis(Polynomials::generate_complete_Lagrange_basis(
            QGaussLobatto<1>(degree + 1).get_points()))
  {
    AssertThrow(degree <= max_degree, ExcMessage("The degree of contact faces is limited."));
  }

  template <int dim>
  void FaceElement<dim>::evaluate(const Coordinates &xi, std::vector<double> &values,
                                  std::vector<Gradient> *gradients) const
  {
    double one_d[dim - 1][max_degree + 1][2]; // [direction][node]{value, derivative}
    for (unsigned int d = 0; d < dim - 1; ++d)
      for (unsigned int i = 0; i <= p; ++i)
        basis[i].value(xi[d], gradients ? 1 : 0, one_d[d][i]);
    values.assign(n, 1.);
    if (gradients)
      gradients->resize(n);
    for (unsigned int a = 0; a < n; ++a)
    {
      std::array<unsigned int, 2> index = {{a % (p + 1), a / (p + 1)}};
      for (unsigned int d = 0; d < dim - 1; ++d)
        values[a] *= one_d[d][index[d]][0];
      if (gradients)
        for (unsigned int d = 0; d < dim - 1; ++d)
        {
          double derivative = 1;
          for (unsigned int e = 0; e < dim - 1; ++e)
            derivative *= one_d[e][index[e]][d == e];
          (*gradients)[a][d] = derivative;
        }
    }
  }

  template <int dim>
  typename FaceElement<dim>::Frame FaceElement<dim>::frame(const SurfaceFace<dim> &face,
                                                           const Coordinates &xi) const
  {
    // Called some hundred thousand times: the scratch memory is kept.
    thread_local std::vector<double> values;
    thread_local std::vector<Gradient> gradients;
    evaluate(xi, values, &gradients);
    Frame result;
    for (unsigned int a = 0; a < n; ++a)
    {
      result.x += values[a] * Tensor<1, dim>(face.nodes[a]);
      for (unsigned int d = 0; d < dim - 1; ++d)
        result.tangents[d] += gradients[a][d] * Tensor<1, dim>(face.nodes[a]);
    }
    if constexpr (dim == 3)
      result.normal = cross_product_3d(result.tangents[0], result.tangents[1]);
    else
      result.normal = cross_product_2d(result.tangents[0]);
    result.measure = result.normal.norm();
    result.normal *= face.orientation / result.measure;
    return result;
  }

  template <int dim>
  typename FaceElement<dim>::Coordinates FaceElement<dim>::project(const SurfaceFace<dim> &face,
                                                                   const Point<dim> &x) const
  {
    // t_i . (x(xi) - x) = 0, Newton with the Gauss-Newton matrix t_i . t_j, exact on flat faces
    Coordinates centre;
    for (unsigned int d = 0; d < dim - 1; ++d)
      centre[d] = 0.5;
    // Beyond half a face outside of it the surface goes on along its tangents: polynomials turn
    // back there, and a point far away would be found on the wrong side.
    const auto extended_frame = [&](const Coordinates &at)
    {
      Coordinates inner = at;
      for (unsigned int d = 0; d < dim - 1; ++d)
        inner[d] = std::min(1.5, std::max(-0.5, at[d]));
      Frame result = frame(face, inner);
      for (unsigned int d = 0; d < dim - 1; ++d)
        result.x += (at[d] - inner[d]) * result.tangents[d];
      return result;
    };
    Coordinates xi = centre, first_step;
    for (unsigned int step = 0; step < 25; ++step)
    {
      const Frame f = extended_frame(xi);
      Tensor<2, dim - 1> metric;
      Tensor<1, dim - 1> residual;
      const Tensor<1, dim> distance = x - f.x;
      for (unsigned int i = 0; i < dim - 1; ++i)
      {
        residual[i] = f.tangents[i] * distance;
        for (unsigned int j = 0; j < dim - 1; ++j)
          metric[i][j] = f.tangents[i] * f.tangents[j];
      }
      const Tensor<1, dim - 1> change = invert(metric) * residual;
      xi += change;
      if (step == 0)
        first_step = xi;
      if (change.norm() < 1e-14 * (1 + xi.norm()))
        return xi;
      if (!(xi.norm() < 1e3))
        return first_step;
    }
    // Rounding may keep the last change above the tolerance; a cycle or a divergence does not end
    // here.
    const Frame f   = extended_frame(xi);
    double mismatch = 0;
    for (unsigned int i = 0; i < dim - 1; ++i)
      mismatch += std::abs(f.tangents[i] * (x - f.x)) / f.tangents[i].norm_square();
    return mismatch < 1e-9 ? xi : first_step;
  }

  namespace
  {
    using Polygon = std::vector<Point<2>>;

    template <int dim>
    struct FaceBox
    {
      Point<dim> low, high;

      FaceBox(const SurfaceFace<dim> &face, const double margin)
          : low(face.nodes[0]), high(face.nodes[0])
      {
        for (const Point<dim> &x : face.nodes)
          for (unsigned int d = 0; d < dim; ++d)
          {
            low[d]  = std::min(low[d], x[d]);
            high[d] = std::max(high[d], x[d]);
          }
        // The nodes do not enclose a curved face; a quarter of its size does.
        const double extra = margin + 0.25 * (high - low).norm();
        for (unsigned int d = 0; d < dim; ++d)
        {
          low[d] -= extra;
          high[d] += extra;
        }
      }

      bool overlaps(const FaceBox &other) const
      {
        for (unsigned int d = 0; d < dim; ++d)
          if (low[d] > other.high[d] || high[d] < other.low[d])
            return false;
        return true;
      }
    };

    /// Sutherland-Hodgman: the part of the polygon inside the unit square.
    Polygon clip_to_unit_square(Polygon polygon)
    {
      for (unsigned int side = 0; side < 4 && !polygon.empty(); ++side)
      {
        const unsigned int d = side / 2;
        const auto inside    = [&](const Point<2> &x) { return side % 2 == 0 ? x[d] : 1 - x[d]; };
        Polygon result;
        for (unsigned int i = 0; i < polygon.size(); ++i)
        {
          const Point<2> &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
          const double in_a = inside(a), in_b = inside(b);
          if (in_a >= 0)
            result.push_back(a);
          if ((in_a > 0 && in_b < 0) || (in_a < 0 && in_b > 0))
          {
            Point<2> cut = a + in_a / (in_a - in_b) * (b - a);
            cut[d]       = side % 2 == 0 ? 0. : 1.;
            result.push_back(cut);
          }
        }
        polygon = std::move(result);
      }
      return polygon;
    }

    double signed_area(const Polygon &polygon)
    {
      double area = 0;
      for (unsigned int i = 0; i < polygon.size(); ++i)
      {
        const Point<2> &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        area += (a[0] * b[1] - a[1] * b[0]) / 2;
      }
      return area;
    }

    /// Removes repeated corners.
    Polygon without_short_edges(const Polygon &polygon)
    {
      Polygon result;
      for (unsigned int i = 0; i < polygon.size(); ++i)
        if ((polygon[i] - polygon[(i + 1) % polygon.size()]).norm() > 1e-13)
          result.push_back(polygon[i]);
      return result;
    }

    bool is_convex_quadrilateral(const Polygon &polygon)
    {
      if (polygon.size() != 4)
        return false;
      double sign = 0;
      for (unsigned int i = 0; i < 4; ++i)
      {
        const Tensor<1, 2> e = polygon[(i + 1) % 4] - polygon[i],
                           f = polygon[(i + 2) % 4] - polygon[(i + 1) % 4];
        const double turn    = (e[0] * f[1] - e[1] * f[0]) / (e.norm() * f.norm());
        if (std::abs(turn) < 1e-3 || turn * sign < 0)
          return false;
        sign = turn;
      }
      return true;
    }

    /// Whether all edges run along the axes. Of a product of shape functions a rule of p + 2 points
    /// per direction misses terms from the third power of the slope on, so that slopes of 1e-3 cost
    /// less than rounding.
    bool is_aligned(const Polygon &polygon)
    {
      for (unsigned int i = 0; i < polygon.size(); ++i)
      {
        const Tensor<1, 2> e = polygon[(i + 1) % polygon.size()] - polygon[i];
        if (std::min(std::abs(e[0]), std::abs(e[1])) > 1e-3 * e.norm())
          return false;
      }
      return true;
    }

    /// A polygon whose edges run along the axes, but for slopes of 1e-3, with further corners on
    /// two opposite sides only, as curved edges have them: cut across there into quadrilaterals.
    /// Empty if it is another one.
    std::vector<Polygon> strips_of(const Polygon &polygon)
    {
      const unsigned int n = polygon.size();
      if (n < 5 || !is_aligned(polygon))
        return {};
      for (unsigned int along = 0; along < 2; ++along)
      {
        // Edges across must be two: where the one ends a chain along the other axis begins.
        const auto runs_across = [&](const unsigned int i)
        {
          const Tensor<1, 2> e = polygon[(i + 1) % n] - polygon[i];
          return std::abs(e[1 - along]) > std::abs(e[along]);
        };
        std::vector<unsigned int> across;
        for (unsigned int i = 0; i < n; ++i)
          if (runs_across(i))
            across.push_back(i);
        if (across.size() != 2)
          continue;
        // Both chains in the same direction
        const auto between = [&](const unsigned int begin, const unsigned int end)
        {
          Polygon chain;
          for (unsigned int i = (begin + 1) % n; i != (end + 1) % n; i = (i + 1) % n)
            chain.push_back(polygon[i]);
          return chain;
        };
        Polygon first = between(across[0], across[1]), second = between(across[1], across[0]);
        std::reverse(second.begin(), second.end());
        if (first.size() < 2 || second.size() < 2)
          continue;
        // Parts of the way where either has a corner
        const auto part_of = [along](const Polygon &chain, const unsigned int i) {
          return (chain[i][along] - chain.front()[along]) /
                 (chain.back()[along] - chain.front()[along]);
        };
        std::vector<double> parts = {0, 1};
        for (const Polygon *chain : {&first, &second})
          for (unsigned int i = 1; i + 1 < chain->size(); ++i)
            parts.push_back(part_of(*chain, i));
        std::sort(parts.begin(), parts.end());
        const auto at = [&](const Polygon &chain, const double part)
        {
          unsigned int i = 1;
          while (i + 1 < chain.size() && part_of(chain, i) < part)
            ++i;
          const double a = part_of(chain, i - 1), b = part_of(chain, i);
          return chain[i - 1] + (part - a) / (b - a) * (chain[i] - chain[i - 1]);
        };
        std::vector<Polygon> strips;
        for (unsigned int k = 0; k + 1 < parts.size(); ++k)
          if (parts[k + 1] - parts[k] > 1e-13)
            strips.push_back({at(first, parts[k]), at(first, parts[k + 1]),
                              at(second, parts[k + 1]), at(second, parts[k])});
        const auto is_good = [](const Polygon &strip)
        { return is_convex_quadrilateral(strip) && is_aligned(strip); };
        if (std::all_of(strips.begin(), strips.end(), is_good))
          return strips;
      }
      return {};
    }

    /// A quadrature on a polygon: a product rule on convex quadrilaterals and on each of its
    /// strips; if it has none, one on each triangle of a fan about the mean corner (collapsed
    /// product rule). Signed weights, positive for the orientation of the polygon. Where the edges
    /// are oblique, a product of two shape functions of degree @p p has the degree 4 p along them,
    /// and the surface element adds one. One point more leaves of what is no polynomial, where
    /// faces are no parallelograms, so little that eigenvalues do not depend on how the corners of
    /// cells are numbered.
    void quadrature_on_polygon(const Polygon &polygon, const unsigned int p,
                               std::vector<std::pair<Point<2>, double>> &points)
    {
      if (const std::vector<Polygon> strips = strips_of(polygon); !strips.empty())
      {
        for (const Polygon &strip : strips)
          quadrature_on_polygon(strip, p, points);
        return;
      }
      const bool is_quadrilateral = is_convex_quadrilateral(polygon);
      const QGauss<1> rule(is_quadrilateral && is_aligned(polygon) ? p + 2 : 2 * p + 2);
      const auto add_quadrilateral = [&](const std::array<Point<2>, 4> &c)
      {
        for (unsigned int j = 0; j < rule.size(); ++j)
          for (unsigned int i = 0; i < rule.size(); ++i)
          {
            const double s = rule.point(i)[0], t = rule.point(j)[0];
            const Point<2> x((1 - s) * (1 - t) * c[0][0] + s * (1 - t) * c[1][0] + s * t * c[2][0] +
                                 (1 - s) * t * c[3][0],
                             (1 - s) * (1 - t) * c[0][1] + s * (1 - t) * c[1][1] + s * t * c[2][1] +
                                 (1 - s) * t * c[3][1]);
            const Tensor<1, 2> x_s = (1 - t) * (c[1] - c[0]) + t * (c[2] - c[3]);
            const Tensor<1, 2> x_t = (1 - s) * (c[3] - c[0]) + s * (c[2] - c[1]);
            points.emplace_back(x, rule.weight(i) * rule.weight(j) *
                                       (x_s[0] * x_t[1] - x_s[1] * x_t[0]));
          }
      };
      if (is_quadrilateral)
      {
        add_quadrilateral({{polygon[0], polygon[1], polygon[2], polygon[3]}});
        return;
      }
      if (polygon.size() == 3)
      {
        add_quadrilateral({{polygon[0], polygon[1], polygon[2], polygon[2]}});
        return;
      }
      Point<2> centre;
      for (const Point<2> &corner : polygon)
        centre += corner / double(polygon.size());
      for (unsigned int i = 0; i < polygon.size(); ++i)
        add_quadrilateral({{centre, polygon[i], polygon[(i + 1) % polygon.size()],
                            polygon[(i + 1) % polygon.size()]}});
    }

    /// Which edges of a face are two edges of finer neighbours (counter-clockwise from xi_2 = 0).
    using DividedEdges = std::array<bool, 4>;

    constexpr std::array<std::array<double, 2>, 5> corners = {
        {{{0, 0}}, {{1, 0}}, {{1, 1}}, {{0, 1}}, {{0, 0}}}};

    /// Finds the edges in whose middle another face has a corner. Their polygons must have that
    /// corner too, lest the pieces overlap or leave gaps.
    std::vector<DividedEdges> divided_edges(const FaceElement<3> &element,
                                            const std::vector<SurfaceFace<3>> &faces)
    {
      std::vector<Point<3>> vertices;
      const unsigned int p = element.degree();
      for (const SurfaceFace<3> &face : faces)
        for (const unsigned int node : {0u, p, p * (p + 1), (p + 1) * (p + 1) - 1})
          vertices.push_back(face.nodes[node]);
      const auto along_x = [](const Point<3> &a, const Point<3> &b) { return a[0] < b[0]; };
      std::sort(vertices.begin(), vertices.end(), along_x);

      std::vector<DividedEdges> result(faces.size());
      for (unsigned int f = 0; f < faces.size(); ++f)
        for (unsigned int i = 0; i < 4; ++i)
        {
          const Point<2> a(corners[i][0], corners[i][1]), b(corners[i + 1][0], corners[i + 1][1]);
          const Point<3> middle  = element.frame(faces[f], a + 0.5 * (b - a)).x;
          const double tolerance = 1e-9 * middle.distance(element.frame(faces[f], a).x);
          auto vertex            = std::lower_bound(vertices.begin(), vertices.end(),
                                                    Point<3>(middle[0] - tolerance, 0, 0), along_x);
          for (; vertex != vertices.end() && (*vertex)[0] <= middle[0] + tolerance; ++vertex)
            result[f][i] = result[f][i] || vertex->distance(middle) <= tolerance;
        }
      return result;
    }
    /// There are no edges in two dimensions.
    std::vector<DividedEdges> divided_edges(const FaceElement<2> &,
                                            const std::vector<SurfaceFace<2>> &faces)
    {
      return std::vector<DividedEdges>(faces.size());
    }

    /// The outline of a rotor face in the reference coordinates of a pad face, counter-clockwise in
    /// the rotor face's own coordinates.
    Polygon outline(const FaceElement<3> &element, const SurfaceFace<3> &rotor_face,
                    const DividedEdges &divided, const SurfaceFace<3> &pad_face)
    {
      // Where edges of both sides coincide, rounding must not decide whether the clipped polygon
      // has a corner more, and so which quadrature it gets.
      const auto to_pad = [&](const Point<2> &xi)
      {
        Point<2> image = element.project(pad_face, element.frame(rotor_face, xi).x);
        for (unsigned int d = 0; d < 2; ++d)
          for (const double end : {0., 1.})
            if (std::abs(image[d] - end) < 1e-12)
              image[d] = end;
        return image;
      };
      const auto far_from_square = [](const Point<2> &a, const Point<2> &b)
      {
        for (unsigned int d = 0; d < 2; ++d)
          if (std::max(a[d], b[d]) < -0.5 || std::min(a[d], b[d]) > 1.5)
            return true;
        return false;
      };
      // A wrong place of the cut by delta costs about delta^2 in the integrals.
      const double tolerance       = 1e-6;
      const unsigned int max_depth = 6; // of edges that are not divided anyway

      Polygon polygon;

      const auto add_edge = [&](const auto &self, const Point<2> &a, const Point<2> &b,
                                const Point<2> &image_a, const Point<2> &image_b,
                                const unsigned depth) -> void
      {
        const Point<2> middle = a + 0.5 * (b - a), image = to_pad(middle);
        const Point<2> chord = image_a + 0.5 * (image_b - image_a);
        if (depth == 0 || (depth <= max_depth && (image - chord).norm() < tolerance) ||
            (far_from_square(image_a, image) && far_from_square(image, image_b) &&
             far_from_square(image_a, image_b)))
        {
          polygon.push_back(image_a);
          return;
        }
        self(self, a, middle, image_a, image, depth - 1);
        self(self, middle, b, image, image_b, depth - 1);
      };
      for (unsigned int i = 0; i < 4; ++i)
      {
        const Point<2> a(corners[i][0], corners[i][1]), b(corners[i + 1][0], corners[i + 1][1]);
        add_edge(add_edge, a, b, to_pad(a), to_pad(b), max_depth + divided[i]);
      }
      return polygon;
    }

    /// Quadrature on the common part of two faces, in the pad's reference coordinates.
    std::vector<std::pair<Point<2>, double>> common_quadrature(const FaceElement<3> &element,
                                                               const SurfaceFace<3> &rotor_face,
                                                               const DividedEdges &divided,
                                                               const SurfaceFace<3> &pad_face)
    {
      std::vector<std::pair<Point<2>, double>> points;
      Polygon polygon =
          without_short_edges(clip_to_unit_square(outline(element, rotor_face, divided, pad_face)));
      if (polygon.size() < 3)
        return points;
      const double area = signed_area(polygon);
      if (area < 0)
        std::reverse(polygon.begin(), polygon.end());
      if (std::abs(area) < 1e-14)
        return points;
      quadrature_on_polygon(polygon, element.degree(), points);
      return points;
    }

    std::vector<std::pair<Point<1>, double>> common_quadrature(const FaceElement<2> &element,
                                                               const SurfaceFace<2> &rotor_face,
                                                               const DividedEdges &,
                                                               const SurfaceFace<2> &pad_face)
    {
      const double a   = element.project(pad_face, element.frame(rotor_face, Point<1>(0.)).x)[0];
      const double b   = element.project(pad_face, element.frame(rotor_face, Point<1>(1.)).x)[0];
      const double low = std::max(0., std::min(a, b)), high = std::min(1., std::max(a, b));

      std::vector<std::pair<Point<1>, double>> points;
      if (high - low > 1e-14)
      {
        const QGauss<1> rule(element.degree() + 2);
        for (unsigned int q = 0; q < rule.size(); ++q)
          points.emplace_back(Point<1>(low + (high - low) * rule.point(q)[0]),
                              (high - low) * rule.weight(q));
      }
      return points;
    }
  } // namespace

  template <int dim>
  std::vector<FacePair<dim>>
  pair_surfaces(const FaceElement<dim> &element, const std::vector<SurfaceFace<dim>> &pad_faces,
                const std::vector<SurfaceFace<dim>> &rotor_faces, const double search_distance)
  {
    // Boxes of the rotor's faces sorted along x: each pad face looks only at those that begin
    // before it ends.
    std::vector<std::pair<FaceBox<dim>, unsigned int>> boxes;
    double widest = 0;
    for (unsigned int m = 0; m < rotor_faces.size(); ++m)
    {
      boxes.emplace_back(FaceBox<dim>(rotor_faces[m], 0.), m);
      widest = std::max(widest, boxes.back().first.high[0] - boxes.back().first.low[0]);
    }
    std::sort(boxes.begin(), boxes.end(),
              [](const auto &a, const auto &b) {
                return std::make_pair(a.first.low[0], a.second) <
                       std::make_pair(b.first.low[0], b.second);
              });

    const std::vector<DividedEdges> divided = divided_edges(element, rotor_faces);
    std::vector<FacePair<dim>> pairs;
    for (unsigned int s = 0; s < pad_faces.size(); ++s)
    {
      const FaceBox<dim> box(pad_faces[s], search_distance);
      auto candidate =
          std::lower_bound(boxes.begin(), boxes.end(), box.low[0] - widest,
                           [](const auto &b, const double x) { return b.first.low[0] < x; });
      for (; candidate != boxes.end() && candidate->first.low[0] <= box.high[0]; ++candidate)
      {
        if (!box.overlaps(candidate->first))
          continue;
        FacePair<dim> pair{s, candidate->second, {}};
        for (const auto &[xi_pad, weight] : common_quadrature(
                 element, rotor_faces[pair.rotor_face], divided[pair.rotor_face], pad_faces[s]))
        {
          const auto frame    = element.frame(pad_faces[s], xi_pad);
          const auto xi_rotor = element.project(rotor_faces[pair.rotor_face], frame.x);
          pair.points.push_back({xi_pad, xi_rotor, weight * frame.measure});
        }
        if (!pair.points.empty())
          pairs.push_back(std::move(pair));
      }
    }
    return pairs;
  }

  template <int dim>
  std::vector<FacePair<dim>>
  pair_facing_surfaces(const FaceElement<dim> &element, const std::vector<SurfaceFace<dim>> &first,
                       const std::vector<SurfaceFace<dim>> &second, const double distance)
  {
    std::vector<FacePair<dim>> result;
    for (FacePair<dim> &pair : pair_surfaces(element, first, second, distance))
    {
      const auto is_apart = [&](const PairedPoint<dim> &point)
      {
        const auto a = element.frame(first[pair.pad_face], point.xi_pad),
                   b = element.frame(second[pair.rotor_face], point.xi_rotor);
        return a.normal * b.normal > -0.5 || a.x.distance(b.x) > distance;
      };
      pair.points.erase(std::remove_if(pair.points.begin(), pair.points.end(), is_apart),
                        pair.points.end());
      if (!pair.points.empty())
        result.push_back(std::move(pair));
    }
    return result;
  }

  template class FaceElement<2>;
  template class FaceElement<3>;
  template std::vector<FacePair<2>> pair_surfaces(const FaceElement<2> &,
                                                  const std::vector<SurfaceFace<2>> &,
                                                  const std::vector<SurfaceFace<2>> &, double);
  template std::vector<FacePair<3>> pair_surfaces(const FaceElement<3> &,
                                                  const std::vector<SurfaceFace<3>> &,
                                                  const std::vector<SurfaceFace<3>> &, double);
  template std::vector<FacePair<2>> pair_facing_surfaces(const FaceElement<2> &,
                                                         const std::vector<SurfaceFace<2>> &,
                                                         const std::vector<SurfaceFace<2>> &,
                                                         double);
  template std::vector<FacePair<3>> pair_facing_surfaces(const FaceElement<3> &,
                                                         const std::vector<SurfaceFace<3>> &,
                                                         const std::vector<SurfaceFace<3>> &,
                                                         double);
} // namespace squeal
