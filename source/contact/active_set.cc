#include <squeal/contact/active_set.h>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <functional>

namespace squeal
{
  void ActiveSet::close()
  {
    std::fill(by_row.begin(), by_row.end(), true);
    for (std::vector<bool> &points : by_point)
      std::fill(points.begin(), points.end(), true);
    slipping.clear();
  }

  std::size_t ActiveSet::hash(const MPI_Comm comm) const
  {
    std::size_t hash = std::hash<std::vector<bool>>()(by_row);
    for (const std::vector<bool> &points : by_point)
      hash = 31 * hash + std::hash<std::vector<bool>>()(points);
    return dealii::Utilities::MPI::sum(hash, comm);
  }
} // namespace squeal
