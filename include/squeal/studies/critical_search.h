#pragma once

#include <squeal/assessment/error_bounds.h>
#include <squeal/bars/carried_errors.h>
#include <squeal/base/log.h>
#include <squeal/reduction/branches.h>
#include <squeal/studies/varied_model.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace squeal
{
  /// A value of a parameter at which something happens, on one branch or between two.
  struct CriticalValue
  {
    std::string kind; ///< onset, end, coalescence, divergence, divergence_end
    double value        = 0;
    double search_error = 0, reduction_error = 0; ///< of the root, of the eigenvalues there
    std::complex<double> lambda;
    int branch = -1, other = -1;
    unsigned int iterations = 0;

    /// For the bar: the modes at or beside the value, the number of this one among them, and the
    /// real part of its dl/dp.
    ModesOnCourse modes;
    unsigned int mode = 0;
    double slope      = 0;
    CriticalModes between;  ///< of a step
    bool is_at_end = false; ///< it is at the end of a step itself, whose modes these are
    std::optional<KnownEffects> effects = {}; ///< on the modes, where none can be carried to them

    double accuracy() const
    {
      return search_error + reduction_error;
    }
  };

  /// Locates critical values between two points of a path whose branches are told apart.
  class CriticalSearch
  {
  public:
    /// With an @p estimator critical values have what their bars need. Model, estimator and log
    /// must live longer.
    CriticalSearch(VariedModel &varied, const ErrorEstimator &estimator, Log &log)
        : varied(varied), tracker(varied.tracker), estimator(estimator), log(log)
    {
    }

    /// All between two points and at the second one, at which the model is assembled. Throws
    /// SolverError. Collective.
    std::vector<CriticalValue> between(const BranchPoint &from, const BranchPoint &to);
    /// Onsets and ends at a point itself, at which the model is assembled: Re l = 0 there up to
    /// rounding, and dl/dp takes it across. @p before is the point before or null.
    std::vector<CriticalValue> at(const BranchPoint &point, const BranchPoint *before,
                                  double direction);

  private:
    /// Numbers of divergent_modes() that all steps see.
    std::vector<unsigned int> divergent_in_disc(const BranchPoint &point) const;
    bool grows_beyond_disc(const std::complex<double> &lambda) const;
    /// Onsets on a branch and its coalescences with later ones.
    void search_branch(const BranchPoint &from, const BranchPoint &to, unsigned int i,
                       bool has_divergence, std::vector<CriticalValue> &found);
    /// det Q = 0 where a real eigenvalue that grows comes or goes.
    std::optional<CriticalValue> divergence(const BranchPoint &from, const BranchPoint &to);
    /// Estimates the effects on a divergence, by the real mode with this eigenvalue at a value
    /// nearby: at this share of the way there. Returns whether the mode is known there.
    bool find_effects(double value, std::complex<double> lambda, double share,
                      CriticalValue &divergence);
    /// Solves Re l = 0 on a branch.
    CriticalValue onset(const BranchPoint &from, const BranchPoint &to, unsigned int branch);
    /// Solves ((l_i - l_j)/2)^2 = 0 by Newton's method: this is smooth where the eigenvalues
    /// themselves are not.
    CriticalValue coalescence(const BranchPoint &from, const BranchPoint &to, unsigned int branch,
                              unsigned int other);
    /// Keeps what the bar of a critical value needs of the modes there.
    void keep_modes(const BranchPoint &from, const VariedModel::Evaluation &at, double value,
                    CriticalValue &critical) const;

    VariedModel &varied;
    ModeTracker &tracker;
    const ErrorEstimator &estimator;
    Log &log;
  };
} // namespace squeal
