#pragma once

#include <squeal/linalg/multi_vector.h>

#include <memory>
#include <vector>

namespace squeal
{
  /// sum_k c_k b_k b_k^T: symmetric, dense, and never formed.
  struct LowRank
  {
    MultiVector vectors;         ///< b, columns
    std::vector<double> weights; ///< c
    MultiVector preimages;       ///< x_k of b_k = A x_k, if it is wanted

    /// c_k b_k^T x_j, row k, column j. Collective.
    DenseMatrix weighted_products(const MultiVector &x) const;
  };

  /// Makes a matrix without entries (make_matrix_free()) of it, which keeps it. Collective.
  Matrix make_matrix(std::shared_ptr<const LowRank> low_rank);
} // namespace squeal
