#include <squeal/run/mesh_sequence.h>
#include <squeal/scenes/make_scene.h>

#include <algorithm>
#include <cmath>
#include <utility>

// From mesh to mesh: resume() makes the last one of an interrupted run again, make() numbers the
// unknowns of the present one and compares what it needs with the memory that there is, refine()
// divides cells, or the elements of the file, for the next one. In front of the first there may be
// some that are refined at the edge of the contact.

namespace squeal
{
  using namespace dealii;

  template <int dim>
  MeshSequence<dim>::MeshSequence(const Geometry<dim> &geometry, const Parameters::All &prm,
                                  const Wanted &wanted, Checkpoint &checkpoint, Report &report,
                                  const std::string &directory, const MPI_Comm comm)
      : model_(std::make_unique<BrakeModel<dim>>(geometry, prm, comm, report.log, report.timer)),
        prm(prm), wanted(wanted), checkpoint(checkpoint), report(report), directory(directory),
        comm(comm), budget(prm.refinement)
  {
  }

  template <int dim>
  unsigned int MeshSequence<dim>::resume()
  {
    for (const CellNames &divided : checkpoint.divided_at_edge)
      divide_again(model().spaces().triangulation, divided);
    for (const Checkpoint::Cycle &done : checkpoint.cycles)
    {
      budget.add_mesh({double(done.n_unknowns), done.seconds, done.memory_gib});
      divide_again(model().spaces().triangulation, done.divided_cells);
    }
    const unsigned int n_done = checkpoint.cycles.size();
    if (divides_elements())
      divide_elements(n_done - (checkpoint.finished ? 1 : 0));
    if (n_done > 0)
      report.log.line("\nResumed after " + std::to_string(n_done) +
                      (n_done == 1 ? " mesh." : " meshes."));
    return n_done;
  }

  template <int dim>
  void MeshSequence<dim>::make(const unsigned int cycle)
  {
    if (checkpoint.cycles.empty())
      refine_at_contact_edge();
    if (!has_state)
      number_unknowns();
    present                               = cycle;
    const FiniteElementSpace<dim> &spaces = model().spaces();
    report.log.line(
        text_of("\nMesh ", cycle, ": ", spaces.triangulation.n_global_active_cells(),
                " cells of degree ", spaces.fe.degree, ", ", spaces.n_displacements,
                " displacements, ", spaces.n_multipliers, " contact pressures",
                spaces.has_ties() ? text_of(", ", spaces.n_ties, " tractions of joints") : ""));
    need_memory();
  }

  template <int dim>
  void MeshSequence<dim>::make_last()
  {
    const unsigned int n_done = checkpoint.cycles.size(), last = n_done > 0 ? n_done - 1 : 0;
    if (present != last)
      make(last);
  }

  template <int dim>
  void MeshSequence<dim>::refine_at_contact_edge()
  {
    for (unsigned int level = 0; level < prm.refinement.edge_levels; ++level)
    {
      number_unknowns();
      if (!divide_at_contact_edge(level, find_steady_state(false)))
        return;
    }
  }

  template <int dim>
  bool MeshSequence<dim>::divide_at_contact_edge(const unsigned int level,
                                                 const SteadyState<dim> &state)
  {
    PhaseTimer::Scope scope(report.timer, "mesh");
    auto &mesh                  = model().spaces().triangulation;
    const std::size_t n_steps   = state.equilibrium->iterations.size();
    std::vector<double> by_cell = cells_at_contact_edge(*state.contact);
    if (Utilities::MPI::max(by_cell.size(), mesh.get_communicator()) == 0)
    {
      report.log.line("\nThe pads touch everywhere: no edge of the contact to refine.");
      has_state = true; // no edge is left that bars would ask for
      return false;
    }
    model().keep_sectors(by_cell);
    unsigned int number = 0;
    for (const auto &cell : mesh.active_cell_iterators())
      if (cell->is_locally_owned() && by_cell[number++] > 0)
        cell->set_refine_flag();
    const std::string objection =
        budget.objection(model().spaces().rows.size * growth_by_flags(mesh));
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
    return true;
  }

  template <int dim>
  const SteadyState<dim> &MeshSequence<dim>::find_steady_state()
  {
    return std::exchange(has_state, false) ? model().steady_state() : find_steady_state(true);
  }

