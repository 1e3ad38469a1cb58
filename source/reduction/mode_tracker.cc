#include <squeal/assessment/stability.h>
#include <squeal/base/stopwatch.h>
#include <squeal/eigen/find_modes.h>
#include <squeal/reduction/branches.h>
#include <squeal/reduction/mode_tracker.h>

#include <algorithm>
#include <cmath>

// First assembly, with static states by factors nearby. Then the expansion point: a full solution,
// models of the sectors, which terms keep to them. Then modes: solved sector by sector and put into
// one list; bases that are restarted. Last what is asked of modes, whole ones or by their
// coordinates, sector by sector again.

namespace squeal
{
  using Complex = std::complex<double>;

  ModeTracker::ModeTracker(const EigensolverOptions &given, const ModeSolver mode_solver)
      : options(given), solver(mode_solver), rim(given.max_imaginary)
  {
    options.keep_factors = true;
  }

  void ModeTracker::set_model(Model &other)
  {
    model = &other;
    parts.clear();
    sectors.reset();
    summed.reset();
  }

  void ModeTracker::assemble_model(const Parameters::All &parameters, const LinearOperator &nearby)
  {
    const LifetimeSeconds stopwatch(seconds_.assembly);
    summed.reset(); // two of them would double the memory
    at_rest.reset();
    ++counts.assemblies;
    const unsigned int n_before = counts.inverse;
    model->assemble(parameters, nearby);
    // Measured: factors of the symmetric half cost as much as 20 solutions, and serve for many
    // values.
    constexpr unsigned int most_solutions = 10;
    options.progress("  static state: " + std::to_string(counts.inverse - n_before) +
                     " solutions with factors nearby");
    if (nearby && counts.inverse > n_before + most_solutions)
      renew_inverse();
  }

  void ModeTracker::assemble_again(const Parameters::All &parameters,
                                   const EigenSolution::Reuse &solution)
  {
    if (solution.assembly != counts.assemblies) // the search for critical values went elsewhere
      assemble_model(parameters, {});
  }

  const QuadraticEigenproblem &ModeTracker::whole_problem() const
  {
    if (!summed)
      summed = sum_of(model->equations().frozen(options.max_imaginary));
    return *summed;
  }

  LinearOperator ModeTracker::inverse() const
  {
    if (parts.empty() || !parts.front().position_factors)
      return {};
    return [this](const MultiVector &b)
    {
      ++counts.inverse;
      MultiVector x(b.row_range(), b.n_columns());
      for (const SectorModel &part : parts)
      {
        const MultiVector b_h = part.sector.restrict(b);
        if (largest_entry(b_h) > 0)
          x += part.sector.expand(part.position_factors->solve(b_h));
      }
      return x;
    };
  }

  void ModeTracker::renew_inverse()
  {
    if (!has_expansion_point() || !set_terms())
      return;
    SectorModel &part = parts.front();
    try
    {
      part.position_factors = std::make_shared<const Factorization>(
          sum_of(part.sector.row_range(), part.terms(), 0), Factorization::Kind::lu,
          "the position matrix (for static states)");
    }
    catch (const SingularMatrix &)
    {
    }
  }

  // The expansion point.

  void ModeTracker::set_expansion_point(const Parameters::All &parameters,
                                        const EigenSolution::Reuse &solution)
  {
    if (solution.empty()) // what an older one projects may lack modes that this one has
    {
      parts.clear();
      return;
    }
    assemble_again(parameters, solution);
    whole_problem();
    QuadraticEigenproblem problem = std::move(*summed);
    summed.reset();
    for (unsigned int order = 0; order < 3; ++order)
      norms[order] = (order == 0 ? problem.Q : order == 1 ? problem.P : problem.M).infinity_norm();

    std::vector<const EigenSolution::Reuse *> found;
    for (const auto &of_sector : solution.sectors)
      found.push_back(&of_sector->reuse);
    if (found.empty())
      found = {&solution};
    else // the sectors sum their own
      problem = problem.of_same_unknowns();
    if (parts.size() != found.size()) // else what they have learnt of the terms stays
    {
      parts.clear();
      for (const Sector &sector : (found.size() == 1 ? Sectors() : *sectors).all(problem.rows))
        parts.emplace_back(sector, options, course);
    }
    for (SectorModel &part : parts)
      part.position_factors.reset();
    if (!set_terms())
    {
      parts.clear();
      return;
    }
    double clearance = found.front()->clearance;
    no_growth_beyond = true;
    for (const EigenSolution::Reuse *of_sector : found)
    {
      clearance = std::min(clearance, of_sector->clearance);
      no_growth_beyond &= of_sector->has_no_growth_beyond;
    }
    rim.begin(clearance, model->terms(), in_sectors(problem.n_constraints));
    for (unsigned int h = 0; h < parts.size(); ++h)
      parts[h].set_expansion_point(problem, *found[h], model->has_semidefinite_terms());
    if (!has_expansion_point())
      for (SectorModel &part : parts)
        part.position_factors.reset();
  }

