#include <squeal/reduction/bracketed_count.h>

#include <algorithm>

namespace squeal
{
  bool BracketedCount::Box::contains(const std::vector<double> &stiffness) const
  {
    bool does = stiffness.size() == low.size();
    for (std::size_t k = 0; k < stiffness.size() && does; ++k)
      does = low[k] <= stiffness[k] && stiffness[k] <= high[k];
    return does;
  }

  std::vector<double> BracketedCount::Problem::stiffness() const
  {
    std::vector<double> result;
    for (unsigned int k = 0; k < semidefinite.n_matrices(); ++k)
    {
      result.push_back(semidefinite.coefficient(k, 0));
      result.push_back(-semidefinite.coefficient(k, 2));
    }
    return result;
  }

  BracketedCount::Problem BracketedCount::problem_of(const std::vector<Term> &terms) const
  {
    Problem result;
    for (const Term &term : terms)
    {
      if (term.order == 1 || !term.matrix || !*term.matrix || !is_conservative(term.origin))
        continue;
      // K, M, and M* of -Omega^2 M*; with the gyroscopic term transport has order 1.
      if (semidefinite && (term.origin == Origin::inertia || term.origin == Origin::elasticity ||
                           term.origin == Origin::transport))
        result.semidefinite.add(term);
      else
        (term.origin == Origin::contact ? result.contact : result.others).push_back(term);
    }
    return result;
  }

  bool BracketedCount::belongs_to_box(const Problem &problem) const
  {
    return problem.semidefinite.has_matrices_of(of_box.semidefinite) &&
           KnownTerms(of_box.others).are(problem.others);
  }

  BracketedCount::Corner BracketedCount::corner(const std::vector<double> &stiffness,
                                                const Corner &known) const
  {
    if (known.count && stiffness == known.stiffness)
      return known;
    return {stiffness, std::make_shared<InertiaCount>(rows, n_local_constraints, omega)};
  }

  unsigned int BracketedCount::count_at(const Corner &corner, const Problem &problem) const
  {
    std::vector<Term> terms;
    for (unsigned int k = 0; k < problem.semidefinite.n_matrices(); ++k)
      for (const unsigned int order : {0u, 2u})
        if (const double stiffness = corner.stiffness[2 * k + order / 2]; stiffness != 0)
          terms.push_back({problem.semidefinite.terms_of(k).front().origin, order,
                           order == 0 ? stiffness : -stiffness, problem.semidefinite.matrix(k)});
    for (const std::vector<Term> *part : {&problem.others, &problem.contact})
      terms.insert(terms.end(), part->begin(), part->end());
    return corner.count->count(terms);
  }

  unsigned int BracketedCount::count_alone(const Problem &problem)
  {
    if (!alone)
      alone = std::make_shared<InertiaCount>(rows, n_local_constraints, omega);
    return count_at({problem.stiffness(), alone}, problem);
  }

  bool BracketedCount::agree(const Corner &soft, const Corner &stiff, const Problem &problem,
                             unsigned int &n_modes) const
  {
    n_modes = count_at(soft, problem);
    return soft.stiffness == stiff.stiffness || count_at(stiff, problem) == n_modes;
  }

  unsigned int BracketedCount::count(const std::vector<Term> &terms)
  {
    const Problem problem          = problem_of(terms);
    const std::vector<double> here = problem.stiffness();
    unsigned int n_modes           = 0;
    if (!softest.count || !belongs_to_box(problem))
    {
      forget_box();
      of_box  = problem;
      softest = stiffest = corner(here, {});
    }
    if (box().contains(here))
      return agree(softest, stiffest, problem, n_modes) ? n_modes : count_alone(problem);

    // As far again as the box had to grow: what comes next on a path is counted, too.
    for (const double margin : {1., 0.})
    {
      Box larger = box();
      for (std::size_t k = 0; k < here.size(); ++k)
      {
        const double size = std::max(here[k], larger.high[k]) - std::min(here[k], larger.low[k]);
        if (here[k] < larger.low[k])
          larger.low[k] = here[k] - margin * size;
        else if (here[k] > larger.high[k])
          larger.high[k] = here[k] + margin * size;
      }
      const auto is_larger_than = [&](const Box &other)
      { return larger.contains(other.low) && larger.contains(other.high); };
      if (std::any_of(failed.begin(), failed.end(), is_larger_than))
        continue;
      const Corner soft = corner(larger.low, softest), stiff = corner(larger.high, stiffest);
      if (agree(soft, stiff, problem, n_modes))
      {
        softest  = soft;
        stiffest = stiff;
        return n_modes;
      }
      failed.push_back(larger);
    }
    return count_alone(problem);
  }
} // namespace squeal
