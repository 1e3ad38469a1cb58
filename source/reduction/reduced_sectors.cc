#include <squeal/assessment/stability.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/reduction/reduced_sectors.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

// First the expansion point (restriction of its problem, models of the sectors, factors for static
// states), then terms: which keep to the sectors, their parts, the count of the reference problem.
// Then modes: solved sector by sector and put into one list, whose coordinates are padded to those
// of the largest model; what is asked of modes in coordinates goes back through for_parts().

namespace squeal
{
  namespace
  {
    /// The first rows of small vectors, with zeros below if they have fewer.
    ComplexMultiVector with_rows(const ComplexMultiVector &x, const unsigned int n)
    {
      ComplexMultiVector result(small_rows(n), x.n_columns());
      for (unsigned int k = 0; k < x.n_columns(); ++k)
        for (unsigned int i = 0; i < std::min(n, x.n_local()); ++i)
          result.set(i, k, x(i, k));
      return result;
    }

    /// Columns become those of the given numbers.
    void insert(const ComplexMultiVector &columns, const std::vector<unsigned int> &numbers,
                ComplexMultiVector &to)
    {
      for (unsigned int k = 0; k < numbers.size(); ++k)
        for (unsigned int i = 0; i < columns.n_local(); ++i)
          to.set(i, numbers[k], columns(i, k));
    }

    constexpr std::array<ComplexMultiVector EigenPairs::*, 2> both_sides = {
        {&EigenPairs::right, &EigenPairs::left}};
  } // namespace

  void ReducedSectors::set_expansion_point(QuadraticEigenproblem problem,
                                           const std::vector<Term> &terms,
                                           const EigenSolution::Reuse &solution,
                                           const Sectors &given, const bool semidefinite)
  {
    inverse_factors.clear();
    n_expansion_constraints = problem.n_constraints;
    sectors                 = given;
    whole                   = problem.rows;
    n_local_constraints     = problem.n_local_constraints;
    compliant               = problem.compliant;
    for (unsigned int order = 0; order < 3; ++order)
      norms[order] = (order == 0 ? problem.Q : order == 1 ? problem.P : problem.M).infinity_norm();

    const unsigned int n_parts = solution.sectors.empty() ? 1 : solution.sectors.size();
    if (n_parts > 1) // the sectors sum their own
      problem = problem.of_same_unknowns();
    if (parts.size() != n_parts) // else what they have learnt of the terms stays
    {
      parts.clear();
      for (const Sector &sector : (n_parts == 1 ? Sectors() : sectors).all(problem.rows))
        parts.push_back({sector, ReducedModel(options, course), {}, 0, 0, {}, {}});
    }
    if (!restrict(terms))
    {
      parts.clear();
      return;
    }
    double clearance = n_parts == 1 ? solution.clearance : solution.sectors[0]->reuse.clearance;
    no_growth_beyond = n_parts > 1 || solution.has_no_growth_beyond;
    for (const auto &of_sector : solution.sectors)
    {
      clearance = std::min(clearance, of_sector->reuse.clearance);
      no_growth_beyond &= of_sector->reuse.has_no_growth_beyond;
    }
    rim.begin(clearance, terms, in_sectors(n_expansion_constraints));
    for (unsigned int h = 0; h < n_parts; ++h)
    {
      Part &part                        = parts[h];
      const EigenSolution::Reuse &found = n_parts == 1 ? solution : solution.sectors[h]->reuse;
      QuadraticEigenproblem of_sector;
      if (!part.sector.is_whole())
        of_sector = expansion_problem_of(part);
      const QuadraticEigenproblem &own = part.sector.is_whole() ? problem : of_sector;
      part.n_modes                     = found.disc_right.n_columns() / 2;
      part.expansion_count             = found.n_reference;
      if (part.n_modes > 0)
        part.reduced.set_expansion_point(own, part.terms, found);
      else
        part.reduced = ReducedModel(options, course);
      if (!part.reference)
        part.reference = std::make_shared<BracketedCount>(
            own.rows, own.n_local_constraints, search_radius(options.max_imaginary), semidefinite);
      part.reference->forget_box();
    }
    if (!has_expansion_point())
      return;
    for (unsigned int h = 0; h < n_parts; ++h)
      inverse_factors.push_back(n_parts == 1 ? solution.factorization
                                             : solution.sectors[h]->reuse.factorization);
  }

