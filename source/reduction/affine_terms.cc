#include <squeal/eigen/inertia_count.h>
#include <squeal/reduction/affine_terms.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace squeal
{
  AffineTerms::AffineTerms(const std::vector<Term> &expansion_terms, const AffineTerms &before)
      : expansion(members_of(expansion_terms))
  {
    for (const Member &member : before.varying)
      if (find(expansion, member)) // else its matrix is gone
        varying.push_back(member);
  }

  AffineTerms::Members AffineTerms::members_of(const std::vector<Term> &terms)
  {
    Members members;
    const bool in_contact =
        std::any_of(terms.begin(), terms.end(),
                    [](const Term &term) { return term.origin == Origin::contact; });
    const auto is_of_bodies = [&](const Term &term)
    {
      return std::any_of(terms.begin(), terms.end(),
                         [&](const Term &other) {
                           return other.origin == Origin::elasticity && other.matrix == term.matrix;
                         });
    };
    for (const Term &term : terms)
      if (term.matrix && *term.matrix)
      {
        const Member member{term.matrix, term.order, term.coefficient,
                            in_contact && is_of_contact(term.origin), is_of_bodies(term)};
        if (const Member *known = find(members, member))
          members[known - members.data()].coefficient += term.coefficient;
        else
          members.push_back(member);
      }
    return members;
  }

  const AffineTerms::Member *AffineTerms::find(const Members &members, const Member &member)
  {
    for (const Member &other : members)
      if (other.matrix == member.matrix && other.order == member.order)
        return &other;
    return nullptr;
  }

  std::vector<double> AffineTerms::varying_terms() const
  {
    std::vector<double> numbers;
    for (unsigned int k = 0; k < expansion.size(); ++k)
      if (find(varying, expansion[k]))
        numbers.push_back(k);
    return numbers;
  }

  void AffineTerms::keep_apart(const std::vector<double> &numbers)
  {
    for (const double k : numbers)
      if (k < expansion.size() && !find(varying, expansion[static_cast<unsigned int>(k)]))
        varying.push_back(expansion[static_cast<unsigned int>(k)]);
  }

  void AffineTerms::learn(const std::vector<Term> &terms)
  {
    for (const Member &member : members_of(terms))
      if (const Member *known = find(expansion, member);
          known && known->coefficient != member.coefficient && !find(varying, member))
        varying.push_back(*known);
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
    const Members now = members_of(terms);
    parts.clear();
    // What bodies are made of stays, though the expansion point may have been without it.
    for (const Member &member : now)
      if (member.of_bodies && !find(expansion, member))
      {
        expansion.push_back(member);
        expansion.back().coefficient = 0;
      }
    std::vector<char> touched(rows.size);
    const auto touch = [&](const Members &members, const Members &others)
    {
      for (const Member &member : members)
        if (member.of_contact || (!member.of_bodies && !find(others, member)))
          for_entries(*member.matrix, [&](const PetscInt row, const PetscInt column, double)
                      { touched[row] = touched[column] = 1; });
    };
    touch(expansion, now);
    touch(now, expansion);

    std::array<Part, 3> sums{};
    for (const Member &member : now)
    {
      const Member *of_expansion = find(expansion, member);
      if (!of_expansion || member.of_contact)
        continue;
      if (of_expansion->coefficient != member.coefficient && !find(varying, member))
        varying.push_back(member);
      if (!find(varying, member))
        sums[member.order].members.push_back(member);
      else if (const auto same = std::find_if(
                   parts.begin(), parts.end(),
                   [&](const Part &part) { return part.members.front().matrix == member.matrix; });
               same != parts.end())
        same->members.push_back(member);
      else
        parts.push_back(
            {true, {member}, {{1., member.matrix}}, longest_column(*member.matrix, rows)});
    }
    for (Part &sum : sums)
      if (!sum.members.empty())
      {
        std::vector<Summand> summands;
        for (const Member &member : sum.members)
        {
          sum.summands.emplace_back(member.coefficient, member.matrix);
          summands.push_back({member.coefficient, *member.matrix});
        }
        sum.norm = longest_column(sum_of(rows, summands), rows);
        parts.push_back(std::move(sum));
      }
    const MultiVector scattered = scattered_vector(rows);
    for (unsigned int i = 0; i < parts.size(); ++i)
    {
      constexpr double rounding = 1e-14;
      const MultiVector product = image(i, scattered);
      parts[i].is_symmetric = largest_entry(difference(product, transposed_image(i, scattered))) <=
                              rounding * largest_entry(product);
    }
    return touched;
  }

  std::optional<AffineTerms::Summands> AffineTerms::update(const std::vector<Term> &terms)
  {
    const Members now = members_of(terms);
    for (auto &of_order : coefficients)
      of_order.assign(parts.size(), 0.);
    Members stay;
    bool holds = true;
    for (unsigned int i = 0; i < parts.size(); ++i)
    {
      for (const Member &member : parts[i].members)
      {
        stay.push_back(member);
        const Member *present         = find(now, member);
        const double coefficient      = present ? present->coefficient : 0.;
        coefficients[member.order][i] = parts[i].varies ? coefficient : 1;
        if (!parts[i].varies && coefficient != member.coefficient)
        {
          if (!find(varying, member))
            varying.push_back(member);
          holds = false;
        }
      }
    }
    if (!holds)
      return std::nullopt;

    has_velocity_terms_ = std::any_of(terms.begin(), terms.end(),
                                      [](const Term &term)
                                      { return term.order == 1 && term.matrix && *term.matrix; });
    Summands changing;
    for (const Member &member : now)
      if (!find(stay, member))
        changing[member.order].emplace_back(member.coefficient, member.matrix);
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

  MultiVector AffineTerms::image(const unsigned int i, const MultiVector &x) const
  {
    MultiVector result(x.row_range(), x.n_columns());
    for (const auto &[coefficient, matrix] : parts[i].summands)
      result.add(coefficient, squeal::multiply(*matrix, x));
    return result;
  }

  MultiVector AffineTerms::transposed_image(const unsigned int i, const MultiVector &x) const
  {
    MultiVector result(x.row_range(), x.n_columns());
    for (const auto &[coefficient, matrix] : parts[i].summands)
      result.add(coefficient, multiply_transposed(*matrix, x));
    return result;
  }

  std::vector<MultiVector> AffineTerms::images(const MultiVector &x) const
  {
    std::vector<MultiVector> result(parts.size(), MultiVector(x.row_range(), x.n_columns()));
    std::set<const Matrix *> done;
    for (const Part &first : parts)
      for (const InterfaceTerms::Summand &summand : first.summands)
        if (const Matrix *const matrix = summand.second.get(); done.insert(matrix).second)
        {
          const MultiVector product = squeal::multiply(*matrix, x);
          for (unsigned int i = 0; i < parts.size(); ++i)
            for (const auto &[coefficient, other] : parts[i].summands)
              if (other.get() == matrix)
                result[i].add(coefficient, product);
        }
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
