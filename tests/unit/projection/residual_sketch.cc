#include "../helpers.h"

#include <squeal/projection/residual_sketch.h>

#include <doctest/doctest.h>

#include <cmath>

namespace squeal::tests::residual_sketch_tests
{
  TEST_CASE("residual sketch: no vector is longer than its bound, whatever its rows are")
  {
    // Unit columns, smooth ones, and ones of both signs; |S^T r| has a relative deviation of
    // 1 / sqrt(2 96) = 0.07.
    const RowRange rows = even_rows(400);
    MultiVector block(rows, 300);
    for (unsigned int j = 0; j < block.n_columns(); ++j)
      for (unsigned int i = 0; i < block.n_local(); ++i)
      {
        const unsigned int row = rows.begin + i;
        block.column(j)[i]     = j < 100   ? (row == 4 * j ? 1. : 0.)
                                 : j < 200 ? std::sin(1e-3 * j * row)
                                           : std::cos(double(j) * row * row);
      }
    const DenseMatrix sketch = ResidualSketch(rows).of(block), exact = inner_products(block, block);
    REQUIRE(sketch.n_columns == block.n_columns());
    double mean = 0;
    for (unsigned int j = 0; j < block.n_columns(); ++j)
    {
      double square = 0;
      for (unsigned int i = 0; i < sketch.n_rows; ++i)
        square += sketch(i, j) * sketch(i, j);
      const double ratio = std::sqrt(square / exact(j, j));
      CHECK(ResidualSketch::longest * ratio >= 1);
      CHECK(std::abs(ratio - 1) <= 0.35); // five deviations
      mean += ratio / block.n_columns();
    }
    CHECK(std::abs(mean - 1) <= 0.02);
  }

  TEST_CASE("residual sketch: small residuals of large summands keep their digits")
  {
    // r = a - b with |r| = 1e-10 |a|: from sketches of a and b, which squares of a and b hide.
    const RowRange rows = even_rows(300);
    MultiVector block(rows, 3);
    for (unsigned int i = 0; i < block.n_local(); ++i)
    {
      const unsigned int row = rows.begin + i;
      block.column(0)[i]     = std::cos(0.1 * row);
      block.column(2)[i]     = 1e-10 * std::sin(0.3 * row);
      block.column(1)[i]     = block.column(0)[i] - block.column(2)[i];
    }
    const DenseMatrix sketch = ResidualSketch(rows).of(block);
    for (unsigned int i = 0; i < sketch.n_rows; ++i)
      CHECK(std::abs(sketch(i, 0) - sketch(i, 1) - sketch(i, 2)) <= 1e-4 * 1e-10);
  }
} // namespace squeal::tests::residual_sketch_tests
