#pragma once

#include <squeal/parameters/choices.h>
#include <squeal/projection/eigenpairs.h>

#include <memory>
#include <string>
#include <vector>

namespace squeal
{
  /// Finds the modes of a quadratic eigenproblem in a window.
  class Eigensolver
  {
  public:
    virtual ~Eigensolver() = default;
    /// Throws SolverError if a mode of the window is missing or cannot be computed to the
    /// tolerance.
    virtual EigenSolution solve(const QuadraticEigenproblem &problem,
                                const EigensolverOptions &options) const = 0;
    /// Whether it compares the modes with |l| <= search_radius(options.max_imaginary), and only
    /// those, with the reference problem's number.
    virtual bool counts_in_disc(const EigensolverOptions &) const
    {
      return false;
    }
    /// The frequencies at which it counts the modes of a reference problem, in this order: who
    /// makes problems may make the first shifted matrix along with the others.
    virtual std::vector<double> counted_frequencies(const EigensolverOptions &,
                                                    bool /*may_move_rigidly*/) const
    {
      return {};
    }
  };

  /// The solver of that name: block_krylov, krylov or dense. To add one: a class and a row in the
  /// table.
  std::unique_ptr<Eigensolver> make_eigensolver(ModeSolver solver);
} // namespace squeal
