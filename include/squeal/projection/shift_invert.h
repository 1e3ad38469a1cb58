#pragma once

#include <squeal/projection/eigenpairs.h>

namespace squeal
{
  /// Solves with a factorisation of F = Q(s) at a real shift s, or of F = Q + t M, a shift of l^2
  /// by t in which the velocity terms are left out (t = -w^2 reaches modes near i w in real
  /// arithmetic); or of its transpose for the adjoint problem. In both cases
  ///     Q(l) = F + (l^2 - square) M + (l - shift) P.
  class ShiftInvert
  {
  public:
    ShiftInvert(const Factorization &factorization, const double shift, const bool adjoint = false)
        : shift(shift), square(shift * shift), factorization(factorization), adjoint(adjoint)
    {
    }
    /// Q + square M.
    static ShiftInvert of_square(const Factorization &factorization, const double square,
                                 const bool adjoint = false)
    {
      return ShiftInvert(factorization, 0, square, adjoint);
    }
    MultiVector solve(const MultiVector &b) const
    {
      return adjoint ? factorization.solve_transposed(b) : factorization.solve(b);
    }
    MultiVector solve_transposed(const MultiVector &b) const
    {
      return adjoint ? factorization.solve(b) : factorization.solve_transposed(b);
    }
    const double shift, square;

  private:
    ShiftInvert(const Factorization &factorization, const double shift, const double square,
                const bool adjoint)
        : shift(shift), square(square), factorization(factorization), adjoint(adjoint)
    {
    }
    const Factorization &factorization;
    const bool adjoint;
  };

  /// One step of inverse iteration of the right vectors with the factorisation F at the shift s:
  ///     x := -F^{-1} ((l^2 - s^2) M + (l - s) P + sum h(l) A) x  =  x - F^{-1} Q(l) x,
  /// with the frozen terms, if there are any.
  /// It damps what is far outside of the window, and gives multipliers that belong to the
  /// displacements.
  void inverse_iteration(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                         EigenPairs &pairs);

  /// Sets the contact pressures to zero.
  void clear_pressures(unsigned int n_local_constraints, MultiVector &block);

  /// Sets multipliers to zero, which are no part of a subspace: they follow from the displacements.
  /// Those of a compliant contact do so within the subspace already and stay.
  void clear_multipliers(const QuadraticEigenproblem &problem, MultiVector &block);

  /// Numbers in [-1, 1] that depend on row, column and seed, not on the number of ranks.
  MultiVector scattered_numbers(const RowRange &rows, unsigned int n_columns, unsigned int seed);
} // namespace squeal
