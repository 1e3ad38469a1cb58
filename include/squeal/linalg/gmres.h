#pragma once

#include <squeal/linalg/multi_vector.h>

#include <functional>
#include <optional>

namespace squeal
{
  /// y = A x for one column.
  using LinearOperator = std::function<MultiVector(const MultiVector &)>;

  /// Solves A x = b, one column, by GMRES (PETSc) from the given x on, preconditioned from the left
  /// with B ~ A^{-1}, until |B (b - A x)| <= tolerance |B b|. Returns the number of iterations, or
  /// nothing if @p max_iterations were not enough; x then is what was reached.
  std::optional<unsigned int> gmres(const LinearOperator &A, const LinearOperator &B,
                                    const MultiVector &b, MultiVector &x, double tolerance,
                                    unsigned int max_iterations);
} // namespace squeal
