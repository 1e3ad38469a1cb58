#pragma once

#include <squeal/projection/eigenpairs.h>

namespace squeal
{
  /// Whether an eigenvalue is in the window.
  bool is_wanted(const EigensolverOptions &options, const std::complex<double> &l);

  /// Leaves the modes of the window, sorted and normalised; zero eigenvalues are counted.
  void restrict_to_window(const QuadraticEigenproblem &problem, const EigensolverOptions &options,
                          EigenSolution &solution);
} // namespace squeal
