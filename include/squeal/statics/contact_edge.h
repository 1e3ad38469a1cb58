#pragma once

#include <squeal/contact/contact.h>
#include <squeal/linalg/complex_multi_vector.h>
#include <squeal/linalg/dense.h>

#include <array>
#include <complex>
#include <functional>

namespace squeal
{
  /// What is uncertain about the area in contact. A mesh places the edge of the contact zone
  /// between two nodes of a pad's face; one more node on either side may belong to the other part.
  /// With A the tangent at the present contacts (theory.md, section 3),
  ///
  /// * the closed multipliers R beside open ones may release. The constraint gets a slack s,
  ///       A x = E_R s,   x_R = 0;
  /// * the open ones C beside closed ones may close. Let a, b, c be their columns, rows and the
  ///   block between them of the matrix in which they are closed:
  ///       A x + a Lambda_C = 0,   b x + c Lambda_C = 0.
  ///
  /// Both are changes of low rank, which are solved exactly in what is static: nothing is linear
  /// in the pressure that is lost, for a contact that opens is no small perturbation.
  struct ContactEdge
  {
    std::vector<unsigned int> releasing, closing; ///< R, C: rows
    DenseMatrix slack;                            ///< (E_R^T A^{-1} E_R)^{-1}, a pseudo-inverse
    DenseMatrix pressure;                         ///< (c - b A^{-1} a)^{-1}, likewise
    Matrix closed; ///< the contact's matrix N + d tau/dp in which C is closed
  };

  using ColumnSolver =
      std::function<MultiVector(const MultiVector &, const std::vector<unsigned int> &multipliers)>;

  /// @p solve gives A^{-1} of a block with a column for each of some multipliers, whose rows it is
  /// told; where these are images of each other in a symmetric brake, so are the columns.
  /// Empty sets without lift-off and for penalty contact, whose
  /// edge is placed by quadrature points. Changes that leave a singular system are left out, as
  /// that of a pad all of whose contacts are at the edge and which would move freely without them:
  /// their resultant is no matter of where the edge is. Collective.
  template <int dim>
  ContactEdge find_contact_edge(const Contact<dim> &contact, const ContactPressure &pressure,
                                const RowRange &rows, bool with_friction,
                                const ColumnSolver &solve);

  /// z_i^H dQ x_j of right and left vectors X and Z: what another edge does to the operator.
  /// Opening R and closing C give
  ///     F_o = z_R^H (E_R^T A^{-1} E_R)^{-1} x_R,   F_c = -(a^T z)^H (c - b A^{-1} a)^{-1} b x,
  /// with the static response in place of that at the frequency of the mode. Nodes know the edge
  /// to half of their spacing: the parabola through F_c, 0 and F_o at the shifts -1, 0 and 1 is
  /// taken at -1/2 and 1/2.
  struct EdgeEffects
  {
    std::vector<std::complex<double>> smaller, larger; ///< area in contact; column-major
    /// The multipliers beside the edge and their parts of z_j^H dQ x_j, one for each mode.
    std::vector<unsigned int> rows;
    std::vector<std::vector<std::complex<double>>> parts;
  };
  /// Empty without an edge. Collective.
  EdgeEffects edge_effects(const ContactEdge &edge, const ComplexMultiVector &x,
                           const ComplexMultiVector &z);
} // namespace squeal
