#include <squeal/base/memory.h>
#include <squeal/continuation/stability_map.h>
#include <squeal/continuation/sweep.h>
#include <squeal/run/analysis.h>
#include <squeal/symmetry/sectors.h>

#include <slepcsys.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    const std::vector<std::string> phase_names = {"mesh",         "assembly", "contact", "static",
                                                  "eigenproblem", "estimate", "output"};

    /// The window of frequencies, as "up to 6000 Hz" or "from 10000 to 12000 Hz".
    std::string window_of(const Parameters::Eigenproblem &prm)
    {
      const std::string maximum = number(prm.maximum_frequency) + " Hz";
      return prm.minimum_frequency > 0 ? "from " + number(prm.minimum_frequency) + " to " + maximum
                                       : "up to " + maximum;
    }

    std::string cycles_header()
    {
      std::string header = "cycle,cells,dofs,multipliers";
      for (const std::string &phase : phase_names)
        header += ",seconds_" + phase;
      return header + ",processor_seconds,seconds_total,memory_mib";
    }
  } // namespace

  Analysis::Analysis(ParameterFile &file, const std::string &directory, const MPI_Comm comm)
      : file(file), prm(file.parameters()), directory(directory), comm(comm), log(comm),
        budget(prm.refinement), resumable(start_run_directory(directory, file, comm))
  {
    log.open(directory + "/log.txt", resumable);
    int n_ranks = 0;
    MPI_Comm_size(comm, &n_ranks);
    char slepc_version[256];
    SQUEAL_PETSC(SlepcGetVersion(slepc_version, sizeof(slepc_version)));
    log.line("squeal " SQUEAL_VERSION " (deal.II " DEAL_II_PACKAGE_VERSION ", " +
             std::string(slepc_version).substr(0, std::string(slepc_version).find(',')) +
#ifdef DEBUG
             ", debug"
#else
             ", release"
#endif
             "), " +
             std::to_string(n_ranks) + (n_ranks == 1 ? " rank" : " ranks"));
    log.print(describe(prm, directory));
    if (resumable)
      if (auto found = Checkpoint::resume(directory, comm))
        record = std::move(*found);
  }

  std::unique_ptr<Table> Analysis::table(const std::string &name, const std::string &header)
  {
    return std::make_unique<Table>(directory + "/" + name, header, comm, !record.cycles.empty());
  }

  EigensolverOptions Analysis::eigensolver_options()
  {
    EigensolverOptions options;
    options.max_imaginary = 2 * M_PI * prm.eigenproblem.maximum_frequency;
    options.min_imaginary = 2 * M_PI * prm.eigenproblem.minimum_frequency;
    options.tolerance     = prm.eigenproblem.tolerance;
    options.shift         = prm.eigenproblem.shift;
    options.progress      = [this](const std::string &text) { log.progress(text); };
    return options;
  }

  void Analysis::solve(const Model &model)
  {
    std::optional<MirrorSymmetry> symmetry;
    if (prm.eigenproblem.mirror_symmetry)
      symmetry = model.mirror_symmetry();
    found = solve_by_symmetry(*make_eigensolver(prm.eigenproblem.solver), model.equations(),
                              eigensolver_options(), symmetry);
  }

  void Analysis::sweep(Model &model, const ModelFactory &make_model)
  {
    if (prm.sweep.is_map())
      StabilityMap(file, model, eigensolver_options(), directory, comm, log).run();
    else
      Sweep(file, model, make_model, eigensolver_options(), directory, comm, log).run();
  }

  void Analysis::climb(Model &model)
  {
    Table ladder_csv(directory + "/ladder.csv", std::string("stage,") + modes_header, comm);
    std::vector<std::vector<ModeRow>> rows;
    std::vector<std::string> stages;
    for (Stage s = Stage::elastic; s < Stage::ladder; s = Stage(int(s) + 1))
    {
      const std::string &stage = stages.emplace_back(name_of(s));
      file.choose("Stage", stage);
      model.assemble(prm);
      PhaseTimer::Scope scope(timer, "eigenproblem");
      solve(model);
      rows.push_back(
          analyse(rayleigh_parts(model, found.modes), found.modes, 0, prm.eigenproblem.tolerance));
      for (const ModeRow &row : rows.back())
      {
        std::vector<std::string> fields = {stage};
        const auto of_mode              = modes_fields(row);
        fields.insert(fields.end(), of_mode.begin(), of_mode.end());
        ladder_csv.add(fields);
      }
      log.line("Stage " + stage + ": " + std::to_string(rows.back().size()) + " modes. " +
               found.proof.completeness + ".");
    }
    file.choose("Stage", "ladder");
    log.print(
        "\nGrowth rates, 1/s, and verdicts of the stages; modes are paired by their eigenvalues\n" +
        ladder_table(stages, rows) +
        "\nOnly the stage full supports a verdict on a real brake: without damping every "
        "circulatory\ngyroscopic system is unstable, and damping of one kind alone settles "
        "nothing.\n");
  }

  void Analysis::find_modes(const Model &model, const unsigned int cycle)
  {
    RayleighParts parts;
    {
      PhaseTimer::Scope scope(timer, "eigenproblem");
      solve(model);
      parts = rayleigh_parts(model, found.modes);
      rows  = analyse(parts, found.modes, cycle, prm.eigenproblem.tolerance);
    }
    return_freed_memory();
    Stopwatch watch;
    estimate(rows);
    return_freed_memory();
    const double of_bars = watch.lap();
    if (!modes_csv) // sweeps and maps need no such tables
    {
      modes_csv         = table("modes.csv", modes_header);
      contributions_csv = table("contributions.csv", contributions_header);
    }
    for (const ModeRow &row : rows)
      modes_csv->add(modes_fields(row));

    log.line("Completeness: " + found.proof.completeness + ".");
    if (found.cost.seconds.factorization > 0)
    {
      char text[240];
      std::snprintf(text, sizeof(text),
                    "Eigenproblem, processor seconds: counting %.2f, factorisation %.2f, right "
                    "vectors %.2f, left vectors %.2f, error bars %.2f; %u right-hand sides.",
                    found.cost.seconds.counting, found.cost.seconds.factorization,
                    found.cost.seconds.right, found.cost.seconds.left, of_bars,
                    found.cost.n_solves);
      log.line(text);
    }
    if (prm.eigenproblem.is_matrix_free())
      log.line("Eigenproblem without factors: " + std::to_string(found.cost.n_solves) +
               " multigrid cycles.");
    if (found.proof.n_rigid_body_modes > 0)
      log.line("Not listed: " + std::to_string(found.proof.n_rigid_body_modes) +
               " rigid-body modes at zero frequency.");
    log.print("\n" + modes_table(rows));
    const unsigned int n_unstable = std::count_if(
        rows.begin(), rows.end(), [](const ModeRow &row) { return row.is_unstable(); });
    const unsigned int n_undecided =
        std::count_if(rows.begin(), rows.end(),
                      [](const ModeRow &row) { return row.verdict == Verdict::undecided; });
    log.line("\n" + std::to_string(rows.size()) + " modes " + window_of(prm.eigenproblem) + ", " +
             std::to_string(n_unstable) + " unstable (marked >), " + std::to_string(n_undecided) +
             " undecided.");
    if (prm.eigenproblem.minimum_frequency > 0)
      log.line(
          "The window leaves out zero frequency: nothing is said about divergence, and nothing "
          "about flutter below it.");
    PhaseTimer::Scope scope(timer, "eigenproblem");
    explain_modes(model, parts, cycle);
  }

  /// Contributions of each origin to each growth rate, and sensitivities if asked for.
  void Analysis::explain_modes(const Model &model, const RayleighParts &rayleigh,
                               const unsigned int cycle)
  {
    if (rows.empty())
      return;
    const std::vector<Contribution> parts = contributions(rayleigh, found.modes, rows);
    for (const Contribution &part : parts)
      contributions_csv->add(contributions_fields(cycle, part));
    std::vector<unsigned int> numbers;
    unsigned int least_stable = 0;
    for (unsigned int j = 0; j < rows.size(); ++j)
    {
      if (rows[j].is_unstable())
        numbers.push_back(rows[j].mode);
      if (rows[j].growth_rate() > rows[least_stable].growth_rate())
        least_stable = j;
    }
    if (numbers.empty())
      numbers = {rows[least_stable].mode};
    if (numbers.size() > 10)
      numbers.resize(10);
    // A body without damping at rest has growth rates of rounding: nothing to explain.
    double largest = 0, rounding = 0;
    for (const Contribution &part : parts)
      largest = std::max(largest, std::abs(part.growth_rate));
    for (const ModeRow &row : rows)
      rounding = std::max(rounding, 1e-12 * std::abs(row.lambda));
    if (largest > rounding)
      log.print("Why: the growth rate as a sum over its causes\n" +
                contributions_table(parts, numbers));

    constexpr double large_condition = 100;
    for (const ModeRow &row : rows)
      if (row.condition_number.value_or(0) > large_condition)
        log.line("Mode " + std::to_string(row.mode) + " has the condition number " +
                 number(std::round(*row.condition_number)) +
                 ": it is close to coalescence, where errors grow like the square root of a "
                 "perturbation and sensitivities hold only for tiny changes.");

    if (!prm.output.sensitivities)
      return;
    if (!sensitivities_csv)
      sensitivities_csv = table("sensitivities.csv", sensitivities_header);
    for (const ParameterDerivative &derivative : model.derivatives())
    {
      const auto d_lambda = sensitivities(derivative, found.modes);
      for (unsigned int j = 0; j < rows.size(); ++j)
        sensitivities_csv->add(sensitivities_fields(cycle, rows[j].mode, derivative, d_lambda[j]));
    }
  }

  void Analysis::finish_cycle(const unsigned int cycle, const std::uint64_t cells,
                              const unsigned int dofs, const unsigned int multipliers)
  {
    std::vector<std::string> fields = {std::to_string(cycle), std::to_string(cells),
                                       std::to_string(dofs), std::to_string(multipliers)};
    for (const std::string &phase : phase_names)
      fields.push_back(number(timer.seconds(phase)));
    fields.push_back(number(Utilities::MPI::sum(of_cycle.lap(), comm)));
    const double memory = peak_memory_mib(comm);
    fields.push_back(number(timer.total()));
    fields.push_back(number(memory));
    if (!cycles_csv)
      cycles_csv = table("cycles.csv", cycles_header());
    cycles_csv->add(fields);
    report_phases();
    record.cycles.push_back({rows, dofs, timer.total(), memory / 1024, {}});
    budget.add_mesh({double(dofs), timer.total(), memory / 1024});
    timer.restart();
  }

  void Analysis::report_phases()
  {
    const double total = timer.total();
    log.line("\n  phase            seconds    share");
    for (const std::string &phase : phase_names)
      if (timer.seconds(phase) > 0)
      {
        char text[100];
        std::snprintf(text, sizeof(text), "  %-14s %9.2f   %5.1f %%", phase.c_str(),
                      timer.seconds(phase), 100 * timer.seconds(phase) / total);
        log.line(text);
      }
    char text[200];
    std::snprintf(text, sizeof(text), "  %-14s %9.2f\n  Peak memory %.0f MiB", "total", total,
                  peak_memory_mib(comm));
    std::string line = text;
    if (!timer.peak_phase().empty())
      line += ", reached in the phase " + timer.peak_phase();
    if (found.cost.factor_memory_mib > 0)
    {
      std::snprintf(text, sizeof(text),
                    "; the factorisation for shift-invert took %.0f MiB (predicted %.0f)",
                    found.cost.factor_memory_mib, found.cost.predicted_memory_mib);
      line += text;
    }
    log.line(line + ".");
  }

  std::string describe(const Parameters::All &prm, const std::string &directory)
  {
    std::ostringstream text;
    text << "Scene " << name_of(prm.scene);
    if (prm.scene != Scene::matrices)
    {
      text << ", stage " << name_of(prm.stage) << ", " << prm.n_pads() << " pads";
      if (prm.n_pads() > 0)
      {
        text << ", contact by " << name_of(prm.contact.formulation)
             << (prm.contact.formulation == Formulation::mortar
                     ? ""
                     : " " + number(prm.contact.penalty_stiffness) + " N/m^3");
        if (prm.terms().friction)
          text << ", friction " << name_of(prm.contact.friction.kind) << " "
               << prm.contact.friction.coefficient << ", steady pressure "
               << name_of(prm.contact.steady_pressure);
      }
      text << ", " << prm.operation.angular_velocity << " rad/s";
      const auto &d = prm.discretization;
      text << "\nCoarse mesh: "
           << (prm.scene == Scene::mesh
                   ? prm.mesh.file
                   : "rotor " + d.rotor_cells_text + ", each pad " + d.pad_cells_text + " cells")
           << "; degree " << d.degree << "; " << prm.refinement.n_cycles() << " mesh(es), "
           << name_of(prm.refinement.strategy);
    }
    if (prm.eigenproblem.is_solved())
      text << "\nEvery mode " << window_of(prm.eigenproblem) << " by the solver "
           << name_of(prm.eigenproblem.solver) << ", tolerance " << prm.eigenproblem.tolerance;
    else
      text << "\nThe static equilibrium only, linear solver "
           << name_of(prm.static_equilibrium.linear_solver);
    text << "\nResults go to " << directory << "\n";
    constexpr double nearly_incompressible = 0.49;
    constexpr unsigned int free_of_locking = 4;
    if (prm.scene != Scene::matrices && prm.discretization.degree < free_of_locking)
      for (const Parameters::BodyMaterial &body : prm.materials())
        if (body.material.poisson_ratio > nearly_incompressible)
          text << "Warning, nearly incompressible: " << body.section
               << "/Material/Poisson ratio = " << body.material.poisson_ratio
               << ". Elements of degree " << prm.discretization.degree
               << " lock, and error bars may be several times too short. Take degree "
               << free_of_locking << ".\n";
    constexpr double long_cell = 20;
    const double length        = (prm.rotor.outer_radius - prm.rotor.inner_radius) /
                          prm.discretization.rotor_cells[0],
                 thickness = prm.rotor.thickness / prm.discretization.rotor_cells[2];
    if (prm.scene == Scene::brake && length > long_cell * thickness)
      text
          << "Warning, thin rotor: its cells are " << number(std::round(length / thickness))
          << " times as long as thick. Error bars may be several times too short. Take more radial "
             "cells.\n";
    return text.str();
  }
} // namespace squeal
