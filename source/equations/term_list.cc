#include <squeal/equations/term_list.h>

#include <algorithm>

namespace squeal
{
  TermList::TermList(const std::vector<Term> &terms)
  {
    for (const Term &term : terms)
      add(term);
  }

  TermList TermList::of_sums(const std::vector<std::vector<Term>> &sums)
  {
    TermList result;
    result.n_sums = sums.size();
    for (unsigned int s = 0; s < sums.size(); ++s)
      for (Term term : sums[s])
      {
        term.order = s;
        result.add(term);
      }
    return result;
  }

  void TermList::add(const Term &term)
  {
    if (!term.matrix || !*term.matrix)
      return;
    if (const auto known = find(term.matrix))
      entries[*known].terms.push_back(term);
    else
      entries.push_back({term.matrix, {term}});
  }

  double TermList::coefficient(const unsigned int k, const unsigned int s) const
  {
    double sum = 0;
    for (const Term &term : entries[k].terms)
      if (term.order == s)
        sum += term.coefficient;
    return sum;
  }

  double TermList::coefficient(const std::shared_ptr<const Matrix> &matrix,
                               const unsigned int s) const
  {
    const auto known = find(matrix);
    return known ? coefficient(*known, s) : 0.;
  }

  std::optional<unsigned int> TermList::find(const std::shared_ptr<const Matrix> &matrix) const
  {
    for (unsigned int k = 0; k < entries.size(); ++k)
      if (entries[k].matrix == matrix)
        return k;
    return std::nullopt;
  }

  bool TermList::has_matrices_of(const TermList &other) const
  {
    return std::equal(entries.begin(), entries.end(), other.entries.begin(), other.entries.end(),
                      [](const Entry &a, const Entry &b) { return a.matrix == b.matrix; });
  }

  std::vector<Term> TermList::terms() const
  {
    std::vector<Term> result;
    for (unsigned int k = 0; k < entries.size(); ++k)
      for (unsigned int s = 0; s < n_sums; ++s)
        if (const double c = coefficient(k, s); c != 0)
        {
          const std::vector<Term> &all = entries[k].terms;
          result.push_back(*std::find_if(all.begin(), all.end(),
                                         [s](const Term &term) { return term.order == s; }));
          result.back().coefficient = c;
        }
    return result;
  }

  MultiVector TermList::multiply(const unsigned int s, const MultiVector &x,
                                 const bool transposed) const
  {
    MultiVector result(x.row_range(), x.n_columns());
    for (unsigned int k = 0; k < entries.size(); ++k)
      if (const double c = coefficient(k, s); c != 0)
        result.add(c, transposed ? multiply_transposed(*entries[k].matrix, x)
                                 : squeal::multiply(*entries[k].matrix, x));
    return result;
  }

  std::vector<MultiVector> TermList::multiply_all(const MultiVector &x) const
  {
    std::vector<MultiVector> result(n_sums, MultiVector(x.row_range(), x.n_columns()));
    for (unsigned int k = 0; k < entries.size(); ++k)
    {
      const MultiVector product = squeal::multiply(*entries[k].matrix, x);
      for (unsigned int s = 0; s < n_sums; ++s)
        if (const double c = coefficient(k, s); c != 0)
          result[s].add(c, product);
    }
    return result;
  }

  KnownTerms::KnownTerms(const std::vector<Term> &terms)
  {
    const TermList list(terms);
    coefficients.carry_over(list, [&](const unsigned int k) { return list.by_order(k); });
  }

  bool KnownTerms::are(const std::vector<Term> &terms) const
  {
    const TermList list(terms);
    bool same = list.n_matrices() == coefficients.size();
    for (unsigned int k = 0; k < list.n_matrices() && same; ++k)
    {
      const auto *known = coefficients.find(list.matrix(k));
      same              = known && *known == list.by_order(k);
    }
    return same;
  }
} // namespace squeal
