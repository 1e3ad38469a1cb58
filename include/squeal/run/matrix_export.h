#pragma once

#include <squeal/model/brake_model.h>
#include <squeal/model/matrix_model.h>

#include <string>
#include <vector>

namespace squeal
{
  /// The files that export_matrices() writes into the run's directory, as a regular expression.
  std::string names_of_exported_files();

  /// Writes (l^2 M + l P + Q) x = 0 for other programs (doc/matrices.md): M.mtx, P.mtx, Q.mtx, the
  /// matrices of which they are sums with terms.csv, the eigenvalues and their right and left
  /// vectors, and what the rows are: unknowns.csv, nodes.csv, expansion.mtx; functions.csv if terms
  /// depend on l otherwise.
  ///
  /// A mirror-symmetric brake is written as a whole. Left out are the pressures of nodes that have
  /// lifted off, whose rows say that they are zero. Collective. Throws std::runtime_error where a
  /// file cannot be written.
  template <int dim>
  void export_matrices(const BrakeModel<dim> &model, const EquationsOfMotion &equations,
                       const EigenPairs &modes, const std::string &directory);

  /// Writes the same of the scene matrices, whose rows are those of its files: no tables of them.
  void export_matrices(const MatrixModel &model, const EigenPairs &modes,
                       const std::string &directory);
} // namespace squeal
