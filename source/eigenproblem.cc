#include <squeal/eigenproblem.h>

namespace squeal
{
  Matrix sum_of(const RowRange &rows, const std::vector<Term> &terms, const unsigned int order)
  {
    std::vector<Summand> summands;
    for (const Term &term : terms)
      if (term.order == order && term.matrix)
        summands.push_back({term.coefficient, *term.matrix});
    return sum_of(rows, summands);
  }
} // namespace squeal
