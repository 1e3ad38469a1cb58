#pragma once

#include <mpi.h>

#include <cstddef>
#include <set>
#include <vector>

namespace squeal
{
  /// Where surfaces in contact touch: by multiplier for mortar, by quadrature point for penalty. At
  /// first they touch everywhere.
  struct ActiveSet
  {
    std::vector<bool> by_row;                ///< by equation, the same on all ranks; mortar
    std::vector<std::vector<bool>> by_point; ///< by interface and point of this rank; penalty
    std::set<unsigned int> slipping;         ///< equations of the pressures without tractions

    void close();
    /// A number that tells sets apart. Collective.
    std::size_t hash(MPI_Comm comm) const;
    bool operator==(const ActiveSet &other) const
    {
      return by_row == other.by_row && by_point == other.by_point;
    }
  };

  /// What a step of the primal-dual active set has changed.
  struct ActiveSetChange
  {
    unsigned int n_changed     = 0; ///< those that broke the conditions
    unsigned int n_active      = 0;
    double largest_tension     = 0; ///< of an active multiplier, Pa
    double largest_penetration = 0; ///< of an inactive multiplier (mean weighted gap), m
  };
} // namespace squeal
