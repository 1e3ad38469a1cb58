#pragma once

#include <squeal/mesh/own_elements.h>
#include <squeal/parameters/parameters.h>

#include <mpi.h>

namespace squeal
{
  template <int dim>
  class FiniteElementSpace;

  /// What a run's need of memory depends on.
  struct RunSize
  {
    double n_cells, n_unknowns;
    unsigned int degree, n_ranks = 1;
    double n_modes;
    bool error_bars;
    ModeSolver solver = ModeSolver::block_krylov;
    bool is_halved    = true; ///< in parity sectors, so that factors are those of a half
    /// Cells of elements with own polynomials; in n_cells such elements count as cells with as many
    /// entries in their matrices.
    double n_cells_of_elements = 0;
  };

  /// A rotor as a plate: area, m^2, and thickness, m.
  struct Plate
  {
    double area, thickness;
  };

  /// Elements with own polynomials as a number of cells of that degree with as many entries.
  double cells_like(const OwnElements &elements, unsigned int degree);

  /// The plate with the volume of a rotor between two radii, m, and half of its surface, m^2, or
  /// the annulus, whichever is less: a rotor beside the axis is no ring, a hat has more surface
  /// than the ring that it rises from.
  Plate plate_like(double inner, double outer, double surface, double volume);
  /// The plate like the rotor of a mesh; without area for the strip. Collective.
  template <int dim>
  Plate plate_like_rotor(const FiniteElementSpace<dim> &spaces);

  /// The number of modes below a frequency, Hz, before there is any model: in proportion to the
  /// bending modes of such a plate.
  double expected_number_of_modes(const Parameters::All &parameters, const Plate &rotor);

  /// Peak resident memory of a run in three dimensions, MiB, summed over ranks.
  ///
  /// With factors the larger one of two phases: that of the error bars, a fit to 27 runs of brakes
  /// of 300 to 47 000 unknowns (the libraries on each rank, the vectors of a search, by unknowns
  /// and modes, the cells' matrices, the error bars' local problems, by cells, modes and functions
  /// of the next degree), and that of the eigenproblem, a fit to five runs of 69 000 to 108 000
  /// unknowns (the cells' matrices and the factors). Without factors (block_davidson): vectors.
  /// Without modes: unknowns and the cells' matrices of a direct solution.
  double expected_peak_mib(const RunSize &size);

  /// The largest part of what is free on any machine that a run would still take, if the prediction
  /// is too high by as much as it may be: above 1 it does not fit. Collective.
  double expected_memory_load(const RunSize &size, MPI_Comm comm);
} // namespace squeal