  bool ModeTracker::has_expansion_point() const
  {
    return std::all_of(parts.begin(), parts.end(),
                       [](const SectorModel &part) { return part.is_ready(); }) &&
           std::any_of(parts.begin(), parts.end(),
                       [](const SectorModel &part) { return part.has_modes(); });
  }

  bool ModeTracker::keep_to_sectors(const std::vector<Term> &terms) const
  {
    // A hundredth of the backward error that projected modes may have, but no less than the
    // rounding that full solutions allow
    const double rounding = std::max(1e-3 * options.tolerance, 1e-11);
    return std::all_of(terms.begin(), terms.end(),
                       [&](const Term &term)
                       { return sectors->keep(term, rounding * norms[term.order]); });
  }

  bool ModeTracker::set_terms()
  {
    const std::vector<Term> &terms = model->terms();
    const TermList list(terms);
    // New ones at once: rows are walked through once for all.
    std::vector<Term> added;
    std::vector<std::vector<Term>> alone;
    for (unsigned int k = 0; k < list.n_matrices() && parts.size() > 1; ++k)
      if (!parts.front().knows(list.matrix(k)))
      {
        added.insert(added.end(), list.terms_of(k).begin(), list.terms_of(k).end());
        alone.push_back({{added.back().origin, 0, 1., list.matrix(k)}});
      }
    if (!keep_to_sectors(added))
      return false;
    for (SectorModel &part : parts)
      part.set_terms(terms, list, alone);
    return true;
  }

  std::vector<double> ModeTracker::varying_terms() const
  {
    // All sectors learn of all terms.
    return parts.empty() ? std::vector<double>() : parts.front().reduced.terms().varying_terms();
  }

  void ModeTracker::keep_apart(const std::vector<double> &varying_terms)
  {
    for (SectorModel &part : parts)
      part.reduced.terms().keep_apart(varying_terms);
  }

  void ModeTracker::look_at(const Parameters::All &parameters)
  {
    assemble_model(parameters, inverse());
    if (has_expansion_point() && set_terms())
      for (SectorModel &part : parts)
        part.reduced.terms().learn(part.terms());
  }

  // Modes.

  EigenSolution ModeTracker::solve(const Parameters::All &parameters, const Scope scope)
  {
    if (!parameters.has_relaxation() && has_expansion_point() &&
        (scope == Scope::disc || no_growth_beyond))
    {
      assemble_model(parameters, inverse());
      if (has_count_of_expansion_point())
      {
        const LifetimeSeconds stopwatch(seconds_.projection);
        if (std::optional<EigenPairs> modes = solve_by_projection())
        {
          EigenSolution found;
          found.modes          = std::move(*modes);
          found.reuse.assembly = counts.assemblies;
          return found;
        }
      }
    }
    return solve_fully(parameters, scope);
  }

  EigenSolution ModeTracker::solve_fully(const Parameters::All &parameters, const Scope scope)
  {
    assemble_model(parameters, {});
    const LifetimeSeconds stopwatch(seconds_.full);
    const EquationsOfMotion equations = model->equations();
    whole_rows                        = equations.rows;
    ++counts.full;
    if (!sectors)
      sectors = model->sectors();
    EigensolverOptions scoped = options;
    scoped.looks_beyond_disc  = scope == Scope::window;
    EigenSolution found;
    try
    {
      found = find_modes(solver, equations, scoped, *sectors);
    }
    catch (const SingularMatrix &)
    {
      // A divergence lies exactly here: another shift than zero.
      scoped.shift = 0.1;
      found        = find_modes(solver, equations, scoped, *sectors);
    }
    found.reuse.assembly = counts.assemblies;
    return found;
  }

