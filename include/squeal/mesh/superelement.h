#pragma once

#include <squeal/linalg/matrix_market.h>

#include <deal.II/base/point.h>
#include <deal.II/base/types.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace squeal
{
  /// A part that is known by its matrices K, M and D only (theory.md, section 11): three
  /// displacements of each of its nodes, node by node, then internal coordinates without a place.
  struct Superelement
  {
    struct Matrices
    {
      MatrixMarketFile stiffness, mass, damping; ///< damping of size zero: there is none
    };

    std::string name;
    std::set<dealii::types::boundary_id> surface; ///< to which nodes are held
    std::vector<dealii::Point<3>> nodes;          ///< places, m
    std::vector<bool> is_held;                    ///< by node; the others are free
    std::shared_ptr<const Matrices> matrices;

    /// The number of unknowns.
    unsigned int size() const
    {
      return matrices->stiffness.n_rows;
    }
    /// The number of nodes that are held.
    unsigned int n_held() const
    {
      return std::count(is_held.begin(), is_held.end(), true);
    }
  };

  /// A body of which a superelement is to be made, and the boundaries on which it hangs on others.
  struct SuperelementInterface
  {
    unsigned int body;
    std::set<dealii::types::boundary_id> boundaries;
  };
} // namespace squeal
