#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/linalg/matrix.h>

namespace squeal
{
  /// Matrices in the coordinates of Craig and Bampton: the displacements of the interface, then an
  /// amplitude of each mode of the part that is held there.
  struct ReducedPart
  {
    DenseMatrix K, M, D; ///< D of size zero: there is none
    unsigned int n_modes    = 0;
    double highest          = 0; ///< frequency of these modes, Hz
    unsigned int n_internal = 0; ///< coordinates that are not on the interface
  };

  /// Reduces a part whose first @p n_interface rows are its interface b, the others its inside i
  /// (theory.md, section 11),
  ///
  ///     u = [ 1    0   ] [ u_b ]     Psi = - K_ii^{-1} K_ib,    K_ii Phi = M_ii Phi W^2,
  ///         [ Psi  Phi ] [ q   ],
  ///
  /// with the lowest modes, at most @p n_modes and, unless it is zero, up to @p frequency, Hz. With
  /// all modes it is the part itself. K and M are symmetric and definite where the interface is
  /// held; D may be empty. Of one rank. Throws SolverError.
  ReducedPart craig_bampton(const Matrix &K, const Matrix &M, const Matrix &D, const RowRange &rows,
                            unsigned int n_interface, unsigned int n_modes, double frequency);
} // namespace squeal
