#pragma once

#include <deal.II/base/point.h>
#include <deal.II/grid/manifold.h>

#include <array>
#include <memory>

namespace squeal
{
  /// The image of the unit cell under a polynomial of degree 2 in each coordinate.
  class QuadraticManifold : public dealii::ChartManifold<3, 3, 3>
  {
  public:
    explicit QuadraticManifold(const std::array<dealii::Point<3>, 27> &points);

    /// At each of the points the determinant of the gradient's columns over the product of their
    /// lengths: 1 for a brick, of one sign where the cell is not folded.
    std::array<double, 27> scaled_jacobians() const;

    std::unique_ptr<dealii::Manifold<3, 3>> clone() const override;
    dealii::Point<3> push_forward(const dealii::Point<3> &xi) const override;
    dealii::DerivativeForm<1, 3, 3>
    push_forward_gradient(const dealii::Point<3> &xi) const override;
    /// Newton's method. Throws SolverError where the cell is so bent that it does not settle.
    dealii::Point<3> pull_back(const dealii::Point<3> &x) const override;

  private:
    /// From the first point, so that what is far from the origin has no other rounding.
    dealii::Tensor<1, 3> arm(const dealii::Point<3> &xi) const;

    const std::array<dealii::Point<3>, 27> points;
    std::array<dealii::Tensor<1, 3>, 27> arms; ///< from the first point
  };
} // namespace squeal
