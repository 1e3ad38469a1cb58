#pragma once

#include <squeal/contact/contact.h>

#include <vector>

namespace squeal
{
  /// What the first sides of ties and of contacts that do not slide hold of the second sides.
  ///
  /// A second side moves with the first. What a cell there leaves over of the forces r on a face,
  /// both resist: the energy is r^2 / (k_1 + k_2), with the sums k_2 of the cell's and k_1 of the
  /// opposite cells' resistances (LocalProblems::resistance). The local problem of the cell knows
  /// k_2 alone: its residual is multiplied with sqrt(k_2 / (k_1 + k_2)). Else a soft layer that is
  /// the second side of a stiff body would answer with its own stiffness, too large by the ratio.
  /// The first side's problem has the constraint (LocalProblems::make).
  template <int dim>
  class SecondSides
  {
  public:
    /// @p resistances of this rank's cells by unknown; @p contact may be null. Collective.
    SecondSides(const FiniteElementSpace<dim> &spaces, const Contact<dim> *contact,
                const std::vector<std::vector<double>> &resistances);

    /// Multiplies the shares of the cells' unknowns on second sides with their factors.
    void reduce(std::vector<std::vector<double>> &shares) const;

  private:
    struct Factor
    {
      unsigned int cell, unknown; ///< number among this rank's, and component times n plus node
      double value;
    };
    std::vector<Factor> factors;
  };
} // namespace squeal