  bool ModeTracker::has_count_of_expansion_point()
  {
    const LifetimeSeconds stopwatch(seconds_.counting);
    return set_terms() &&
           std::all_of(parts.begin(), parts.end(),
                       [](SectorModel &part) { return part.has_count_of_expansion_point(); });
  }

  std::vector<RimSurvey::InSector> ModeTracker::in_sectors(const unsigned int n_constraints) const
  {
    std::vector<RimSurvey::InSector> result;
    for (const SectorModel &part : parts)
      result.push_back(part.in_survey(n_constraints));
    return result;
  }

  std::optional<EigenPairs> ModeTracker::solve_by_projection()
  {
    if (!rim.covers(model->terms(), in_sectors(n_constraints())))
      return std::nullopt;
    // The first sector that cannot be projected is not to keep the others from learning.
    for (SectorModel &part : parts)
      part.reduced.terms().learn(part.terms());
    std::vector<EigenPairs> found;
    for (SectorModel &part : parts)
    {
      std::optional<EigenPairs> of_part =
          part.has_modes() ? part.reduced.solve(part.terms()) : EigenPairs();
      if (!of_part)
        return std::nullopt;
      found.push_back(std::move(*of_part));
    }
    // A sector may need no correction for many values while its vectors drift: the largest
    // amplification of all sectors counts.
    constexpr double safety = 4;
    double amplification    = 0;
    for (const SectorModel &part : parts)
      amplification = std::max(amplification, part.reduced.amplification());
    for (EigenPairs &of_part : found)
      for (const double error : of_part.backward_error)
        of_part.projection_error.push_back(
            std::max(safety * amplification * error, options.tolerance));
    return list_of(std::move(found));
  }

  EigenPairs ModeTracker::list_of(std::vector<EigenPairs> found) const
  {
    if (parts.size() == 1)
      return std::move(found.front());
    EigenPairs modes;
    for (unsigned int h = 0; h < parts.size(); ++h)
    {
      EigenPairs of_part = in_coordinates(std::move(found[h]), largest_dimension());
      of_part.parity.assign(of_part.size(), parts[h].sector.parity());
      // Components and norms of a sector and of the whole differ by up to sqrt(2).
      for (double &error : of_part.backward_error)
        error *= 2;
      if (h == 0)
        modes = std::move(of_part);
      else
        modes.append(of_part);
    }
    return modes.select(order_of_modes(modes.lambda));
  }

  unsigned int ModeTracker::largest_dimension() const
  {
    unsigned int largest = 0;
    for (const SectorModel &part : parts)
      largest = std::max(largest, part.reduced.dimension());
    return largest;
  }

  bool ModeTracker::is_crowded() const
  {
    return std::any_of(parts.begin(), parts.end(),
                       [](const SectorModel &part) { return part.reduced.is_crowded(); });
  }

  bool ModeTracker::is_full() const
  {
    return std::any_of(parts.begin(), parts.end(),
                       [](const SectorModel &part) { return part.reduced.is_full(); });
  }

  EigenPairs ModeTracker::restart(const EigenPairs &modes)
  {
    ++counts.restarts;
    std::vector<SectorModes> all = by_sector(is_whole(modes) ? EigenPairs() : modes);
    for (unsigned int h = 0; h < parts.size(); ++h)
      if (ReducedModel &reduced = parts[h].reduced; reduced.is_crowded())
      {
        const EigenPairs vectors = reduced.expand(all[h].pairs);
        reduced.restart();
        all[h].pairs = reduced.projected().basis.coordinates(vectors);
      }
    if (is_whole(modes))
      return modes;
    EigenPairs result = modes;
    result.right = result.left = {small_rows(largest_dimension()), modes.size()};
    for (const SectorModes &of_sector : all)
      of_sector.put_vectors(result);
    return result;
  }

  // What is asked of modes.

  std::vector<SectorModes> ModeTracker::by_sector(const EigenPairs &modes) const
  {
    std::vector<SectorModes> result;
    for (const SectorModel &part : parts)
      result.emplace_back(part, modes);
    return result;
  }

