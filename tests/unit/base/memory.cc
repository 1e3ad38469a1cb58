#include <squeal/base/memory.h>

#include <doctest/doctest.h>

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
namespace squeal::tests::memory_tests
{
  namespace
  {
    constexpr double mib = 1024 * 1024;

    /// A directory in which /proc and /sys of a made-up machine with 8 GiB stand.
    struct Machine
    {
      Machine()
          : root(std::filesystem::temp_directory_path() /
                 ("squeal-machine-" + std::to_string(getpid())))
      {
        std::filesystem::remove_all(root);
        write("proc/meminfo", "MemTotal: 16777216 kB\nMemAvailable:    8388608 kB\n");
      }
      ~Machine()
      {
        std::filesystem::remove_all(root);
      }
      void write(const std::string &name, const std::string &text) const
      {
        std::filesystem::create_directories((root / name).parent_path());
        std::ofstream(root / name) << text;
      }
      double available() const
      {
        return available_memory_mib(root.string());
      }
      /// A group of version 2.
      void limit(const std::string &group, const double limit_mib, const double used_mib,
                 const double cache_mib) const
      {
        const std::string place = "sys/fs/cgroup" + group + "/memory.";
        write(place + "max", limit_mib > 0 ? text_of_mib(limit_mib) : "max\n");
        write(place + "current", text_of_mib(used_mib));
        write(place + "stat", "anon 17\ninactive_file " + text_of_mib(cache_mib / 4) +
                                  "active_file " + text_of_mib(3 * cache_mib / 4) + "shmem 5\n");
      }
      static std::string text_of_mib(const double value)
      {
        return std::to_string(static_cast<long long>(value * mib)) + "\n";
      }
      const std::filesystem::path root;
    };
  } // namespace

  TEST_CASE("memory: without control groups it is what the machine has")
  {
    const Machine machine;
    CHECK(machine.available() == 8192);
    // A system that says nothing.
    std::filesystem::remove_all(machine.root / "proc");
    CHECK(std::isinf(machine.available()));
  }

  TEST_CASE("memory: the page cache of a control group (version 2) can be taken")
  {
    const Machine machine;
    machine.write("proc/self/cgroup", "0::/user/job\n");
    machine.limit("/user/job", 1000, 900, 0);
    CHECK(machine.available() == 100);
    // 1000 - (900 - 800)
    machine.limit("/user/job", 1000, 900, 800);
    CHECK(machine.available() == 900);
    machine.limit("/user/job", 0, 900, 800);
    CHECK(machine.available() == 8192);
  }

  TEST_CASE("memory: the limits of the groups above count")
  {
    const Machine machine;
    machine.write("proc/self/cgroup", "0::/user/job/step\n");
    machine.limit("/user/job/step", 0, 100, 0);
    machine.limit("/user/job", 2000, 500, 100); // 1600
    machine.limit("/user", 1500, 1200, 0);      // 300
    CHECK(machine.available() == 300);
    machine.limit("/user", 15000, 1200, 0);
    CHECK(machine.available() == 1600);
  }

  TEST_CASE("memory: inside of a container the root of the tree is the group")
  {
    const Machine machine;
    machine.write("proc/self/cgroup", "0::/../../docker/1234\n");
    machine.limit("", 700, 200, 50);
    CHECK(machine.available() == 550);
  }

  TEST_CASE("memory: control groups of version 1")
  {
    const Machine machine;
    machine.write("proc/self/cgroup",
                  "12:cpuset:/\n7:cpu,memory:/batch/job 7\n1:name=systemd:/batch\n");
    const std::string place = "sys/fs/cgroup/memory/batch/";
    machine.write(place + "job 7/memory.limit_in_bytes", "9223372036854771712\n"); // none
    machine.write(place + "job 7/memory.usage_in_bytes", Machine::text_of_mib(300));
    CHECK(machine.available() == 8192);
    machine.write(place + "memory.limit_in_bytes", Machine::text_of_mib(1000));
    machine.write(place + "memory.usage_in_bytes", Machine::text_of_mib(800));
    CHECK(machine.available() == 200);
    machine.write(place + "memory.stat", "cache 1\ninactive_file 7\ntotal_inactive_file " +
                                             Machine::text_of_mib(300) + "total_active_file " +
                                             Machine::text_of_mib(100));
    CHECK(machine.available() == 600);
  }
} // namespace squeal::tests::memory_tests
