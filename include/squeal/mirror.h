#pragma once

#include <squeal/eigenproblem.h>
#include <squeal/rank_group.h>

#include <functional>
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
    std::vector<bool> is_pressure; ///< or a displacement

    /// S x.
    Block reflect(const Block &x) const;
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
  /// The same of one matrix, given by its products.
  bool is_symmetric(const std::function<Block(const Block &)> &matrix,
                    const MirrorSymmetry &symmetry);
  /// Whether S x = x to rounding.
  bool is_symmetric(const Block &x, const MirrorSymmetry &symmetry);

  /// The vectors with S x = x, or those with S x = -x, by an orthonormal basis V: its columns are
  ///     (e_i +- S e_i)/sqrt 2,   and e_i where S e_i = +- e_i.
  /// Pressures come last on each rank.
  class HalfSpace
  {
  public:
    /// Each rank has about half of its own rows, in their order.
    HalfSpace(const MirrorSymmetry &symmetry, bool symmetric);
    /// The ranks of a group share the rows evenly; others have none, and no communicator. All take
    /// part in what is collective.
    HalfSpace(const MirrorSymmetry &symmetry, bool symmetric, const RankGroup &group);

    /// V^T A V of each matrix. The problem must be symmetric. Collective.
    QuadraticEigenproblem restrict(const QuadraticEigenproblem &problem) const;
    /// V^T A V of a matrix. Collective.
    Matrix restrict(const Matrix &matrix) const
    {
      return restrict(std::vector<Summand>{{1., matrix ? Mat(matrix) : nullptr}});
    }
    /// V^T A V of a sum that is not formed, sum_i c_i A_i. Collective.
    Matrix restrict(const std::vector<Summand> &summands) const;
    /// V^T x. Collective.
    Block restrict(const Block &x) const;
    /// V y. Collective.
    Block expand(const Block &y) const;
    /// The rows of the half that rows of the whole are part of, ascending: no columns of V vanish
    /// there.
    std::vector<unsigned int> restrict(const std::vector<unsigned int> &rows_of_whole) const;

    const RowRange &row_range() const
    {
      return rows;
    }
    /// Whether this rank has a part of the half.
    bool is_here() const
    {
      return rows.comm != MPI_COMM_NULL;
    }

  private:
    static constexpr unsigned int none = -1;

    HalfSpace(const MirrorSymmetry &symmetry, bool symmetric, const RankGroup *group);
    /// A distributed column of the half on all ranks of the whole.
    std::vector<double> replicate_half(const double *column) const;

    const RowRange whole;
    const std::vector<unsigned int> images; ///< of the rows of the whole
    RowRange rows;
    /// By global row of the whole: the only column of V with an entry there, or none, and the
    /// entry.
    std::vector<unsigned int> columns;
    std::vector<double> entries;
    std::vector<bool> is_second; ///< of a pair, the row that another one stands for
    /// By own row of the half: the row i of the whole that it stands for, and whether that is of a
    /// pressure.
    std::vector<unsigned int> representatives;
    std::vector<bool> has_pressure;
  };
} // namespace squeal
