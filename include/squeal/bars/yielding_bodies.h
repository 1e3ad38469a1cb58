#pragma once

#include <squeal/bars/enriched_residuals.h>
#include <squeal/linalg/factorization.h>

#include <memory>
#include <set>
#include <vector>

namespace squeal
{
  /// Bodies of flat cells, in which V_h gives way to what one degree more adds.
  ///
  /// In bending a flat cell's rotation must follow its deflection, or it shears. A function of W
  /// that bends it cannot do so by itself: problems on single cells, V_h held, see a small part of
  /// the error. Here the whole body answers to its part of the residuals,
  ///     K+ d = r   on V+ = V_h + W,
  /// contacts and joints being given tractions. That takes factors of its stiffness in V+.
  ///
  /// Bodies with the first side of a contact or tie are left out, whose local problems have
  /// multipliers, and bodies that share nodes with others, which resist, too.
  template <int dim>
  class YieldingBodies
  {
  public:
    /// Finds the bodies. K+ + @p shift M+, in (rad/s)^2, stands for K+: a little holds bodies that
    /// nothing else holds, on whose rigid motions residuals do no work. @p residuals must outlive
    /// it. Collective.
    YieldingBodies(const EnrichedResiduals<dim> &residuals, double shift);

    template <typename Cell>
    bool has(const Cell &cell) const
    {
      return bodies.count(space.base.geometry.parts[cell->material_id()].body) > 0;
    }
    bool empty() const
    {
      return bodies.empty();
    }
    /// Whether the cell is of a body that should yield and does not, for give_up() was called.
    template <typename Cell>
    bool had(const Cell &cell) const
    {
      return given_up.count(space.base.geometry.parts[cell->material_id()].body) > 0;
    }
    void give_up()
    {
      std::swap(bodies, given_up);
    }

    /// d for the columns of @p r, a block on V+. Collective; throws SolverError, also where there
    /// is no memory for factors.
    MultiVector answer(const MultiVector &r);

  private:
    void find_bodies();
    void factorise();

    const EnrichedResiduals<dim> &residuals;
    const EnrichedSpace<dim> &space; ///< theirs
    const double shift;
    std::set<Body> bodies, given_up;
    std::unique_ptr<PartialFactorization> factors; ///< of K+
  };
} // namespace squeal
