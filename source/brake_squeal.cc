#include <squeal/brake_model.h>
#include <squeal/brake_squeal.h>
#include <squeal/contact_fields.h>
#include <squeal/convergence.h>
#include <squeal/error_estimators.h>
#include <squeal/fields.h>
#include <squeal/half_problems.h>
#include <squeal/matrix_model.h>
#include <squeal/mesh_scene.h>
#include <squeal/refinement.h>
#include <squeal/stability_map.h>
#include <squeal/static_report.h>
#include <squeal/sweep.h>

#include <deal.II/distributed/grid_refinement.h>

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
        budget(prm.refinement)
  {
    start_run_directory(directory, file, comm);
    log.open(directory + "/log.txt");
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
    modes_csv  = std::make_unique<Table>(directory + "/modes.csv", modes_header, comm);
    cycles_csv = std::make_unique<Table>(directory + "/cycles.csv", cycles_header(), comm);
    contributions_csv =
        std::make_unique<Table>(directory + "/contributions.csv", contributions_header, comm);
  }

  EigensolverOptions Analysis::eigensolver_options()
  {
    EigensolverOptions options;
    options.max_imaginary = 2 * M_PI * prm.eigenproblem.maximum_frequency;
    options.tolerance     = prm.eigenproblem.tolerance;
    options.shift         = prm.eigenproblem.shift;
    options.progress      = [this](const std::string &text) { log.progress(text); };
    return options;
  }

  void Analysis::solve(const Model &model, const QuadraticEigenproblem &problem)
  {
    std::optional<MirrorSymmetry> symmetry;
    if (prm.eigenproblem.mirror_symmetry)
      symmetry = model.mirror_symmetry();
    modes = solve_by_symmetry(*make_eigensolver(prm.eigenproblem.solver), problem,
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
    for (const std::string &stage : Parameters::stage_names)
    {
      file.choose("Stage", stage);
      model.assemble(prm);
      PhaseTimer::Scope scope(timer, "eigenproblem");
      const QuadraticEigenproblem problem = model.problem();
      solve(model, problem);
      rows.push_back(analyse(problem, modes, 0, prm.eigenproblem.tolerance));
      for (const ModeRow &row : rows.back())
      {
        std::vector<std::string> fields = {stage};
        const auto of_mode              = modes_fields(row);
        fields.insert(fields.end(), of_mode.begin(), of_mode.end());
        ladder_csv.add(fields);
      }
      log.line("Stage " + stage + ": " + std::to_string(rows.back().size()) + " modes. " +
               modes.completeness + ".");
    }
    file.choose("Stage", "ladder");
    log.print(
        "\nGrowth rates, 1/s, and verdicts of the stages; modes are paired by their eigenvalues\n" +
        ladder_table(Parameters::stage_names, rows) +
        "\nOnly the stage full supports a verdict on a real brake: without damping every "
        "circulatory\ngyroscopic system is unstable, and damping of one kind alone settles "
        "nothing.\n");
  }

  void Analysis::find_modes(const Model &model, const unsigned int cycle)
  {
    std::vector<ModeRow> rows;
    {
      PhaseTimer::Scope scope(timer, "eigenproblem");
      const QuadraticEigenproblem problem = model.problem();
      solve(model, problem);
      rows = analyse(problem, modes, cycle, prm.eigenproblem.tolerance);
    }
    const std::clock_t before = std::clock();
    estimate(rows);
    const double of_bars = double(std::clock() - before) / CLOCKS_PER_SEC;
    for (const ModeRow &row : rows)
      modes_csv->add(modes_fields(row));
    rows_of_cycle.push_back(rows);

    log.line("Completeness: " + modes.completeness + ".");
    if (modes.seconds.factorization > 0)
    {
      char text[240];
      std::snprintf(text, sizeof(text),
                    "Eigenproblem, processor seconds: counting %.2f, factorisation %.2f, right "
                    "vectors %.2f, left vectors %.2f, error bars %.2f; %u right-hand sides.",
                    modes.seconds.counting, modes.seconds.factorization, modes.seconds.right,
                    modes.seconds.left, of_bars, modes.n_solves);
      log.line(text);
    }
    if (modes.n_rigid_body_modes > 0)
      log.line("Not listed: " + std::to_string(modes.n_rigid_body_modes) +
               " rigid-body modes at zero frequency.");
    log.print("\n" + modes_table(rows));
    const unsigned int n_unstable = std::count_if(
        rows.begin(), rows.end(),
        [](const ModeRow &row) { return row.verdict == "flutter" || row.verdict == "divergence"; });
    log.line("\n" + std::to_string(rows.size()) + " modes up to " +
             number(prm.eigenproblem.maximum_frequency) + " Hz, " + std::to_string(n_unstable) +
             " unstable (marked >).");
    PhaseTimer::Scope scope(timer, "eigenproblem");
    explain_modes(model, rows, cycle);
  }

  /// Contributions of each origin to each growth rate, and sensitivities if asked for.
  void Analysis::explain_modes(const Model &model, const std::vector<ModeRow> &rows,
                               const unsigned int cycle)
  {
    if (rows.empty())
      return;
    const std::vector<Contribution> parts = contributions(model, modes, rows);
    for (const Contribution &part : parts)
      contributions_csv->add(contributions_fields(cycle, part));
    std::vector<unsigned int> numbers;
    unsigned int least_stable = 0;
    for (unsigned int j = 0; j < rows.size(); ++j)
    {
      if (rows[j].verdict == "flutter" || rows[j].verdict == "divergence")
        numbers.push_back(rows[j].mode);
      if (rows[j].growth_rate() > rows[least_stable].growth_rate())
        least_stable = j;
    }
    if (numbers.empty())
      numbers = {rows[least_stable].mode};
    if (numbers.size() > 10)
      numbers.resize(10);
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
      sensitivities_csv =
          std::make_unique<Table>(directory + "/sensitivities.csv", sensitivities_header, comm);
    for (const ParameterDerivative &derivative : model.derivatives())
    {
      const auto d_lambda = sensitivities(derivative, modes);
      for (unsigned int j = 0; j < rows.size(); ++j)
        sensitivities_csv->add(sensitivities_fields(cycle, rows[j].mode, derivative, d_lambda[j]));
    }
  }

  void Analysis::finish_cycle(const unsigned int cycle, const std::uint64_t cells,
                              const unsigned int dofs, const unsigned int multipliers)
  {
    dofs_of_cycle.push_back(dofs);
    std::vector<std::string> fields = {std::to_string(cycle), std::to_string(cells),
                                       std::to_string(dofs), std::to_string(multipliers)};
    for (const std::string &phase : phase_names)
      fields.push_back(number(timer.seconds(phase)));
    // Of all ranks and threads: what other programs on the machine take is not in it.
    const std::clock_t now = std::clock();
    fields.push_back(
        number(Utilities::MPI::sum(double(now - processor_start) / CLOCKS_PER_SEC, comm)));
    processor_start     = now;
    const double memory = peak_memory_mib(comm);
    fields.push_back(number(timer.total()));
    fields.push_back(number(memory));
    cycles_csv->add(fields);
    report_phases();
    budget.add_mesh(dofs, timer.total(), memory / 1024);
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
    char text[160];
    std::snprintf(text, sizeof(text),
                  "  %-14s %9.2f\n  Peak memory %.0f MiB, of this the factorisation for "
                  "shift-invert %.0f MiB.",
                  "total", total, peak_memory_mib(comm), modes.factor_memory_mib);
    log.line(text);
  }

  namespace
  {
    /// Bodies meshed by finite elements, on a sequence of meshes.
    template <int dim>
    class BrakeSqueal : public Analysis
    {
    public:
      BrakeSqueal(const Geometry<dim> &geometry, ParameterFile &file, const std::string &directory,
                  const MPI_Comm comm)
          : Analysis(file, directory, comm), model(geometry, prm, comm, log, timer),
            static_csv(
                directory + "/static.csv",
                "cycle,pad,normal_force_n,friction_force_n,friction_torque_nm,contact_area_m2,"
                "max_pressure_pa,max_penetration_m,self_energising_gain",
                comm)
      {
        log.print(geometry.report);
        if (!geometry.report.empty())
          write_text(directory + "/mesh.csv", geometry.report_table, comm);
      }

      void run() override
      {
        for (unsigned int cycle = 0; cycle < prm.refinement.n_cycles(); ++cycle)
        {
          if (cycle > 0 && !refine())
            break;
          make_mesh(cycle);
          if (prm.sweep.active() || prm.stage_name == "ladder")
          {
            prm.sweep.active() ? sweep(model, make_model()) : climb(model);
            report_phases();
            break;
          }
          model.assemble(prm);
          report_static(cycle);
          find_modes(model, cycle);
          write_fields(cycle);
          finish_cycle(cycle, model.spaces().triangulation.n_global_active_cells(),
                       model.spaces().rows.size, model.spaces().n_multipliers);
        }
        report_convergence();
        log.line("\nResults: " + directory);
      }

    private:
      void estimate(std::vector<ModeRow> &rows) override;
      /// False if nothing is left to refine for, or if the next mesh is beyond the budget.
      bool refine();
      bool is_affordable(double n_unknowns);
      void make_mesh(unsigned int cycle);
      /// Models for other parameters of the geometry and the discretisation.
      ModelFactory make_model()
      {
        return [this](const Parameters::All &parameters)
        {
          Geometry<dim> geometry;
          if constexpr (dim == 2)
            geometry = make_strip(parameters);
          else
            geometry = make_bodies(parameters);
          auto other = std::make_unique<BrakeModel<dim>>(geometry, parameters, comm, log, timer);
          other->distribute();
          return other;
        };
      }
      void report_static(unsigned int cycle);
      void write_fields(unsigned int cycle);
      /// Writes convergence.csv and convergence.tex if there are several meshes or a reference.
      void report_convergence();

      BrakeModel<dim> model;
      Table static_csv;
      EigenvalueErrors errors;
    };

    template <int dim>
    void BrakeSqueal<dim>::estimate(std::vector<ModeRow> &rows)
    {
      if (!prm.eigenproblem.error_bars)
        return;
      PhaseTimer::Scope scope(timer, "estimate");
      log.progress("  error bars");
      errors = estimate_errors(model, modes);
      for (unsigned int j = 0; j < rows.size(); ++j)
      {
        ModeRow &row          = rows[j];
        row.corrected         = row.lambda + errors.bounds.correction[j];
        row.growth_rate_error = errors.bounds.growth_rate[j];
        row.frequency_error   = errors.bounds.imaginary[j] / (2 * M_PI);
        row.verdict = verdict(row.lambda, prm.eigenproblem.tolerance, errors.bounds.growth_rate[j]);
      }
    }

    template <int dim>
    bool BrakeSqueal<dim>::is_affordable(const double n_unknowns)
    {
      std::string objection = budget.objection(n_unknowns);
      // Ranks measure different times: the first one's word counts.
      objection = Utilities::MPI::broadcast(comm, objection);
      if (!objection.empty())
        log.line("\n" + objection);
      return objection.empty();
    }

    /// Uniform: every cell. Adaptive: the cells that make up the greater part of the errors (bulk
    /// criterion, Doerfler 1996).
    template <int dim>
    bool BrakeSqueal<dim>::refine()
    {
      PhaseTimer::Scope scope(timer, "mesh");
      Spaces<dim> &spaces = model.spaces();
      auto &mesh          = spaces.triangulation;
      // Every unknown of a volume becomes 2^dim, roughly.
      const double growth = std::pow(2., dim);
      if (prm.refinement.strategy == "uniform")
      {
        if (!is_affordable(growth * spaces.rows.size))
          return false;
        mesh.refine_global(1);
        return true;
      }
      constexpr double bulk = 0.7;
      std::vector<double> by_cell =
          refinement_indicators(rows_of_cycle.back(), errors, prm.refinement.tolerance);
      if (Utilities::MPI::max(by_cell.size(), comm) == 0)
      {
        log.line(prm.refinement.tolerance > 0 ? "\nAll modes are known to the tolerance."
                                              : "\nAll verdicts are decided.");
        return false;
      }
      if (prm.eigenproblem.mirror_symmetry)
        average_mirror_cells(spaces, by_cell);
      Vector<float> criteria(mesh.n_active_cells());
      unsigned int number = 0;
      for (const auto &cell : mesh.active_cell_iterators())
        if (cell->is_locally_owned())
          criteria(cell->active_cell_index()) = by_cell[number++];
      parallel::distributed::GridRefinement::refine_and_coarsen_fixed_fraction(mesh, criteria, bulk,
                                                                               0.);
      unsigned int n_marked = 0;
      for (const auto &cell : mesh.active_cell_iterators())
        n_marked += cell->is_locally_owned() && cell->refine_flag_set();
      n_marked             = Utilities::MPI::sum(n_marked, comm);
      const double n_cells = mesh.n_global_active_cells();
      if (!is_affordable(spaces.rows.size * (1 + (growth - 1) * n_marked / n_cells)))
        return false;
      mesh.execute_coarsening_and_refinement();
      return true;
    }

    template <int dim>
    void BrakeSqueal<dim>::make_mesh(const unsigned int cycle)
    {
      PhaseTimer::Scope scope(timer, "mesh");
      const Spaces<dim> &spaces = model.spaces();
      modes                     = Modes();
      model.distribute();
      log.line("\nMesh " + std::to_string(cycle) + ": " +
               std::to_string(spaces.triangulation.n_global_active_cells()) + " cells of degree " +
               std::to_string(spaces.fe.degree) + ", " + std::to_string(spaces.n_displacements) +
               " displacements, " + std::to_string(spaces.n_multipliers) + " contact pressures");
    }

    /// The static equilibrium's steps and the resultants of the steady pressure: static.csv and a
    /// line for each pad.
    template <int dim>
    void BrakeSqueal<dim>::report_static(const unsigned int cycle)
    {
      const bool slides = prm.terms().friction, computed = model.equilibrium() != nullptr;
      if (computed && prm.n_pads() > 0)
        log.print(iteration_table(model.equilibrium()->iterations, prm.contact.mortar()));
      const bool checks = slides && prm.contact.self_locking_check && prm.n_pads() > 0;
      PhaseTimer::Scope scope(timer, "static");
      const SelfLocking locking = checks ? model.self_locking() : SelfLocking();
      for (const ContactResultants &r : model.resultants())
      {
        static_csv.add({std::to_string(cycle), r.name, number(r.normal_force),
                        slides ? number(r.friction_force) : "",
                        slides ? number(r.friction_torque) : "", number(r.area),
                        number(r.max_pressure), computed ? number(r.max_penetration) : "",
                        checks ? number(locking.gain) : ""});
        char text[240];
        std::snprintf(text, sizeof(text),
                      "Pad %s: normal force %.6g N, friction force %.6g N, torque %.6g N m, area "
                      "in contact %.6g m^2, "
                      "pressure %.4g to %.4g Pa",
                      r.name.c_str(), r.normal_force, slides ? r.friction_force : 0.,
                      slides ? r.friction_torque : 0., r.area, r.min_pressure, r.max_pressure);
        log.line(text);
      }
      if (checks)
        log.line("Friction amplifies contact pressure with the gain " + number(locking.gain, 4) +
                 " (1: self-locking)");
      if (locking.locks())
        log.line("Warning, self-locking: the friction that a pattern of contact pressure causes "
                 "brings back more pressure than that. This steady state is not the one that a "
                 "brake reaches when friction grows from zero.");
    }

    template <int dim>
    void BrakeSqueal<dim>::write_fields(const unsigned int cycle)
    {
      PhaseTimer::Scope scope(timer, "output");
      if (prm.output.fields == "none")
        return;
      const Spaces<dim> &spaces   = model.spaces();
      const bool has_pads         = prm.n_pads() > 0;
      const double pressure_scale = has_pads ? model.contact()->pressure_scale() : 1;
      if (model.equilibrium())
      {
        const Block &state = model.equilibrium()->state;
        write_state(spaces, state, pressure_scale, directory, cycle);
        if (has_pads)
          write_contact(spaces, *model.contact(), state, prm.terms().friction, directory, cycle);
      }

      const std::vector<ModeRow> &rows = rows_of_cycle.back();
      std::vector<unsigned int> wanted;
      unsigned int least_stable = 0;
      for (unsigned int j = 0; j < rows.size(); ++j)
      {
        if (prm.output.fields == "all" || rows[j].verdict == "flutter" ||
            rows[j].verdict == "divergence" || rows[j].verdict == "undecided")
          wanted.push_back(j);
        if (rows[j].growth_rate() > rows[least_stable].growth_rate())
          least_stable = j;
      }
      if (wanted.empty() && !rows.empty())
        wanted.push_back(least_stable);
      for (const unsigned int j : wanted)
      {
        log.progress("  fields of mode " + std::to_string(rows[j].mode));
        write_mode(spaces, modes.re, modes.im, j, pressure_scale, directory, cycle, rows[j].mode,
                   prm.output.animation_frames);
        if (prm.terms().friction && has_pads)
          write_friction_work(spaces, *model.contact(), model.friction_work(modes, j), directory,
                              cycle, rows[j].mode);
      }
    }

    template <int dim>
    void BrakeSqueal<dim>::report_convergence()
    {
      const auto reference = prm.refinement.reference_eigenvalues();
      if (rows_of_cycle.size() < 2 && (rows_of_cycle.empty() || reference.empty()))
        return;
      // Adaptive meshes have no one size of cells: what counts is the number of unknowns.
      std::vector<double> sizes;
      for (unsigned int c = 0; c < dofs_of_cycle.size(); ++c)
        sizes.push_back(prm.refinement.strategy == "adaptive"
                            ? std::pow(dofs_of_cycle[c], -1. / dim)
                            : std::pow(0.5, c));
      const std::vector<ConvergenceRow> rows = convergence_rows(
          rows_of_cycle, dofs_of_cycle, sizes, prm.discretization.degree, reference);
      Table csv(directory + "/convergence.csv", convergence_header, comm);
      for (const ConvergenceRow &row : rows)
        csv.add(convergence_fields(row));
      write_text(directory + "/convergence.tex", convergence_tex(rows), comm);
      if (rows_of_cycle.size() > 1)
        log.print("\nConvergence (change: |l - l of the mesh before| / |l|)\n" +
                  convergence_table(rows));
    }

    /// Matrix Market files in, modes out; no mesh.
    class MatrixAnalysis : public Analysis
    {
    public:
      using Analysis::Analysis;
      void run() override
      {
        std::unique_ptr<MatrixModel> model;
        {
          PhaseTimer::Scope scope(timer, "assembly");
          model = std::make_unique<MatrixModel>(prm.matrices, comm);
          model->assemble(prm);
          log.line("\nMatrices of size " + std::to_string(model->size()));
        }
        if (prm.sweep.active())
        {
          sweep(*model, {});
          report_phases();
          log.line("\nResults: " + directory);
          return;
        }
        find_modes(*model, 0);
        finish_cycle(0, 0, model->size(), 0);
        log.line("\nResults: " + directory);
      }
    };
  } // namespace

  std::unique_ptr<Analysis> make_analysis(ParameterFile &file, const std::string &directory,
                                          const MPI_Comm comm)
  {
    const Parameters::All &prm = file.parameters();
    if (prm.scene == "matrices")
      return std::make_unique<MatrixAnalysis>(file, directory, comm);
    if (prm.scene == "strip")
      return std::make_unique<BrakeSqueal<2>>(make_strip(prm), file, directory, comm);
    return std::make_unique<BrakeSqueal<3>>(make_bodies(prm), file, directory, comm);
  }

  std::string describe(const Parameters::All &prm, const std::string &directory)
  {
    std::ostringstream text;
    text << "Scene " << prm.scene;
    if (prm.scene != "matrices")
    {
      text << ", stage " << prm.stage_name << ", " << prm.n_pads() << " pads";
      if (prm.n_pads() > 0)
      {
        text << ", contact by " << prm.contact.formulation
             << (prm.contact.formulation == "mortar"
                     ? ""
                     : " " + number(prm.contact.penalty_stiffness) + " N/m^3");
        if (prm.terms().friction)
          text << ", friction " << prm.contact.friction_law << " "
               << prm.contact.friction_coefficient << ", steady pressure "
               << prm.contact.steady_pressure;
      }
      text << ", " << prm.operation.angular_velocity << " rad/s";
      const auto &d = prm.discretization;
      text << "\nCoarse mesh: "
           << (prm.scene == "mesh"
                   ? prm.mesh.file
                   : "rotor " + d.rotor_cells_text + ", each pad " + d.pad_cells_text + " cells")
           << "; degree " << d.degree << "; " << prm.refinement.n_cycles() << " mesh(es), "
           << prm.refinement.strategy;
    }
    text << "\nEvery mode up to " << number(prm.eigenproblem.maximum_frequency)
         << " Hz by the solver " << prm.eigenproblem.solver << ", tolerance "
         << prm.eigenproblem.tolerance << "\nResults go to " << directory << "\n";
    return text.str();
  }
} // namespace squeal
