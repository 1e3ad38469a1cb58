#include <squeal/base/memory.h>

#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

namespace squeal
{
  namespace
  {
    constexpr double unlimited = std::numeric_limits<double>::infinity();

    /// The number after a word at the beginning of a line, in kilobytes.
    double read_kilobytes(const std::string &filename, const std::string &word)
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

    /// Bytes behind words at the beginnings of lines, summed up.
    double sum_of_bytes(const std::string &filename, const std::vector<std::string> &words)
    {
      std::ifstream in(filename);
      std::string word;
      double sum = 0, bytes = 0;
      while (in >> word >> bytes)
        if (std::count(words.begin(), words.end(), word))
          sum += bytes;
      return sum;
    }

    /// The names of a version of control groups.
    struct GroupFiles
    {
      const char *limit, *used;
      std::vector<std::string> file_cache; ///< in memory.stat: pages that can be read again
    };

    /// What a group and those above it leave, each with its own limit. What is used counts the page
    /// cache of files, which the system gives up before it lets anybody go without.
    double left_by_groups_mib(const std::filesystem::path &tree, const std::filesystem::path &group,
                              const GroupFiles &files)
    {
      double left = unlimited;
      // Inside of a container the path is that of the host, and may lead out of the tree
      // ("/../.."); the tree's root is the group then.
      const std::filesystem::path inside = (std::filesystem::path("/") / group).lexically_normal();
      for (std::filesystem::path place = tree / inside.relative_path();;
           place                       = place.parent_path())
      {
        const double limit = read_bytes((place / files.limit).string()),
                     used  = read_bytes((place / files.used).string());
        if (limit < unlimited && used < unlimited)
        {
          const double cache = sum_of_bytes((place / "memory.stat").string(), files.file_cache);
          left = std::min(left, std::max(0., limit - std::max(0., used - cache)) / (1024 * 1024));
        }
        if (place == tree || !place.has_relative_path())
          return left;
      }
    }

    /// Memory that the control groups of this process leave, MiB: versions 2 ("0::/path") and 1
    /// ("7:cpu,memory:/path").
    double available_in_groups_mib(const std::string &root)
    {
      std::ifstream in(root + "/proc/self/cgroup");
      double left = unlimited;
      for (std::string line; std::getline(in, line);)
      {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos)
          continue;
        const std::string controllers    = "," + line.substr(first + 1, second - first - 1) + ",",
                          group          = line.substr(second + 1);
        const std::filesystem::path tree = root + "/sys/fs/cgroup";
        if (controllers == ",,")
          left = std::min(
              left,
              left_by_groups_mib(
                  tree, group, {"memory.max", "memory.current", {"inactive_file", "active_file"}}));
        else if (controllers.find(",memory,") != std::string::npos)
          left = std::min(left, left_by_groups_mib(tree / "memory", group,
                                                   {"memory.limit_in_bytes",
                                                    "memory.usage_in_bytes",
                                                    {"total_inactive_file", "total_active_file"}}));
      }
      return left;
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

  double available_memory_mib(const std::string &root)
  {
    return std::min(read_kilobytes(root + "/proc/meminfo", "MemAvailable:") / 1024,
                    available_in_groups_mib(root));
  }

  double available_address_space_mib()
  {
    rlimit limit{};
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
      return unlimited;
    const double used = read_kilobytes("/proc/self/status", "VmSize:") / 1024;
    return std::max(0., limit.rlim_cur / (1024. * 1024.) - used);
  }

  double memory_load(const double needed_mib, const MPI_Comm comm)
  {
    MPI_Comm machine = MPI_COMM_NULL;
    MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
    double needed    = needed_mib,
           available = std::min(available_memory_mib(), available_address_space_mib());
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
