#pragma once

#include <squeal/eigen/subspace_iteration.h>

namespace squeal
{
  /// What SLEPc's PEP found.
  struct SlepcPep
  {
    MultiVector vectors;                      ///< Re and Im of the converged pairs
    std::vector<std::complex<double>> lambda; ///< with Im l >= 0
    double reached = 0; ///< every eigenvalue nearer to the shift than this was found
  };

  /// Searches all eigenvalues with |l - shift| <= reach by TOAR with shift-invert, one vector at a
  /// time, in real arithmetic. @p n_wanted is a guess of their number, @p seed chooses the start
  /// vector. Throws SolverError.
  SlepcPep pep_search(const QuadraticEigenproblem &problem, const Factorization &factorization,
                      double shift, double reach, unsigned int n_wanted, unsigned int seed,
                      const EigensolverOptions &options);
} // namespace squeal
