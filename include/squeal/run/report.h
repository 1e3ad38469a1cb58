#pragma once

#include <squeal/assessment/tables.h>
#include <squeal/bars/convergence.h>
#include <squeal/base/log.h>
#include <squeal/base/stopwatch.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/projection/eigenpairs.h>
#include <squeal/run/bar_report.h>
#include <squeal/statics/self_locking.h>
#include <squeal/statics/static_equilibrium.h>
#include <squeal/statics/wear_steps.h>
#include <squeal/statics/worn_pressure.h>
#include <squeal/studies/frequency_response.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace squeal
{
  /// What a run tells: log.txt, the tables that grow from mesh to mesh, the seconds of its phases.
  class Report
  {
  public:
    /// Begins the log, or goes on with that of an interrupted run (@p resumes), whose tables go on
    /// if it had finished a mesh (@p appends). @p called: lines about when and how it was started.
    Report(const Parameters::All &prm, const std::string &directory, MPI_Comm comm,
           const std::string &called, bool resumes, bool appends);

    /// static.csv and a line for each pad. @p equilibrium is null if the pressure is given, @p
    /// locking null if it was not checked.
    void steady_state(unsigned int cycle, const StaticEquilibrium *equilibrium,
                      const std::vector<ContactResultants> &resultants, const SelfLocking *locking);
    /// Lines and warnings about the pressure of worn pads.
    template <int dim>
    void worn_pads(const WornPressure<dim> &worn, const std::vector<ContactResultants> &pads);
    /// wear.csv and a line for each pad.
    void wear(unsigned int cycle, const std::vector<WearStep> &steps);
    /// modes.csv, contributions.csv, and what the screen shows of them. The bars took @p
    /// seconds_of_bars of the processor.
    void modes(unsigned int cycle, const EigenSolution &found, const ModeTable &table,
               double seconds_of_bars);
    /// bars.csv, and what makes up the bars of flutter and undecided modes.
    void bars(unsigned int cycle, const std::vector<ModeRow> &rows,
              const std::vector<BarPart> &parts, const NextDegree &next);
    /// sensitivities.csv.
    void sensitivities(unsigned int cycle, const EigenPairs &modes, const ModeTable &table,
                       const std::vector<ParameterDerivative> &derivatives);
    /// response.csv, and a line for each force and observation; whether modes grow.
    void response(const FrequencyResponse &response, const EigenPairs &modes);
    /// What a mesh took.
    struct Cost
    {
      double seconds, memory_gib; ///< the peak so far
    };
    /// cycles.csv and the table of phases, which begin anew. Collective.
    Cost cycle(unsigned int cycle, std::uint64_t cells, unsigned int dofs, unsigned int multipliers,
               const EigenSolution::Cost &cost);
    /// The seconds of the phases so far and the peak of memory. Collective.
    void phases(const EigenSolution::Cost &cost = {});
    /// ladder.csv: the modes of one stage.
    void stage(const std::string &name, const EigenSolution &found,
               const std::vector<ModeRow> &rows);
    /// The stages side by side.
    void ladder(const std::vector<std::string> &stages,
                const std::vector<std::vector<ModeRow>> &rows);
    /// convergence.csv, convergence.tex and a table of several meshes.
    void convergence(const std::vector<ConvergenceRow> &rows, bool several_meshes);
    void end();

    Log log;
    PhaseTimer timer;

  private:
    /// The table of this name, begun with the columns of @p sample.
    Table &table(const std::string &name, const Fields &sample);
    /// The line of a contact between bodies that do not slide.
    void describe_joint(const ContactResultants &joint, bool computed);
    /// Causes of growth rates, and modes near to coalescence.
    void explain(const ModeTable &table);

    const Parameters::All &prm;
    const std::string directory;
    const MPI_Comm comm;
    const bool appends;
    std::map<std::string, Table> tables;
    Stopwatch of_cycle; ///< since the last line of cycles.csv
  };

  /// Prints what a run would do, for --check.
  std::string describe(const Parameters::All &parameters, const std::string &directory);
} // namespace squeal
