#include <squeal/assessment/modal_damping.h>
#include <squeal/bars/error_estimators.h>
#include <squeal/base/memory.h>
#include <squeal/contact/contact_fields.h>
#include <squeal/eigen/sectors.h>
#include <squeal/mesh/fields.h>
#include <squeal/mesh/places.h>
#include <squeal/model/brake_model.h>
#include <squeal/model/matrix_free_modes.h>
#include <squeal/model/matrix_model.h>
#include <squeal/run/checkpoint.h>
#include <squeal/run/driver.h>
#include <squeal/run/matrix_export.h>
#include <squeal/run/memory_prediction.h>
#include <squeal/run/refinement.h>
#include <squeal/run/report.h>
#include <squeal/run/run_directory.h>
#include <squeal/run/superelement_export.h>
#include <squeal/scenes/imported_scene.h>
#include <squeal/studies/frequency_response.h>
#include <squeal/studies/sampling.h>
#include <squeal/studies/stability_map.h>
#include <squeal/studies/sweep.h>

#include <deal.II/distributed/grid_refinement.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    template <int dim>
    Geometry<dim> make_scene(const Parameters::All &prm)
    {
      if constexpr (dim == 2)
        return make_strip(prm);
      else
        return make_bodies(prm);
    }

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
          report.log.line(text_of("Damping is not modal by ", 100 * *share,
                                  " %: the norm of its part off the diagonal, in the real modes."));
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

    /// Bodies meshed by finite elements, on a sequence of meshes.
    template <int dim>
    class Driver
    {
    public:
      Driver(const Geometry<dim> &geometry, ParameterFile &file, const std::string &directory,
             const MPI_Comm comm, const RunDirectory::Options &options)
          : common(file, directory, comm, options), prm(common.prm), report(common.report),
            checkpoint(common.checkpoint), reference(prm.refinement.reference_eigenvalues()),
            budget(prm.refinement), model(geometry, prm, comm, report.log, report.timer)
      {
        if (prm.eigenproblem.is_matrix_free() && geometry.may_move_rigidly)
          throw InputError("Eigenproblem/Solver = block_davidson: a body that is free to move as a "
                           "rigid body has no static equilibrium without factors. Hold it, or take "
                           "block_krylov.");
        report.log.print(geometry.report);
        if (!geometry.report.empty())
          write_text(directory + "/mesh.csv", geometry.report_table, comm);
      }

      void run()
      {
        const unsigned int first = resume();
        bool has_state           = first == 0 && refine_at_contact_edge();
        unsigned int cycle       = first;
        for (; has_mesh(cycle); ++cycle)
        {
          if (!has_state)
            number_unknowns();
          tell_mesh(cycle);
          if (cycle == first && prm.response.active())
            find_places(); // one that is not there is to be told before anything is solved
          const SteadyState<dim> &state =
              std::exchange(has_state, false) ? model.steady_state() : find_steady_state(true);
          const EquationsOfMotion equations = linearise(state);
          report_steady_state(cycle, state);
          const EigenSolution found = find_modes(equations);
          Stopwatch watch;
          const EigenvalueErrors errors = estimate_errors(found.modes);
          const double seconds_of_bars  = watch.lap();
          const ModeTable table = assess_stability(cycle, found, errors.bounds, seconds_of_bars);
          write(cycle, state, found.modes, table.rows);
          finish(cycle, found.cost, table.rows);
          refine(table.rows, errors);
          if (checkpoint.finished)
          {
            export_matrices(cycle, equations, found.modes);
            if (prm.response.active())
              respond(equations, found.modes);
          }
        }
        report_convergence();
        if (continues())
        {
          if (cycle == first) // this run has made no mesh
          {
            number_unknowns();
            tell_mesh(cycle > 0 ? cycle - 1 : 0);
          }
          common.continue_along_parameters(model, make_model(), make_estimator());
        }
        Checkpoint::remove(common.directory, common.comm);
        common.end();
      }

    private:
      /// Whether a sweep, a map or the ladder follows.
      bool continues() const
      {
        return prm.varies_parameters() || prm.stage == Stage::ladder;
      }
      bool refines() const
      {
        return prm.refinement.n_cycles() > 1;
      }
      /// What follows needs no modes of the mesh beforehand, but a refined one is made by them.
      bool has_mesh(const unsigned int cycle) const
      {
        return !checkpoint.finished && cycle < prm.refinement.n_cycles() &&
               (refines() || !continues());
      }

      /// Divides the cells that an interrupted run has divided. Returns the number of its meshes.
      unsigned int resume()
      {
        for (const CellNames &divided : checkpoint.divided_at_edge)
          divide_again(model.spaces().triangulation, divided);
        for (const Checkpoint::Cycle &done : checkpoint.cycles)
        {
          budget.add_mesh({double(done.n_unknowns), done.seconds, done.memory_gib});
          divide_again(model.spaces().triangulation, done.divided_cells);
        }
        const unsigned int n_done = checkpoint.cycles.size();
        if (n_done > 0)
          report.log.line("\nResumed after " + std::to_string(n_done) +
                          (n_done == 1 ? " mesh." : " meshes."));
        return n_done;
      }

      /// Divides cells where the static equilibrium says that the contact ends: modes are sensitive
      /// to the place, and it takes no modes to find it. Returns whether the model has all of the
      /// state of the last mesh: where pads touch everywhere, no edge is left that bars ask for.
      bool refine_at_contact_edge()
      {
        auto &mesh = model.spaces().triangulation;
        for (unsigned int level = 0; level < prm.refinement.edge_levels; ++level)
        {
          number_unknowns();
          const SteadyState<dim> &state = find_steady_state(false);
          const std::size_t n_steps     = state.equilibrium->iterations.size();
          PhaseTimer::Scope scope(report.timer, "mesh");
          std::vector<double> by_cell = cells_at_contact_edge(*state.contact);
          if (Utilities::MPI::max(by_cell.size(), common.comm) == 0)
          {
            report.log.line("\nThe pads touch everywhere: no edge of the contact to refine.");
            return true;
          }
          model.keep_sectors(by_cell);
          unsigned int number = 0;
          for (const auto &cell : mesh.active_cell_iterators())
            if (cell->is_locally_owned() && by_cell[number++] > 0)
              cell->set_refine_flag();
          const std::string objection =
              budget.objection(model.spaces().rows.size * growth_by_flags(mesh));
          if (!objection.empty())
          {
            report.log.line("\n" + objection);
            for (const auto &cell : mesh.active_cell_iterators())
              cell->clear_refine_flag();
            return false;
          }
          checkpoint.divided_at_edge.push_back(divide(mesh));
          report.log.line(text_of("\nEdge of the contact, level ", level + 1, ": ",
                                  checkpoint.divided_at_edge.back().size(),
                                  " of the pads' cells divided. Active set: ", n_steps, " steps."));
        }
        return false;
      }

      /// From where the pads touched on the mesh before.
      const SteadyState<dim> &find_steady_state(const bool with_edge)
      {
        const SteadyState<dim> &state =
            model.find_steady_state(prm, {}, {&checkpoint.zone, with_edge});
        checkpoint.zone =
            state.contact && state.equilibrium ? zone_of(*state.contact) : ContactZone();
        return state;
      }

      void number_unknowns()
      {
        PhaseTimer::Scope scope(report.timer, "mesh");
        model.distribute();
      }

      void tell_mesh(const unsigned int cycle)
      {
        const FiniteElementSpace<dim> &spaces = model.spaces();
        report.log.line(
            text_of("\nMesh ", cycle, ": ", spaces.triangulation.n_global_active_cells(),
                    " cells of degree ", spaces.fe.degree, ", ", spaces.n_displacements,
                    " displacements, ", spaces.n_multipliers, " contact pressures",
                    spaces.has_ties() ? text_of(", ", spaces.n_ties, " tractions of joints") : ""));
        need_memory();
      }

      /// What a mesh that is @p growth times as large as the present one asks for.
      RunSize size_of_run(const double growth = 1) const
      {
        const FiniteElementSpace<dim> &spaces = model.spaces();
        return {growth * spaces.triangulation.n_global_active_cells(),
                growth * spaces.rows.size,
                spaces.fe.degree,
                Utilities::MPI::n_mpi_processes(common.comm),
                expected_number_of_modes(prm, plate_like_rotor()),
                prm.eigenproblem.error_bars,
                prm.eigenproblem.solver,
                model.sectors().are_two()};
      }
      Plate plate_like_rotor() const
      {
        const FiniteElementSpace<dim> &spaces = model.spaces();
        double inner = std::numeric_limits<double>::max(), outer = 0, volume = 0, surface = 0;
        if constexpr (dim == 3)
          for (const auto &cell : spaces.triangulation.active_cell_iterators())
            if (cell->is_locally_owned() &&
                spaces.geometry.parts[cell->material_id()].body == rotor_body)
            {
              volume += cell->measure();
              for (const unsigned int v : cell->vertex_indices())
              {
                const double radius = std::hypot(cell->vertex(v)[0], cell->vertex(v)[1]);
                inner               = std::min(inner, radius);
                outer               = std::max(outer, radius);
              }
              for (const unsigned int f : cell->face_indices())
                if (cell->face(f)->at_boundary())
                {
                  const auto face = cell->face(f);
                  surface += cross_product_3d(face->vertex(3) - face->vertex(0),
                                              face->vertex(2) - face->vertex(1))
                                 .norm() /
                             2;
                }
            }
        const MPI_Comm comm = common.comm;
        return plate_like(Utilities::MPI::min(inner, comm), Utilities::MPI::max(outer, comm),
                          Utilities::MPI::sum(surface, comm), Utilities::MPI::sum(volume, comm));
      }
      /// In three dimensions, to which the prediction was fitted, and not of iterative statics
      /// alone.
      bool predicts_memory() const
      {
        return dim == 3 && (prm.eigenproblem.is_solved() ||
                            prm.static_equilibrium.linear_solver != LinearSolver::iterative);
      }
      /// Statics alone turn to iterations by themselves where factors do not fit.
      bool has_other_way() const
      {
        return !prm.eigenproblem.is_solved() &&
               prm.static_equilibrium.linear_solver == LinearSolver::automatic;
      }

      /// Refuses what cannot fit before hours go into it.
      void need_memory()
      {
        if (!predicts_memory())
          return;
        const RunSize size = size_of_run();
        const double mib = expected_peak_mib(size), load = expected_memory_load(size, common.comm);
        report.log.line(formatted("Expected peak memory about %.0f MiB", mib) +
                        (prm.eigenproblem.is_solved() && model.spaces().geometry.has_rotor()
                             ? formatted(", with about %.0f modes", size.n_modes)
                             : ""));
        if (load > 1 && !has_other_way() && prm.refinement.check_memory)
          throw SolverError("The run needs about " + number(mib / 1024, 3) + " GiB, " +
                                number(load, 3) + " times what is available.",
                            {Failure::factors_too_large, Failure::memory_predicted});
      }

      EquationsOfMotion linearise(const SteadyState<dim> &state)
      {
        if (!prm.eigenproblem.is_solved() && !prm.response.active())
          return {};
        return_freed_memory();
        return model.linearise(state);
      }

      void report_steady_state(const unsigned int cycle, const SteadyState<dim> &state)
      {
        PhaseTimer::Scope scope(report.timer, "static");
        std::optional<SelfLocking> locking;
        if (prm.terms().friction && prm.contact.self_locking_check && prm.n_pads() > 0)
          locking = model.self_locking();
        report.steady_state(cycle, state.equilibrium ? &*state.equilibrium : nullptr,
                            model.resultants(), locking ? &*locking : nullptr);
      }

      EigenSolution find_modes(const EquationsOfMotion &equations)
      {
        EigenSolution found;
        if (!prm.eigenproblem.is_solved())
          return found;
        if (prm.eigenproblem.is_matrix_free())
        {
          PhaseTimer::Scope scope(report.timer, "eigenproblem");
          found = find_modes_without_factors(model, options_of(prm.eigenproblem, report.log));
        }
        else
          found = common.find_modes(model, equations);
        return_freed_memory();
        return found;
      }

      EigenvalueErrors estimate_errors(const EigenPairs &modes)
      {
        if (!prm.eigenproblem.error_bars || !prm.eigenproblem.is_solved())
          return {};
        PhaseTimer::Scope scope(report.timer, "estimate");
        report.log.progress("  error bars");
        EigenvalueErrors errors = squeal::estimate_errors(model, modes);
        return_freed_memory();
        return errors;
      }

      /// Verdicts and causes, written and shown.
      ModeTable assess_stability(const unsigned int cycle, const EigenSolution &found,
                                 const ErrorBounds &bars, const double seconds_of_bars)
      {
        if (!prm.eigenproblem.is_solved())
          return {};
        ModeTable table = common.assess_stability(model, found.modes, cycle, bars);
        if (model.spaces().geometry.has_rotor())
        {
          PhaseTimer::Scope scope(report.timer, "eigenproblem");
          std::vector<double> densities;
          for (const Parameters::BodyMaterial &part : prm.materials())
            densities.push_back(part.material.density);
          const std::vector<ModeShape> shapes = mode_shapes(model.spaces(), densities, found.modes);
          for (unsigned int j = 0; j < shapes.size(); ++j)
            table.rows[j].shape = shapes[j];
        }
        common.tell(model, cycle, found, table, seconds_of_bars);
        return table;
      }

      /// Fields of the steady state and of the modes that were asked for.
      void write(const unsigned int cycle, const SteadyState<dim> &state, const EigenPairs &modes,
                 const std::vector<ModeRow> &rows)
      {
        PhaseTimer::Scope scope(report.timer, "output");
        if (prm.output.fields == FieldOutput::none)
          return;
        const std::string &directory          = common.directory;
        const FiniteElementSpace<dim> &spaces = model.spaces();
        const bool has_contact = prm.has_contact(), slides = prm.terms().friction;
        const double pressure_scale = has_contact ? state.contact->pressure_scale() : 1;
        if (state.equilibrium)
        {
          const MultiVector &displacements = state.equilibrium->state;
          write_state(spaces, displacements, pressure_scale, directory, cycle);
          if (has_contact)
            write_contact(spaces, *state.contact, displacements, slides, directory, cycle);
        }
        std::vector<unsigned int> wanted;
        for (unsigned int j = 0; j < rows.size(); ++j)
          if (prm.output.fields == FieldOutput::all || rows[j].is_unstable() ||
              rows[j].verdict == Verdict::undecided)
            wanted.push_back(j);
        if (wanted.empty() && !rows.empty())
          wanted.push_back(least_stable(rows));
        // A hundred undecided modes need no hundred animations.
        const auto moves = [&](const unsigned int j)
        {
          return prm.output.fields == FieldOutput::all || rows[j].is_unstable() ||
                 j == least_stable(rows);
        };
        for (const unsigned int j : wanted)
        {
          report.log.progress("  fields of mode " + std::to_string(rows[j].mode));
          write_mode(spaces, modes.right, j, pressure_scale, directory, cycle, rows[j].mode,
                     moves(j) ? prm.output.animation_frames : 0);
          if (slides && prm.n_pads() > 0)
            write_friction_work(spaces, *state.contact, model.friction_work(modes, j), directory,
                                cycle, rows[j].mode);
        }
      }

      void finish(const unsigned int cycle, const EigenSolution::Cost &cost,
                  const std::vector<ModeRow> &rows)
      {
        const FiniteElementSpace<dim> &spaces = model.spaces();
        const unsigned int n_unknowns         = spaces.rows.size;
        const auto [seconds, memory_gib] =
            report.cycle(cycle, spaces.triangulation.n_global_active_cells(), n_unknowns,
                         spaces.n_multipliers, cost);
        checkpoint.cycles.push_back({rows, n_unknowns, seconds, memory_gib, {}});
        budget.add_mesh({double(n_unknowns), seconds, memory_gib});
      }

      /// Divides cells for the next mesh, if there is one, and saves how far the run has come.
      void refine(const std::vector<ModeRow> &rows, const EigenvalueErrors &errors)
      {
        checkpoint.finished =
            checkpoint.cycles.size() == prm.refinement.n_cycles() || !divide_cells(rows, errors);
        if (refines() && (!checkpoint.finished || prm.varies_parameters()))
          checkpoint.save(common.directory, common.comm);
      }

      /// Forces and observations of the frequency response.
      std::pair<MultiVector, MultiVector> find_places()
      {
        constexpr unsigned int n_components   = dim;
        const Parameters::Response &section   = prm.response;
        const FiniteElementSpace<dim> &spaces = model.spaces();
        MultiVector forces =
            motions_at(spaces, section.list_of_forces(n_components), "Response/Forces");
        MultiVector observations =
            motions_at(spaces, section.list_of_observations(n_components),
                       section.observations.empty() ? "Response/Forces" : "Response/Observations");
        return {std::move(forces), std::move(observations)};
      }

      /// The frequency response on the last mesh.
      void respond(const EquationsOfMotion &equations, const EigenPairs &modes)
      {
        PhaseTimer::Scope scope(report.timer, "eigenproblem");
        const auto [forces, observations]   = find_places();
        const Parameters::Response &section = prm.response;
        const FrequencyResponse response =
            frequency_response(equations, model.sectors(), modes, forces, observations,
                               section.list_of_frequencies(prm.eigenproblem.maximum_frequency),
                               {section.method, section.tolerance,
                                [this](const std::string &text) { report.log.progress(text); }});
        report.response(response, modes);
      }

      /// On the last mesh, which is known to be that once it has been left as it is.
      void export_matrices(const unsigned int cycle, const EquationsOfMotion &equations,
                           const EigenPairs &modes)
      {
        if (model.spaces().geometry.superelement_out)
        {
          PhaseTimer::Scope scope(report.timer, "output");
          report.log.progress("  superelement");
          report.log.line(squeal::export_superelement(model, equations, common.directory));
        }
        if (!prm.output.matrices)
          return;
        PhaseTimer::Scope scope(report.timer, "output");
        report.log.progress("  matrices");
        squeal::export_matrices(model, equations, modes, common.directory);
        report.log.line(text_of("\nMatrices, unknowns and modes of mesh ", cycle,
                                " written for other programs: M.mtx and others, doc/matrices.md."));
      }

      /// Uniform: every cell. Adaptive: the cells that make up the greater part of the errors.
      /// False if nothing is left to refine for, or if the next mesh is beyond the budget.
      bool divide_cells(const std::vector<ModeRow> &rows, const EigenvalueErrors &errors)
      {
        PhaseTimer::Scope scope(report.timer, "mesh");
        auto &mesh = model.spaces().triangulation;
        if (prm.refinement.strategy == Strategy::uniform)
          mesh.set_all_refine_flags();
        else
        {
          std::vector<double> by_cell =
              refinement_indicators(rows, errors, prm.refinement.tolerance);
          if (Utilities::MPI::max(by_cell.size(), common.comm) == 0)
          {
            report.log.line(prm.refinement.tolerance > 0 ? "\nAll modes are known to the tolerance."
                                                         : "\nAll verdicts are decided.");
            return false;
          }
          model.keep_sectors(by_cell);
          flag_cells(mesh, by_cell);
        }
        // Ranks measure different times: the first one's word counts.
        const double growth   = growth_by_flags(mesh);
        std::string objection = Utilities::MPI::broadcast(
            common.comm, budget.objection(model.spaces().rows.size * growth));
        if (objection.empty() && predicts_memory() && !has_other_way() &&
            prm.refinement.check_memory &&
            expected_memory_load(size_of_run(growth), common.comm) > 1)
          objection = "No further mesh: it would need about " +
                      number(expected_peak_mib(size_of_run(growth)) / 1024, 3) +
                      " GiB, more than there is.";
        if (!objection.empty())
        {
          report.log.line("\n" + objection);
          return false;
        }
        checkpoint.cycles.back().divided_cells = divide(mesh);
        return true;
      }

      /// Writes convergence.csv and convergence.tex if there are several meshes or a reference.
      void report_convergence()
      {
        const unsigned int n_cycles = checkpoint.cycles.size();
        if (!prm.eigenproblem.is_solved() || n_cycles == 0)
          return;
        if (n_cycles < 2 && reference.empty())
          return;
        std::vector<std::vector<ModeRow>> rows;
        std::vector<unsigned int> n_unknowns;
        std::vector<double> sizes;
        for (const Checkpoint::Cycle &done : checkpoint.cycles)
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
            n_cycles > 1);
      }

      /// Models for other parameters of the geometry and the discretisation.
      ModelFactory make_model()
      {
        return [this](const Parameters::All &parameters)
        {
          auto other = std::make_unique<BrakeModel<dim>>(make_scene<dim>(parameters), parameters,
                                                         common.comm, report.log, report.timer);
          other->distribute();
          return other;
        };
      }

      /// Of models on this mesh or on another one; nothing without bars.
      ErrorEstimator make_estimator() const
      {
        if (!prm.eigenproblem.error_bars)
          return {};
        return [](const Model &any, const EigenPairs &modes)
        {
          ErrorEffects effects =
              squeal::estimate_errors(dynamic_cast<const BrakeModel<dim> &>(any), modes).effects;
          return_freed_memory();
          return effects;
        };
      }

      Run common;
      const Parameters::All &prm;
      Report &report;
      Checkpoint &checkpoint;
      const std::vector<std::complex<double>> reference; ///< as it was when the run began
      RefinementBudget budget;
      BrakeModel<dim> model;
    };

    /// Matrix Market files in, modes out; no mesh.
    void run_matrices(ParameterFile &file, const std::string &directory, const MPI_Comm comm,
                      const RunDirectory::Options &options)
    {
      Run common(file, directory, comm, options);
      Report &report = common.report;
      std::optional<MatrixModel> model;
      {
        PhaseTimer::Scope scope(report.timer, "assembly");
        model.emplace(common.prm.matrices, comm);
        model->assemble(common.prm);
        report.log.line("\nMatrices of size " + std::to_string(model->size()));
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
