#pragma once

#include <squeal/assessment/tables.h>

#include <complex>
#include <optional>
#include <string>
#include <vector>

namespace squeal
{
  /// One mode on one mesh of a study.
  struct ConvergenceRow
  {
    ModeRow mode;
    unsigned int number = 0; ///< of the mode on the finest mesh
    unsigned int dofs   = 0;
    /// |l - l of the mesh before| / |l|, and the order in the mesh size of the last two changes.
    std::optional<double> change, rate;
    /// Limits of Re l, 1/s, and |Im l|/(2 pi), Hz, by extrapolation.
    std::optional<double> extrapolated_growth_rate, extrapolated_frequency;
    std::optional<std::complex<double>> reference;
  };

  /// The modes of the finest mesh over all meshes, paired by match_modes(), and with the
  /// eigenvalues
  /// @p reference (none if empty).
  ///
  /// @p mesh_sizes are up to a common factor. A quantity x = x* + C h^q has
  ///     (x0 - x1)/(x1 - x2) = (h0^q - h1^q)/(h1^q - h2^q),   x* = x2 + (x2 - x1) h2^q/(h1^q -
  ///     h2^q)
  /// (Richardson; with a constant ratio of the sizes, Aitken). It is extrapolated where its own q
  /// is one that eigenvalues of degree @p degree can have, 1/2 <= q <= 2 degree + 1/2, and stable:
  /// within a third of that of the meshes before, or, with three meshes, of that of |l|.
  std::vector<ConvergenceRow> convergence_rows(const std::vector<std::vector<ModeRow>> &cycles,
                                               const std::vector<unsigned int> &dofs,
                                               const std::vector<double> &mesh_sizes,
                                               unsigned int degree,
                                               const std::vector<std::complex<double>> &reference);

  /// The order q of three values, from @p ratio = (x0 - x1)/(x1 - x2) and the sizes of the meshes;
  /// empty where there is none, or none between 0 and 30.
  std::optional<double> observed_order(double ratio, double h0, double h1, double h2);

  /// A line of convergence.csv.
  Fields convergence_fields(const ConvergenceRow &row);

  /// Frequencies and growth rates over the meshes as the screen shows them.
  std::string convergence_table(const std::vector<ConvergenceRow> &rows);

  /// Tables of frequencies and growth rates with error bars, for LaTeX with the package booktabs.
  std::string convergence_tex(const std::vector<ConvergenceRow> &rows);
} // namespace squeal
