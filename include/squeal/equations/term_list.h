#pragma once

#include <squeal/equations/equations_of_motion.h>

#include <array>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace squeal
{
  /// Sums of terms by their distinct matrices,
  ///     A_s = sum_k c_k,s A_k,   s the order, or the number of a sum.
  /// Whether a matrix is one of before with another coefficient is asked here and nowhere else.
  /// Matrices come in the order in which the terms name them: sums must not depend on addresses.
  /// Terms without a matrix are left out, those with a coefficient of zero are not.
  class TermList
  {
  public:
    TermList() = default;
    /// Sums the terms of each order.
    explicit TermList(const std::vector<Term> &terms);
    /// Takes several sums, by number; the orders of their terms do not matter.
    static TermList of_sums(const std::vector<std::vector<Term>> &sums);
    void add(const Term &term);

    unsigned int n_matrices() const
    {
      return entries.size();
    }
    const std::shared_ptr<const Matrix> &matrix(const unsigned int k) const
    {
      return entries[k].matrix;
    }
    /// The terms of a matrix in their order, for what depends on where they come from.
    const std::vector<Term> &terms_of(const unsigned int k) const
    {
      return entries[k].terms;
    }
    /// c_k,s.
    double coefficient(unsigned int k, unsigned int s) const;
    /// c_k,0, c_k,1, c_k,2.
    std::array<double, 3> by_order(const unsigned int k) const
    {
      return {{coefficient(k, 0), coefficient(k, 1), coefficient(k, 2)}};
    }
    /// Finds c of a matrix in a sum: zero for one that is not there.
    double coefficient(const std::shared_ptr<const Matrix> &matrix, unsigned int s) const;
    /// The number of a matrix, or nothing.
    std::optional<unsigned int> find(const std::shared_ptr<const Matrix> &matrix) const;

    /// Whether both have the same matrices in the same order: then only coefficients differ.
    bool has_matrices_of(const TermList &other) const;

    /// One term for each matrix and sum, without those that add up to zero.
    std::vector<Term> terms() const;
    /// A_s x, with each matrix of the sum multiplied once; with A_s^T if @p transposed.
    MultiVector multiply(unsigned int s, const MultiVector &x, bool transposed = false) const;
    /// A_s x of all sums, with each matrix multiplied once.
    std::vector<MultiVector> multiply_all(const MultiVector &x) const;

  private:
    struct Entry
    {
      std::shared_ptr<const Matrix> matrix;
      std::vector<Term> terms;
    };
    std::vector<Entry> entries;
    unsigned int n_sums = 3;
  };

  /// A value for each of some matrices, which it does not keep alive. What is known of a matrix is
  /// carried over from one list of terms to the next; what no term has any more is forgotten.
  template <typename Value>
  class PerMatrix
  {
  public:
    unsigned int size() const
    {
      return values.size();
    }
    /// The value of a matrix, or null.
    Value *find(const std::shared_ptr<const Matrix> &matrix)
    {
      for (auto &[known, value] : values)
        if (known.lock() == matrix)
          return &value;
      return nullptr;
    }
    const Value *find(const std::shared_ptr<const Matrix> &matrix) const
    {
      return const_cast<PerMatrix *>(this)->find(matrix);
    }
    /// Throws std::logic_error for a matrix without a value.
    const Value &at(const std::shared_ptr<const Matrix> &matrix) const
    {
      if (const Value *value = find(matrix))
        return *value;
      throw std::logic_error("There is no value for this matrix.");
    }
    /// Has values for the matrices of a list from now on, in their order: those that are known, and
    /// make(k) for a new one, its k-th.
    template <typename Make>
    void carry_over(const TermList &terms, const Make &make)
    {
      std::vector<std::pair<std::weak_ptr<const Matrix>, Value>> present;
      for (unsigned int k = 0; k < terms.n_matrices(); ++k)
      {
        Value *known = find(terms.matrix(k));
        present.emplace_back(terms.matrix(k), known ? std::move(*known) : make(k));
      }
      values = std::move(present);
    }
    /// The value of the k-th matrix of the list that was carried over last.
    Value &operator[](const unsigned int k)
    {
      return values[k].second;
    }
    const Value &operator[](const unsigned int k) const
    {
      return values[k].second;
    }

  private:
    std::vector<std::pair<std::weak_ptr<const Matrix>, Value>> values;
  };

  /// The coefficients by order of terms as they were, without their matrices: tells whether later
  /// ones are the same.
  class KnownTerms
  {
  public:
    KnownTerms() = default;
    explicit KnownTerms(const std::vector<Term> &terms);
    bool are(const std::vector<Term> &terms) const;

  private:
    PerMatrix<std::array<double, 3>> coefficients;
  };
} // namespace squeal
