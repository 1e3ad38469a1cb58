#pragma once

#include <squeal/assessment/tables.h>
#include <squeal/bars/carried_errors.h>
#include <squeal/studies/parameter_study.h>

#include <chrono>
#include <memory>
#include <optional>

namespace squeal
{
  /// Follows the modes of a model along one parameter and, if asked for, locates critical values.
  ///
  /// Points near an expansion point, a value with a full solution, are solved by projection. Where
  /// branches cannot be told apart the step is halved, up to max_halvings times. Tables are on disk
  /// after each point. A sweep that was killed resumes after its last full solution, which with the
  /// parameters determines all that follows: the tables become the same to the last digit.
  ///
  /// With an estimator, every row and every critical value has the bar of the mesh. The effects of
  /// the discretisation are estimated at the full solutions and at the last value, and carried to
  /// what lies between two of them (carried_errors.h); the rows between are written then.
  ///
  /// A parameter of the geometry or the discretisation changes the mesh: each point then has a
  /// model of its own, branches continue by overlaps where the unknowns are the same in number and
  /// by eigenvalues otherwise, and critical values are only bracketed.
  class Sweep
  {
  public:
    static constexpr unsigned int max_halvings = 5;

    /// @p make_model serves parameters that change the mesh; it may be empty, and so may
    /// @p estimator, without which there are no bars.
    Sweep(ParameterFile &file, Model &model, const ModelFactory &make_model,
          const EigensolverOptions &options, const std::string &directory, MPI_Comm comm, Log &log,
          const ErrorEstimator &estimator = {});

    /// Throws InputError, SolverError.
    void run();

  private:
    /// A value at which something happens, on one branch or between two.
    struct Critical
    {
      std::string kind; ///< onset, end, coalescence, divergence, divergence_end
      double value        = 0;
      double search_error = 0, reduction_error = 0; ///< of the root, of the eigenvalues there
      std::complex<double> lambda;
      int branch = -1, other = -1;
      unsigned int iterations = 0;

      /// For the bar: the modes at or beside the value, the number of this one among them, and
      /// the real part of its dl/dp.
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

    /// A place on the way: a value, or one between two where branches are told apart.
    struct Stop
    {
      ModesOnCourse modes;
      std::vector<double> overlaps;
      std::vector<ModeRow> rows;
      std::vector<double> reduction_errors;   ///< of the rows' eigenvalues, 1/s
      bool is_value                  = false; ///< it has rows in the table
      std::vector<Critical> critical = {};    ///< on the way to it
    };