  template <int dim>
  const SteadyState<dim> &MeshSequence<dim>::find_steady_state(const bool with_edge)
  {
    const SteadyState<dim> &state =
        model().find_steady_state(prm, {}, {&checkpoint.zone, with_edge});
    checkpoint.zone = state.contact && state.equilibrium ? zone_of(*state.contact) : ContactZone();
    return state;
  }

  template <int dim>
  void MeshSequence<dim>::number_unknowns()
  {
    PhaseTimer::Scope scope(report.timer, "mesh");
    model().distribute();
  }

  /// What a mesh that is @p growth times as large as the present one asks for.
  template <int dim>
  RunSize MeshSequence<dim>::size_of_run(const double growth) const
  {
    const FiniteElementSpace<dim> &spaces = model().spaces();
    const OwnElements &own                = spaces.geometry.own;
    const double growth_of_own            = divides_elements() ? growth : 1;
    const double n_parts                  = std::count_if(own.cells.begin(), own.cells.end(),
                                                          [](const OwnElements::Cell &cell)
                                                          { return cell.element != OwnElements::none; });
    return {growth * (spaces.triangulation.n_global_active_cells() - n_parts) +
                growth_of_own * cells_like(own, spaces.fe.degree),
            growth * spaces.rows.size,
            spaces.fe.degree,
            Utilities::MPI::n_mpi_processes(spaces.comm),
            expected_number_of_modes(prm, plate_like_rotor(spaces)),
            prm.eigenproblem.error_bars,
            prm.eigenproblem.solver,
            model().sectors().are_two(),
            growth_of_own * n_parts};
  }

  template <int dim>
  NextDegree MeshSequence<dim>::next_degree() const
  {
    RunSize size    = size_of_run();
    const double p  = size.degree;
    const auto &own = model().spaces().geometry.own;
    size.degree     = p + 1;
    size.n_unknowns *= std::pow((p + 1) / p, dim);
    size.n_cells += cells_like(own, size.degree) - cells_like(own, size.degree - 1);
    return {size.n_unknowns, dim == 3 ? expected_peak_mib(size) : 0};
  }

  /// In three dimensions, to which the prediction was fitted, and not of iterative statics alone.
  template <int dim>
  bool MeshSequence<dim>::predicts_memory() const
  {
    return dim == 3 &&
           (wanted.modes || prm.static_equilibrium.linear_solver != LinearSolver::iterative);
  }

  /// Statics alone turn to iterations by themselves where factors do not fit.
  template <int dim>
  bool MeshSequence<dim>::has_other_way() const
  {
    return !wanted.modes && prm.static_equilibrium.linear_solver == LinearSolver::automatic;
  }

  /// Refuses what cannot fit before hours go into it.
  template <int dim>
  void MeshSequence<dim>::need_memory()
  {
    if (!predicts_memory())
      return;
    const RunSize size = size_of_run();
    const double mib   = expected_peak_mib(size),
                 load  = expected_memory_load(size, model().spaces().comm);
    report.log.line(formatted("Expected peak memory about %.0f MiB", mib) +
                    (wanted.modes && model().spaces().geometry.has_rotor()
                         ? formatted(", with about %.0f modes", size.n_modes)
                         : ""));
    if (load > 1 && !has_other_way() && prm.refinement.check_memory)
      throw SolverError("The run needs about " + number(mib / 1024, 3) + " GiB, " +
                            number(load, 3) + " times what is available.",
                        {Failure::factors_too_large, Failure::memory_predicted});
  }

  template <int dim>
  void MeshSequence<dim>::refine(const unsigned int cycle, const EigenSolution::Cost &cost,
                                 const std::vector<ModeRow> &rows, const EigenvalueErrors &errors)
  {
    const FiniteElementSpace<dim> &spaces = model().spaces();
    const unsigned int n_unknowns         = spaces.rows.size;
    const auto [seconds, memory_gib] =
        report.cycle(cycle, spaces.triangulation.n_global_active_cells(), n_unknowns,
                     spaces.n_multipliers, cost);
    checkpoint.cycles.push_back({rows, n_unknowns, seconds, memory_gib, {}});
    budget.add_mesh({double(n_unknowns), seconds, memory_gib});
    checkpoint.finished =
        checkpoint.cycles.size() == prm.refinement.n_cycles() || !divide_cells(rows, errors);
    if (prm.refinement.n_cycles() > 1 && (!checkpoint.finished || prm.varies_parameters()))
      checkpoint.save(directory, spaces.comm);
  }

