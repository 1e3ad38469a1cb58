#include <squeal/base/log.h>
#include <squeal/base/memory.h>
#include <squeal/base/signals.h>

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <stdexcept>

namespace squeal
{
  bool is_rank_zero(const MPI_Comm comm)
  {
    int rank = 0;
    MPI_Comm_rank(comm, &rank);
    return rank == 0;
  }

  // mpirun pretends to be a terminal even where its own output goes to a file.
  Log::Log(const MPI_Comm comm)
      : speaks(is_rank_zero(comm)),
        terminal(isatty(STDOUT_FILENO) && !std::getenv("OMPI_COMM_WORLD_RANK"))
  {
  }

  void Log::open(const std::string &filename, const bool append)
  {
    if (!speaks)
      return;
    file.open(filename, append ? std::ios::app : std::ios::out);
    file << so_far << std::flush;
    so_far.clear();
  }

  void Log::keep_warnings(const std::string &text)
  {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
      if (line.rfind("Warning", 0) == 0 &&
          std::find(warnings.begin(), warnings.end(), line) == warnings.end())
        warnings.push_back(line);
  }

  void Log::repeat_warnings()
  {
    std::string text;
    for (const std::string &warning : warnings)
      text += warning + "\n";
    if (!text.empty())
      print("\n" + text);
  }

  void Log::print(const std::string &text)
  {
    if (!speaks)
      return;
    keep_warnings(text);
    if (progress_shown)
      std::cout << "\r\033[K";
    progress_shown = false;
    std::cout << text << std::flush;
    if (!file.is_open())
      so_far += text;
    else if (!(file << text << std::flush))
      throw std::runtime_error(
          "log.txt cannot be written; is the disk full? Results so far are kept.");
  }

  void Log::progress(const std::string &text)
  {
    check_interruption();
    if (!speaks || !terminal)
      return;
    std::cout << "\r\033[K" << text << std::flush;
    progress_shown = true;
  }

  void PhaseTimer::add(const std::string &phase, const double seconds)
  {
    phases[phase] += seconds;
    if (const double peak = peak_memory_mib(MPI_COMM_SELF); peak > 1.01 * peak_mib)
    {
      peak_mib    = peak;
      peak_phase_ = phase;
    }
  }

  double PhaseTimer::seconds(const std::string &phase) const
  {
    const auto found = phases.find(phase);
    return found == phases.end() ? 0 : found->second;
  }

  void PhaseTimer::restart()
  {
    phases.clear();
    start = std::chrono::steady_clock::now();
  }
} // namespace squeal
