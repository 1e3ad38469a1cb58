#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/linalg/multi_vector.h>

#include <limits>
#include <utility>
#include <vector>

namespace squeal
{
  /// What columns must add to a space to be taken into it. What is left of a column beside the
  /// space is its remainder.
  struct Novelty
  {
    /// Remainders shorter than this times their columns are left out.
    double shortest;
    /// Combinations of remainders of unit length that are shorter than this are left out; 0: all
    /// but rounding are kept. Squares do not tell lengths below 1e-7 from zero.
    double dependent = 0;
    /// Principal components of the remainders, as long as these are, that are shorter than
    /// `shortest` are left out in place of all this.
    bool by_components = false;
  };

  /// A space that grows: an orthonormal basis U, of any rows, and nothing else. The only
  /// orthogonalisation against known vectors: each method brings what it takes for new, and keeps
  /// images of U by itself.
  class SearchSpace
  {
  public:
    SearchSpace() = default;
    /// The empty space; @p largest is how many dimensions it can have.
    explicit SearchSpace(const RowRange &rows,
                         unsigned int largest = std::numeric_limits<unsigned int>::max())
        : SearchSpace(MultiVector(rows, 0), largest)
    {
    }
    /// The span of orthonormal columns.
    explicit SearchSpace(MultiVector orthonormal,
                         unsigned int largest = std::numeric_limits<unsigned int>::max())
        : basis_(std::move(orthonormal)), largest(largest)
    {
    }

    const MultiVector &basis() const
    {
      return basis_;
    }
    unsigned int n_columns() const
    {
      return basis_.n_columns();
    }

    /// An image A Y of the columns Y that are added, which becomes that of what is new in them, and
    /// the image A U of the basis.
    struct Image
    {
      MultiVector &of_added;
      const MultiVector &of_basis;
    };
    /// Enlarges the space by what is new in the columns, and returns that, orthonormal. @p
    /// coefficients become those of the given columns in the new basis, as far as it has them.
    /// Images need a Novelty that is not 0 in `dependent`. Collective.
    MultiVector add(MultiVector columns, const Novelty &novelty,
                    const std::vector<Image> &images = {}, DenseMatrix *coefficients = nullptr);

    /// U := U C with orthonormal columns of C.
    void turn(const DenseMatrix &c)
    {
      basis_ = combine(basis_, c);
    }
    /// Replaces columns of the basis, from the first on, by others that differ by rounding.
    void replace(unsigned int first, const MultiVector &columns);
    MultiVector release()
    {
      return std::exchange(basis_, {});
    }

  private:
    /// The remainders that are new, combined; their images likewise.
    void take_new(MultiVector &remainders, const DenseMatrix &before, const Novelty &novelty,
                  const std::vector<Image> &images) const;

    MultiVector basis_;
    unsigned int largest = 0;
  };
} // namespace squeal
