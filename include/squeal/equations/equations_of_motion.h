#pragma once

#include <squeal/base/names.h>
#include <squeal/linalg/low_rank.h>
#include <squeal/linalg/multi_vector.h>
#include <squeal/parameters/stiffness_factor.h>

#include <array>
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

  /// The terms of one order that are not zero.
  std::vector<Term> terms_of_order(const std::vector<Term> &terms, unsigned int order);
  /// Whether velocity terms may feed energy: the symmetric part of their sum need not be positive.
  bool may_excite(const std::vector<Term> &terms);

  /// Sums the terms; empty if all are zero.
  Matrix sum_of_terms(const RowRange &rows, const std::vector<Term> &terms);
  /// Sums the terms of one order.
  Matrix sum_of(const RowRange &rows, const std::vector<Term> &terms, unsigned int order);
  /// The sum of one order without entries, which would take memory: for a few products.
  Matrix matrix_free_sum_of(const RowRange &rows, const std::vector<Term> &terms,
                            unsigned int order);

  struct QuadraticEigenproblem;

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

    /// Adds to the terms what of the relaxation is frozen at a frequency w: of each (f(l) - 1) c A
    ///     (Re f(i w) - 1) c A   as stiffness; all of the damping is left to FrozenTerm.
    EquationsOfMotion frozen(double frequency) const;

    /// The terms of one order that are not zero.
    std::vector<Term> of_order(unsigned int order) const;
    /// The position terms of the reference problem; none if it is the problem itself.
    std::vector<Term> reference_terms() const;
    /// The terms of Q_ref - omega^2 M.
    std::vector<Term> shifted_reference_terms(double omega) const;
    /// The problem that the terms make, but for its matrices. Throws std::logic_error if what
    /// relaxes is not frozen.
    QuadraticEigenproblem without_matrices() const;
  };
} // namespace squeal
