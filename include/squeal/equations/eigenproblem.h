#pragma once

#include <squeal/equations/equations_of_motion.h>

#include <complex>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace squeal
{
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

  /// Sums the terms of each order; the reference is made from the terms when it is wanted. Throws
  /// std::logic_error if what relaxes is not frozen.
  QuadraticEigenproblem sum_of(const EquationsOfMotion &equations);
} // namespace squeal
