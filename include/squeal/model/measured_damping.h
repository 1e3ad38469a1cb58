#pragma once

#include <squeal/model/model.h>

namespace squeal
{
  /// The damping of modes with measured ratios zeta (theory.md, section 12),
  ///     P_modal = sum_j (M phi_j) 2 zeta(w_j) w_j (M phi_j)^T,
  /// phi_j, w_j the real modes of the conservative terms, with unit modal masses, up to the rim of
  /// the disc in which modes are searched. A term (f(l) - 1) A with f = 1 + l theta, theta = 1 s:
  /// the matrix is dense and of low rank, so it is no summand of P. Throws SolverError. Collective.
  RelaxationTerm measured_damping(const EquationsOfMotion &equations, const Sectors &sectors,
                                  const Parameters::All &parameters);

  /// d/d factor of such a term of Modal damping/Factor = @p factor.
  ParameterDerivative derivative_by_factor(const RelaxationTerm &damping, double factor);
} // namespace squeal
