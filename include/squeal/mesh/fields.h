#pragma once

#include <squeal/linalg/complex_multi_vector.h>

#include <complex>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

namespace squeal
{
  template <int dim>
  class FiniteElementSpace;

  /// Writes the pieces of all ranks, <base>.<rank>.vtu (<base>.vtu of a single one), and
  /// <base>.pvtu, which names them and whose name is returned. Collective.
  std::string write_pieces(
      const std::string &directory, const std::string &base, MPI_Comm comm,
      const std::function<void(std::ostream &)> &write_vtu,
      const std::function<void(std::ostream &, const std::vector<std::string> &)> &write_pvtu);

  /// mode-<cycle>-<mode>, what the names of a mode's files begin with.
  std::string mode_file(unsigned int cycle, unsigned int mode);

  /// The directory of animations' frames, in that of the results.
  std::string frames_directory();

  /// Writes the static state (one column of displacements, m, and multipliers) as
  /// state-<cycle>.pvtu.
  /// @p pressure_scale turns multipliers into pressures, Pa; the field is left out without
  /// multipliers.
  template <int dim>
  void write_state(const FiniteElementSpace<dim> &spaces, const MultiVector &state,
                   double pressure_scale, const std::string &directory, unsigned int cycle);

  /// Writes one mode: mode-<cycle>-<mode>.pvtu with Re and Im of the displacement (and the contact
  /// pressure's amplitude), and an animation over one period as
  /// frames/mode-<cycle>-<mode>-frame-*.pvtu with a mode-<cycle>-<mode>.pvd that ParaView plays;
  /// its time is in periods. The mode is scaled so that its largest displacement is 1.
  template <int dim>
  void write_mode(const FiniteElementSpace<dim> &spaces, const ComplexMultiVector &modes,
                  unsigned int column, double pressure_scale, const std::string &directory,
                  unsigned int cycle, unsigned int mode, unsigned int n_frames);
} // namespace squeal
