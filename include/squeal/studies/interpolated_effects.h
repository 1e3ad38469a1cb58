#pragma once

#include <squeal/bars/carried_errors.h>
#include <squeal/reduction/branches.h>
#include <squeal/studies/varied_model.h>

#include <vector>

namespace squeal
{
  /// The effects of the discretisation wherever several parameters may be, from those at a centre
  /// and at some places about it: linear between, as the operators nearly are (theory.md,
  /// section 10).
  class InterpolatedEffects
  {
  public:
    using Point = std::vector<double>;
    /// Weights of the places at a point; the centre has what is left of one.
    using Shares = std::vector<double>;

    /// Solves the centre in full. With an estimator effects are estimated there and at the places,
    /// whose modes must continue those of the centre. Throws SolverError, InputError.
    InterpolatedEffects(VariedModel &varied, const ErrorEstimator &estimator, const Point &centre,
                        const std::vector<Point> &places);

    /// Modes and branches there, the latter by the modes' numbers.
    const BranchPoint &centre() const
    {
      return at_centre;
    }
    const ModesOnCourse &place() const
    {
      return course;
    }

    /// The effects at a point on the modes of the centre. With an estimator only.
    KnownEffects at(const Shares &shares) const;
    /// The effects on the modes of the point, of the last solution, that continue one of the
    /// centre. Collective.
    KnownEffects on(const Shares &shares, const EigenPairs &modes) const;

  private:
    VariedModel &varied;
    BranchPoint at_centre;
    ModesOnCourse course;
    ErrorEffects effects;
    std::vector<KnownEffects> at_places; ///< on the modes of the centre
  };
} // namespace squeal