  QuadraticEigenproblem ReducedSectors::expansion_problem_of(const Part &part) const
  {
    QuadraticEigenproblem result;
    result.rows = part.sector.row_range();
    result.M    = sum_of(result.rows, part.terms, 2);
    result.Q    = sum_of(result.rows, part.terms, 0);
    result.n_constraints =
        part.sector.is_whole() ? n_expansion_constraints : n_expansion_constraints / 2;
    result.n_local_constraints = part.sector.n_local_pressures(n_local_constraints);
    result.compliant           = compliant;
    return result;
  }

  MultiVector ReducedSectors::apply_inverse(const MultiVector &b) const
  {
    ++n_inverse_;
    MultiVector x(b.row_range(), b.n_columns());
    for (unsigned int h = 0; h < parts.size(); ++h)
    {
      const MultiVector b_h = parts[h].sector.restrict(b);
      if (largest_entry(b_h) > 0)
        x += parts[h].sector.expand(inverse_factors[h]->solve(b_h));
    }
    return x;
  }

  void ReducedSectors::renew_inverse(const std::vector<Term> &terms)
  {
    if (!has_expansion_point() || !restrict(terms))
      return;
    const Part &part = parts.front();
    try
    {
      inverse_factors.front() = std::make_shared<const Factorization>(
          sum_of(part.reference->row_range(), part.terms, 0), Factorization::Kind::lu,
          "the position matrix (for static states)");
    }
    catch (const SingularMatrix &)
    {
    }
  }

  std::vector<double> ReducedSectors::varying_terms() const
  {
    // The first sector that cannot be projected keeps the others from learning.
    std::set<double> of_any;
    for (const Part &part : parts)
      for (const double number : part.reduced.varying_terms())
        of_any.insert(number);
    return {of_any.begin(), of_any.end()};
  }

  void ReducedSectors::keep_apart(const std::vector<double> &varying_terms)
  {
    for (Part &part : parts)
      part.reduced.keep_apart(varying_terms);
  }

  void ReducedSectors::learn(const std::vector<Term> &terms)
  {
    if (!has_expansion_point() || !restrict(terms))
      return;
    for (Part &part : parts)
      part.reduced.learn(part.terms);
  }

  bool ReducedSectors::has_expansion_point() const
  {
    return !parts.empty() &&
           std::all_of(parts.begin(), parts.end(),
                       [](const Part &part)
                       { return part.n_modes == 0 || part.reduced.has_expansion_point(); }) &&
           std::any_of(parts.begin(), parts.end(),
                       [](const Part &part) { return part.n_modes > 0; });
  }

  // Terms.

  bool ReducedSectors::keep_to_sectors(const std::vector<Term> &terms) const
  {
    // A hundredth of the backward error that projected modes may have, but no less than the
    // rounding that full solutions allow
    const double rounding = std::max(1e-3 * options.tolerance, 1e-11);
    return std::all_of(terms.begin(), terms.end(),
                       [&](const Term &term)
                       { return sectors.keep(term, rounding * norms[term.order]); });
  }

  bool ReducedSectors::restrict(const std::vector<Term> &terms)
  {
    if (parts.size() == 1)
    {
      parts.front().terms = terms;
      return true;
    }
    const TermList list(terms);
    // New ones at once: rows are walked through once for all.
    std::vector<Term> added;
    std::vector<std::vector<Term>> alone;
    for (unsigned int k = 0; k < list.n_matrices(); ++k)
      if (!parts.front().restricted.find(list.matrix(k)))
      {
        added.insert(added.end(), list.terms_of(k).begin(), list.terms_of(k).end());
        alone.push_back({{added.back().origin, 0, 1., list.matrix(k)}});
      }
    if (!keep_to_sectors(added))
      return false;
    for (Part &part : parts)
    {
      std::vector<Matrix> restricted = part.sector.sums(alone);
      unsigned int next              = 0;
      part.restricted.carry_over(
          list, [&](unsigned int)
          { return std::make_shared<const Matrix>(std::move(restricted[next++])); });
      part.terms.clear();
      for (const Term &term : terms)
        if (term.matrix && *term.matrix)
          part.terms.push_back(
              {term.origin, term.order, term.coefficient, part.restricted.at(term.matrix)});
    }
    return true;
  }

