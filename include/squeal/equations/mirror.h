#pragma once

#include <squeal/equations/equations_of_motion.h>

#include <optional>
#include <vector>

namespace squeal
{
  template <int dim>
  class FiniteElementSpace;

  /// The reflection about the rotor's mid-plane, z -> -z, as a permutation with signs of the
  /// equations,
  ///     S e_i = sign_i e_image(i),
  /// axial displacements with sign -1, others and contact pressures with +1. The axis stays the
  /// axis of rotation and the transport is along the plane, so a brake that is its own mirror image
  /// has S A S = A for all its matrices.
  struct MirrorSymmetry
  {
    RowRange rows;
    std::vector<unsigned int> image; ///< by global row, on every rank
    std::vector<signed char> sign;
    std::vector<bool> is_pressure; ///< or a displacement

    /// S x.
    MultiVector reflect(const MultiVector &x) const;
    /// Some columns without any pattern.
    MultiVector scattered(unsigned int n_columns) const;
  };

  /// Finds the reflection if the mesh and its fixed components are symmetric, on all ranks alike.
  /// Loads, materials and contact are not looked at: is_symmetric() tells. Collective.
  template <int dim>
  std::optional<MirrorSymmetry> find_mirror_symmetry(const FiniteElementSpace<dim> &spaces);

  /// Replaces the value of each own cell by the mean of it and its mirror image's, if every cell
  /// has one: cells that are marked by it then leave the mesh symmetric. Collective.
  template <int dim>
  void average_over_images(const FiniteElementSpace<dim> &spaces, std::vector<double> &by_cell);

  /// The terms of M, P and Q.
  std::vector<std::vector<Term>> sums_of(const EquationsOfMotion &equations);

  /// Whether S A S x = A x for all matrices of the problem and some scattered x, to rounding.
  bool is_symmetric(const EquationsOfMotion &equations, const MirrorSymmetry &symmetry);
  /// Whether S A S x = A x for the given sums A of terms.
  bool is_symmetric(const std::vector<std::vector<Term>> &sums, const MirrorSymmetry &symmetry);
  /// Whether S x = x to rounding.
  bool is_symmetric(const MultiVector &x, const MirrorSymmetry &symmetry);
} // namespace squeal
