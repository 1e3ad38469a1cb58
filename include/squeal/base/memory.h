#pragma once

#include <mpi.h>

#include <string>

namespace squeal
{
  /// Peak resident memory so far, summed over ranks, MiB.
  double peak_memory_mib(MPI_Comm comm);

  /// Memory of the machine that is free or can be made so, MiB, within the limits of the control
  /// groups of this process (versions 1 and 2) and of those above them; infinite where the system
  /// does not say. @p root: the directory in which /proc and /sys stand.
  double available_memory_mib(const std::string &root = "");

  /// What the limit of this process' address space (RLIMIT_AS) leaves, MiB; infinite without one.
  double available_address_space_mib();

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