  bool ReducedSectors::has_count_of_expansion_point(const std::vector<Term> &terms)
  {
    if (!restrict(terms))
      return false;
    for (Part &part : parts)
      if (part.reference->count(part.terms) != part.expansion_count)
        return false;
    return true;
  }

  // Modes.

  std::vector<RimSurvey::InSector>
  ReducedSectors::in_sectors(const unsigned int n_constraints) const
  {
    std::vector<RimSurvey::InSector> result;
    for (const Part &part : parts)
      result.push_back({part.sector.row_range(), part.terms,
                        part.sector.is_whole() ? n_constraints : n_constraints / 2});
    return result;
  }

  std::optional<EigenPairs> ReducedSectors::solve(const std::vector<Term> &terms,
                                                  const unsigned int n_constraints)
  {
    if (!restrict(terms) || !rim.covers(terms, in_sectors(n_constraints)))
      return std::nullopt;
    std::vector<EigenPairs> found;
    for (Part &part : parts)
    {
      std::optional<EigenPairs> of_part =
          part.n_modes == 0 ? EigenPairs() : part.reduced.solve(part.terms);
      if (!of_part)
        return std::nullopt;
      found.push_back(std::move(*of_part));
    }
    // A sector may need no correction for many values while its vectors drift: the largest
    // amplification of all sectors counts.
    constexpr double safety = 4;
    double amplification    = 0;
    for (const Part &part : parts)
      amplification = std::max(amplification, part.reduced.amplification());
    for (EigenPairs &of_part : found)
      for (const double error : of_part.backward_error)
        of_part.projection_error.push_back(
            std::max(safety * amplification * error, options.tolerance));
    if (parts.size() == 1)
      return std::move(found.front());
    EigenPairs modes;
    for (unsigned int h = 0; h < parts.size(); ++h)
    {
      EigenPairs &of_part = found[h];
      of_part.parity.assign(of_part.size(), parts[h].sector.parity());
      // Components and norms of a sector and of the whole differ by up to sqrt(2).
      for (double &error : of_part.backward_error)
        error *= 2;
      for (const auto side : both_sides)
        of_part.*side = in_all_coordinates(of_part.*side);
      if (h == 0)
        modes = std::move(of_part);
      else
        modes.append(of_part);
    }
    return modes.select(order_of_modes(modes.lambda));
  }

  bool ReducedSectors::is_crowded() const
  {
    return std::any_of(parts.begin(), parts.end(),
                       [](const Part &part) { return part.reduced.is_crowded(); });
  }

  bool ReducedSectors::is_full() const
  {
    return std::any_of(parts.begin(), parts.end(),
                       [](const Part &part) { return part.reduced.is_full(); });
  }

  EigenPairs ReducedSectors::restart(const EigenPairs &modes)
  {
    std::vector<EigenPairs> of_parts;
    for (Part &part : parts)
    {
      of_parts.push_back(extract(modes, part));
      if (!part.reduced.is_crowded())
        continue;
      const EigenPairs whole = part.reduced.expand(of_parts.back());
      part.reduced.restart();
      of_parts.back() = part.reduced.coordinates(whole);
    }
    EigenPairs result = modes;
    for (const auto side : both_sides)
    {
      result.*side = in_all_coordinates(ComplexMultiVector(small_rows(0), modes.size()));
      for (unsigned int h = 0; h < parts.size(); ++h)
        insert(of_parts[h].*side, modes_of(modes, parts[h]), result.*side);
    }
    return result;
  }

  std::vector<unsigned int> ReducedSectors::modes_of(const EigenPairs &modes, const Part &part)
  {
    std::vector<unsigned int> numbers;
    for (unsigned int k = 0; k < modes.size(); ++k)
      if (part.sector.is_whole() || modes.parity[k] == part.sector.parity())
        numbers.push_back(k);
    return numbers;
  }

