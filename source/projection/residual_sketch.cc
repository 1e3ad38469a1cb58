#include <squeal/projection/residual_sketch.h>

#include <cmath>
#include <random>

namespace squeal
{
  ResidualSketch::ResidualSketch(const RowRange &rows) : directions(rows, n_directions)
  {
    std::normal_distribution<double> normal(0, 1 / std::sqrt(double(n_directions)));
    for (unsigned int i = 0; i < directions.n_local(); ++i)
    {
      // The same numbers in a row whatever rank has it
      std::mt19937_64 engine(rows.begin + i);
      normal.reset();
      for (unsigned int j = 0; j < n_directions; ++j)
        directions.column(j)[i] = normal(engine);
    }
  }

  DenseMatrix ResidualSketch::of(const MultiVector &block) const
  {
    return inner_products(directions, block);
  }
} // namespace squeal
