#include <squeal/equations/eigenproblem.h>
#include <squeal/linalg/compressed_rows.h>

namespace squeal
{
  namespace
  {
    /// Re f(i w).
    double storage(const StiffnessFactor &factor, const double frequency)
    {
      return factor(std::complex<double>(0, frequency)).real();
    }
  } // namespace

  std::complex<double> FrozenTerm::h(const std::complex<double> l) const
  {
    return coefficient * (factor(l) - storage(factor, frequency));
  }

  std::complex<double> FrozenTerm::derivative(const std::complex<double> l) const
  {
    return coefficient * factor.derivative(l);
  }

  std::complex<double> FrozenTerm::quotient(const std::complex<double> l,
                                            const std::complex<double> m) const
  {
    return coefficient * factor.quotient(l, m);
  }

  QuadraticEigenproblem QuadraticEigenproblem::of_same_unknowns() const
  {
    QuadraticEigenproblem problem;
    problem.rows                = rows;
    problem.n_constraints       = n_constraints;
    problem.n_local_constraints = n_local_constraints;
    problem.compliant           = compliant;
    return problem;
  }

  QuadraticEigenproblem sum_of(const EquationsOfMotion &equations)
  {
    const RowRange &rows          = equations.rows;
    QuadraticEigenproblem problem = equations.without_matrices();
    problem.M                     = sum_of_terms(rows, equations.of_order(2));
    problem.P                     = sum_of_terms(rows, equations.of_order(1));
    problem.Q                     = sum_of_terms(rows, equations.of_order(0));
    for (const RelaxationTerm &term : equations.relaxation)
      problem.frozen.push_back(
          {term.coefficient, term.matrix->view(false), term.factor, equations.frozen_at});
    if (equations.matrices_are_given && !equations.relaxation.empty())
      problem.given = std::make_shared<const EquationsOfMotion>(equations);
    if (equations.reference == EquationsOfMotion::Reference::symmetric_part)
      problem.reference = symmetric_part(rows, problem.Q);
    else if (!equations.reference_terms().empty())
      problem.make_shifted_reference = [equations](const double omega)
      { return sum_of_terms(equations.rows, equations.shifted_reference_terms(omega)); };
    return problem;
  }

  Matrix QuadraticEigenproblem::shifted_reference(const double omega) const
  {
    if (make_shifted_reference)
      return make_shifted_reference(omega);
    return sum_in_places(rows, reference ? reference : Q, -omega * omega, M);
  }
} // namespace squeal