  EigenPairs ReducedSectors::extract(const EigenPairs &modes, const Part &part)
  {
    EigenPairs result = modes.select(modes_of(modes, part));
    for (const auto side : both_sides)
      result.*side = with_rows(result.*side, part.reduced.dimension());
    return result;
  }

  template <typename Visit>
  void ReducedSectors::for_parts(const EigenPairs &modes, const Visit &visit) const
  {
    for (const Part &part : parts)
      if (const std::vector<unsigned int> numbers = modes_of(modes, part); !numbers.empty())
        visit(part, numbers, extract(modes, part));
  }

  ComplexMultiVector ReducedSectors::in_all_coordinates(const ComplexMultiVector &of_part) const
  {
    unsigned int largest = 0;
    for (const Part &part : parts)
      largest = std::max(largest, part.reduced.dimension());
    return with_rows(of_part, largest);
  }

  std::vector<std::complex<double>>
  ReducedSectors::biorthogonality(const EigenPairs &of_left, const EigenPairs &of_right) const
  {
    std::vector<std::complex<double>> result(std::size_t(of_left.size()) * of_right.size());
    for_parts(
        of_right,
        [&](const Part &part, const std::vector<unsigned int> &columns, const EigenPairs &right)
        {
          const std::vector<unsigned int> lines = modes_of(of_left, part);
          const auto form =
              squeal::biorthogonality(part.reduced.problem(), extract(of_left, part), right);
          for (unsigned int j = 0; j < columns.size(); ++j)
            for (unsigned int i = 0; i < lines.size(); ++i)
              result[lines[i] + std::size_t(columns[j]) * of_left.size()] =
                  form[i + std::size_t(j) * lines.size()];
        });
    return result;
  }

  ReducedModel::RayleighForms ReducedSectors::rayleigh_forms(const EigenPairs &modes) const
  {
    ReducedModel::RayleighForms result;
    result.of_p.resize(modes.size());
    result.of_q = result.of_p;
    for_parts(
        modes,
        [&](const Part &part, const std::vector<unsigned int> &numbers, const EigenPairs &of_part)
        {
          const auto forms = part.reduced.rayleigh_forms(of_part);
          for (unsigned int k = 0; k < numbers.size(); ++k)
          {
            result.of_p[numbers[k]] = forms.of_p[k];
            result.of_q[numbers[k]] = forms.of_q[k];
          }
        });
    return result;
  }

  /// z^H dA x of a mode of a sector needs V_h^T dA V_h only, whatever the symmetry of dA.
  std::vector<std::complex<double>>
  ReducedSectors::sensitivities(const ParameterDerivative &derivative,
                                const EigenPairs &modes) const
  {
    std::vector<std::complex<double>> result(modes.size());
    for_parts(
        modes,
        [&](const Part &part, const std::vector<unsigned int> &numbers, const EigenPairs &of_part)
        {
          ParameterDerivative projected = derivative;
          projected.terms.clear();
          for (const Term &term : derivative.terms)
            if (term.matrix && *term.matrix)
              projected.terms.push_back(
                  {term.origin, term.order, term.coefficient, part.sector.restrict(term.matrix)});
          projected.terms  = part.reduced.project(projected.terms);
          const auto found = squeal::sensitivities(projected, of_part);
          for (unsigned int k = 0; k < numbers.size(); ++k)
            result[numbers[k]] = found[k];
        });
    return result;
  }

  EigenPairs ReducedSectors::expand(const EigenPairs &modes) const
  {
    EigenPairs result = modes;
    for (const auto side : both_sides)
      result.*side = ComplexMultiVector(whole, modes.size());
    for_parts(
        modes,
        [&](const Part &part, const std::vector<unsigned int> &numbers, const EigenPairs &of_part)
        {
          const EigenPairs expanded = part.reduced.expand(of_part);
          for (const auto side : both_sides)
            insert(part.sector.expand(expanded.*side), numbers, result.*side);
        });
    return result;
  }
} // namespace squeal