    /// Modes, rows and branches at a value; those of @p before, if any, go on. Returns whether they
    /// do without doubt.
    bool solve(double value, const BranchPoint *before, BranchPoint &point,
               ModeTracker::Scope scope, bool fully = false);
    /// Whether so much time has passed since the state was saved that the next value should be
    /// solved in full, from which alone a sweep can be resumed.
    bool is_state_old() const;
    /// Whether bars are estimated at the value, which takes a full solution: at the last one, and
    /// of many values also halfway. Projected vectors are good to what eigenvalues need, whose
    /// errors are of second order in them, not to what bars do.
    bool wants_bars(double value) const;
    /// Whether so many contacts have opened or closed since bars were estimated that they are to be
    /// estimated again: effects are carried from one contact zone to another only roughly.
    bool are_effects_of_another_contact() const;
    void make_mesh(double value);
    /// Whether the rules of the parameters allow a value between two of the sweep: the angular
    /// velocity 0 may be none.
    bool is_allowed(double value);
    /// From a point to a value: branches continued, critical values in between located. What is
    /// known of a value that was solved in full is not computed again.
    BranchPoint advance(const BranchPoint &from, double value, ModeTracker::Scope scope,
                        unsigned int n_halvings = 0, std::optional<BranchPoint> known = {});
    /// Whether steps of Scope::disc do not see the mode.
    bool grows_beyond_disc(const std::complex<double> &lambda) const;
    /// Numbers of divergent_modes() that all steps see.
    std::vector<unsigned int> divergent_in_disc(const BranchPoint &point) const;
    BranchPoint advance_on_new_mesh(const BranchPoint &from, double value);
    /// How the modes turn into those of the next point, which continue their branches. Returns
    /// whether they do without doubt.
    bool continue_branches(const BranchPoint &from, BranchPoint &to);
    /// Adds a place to the way, to which the modes of the one before turn like this.
    void pass(const BranchPoint &point, std::vector<std::complex<double>> from_before,
              unsigned int n_before);
    /// The last place is a value of the sweep, with these rows. Without an estimator they are
    /// written.
    void reach(const BranchPoint &point);
    /// Estimates the effects of the discretisation on a point and writes what lies before it.
    void estimate_errors(const BranchPoint &point);
    /// Effects of the present parameters, from which the course goes on.
    void keep_effects(ErrorEffects found);
    /// Writes all places after the first one; @p known is empty where effects are not.
    void write_course(const std::vector<KnownEffects> &known);
    void write(const Stop &stop);
    void write(const Critical &critical, const std::optional<CriticalBar> &bar);
    std::optional<CriticalBar> bar_of(const Critical &critical, unsigned int stop,
                                      const std::vector<KnownEffects> &known) const;
    std::vector<ModesOnCourse> course() const;
    /// How far it is and how long it will take.
    void tell_progress(unsigned int k, unsigned int n_before);
    bool resume(BranchPoint &last, unsigned int &n_done);
    /// Makes a point that was solved fully the new expansion point, and saves it. After a
    /// projection it keeps the bases small.
    void settle(BranchPoint &point);

    void find_critical_values(const BranchPoint &from, const BranchPoint &to);
    /// Onsets and ends at a point itself, whose operators are the present ones: Re l = 0 there up
    /// to rounding, and dl/dp takes it across. @p before is the point before or null.
    void find_critical_values_at(const BranchPoint &point, const BranchPoint *before,
                                 double direction);
    /// det Q = 0 where a real eigenvalue that grows comes or goes.
    void find_divergence(const BranchPoint &from, const BranchPoint &to);
    /// The effects on it, by the real mode with this eigenvalue at a value nearby: at this share of
    /// the way there. Returns whether the mode is known there.
    bool find_effects(double value, std::complex<double> lambda, double share,
                      Critical &divergence);
    /// Re l = 0 on a branch.
    Critical onset(const BranchPoint &from, const BranchPoint &to, unsigned int branch);
    /// ((l_i - l_j)/2)^2 = 0 by Newton's method: this is smooth where the eigenvalues themselves
    /// are not.
    Critical coalescence(const BranchPoint &from, const BranchPoint &to, unsigned int branch,
                         unsigned int other);
    Fields critical_fields(const Critical &critical, const std::optional<CriticalBar> &bar) const;
    void report(Critical critical);
    /// What the bar of a critical value needs of the modes there.
    void keep_modes(const BranchPoint &from, const ParameterStudy::Evaluation &at, double value,
                    Critical &critical);
    void walk(BranchPoint &last, unsigned int n_done);

    const std::string parameter;
    const bool keeps_mesh;
    const ModelFactory make_model;
    std::unique_ptr<Model> own_model; ///< of the present mesh, where the parameter changes it
    ParameterStudy study;
    ModeTracker &tracker;
    const std::vector<double> values;
    const bool wants_critical_values;
    Log &log;
    const ErrorEstimator estimator;
    std::unique_ptr<Table> sweep_csv, critical_csv;
    std::vector<Stop> stops;                      ///< since the last estimate
    std::vector<Critical> located;                ///< since the last of them
    std::optional<ErrorEffects> effects;          ///< at the first of them
    unsigned int n_constraints_of_effects = 0;    ///< that held there
    std::vector<std::complex<double>> transition; ///< of the last call of continue_branches()
    const std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
    std::chrono::steady_clock::time_point last_saved  = std::chrono::steady_clock::now();
  };
} // namespace squeal
