#include <squeal/assessment/modal_damping.h>
#include <squeal/bars/error_estimators.h>
#include <squeal/base/memory.h>
#include <squeal/eigen/find_modes.h>
#include <squeal/mesh/places.h>
#include <squeal/model/brake_model.h>
#include <squeal/model/matrix_free_modes.h>
#include <squeal/model/matrix_model.h>
#include <squeal/parameters/plausibility.h>
#include <squeal/run/checkpoint.h>
#include <squeal/run/driver.h>
#include <squeal/run/field_output.h>
#include <squeal/run/matrix_export.h>
#include <squeal/run/mesh_sequence.h>
#include <squeal/run/report.h>
#include <squeal/run/run_directory.h>
#include <squeal/run/superelement_export.h>
#include <squeal/run/wanted.h>
#include <squeal/scenes/imported_bodies.h>
#include <squeal/scenes/make_scene.h>
#include <squeal/studies/frequency_response.h>
#include <squeal/studies/sampling.h>
#include <squeal/studies/stability_map.h>
#include <squeal/studies/study_points.h>
#include <squeal/studies/sweep.h>

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <utility>

// What happens when a run is started. Run has what all scenes share: directory, log, the verbs for
// modes, verdicts and studies. Driver::run() is the whole of a run with meshes, each line a verb
// whose name is that of a room or of a member below it; run_matrices() is that of given matrices.
// The sequence of meshes is in mesh_sequence.h, what is asked for in wanted.h.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    EigensolverOptions options_of(const Parameters::Eigenproblem &prm, Log &log)
    {
      EigensolverOptions options;
      options.max_imaginary = 2 * M_PI * prm.maximum_frequency;
      options.min_imaginary = 2 * M_PI * prm.minimum_frequency;
      options.tolerance     = prm.tolerance;
      options.shift         = prm.shift;
      options.progress      = [&log](const std::string &text) { log.progress(text); };
      return options;
    }

    /// What the scenes with a mesh and the scene matrices have in common. The words of a run are
    /// the members of Driver and of run_matrices() below.
    struct Run
    {
      ParameterFile &file;
      const Parameters::All &prm;
      const std::string directory;
      const MPI_Comm comm;
      RunDirectory place;
      Checkpoint checkpoint;
      Report report;

      Run(ParameterFile &file, const std::string &directory, const MPI_Comm comm,
          const RunDirectory::Options &options)
          : file(file), prm(file.parameters()), directory(directory), comm(comm),
            place(directory, file, options, comm),
            checkpoint(place.resumes() ? Checkpoint::resume(directory, comm).value_or(Checkpoint())
                                       : Checkpoint()),
            report(prm, directory, comm, options.called, place.resumes(),
                   !checkpoint.cycles.empty())
      {
        report.log.print(place.message());
      }

      /// Refuses what a study would make of the parameters, and tells doubts about it, before
      /// anything is computed.
      void check_study()
      {
        for (const std::string &doubt : squeal::check_study(file))
          report.log.line(doubt);
      }

      void end()
      {
        report.end();
        place.finish();
      }

      /// Every mode of the window, and the proof.
      EigenSolution find_modes(const Model &model, const EquationsOfMotion &equations)
      {
        PhaseTimer::Scope scope(report.timer, "eigenproblem");
        return squeal::find_modes(prm.eigenproblem.solver, equations,
                                  options_of(prm.eigenproblem, report.log), model.sectors());
      }

      ModeTable assess_stability(const Model &model, const EigenPairs &modes,
                                 const unsigned int cycle, const ErrorBounds &bars = {})
      {
        PhaseTimer::Scope scope(report.timer, "eigenproblem");
        return squeal::assess_stability(model, modes, cycle, prm.eigenproblem.tolerance, bars);
      }

      void tell(const Model &model, const unsigned int cycle, const EigenSolution &found,
                const ModeTable &table, const double seconds_of_bars)
      {
        report.modes(cycle, found, table, seconds_of_bars);
        PhaseTimer::Scope scope(report.timer, "eigenproblem");
        if (const auto share = non_modal_damping(model, found.modes))
          report.log.line("Damping couples modes: " + number(100 * *share, 2) +
                          " % of it is not modal.");
        if (prm.output.sensitivities && !table.rows.empty())
          report.sensitivities(cycle, found.modes, table, model.derivatives());
      }

      /// The sweep or the stability map on the present mesh or, where the parameter changes it, on
      /// meshes of @p make_model; or the ladder.
      void continue_along_parameters(Model &model, const ModelFactory &make_model,
                                     const ErrorEstimator &estimator = {})
      {
        const EigensolverOptions options = options_of(prm.eigenproblem, report.log);
        EigenSolution::Cost cost;
        if (prm.stage == Stage::ladder)
          cost = climb(model);
        else if (prm.sampling.active())
          Sampling(file, model, options, directory, comm, report.log, estimator).run();
        else if (prm.sweep.is_map())
          StabilityMap(file, model, options, directory, comm, report.log, estimator).run();
        else
          Sweep(file, model, make_model, options, directory, comm, report.log, estimator).run();
        report.phases(cost);
      }

    private:
      /// All stages one after the other (theory.md, section 5). Returns what the last one cost.
      EigenSolution::Cost climb(Model &model)
      {
        EigenSolution::Cost cost;
        std::vector<std::string> stages;
        std::vector<std::vector<ModeRow>> rows;
        for (Stage stage = Stage::elastic; stage < Stage::ladder; stage = Stage(int(stage) + 1))
        {
          stages.push_back(name_of(stage));
          file.choose("Stage", stages.back());
          model.assemble(prm);
          const EigenSolution found = find_modes(model, model.equations());
          rows.push_back(assess_stability(model, found.modes, 0).rows);
          report.stage(stages.back(), found, rows.back());
          cost = found.cost;
        }
        file.choose("Stage", name_of(Stage::ladder));
        report.ladder(stages, rows);
        return cost;
      }
    };

    /// An error that names, before what its kinds advise, the warnings that were there before
    /// anything was computed: wrong units ask for memory, meshes and solvers that nobody needs.
    SolverError after_warnings(const SolverError &error, const Parameters::All &prm,
                               const std::string &report)
    {
      std::string warnings;
      for (const std::string &doubt : doubts(prm))
        warnings += doubt + "\n";
      std::istringstream lines(report);
      for (std::string line; std::getline(lines, line);)
        if (line.rfind("Warning", 0) == 0)
          warnings += line + "\n";
      if (warnings.empty())
        return error;
      return SolverError(text_of(error.what(), "\nSee to this first:\n", warnings,
                                 error.kinds.empty() ? "" : "If it is as it should be:"),
                         error.kinds);
    }

    /// Brakes on meshes of their own, where a study varies what changes the mesh, and the bars of
    /// all.
    template <int dim>
    class Brakes
    {
    public:
      /// All must outlive it.
      Brakes(const BrakeModel<dim> &first, const MPI_Comm comm, Report &report)
          : comm(comm), report(report), known{{&first, &first}}
      {
      }

      std::unique_ptr<Model> make(const Parameters::All &parameters)
      {
        auto made = std::make_unique<BrakeModel<dim>>(make_scene<dim>(parameters), parameters, comm,
                                                      report.log, report.timer);
        made->distribute();
        known[made.get()] = made.get();
        return made;
      }

      /// Estimates what the mesh does to the modes of a brake that it made, or of the first one.
      ErrorEffects estimate_errors(const Model &model, const EigenPairs &modes) const
      {
        ErrorEffects effects = squeal::estimate_errors(*known.at(&model), modes).effects;
        return_freed_memory();
        return effects;
      }

    private:
      const MPI_Comm comm;
      Report &report;
      std::map<const Model *, const BrakeModel<dim> *> known;
    };

    /// Bodies meshed by finite elements, on a sequence of meshes.
    template <int dim>
    class Driver
    {
    public:
      Driver(const Geometry<dim> &geometry, ParameterFile &file, const std::string &directory,
             const MPI_Comm comm, const RunDirectory::Options &options)
          : common(file, directory, comm, options), prm(common.prm), wanted(prm),
            report(common.report), reference(prm.refinement.reference_eigenvalues()),
            meshes(geometry, prm, wanted, common.checkpoint, report, directory, comm)
      {
        if (prm.eigenproblem.is_matrix_free() && geometry.may_move_rigidly)
          throw InputError("Eigenproblem/Solver = block_davidson: a body that is free to move as a "
                           "rigid body has no static equilibrium without factors. Hold it, or take "
                           "block_krylov.");
        check_scene_at_speeds(file);
        common.check_study();
        report.log.print(geometry.report);
        if (!geometry.report.empty())
          write_text(directory + "/mesh.csv", geometry.report_table, comm);
      }

      void run()
      {
        try
        {
          pass_meshes();
        }
        catch (const SolverError &error)
        {
          throw after_warnings(error, prm, meshes.model().spaces().geometry.report);
        }
      }

    private:
      void pass_meshes()
      {
        for (unsigned int cycle = meshes.resume(); meshes.has(cycle); ++cycle)
        {
          make_mesh(cycle);
          const SteadyState<dim> &state     = meshes.find_steady_state();
          const EquationsOfMotion equations = linearise();
          report_steady_state(cycle, state);
          const EigenSolution found     = find_modes(equations);
          const EigenvalueErrors errors = estimate_errors(found.modes);
          const ModeTable table         = assess_stability(cycle, found, errors.bounds);
          write_fields(cycle, found.modes, table.rows);
          meshes.refine(cycle, found.cost, table.rows, errors); // or ends
          use_last_mesh(cycle, equations, found.modes);
        }
        report_convergence();
        run_studies();
        Checkpoint::remove(common.directory, common.comm);
        common.end();
      }

      /// Where a study lets a rotor turn that rests in the file, the scene is made once more and
      /// refuses what it does of rotors that turn. Nothing else of what a scene checks depends on
      /// numbers that keep the mesh.
      void check_scene_at_speeds(ParameterFile &file) const
      {
        if (prm.scene != Scene::mesh || needs_revolution(prm))
          return;
        file.also_check(
            [is_known = false](const Parameters::All &parameters) mutable
            {
              if (is_known || !needs_revolution(parameters))
                return;
              make_scene<dim>(parameters);
              is_known = true;
            });
      }

      void make_mesh(const unsigned int cycle)
      {
        meshes.make(cycle);
        if (wanted.response)
          find_places(); // one that is not there is to be told before anything is solved
      }

      EquationsOfMotion linearise()
      {
        if (!wanted.equations)
          return {};
        return_freed_memory();
        return meshes.model().linearise();
      }

      void report_steady_state(const unsigned int cycle, const SteadyState<dim> &state)
      {
        PhaseTimer::Scope scope(report.timer, "static");
        std::optional<SelfLocking> locking;
        if (wanted.self_locking)
          locking = meshes.model().self_locking();
        const std::vector<ContactResultants> resultants = meshes.model().resultants();
        report.steady_state(cycle, state.equilibrium ? &*state.equilibrium : nullptr, resultants,
                            locking ? &*locking : nullptr);
        if (!state.wear_steps.empty())
          report.wear(cycle, state.wear_steps);
        if (state.worn)
          report.worn_pads(*state.worn, resultants);
      }

      EigenSolution find_modes(const EquationsOfMotion &equations)
      {
        EigenSolution found;
        if (!wanted.modes)
          return found;
        if (prm.eigenproblem.is_matrix_free())
        {
          PhaseTimer::Scope scope(report.timer, "eigenproblem");
          found =
              find_modes_without_factors(meshes.model(), options_of(prm.eigenproblem, report.log));
        }
        else
          found = common.find_modes(meshes.model(), equations);
        return_freed_memory();
        return found;
      }

      EigenvalueErrors estimate_errors(const EigenPairs &modes)
      {
        Stopwatch watch;
        EigenvalueErrors errors;
        if (wanted.bars)
        {
          PhaseTimer::Scope scope(report.timer, "estimate");
          report.log.progress("  error bars");
          errors = squeal::estimate_errors(meshes.model(), modes);
          return_freed_memory();
        }
        seconds_of_bars = watch.lap();
        return errors;
      }

      /// Verdicts and causes, written and shown.
      ModeTable assess_stability(const unsigned int cycle, const EigenSolution &found,
                                 const ErrorBounds &bars)
      {
        if (!wanted.modes)
          return {};
        ModeTable table = common.assess_stability(meshes.model(), found.modes, cycle, bars);
        if (meshes.model().spaces().geometry.has_rotor())
        {
          PhaseTimer::Scope scope(report.timer, "eigenproblem");
          std::vector<double> densities;
          for (const Parameters::BodyMaterial &part : prm.materials())
            densities.push_back(part.material.density);
          const std::vector<ModeShape> shapes =
              mode_shapes(meshes.model().spaces(), densities, found.modes);
          for (unsigned int j = 0; j < shapes.size(); ++j)
            table.rows[j].shape = shapes[j];
        }
        common.tell(meshes.model(), cycle, found, table, seconds_of_bars);
        if (wanted.bars)
          report.bars(cycle, table.rows, bars.parts, meshes.next_degree());
        return table;
      }

      void write_fields(const unsigned int cycle, const EigenPairs &modes,
                        const std::vector<ModeRow> &rows)
      {
        PhaseTimer::Scope scope(report.timer, "output");
        if (wanted.fields)
          squeal::write_fields(meshes.model(), modes, rows, common.directory, cycle, report.log);
      }

      /// Exports matrices and answers forces on the last mesh, which is known to be that once it
      /// has been left as it is.
      void use_last_mesh(const unsigned int cycle, const EquationsOfMotion &equations,
                         const EigenPairs &modes)
      {
        if (!common.checkpoint.finished)
          return;
        if (meshes.model().spaces().geometry.superelement_out)
        {
          PhaseTimer::Scope scope(report.timer, "output");
          report.log.progress("  superelement");
          report.log.line(export_superelement(meshes.model(), equations, common.directory));
        }
        if (wanted.matrices)
        {
          PhaseTimer::Scope scope(report.timer, "output");
          report.log.progress("  matrices");
          export_matrices(meshes.model(), equations, modes, common.directory);
          report.log.line(
              text_of("\nMatrices, unknowns and modes of mesh ", cycle,
                      " written for other programs: M.mtx and others, doc/matrices.md."));
        }
        if (wanted.response)
          respond(equations, modes);
      }

      /// Forces and observations of the frequency response.
      std::pair<MultiVector, MultiVector> find_places()
      {
        constexpr unsigned int n_components   = dim;
        const Parameters::Response &section   = prm.response;
        const FiniteElementSpace<dim> &spaces = meshes.model().spaces();
        MultiVector forces =
            motions_at(spaces, section.list_of_forces(n_components), "Response/Forces");
        MultiVector observations =
            motions_at(spaces, section.list_of_observations(n_components),
                       section.observations.empty() ? "Response/Forces" : "Response/Observations");
        return {std::move(forces), std::move(observations)};
      }

      void respond(const EquationsOfMotion &equations, const EigenPairs &modes)
      {
        PhaseTimer::Scope scope(report.timer, "eigenproblem");
        const auto [forces, observations]   = find_places();
        const Parameters::Response &section = prm.response;
        const FrequencyResponse response =
            frequency_response(equations, meshes.model().sectors(), modes, forces, observations,
                               section.list_of_frequencies(prm.eigenproblem.maximum_frequency),
                               {section.method, section.tolerance,
                                [this](const std::string &text) { report.log.progress(text); }});
        report.response(response, modes);
      }

      /// Writes convergence.csv and convergence.tex if there are several meshes or a reference.
      void report_convergence()
      {
        const std::vector<Checkpoint::Cycle> &cycles = common.checkpoint.cycles;
        if (!wanted.modes || cycles.empty() || (cycles.size() < 2 && reference.empty()))
          return;
        std::vector<std::vector<ModeRow>> rows;
        std::vector<unsigned int> n_unknowns;
        std::vector<double> sizes;
        for (const Checkpoint::Cycle &done : cycles)
        {
          // Adaptive meshes have no one size of cells: what counts is the number of unknowns.
          sizes.push_back(prm.refinement.strategy == Strategy::adaptive
                              ? std::pow(done.n_unknowns, -1. / dim)
                              : std::pow(0.5, sizes.size()));
          rows.push_back(done.rows);
          n_unknowns.push_back(done.n_unknowns);
        }
        report.convergence(
            convergence_rows(rows, n_unknowns, sizes, prm.discretization.degree, reference),
            cycles.size() > 1);
      }

      /// A sweep, a map, samples or the ladder.
      void run_studies()
      {
        if (!wanted.studies)
          return;
        meshes.make_last();
        Brakes<dim> brakes(meshes.model(), common.comm, report);
        ErrorEstimator estimator;
        if (prm.eigenproblem.error_bars)
          estimator = [&brakes](const Model &any, const EigenPairs &modes)
          { return brakes.estimate_errors(any, modes); };
        common.continue_along_parameters(
            meshes.model(),
            [&brakes](const Parameters::All &parameters) { return brakes.make(parameters); },
            estimator);
      }

      Run common;
      const Parameters::All &prm;
      const Wanted wanted;
      Report &report;
      const std::vector<std::complex<double>> reference; ///< as it was when the run began
      MeshSequence<dim> meshes;
      double seconds_of_bars = 0; ///< of the processor, on the present mesh
    };

    /// Matrix Market files in, modes out; no mesh.
    void run_matrices(ParameterFile &file, const std::string &directory, const MPI_Comm comm,
                      const RunDirectory::Options &options)
    {
      Run common(file, directory, comm, options);
      common.check_study();
      Report &report = common.report;
      std::optional<MatrixModel> model;
      {
        PhaseTimer::Scope scope(report.timer, "assembly");
        model.emplace(common.prm.matrices, comm);
        model->assemble(common.prm);
        report.log.line("\nMatrices of size " + std::to_string(model->size()));
        for (const std::string &doubt : model->doubts())
          report.log.line(doubt);
      }
      if (common.prm.varies_parameters())
        common.continue_along_parameters(*model, {});
      else
      {
        const EigenSolution found = common.find_modes(*model, model->equations());
        const ModeTable table     = common.assess_stability(*model, found.modes, 0);
        common.tell(*model, 0, found, table, 0);
        report.cycle(0, 0, model->size(), 0, found.cost);
        if (common.prm.output.matrices)
          export_matrices(*model, found.modes, directory);
      }
      common.end();
    }
  } // namespace

  void run(ParameterFile &file, const std::string &directory, const MPI_Comm comm,
           const RunDirectory::Options &options)
  {
    const Parameters::All &prm = file.parameters();
    if (prm.scene == Scene::matrices)
      run_matrices(file, directory, comm, options);
    else if (prm.scene == Scene::strip)
      Driver<2>(make_scene<2>(prm), file, directory, comm, options).run();
    else
      Driver<3>(make_scene<3>(prm), file, directory, comm, options).run();
  }
} // namespace squeal
