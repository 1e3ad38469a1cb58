#include <squeal/base/errors.h>
#include <squeal/mesh/quadratic_manifold.h>

#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Values of the polynomials of degree 2 that are 1 at 0, 1/2 and 1.
    std::array<double, 3> quadratic_values(const double s)
    {
      return {{(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)}};
    }

    std::array<double, 3> quadratic_slopes(const double s)
    {
      return {{4 * s - 3, 4 - 8 * s, 4 * s - 1}};
    }
  } // namespace

  QuadraticManifold::QuadraticManifold(const std::array<Point<3>, 27> &points) : points(points)
  {
    for (unsigned int n = 0; n < 27; ++n)
      arms[n] = points[n] - points[0];
  }

  std::unique_ptr<Manifold<3, 3>> QuadraticManifold::clone() const
  {
    return std::make_unique<QuadraticManifold>(points);
  }

  Tensor<1, 3> QuadraticManifold::arm(const Point<3> &xi) const
  {
    const auto a = quadratic_values(xi[0]), b = quadratic_values(xi[1]),
               c = quadratic_values(xi[2]);
    Tensor<1, 3> result;
    for (unsigned int n = 1; n < 27; ++n)
      result += a[n % 3] * b[n / 3 % 3] * c[n / 9] * arms[n];
    return result;
  }

  Point<3> QuadraticManifold::push_forward(const Point<3> &xi) const
  {
    return points[0] + arm(xi);
  }

  DerivativeForm<1, 3, 3> QuadraticManifold::push_forward_gradient(const Point<3> &xi) const
  {
    std::array<std::array<double, 3>, 3> values{}, slopes{};
    for (unsigned int d = 0; d < 3; ++d)
    {
      values[d] = quadratic_values(xi[d]);
      slopes[d] = quadratic_slopes(xi[d]);
    }
    DerivativeForm<1, 3, 3> gradient;
    for (unsigned int n = 0; n < 27; ++n)
    {
      const std::array<unsigned int, 3> at = {{n % 3, n / 3 % 3, n / 9}};
      for (unsigned int d = 0; d < 3; ++d)
      {
        double weight = 1;
        for (unsigned int e = 0; e < 3; ++e)
          weight *= e == d ? slopes[e][at[e]] : values[e][at[e]];
        for (unsigned int c = 0; c < 3; ++c)
          gradient[c][d] += weight * arms[n][c];
      }
    }
    return gradient;
  }

  std::array<double, 27> QuadraticManifold::scaled_jacobians() const
  {
    std::array<double, 27> result;
    for (unsigned int n = 0; n < 27; ++n)
    {
      const Point<3> xi(n % 3 / 2., n / 3 % 3 / 2., n / 9 / 2.);
      const Tensor<2, 3> columns = transpose(Tensor<2, 3>(push_forward_gradient(xi)));
      const double lengths       = columns[0].norm() * columns[1].norm() * columns[2].norm();
      result[n]                  = lengths > 0 ? determinant(columns) / lengths : 0;
    }
    return result;
  }

  Point<3> QuadraticManifold::pull_back(const Point<3> &x) const
  {
    unsigned int nearest = 0;
    for (unsigned int n = 1; n < 27; ++n)
      if (points[n].distance(x) < points[nearest].distance(x))
        nearest = n;
    Point<3> xi(nearest % 3 / 2., nearest / 3 % 3 / 2., nearest / 9 / 2.);
    constexpr unsigned int most_steps = 50;
    // Each step squares the error, a part of the cell.
    constexpr double last_step = 1e-10;
    for (unsigned int step = 0; step < most_steps; ++step)
    {
      const Tensor<2, 3> gradient(push_forward_gradient(xi));
      if (!(std::abs(determinant(gradient)) > 0))
        break;
      const Tensor<1, 3> change = invert(gradient) * (x - points[0] - arm(xi));
      xi += change;
      if (change.norm() <= last_step)
        return xi;
    }
    throw SolverError(
        "A cell that follows the middle nodes of a quadratic element is bent so much "
        "that a point of it is not found: it needs middle nodes nearer to the middles of "
        "its edges.");
  }
} // namespace squeal
