#pragma once

#include <squeal/assessment/tables.h>
#include <squeal/base/archive.h>
#include <squeal/base/log.h>
#include <squeal/base/state_file.h>
#include <squeal/studies/varied_model.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace squeal
{
  /// What is answered by solving a model at many points, one after the other: a sweep, a stability
  /// map, samples. The base goes from point to point, tells how far it is and what it cost, saves
  /// what an interrupted run goes on from beside the tables, and takes it up again.
  class Study
  {
  public:
    virtual ~Study()                = default;
    Study(const Study &)            = delete;
    Study &operator=(const Study &) = delete;

    /// Begins or goes on, solves all points and gives the parameters their first values back.
    /// Throws InputError, SolverError. Collective.
    void run();

  protected:
    /// How a study and its parts are called.
    struct Names
    {
      std::string study; ///< "sweep": of sweep.state and in messages
      std::string point; ///< "value"
      std::string sought;
      std::vector<std::string> tables; ///< that a resumed run goes on with
    };
    /// @p estimator may be empty: there are no bars of the mesh then.
    Study(const Names &names, ParameterFile &file, const std::vector<std::string> &parameters,
          Model &model, const EigensolverOptions &options, const std::string &directory,
          MPI_Comm comm, Log &log, const ErrorEstimator &estimator);

    virtual unsigned int n_points() const = 0;
    /// Computes what all points need, before an interrupted run is taken up.
    virtual void prepare() {}
    /// Hands over what the run goes on from.
    virtual void visit(Archive &state) = 0;
    /// Goes on from the state that was visited. Returns why it cannot, or nothing.
    virtual std::string take_up() = 0;
    /// Opens the tables, which go on if the run was @p resumed, and tells what begins.
    virtual void open(bool resumed)        = 0;
    virtual void solve(unsigned int point) = 0;
    /// Whether a run can go on from here. If not, the state stays that of an earlier point.
    virtual bool can_be_saved() const
    {
      return true;
    }
    /// Takes note that a point whose state carries no load is left out. Returns whether the study
    /// goes on without it.
    virtual bool leave_out(unsigned int point) = 0;
    virtual void conclude() {}

    void save();
    /// Whether the last state was saved longer ago. The same on all ranks. Collective.
    bool is_state_older_than(std::chrono::seconds age) const;
    std::unique_ptr<Table> table(const std::string &name, const Fields &sample, bool resumed) const
    {
      return std::make_unique<Table>(directory + "/" + name, sample, comm, resumed);
    }
    void tell_full_solutions(const std::string &besides) const;
    /// Takes note of how many modes a point has. Those that have none are no verdict.
    void count_modes(const std::size_t n_modes)
    {
      n_without_modes += n_modes == 0;
    }
    /// What a state is refused for whose numbers are those of another study.
    std::string not_of_this() const
    {
      return names.study + ".state is not of this run.";
    }

    VariedModel varied;
    ModeTracker &tracker;
    const std::string directory;
    const MPI_Comm comm;
    Log &log;
    const ErrorEstimator estimator;
    /// How often a state is saved at most.
    std::chrono::seconds interval{0};
    unsigned int n_done = 0; ///< points

  private:
    bool resume();
    void tell_progress() const;

    using Clock = std::chrono::steady_clock;
    const Names names;
    StateFile state;
    unsigned int n_before        = 0; ///< points done by the run that was interrupted
    unsigned int n_without_modes = 0; ///< points
    Clock::time_point begin      = Clock::now();
    Clock::time_point last_saved = Clock::now();
    bool has_saved               = false; ///< in this run
  };

  /// Counts the modes of the rows of one point.
  struct GrowthSummary
  {
    explicit GrowthSummary(const std::vector<ModeRow> &rows);

    /// A number of modes as a field of a table; empty where there are none, which is no verdict.
    std::string field(const unsigned int n) const
    {
      return worst ? std::to_string(n) : "";
    }

    unsigned int n_unstable  = 0; ///< with the verdict flutter or divergence
    unsigned int n_undecided = 0;
    std::optional<ModeRow> worst; ///< the mode of the largest growth rate
  };
} // namespace squeal
