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

  /// The largest part of what is available that any machine would need if each rank took
  /// @p needed_mib: above 1 it does not fit. Ranks on one machine share its memory. Collective; the
  /// same on all ranks.
  double memory_load(double needed_mib, MPI_Comm comm);

  /// Makes memory that is freed go back to the system. SuperLU, a library of deal.II's, forbids it
  /// for the whole process as it is loaded (mallopt): then matrices and factors that are gone stay
  /// in the process as holes that the next ones do not fit in. Call it first.
  void return_freed_memory();
} // namespace squeal
