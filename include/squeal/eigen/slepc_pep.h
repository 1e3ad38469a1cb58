#pragma once

#include <squeal/projection/eigenpairs.h>

namespace squeal
{
  /// Searches all eigenpairs with Im l >= 0 and with |l - shift| <= reach by TOAR with
  /// shift-invert, one vector at a time, in real arithmetic. @p n_wanted is a guess of their
  /// number, @p seed chooses the start vector. Throws SolverError.
  EigenPairs pep_search(const QuadraticEigenproblem &problem, const Factorization &factorization,
                        double shift, double reach, unsigned int n_wanted, unsigned int seed,
                        const EigensolverOptions &options);
} // namespace squeal
