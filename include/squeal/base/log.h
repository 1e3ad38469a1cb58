#pragma once

#include <mpi.h>

#include <chrono>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace squeal
{
  /// Whether this is the rank that speaks and writes tables.
  bool is_rank_zero(MPI_Comm comm);

  /// What the screen shows, and the same in log.txt. Only rank 0 speaks. Lines that begin with
  /// "Warning" are kept and stand again at the end of a run.
  class Log
  {
  public:
    explicit Log(MPI_Comm comm);

    /// Everything printed so far and from now on goes to this file too, at the end of what it holds
    /// already with @p append.
    void open(const std::string &filename, bool append = false);

    void print(const std::string &text);
    void line(const std::string &text)
    {
      print(text + "\n");
    }

    /// Prints each warning so far again, once.
    void repeat_warnings();

    /// A line that the next one overwrites; shown on terminals only. Ends the run if a signal has
    /// come: throws Interrupted.
    void progress(const std::string &text);

  private:
    void keep_warnings(const std::string &text);

    const bool speaks, terminal;
    bool progress_shown = false;
    std::vector<std::string> warnings; ///< lines, none of them twice
    std::ofstream file;
    std::string so_far;
  };

  /// Wall-clock seconds by phase, and in which of them this rank's memory peaked.
  class PhaseTimer
  {
  public:
    class Scope
    {
    public:
      Scope(PhaseTimer &timer, const std::string &phase)
          : timer(timer), phase(phase), start(std::chrono::steady_clock::now())
      {
      }
      ~Scope()
      {
        timer.add(phase, seconds_since(start));
      }
      Scope(const Scope &)            = delete;
      Scope &operator=(const Scope &) = delete;

    private:
      PhaseTimer &timer;
      const std::string phase;
      const std::chrono::steady_clock::time_point start;
    };

    static double seconds_since(const std::chrono::steady_clock::time_point start)
    {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }

    void add(const std::string &phase, double seconds);
    double seconds(const std::string &phase) const;
    double total() const
    {
      return seconds_since(start);
    }
    /// The phase at whose end the peak memory had last grown by more than a hundredth.
    const std::string &peak_phase() const
    {
      return peak_phase_;
    }
    /// Forgets the phases and starts the total anew.
    void restart();

  private:
    std::map<std::string, double> phases;
    std::string peak_phase_;
    double peak_mib                             = 0;
    std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
  };
} // namespace squeal
