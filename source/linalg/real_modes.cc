#include <squeal/linalg/real_modes.h>

#include <algorithm>

namespace squeal
{
  RealModes real_modes(const DenseMatrix &mass, const DenseMatrix &stiffness,
                       const unsigned int n_modes)
  {
    constexpr double smallest = 1e-4;
    const DenseMatrix unit    = principal_combinations(mass, smallest);
    DenseMatrix vectors       = unit.transpose() * (stiffness * unit);
    RealModes result;
    result.squares = symmetric_eigen(vectors);
    result.squares.resize(std::min<std::size_t>(n_modes, result.squares.size()));
    result.coordinates = (unit * vectors).columns(0, result.squares.size());
    return result;
  }
} // namespace squeal
