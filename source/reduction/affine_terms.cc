#include <squeal/eigen/inertia_count.h>
#include <squeal/reduction/affine_terms.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  namespace
  {
    bool has_origin(const TermList &terms, const unsigned int k, const Origin origin)
    {
      return std::any_of(terms.terms_of(k).begin(), terms.terms_of(k).end(),
                         [&](const Term &term) { return term.origin == origin; });
    }

    /// Whether only the coefficients of a matrix change.
    bool is_of_bodies(const TermList &terms, const unsigned int k)
    {
      return has_origin(terms, k, Origin::elasticity);
    }

    /// Whether a matrix changes with the area of contact, also where it has not yet.
    bool changes_with_contact(const TermList &terms, const unsigned int k)
    {
      if (!is_of_contact(terms.terms_of(k).front().origin))
        return false;
      for (unsigned int other = 0; other < terms.n_matrices(); ++other)
        if (has_origin(terms, other, Origin::contact))
          return true;
      return false;
    }

    constexpr auto none_varies = [](unsigned int) { return std::array<bool, 3>{}; };
  } // namespace

  AffineTerms::AffineTerms(const std::vector<Term> &expansion_terms, const AffineTerms &before)
      : expansion(expansion_terms), varying(before.varying)
  {
    varying.carry_over(expansion, none_varies);
  }

  std::vector<double> AffineTerms::varying_terms() const
  {
    std::vector<double> numbers;
    for (unsigned int k = 0; k < expansion.n_matrices(); ++k)
      for (unsigned int order = 0; order < 3; ++order)
        if (varying[k][order])
          numbers.push_back(3 * k + order);
    return numbers;
  }

  void AffineTerms::keep_apart(const std::vector<double> &numbers)
  {
    for (const double number : numbers)
      if (const auto n = static_cast<unsigned int>(number); n < 3 * expansion.n_matrices())
        varying[n / 3][n % 3] = true;
  }

  void AffineTerms::learn(const std::vector<Term> &terms)
  {
    const TermList now(terms);
    for (unsigned int k = 0; k < now.n_matrices(); ++k)
      if (is_of_bodies(now, k) && !expansion.find(now.matrix(k)))
        expansion.add({Origin::elasticity, 0, 0., now.matrix(k)});
    varying.carry_over(expansion, none_varies);
    for (unsigned int k = 0; k < expansion.n_matrices(); ++k)
      if (const auto known = now.find(expansion.matrix(k)))
        for (unsigned int order = 0; order < 3; ++order)
          if (expansion.coefficient(k, order) != now.coefficient(*known, order))
            varying[k][order] = true;
  }

  namespace
  {
    /// The Euclidean length of the longest column: a lower bound of the 2-norm.
    double longest_column(const Matrix &matrix, const RowRange &rows)
    {
      if (!matrix)
        return 0;
      std::vector<double> squares(rows.size);
      for_entries(matrix, [&](PetscInt, const PetscInt column, const double value)
                  { squares[column] += value * value; });
      MPI_Allreduce(MPI_IN_PLACE, squares.data(), squares.size(), MPI_DOUBLE, MPI_SUM, rows.comm);
      return std::sqrt(*std::max_element(squares.begin(), squares.end()));
    }
  } // namespace

  std::vector<char> AffineTerms::split(const RowRange &rows, const std::vector<Term> &terms)
  {
    const TermList now(terms);
    learn(terms);

    std::vector<char> touched(rows.size);
    const auto touch = [&](const TermList &list, const TermList &other)
    {
      for (unsigned int k = 0; k < list.n_matrices(); ++k)
        if (changes_with_contact(list, k) ||
            (!is_of_bodies(list, k) && !other.find(list.matrix(k))))
          for_entries(*list.matrix(k), [&](const PetscInt row, const PetscInt column, double)
                      { touched[row] = touched[column] = 1; });
    };
    touch(expansion, now);
    touch(now, expansion);

    parts.clear();
    fixed = {};
    std::vector<std::vector<Term>> of_parts;
    std::array<std::vector<Term>, 3> by_order;
    for (unsigned int k = 0; k < now.n_matrices(); ++k)
    {
      const auto known = expansion.find(now.matrix(k));
      if (!known || changes_with_contact(now, k))
        continue;
      const ByOrder &varies = varying[*known];
      for (unsigned int order = 0; order < 3; ++order)
        if (!varies[order])
        {
          by_order[order].push_back(
              {Origin::elasticity, order, now.coefficient(k, order), now.matrix(k)});
          fixed.add(by_order[order].back());
        }
      if (varies == ByOrder{})
        continue;
      parts.push_back({now.matrix(k), varies, longest_column(*now.matrix(k), rows)});
      of_parts.push_back({{Origin::elasticity, 0, 1., now.matrix(k)}});
    }
    add_parts(rows, std::move(of_parts), by_order);
    return touched;
  }

  void AffineTerms::add_parts(const RowRange &rows, std::vector<std::vector<Term>> of_parts,
                              const std::array<std::vector<Term>, 3> &by_order)
  {
    for (unsigned int order = 0; order < 3; ++order)
      if (Matrix sum = sum_of_terms(rows, by_order[order]))
      {
        parts.push_back({{}, {}, longest_column(sum, rows)});
        parts.back().orders[order] = true;
        of_parts.push_back(by_order[order]);
      }
    sums                        = TermList::of_sums(of_parts);
    const MultiVector scattered = scattered_vector(rows);
    for (unsigned int i = 0; i < parts.size(); ++i)
    {
      constexpr double rounding = 1e-14;
      const MultiVector product = image(i, scattered);
      parts[i].is_symmetric     = largest_entry(difference(product, image(i, scattered, true))) <=
                              rounding * largest_entry(product);
    }
  }

  std::optional<TermList> AffineTerms::update(const std::vector<Term> &terms)
  {
    const TermList now(terms);
    for (unsigned int order = 0; order < 3; ++order)
    {
      coefficients[order].clear();
      for (const Part &part : parts)
        coefficients[order].push_back(!part.orders[order] ? 0
                                      : part.matrix       ? now.coefficient(part.matrix, order)
                                                          : 1);
    }
    bool holds = true;
    for (unsigned int k = 0; k < fixed.n_matrices(); ++k)
      for (const Term &term : fixed.terms_of(k))
        if (now.coefficient(term.matrix, term.order) != term.coefficient)
        {
          varying[*expansion.find(term.matrix)][term.order] = true;
          holds                                             = false;
        }
    if (!holds)
      return std::nullopt;

    has_velocity_terms_ = false;
    TermList changing;
    for (unsigned int k = 0; k < now.n_matrices(); ++k)
      for (const Term &term : now.terms_of(k))
      {
        has_velocity_terms_ |= term.order == 1;
        if (!fixed.find(term.matrix) && !sums.find(term.matrix))
          changing.add(term);
      }
    return changing;
  }

  std::complex<double> AffineTerms::factor(const unsigned int i,
                                           const std::complex<double> lambda) const
  {
    std::complex<double> sum = 0;
    for (unsigned int order = 0; order < 3; ++order)
      sum += coefficients[order][i] * std::pow(lambda, int(order));
    return sum;
  }

  std::array<double, 3> AffineTerms::norms() const
  {
    std::array<double, 3> result{};
    for (unsigned int order = 0; order < 3; ++order)
      for (unsigned int i = 0; i < parts.size(); ++i)
        result[order] = std::max(result[order], std::abs(coefficients[order][i]) * parts[i].norm);
    return result;
  }

  DenseMatrix AffineTerms::sum(const unsigned int order,
                               const std::vector<DenseMatrix> &by_matrix) const
  {
    DenseMatrix result;
    for (unsigned int i = 0; i < parts.size(); ++i)
      result.add(coefficients[order][i], by_matrix[i]);
    return result;
  }

  MultiVector AffineTerms::multiply(const unsigned int order, const MultiVector &block) const
  {
    MultiVector result(block.row_range(), block.n_columns());
    for (unsigned int i = 0; i < parts.size(); ++i)
      if (coefficients[order][i] != 0)
        result.add(coefficients[order][i], image(i, block));
    return result;
  }
} // namespace squeal
