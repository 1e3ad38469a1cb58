#include <squeal/eigen/growth_search.h>
#include <squeal/eigen/rim_survey.h>

#include <algorithm>

namespace squeal
{
  namespace
  {
    /// Zero if there is no such kind.
    template <typename Kind>
    double size_in(const std::map<Kind, double> &strengths, const Kind &kind)
    {
      const auto found = strengths.find(kind);
      return found == strengths.end() ? 0. : found->second;
    }
  } // namespace

  void RimSurvey::begin(const double of_expansion, const std::vector<Term> &terms,
                        std::vector<InSector> in_sectors)
  {
    clearance            = of_expansion;
    expansion            = std::move(in_sectors);
    const Strengths here = strengths_of(terms);
    surveyed             = {{here, here}};
    is_expansion_definite.reset();
  }

  bool RimSurvey::covers(const std::vector<Term> &terms, const std::vector<InSector> &in_sectors)
  {
    const Strengths now = strengths_of(terms);
    return is_within_clearance(now) || survey(now, in_sectors);
  }

  RimSurvey::Strengths RimSurvey::strengths_of(const std::vector<Term> &terms)
  {
    TermList list;
    for (const Term &term : terms)
      if (term.origin == Origin::inertia || term.origin == Origin::elasticity ||
          (term.order == 1 && term.origin != Origin::transport))
        list.add(term);
    matrix_norms.carry_over(list,
                            [&](const unsigned int k) { return list.matrix(k)->infinity_norm(); });
    Strengths result;
    for (unsigned int k = 0; k < list.n_matrices(); ++k)
      for (const Term &term : list.terms_of(k))
        if (const double size = std::abs(term.coefficient) * matrix_norms[k]; size > 0)
          result[{term.origin, term.order}] += size;
    return result;
  }

  bool RimSurvey::is_within_clearance(const Strengths &now) const
  {
    const double margin = 1 + 0.8 * (clearance - 1); // norms are not distances
    const auto covers   = [&](const Surveyed &known)
    {
      Strengths kinds = now;
      kinds.insert(known.from.begin(), known.from.end());
      return std::all_of(kinds.begin(), kinds.end(),
                         [&](const Strengths::value_type &entry)
                         {
                           const double a = size_in(known.from, entry.first),
                                        b = size_in(known.to, entry.first),
                                        x = size_in(now, entry.first);
                           return std::min(a, b) / margin <= x && x <= std::max(a, b) * margin;
                         });
    };
    return std::any_of(surveyed.begin(), surveyed.end(), covers);
  }

  bool RimSurvey::are_definite(const std::vector<InSector> &in_sectors,
                               const std::map<Origin, double> &factors) const
  {
    return std::all_of(in_sectors.begin(), in_sectors.end(),
                       [&](const InSector &problem)
                       {
                         std::vector<Term> terms = problem.terms;
                         for (Term &term : terms)
                           if (const auto factor = factors.find(term.origin);
                               term.order == 1 && factor != factors.end())
                             term.coefficient *= factor->second;
                         return is_definite_on_rim(problem.rows, terms, problem.n_constraints,
                                                   max_imaginary);
                       });
  }

  /// Surveys the problem of now; where its velocity terms only damp, what is between it and the
  /// expansion point, too, and much farther: more of them make Q(-R) less definite, so that
  /// definite with the most of them is definite with less.
  bool RimSurvey::survey(const Strengths &now, const std::vector<InSector> &in_sectors)
  {
    if (!is_expansion_definite)
      is_expansion_definite = are_definite(expansion, {});
    if (!*is_expansion_definite)
      return false;
    const bool only_damps =
        std::none_of(in_sectors.begin(), in_sectors.end(),
                     [](const InSector &problem) { return may_excite(problem.terms); });
    Surveyed reached{now, now};
    if (only_damps)
    {
      double of_all = 0;
      for (const auto &[kind, size] : now)
        if (kind.second == 1)
        {
          of_all += size;
          reached.from[kind] = size_in(surveyed.front().from, kind);
        }
      // What has grown from little may go on to a tenth of the others.
      constexpr double far = 30, of_others = 0.1;
      std::map<Origin, double> tried;
      for (const double least : {of_others * of_all, 0.})
      {
        Surveyed ahead = reached;
        std::map<Origin, double> factors;
        for (auto &[kind, size] : ahead.to)
          if (kind.second == 1)
          {
            const double at_first = size_in(reached.from, kind);
            factors[kind.first]   = size > at_first   ? std::max(far, least / size)
                                    : size < at_first ? 1 / far
                                                      : 1;
            size *= factors[kind.first];
          }
        if (factors != tried && are_definite(in_sectors, factors))
        {
          surveyed.push_back(std::move(ahead));
          return true;
        }
        tried = std::move(factors);
      }
    }
    // Rather a few symmetric factorisations than a full solution
    if (!are_definite(in_sectors, {}))
      return false;
    surveyed.push_back(std::move(reached));
    return true;
  }
} // namespace squeal
