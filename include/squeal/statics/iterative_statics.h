#pragma once

#include <squeal/bodies/material_operator.h>
#include <squeal/contact/contact.h>
#include <squeal/linalg/gmres.h>
#include <squeal/parameters/choices.h>

#include <memory>
#include <string>
#include <vector>

namespace squeal
{
  template <int dim>
  class DisplacementOperator;

  /// How the static equilibrium is solved for iteratively.
  struct IterativeOptions
  {
    Multigrid multigrid     = Multigrid::gamg;
    unsigned int iterations = 300; ///< of GMRES, for one linear problem
  };

  /// Linear problems of the static equilibrium without factors and without the bodies' matrices,
  ///
  ///     [ A    N + mu T ] [ u ]   [ f ]
  ///     [ N^T    -C     ] [ L ] = [ g ],
  ///
  /// by GMRES. Two steps make the preconditioner. First the constraints, weighted with a diagonal
  /// D, are added to the equilibrium of forces (augmented Lagrangian; Golub and Greif 2003). That
  /// changes no solution, holds pads that contact alone holds, and makes the Schur complement of
  /// the multipliers simple:
  ///
  ///     [ I  N D ]          A + N D N^T,    Schur complement ~ -D^{-1}.
  ///     [ 0   I  ]
  ///
  /// D is the inverse of the compliance that the multipliers would see if the bodies' stiffness
  /// were its diagonal, N^T diag(A)^{-1} N + C: so N D N^T is as large as A, on every mesh, and
  /// multigrid does as well with A + N D N^T as with A. Then a block triangular matrix (Murphy,
  /// Golub, Wathen 2000) with a multigrid cycle for the displacements:
  ///
  ///     [ A + N D N^T    N (I - D C) + mu T ]
  ///     [     0               -D^{-1}       ].
  ///
  /// For penalty contact there are no multipliers, and the cycle is for A + N.
  template <int dim>
  class IterativeStatics
  {
  public:
    /// @p spaces must outlive it unchanged. Collective.
    IterativeStatics(const FiniteElementSpace<dim> &spaces,
                     const std::vector<MaterialOperator> &bodies, const IterativeOptions &options);
    ~IterativeStatics();

    /// As large as the rows of the stiffness, for Contact::scale_constraints.
    double stiffness_scale() const;

    /// The product with the matrix above at the present active set; @p pressure for d tau/dp.
    LinearOperator tangent(const Contact<dim> &contact, const ContactPressure &pressure,
                           bool with_friction) const;

    /// Solves with the matrix above from the given x on until the preconditioned residual, which is
    /// an estimate of the error, has @p tolerance of its first size or of that of the solution.
    /// Returns the number of GMRES steps. Throws SolverError if the allowed ones are not enough.
    unsigned int solve(const Contact<dim> &contact, const ContactPressure &pressure,
                       bool with_friction, const MultiVector &b, double tolerance, MultiVector &x);

    /// Makes the preconditioner for the present active set, which solve() does by itself.
    void set_up(const Contact<dim> &contact, const ContactPressure &pressure, bool with_friction);

    /// The multigrid cycle for A + N D N^T (penalty: A + N) at the active set of the last solve()
    /// or set_up(), column by column; zero in the rows of multipliers.
    MultiVector cycle(const MultiVector &forces) const;

    /// A.
    const DisplacementOperator<dim> &stiffness() const;

    /// What it works with, for the log.
    std::string description() const;

  private:
    /// The preconditioner at one active set.
    struct Preconditioner;

    const FiniteElementSpace<dim> &spaces;
    const IterativeOptions options;
    struct Bodies; ///< matrix-free product and multigrid
    const std::unique_ptr<Bodies> bodies;
    std::unique_ptr<Preconditioner> preconditioner;
  };
} // namespace squeal
