#include <squeal/eigenproblem.h>

#include <string>

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

  unsigned int count_reference_modes(const QuadraticEigenproblem &problem, const double omega)
  {
    const Matrix &stiffness = problem.reference ? problem.reference : problem.Q;
    const Matrix shifted    = sum_of(problem.rows, {{1., stiffness}, {-omega * omega, problem.M}});
    const Factorization factorization(shifted, Factorization::Kind::ldlt,
                                      "the shifted reference problem (for counting its modes)");
    const auto inertia = factorization.inertia();
    if (inertia.negative < problem.n_constraints)
      throw SolverError("The inertia count of the reference problem gave " +
                        std::to_string(inertia.negative) + " negative eigenvalues, less than the " +
                        std::to_string(problem.n_constraints) +
                        " of the contact constraints: the constraints are linearly dependent.");
    return inertia.negative - problem.n_constraints;
  }
} // namespace squeal
