#pragma once

#include <squeal/equations/term_list.h>
#include <squeal/linalg/dense.h>

#include <array>
#include <complex>
#include <memory>
#include <optional>
#include <vector>

namespace squeal
{
  /// The equations of motion as sums of matrices that stay the same along a path of parameters,
  ///     A_order = sum_i c_i,order A_i + (what changes with the contact),
  /// so that each A_i has to be projected once only. Matrices of one order whose coefficients have
  /// never been seen to change are one A_i; others are an A_i each, for all orders.
  class AffineTerms
  {
  public:
    AffineTerms() = default;
    /// Begins with the terms of an expansion point. Coefficients that @p before has seen to change
    /// are kept apart.
    AffineTerms(const std::vector<Term> &expansion_terms, const AffineTerms &before);

    /// Numbers the expansion point's coefficients that have been seen to change: 3 k + order of its
    /// k-th matrix.
    std::vector<double> varying_terms() const;
    /// Keeps the terms of these numbers apart from now on.
    void keep_apart(const std::vector<double> &varying_terms);
    /// Keeps apart, from the next split() on, what has another coefficient among these terms. What
    /// bodies are made of counts, though the expansion point may have been without it.
    void learn(const std::vector<Term> &terms);

    /// Makes the constant matrices anew from the expansion point's terms and others. Returns by row
    /// whether a matrix that may change couples it on this rank.
    std::vector<char> split(const RowRange &rows, const std::vector<Term> &terms);
    /// The number of constant matrices; zero before split().
    unsigned int size() const
    {
      return parts.size();
    }
    /// A_i x, or A_i^T x.
    MultiVector image(const unsigned int i, const MultiVector &x,
                      const bool transposed = false) const
    {
      return sums.multiply(i, x, transposed);
    }
    /// A_i x of all, with one product for each matrix that they consist of.
    std::vector<MultiVector> images(const MultiVector &x) const
    {
      return sums.multiply_all(x);
    }
    /// Whether A_i = A_i^T, to rounding.
    bool is_symmetric(const unsigned int i) const
    {
      return parts[i].is_symmetric;
    }

    /// Takes the coefficients of these terms. Returns what changes with the contact, or nothing if
    /// a coefficient has changed that a sum contains: split() must be called again for a new
    /// expansion point, which keeps that matrix apart.
    std::optional<TermList> update(const std::vector<Term> &terms);

    bool has_velocity_terms() const
    {
      return has_velocity_terms_;
    }
    double coefficient(const unsigned int order, const unsigned int i) const
    {
      return coefficients[order][i];
    }
    /// sum_order c_i,order l^order.
    std::complex<double> factor(unsigned int i, std::complex<double> lambda) const;
    /// Lower bounds of the 2-norms of the summands, the largest of each order.
    std::array<double, 3> norms() const;
    /// The sum of one order of images or projections of the constant matrices.
    DenseMatrix sum(unsigned int order, const std::vector<DenseMatrix> &by_matrix) const;
    /// The sum of one order times the columns.
    MultiVector multiply(unsigned int order, const MultiVector &block) const;

  private:
    using ByOrder = std::array<bool, 3>;
    /// What is known of A_i.
    struct Part
    {
      std::shared_ptr<const Matrix> matrix; ///< that varies; null for a sum
      ByOrder orders;                       ///< in which it stands
      double norm;
      bool is_symmetric = false;
    };
    /// Makes the parts of the sums.
    void add_parts(const RowRange &rows, std::vector<std::vector<Term>> of_parts,
                   const std::array<std::vector<Term>, 3> &by_order);

    TermList expansion;
    PerMatrix<ByOrder> varying; ///< whether coefficients of the expansion have been seen to change
    TermList fixed;             ///< what sums of an order contain, with the coefficients there
    TermList sums;              ///< the A_i, which have no entries of their own
    std::vector<Part> parts;
    std::array<std::vector<double>, 3> coefficients; ///< by order and constant matrix
    bool has_velocity_terms_ = false;
  };
} // namespace squeal
