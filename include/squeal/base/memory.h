#pragma once

#include <mpi.h>

namespace squeal
{
  /// Peak resident memory so far, summed over ranks, MiB.
  double peak_memory_mib(MPI_Comm comm);

  /// What this process may still take, MiB: the machine's memory that is free or can be made so,
  /// within the limits of the control group and of the process (RLIMIT_AS); infinite where the
  /// system does not say.
  double available_memory_mib();

  /// The largest part of what is available that any machine would need if each rank, also outside
  /// of the communicator, took
  /// @p needed_mib: above 1 it does not fit. Ranks on one machine share its memory. Collective; the
  /// same on all ranks.
  double memory_load(double needed_mib, MPI_Comm comm);

  /// Gives memory that was freed back to the system. The C library does not do so by itself, not
  /// even for large matrices: SuperLU, loaded with deal.II, forbids it to the whole process
  /// (mallopt). Worth it after a phase, before others need much: pages that come back cost
  /// microseconds each.
  void return_freed_memory();
} // namespace squeal
