#pragma once

#include <squeal/parameters/choices.h>
#include <squeal/projection/eigenpairs.h>

#include <functional>
#include <memory>

namespace squeal
{
  /// Gives the number of reference modes in the disc, where others than the solver count them;
  /// empty: it counts by itself. Called once the solver has factors. Free bodies are not allowed
  /// with it.
  using Counting = std::function<unsigned int()>;

  /// Finds the modes of a quadratic eigenproblem in a window.
  class Eigensolver
  {
  public:
    virtual ~Eigensolver() = default;
    /// Throws SolverError if a mode of the window is missing or cannot be computed to the
    /// tolerance.
    virtual EigenSolution solve(const QuadraticEigenproblem &problem,
                                const EigensolverOptions &options,
                                const Counting &counting = {}) const = 0;
  };

  /// The solver of that name: block_krylov, krylov or dense. To add one: a class and a row in the
  /// table.
  std::unique_ptr<Eigensolver> make_eigensolver(ModeSolver solver);
} // namespace squeal
