#pragma once

#include <squeal/parameters/parameters.h>

#include <mpi.h>

namespace squeal
{
  /// What a run's need of memory depends on.
  struct RunSize
  {
    double n_cells, n_unknowns;
    unsigned int degree, n_ranks = 1;
    double n_modes;
    bool error_bars;
  };

  /// The number of modes below a frequency, Hz, before there is any model: in proportion to the
  /// bending modes of a plate of the rotor's area and thickness.
  double expected_number_of_modes(const Parameters::All &parameters);

  /// Peak resident memory of a run whose eigensolver has factors, MiB, summed over ranks.
  ///
  /// A fit to 27 runs of brakes of 300 to 47 000 unknowns, all within 20 % of it: the libraries on
  /// each rank, the vectors of a search (by unknowns and modes), the cells' matrices, the error
  /// bars' local problems (by cells, and by cells, modes and functions of the next degree).
  double expected_peak_mib(const RunSize &size);

  /// The largest part of what is free on any machine that a run would still take, if the prediction
  /// is too high by as much as it may be: above 1 it does not fit. Collective.
  double expected_memory_load(const RunSize &size, MPI_Comm comm);
} // namespace squeal
