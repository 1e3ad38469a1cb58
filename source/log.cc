#include <squeal/log.h>

#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>

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

  void Log::open(const std::string &filename)
  {
    if (!speaks)
      return;
    file.open(filename);
    file << so_far << std::flush;
    so_far.clear();
  }

  void Log::print(const std::string &text)
  {
    if (!speaks)
      return;
    if (progress_shown)
      std::cout << "\r\033[K";
    progress_shown = false;
    std::cout << text << std::flush;
    if (file.is_open())
      file << text << std::flush;
    else
      so_far += text;
  }

  void Log::progress(const std::string &text)
  {
    if (!speaks || !terminal)
      return;
    std::cout << "\r\033[K" << text << std::flush;
    progress_shown = true;
  }

  void PhaseTimer::add(const std::string &phase, const double seconds)
  {
    phases[phase] += seconds;
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

  double peak_memory_mib(const MPI_Comm comm)
  {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    double mib = usage.ru_maxrss / 1024.; // kilobytes on Linux
    MPI_Allreduce(MPI_IN_PLACE, &mib, 1, MPI_DOUBLE, MPI_SUM, comm);
    return mib;
  }
} // namespace squeal
