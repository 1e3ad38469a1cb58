#pragma once

#include <squeal/linalg/multi_vector.h>

namespace squeal
{
  /// Lengths of combinations of many long vectors by their products with a few random directions.
  ///
  /// With independent normal numbers g_ij the squares sum up to |S^T r|^2 = |r|^2 chi^2_n / n,
  /// whatever r is, as long as it does not depend on S. So |r| <= 2 |S^T r| but with the
  /// probability that chi^2_96 < 96 / 4, at most exp(-48 (1/4 - 1 - ln 1/4)) = 6e-14: a bound that
  /// holds for all residuals of any run. Sums are formed of sketches as of the vectors themselves,
  /// with a rounding relative to the summands, so that small residuals keep their digits, which
  /// they lose where products of the vectors with each other are summed. (Halko, Martinsson, Tropp,
  /// SIAM Review 53, 2011; Balabanov and Nouy, Adv. Comput. Math. 45, 2019.)
  class ResidualSketch
  {
  public:
    explicit ResidualSketch(const RowRange &rows);

    /// S^T B, a column for each of B. Collective.
    DenseMatrix of(const MultiVector &block) const;

    static constexpr unsigned int n_directions = 96;
    /// How much longer than its sketch a vector may be.
    static constexpr double longest = 2;

  private:
    MultiVector directions; ///< S
  };
} // namespace squeal
