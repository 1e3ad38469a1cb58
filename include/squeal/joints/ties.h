#pragma once

#include <squeal/contact/contact_kinematics.h>
#include <squeal/linalg/matrix.h>
#include <squeal/mesh/geometry.h>

#include <memory>

namespace squeal
{
  template <int dim>
  class FiniteElementSpace;

  /// The ties of a scene on one mesh (theory.md, section 11), with [[u]] = u_2 - u_1 between the
  /// second side and the first,
  ///
  ///     [ 0  B^T ] [ u      ]      Lambda^T B u = int Lambda . [[u]] da = 0  for all Lambda in the
  ///     [ B   0  ] [ Lambda ],     trace of the displacements on the first sides.
  ///
  /// Where a component of the displacement is fixed, that of the traction is zero: the support has
  /// it. Its row has an entry on the diagonal.
  struct Ties
  {
    std::shared_ptr<const Matrix> matrix; ///< null without ties
    unsigned int n_active = 0;            ///< components of tractions, of all ranks
    double scale          = 1;            ///< Pa: the traction of a unit unknown
    double stiffness      = 1;            ///< N/m, on the diagonal where a traction is zero
  };

  /// The faces of both sides of a tie, the first as those of the pad, and their common parts.
  /// Collective.
  template <int dim>
  PairedInterface<dim> pair_tie(const FiniteElementSpace<dim> &spaces,
                                const FaceElement<dim> &element, const TiedSurfaces &tie);

  /// Assembles the ties. Constraint rows are as large as those of the bodies' @p stiffness, N/m, as
  /// Contact::scale_constraints() makes its own. Collective.
  template <int dim>
  Ties assemble_ties(const FiniteElementSpace<dim> &spaces, double stiffness);

  /// Assembles the ties on another space of the mesh with the scale of given ones. Collective.
  template <int dim>
  Ties assemble_ties_as(const Ties &given, const FiniteElementSpace<dim> &spaces);
} // namespace squeal
