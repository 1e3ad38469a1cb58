#include <squeal/equations/eigenproblem.h>
#include <squeal/equations/term_list.h>
#include <squeal/linalg/compressed_rows.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

namespace squeal
{
  namespace
  {
    bool is_zero(const Term &term)
    {
      return !term.matrix || !*term.matrix || term.coefficient == 0;
    }
  } // namespace

  std::vector<Term> terms_of_order(const std::vector<Term> &terms, const unsigned int order)
  {
    std::vector<Term> result;
    std::copy_if(terms.begin(), terms.end(), std::back_inserter(result),
                 [&](const Term &term) { return term.order == order && !is_zero(term); });
    return result;
  }

  EquationsOfMotion EquationsOfMotion::frozen(const double frequency) const
  {
    EquationsOfMotion result = *this;
    for (const RelaxationTerm &term : relaxation)
      if (!term.low_rank)
        result.terms.push_back({Origin::elasticity, 0,
                                term.coefficient * (term.factor({0, frequency}).real() - 1),
                                term.matrix});
    result.frozen_at = frequency;
    return result;
  }

  std::vector<Term> EquationsOfMotion::of_order(const unsigned int order) const
  {
    return terms_of_order(terms, order);
  }

  std::vector<Term> EquationsOfMotion::reference_terms() const
  {
    const std::vector<Term> all = of_order(0);
    if (reference == Reference::symmetric_part)
      return all;
    std::vector<Term> conservative;
    std::copy_if(all.begin(), all.end(), std::back_inserter(conservative),
                 [](const Term &term) { return is_conservative(term.origin); });
    if (conservative.size() == all.size() && of_order(1).empty())
      return {};
    return conservative;
  }

  std::vector<Term> EquationsOfMotion::shifted_reference_terms(const double omega) const
  {
    std::vector<Term> result = reference_terms();
    for (Term term : of_order(2))
    {
      term.coefficient *= -omega * omega;
      result.push_back(std::move(term));
    }
    return result;
  }

  bool may_excite(const std::vector<Term> &terms)
  {
    return std::any_of(terms.begin(), terms.end(),
                       [](const Term &term)
                       {
                         return term.order == 1 && (term.origin == Origin::falling_friction ||
                                                    term.origin == Origin::velocity);
                       });
  }

  QuadraticEigenproblem EquationsOfMotion::without_matrices() const
  {
    if (!relaxation.empty() && frozen_at == 0)
      throw std::logic_error("Equations with relaxation make no quadratic problem.");
    QuadraticEigenproblem problem;
    problem.rows                = rows;
    problem.n_constraints       = n_constraints;
    problem.n_local_constraints = n_local_constraints;
    problem.compliant           = compliant;
    problem.reference_name      = reference_name;
    problem.may_move_rigidly    = may_move_rigidly;

    problem.may_excite = may_excite(terms);
    return problem;
  }

  Matrix sum_of_terms(const RowRange &rows, const std::vector<Term> &terms)
  {
    std::vector<Summand> summands;
    for (const Term &term : terms)
      if (!is_zero(term))
        summands.push_back({term.coefficient, *term.matrix});
    return sum_of(rows, summands);
  }

  Matrix sum_of(const RowRange &rows, const std::vector<Term> &terms, const unsigned int order)
  {
    return sum_of_terms(rows, terms_of_order(terms, order));
  }

  Matrix matrix_free_sum_of(const RowRange &rows, const std::vector<Term> &terms,
                            const unsigned int order)
  {
    const TermList list(terms_of_order(terms, order));
    if (list.n_matrices() == 0)
      return {};
    return make_matrix_free(rows, [list, order](const MultiVector &x, const bool transposed)
                            { return list.multiply(order, x, transposed); });
  }
} // namespace squeal
