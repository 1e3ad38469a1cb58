#include <squeal/static_equilibrium.h>

namespace squeal
{
  Block solve_static_equilibrium(const RowRange &rows, const std::vector<Term> &terms, const Block &load)
  {
    std::vector<Summand> summands;
    for (const Term &term : terms)
      if (term.order == 0 && term.matrix && term.origin != Origin::friction_damping &&
          term.origin != Origin::falling_friction)
        summands.push_back({term.coefficient, *term.matrix});
    const Matrix        A = sum_of(rows, summands);
    const Factorization factorization(A, Factorization::Kind::lu, "the stiffness of the static equilibrium");

    Block solution = factorization.solve(load);
    Block residual = multiply(A, solution);
    for (unsigned int i = 0; i < residual.n_local(); ++i)
      residual.data()[i] = load.data()[i] - residual.data()[i];
    const Block correction = factorization.solve(residual);
    for (unsigned int i = 0; i < residual.n_local(); ++i)
      solution.data()[i] += correction.data()[i];
    return solution;
  }
} // namespace squeal
