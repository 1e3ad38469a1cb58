#include <squeal/assessment/stability.h>
#include <squeal/base/stopwatch.h>
#include <squeal/eigen/find_modes.h>
#include <squeal/reduction/branches.h>
#include <squeal/reduction/mode_tracker.h>

#include <cmath>

namespace squeal
{
  ModeTracker::ModeTracker(const EigensolverOptions &given, const ModeSolver mode_solver)
      : options(given), solver(mode_solver), reduced(given)
  {
    options.keep_factors = true;
  }

  void ModeTracker::set_model(Model &other)
  {
    model   = &other;
    reduced = ReducedSectors(options);
    sectors.reset();
    summed.reset();
  }

  void ModeTracker::assemble_model(const Parameters::All &parameters, const LinearOperator &nearby)
  {
    const LifetimeSeconds stopwatch(seconds_.assembly);
    summed.reset(); // two of them would double the memory
    at_rest.reset();
    ++n_assemblies;
    const unsigned int n_before = reduced.n_inverse();
    model->assemble(parameters, nearby);
    // Measured: factors of the symmetric half cost as much as 20 solutions, and serve for many
    // values.
    constexpr unsigned int most_solutions = 10;
    options.progress("  static state: " + std::to_string(reduced.n_inverse() - n_before) +
                     " solutions with factors nearby");
    if (nearby && reduced.n_inverse() > n_before + most_solutions)
      reduced.renew_inverse(model->terms());
  }

  const QuadraticEigenproblem &ModeTracker::whole_problem() const
  {
    if (!summed)
      summed = sum_of(model->equations().frozen(options.max_imaginary));
    return *summed;
  }

  bool ModeTracker::has_count_of_expansion_point()
  {
    const LifetimeSeconds stopwatch(seconds_.counting);
    return reduced.has_count_of_expansion_point(model->terms());
  }

  void ModeTracker::look_at(const Parameters::All &parameters)
  {
    assemble_model(parameters, reduced.inverse());
    reduced.learn(model->terms());
  }

  EigenSolution ModeTracker::solve(const Parameters::All &parameters, const Scope scope)
  {
    if (!parameters.has_relaxation() && reduced.has_expansion_point() &&
        (scope == Scope::disc || reduced.has_no_growth_beyond()))
    {
      assemble_model(parameters, reduced.inverse());
      if (has_count_of_expansion_point())
      {
        const LifetimeSeconds stopwatch(seconds_.projection);
        if (std::optional<EigenPairs> modes = reduced.solve(model->terms(), n_constraints()))
        {
          EigenSolution found;
          found.modes          = std::move(*modes);
          found.reuse.assembly = n_assemblies;
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
    ++n_full;
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
    found.reuse.assembly = n_assemblies;
    return found;
  }

  void ModeTracker::assemble_again(const Parameters::All &parameters,
                                   const EigenSolution::Reuse &solution)
  {
    if (solution.assembly != n_assemblies) // the search for critical values went elsewhere
      assemble_model(parameters, {});
  }

  void ModeTracker::set_expansion_point(const Parameters::All &parameters,
                                        const EigenSolution::Reuse &solution)
  {
    if (solution.empty()) // what an older one projects may lack modes that this one has
    {
      reduced = ReducedSectors(options);
      return;
    }
    assemble_again(parameters, solution);
    whole_problem();
    reduced.set_expansion_point(std::move(*summed), model->terms(), solution, *sectors,
                                model->has_semidefinite_terms());
    summed.reset();
  }

  std::vector<ModeRow> ModeTracker::analyse(const EigenPairs &modes) const
  {
    if (!model->relaxation().empty())
      return squeal::analyse(rayleigh_parts(*model, modes), modes, 0, options.tolerance);
    if (is_whole(modes))
      return squeal::analyse(whole_problem(), modes, 0, options.tolerance);
    const auto forms = reduced.rayleigh_forms(modes);
    return squeal::analyse(modes, forms.of_p, forms.of_q, 0, options.tolerance);
  }

  std::vector<std::complex<double>> ModeTracker::sensitivities(const std::string &parameter,
                                                               const EigenPairs &modes) const
  {
    std::vector<std::complex<double>> result;
    for (const ParameterDerivative &derivative : derivatives(parameter))
      result = is_whole(modes) ? squeal::sensitivities(derivative, modes)
                               : reduced.sensitivities(derivative, modes);
    return result;
  }

  std::vector<std::complex<double>> ModeTracker::transition(const EigenPairs &before,
                                                            const EigenPairs &next) const
  {
    std::vector<std::complex<double>> form;
    if (is_whole(before) && is_whole(next))
      form = biorthogonality(whole_problem(), before, next);
    else if (!is_whole(before) && !is_whole(next))
      form = reduced.biorthogonality(before, next);
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
    assemble_model(parameters, reduced.inverse());
    return whole_problem();
  }

  const QuadraticEigenproblem &ModeTracker::assemble_at_rest(const Parameters::All &parameters)
  {
    if (!parameters.has_relaxation())
      return assemble(parameters);
    assemble_model(parameters, reduced.inverse());
    EquationsOfMotion relaxed = model->equations();
    relaxed.relaxation.clear();
    at_rest = sum_of(relaxed);
    return *at_rest;
  }
} // namespace squeal
