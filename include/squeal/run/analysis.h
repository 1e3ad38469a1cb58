#pragma once

#include <squeal/assessment/tables.h>
#include <squeal/base/log.h>
#include <squeal/base/stopwatch.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/parameters/parameter_file.h>
#include <squeal/run/checkpoint.h>
#include <squeal/run/refinement.h>

#include <memory>

namespace squeal
{
  /// What both kinds of analysis share: where results go, how modes are found and reported.
  class Analysis
  {
  public:
    Analysis(ParameterFile &file, const std::string &directory, MPI_Comm comm);
    virtual ~Analysis() = default;

    /// The whole analysis. Throws InputError, SolverError.
    virtual void run() = 0;

  protected:
    /// Solves, analyses, appends to modes.csv and shows the table.
    void find_modes(const Model &model, unsigned int cycle);
    /// Fills in the errors of the discretisation; without a mesh there are none.
    virtual void estimate(std::vector<ModeRow> &) {}
    EigensolverOptions eigensolver_options();
    /// Finds the modes.
    virtual void solve(const Model &model);
    /// The sweep or the stability map of the parameter file, on the present mesh or, where the
    /// parameter changes it, on meshes of @p make_model.
    void sweep(Model &model, const ModelFactory &make_model);
    /// All stages one after the other (theory.md, section 5): ladder.csv and a table.
    void climb(Model &model);
    /// Appends to cycles.csv.
    void finish_cycle(unsigned int cycle, std::uint64_t cells, unsigned int dofs,
                      unsigned int multipliers);
    void report_phases();
    /// A table of the run, which goes on where an interrupted run has left it.
    std::unique_ptr<Table> table(const std::string &name, const std::string &header);

    ParameterFile &file;
    const Parameters::All &prm;
    const std::string directory;
    const MPI_Comm comm;
    Log log;
    PhaseTimer timer;
    RefinementBudget budget;
    Checkpoint record;
    const bool resumable; ///< results of an interrupted run of the same parameters are there
    Stopwatch of_cycle;   ///< since the last one's line

    EigenSolution found;
    std::vector<ModeRow> rows; ///< of the present cycle

  private:
    void explain_modes(const Model &model, const RayleighParts &rayleigh, unsigned int cycle);
    std::unique_ptr<Table> modes_csv, cycles_csv, contributions_csv, sensitivities_csv;
  };

  /// Prints what a run would do, for --check.
  std::string describe(const Parameters::All &parameters, const std::string &directory);
} // namespace squeal
