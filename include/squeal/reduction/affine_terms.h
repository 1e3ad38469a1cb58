#pragma once

#include <squeal/equations/eigenproblem.h>
#include <squeal/reduction/interface_terms.h>

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
    /// For the terms of an expansion point. Coefficients that @p before has seen to change are kept
    /// apart.
    AffineTerms(const std::vector<Term> &expansion_terms, const AffineTerms &before);

    /// The expansion point's terms whose coefficients have been seen to change, by number.
    std::vector<double> varying_terms() const;
    void keep_apart(const std::vector<double> &varying_terms);
    /// Keeps those apart, before split(), that have another coefficient among these terms.
    void learn(const std::vector<Term> &terms);

    /// Makes the constant matrices anew from the expansion point's terms and others. Returns by row
    /// whether a matrix that may change couples it on this rank.
    std::vector<char> split(const RowRange &rows, const std::vector<Term> &terms);
    /// The number of constant matrices; zero before split().
    unsigned int size() const
    {
      return parts.size();
    }
    /// A_i x.
    MultiVector image(unsigned int i, const MultiVector &x) const;
    /// A_i^T x.
    MultiVector transposed_image(unsigned int i, const MultiVector &x) const;
    /// A_i x of all, with one product for each matrix that they consist of.
    std::vector<MultiVector> images(const MultiVector &x) const;
    /// Whether A_i = A_i^T, to rounding.
    bool is_symmetric(const unsigned int i) const
    {
      return parts[i].is_symmetric;
    }

    using Summands = std::array<std::vector<InterfaceTerms::Summand>, 3>;
    /// Takes the coefficients of these terms. Returns what changes with the contact, by order.
    /// Nothing if a coefficient has changed that a sum contains: split() must be called again for a
    /// new expansion point, which keeps that matrix apart.
    std::optional<Summands> update(const std::vector<Term> &terms);

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
    /// A matrix in one of the orders and the sum of its coefficients.
    struct Member
    {
      std::shared_ptr<const Matrix> matrix;
      unsigned int order;
      double coefficient;
      bool of_contact; ///< changes with the area of contact, also where it has not yet
      bool of_bodies;  ///< an elasticity: only its coefficients change
    };
    using Members = std::vector<Member>;
    /// A_i: a sum of matrices of one order, or one that varies. Sums have no entries of their own,
    /// which would be as large as all matrices of an order.
    struct Part
    {
      bool varies;
      Members members; ///< of one that varies the same matrix in all orders
      std::vector<InterfaceTerms::Summand> summands;
      double norm;
      bool is_symmetric = false;
    };
    /// In the order of the terms: sums must not depend on addresses.
    static Members members_of(const std::vector<Term> &terms);
    static const Member *find(const Members &members, const Member &member);

    Members expansion, varying;
    std::vector<Part> parts;
    std::array<std::vector<double>, 3> coefficients; ///< by order and constant matrix
    bool has_velocity_terms_ = false;
  };
} // namespace squeal
