#pragma once

#include <squeal/continuation/branches.h>
#include <squeal/continuation/carried_errors.h>
#include <squeal/continuation/parameter_study.h>

#include <functional>
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
    /// The shares of the places at a point; the centre has what is left of one.
    using Shares = std::function<std::vector<double>(const Point &)>;

    /// Solves the centre in full. With an estimator effects are estimated there and at the places,
    /// whose modes must continue those of the centre. Throws SolverError, InputError.
    InterpolatedEffects(ParameterStudy &study, const ErrorEstimator &estimator, const Point &centre,
                        const std::vector<Point> &places, const Shares &shares);

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
    KnownEffects at(const Point &point) const;
    /// The same on the modes of the point, of the last solution: those that continue one of the
    /// centre. Fills the branches of @p modes. Collective.
    KnownEffects on(const Point &point, BranchPoint &modes) const;

  private:
    ParameterStudy &study;
    const Shares shares;
    BranchPoint at_centre;
    ModesOnCourse course;
    ErrorEffects effects;
    std::vector<KnownEffects> at_places; ///< on the modes of the centre
  };

  /// Gives the rows of modes the bars that follow from what is known of their effects, and their
  /// verdicts with them. Returns the bounds, in the order of known.modes.
  ErrorBounds set_bars(std::vector<ModeRow> &rows, const EigenPairs &modes,
                       const KnownEffects &known, double tolerance);
} // namespace squeal
