#include <squeal/base/memory.h>

#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

namespace squeal
{
  namespace
  {
    constexpr double unlimited = std::numeric_limits<double>::infinity();

    /// The number after a word at the beginning of a line, in kilobytes.
    double read_kilobytes(const char *filename, const std::string &word)
    {
      std::ifstream in(filename);
      for (std::string line; std::getline(in, line);)
        if (line.rfind(word, 0) == 0)
          return std::stod(line.substr(word.size()));
      return unlimited;
    }

    /// A file with one number of bytes, or the word max.
    double read_bytes(const std::string &filename)
    {
      std::ifstream in(filename);
      double bytes = 0;
      return in >> bytes ? bytes : unlimited;
    }

    /// Of the control group (version 2, as systemd and containers set it up).
    double available_in_group_mib()
    {
      std::ifstream in("/proc/self/cgroup");
      std::string line, directory = "/sys/fs/cgroup";
      while (std::getline(in, line))
        if (line.rfind("0::", 0) == 0)
          directory += line.substr(3);
      double available = unlimited;
      // Inside of a container the path is that of the host: then the root of the tree is the group.
      for (const std::string &place : {directory, std::string("/sys/fs/cgroup")})
      {
        const double limit = read_bytes(place + "/memory.max"),
                     used  = read_bytes(place + "/memory.current");
        if (limit < unlimited && used < unlimited)
          available = std::min(available, std::max(0., limit - used) / (1024 * 1024));
      }
      return available;
    }
  } // namespace

  double peak_memory_mib(const MPI_Comm comm)
  {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    double mib = usage.ru_maxrss / 1024.; // kilobytes on Linux
    MPI_Allreduce(MPI_IN_PLACE, &mib, 1, MPI_DOUBLE, MPI_SUM, comm);
    return mib;
  }

  double available_memory_mib()
  {
    double available =
        std::min(read_kilobytes("/proc/meminfo", "MemAvailable:") / 1024, available_in_group_mib());
    rlimit limit{};
    if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
    {
      const double used = read_kilobytes("/proc/self/status", "VmSize:") / 1024;
      available         = std::min(available, limit.rlim_cur / (1024. * 1024.) - used);
    }
    return std::max(0., available);
  }

  double memory_load(const double needed_mib, const MPI_Comm comm)
  {
    MPI_Comm machine = MPI_COMM_NULL;
    MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
    double needed = needed_mib, available = available_memory_mib();
    MPI_Allreduce(MPI_IN_PLACE, &needed, 1, MPI_DOUBLE, MPI_SUM, machine);
    MPI_Allreduce(MPI_IN_PLACE, &available, 1, MPI_DOUBLE, MPI_MIN, machine);
    MPI_Comm_free(&machine);
    // Ranks outside of the communicator do the same for another part of the problem
    // (subcommunicator.h).
    int n = 1, n_all = 1;
    MPI_Comm_size(comm, &n);
    MPI_Comm_size(MPI_COMM_WORLD, &n_all);
    double load = needed * n_all / n / std::max(available, 1.);
    MPI_Allreduce(MPI_IN_PLACE, &load, 1, MPI_DOUBLE, MPI_MAX, comm);
    return load;
  }

  void return_freed_memory()
  {
    malloc_trim(0);
  }
} // namespace squeal
