#pragma once

#include <squeal/projection/eigenpairs.h>

namespace squeal
{
  /// Eigenvalues of given matrices beyond what rounding leaves of summed and projected ones: one
  /// step of Newton's method for the two-sided Rayleigh quotient,
  ///     l := l - z^H T(l) x / z^H T'(l) x,
  /// with the equations that the problem was made of, in the longest floating-point numbers that
  /// the machine has. Each z^H A x of a matrix A is a small difference of large summands: a fine
  /// beam has |K| = 1e9 |l^2 M|, and its lowest eigenvalues lose as many digits. Errors of x and z
  /// enter by their product. Vectors are not changed.
  void use_given_matrices(const QuadraticEigenproblem &problem, EigenPairs &modes);
} // namespace squeal
