#pragma once

#include <squeal/contact/contact.h>
#include <squeal/linalg/complex_multi_vector.h>
#include <squeal/linalg/dense.h>

#include <array>
#include <complex>
#include <functional>
#include <map>

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
    /// Part of an interface at faces of one level of refinement: between small cells the edge is
    /// elsewhere, in spacings, than between large ones. The interfaces' parts of level k come
    /// before those of level k + 1.
    struct Part
    {
      unsigned int interface, level;
    };
    std::vector<Part> parts;                            ///< all there are on the mesh
    std::vector<unsigned int> releasing, closing;       ///< R, C: rows
    std::vector<unsigned int> releasing_at, closing_at; ///< the part of each
    /// By part: static energy that R releases, Lambda_R^T slack Lambda_R / 2, and that it
    /// would take to close C, r_C^T pressure r_C / 2 with r_C = b x - g_C; J, without their signs.
    /// Zero of interfaces that do not slide.
    std::vector<double> release_energy, closing_energy;
    DenseMatrix slack;    ///< (E_R^T A^{-1} E_R)^{-1}, a pseudo-inverse
    DenseMatrix pressure; ///< (c - b A^{-1} a)^{-1}, likewise
    Matrix closed;        ///< the contact's matrix N + d tau/dp in which C is closed
  };

  using ColumnSolver =
      std::function<MultiVector(const MultiVector &, const std::vector<unsigned int> &multipliers)>;

  /// @p state is the static equilibrium with its pressures.
  /// @p solve gives A^{-1} of a block with a column for each of some multipliers, whose rows it is
  /// told; where these are images of each other in a symmetric brake, so are the columns.
  /// Empty sets without lift-off and for penalty contact, whose
  /// edge is placed by quadrature points. Changes that leave a singular system are left out, as
  /// that of a pad all of whose contacts are at the edge and which would move freely without them:
  /// their resultant is no matter of where the edge is. Collective.
  template <int dim>
  ContactEdge find_contact_edge(const Contact<dim> &contact, const ContactPressure &pressure,
                                const RowRange &rows, bool with_friction, const MultiVector &state,
                                const ColumnSolver &solve);

  /// z_i^H dQ x_j of right and left vectors X and Z: what another edge does to the operator.
  /// Opening R and closing C give
  ///     F_o = z_R^H (E_R^T A^{-1} E_R)^{-1} x_R,   F_c = -(a^T z)^H (c - b A^{-1} a)^{-1} b x,
  /// with the static response in place of that at the frequency of the mode. Between them effects
  /// are a parabola F(s) through F_o, 0 and F_c at the shifts s = -1, 0 and 1 of the edge.
  ///
  /// Nodes know the edge to half of their spacing; the static state knows more. Where its pressures
  /// at R are small beside what it would take to close C the edge lies inside, and the other way
  /// round. With the energies e_o, e_c of ContactEdge and the share r of the closing in the modes'
  /// answers, r = sum |F_c| / sum |F_o|, which takes off what R and C differ in stiffness,
  ///     q = sqrt(e_c / (r e_o)),    s = (1 - q)/(1 + q)/2 - 1/5.
  /// This is measured: s that makes growth rates right on twelve meshes of three brakes
  /// (tests/benchmark/lift_off.py) lies within 0.15 of it. So the edge is there to a fifth of the
  /// spacing. Each part of the edge has its own s. Where q is beyond those of the measurement, as
  /// at a chamfer's edge, and between bodies that do not slide, it is anywhere within half a
  /// spacing.
  struct EdgeEffects
  {
    using Effect = std::vector<std::complex<double>>; ///< column-major
    Effect opening, closing;                          ///< F_o, F_c
    struct Shifts
    {
      Effect smaller, larger; ///< area in contact, at most
      Effect likeliest;       ///< F(s); zero for edges that are not known better than the spacing
    };
    std::vector<Shifts> by_level; ///< of the faces' refinement: what one says of another is little
    /// By interface: z_j^H dQ x_j of the shifts that change it most, one for each mode.
    std::map<unsigned int, std::vector<std::complex<double>>> by_interface;
    /// The multipliers beside the edge and their parts of z_j^H dQ x_j, one for each mode.
    std::vector<unsigned int> rows;
    std::vector<std::vector<std::complex<double>>> parts;
  };
  /// Empty without an edge. Collective.
  EdgeEffects edge_effects(const ContactEdge &edge, const ComplexMultiVector &x,
                           const ComplexMultiVector &z);
} // namespace squeal
