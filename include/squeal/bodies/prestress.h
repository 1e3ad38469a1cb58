#pragma once

#include <squeal/linalg/multi_vector.h>
#include <squeal/mesh/geometry.h>
#include <squeal/parameters/materials.h>

#include <vector>

namespace squeal
{
  template <int dim>
  class FiniteElementSpace;

  /// The centrifugal load of the given bodies, int -rho Omega^2 (w.grad)w . Phi, N: for w = e_z x x
  /// the force rho Omega^2 (x, y, 0), none for straight transport. One column.
  template <int dim>
  MultiVector assemble_centrifugal_load(const FiniteElementSpace<dim> &spaces,
                                        const std::vector<Body> &bodies, const Material &material,
                                        double angular_velocity);

  /// The geometric stiffness of the stress sigma_0 = C grad u_0 that the displacements @p state
  /// (one column) cause in the given bodies,
  ///     int sigma_0 : grad(du)^T grad(Du),
  /// symmetric. It is what follows of the Green strain's quadratic part; the change of the
  /// elastic stiffness by the strains of u_0, of the order of those strains, is neglected as in
  /// every linear theory of prestress.
  template <int dim>
  Matrix assemble_stress_stiffness(const FiniteElementSpace<dim> &spaces,
                                   const std::vector<Body> &bodies, const Material &material,
                                   const MultiVector &state);
} // namespace squeal
