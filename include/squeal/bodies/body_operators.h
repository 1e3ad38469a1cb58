#pragma once

#include <squeal/linalg/multi_vector.h>
#include <squeal/mesh/geometry.h>
#include <squeal/parameters/materials.h>

#include <memory>
#include <vector>

namespace squeal
{
  template <int dim>
  class FiniteElementSpace;

  /// The matrices of theory.md, section 2, of one material. Rows of other bodies are empty. SI
  /// units.
  struct BodyMatrices
  {
    std::shared_ptr<const Matrix> M; ///< int rho Phi Phi^T
    std::shared_ptr<const Matrix> K; ///< int B C B^T
    std::shared_ptr<const Matrix>
        G; ///< 1/2 int rho [Phi (d_phi Phi)^T - (d_phi Phi) Phi^T]; or null
    std::shared_ptr<const Matrix> M_star; ///< int rho (d_phi Phi)(d_phi Phi)^T; or null
    std::shared_ptr<const Matrix> V;      ///< int B C_v B^T; or null
  };

  /// Which of them are wanted.
  struct BodyMatrixChoice
  {
    bool M = true, K = true, G = false, M_star = false, V = false;
  };

  /// Assembles the wanted matrices of the given bodies in one pass over their cells.
  template <int dim>
  BodyMatrices assemble_body(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                             const Material &material, const BodyMatrixChoice &choice);
  /// M and K, and @p with_transport G and M*.
  template <int dim>
  BodyMatrices assemble_body(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                             const Material &material, bool with_transport);

  /// int B C_k B^T of the laws C_k of the material's elastic_components(), of 1 Pa, in one pass.
  template <int dim>
  std::vector<std::shared_ptr<const Matrix>>
  assemble_stiffnesses(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                       const Material &material);

  /// The load vector of the scene's pressures, each times a factor (none: 1), int -p n . Phi, N.
  /// One column.
  template <int dim>
  MultiVector
  assemble_pressure_load(const FiniteElementSpace<dim> &spaces,
                         const std::function<double(const PressureLoad<dim> &)> &factor = {});
} // namespace squeal
