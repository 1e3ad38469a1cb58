#pragma once

#include <squeal/subspace_iteration.h>

#include <memory>
#include <string>

namespace squeal
{
  /// Finds the modes of a quadratic eigenproblem in a window.
  class Eigensolver
  {
  public:
    virtual ~Eigensolver() = default;
    /// Throws SolverError if a mode of the window is missing or cannot be computed to the
    /// tolerance.
    virtual Modes solve(const QuadraticEigenproblem &problem,
                        const EigensolverOptions &options) const = 0;
  };

  /// The solver of that name: block_krylov, krylov or dense. To add one: a class and a row in the
  /// table.
  std::unique_ptr<Eigensolver> make_eigensolver(const std::string &name);
} // namespace squeal
