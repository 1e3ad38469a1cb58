#pragma once

#include <squeal/linear_algebra.h>

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
    velocity          ///< a given velocity matrix (scene matrices)
  };

  /// Whether a term belongs to the conservative reference problem, by which modes are counted.
  inline bool is_conservative(const Origin origin)
  {
    return origin == Origin::inertia || origin == Origin::elasticity || origin == Origin::contact ||
           origin == Origin::transport || origin == Origin::prestress;
  }

  /// Whether a term acts on the contact surfaces only.
  inline bool is_of_contact(const Origin origin)
  {
    return origin == Origin::contact || origin == Origin::friction ||
           origin == Origin::friction_damping || origin == Origin::falling_friction ||
           origin == Origin::turning_friction;
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

  /// (l^2 M + l P + Q) x = 0 with real matrices, M symmetric positive semi-definite. No mesh, no
  /// dimension.
  struct QuadraticEigenproblem
  {
    RowRange rows;
    Matrix M, P, Q;                       ///< P may be empty
    unsigned int n_constraints       = 0; ///< rows of contact pressures: M and P vanish there
    unsigned int n_local_constraints = 0; ///< of this rank; they are its last rows
    /// Whether the contact is compliant: the constraint N^T u = C Lambda has a matrix C > 0, so
    /// that the pressures follow from the displacements by themselves.
    bool compliant = false;

    /// The symmetric position matrix of the conservative reference problem l^2 M + Q_ref, whose
    /// modes can be counted by inertia; empty: Q itself is symmetric and there is no P.
    Matrix reference;
    std::string reference_name; ///< what the reference problem is, for the log

    /// Whether zero eigenvalues must be looked for (they rule out a shift of zero).
    bool may_move_rigidly = true;
  };

  /// sum over the terms of one order, or the empty matrix.
  Matrix sum_of(const RowRange &rows, const std::vector<Term> &terms, unsigned int order);

  /// The number of eigenfrequencies below @p omega of the conservative reference problem, by the
  /// inertia of an LDL^T factorisation of Q_ref - omega^2 M (Sylvester): negative pivots minus one
  /// per constraint.
  unsigned int count_reference_modes(const QuadraticEigenproblem &problem, double omega);
} // namespace squeal
