#pragma once

#include <squeal/equations/term_list.h>
#include <squeal/linalg/compressed_rows.h>
#include <squeal/linalg/multi_vector.h>

#include <memory>
#include <vector>

namespace squeal
{
  /// The terms that change with the contact, in the few rows that they couple: the interface.
  /// Vectors are seen there as small matrices on all ranks, with a row of the interface as a column
  /// and a vector as a row.
  class InterfaceTerms
  {
  public:
    /// C, the constraints of displacements, in the interface.
    class Constraints
    {
    public:
      /// C w, a constraint a column.
      DenseMatrix violations(const DenseMatrix &at_rows) const;
      /// C^T p.
      DenseMatrix forces_of(const DenseMatrix &pressures) const;
      /// - (C C^T)^{-1} C w, a constraint a column.
      DenseMatrix balancing_pressures(const DenseMatrix &at_rows) const;
      /// - C^T (C C^T)^{-1} C w.
      DenseMatrix shortest_change(const DenseMatrix &at_rows) const
      {
        return forces_of(balancing_pressures(at_rows));
      }

      std::vector<unsigned int> rows; ///< by constraint, in the interface

    private:
      friend class InterfaceTerms;
      CompressedRows transposed; ///< C^T
      PositiveFactors squares;   ///< of C C^T
      KnownTerms terms;          ///< that C was found in
    };

    InterfaceTerms() = default;
    /// Pressures are the last @p n_local_constraints of this rank's rows; @p compliant as in
    /// QuadraticEigenproblem.
    InterfaceTerms(const RowRange &rows, const unsigned int n_local_constraints,
                   const bool has_constraints, const bool compliant)
        : whole(rows), n_local_constraints(n_local_constraints), has_constraints(has_constraints),
          compliant(compliant)
    {
    }

    /// The interface becomes the rows that any rank has touched. Collective.
    void set_rows(std::vector<char> touched);
    const std::vector<unsigned int> &rows() const ///< ascending
    {
      return rows_;
    }
    unsigned int n_rows() const
    {
      return rows_.size();
    }
    bool is_compliant() const
    {
      return compliant;
    }
    /// Whether displacements must satisfy constraints.
    bool is_constrained() const
    {
      return has_constraints && !compliant;
    }

    /// Replaces the terms. False if they couple other rows than the interface. Collective.
    bool set_terms(const TermList &given);
    /// C of the present terms for left vectors, (N + mu T)^T.
    const Constraints &left_constraints() const
    {
      return left;
    }
    /// C for right vectors, N^T.
    const Constraints &right_constraints() const
    {
      return right;
    }
    /// How often the right constraints have changed.
    unsigned int n_changes() const
    {
      return n_changes_;
    }
    /// Rows of constraints that couple to nothing.
    std::vector<unsigned int> open_contacts() const;

    /// The forces of the terms of one order on displacements, and on the pressures of a compliant
    /// contact.
    DenseMatrix forces(unsigned int order, const DenseMatrix &at_rows) const;
    /// The forces of pressures by any matrix; empty if it has none. Collective.
    DenseMatrix forces_of_pressures(const Matrix &matrix, const DenseMatrix &pressures) const;
    /// The pressures C^{-1} N^T u of a compliant contact in the constraints' rows; with the
    /// transposed matrices for left vectors.
    DenseMatrix compliant_pressures(const DenseMatrix &at_rows, bool of_left) const;
    /// sum += A B^T for displacements A and forces B.
    void add_products(const DenseMatrix &a, const DenseMatrix &b, DenseMatrix &sum) const;

  private:
    /// The entries of a matrix on all ranks, numbered within the interface, by what they couple.
    struct Sorted
    {
      CompressedRows of_displacements; ///< forces of displacements
      CompressedRows of_pressures;     ///< forces of pressures
      CompressedRows of_constraints;   ///< rows of constraints
    };
    std::shared_ptr<const Sorted> sort(const Matrix &matrix, int &known) const;
    struct Changing
    {
      double coefficient;
      std::shared_ptr<const Sorted> sorted;
    };
    std::vector<Changing> of_order(unsigned int order) const;
    /// Returns whether they have changed.
    bool find_constraints(bool of_left, Constraints &constraints) const;
    /// result += factor times entries times vectors.
    void apply(double factor, const CompressedRows &entries, const DenseMatrix &at_rows,
               DenseMatrix &result) const;

    RowRange whole;
    unsigned int n_local_constraints = 0;
    bool has_constraints = false, compliant = false;
    std::vector<unsigned int> rows_;
    std::vector<int> number;         ///< by row of the whole; -1
    std::vector<char> is_constraint; ///< by interface row
    TermList terms;
    PerMatrix<std::shared_ptr<const Sorted>> sorted; ///< of these
    Constraints left, right;
    unsigned int n_changes_ = 0;
  };
} // namespace squeal
