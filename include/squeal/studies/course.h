#pragma once

#include <squeal/base/archive.h>
#include <squeal/studies/critical_search.h>

#include <functional>

namespace squeal
{
  /// Keeps what a sweep found since error effects were estimated last, until the next estimate.
  /// Then effects are carried to all of it from both ends (carried_errors.h), rows and critical
  /// values get their bars, and the course begins anew at its last place.
  class Course
  {
  public:
    /// A place on the way: a value, or one between two where branches are told apart.
    struct Stop
    {
      ModesOnCourse modes;
      std::vector<double> overlaps;
      std::vector<ModeRow> rows;            ///< of a value of the sweep, in the table
      std::vector<double> reduction_errors; ///< of the rows' eigenvalues, 1/s
      std::vector<CriticalValue> critical;  ///< on the way to it
      bool is_value = false;
    };
    using WriteCritical =
        std::function<void(const CriticalValue &critical, const std::optional<CriticalBar> &bar)>;
    using WriteStop = std::function<void(const Stop &)>;

    /// @p write_critical and @p write_stop get what is finished, in the order of the way.
    Course(double tolerance, WriteCritical write_critical, WriteStop write_stop)
        : tolerance(tolerance), write_critical(std::move(write_critical)),
          write_stop(std::move(write_stop))
    {
    }

    /// Begins at a point, which is no value of the table yet.
    void begin(const BranchPoint &point, std::vector<CriticalValue> critical = {});
    /// Adds a place, to which the modes of the one before, @p n_before, turn by @p transition.
    void pass(const BranchPoint &point, std::vector<std::complex<double>> transition,
              unsigned int n_before, std::vector<CriticalValue> critical);
    /// Makes the last place a value with the rows of a point.
    void reach(const BranchPoint &point, std::vector<double> reduction_errors);

    /// Finishes what lies between the last effects and these, which belong to the last place.
    void finish(ErrorEffects here);
    /// Finishes it without bars.
    void finish();
    /// Takes over effects at the place where the course began.
    void keep(ErrorEffects here)
    {
      effects = std::move(here);
    }

    /// Collects what a resumed sweep needs of the values before, or fills it in.
    void visit(Archive &state)
    {
      state(decided);
    }

  private:
    /// A value at which the growth rate of a branch has a sign beyond its bar.
    struct Decided
    {
      double value        = 0;
      unsigned int branch = 0;
      bool grows          = false;

      friend void serialize(Archive &archive, Decided &decided)
      {
        archive(decided.value, decided.branch, decided.grows);
      }
    };
    void write(const std::vector<KnownEffects> &known);
    /// Notes the growth rates of a value that have a sign beyond their bars.
    void note_decided(const Stop &stop);
    /// Keeps the bar of an onset or an end within the values nearest to it at which the rates' own
    /// bars say that the branch is stable, and that it grows.
    std::optional<CriticalBar> limited(std::optional<CriticalBar> bar,
                                       const CriticalValue &critical) const;
    std::optional<CriticalBar> bar_of(const CriticalValue &critical, unsigned int stop,
                                      const std::vector<KnownEffects> &known) const;

    const double tolerance;
    const WriteCritical write_critical;
    const WriteStop write_stop;
    std::vector<Stop> stops;
    std::optional<ErrorEffects> effects; ///< at the first of them
    std::vector<Decided> decided;
  };
} // namespace squeal
