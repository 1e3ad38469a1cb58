#pragma once

#include <squeal/base/subcommunicator.h>
#include <squeal/equations/eigenproblem.h>
#include <squeal/equations/mirror.h>

#include <memory>
#include <vector>

namespace squeal
{
  struct CompressedRows;

  /// The vectors with S x = x, or those with S x = -x, by an orthonormal basis V: its columns are
  ///     (e_i +- S e_i)/sqrt 2,   and e_i where S e_i = +- e_i.
  /// Pressures come last on each rank.
  class ParitySpace
  {
  public:
    /// Each rank has about half of its own rows, in their order.
    ParitySpace(const MirrorSymmetry &symmetry, bool symmetric);
    /// The ranks of a group share the rows evenly; others have none, and no communicator. All take
    /// part in what is collective.
    ParitySpace(const MirrorSymmetry &symmetry, bool symmetric, const Subcommunicator &group);

    /// V^T A V of each matrix A of the problem, which must be symmetric. The sums of its terms are
    /// made row by row and not stored. The first reference matrix that will be asked for, at the
    /// first of the @p counted frequencies, is made along with them. Collective.
    QuadraticEigenproblem restrict(const EquationsOfMotion &equations,
                                   const std::vector<double> &counted = {}) const;
    /// V^T (sum_i c_i A_i) V of several sums; each matrix is read once. Empty where a sum is.
    /// Collective.
    std::vector<Matrix> restrict(const std::vector<std::vector<Term>> &sums) const;
    /// Sums of terms that are wanted on a half.
    struct Wanted
    {
      const ParitySpace *space;
      std::vector<std::vector<Term>> sums;
    };
    /// Restricts to several halves, which groups of ranks share: these finish it at the same time.
    static std::vector<std::vector<Matrix>> restrict(const std::vector<Wanted> &all);
    /// Q_ref - omega^2 M of several halves, on ranks of their own choice.
    struct Counting
    {
      double omega;
      std::vector<const ParitySpace *> spaces;
      std::vector<Matrix> shifted;
    };
    /// Problems of several halves. With @p counting their reference problems are only named.
    static std::vector<QuadraticEigenproblem> restrict(
        const std::vector<const ParitySpace *> &spaces, const EquationsOfMotion &equations,
        Counting *counting = nullptr);
    /// V^T A V of a matrix. Collective.
    Matrix restrict(const std::shared_ptr<const Matrix> &matrix) const;
    /// V^T x. Collective.
    MultiVector restrict(const MultiVector &x) const;
    /// Empty on ranks that have no part of the half. Collective.
    Matrix restrict(const LowRank &low_rank) const;
    /// V y. Collective.
    MultiVector expand(const MultiVector &y) const;
    /// The rows of the half that rows of the whole are part of, ascending: no columns of V vanish
    /// there.
    std::vector<unsigned int> restrict(const std::vector<unsigned int> &rows_of_whole) const;

    /// The number of pressures among this rank's rows of the half, of which they are the last.
    unsigned int n_local_pressures() const;

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

    ParitySpace(const MirrorSymmetry &symmetry, bool symmetric, const Subcommunicator *group);
    /// A distributed column of the half on all ranks of the whole.
    std::vector<double> replicate_half(const double *column) const;
    /// Q_ref - omega^2 M. Collective.
    Matrix shifted_reference(const EquationsOfMotion &equations, double omega) const;
    /// Rows of V^T (sum_i c_i A_i) V of several sums, those that stand for rows of this rank.
    std::vector<CompressedRows> restrict_own_rows(const std::vector<std::vector<Term>> &sums) const;
    /// Rows of a matrix of the half on the ranks of the group, of those that have its rows in the
    /// whole, columns numbered as in the group.
    CompressedRows hand_over(const CompressedRows &sent) const;

    const RowRange whole;
    const bool is_shared;                   ///< by a group of ranks
    const std::vector<unsigned int> images; ///< of the rows of the whole
    RowRange rows;
    /// For a row of the whole: the one column of V that is not zero there, or `none`, and its
    /// value.
    struct Place
    {
      unsigned int column = none;
      bool is_second      = false; ///< of a pair, the row that another one stands for
      double entry        = 0;
    };
    std::vector<Place> places; ///< by global row, side by side: they are wanted together
    /// By own row of the half: the row i of the whole that it stands for, and whether that is of a
    /// pressure.
    std::vector<unsigned int> representatives;
    std::vector<bool> has_pressure;
    /// The representatives that are own rows of the whole; without a group all of them.
    std::vector<unsigned int> own_representatives;
  };
} // namespace squeal
