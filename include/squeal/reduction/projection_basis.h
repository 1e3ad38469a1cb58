#pragma once

#include <squeal/projection/eigenpairs.h>
#include <squeal/projection/search_space.h>

#include <vector>

namespace squeal
{
  /// A basis V of displacements and as many test vectors W, real. V is orthonormal; W has the left
  /// vectors of modes in place of the right ones, and is V else.
  struct ProjectionBasis
  {
    /// Vectors have these rows, on this rank with so many of contact pressures, which are zero.
    ProjectionBasis() = default;
    ProjectionBasis(const RowRange &rows, const unsigned int n_local_constraints)
        : rows(rows), n_local_constraints(n_local_constraints), space(rows), left(rows, 0)
    {
    }

    unsigned int dimension() const
    {
      return space.n_columns();
    }
    const MultiVector &right() const ///< V
    {
      return space.basis();
    }
    /// Clears the pressures.
    MultiVector displacements(MultiVector block) const;
    /// Makes V and W anew of modes' displacements, each Re and Im.
    void begin(MultiVector of_right, MultiVector of_left);
    /// Columns of coordinates in V, and the size from which on their principal components matter.
    struct Within
    {
      DenseMatrix coordinates;
      double smallest;
    };
    /// Makes V anew in its span, of the displacements of modes in coordinates, Re and Im, and of
    /// other columns, and W with left vectors. Returns C, V := V C.
    DenseMatrix begin_within(const DenseMatrix &of_right, MultiVector of_left,
                             const std::vector<Within> &others);
    /// Enlarges V by what the columns add to it, except for principal components of a size up to
    /// @p smallest.
    void append(MultiVector added, double smallest);
    /// Re and Im of the approximate modes with |l| <= largest in a space of displacements; @p
    /// radius is the size of the eigenvalues that matter.
    MultiVector modes_of(const QuadraticEigenproblem &problem, const MultiVector &space,
                         double radius, double largest) const;
    /// V c, or W c.
    MultiVector expanded(const MultiVector &c, bool of_left) const;
    /// Coordinates of whole vectors of the span.
    EigenPairs coordinates(const EigenPairs &whole) const;

    RowRange rows;
    unsigned int n_local_constraints = 0;
    SearchSpace space; ///< V
    MultiVector left;  ///< the first columns of W; the others are those of V

    /// Parts of unit vectors below this are left out of the bases.
    static constexpr double smallest = 2e-10;

  private:
    /// Makes left vectors, each Re and Im, the test vectors in place of the first @p n that V has.
    void test_by(MultiVector left_vectors, unsigned int n);
  };
} // namespace squeal
