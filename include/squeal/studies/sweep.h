#pragma once

#include <squeal/studies/course.h>
#include <squeal/studies/critical_search.h>
#include <squeal/studies/path.h>
#include <squeal/studies/study.h>

namespace squeal
{
  /// Follows the modes of a model along one parameter and, if asked for, locates critical values.
  ///
  /// Points near an expansion point, a value with a full solution, are solved by projection. Tables
  /// are on disk after each point. A sweep that was killed resumes after its last full solution,
  /// which with the parameters determines all that follows: the tables become the same to the last
  /// digit.
  ///
  /// With an estimator, every row and every critical value has the bar of the mesh. The effects of
  /// the discretisation are estimated at the full solutions and at the last value, and carried to
  /// what lies between two of them (Course); the rows between are written then.
  ///
  /// Where the parameter changes the mesh (Path), critical values are only bracketed.
  class Sweep : public Study
  {
  public:
    /// @p make_model serves parameters that change the mesh; it may be empty.
    Sweep(ParameterFile &file, Model &model, const ModelFactory &make_model,
          const EigensolverOptions &options, const std::string &directory, MPI_Comm comm, Log &log,
          const ErrorEstimator &estimator = {});

  private:
    unsigned int n_points() const override
    {
      return values.size();
    }
    void visit(Archive &state) override
    {
      state(last.value, last.n_branches, last.branches, last.overlaps, varying_terms);
      course.visit(state);
    }
    std::string take_up() override;
    void open(bool resumed) override;
    void solve(unsigned int point) override;
    bool leave_out(const unsigned int point) override
    {
      return has_begun || point + 1 < values.size();
    }
    bool can_be_saved() const override
    {
      return tracker.is_whole(last.modes);
    }
    void conclude() override;

    /// Solves a value and continues the branches to it.
    void advance(unsigned int point);
    /// Solves a value, in full if bars are to be estimated there, or if so much time has passed
    /// since the state was saved: a sweep can be resumed from a full solution alone.
    BranchPoint solve_value(double value);
    /// Whether bars are estimated at the value, which takes a full solution: at the last one, and
    /// of many values also halfway. Projected vectors are good to what eigenvalues need, whose
    /// errors are of second order in them, not to what bars do.
    bool wants_bars(double value) const;
    /// Whether so many contacts have opened or closed since bars were estimated that they are to be
    /// estimated again: effects are carried from one contact zone to another only roughly.
    bool are_effects_of_another_contact() const;
    /// Makes the last point, if it was solved fully, the new expansion point. After a projection it
    /// keeps the bases small.
    void settle();
    /// Estimates the effects of the discretisation on the last point.
    ErrorEffects estimate_errors();
    void write(const Course::Stop &stop);
    void write(const CriticalValue &critical, const std::optional<CriticalBar> &bar);
    Fields critical_fields(const CriticalValue &critical,
                           const std::optional<CriticalBar> &bar) const;

    const std::string parameter;
    const std::vector<double> values;
    const bool wants_critical_values;
    Path path;
    CriticalSearch search;
    Course course;
    std::unique_ptr<Table> sweep_csv, critical_csv;
    bool has_begun = false;                    ///< at a value that carries a load
    BranchPoint last;                          ///< the last value
    std::vector<double> varying_terms;         ///< of the last expansion point
    unsigned int n_constraints_of_effects = 0; ///< that held where bars were estimated last
  };
} // namespace squeal
