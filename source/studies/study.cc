#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/parameters/plausibility.h>
#include <squeal/studies/study.h>

namespace squeal
{
  Study::Study(const Names &names, ParameterFile &file, const std::vector<std::string> &parameters,
               Model &model, const EigensolverOptions &options, const std::string &directory,
               const MPI_Comm comm, Log &log, const ErrorEstimator &estimator)
      : varied(file, parameters, options, names.sought), tracker(varied.tracker),
        directory(directory), comm(comm), log(log), estimator(estimator), names(names),
        state(directory, names.study, names.tables)
  {
    tracker.set_model(model);
  }

  void Study::run()
  {
    prepare();
    const bool resumed = resume();
    open(resumed);
    n_before = n_done;
    begin    = Clock::now();
    while (n_done < n_points())
    {
      tell_progress();
      try
      {
        solve(n_done);
      }
      catch (const NoLoad &error)
      {
        if (!leave_out(n_done))
          throw;
        ++n_done;
        log.line(text_of("Warning, left out: ", names.point, " ", n_done, ". ", error.what()));
        continue; // the state stays that of the point before
      }
      ++n_done;
      if (can_be_saved() && (!has_saved || is_state_older_than(interval)))
        save();
    }
    conclude();
    varied.restore();
    if (n_without_modes > 0)
      log.line(
          no_modes(varied.file.parameters().eigenproblem,
                   text_of("at ", n_without_modes, " of ", n_points(), " ", names.point, "s")));
    const ModeTracker::Seconds &seconds = tracker.seconds();
    log.line(formatted("  Processor seconds: contact and static states %.1f, counting %.1f, "
                       "projection %.1f, full solutions %.1f",
                       seconds.assembly, seconds.counting, seconds.projection, seconds.full) +
             (estimator ? formatted(", error bars %.1f.", seconds.bars) : "."));
    state.remove(comm);
  }

  void Study::save()
  {
    Archive archive;
    archive(n_done, n_without_modes);
    visit(archive);
    state.save(archive.numbers(), comm);
    last_saved = Clock::now();
    has_saved  = true;
  }

  bool Study::resume()
  {
    const std::optional<std::vector<double>> numbers = state.resume(comm);
    if (!numbers)
      return false;
    Archive untouched;
    visit(untouched);
    std::string objection = not_of_this();
    try
    {
      Archive archive(*numbers);
      archive(n_done, n_without_modes);
      visit(archive);
      if (archive.is_used_up() && n_done > 0 && n_done <= n_points())
        objection = take_up();
    }
    catch (const Archive::Damaged &)
    {
    }
    if (objection.empty())
    {
      log.line(text_of("Resumed after ", n_done, " of ", n_points(), " ", names.point, "s."));
      return true;
    }
    n_done = n_without_modes = 0;
    Archive again(untouched.numbers());
    visit(again);
    log.line("What was interrupted is not resumed, it begins anew: " + objection);
    return false;
  }

  bool Study::is_state_older_than(const std::chrono::seconds age) const
  {
    int is_old = Clock::now() - last_saved > age;
    MPI_Bcast(&is_old, 1, MPI_INT, 0, comm);
    return is_old;
  }

  void Study::tell_progress() const
  {
    std::string text = text_of("  ", names.point, " ", n_done + 1, " of ", n_points());
    if (n_done > n_before)
      text += formatted(", about %.0f s to go", PhaseTimer::seconds_since(begin) /
                                                    (n_done - n_before) * (n_points() - n_done));
    log.progress(text);
  }

  void Study::tell_full_solutions(const std::string &besides) const
  {
    log.line(text_of("  ", tracker.n_full_solutions(), " full solutions for ", n_done - n_before,
                     " ", names.point, "s", besides, "; bases were restarted ",
                     tracker.n_restarts(), " times."));
  }

  GrowthSummary::GrowthSummary(const std::vector<ModeRow> &rows)
  {
    for (const ModeRow &row : rows)
    {
      n_unstable += row.is_unstable();
      n_undecided += row.verdict == Verdict::undecided;
      if (!worst || row.growth_rate() > worst->growth_rate())
        worst = row;
    }
  }
} // namespace squeal
