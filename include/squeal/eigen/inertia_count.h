#pragma once

#include <squeal/equations/eigenproblem.h>
#include <squeal/equations/term_list.h>
#include <squeal/linalg/factorization.h>
#include <squeal/projection/search_region.h>

#include <map>
#include <memory>
#include <vector>

namespace squeal
{
  /// A vector of scattered numbers: products with it tell matrices apart.
  MultiVector scattered_vector(const RowRange &rows);

  /// Rows of constraints that act on no displacement in any of these matrices, ascending, on all
  /// ranks. Constraints are the last @p n_local_constraints of each rank's rows. Collective.
  std::vector<unsigned int> open_constraints(const RowRange &rows, unsigned int n_local_constraints,
                                             const std::vector<const Matrix *> &coupling);

  /// Whether the inertia of the reference counts the problem's own modes: there is no P, and Q is
  /// the reference up to rounding. Collective.
  bool is_own_reference(const QuadraticEigenproblem &problem);

  /// The number of eigenfrequencies below @p omega of the conservative reference problem, by the
  /// inertia of an LDL^T factorisation of Q_ref - omega^2 M (Sylvester): negative pivots minus one
  /// per constraint.
  unsigned int count_reference_modes(const QuadraticEigenproblem &problem, double omega);
  /// Counts with a Q_ref - omega^2 M that is given.
  unsigned int count_reference_modes(const QuadraticEigenproblem &problem, const Matrix &shifted);
  /// Counts below several frequencies, with one sum of the matrices and one analysis of their
  /// pattern: @p shifted is Q_ref - omegas[0]^2 M.
  std::vector<unsigned int> count_reference_modes(const QuadraticEigenproblem &problem,
                                                  const std::vector<double> &omegas,
                                                  Matrix shifted);

  /// Throws SolverError if modes of a region must be missing: there are fewer, overdamped ones
  /// included, than the reference problem has well inside, beside @p n_zero at zero frequency.
  /// Friction and damping are taken to change |l| by at most a factor of two, of a tenth at the
  /// ends of a window. More modes than those of the reference may come in: strong damping makes the
  /// highest ones slow. Collective.
  void check_for_missing(const QuadraticEigenproblem &problem, const SearchRegion &region,
                         unsigned int n_found, unsigned int n_zero);

  /// count_reference_modes() with a memory: counts again only if the reference problem is another
  /// one, which the products with a fixed vector tell.
  class RememberedCounts
  {
  public:
    /// The numbers of modes below each of the @p omegas. Throws SolverError. Collective.
    std::vector<unsigned int> operator()(const QuadraticEigenproblem &problem,
                                         const std::vector<double> &omegas);

  private:
    struct Count
    {
      std::vector<double> fingerprint; ///< of Q_ref - omega^2 M and M
      std::vector<unsigned int> n_modes;
    };
    std::map<std::vector<double>, Count> counted; ///< by the omegas
  };

  /// Counts the modes of reference problems by inertia (count_reference_modes()), of several that
  /// differ in which contacts are open, with one factorisation.
  ///
  /// Contacts R that open take their rows and columns out of A = Q_ref - omega^2 M. With the Schur
  /// complement S of what is left, S^{-1} = (A^{-1})_RR and
  ///     negative(A without R) = negative(A) - negative((A^{-1})_RR)
  /// (Haynsworth), at the cost of a solution for each row of R.
  class InertiaCount
  {
  public:
    InertiaCount(const RowRange &rows, const unsigned int n_local_constraints, const double omega)
        : rows(rows), n_local_constraints(n_local_constraints), omega(omega)
    {
    }
    const RowRange &row_range() const
    {
      return rows;
    }
    /// Counts the modes of these terms' reference problem. Throws SolverError. Collective.
    unsigned int count(const std::vector<Term> &terms);

  private:
    /// A factorised problem whose contacts are to be opened.
    struct Base
    {
      KnownTerms bodies; ///< conservative terms without the contact's
      std::shared_ptr<const Matrix> contact;
      std::vector<unsigned int> open; ///< rows of open contacts, ascending
      std::unique_ptr<const Factorization> factors;
      unsigned int negative = 0;
      std::vector<unsigned int> solved; ///< rows with a column of A^{-1}
      MultiVector columns;
      /// The last contact that was compared with the base's: nearby problems have the same.
      struct
      {
        std::shared_ptr<const Matrix> contact;
        std::vector<unsigned int> open;
        bool is_left = false;
      } compared;
    };
    unsigned int n_constraints() const;
    bool has_bodies_of_base(const std::vector<Term> &others) const
    {
      return base.factors && base.contact && base.bodies.are(others);
    }
    /// A contact without what is open both in the base and in this one.
    std::shared_ptr<const Matrix>
    closed_where_either_is(const Matrix &contact, const std::vector<unsigned int> &open) const;
    /// Whether these terms are the base's with more contacts open.
    bool is_opened_base(const std::vector<Term> &others,
                        const std::shared_ptr<const Matrix> &contact,
                        const std::vector<unsigned int> &open);
    void make_base(const std::vector<Term> &others, std::shared_ptr<const Matrix> contact,
                   std::vector<unsigned int> open);
    /// negative((A^{-1})_RR), or -1 if rounding might decide.
    int negative_of_inverse(const std::vector<unsigned int> &added);

    const RowRange rows;
    const unsigned int n_local_constraints;
    const double omega;
    Base base;
  };
} // namespace squeal
