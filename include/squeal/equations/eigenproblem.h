#pragma once

#include <squeal/base/names.h>
#include <squeal/linalg/low_rank.h>
#include <squeal/linalg/multi_vector.h>
#include <squeal/parameters/stiffness_factor.h>

#include <complex>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace squeal
{
  /// Where a term of the equations of motion comes from.
  enum class Origin
  {
    inertia,
    elasticity,
    material_damping,
    transport,
    contact,          ///< normal coupling N
    friction,         ///< mu T, circulatory
    friction_damping, ///< P_R, Q_R of the turning sliding direction
    falling_friction, ///< P_R, Q_R of mu'
    prestress,        ///< geometric stiffness of the static stress and pressure, conservative
    turning_friction, ///< geometric stiffness of the friction traction, circulatory
    velocity,         ///< a given velocity matrix (scene matrices)
    joint,            ///< ties, points, springs, dashpots, rigid links
    contact_damping   ///< dashpots of the contact surfaces
  };
  inline std::array<std::string, 13> names_of(Origin)
  {
    return {{"inertia", "elasticity", "material damping", "transport", "contact", "friction",
             "friction damping", "falling friction", "prestress", "turning friction",
             "velocity matrix", "joint", "contact damping"}};
  }

  /// Whether a term belongs to the conservative reference problem, by which modes are counted.
  inline bool is_conservative(const Origin origin)
  {
    return origin == Origin::inertia || origin == Origin::elasticity || origin == Origin::contact ||
           origin == Origin::transport || origin == Origin::prestress || origin == Origin::joint;
  }

  /// Whether a term acts on the contact surfaces only.
  inline bool is_of_contact(const Origin origin)
  {
    return origin == Origin::contact || origin == Origin::friction ||
           origin == Origin::friction_damping || origin == Origin::falling_friction ||
           origin == Origin::turning_friction || origin == Origin::contact_damping;
  }

  /// One term coefficient * matrix * (d/dt)^order u of the equations of motion. Matrices are shared
  /// between terms: D = alpha M + beta K stores nothing.
  struct Term
  {
    Origin origin;
    unsigned int order; ///< 0: position, 1: velocity, 2: acceleration
    double coefficient;
    std::shared_ptr<const Matrix> matrix;
  };

  /// What the stiffness c A, a term of order zero and itself relaxed, becomes by f beyond itself:
  /// (f(l) - 1) c A.
  struct RelaxationTerm
  {
    Origin origin;
    double coefficient;
    std::shared_ptr<const Matrix> matrix;
    StiffnessFactor factor;
    /// What A is made of, if it has no entries; then f is 1 at rest, and nothing of it is frozen.
    std::shared_ptr<const LowRank> low_rank = {};
  };

  /// What is left of (f(l) - 1) c A once it is frozen at a frequency w, which makes a quadratic
  /// problem of the rest: h(l) A with
  ///     h(l) = c (f(l) - Re f(i w)).
  struct FrozenTerm
  {
    double coefficient;
    Matrix matrix; ///< A
    StiffnessFactor factor;
    double frequency; ///< w, 1/s

    std::complex<double> h(std::complex<double> l) const;
    std::complex<double> derivative(std::complex<double> l) const;
    /// (h(l) - h(m)) / (l - m).
    std::complex<double> quotient(std::complex<double> l, std::complex<double> m) const;
  };

  /// The terms of one order that are not zero.
  std::vector<Term> terms_of_order(const std::vector<Term> &terms, unsigned int order);

  struct EquationsOfMotion;

  /// (l^2 M + l P + Q) x = 0 with real matrices, M symmetric positive semi-definite. No mesh, no
  /// dimension.
  struct QuadraticEigenproblem
  {
    RowRange rows;
    Matrix M, P, Q; ///< P may be empty
    /// If there are any: the problem is (l^2 M + l P + Q + sum h(l) A) x = 0, and the quadratic one
    /// is where its solution begins.
    std::vector<FrozenTerm> frozen;
    /// If the matrices are given and frozen terms are there: the equations, whose matrices have not
    /// been rounded by sums. One frozen term for each of relaxation.
    std::shared_ptr<const EquationsOfMotion> given;
    /// Rows of contact pressures and of tractions of joints: M and P vanish there.
    unsigned int n_constraints       = 0;
    unsigned int n_local_constraints = 0; ///< of this rank; they are its last rows
    /// Whether the contact is compliant: the constraint N^T u = C Lambda has a matrix C > 0, so
    /// that the pressures follow from the displacements by themselves.
    bool compliant = false;

    /// The symmetric position matrix of the conservative reference problem l^2 M + Q_ref, whose
    /// modes can be counted by inertia, or what makes Q_ref - omega^2 M of it: it is wanted once or
    /// twice, and then its memory for other things. Neither: Q itself is symmetric and there is no
    /// P.
    Matrix reference;
    std::function<Matrix(double omega)> make_shifted_reference;
    std::string reference_name; ///< what the reference problem is, for the log

    bool has_reference() const
    {
      return reference || make_shifted_reference;
    }
    /// Q_ref - omega^2 M.
    Matrix shifted_reference(double omega) const;

    /// A problem of the same unknowns and constraints, without matrices and references.
    QuadraticEigenproblem of_same_unknowns() const;

    /// Whether zero eigenvalues must be looked for (they rule out a shift of zero).
    bool may_move_rigidly = true;
    bool may_excite       = true; ///< may_excite() of its terms
  };

  /// Whether velocity terms may feed energy: the symmetric part of their sum need not be positive.
  bool may_excite(const std::vector<Term> &terms);

  /// The equations of motion as they are before their terms are summed: the sectors of a symmetric
  /// brake sum theirs each by itself, and nobody the whole.
  struct EquationsOfMotion
  {
    RowRange rows;
    std::vector<Term> terms;

    /// The position matrix of the reference problem, by which modes are counted.
    enum class Reference
    {
      conservative_terms,
      symmetric_part ///< of all position terms
    };
    Reference reference = Reference::conservative_terms;
    std::string reference_name; ///< as the other members of QuadraticEigenproblem
    unsigned int n_constraints = 0, n_local_constraints = 0;
    bool compliant = false, may_move_rigidly = true;

    std::vector<RelaxationTerm> relaxation;
    double frozen_at = 0; ///< 1/s; 0: not frozen
    /// Whether the matrices are given to the last digit (not integrals, which are rounded anyway).
    bool matrices_are_given = false;

    /// The terms with the frozen part of the relaxation: of each (f(l) - 1) c A
    ///     (Re f(i w) - 1) c A   as stiffness; all of the damping is left to FrozenTerm.
    EquationsOfMotion frozen(double frequency) const;

    /// The terms of one order that are not zero.
    std::vector<Term> of_order(unsigned int order) const;
    /// Those of the reference problem; none if it is the problem itself.
    std::vector<Term> reference_terms() const;
    /// Those of Q_ref - omega^2 M.
    std::vector<Term> shifted_reference_terms(double omega) const;
    /// All of the problem but its matrices.
    QuadraticEigenproblem without_matrices() const;
  };

  /// The terms of each order summed; the reference is made from the terms when it is wanted.
  QuadraticEigenproblem sum_of(const EquationsOfMotion &equations);

  /// sum over the terms, or the empty matrix.
  Matrix sum_of_terms(const RowRange &rows, const std::vector<Term> &terms);
  /// The same of those of one order.
  Matrix sum_of(const RowRange &rows, const std::vector<Term> &terms, unsigned int order);
  /// The same without entries, which would take memory: for a few products.
  Matrix matrix_free_sum_of(const RowRange &rows, const std::vector<Term> &terms,
                            unsigned int order);
} // namespace squeal
