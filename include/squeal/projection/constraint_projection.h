#pragma once

#include <squeal/linalg/factorization.h>

#include <memory>

namespace squeal
{
  /// The constraints of contact in problems that are solved without factors,
  ///
  ///     [ A     N + mu T ] [ u ]      right vectors:  N^T u = C Lambda,
  ///     [ N^T      -C    ] [ L ],     left ones:      (N + mu T)^T v = C zeta,
  ///
  /// satisfied to rounding by displacements of the contact surfaces: with a diagonal W ~ 1/A and
  ///     S = N^T W (N + mu T),
  /// a small sparse matrix that is factorised,
  ///     u := u - W (N + mu T) S^{-1} (N^T u - C Lambda),
  ///     v := v - W N S^{-T} ((N + mu T)^T v - C zeta).
  /// These are projections; the transpose of the left one takes from forces what pressures can
  /// bear. What a multigrid cycle for A + N D N^T leaves of the constraints is so little that the
  /// surfaces' cells bear it (iterative_statics.h).
  ///
  /// Without multipliers (penalty) there is nothing to satisfy.
  class ConstraintProjection
  {
  public:
    /// @p coupling holds the blocks of contact and may hold others of displacements, which are not
    /// looked at; rows of released multipliers have an entry on the diagonal only. The last @p
    /// n_local rows of each rank are multipliers. @p stiffness is the diagonal of A, one column.
    /// Collective.
    ConstraintProjection(const RowRange &rows, unsigned int n_local, const Matrix &coupling,
                         const MultiVector &stiffness);

    /// Moves the displacements so that the vectors satisfy the constraints, those of left vectors
    /// if @p left. Multipliers stay.
    void satisfy(MultiVector &x, bool left) const;

    /// The pressures d, zero in the other rows, that take most from the forces of a residual:
    /// N^T W (r + (N + mu T) d) = 0, and adds [N + mu T; -C] d to it; if @p left, with the
    /// transposed matrix.
    MultiVector relieve(MultiVector &residual, bool left) const;

  private:
    /// The matrix of contact or its transpose times x.
    MultiVector couple(const MultiVector &x, bool transposed) const;
    /// S^{-1} or S^{-T} of what the multipliers' rows hold; zero in the others.
    MultiVector solve(const MultiVector &rows_of_multipliers, bool transposed) const;
    /// W times the displacements' rows, zero in the multipliers'.
    void weigh(MultiVector &x) const;

    const RowRange rows;
    RowRange multipliers; ///< numbered by themselves
    Matrix contact;
    std::vector<double> weights; ///< of this rank's rows, zero for multipliers
    std::unique_ptr<const Factorization> schur;
  };
} // namespace squeal
