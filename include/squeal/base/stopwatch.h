#pragma once

#include <ctime>

namespace squeal
{
  /// Processor seconds of this process, all its threads: what other programs on the machine take is
  /// not in them.
  class Stopwatch
  {
  public:
    /// Since the last call, at first since the beginning.
    double lap()
    {
      const std::clock_t before = start;
      start                     = std::clock();
      return double(start - before) / CLOCKS_PER_SEC;
    }

  private:
    std::clock_t start = std::clock();
  };

  /// Adds the processor seconds of its lifetime.
  class LifetimeSeconds
  {
  public:
    explicit LifetimeSeconds(double &sum) : sum(sum) {}
    ~LifetimeSeconds()
    {
      sum += watch.lap();
    }
    LifetimeSeconds(const LifetimeSeconds &)            = delete;
    LifetimeSeconds &operator=(const LifetimeSeconds &) = delete;

  private:
    double &sum;
    Stopwatch watch;
  };
} // namespace squeal
