#pragma once

#include <squeal/linalg/dense.h>

namespace squeal
{
  /// The diagonal of the inverse of a symmetric positive definite matrix, of which the upper
  /// triangle is read: a third of the work of the inverse. Throws SolverError if the matrix is
  /// singular to working precision.
  std::vector<double> inverse_diagonal(DenseMatrix a);
} // namespace squeal
