#pragma once

#include <deal.II/base/point.h>
#include <deal.II/base/tensor.h>

#include <memory>
#include <utility>
#include <vector>

namespace squeal
{
  /// A part of a plane curve: of the polynomial through its points at the Gauss-Lobatto nodes of
  /// the unit interval.
  class PlaneCurve
  {
  public:
    /// From the first point to the last; two points make a straight line.
    explicit PlaneCurve(std::vector<dealii::Point<2>> points);

    /// The point at s in [0, 1], and the derivative there.
    dealii::Point<2> at(double s) const;
    dealii::Tensor<1, 2> tangent(double s) const;

    dealii::Point<2> begin() const
    {
      return at(0);
    }
    dealii::Point<2> end() const
    {
      return at(1);
    }
    bool is_straight() const
    {
      return points->size() == 2;
    }
    /// From s = @p from to s = @p to; backwards, if that is the smaller one.
    PlaneCurve part(double from, double to) const;
    PlaneCurve reversed() const
    {
      return part(1, 0);
    }
    /// Where the coordinate @p d, which grows or falls all along, has the value @p x.
    double parameter_at(unsigned int d, double x) const;
    /// The largest distance from the straight line between its ends.
    double bow() const;
    /// Whether it runs along an axis, but for slopes of 1e-3.
    bool is_aligned() const;

  private:
    std::shared_ptr<const std::vector<dealii::Point<2>>> points;
    double first = 0, last = 1; ///< of the polynomial's interval
  };

  /// A region of the plane, by its sides counter-clockwise.
  using CurvedPolygon = std::vector<PlaneCurve>;

  double signed_area(const CurvedPolygon &polygon);

  /// Returns the region with straight lines for curves that are straight to rounding, without sides
  /// shorter than rounding and without corners between two straight sides of one direction.
  CurvedPolygon simplified(const CurvedPolygon &polygon);

  /// A quadrature for products of two functions that are polynomials of degree @p p in each
  /// coordinate, on a polygon of positive area: product rules on patches with three or four sides
  /// (Coons), which the polygon is cut into along straight lines; if it cannot be, on the triangles
  /// of a fan about its mean corner, with signed weights.
  ///
  /// Where sides run along the axes, but for slopes of 1e-3, p + 2 points per direction miss terms
  /// from the third power of the slope on, less than rounding. Where they are oblique, a product
  /// has the degree 4 p along them, and the surface element adds one; one point more leaves of what
  /// is no polynomial, where faces are no parallelograms, so little that eigenvalues do not depend
  /// on how the corners of cells are numbered. Sides with a bow get one point more in either case.
  std::vector<std::pair<dealii::Point<2>, double>> quadrature_on(const CurvedPolygon &polygon,
                                                                 unsigned int p);
} // namespace squeal
