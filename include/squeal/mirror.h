#pragma once

#include <squeal/eigenproblem.h>

#include <optional>
#include <vector>

namespace squeal
{
  template <int dim>
  class Spaces;

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

    /// S x.
    Block reflect(const Block &x) const;
    /// Some columns without any pattern.
    Block scattered(unsigned int n_columns) const;
  };

  /// The reflection if the mesh and its fixed components are symmetric. The same on all ranks.
  /// Loads, materials and contact are not looked at: is_symmetric() tells. Collective.
  template <int dim>
  std::optional<MirrorSymmetry> find_mirror_symmetry(const Spaces<dim> &spaces);

  /// Replaces the value of each own cell by the mean of it and its mirror image's, if every cell
  /// has one: cells that are marked by it then leave the mesh symmetric. Collective.
  template <int dim>
  void average_mirror_cells(const Spaces<dim> &spaces, std::vector<double> &by_cell);

  /// Whether S A S x = A x for all matrices of the problem and some scattered x, to rounding.
  bool is_symmetric(const QuadraticEigenproblem &problem, const MirrorSymmetry &symmetry);

  /// The vectors with S x = x, or those with S x = -x, by an orthonormal basis V: its columns are
  ///     (e_i +- S e_i)/sqrt 2,   and e_i where S e_i = +- e_i.
  /// Each rank has about half of its own rows, in their order, so that contact pressures stay last.
  class HalfSpace
  {
  public:
    HalfSpace(const MirrorSymmetry &symmetry, bool symmetric);

    /// V^T A V of each matrix. The problem must be symmetric.
    QuadraticEigenproblem restrict(const QuadraticEigenproblem &problem) const;
    /// V^T A V of a matrix. Collective.
    Matrix restrict(const Matrix &matrix) const;
    /// V y.
    Block expand(const Block &y) const;
    /// V^T x. Collective.
    Block restrict(const Block &x) const;
    /// Of this rank's last rows of the whole the number of those that stand for a pair.
    unsigned int n_local_last(unsigned int n_of_whole) const;

    const RowRange &row_range() const
    {
      return rows;
    }

  private:
    static constexpr unsigned int none = -1;

    const RowRange whole;
    const std::vector<unsigned int> images; ///< of the rows of the whole
    RowRange rows;
    /// By global row of the whole: the only column of V with an entry there, or none, and the
    /// entry.
    std::vector<unsigned int> columns;
    std::vector<double> entries;
    std::vector<bool> is_second; ///< of a pair, the row that another one stands for
    /// By own row of the half: the own row i of the whole that it stands for.
    std::vector<unsigned int> representatives;
  };
} // namespace squeal
