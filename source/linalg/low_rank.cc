#include <squeal/linalg/low_rank.h>

#include <utility>

namespace squeal
{
  DenseMatrix LowRank::weighted_products(const MultiVector &x) const
  {
    DenseMatrix products = inner_products(vectors, x);
    for (unsigned int j = 0; j < products.n_columns; ++j)
      for (unsigned int k = 0; k < products.n_rows; ++k)
        products(k, j) *= weights[k];
    return products;
  }

  Matrix make_matrix(std::shared_ptr<const LowRank> low_rank)
  {
    const RowRange rows = low_rank->vectors.row_range();
    return make_matrix_free(rows, [low_rank = std::move(low_rank)](const MultiVector &x, bool)
                            { return combine(low_rank->vectors, low_rank->weighted_products(x)); });
  }
} // namespace squeal
