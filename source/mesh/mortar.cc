#include <squeal/base/errors.h>
#include <squeal/mesh/curved_polygon.h>
#include <squeal/mesh/mortar.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/base/utilities.h>

#include <boost/math/tools/toms748_solve.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

// Common quadrature of two surfaces. FaceElement has the shape functions of a face, its normal and
// the nearest point. The edges of a face of one surface become polygons in the reference square of
// a face of the other (EdgeImages, outline_of()), are clipped against it (clip_to_unit_square())
// and get back their curved sides (sides_of()); quadrature_on() of curved_polygon.h does the rest.
// pair_surfaces() does so for all faces whose boxes are near enough.

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

    /// A corner of an outline with the side that begins there: the image of an edge of the rotor's
    /// face between two parameters, or (-1) a straight line.
    struct Corner
    {
      Point<2> x;
      int edge    = -1;
      double from = 0, to = 1; ///< of the edge
    };
    using Outline = std::vector<Corner>;

    /// Where images of edges are further away from their polygon than this they jump: the point of
    /// a face that is nearest is not unique far outside of it.
    constexpr double jump = 1e-4;

    /// Sutherland-Hodgman: the part of the outline inside the unit square. Images of edges are cut
    /// where they cross its sides, straight lines elsewhere.
    template <typename Image>
    Outline clip_to_unit_square(Outline outline, const Image &image)
    {
      for (unsigned int side = 0; side < 4 && !outline.empty(); ++side)
      {
        const unsigned int d = side / 2;
        const auto inside    = [&](const Point<2> &x) { return side % 2 == 0 ? x[d] : 1 - x[d]; };
        Outline result;
        for (unsigned int i = 0; i < outline.size(); ++i)
        {
          const Corner &a   = outline[i];
          const Point<2> &b = outline[(i + 1) % outline.size()].x;
          const double in_a = inside(a.x), in_b = inside(b);
          if (in_a >= 0)
            result.push_back(a);
          if (in_a == 0 && in_b < 0)
            result.back().edge = -1; // along the side of the square
          if ((in_a > 0 && in_b < 0) || (in_a < 0 && in_b > 0))
          {
            const double part = in_a / (in_a - in_b);
            Corner cut        = a;
            cut.x             = a.x + part * (b - a.x);
            cut.from          = a.from + part * (a.to - a.from);
            if (a.edge >= 0)
            {
              std::uintmax_t most_steps = 40;
              const auto [low, high]    = boost::math::tools::toms748_solve(
                  [&](const double at) { return inside(image(a.edge, at)); }, a.from, a.to, in_a,
                  in_b, boost::math::tools::eps_tolerance<double>(), most_steps);
              const double s   = (low + high) / 2;
              const Point<2> x = image(a.edge, s);
              if (x.distance(cut.x) < jump)
              {
                cut.x    = x;
                cut.from = s;
              }
            }
            cut.x[d] = side % 2 == 0 ? 0. : 1.;
            if (in_a > 0)
            {
              result.back().to = cut.from;
              cut.edge         = -1;
            }
            result.push_back(cut);
          }
        }
        outline = std::move(result);
      }
      return outline;
    }

    /// The outline's sides: of each edge one curve as far as it goes; lines where its image jumps.
    template <typename Image>
    CurvedPolygon sides_of(Outline outline, const Image &image)
    {
      const unsigned int n = outline.size();
      const auto goes_on   = [&](const unsigned int i)
      {
        const Corner &before = outline[(i + n - 1) % n], &after = outline[i % n];
        return after.edge >= 0 && before.edge == after.edge && before.to == after.from;
      };
      unsigned int start = 0;
      while (start + 1 < n && goes_on(start))
        ++start;
      std::rotate(outline.begin(), outline.begin() + start, outline.end());

      // Closer to the edge than the polygon that was clipped
      constexpr unsigned int n_points          = 8;
      static const std::vector<Point<1>> nodes = QGaussLobatto<1>(n_points).get_points();
      CurvedPolygon sides;
      for (unsigned int i = 0, next; i < n; i = next)
      {
        next = i + 1;
        while (next < n && goes_on(next))
          ++next;
        const Corner &first = outline[i];
        const double range  = outline[next - 1].to - first.from;
        const auto corner   = [&](const unsigned int k) { return outline[k % n].x; };
        bool follows        = first.edge >= 0 && range > 0;
        std::vector<Point<2>> points;
        for (unsigned int k = 0, at = i; k < n_points && follows; ++k)
        {
          const double s = first.from + nodes[k][0] * range;
          while (at + 1 < next && s > outline[at].to)
            ++at;
          const double part         = (s - outline[at].from) / (outline[at].to - outline[at].from);
          const Point<2> of_outline = corner(at) + part * (corner(at + 1) - corner(at));
          points.push_back(k == 0              ? first.x
                           : k == n_points - 1 ? corner(next)
                                               : image(first.edge, s));
          follows = points.back().distance(of_outline) < jump;
        }
        if (follows)
        {
          const PlaneCurve curve(std::move(points));
          for (unsigned int k = i + 1; k < next && follows; ++k)
            follows = curve.at((outline[k].from - first.from) / range).distance(corner(k)) < jump;
          if (follows)
          {
            sides.push_back(curve);
            continue;
          }
        }
        for (unsigned int k = i; k < next; ++k)
          sides.push_back(PlaneCurve({corner(k), corner(k + 1)}));
      }
      return sides;
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

    /// An edge of a rotor face, counter-clockwise in the face's own coordinates, or a half of one
    /// where finer neighbours share it: its image in the reference coordinates of a pad face.
    class EdgeImages
    {
    public:
      EdgeImages(const FaceElement<3> &element, const SurfaceFace<3> &rotor_face,
                 const DividedEdges &divided, const SurfaceFace<3> &pad_face)
          : element(element), rotor_face(rotor_face), pad_face(pad_face)
      {
        for (unsigned int i = 0; i < 4; ++i)
        {
          const Point<2> a(corners[i][0], corners[i][1]), b(corners[i + 1][0], corners[i + 1][1]),
              middle = a + 0.5 * (b - a);
          if (divided[i])
          {
            ends.push_back({{a, middle}});
            ends.push_back({{middle, b}});
          }
          else
            ends.push_back({{a, b}});
        }
      }
      unsigned int n_edges() const
      {
        return ends.size();
      }
      Point<2> operator()(const unsigned int edge, const double s) const
      {
        const Point<2> xi = ends[edge][0] + s * (ends[edge][1] - ends[edge][0]);
        Point<2> image    = element.project(pad_face, element.frame(rotor_face, xi).x);
        // Where edges of both sides coincide, rounding must not decide whether the clipped polygon
        // has a corner more, and so which quadrature it gets.
        for (unsigned int d = 0; d < 2; ++d)
          for (const double end : {0., 1.})
            if (std::abs(image[d] - end) < 1e-12)
              image[d] = end;
        return image;
      }

    private:
      const FaceElement<3> &element;
      const SurfaceFace<3> &rotor_face, &pad_face;
      std::vector<std::array<Point<2>, 2>> ends; ///< in the rotor face's coordinates
    };

    /// The outline of a rotor face as a polygon that follows its edges.
    Outline outline_of(const EdgeImages &image)
    {
      const auto far_from_square = [](const Point<2> &a, const Point<2> &b)
      {
        for (unsigned int d = 0; d < 2; ++d)
          if (std::max(a[d], b[d]) < -0.5 || std::min(a[d], b[d]) > 1.5)
            return true;
        return false;
      };
      // It decides only which parts of an edge are inside of the square. What is missed, a bow
      // across a side and back, costs about the square of that in the integrals.
      const double tolerance       = 1e-6;
      const unsigned int max_depth = 6; // of edges

      Outline outline;
      const auto add_edge = [&](const auto &self, const unsigned int edge, const double from,
                                const double to, const Point<2> &at_from, const Point<2> &at_to,
                                const unsigned depth) -> void
      {
        const double middle      = (from + to) / 2;
        const Point<2> at_middle = image(edge, middle), chord = at_from + 0.5 * (at_to - at_from);
        if (depth == 0 || (at_middle - chord).norm() < tolerance ||
            (far_from_square(at_from, at_middle) && far_from_square(at_middle, at_to) &&
             far_from_square(at_from, at_to)))
        {
          outline.push_back({at_from, int(edge), from, to});
          return;
        }
        self(self, edge, from, middle, at_from, at_middle, depth - 1);
        self(self, edge, middle, to, at_middle, at_to, depth - 1);
      };
      for (unsigned int edge = 0; edge < image.n_edges(); ++edge)
        add_edge(add_edge, edge, 0., 1., image(edge, 0.), image(edge, 1.), max_depth);
      return outline;
    }

    /// Quadrature on the common part of two faces, in the pad's reference coordinates.
    std::vector<std::pair<Point<2>, double>> common_quadrature(const FaceElement<3> &element,
                                                               const SurfaceFace<3> &rotor_face,
                                                               const DividedEdges &divided,
                                                               const SurfaceFace<3> &pad_face)
    {
      const EdgeImages image(element, rotor_face, divided, pad_face);
      const Outline outline = clip_to_unit_square(outline_of(image), image);
      if (outline.size() < 2)
        return {};
      CurvedPolygon polygon = simplified(sides_of(outline, image));
      if (polygon.size() < 2)
        return {};
      const double area = signed_area(polygon);
      if (std::abs(area) < 1e-14)
        return {};
      if (area < 0)
      {
        std::reverse(polygon.begin(), polygon.end());
        for (PlaneCurve &side : polygon)
          side = side.reversed();
      }
      return quadrature_on(polygon, element.degree());
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
