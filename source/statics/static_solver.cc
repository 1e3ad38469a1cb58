#include <squeal/statics/static_solver.h>

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

namespace squeal
{
  template <int dim>
  void close_contact(Contact<dim> &contact, const std::vector<Term> &body_terms,
                     const IterativeStatics<dim> *solver)
  {
    contact.close();
    if (!contact.contact_model().mortar || contact.paired_interfaces().empty())
      return;
    // Rows of the constraint as large as those of the stiffness.
    double stiffness = solver ? solver->stiffness_scale() : 0;
    for (const Term &term : body_terms)
      if (term.origin == Origin::elasticity && term.order == 0)
        stiffness = std::max(stiffness, term.coefficient * term.matrix->infinity_norm());
    // A uniform pressure without modes needs no matrix, and nothing is solved.
    if (stiffness > 0)
      contact.scale_constraints(stiffness);
  }

  template <int dim>
  bool StaticSolver<dim>::has_factors(const StaticProblem &problem, const Contact<dim> &contact,
                                      const bool follows)
  {
    if (cached && !cached->serves(problem.body_terms, contact))
    {
      cached.reset();
      may_cache = false;
    }
    if (!cached && follows && may_cache && of_last.are(problem.body_terms) &&
        DirectStatics<dim>::may_serve(contact))
      cached = std::make_unique<DirectStatics<dim>>(problem.load.row_range(), problem.body_terms,
                                                    contact.contact_model(), problem.with_friction,
                                                    problem.sectors(), false);
    return cached != nullptr;
  }

  template <int dim>
  StaticEquilibrium
  StaticSolver<dim>::solve(const StaticProblem &problem, Contact<dim> &contact,
                           ContactMatrices<dim> &matrices, std::optional<StaticEquilibrium> before,
                           const LinearOperator &nearby, IterativeStatics<dim> *const iterative)
  {
    const bool follows = nearby && before;
    if (!nearby)
    {
      cached.reset();
      may_cache = true;
    }

    std::vector<std::function<std::optional<StaticEquilibrium>()>> candidates;
    if (has_factors(problem, contact, follows))
      candidates.emplace_back(
          [&]()
          {
            auto found = follow_static_equilibrium(*cached, problem, contact);
            may_cache &= bool(found);
            return found;
          });
    else if (follows)
      candidates.emplace_back(
          [&]()
          {
            return follow_static_equilibrium(*std::exchange(before, std::nullopt), nearby, problem,
                                             contact, matrices);
          });
    if (iterative)
      candidates.emplace_back([&]()
                              { return solve_static_equilibrium(*iterative, problem, contact); });
    else
      candidates.emplace_back([&]() { return solve_static_equilibrium(problem, contact); });

    std::optional<StaticEquilibrium> found;
    for (const auto &candidate : candidates)
    {
      found = candidate();
      if (found)
        break;
      cached.reset();
      close_contact<dim>(contact, problem.body_terms, nullptr);
    }
    // What is known of earlier states is a good start of what follows; without nearby factors what
    // follows is to be the same in a run that was interrupted here.
    if (follows && before && found->space.basis.n_columns() == 0)
      found->space = std::move(before->space);
    of_last = KnownTerms(problem.body_terms);
    return std::move(*found);
  }

  template void close_contact(Contact<2> &, const std::vector<Term> &, const IterativeStatics<2> *);
  template void close_contact(Contact<3> &, const std::vector<Term> &, const IterativeStatics<3> *);
  template class StaticSolver<2>;
  template class StaticSolver<3>;
} // namespace squeal
