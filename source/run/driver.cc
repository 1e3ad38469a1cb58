#include <squeal/assessment/convergence.h>
#include <squeal/assessment/error_estimators.h>
#include <squeal/contact/contact_fields.h>
#include <squeal/mesh/fields.h>
#include <squeal/mesh_import/imported_scene.h>
#include <squeal/model/brake_model.h>
#include <squeal/model/matrix_free_modes.h>
#include <squeal/model/matrix_model.h>
#include <squeal/run/driver.h>
#include <squeal/run/refinement.h>
#include <squeal/statics/static_report.h>

#include <deal.II/distributed/grid_refinement.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Bodies meshed by finite elements, on a sequence of meshes.
    template <int dim>
    class Driver : public Analysis
    {
    public:
      Driver(const Geometry<dim> &geometry, ParameterFile &file, const std::string &directory,
             const MPI_Comm comm)
          : Analysis(file, directory, comm), model(geometry, prm, comm, log, timer)
      {
        if (prm.eigenproblem.is_matrix_free() && geometry.may_move_rigidly)
          throw InputError("Eigenproblem/Solver = block_davidson: a body that is free to move as a "
                           "rigid body has no static equilibrium without factors. Hold it, or take "
                           "block_krylov.");
        log.print(geometry.report);
        if (!geometry.report.empty())
          write_text(directory + "/mesh.csv", geometry.report_table, comm);
      }

      void run() override
      {
        const bool refines = prm.refinement.n_cycles() > 1;
        unsigned int cycle = replay();
        // A sweep without refinement, and the ladder, need no modes of this mesh beforehand.
        while (!record.finished && (refines || (!prm.sweep.active() && prm.stage != Stage::ladder)))
        {
          model.assemble(prm);
          report_static(cycle);
          if (prm.eigenproblem.is_solved())
            find_modes(model, cycle);
          write_fields(cycle);
          finish_cycle(cycle, model.spaces().triangulation.n_global_active_cells(),
                       model.spaces().rows.size, model.spaces().n_multipliers);
          record.finished = ++cycle == prm.refinement.n_cycles() || !refine();
          if (refines && (!record.finished || prm.sweep.active()))
            record.save(directory, comm);
          if (!record.finished)
            make_mesh(cycle);
        }
        report_convergence();
        if (prm.sweep.active() || prm.stage == Stage::ladder)
        {
          found = EigenSolution();
          prm.sweep.active() ? sweep(model, make_model()) : climb(model);
          report_phases();
        }
        Checkpoint::remove(directory, comm);
        log.line("\nResults: " + directory);
      }

    private:
      void estimate(std::vector<ModeRow> &rows) override;
      void solve(const Model &any) override
      {
        if (prm.eigenproblem.is_matrix_free())
          found = find_modes_without_factors(model, eigensolver_options());
        else
          Analysis::solve(any);
      }
      /// False if nothing is left to refine for, or if the next mesh is beyond the budget.
      bool refine();
      bool is_affordable(double n_unknowns);
      void make_mesh(unsigned int cycle);
      /// The first mesh, or the one on which an interrupted run goes on, and its number.
      unsigned int replay();
      /// Divides the flagged cells.
      void divide();
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
      std::unique_ptr<Table> static_csv;
      EigenvalueErrors errors;
    };

    template <int dim>
    void Driver<dim>::estimate(std::vector<ModeRow> &rows)
    {
      if (!prm.eigenproblem.error_bars)
        return;
      PhaseTimer::Scope scope(timer, "estimate");
      log.progress("  error bars");
      errors = estimate_errors(model, found.modes);
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
    bool Driver<dim>::is_affordable(const double n_unknowns)
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
    bool Driver<dim>::refine()
    {
      PhaseTimer::Scope scope(timer, "mesh");
      FiniteElementSpace<dim> &spaces = model.spaces();
      auto &mesh                      = spaces.triangulation;
      // Every unknown of a volume becomes 2^dim, roughly.
      const double growth = std::pow(2., dim);
      if (prm.refinement.strategy == Strategy::uniform)
      {
        if (!is_affordable(growth * spaces.rows.size))
          return false;
        mesh.set_all_refine_flags();
        divide();
        return true;
      }
      constexpr double bulk       = 0.7;
      std::vector<double> by_cell = refinement_indicators(rows, errors, prm.refinement.tolerance);
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
      divide();
      return true;
    }

    template <int dim>
    void Driver<dim>::divide()
    {
      auto &mesh = model.spaces().triangulation;
      std::vector<CellId::binary_type> own;
      for (const auto &cell : mesh.active_cell_iterators())
        if (cell->is_locally_owned() && cell->refine_flag_set())
          own.push_back(cell->id().template to_binary<dim>());
      auto &divided = record.cycles.back().divided_cells;
      for (const auto &of_rank : Utilities::MPI::all_gather(comm, own))
        divided.insert(divided.end(), of_rank.begin(), of_rank.end());
      mesh.execute_coarsening_and_refinement();
    }

    template <int dim>
    unsigned int Driver<dim>::replay()
    {
      auto &mesh = model.spaces().triangulation;
      for (const Checkpoint::Cycle &done : record.cycles)
      {
        budget.add_mesh({double(done.n_unknowns), done.seconds, done.memory_gib});
        const std::set<CellId::binary_type> divided(done.divided_cells.begin(),
                                                    done.divided_cells.end());
        if (divided.empty()) // the last one of all
          continue;
        for (const auto &cell : mesh.active_cell_iterators())
          if (cell->is_locally_owned() && divided.count(cell->id().template to_binary<dim>()) > 0)
            cell->set_refine_flag();
        mesh.execute_coarsening_and_refinement();
      }
      const unsigned int n_done = record.cycles.size();
      if (n_done > 0)
        log.line("\nResumed after " + std::to_string(n_done) +
                 (n_done == 1 ? " mesh." : " meshes."));
      make_mesh(record.finished ? n_done - 1 : n_done);
      return n_done;
    }

    template <int dim>
    void Driver<dim>::make_mesh(const unsigned int cycle)
    {
      PhaseTimer::Scope scope(timer, "mesh");
      const FiniteElementSpace<dim> &spaces = model.spaces();
      found                                 = EigenSolution();
      model.distribute();
      log.line("\nMesh " + std::to_string(cycle) + ": " +
               std::to_string(spaces.triangulation.n_global_active_cells()) + " cells of degree " +
               std::to_string(spaces.fe.degree) + ", " + std::to_string(spaces.n_displacements) +
               " displacements, " + std::to_string(spaces.n_multipliers) + " contact pressures");
    }

    /// The static equilibrium's steps and the resultants of the steady pressure: static.csv and a
    /// line for each pad.
    template <int dim>
    void Driver<dim>::report_static(const unsigned int cycle)
    {
      const bool slides = prm.terms().friction, computed = model.equilibrium() != nullptr;
      if (computed && prm.n_pads() > 0)
        log.print(iteration_table(model.equilibrium()->iterations, prm.contact.mortar()));
      const bool checks = slides && prm.contact.self_locking_check && prm.n_pads() > 0;
      PhaseTimer::Scope scope(timer, "static");
      const SelfLocking locking = checks ? model.self_locking() : SelfLocking();
      if (!static_csv)
        static_csv =
            table("static.csv",
                  "cycle,pad,normal_force_n,friction_force_n,friction_torque_nm,contact_area_m2,"
                  "max_pressure_pa,max_penetration_m,self_energising_gain");
      for (const ContactResultants &r : model.resultants())
      {
        static_csv->add({std::to_string(cycle), r.name, number(r.normal_force),
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
    void Driver<dim>::write_fields(const unsigned int cycle)
    {
      PhaseTimer::Scope scope(timer, "output");
      if (prm.output.fields == FieldOutput::none)
        return;
      const FiniteElementSpace<dim> &spaces = model.spaces();
      const bool has_pads                   = prm.n_pads() > 0;
      const double pressure_scale           = has_pads ? model.contact()->pressure_scale() : 1;
      if (model.equilibrium())
      {
        const MultiVector &state = model.equilibrium()->state;
        write_state(spaces, state, pressure_scale, directory, cycle);
        if (has_pads)
          write_contact(spaces, *model.contact(), state, prm.terms().friction, directory, cycle);
      }

      std::vector<unsigned int> wanted;
      unsigned int least_stable = 0;
      for (unsigned int j = 0; j < rows.size(); ++j)
      {
        if (prm.output.fields == FieldOutput::all || rows[j].is_unstable() ||
            rows[j].verdict == Verdict::undecided)
          wanted.push_back(j);
        if (rows[j].growth_rate() > rows[least_stable].growth_rate())
          least_stable = j;
      }
      if (wanted.empty() && !rows.empty())
        wanted.push_back(least_stable);
      for (const unsigned int j : wanted)
      {
        log.progress("  fields of mode " + std::to_string(rows[j].mode));
        write_mode(spaces, found.modes.right, j, pressure_scale, directory, cycle, rows[j].mode,
                   prm.output.animation_frames);
        if (prm.terms().friction && has_pads)
          write_friction_work(spaces, *model.contact(), model.friction_work(found.modes, j),
                              directory, cycle, rows[j].mode);
      }
    }

    template <int dim>
    void Driver<dim>::report_convergence()
    {
      if (!prm.eigenproblem.is_solved())
        return;
      const auto reference = prm.refinement.reference_eigenvalues();
      std::vector<std::vector<ModeRow>> rows_of_cycle;
      std::vector<unsigned int> dofs_of_cycle;
      std::vector<double> sizes;
      for (const Checkpoint::Cycle &done : record.cycles)
      {
        // Adaptive meshes have no one size of cells: what counts is the number of unknowns.
        sizes.push_back(prm.refinement.strategy == Strategy::adaptive
                            ? std::pow(done.n_unknowns, -1. / dim)
                            : std::pow(0.5, sizes.size()));
        rows_of_cycle.push_back(done.rows);
        dofs_of_cycle.push_back(done.n_unknowns);
      }
      if (rows_of_cycle.size() < 2 && (rows_of_cycle.empty() || reference.empty()))
        return;
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
    if (prm.scene == Scene::matrices)
      return std::make_unique<MatrixAnalysis>(file, directory, comm);
    if (prm.scene == Scene::strip)
      return std::make_unique<Driver<2>>(make_strip(prm), file, directory, comm);
    return std::make_unique<Driver<3>>(make_bodies(prm), file, directory, comm);
  }
} // namespace squeal
