#pragma once

#include <squeal/contact/contact_matrices.h>
#include <squeal/equations/sector.h>
#include <squeal/equations/term_list.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace squeal
{
  /// The tangent of the static problem at fixed active set, the sum of these terms: the body terms
  /// of order 0, N, and with friction d tau/dp at the given pressure. Those of the contact are made
  /// by @p matrices.
  template <int dim>
  std::vector<Term> static_terms(const std::vector<Term> &body_terms, const Contact<dim> &contact,
                                 const ContactPressure &pressure, bool with_friction,
                                 ContactMatrices<dim> &matrices);

  class ReleaseSolver;

  /// Linear problems of the static equilibrium by factors (LU by MUMPS, one step of iterative
  /// refinement).
  ///
  /// A friction law that depends on the pressure, and penalty contact with its many points, change
  /// the matrix in each step; for mortar contact one factorisation serves all active sets that are
  /// not too different. Made for one state it has the active set at which it is first needed. Else
  /// all contacts are closed in it, and it serves all sets of a moderate number of releases, and
  /// all friction coefficients and loads: serves() tells, so that a sweep may keep it.
  ///
  /// A brake and a load that are their own mirror image have a symmetric state: with the basis V of
  /// symmetric vectors, V^T A V y = V^T b is a problem of half the size (theory.md, section 4). The
  /// antisymmetric half is needed for what is no state, as the effects of single contacts. Where
  /// there are several ranks, half of them factorises each. Symmetry of matrix, right side and
  /// active set is checked; without it the whole is solved.
  template <int dim>
  class DirectStatics
  {
  public:
    /// @p sectors of the mesh. @p all_sectors: solve_columns() will be called. @p for_one_state:
    /// the load, the friction coefficient and the bodies stay as they are. Only the @p body_terms
    /// of order 0 are used.
    DirectStatics(const RowRange &rows, const std::vector<Term> &body_terms,
                  const ContactModel<dim> &model, bool with_friction, Sectors sectors,
                  bool all_sectors, bool for_one_state = false);
    ~DirectStatics();

    /// Whether one factorisation serves this contact and others.
    static bool may_serve(const Contact<dim> &contact)
    {
      return may_serve(contact.contact_model()) &&
             contact.released_multipliers().size() <= most_releases;
    }
    /// Whether the factors are also those of other bodies' terms and another contact, up to the
    /// active set and the friction coefficient. Collective.
    bool serves(const std::vector<Term> &body_terms, const Contact<dim> &contact) const;

    const std::vector<Term> &body_terms() const
    {
      return of_bodies;
    }

    /// The state at the present active set and the pressure of the step before. Throws SolverError.
    MultiVector solve(const Contact<dim> &contact, const ContactPressure &pressure,
                      const MultiVector &right_hand_side);

    /// |b - A x| / |b| of the last solution: large where A is singular.
    double relative_residual() const;

    /// Solutions of the last linear problem for other right sides, one for each of the given
    /// multipliers' rows. If multipliers are images of each other, so are their right sides.
    MultiVector solve_columns(const Contact<dim> &contact, const MultiVector &right_hand_sides,
                              const std::vector<unsigned int> &multipliers);

  private:
    static constexpr unsigned int most_releases = 400;
    /// As many solutions cost more than new factors.
    static constexpr unsigned int most_changes = 150;

    static bool may_serve(const ContactModel<dim> &model)
    {
      return model.mortar && !model.friction_is_nonlinear();
    }

    struct Part
    {
      Sector sector;
      std::unique_ptr<ReleaseSolver> solver; ///< on the ranks that have a part of it
    };
    /// New factors of the tangent, with the constraints of the multipliers @p open released.
    void factorise(const Contact<dim> &contact, const ContactPressure &pressure,
                   const std::vector<unsigned int> &open);
    /// Makes factors that serve other active sets, too.
    void factorise_once(const Contact<dim> &contact, const ContactPressure &pressure);
    bool needs_factors(const std::vector<unsigned int> &released) const;
    double change_of_friction(const Contact<dim> &contact, const ContactPressure &pressure);
    void make_parts();
    /// The whole from now on.
    void forget_sectors();

    const RowRange rows; ///< of the whole
    const std::vector<Term> of_bodies;
    const bool with_friction, all_sectors, for_one_state;
    bool factor_once;
    Sectors sectors;
    std::vector<Part> parts;
    ContactMatrices<dim> contact_matrices;
    /// What factors for all active sets were made with.
    struct Base
    {
      Contact<dim> contact;                   ///< all closed
      double coefficient;                     ///< of friction_slopes()
      ContactPressure slopes;                 ///< likewise; none: without friction so far
      std::shared_ptr<const Matrix> friction; ///< once another coefficient needs it
    };
    std::optional<Base> base;
  };
} // namespace squeal
