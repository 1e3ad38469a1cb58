#pragma once

#include <squeal/mesh/geometry.h>

namespace dealii
{
  template <int dim, int spacedim>
  class Triangulation;
}

namespace squeal
{
  /// Fills an empty triangulation with the bodies of a scene, disjoint: material ids, manifolds and
  /// boundary ids.
  template <int dim>
  void make_coarse_mesh(const Geometry<dim> &geometry,
                        dealii::Triangulation<dim, dim> &triangulation);

  /// Numbers the vertices of the cells so that all cells at an edge give it one direction, as a
  /// triangulation needs it. Returns false where there is no such numbering: rows of cells close in
  /// a twisted ring.
  bool order_consistently(std::vector<CoarseCell<3>> &cells);
} // namespace squeal
