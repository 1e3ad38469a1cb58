#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/mesh/mortar.h>
#include <squeal/mesh/superelement.h>
#include <squeal/parameters/parameters.h>

#include <string>
#include <vector>

namespace squeal
{
  inline const std::string superelements_key = "Joints/Superelements";

  /// A surface to which nodes of a superelement may be held: patches of degree 2.
  struct HoldingSurface
  {
    std::string name;
    std::vector<SurfaceFace<3>> faces;
  };

  /// A superelement, and where its nodes are held.
  struct PlacedSuperelement
  {
    static constexpr unsigned int free = -1;
    Superelement element;                      ///< without boundaries
    std::vector<unsigned int> surface_of_node; ///< number of the surface, or free
    std::string report;                        ///< a line for the log
  };

  /// Reads <files>-K.mtx, -M.mtx, -D.mtx (if it is there) and -nodes.csv. A node is held to the
  /// nearest surface if that is within @p tolerance, m; 0: 5 % of the longest edge of its faces.
  /// Throws InputError: files that are missing or wrong, matrices that are not symmetric or not as
  /// large as the table says, a mass matrix with negative eigenvalues, surfaces without a node,
  /// coordinates that nothing holds.
  PlacedSuperelement read_superelement(const Parameters::Joints::Superelement &entry,
                                       const std::vector<HoldingSurface> &surfaces,
                                       double tolerance);

  /// The stiffness of a superelement for the rigid motions of its nodes about the origin of @p
  /// places, six by six, its internal coordinates free: zero where it comes from rounding.
  DenseMatrix rigid_stiffness(const Superelement &element,
                              const std::vector<dealii::Point<3>> &places);
} // namespace squeal
