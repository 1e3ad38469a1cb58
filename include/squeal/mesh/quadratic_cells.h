#pragma once

#include <deal.II/base/point.h>
#include <deal.II/grid/manifold.h>
#include <deal.II/grid/tria.h>

#include <array>
#include <map>
#include <memory>
#include <vector>

namespace squeal
{
  /// Cells whose edges and faces are curved: polynomials of degree 2 in each coordinate of the unit
  /// cell. Points are kept by the vertices between which they lie, so that cells that share a face
  /// share its shape, whatever the order of their vertices.
  struct QuadraticCells
  {
    std::map<std::array<unsigned int, 2>, dealii::Point<3>> edges; ///< vertices ascending
    std::map<std::array<unsigned int, 4>, dealii::Point<3>> faces; ///< vertices ascending
    std::map<unsigned int, dealii::Point<3>> cells;                ///< the centres of curved cells

    /// The same with other numbers of vertices.
    QuadraticCells renumbered(const std::vector<unsigned int> &number) const;
    /// The 27 points of a curved cell with the given vertices (order of deal.II), x first.
    std::array<dealii::Point<3>, 27> points(unsigned int cell,
                                            const std::array<dealii::Point<3>, 8> &corners,
                                            const std::array<unsigned int, 8> &vertices) const;
    bool empty() const
    {
      return cells.empty();
    }
    /// Gives each curved cell of a coarse mesh, with its faces and edges, a manifold of its own:
    /// new points lie where the cell's polynomial has them. Ids are @p first_id + cell.
    void attach(dealii::Triangulation<3> &triangulation, dealii::types::manifold_id first_id) const;
  };

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
