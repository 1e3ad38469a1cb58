#pragma once

#include <squeal/eigenproblem.h>

namespace squeal
{
  /// The steady sliding state: position terms of the equations of motion, contact closed everywhere,
  ///     sum_{order 0} c_i A_i q_0 = f.
  /// Terms that only appear by linearising friction (P_R, Q_R) are no part of it. The operator is not
  /// symmetric because of friction; LU by MUMPS, one step of iterative refinement. One column, with the
  /// contact pressures in the multipliers' rows. Throws SolverError.
  Block solve_static_equilibrium(const RowRange &rows, const std::vector<Term> &terms, const Block &load);
} // namespace squeal