  /// Uniform: every cell. Adaptive: the cells that make up the greater part of the errors.
  template <int dim>
  bool MeshSequence<dim>::flag(const std::vector<ModeRow> &rows, const EigenvalueErrors &errors)
  {
    auto &mesh = model().spaces().triangulation;
    if (prm.refinement.strategy == Strategy::uniform)
    {
      mesh.set_all_refine_flags();
      return true;
    }
    std::vector<double> by_cell = refinement_indicators(rows, errors, prm.refinement.tolerance);
    if (Utilities::MPI::max(by_cell.size(), mesh.get_communicator()) == 0)
    {
      report.log.line(prm.refinement.tolerance > 0 ? "\nAll modes are known to the tolerance."
                                                   : "\nAll verdicts are decided.");
      return false;
    }
    model().keep_sectors(by_cell);
    if (!leave_elements_whole(by_cell))
    {
      report.log.line("\nWhat errors are left is of elements with polynomials of their own, which "
                      "stay whole; Mesh/Tetrahedra = divided refines them.");
      return false;
    }
    flag_cells(mesh, by_cell);
    return true;
  }

  template <int dim>
  bool MeshSequence<dim>::divides_elements() const
  {
    return prm.refinement.strategy == Strategy::uniform && !model().spaces().geometry.own.empty();
  }

  template <int dim>
  void MeshSequence<dim>::divide_elements(const unsigned int times)
  {
    if (times == 0)
      return;
    Parameters::All finer = prm;
    finer.mesh.refinements += times;
    model_.reset(); // both need not have place
    model_ = std::make_unique<BrakeModel<dim>>(make_scene<dim>(finer), prm, comm, report.log,
                                               report.timer);
  }

  /// Takes the cells of elements with own polynomials out of what is to be divided; whether some
  /// are left. Collective.
  template <int dim>
  bool MeshSequence<dim>::leave_elements_whole(std::vector<double> &by_cell) const
  {
    const auto &mesh       = model().spaces().triangulation;
    const OwnElements &own = model().spaces().geometry.own;
    unsigned int number    = 0;
    double largest         = 0;
    for (const auto &cell : mesh.active_cell_iterators())
      if (cell->is_locally_owned())
      {
        if (cell->level() == 0 && own.has(cell->index()))
          by_cell[number] = 0;
        largest = std::max(largest, by_cell[number++]);
      }
    return Utilities::MPI::max(largest, mesh.get_communicator()) > 0;
  }

  template <int dim>
  std::string MeshSequence<dim>::objection(const double growth) const
  {
    // Ranks measure different times: the first one's word counts.
    const MPI_Comm comm = model().spaces().comm;
    const std::string too_costly =
        Utilities::MPI::broadcast(comm, budget.objection(model().spaces().rows.size * growth));
    if (!too_costly.empty() || !predicts_memory() || has_other_way() ||
        !prm.refinement.check_memory)
      return too_costly;
    const RunSize size = size_of_run(growth);
    if (expected_memory_load(size, comm) <= 1)
      return {};
    return "No further mesh: it would need about " + number(expected_peak_mib(size) / 1024, 3) +
           " GiB, more than there is.";
  }

  template <int dim>
  bool MeshSequence<dim>::divide_cells(const std::vector<ModeRow> &rows,
                                       const EigenvalueErrors &errors)
  {
    PhaseTimer::Scope scope(report.timer, "mesh");
    if (!flag(rows, errors))
      return false;
    auto &mesh            = model().spaces().triangulation;
    const std::string why = objection(growth_by_flags(mesh));
    if (!why.empty())
    {
      report.log.line("\n" + why);
      return false;
    }
    if (divides_elements())
      divide_elements(checkpoint.cycles.size());
    else
      checkpoint.cycles.back().divided_cells = divide(mesh);
    return true;
  }

  template class MeshSequence<2>;
  template class MeshSequence<3>;
} // namespace squeal
