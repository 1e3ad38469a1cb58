#pragma once

#include <squeal/model/brake_model.h>
#include <squeal/run/checkpoint.h>
#include <squeal/run/memory_prediction.h>
#include <squeal/run/refinement.h>
#include <squeal/run/report.h>
#include <squeal/run/wanted.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace squeal
{
  /// The meshes of a run, one made from the other, and the steady state on each.
  ///
  /// The first one is refined where the contact ends, if that is asked for; the others by the error
  /// bars of the modes or everywhere. Elements of a file with polynomials of their own are divided
  /// everywhere only, and before the mesh is made of them. A mesh that is beyond the budget or the
  /// memory is not begun. What an interrupted run has divided is divided again, in the same order.
  /// All are collective.
  template <int dim>
  class MeshSequence
  {
  public:
    /// @p geometry is the scene of the parameters; all others must outlive it.
    MeshSequence(const Geometry<dim> &geometry, const Parameters::All &prm, const Wanted &wanted,
                 Checkpoint &checkpoint, Report &report, const std::string &directory,
                 MPI_Comm comm);

    /// Has the brake on the present mesh. The next mesh may be one of another brake.
    BrakeModel<dim> &model()
    {
      return *model_;
    }
    const BrakeModel<dim> &model() const
    {
      return *model_;
    }

    /// Divides the cells that an interrupted run has divided. Returns the number of its meshes.
    unsigned int resume();
    /// Whether modes are wanted on a mesh of this number.
    bool has(unsigned int cycle) const
    {
      return wanted.meshes && !checkpoint.finished && cycle < prm.refinement.n_cycles();
    }
    /// Numbers the unknowns of the mesh, the first one after it was refined at the contact's edge,
    /// and tells about it. Throws SolverError where memory does not suffice.
    void make(unsigned int cycle);
    /// Makes the mesh that studies are on, unless modes have been found on it.
    void make_last();
    /// The state on the present mesh, from where the pads touched on the mesh before. Throws
    /// SolverError.
    const SteadyState<dim> &find_steady_state();
    /// Predicts what one degree more on the present mesh asks for. Collective.
    NextDegree next_degree() const;
    /// Notes what was found and divides cells for the next mesh, if there is one, or notes that
    /// this is the last; saves how far the run has come.
    void refine(unsigned int cycle, const EigenSolution::Cost &cost,
                const std::vector<ModeRow> &rows, const EigenvalueErrors &errors);

  private:
    /// Divides cells where the static equilibrium says that the contact ends: modes are sensitive
    /// to the place, and it takes no modes to find it.
    void refine_at_contact_edge();
    /// False if the pads touch everywhere, or if the budget does not allow for it.
    bool divide_at_contact_edge(unsigned int level, const SteadyState<dim> &state);
    /// False if nothing is left to refine for, or if the next mesh is beyond the budget.
    bool divide_cells(const std::vector<ModeRow> &rows, const EigenvalueErrors &errors);
    /// Whether the next mesh is made of elements that the file's are divided into.
    bool divides_elements() const;
    /// Makes the brake of elements that have been divided @p times more often than the file's.
    void divide_elements(unsigned int times);
    bool leave_elements_whole(std::vector<double> &by_cell) const;
    /// False if every mode is known well enough.
    bool flag(const std::vector<ModeRow> &rows, const EigenvalueErrors &errors);
    /// Why a mesh that is @p growth times as large must not be begun; empty if it may.
    std::string objection(double growth) const;
    const SteadyState<dim> &find_steady_state(bool with_edge);
    void number_unknowns();
    void need_memory();
    bool predicts_memory() const;
    bool has_other_way() const;
    RunSize size_of_run(double growth = 1) const;

    std::unique_ptr<BrakeModel<dim>> model_;
    const Parameters::All &prm;
    const Wanted &wanted;
    Checkpoint &checkpoint;
    Report &report;
    const std::string directory;
    const MPI_Comm comm;
    RefinementBudget budget;
    bool has_state = false;              ///< the model has that of the mesh to come
    std::optional<unsigned int> present; ///< number of the mesh
  };
} // namespace squeal
