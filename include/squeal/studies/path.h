#pragma once

#include <squeal/base/log.h>
#include <squeal/base/text.h>
#include <squeal/model/model.h>
#include <squeal/reduction/branches.h>
#include <squeal/studies/varied_model.h>

#include <functional>
#include <memory>

namespace squeal
{
  /// Follows the branches of a model's modes along one parameter. Where branches cannot be told
  /// apart the step is halved. A parameter that changes the mesh has a model of its own at each
  /// value: there branches continue by overlaps where the unknowns are the same in number and by
  /// eigenvalues otherwise.
  class Path
  {
  public:
    static constexpr unsigned int max_halvings = 5;

    /// @p make_model serves a parameter that changes the mesh; else it may be empty. Throws
    /// InputError if the equations of motion do not depend on the parameter.
    Path(VariedModel &varied, const ModelFactory &make_model, MPI_Comm comm, Log &log);

    bool keeps_mesh() const
    {
      return keeps_mesh_;
    }

    /// Finds modes and their rows at a value, which belong to no branches yet.
    BranchPoint solve(double value, ModeTracker::Scope scope, bool fully = false);
    /// Begins a branch with each mode.
    static void begin_branches(BranchPoint &point);

    /// Hears of each step, from a point to one whose branches continue its own, while the model is
    /// assembled there, and how the modes turn.
    using OnStep = std::function<void(const BranchPoint &from, const BranchPoint &to,
                                      const std::vector<std::complex<double>> &transition)>;
    /// Continues the branches to a solved point on the same mesh, step by step.
    BranchPoint advance(const BranchPoint &from, BranchPoint to, const OnStep &on_step,
                        ModeTracker::Scope scope = ModeTracker::Scope::window,
                        unsigned int n_halvings  = 0);
    /// Continues them to a point on a mesh of its own. The log says where growth rates change
    /// their signs.
    void advance_on_new_mesh(const BranchPoint &from, BranchPoint &to);

  private:
    void make_mesh(double value);
    /// Whether the rules of the parameters allow a value between two of the sweep: the angular
    /// velocity 0 may be none.
    bool is_allowed(double value);

    VariedModel &varied;
    ModeTracker &tracker;
    const std::string parameter;
    const bool keeps_mesh_;
    const ModelFactory make_model;
    const MPI_Comm comm;
    Log &log;
    std::unique_ptr<Model> own_model; ///< of the present mesh, where the parameter changes it
  };
} // namespace squeal
