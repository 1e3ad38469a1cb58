#pragma once

#include <squeal/eigen/inertia_count.h>

#include <memory>
#include <vector>

namespace squeal
{
  /// Counts the modes of conservative reference problems that differ in the coefficients of their
  /// terms and in which contacts are open, most of them without a factorisation of their own.
  ///
  /// With K = sum k_i K_i and M = sum m_i M_i of semidefinite matrices the eigenfrequencies rise
  /// with each k_i and fall with each m_i (Courant, Fischer): of the problems in a box of
  /// coefficients, all with the same contacts, the softest has the most and the stiffest the fewest
  /// modes below a frequency. If these two have as many, so have all; and for other contacts they
  /// are counted by their factors (InertiaCount). The box grows with what is counted, as long as
  /// its corners agree; a problem whose own corners do not agree is factorised.
  class BracketedCount
  {
  public:
    /// @p semidefinite: whether matrices of inertia, elasticity and transport are.
    BracketedCount(const RowRange &rows, const unsigned int n_local_constraints, const double omega,
                   const bool semidefinite)
        : rows(rows), n_local_constraints(n_local_constraints), omega(omega),
          semidefinite(semidefinite)
    {
    }
    const RowRange &row_range() const
    {
      return rows;
    }
    /// The number of modes below omega of the reference problem of these terms. Throws SolverError.
    /// Collective.
    unsigned int count(const std::vector<Term> &terms);
    /// Begins with an empty box.
    void forget_box()
    {
      softest = stiffest = {};
      failed.clear();
    }

  private:
    /// Conservative terms.
    struct Problem
    {
      TermList semidefinite;
      std::vector<Term> others, contact;
      /// How stiff each semidefinite matrix makes: its coefficients of the orders 0 and, negative,
      /// 2.
      std::vector<double> stiffness() const;
    };
    struct Corner
    {
      std::vector<double> stiffness;
      std::shared_ptr<InertiaCount> count;
    };
    struct Box
    {
      std::vector<double> low, high;
      bool contains(const std::vector<double> &stiffness) const;
    };
    Problem problem_of(const std::vector<Term> &terms) const;
    /// Whether only coefficients of semidefinite matrices and contacts differ from those of the
    /// box.
    bool belongs_to_box(const Problem &problem) const;
    Box box() const
    {
      return {softest.stiffness, stiffest.stiffness};
    }
    /// A corner with the factors of @p known if it is that.
    Corner corner(const std::vector<double> &stiffness, const Corner &known) const;
    unsigned int count_at(const Corner &corner, const Problem &problem) const;
    unsigned int count_alone(const Problem &problem);
    /// Whether corners agree.
    bool agree(const Corner &soft, const Corner &stiff, const Problem &problem,
               unsigned int &n_modes) const;

    const RowRange rows;
    const unsigned int n_local_constraints;
    const double omega;
    const bool semidefinite;
    Problem of_box; ///< the first in it
    Corner softest, stiffest;
    std::vector<Box> failed; ///< whose corners do not agree
    std::shared_ptr<InertiaCount> alone;
  };
} // namespace squeal