  EigenPairs ModeTracker::in_their_phases(const EigenPairs &modes) const
  {
    if (is_whole(modes))
      return modes;
    EigenPairs result = modes;
    result.right = result.left = {whole_rows, modes.size()};
    for (SectorModes &of_sector : by_sector(modes))
      if (!of_sector.numbers.empty())
      {
        const SectorModel &part = of_sector.model;
        of_sector.pairs         = part.reduced.expand(of_sector.pairs);
        of_sector.pairs.right   = part.sector.expand(of_sector.pairs.right);
        of_sector.pairs.left    = part.sector.expand(of_sector.pairs.left);
        of_sector.put_vectors(result);
      }
    return result;
  }

  std::vector<ModeRow> ModeTracker::analyse(const EigenPairs &modes) const
  {
    if (!model->relaxation().empty())
      return squeal::analyse(rayleigh_parts(*model, modes), modes, 0, options.tolerance);
    if (is_whole(modes))
      return squeal::analyse(whole_problem(), modes, 0, options.tolerance);
    std::vector<Complex> of_p(modes.size()), of_q = of_p;
    for (const SectorModes &of_sector : by_sector(modes))
      if (!of_sector.numbers.empty())
      {
        const auto forms = of_sector.model.reduced.projected().rayleigh_forms(of_sector.pairs);
        of_sector.put(forms.of_p, of_p);
        of_sector.put(forms.of_q, of_q);
      }
    return squeal::analyse(modes, of_p, of_q, 0, options.tolerance);
  }

  std::vector<Complex> ModeTracker::sensitivities(const std::string &parameter,
                                                  const EigenPairs &modes) const
  {
    std::vector<Complex> result;
    for (const ParameterDerivative &derivative : derivatives(parameter))
      if (is_whole(modes))
        result = squeal::sensitivities(derivative, modes);
      else
      {
        result.assign(modes.size(), 0);
        for (const SectorModes &of_sector : by_sector(modes))
          if (!of_sector.numbers.empty())
            of_sector.put(
                squeal::sensitivities(of_sector.model.project(derivative), of_sector.pairs),
                result);
      }
    return result;
  }

  std::vector<Complex> ModeTracker::reduced_form(const EigenPairs &of_left,
                                                 const EigenPairs &of_right) const
  {
    std::vector<Complex> result(std::size_t(of_left.size()) * of_right.size());
    for (const SectorModel &part : parts)
      if (const SectorModes left(part, of_left), right(part, of_right); !right.numbers.empty())
      {
        const auto form = biorthogonality(
            part.reduced.projected().problem(ReducedProjection::petrov), left.pairs, right.pairs);
        for (std::size_t j = 0, k = 0; j < right.numbers.size(); ++j)
          for (std::size_t i = 0; i < left.numbers.size(); ++i, ++k)
            result[left.numbers[i] + right.numbers[j] * std::size_t(of_left.size())] = form[k];
      }
    return result;
  }

  std::vector<Complex> ModeTracker::transition(const EigenPairs &before,
                                               const EigenPairs &next) const
  {
    std::vector<Complex> form;
    if (is_whole(before) && is_whole(next))
      form = biorthogonality(whole_problem(), before, next);
    else if (!is_whole(before) && !is_whole(next))
      form = reduced_form(before, next);
    else
    {
      // The form needs no more.
      QuadraticEigenproblem moving;
      moving.rows = whole_rows;
      moving.M    = matrix_free_sum_of(whole_rows, model->terms(), 2);
      moving.P    = matrix_free_sum_of(whole_rows, model->terms(), 1);
      form        = biorthogonality(moving, in_their_phases(before), in_their_phases(next));
    }
    return transition_of(std::move(form), before);
  }

  ErrorEffects ModeTracker::estimate_errors(const ErrorEstimator &estimator,
                                            const Parameters::All &parameters,
                                            const EigenPairs &modes,
                                            const EigenSolution::Reuse &solution)
  {
    const EigenPairs all = whole(modes);
    assemble_again(parameters, solution);
    const LifetimeSeconds stopwatch(seconds_.bars);
    return estimator(*model, all);
  }

  const QuadraticEigenproblem &ModeTracker::assemble(const Parameters::All &parameters)
  {
    assemble_model(parameters, inverse());
    return whole_problem();
  }

  const QuadraticEigenproblem &ModeTracker::assemble_at_rest(const Parameters::All &parameters)
  {
    if (!parameters.has_relaxation())
      return assemble(parameters);
    assemble_model(parameters, inverse());
    EquationsOfMotion relaxed = model->equations();
    relaxed.relaxation.clear();
    at_rest = sum_of(relaxed);
    return *at_rest;
  }
} // namespace squeal
