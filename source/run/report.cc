#include <squeal/assessment/critical_speed.h>
#include <squeal/bars/locking.h>
#include <squeal/base/memory.h>
#include <squeal/model/plausible_load.h>
#include <squeal/parameters/plausibility.h>
#include <squeal/run/report.h>
#include <squeal/statics/static_report.h>

#include <deal.II/base/mpi.h>

#include <slepcsys.h>

#include <algorithm>
#include <cmath>

// What a run tells, in the order of a run: the banner; static.csv and the pads; modes.csv and
// contributions.csv, with the screen's table, its causes and near coincidences; sensitivities.csv;
// response.csv; cycles.csv and the seconds of phases; the ladder; convergence. describe() at the
// end is the summary of the parameters with which a log begins, and all that --check prints.

namespace squeal
{
  namespace
  {
    const std::vector<std::string> phase_names = {"mesh",         "assembly", "contact", "static",
                                                  "eigenproblem", "estimate", "output"};

    std::string banner(const MPI_Comm comm)
    {
      const unsigned int n_ranks = dealii::Utilities::MPI::n_mpi_processes(comm);
      char text[256];
      SQUEAL_PETSC(SlepcGetVersion(text, sizeof(text)));
      const std::string slepc = text;
#ifdef DEBUG
      const char *build = ", debug";
#else
      const char *build = ", release";
#endif
      return "squeal " SQUEAL_VERSION " (deal.II " DEAL_II_PACKAGE_VERSION ", " +
             slepc.substr(0, slepc.find(',')) + build + "), " + std::to_string(n_ranks) +
             (n_ranks == 1 ? " rank" : " ranks");
    }
  } // namespace

  Report::Report(const Parameters::All &prm, const std::string &directory, const MPI_Comm comm,
                 const std::string &called, const bool resumes, const bool appends)
      : log(comm), prm(prm), directory(directory), comm(comm), appends(appends)
  {
    log.open(directory + "/log.txt", resumes);
    log.line(banner(comm));
    log.print(called);
    log.print(describe(prm, directory));
  }

  Table &Report::table(const std::string &name, const Fields &sample)
  {
    return tables.try_emplace(name, directory + "/" + name, sample, comm, appends).first->second;
  }

  void Report::steady_state(const unsigned int cycle, const StaticEquilibrium *equilibrium,
                            const std::vector<ContactResultants> &resultants,
                            const SelfLocking *locking)
  {
    const bool slides = prm.terms().friction, computed = equilibrium != nullptr;
    if (computed && prm.has_contact())
      log.print(iteration_table(equilibrium->iterations, prm.contact.mortar()));
    const auto has_friction = [&](const ContactResultants &r)
    { return r.kind == ContactKind::sliding ? slides : computed && r.kind == ContactKind::stick; };
    const auto fields_of = [&](const ContactResultants &r) -> Fields
    {
      const auto known = [](const bool is_known, const double value)
      { return is_known ? std::optional<double>(value) : std::nullopt; };
      return {
          {"cycle", cycle},
          {"pad", r.name},
          {"normal_force_n", r.normal_force},
          {"friction_force_n", known(has_friction(r), r.friction_force)},
          {"friction_torque_nm", known(has_friction(r), r.friction_torque)},
          {"contact_area_m2", r.area},
          {"max_pressure_pa", r.max_pressure},
          {"max_penetration_m", known(computed, r.max_penetration)},
          {"self_energising_gain", known(locking, locking ? locking->gain : 0)},
          {"needed_friction", known(computed && r.kind == ContactKind::stick, r.needed_friction)}};
    };
    Table &static_csv = table("static.csv", fields_of({}));
    for (const ContactResultants &r : resultants)
    {
      static_csv.add(fields_of(r));
      if (r.kind != ContactKind::sliding)
      {
        describe_joint(r, computed);
        continue;
      }
      const double force = slides ? r.friction_force : 0, torque = slides ? r.friction_torque : 0;
      log.line(prm.scene == Scene::strip // of one metre of its depth
                   ? formatted("Block: normal force %.6g N/m, friction force %.6g N/m, length in "
                               "contact %.6g m, pressure %.4g to %.4g Pa",
                               r.normal_force, force, r.area, r.min_pressure, r.max_pressure)
                   : formatted("Pad %s: normal force %.6g N, friction force %.6g N, torque %.6g N "
                               "m, area in contact %.6g m^2, pressure %.4g to %.4g Pa",
                               r.name.c_str(), r.normal_force, force, torque, r.area,
                               r.min_pressure, r.max_pressure));
      if (r.min_pressure < 0)
        log.line("  Negative pressure: contacts open at the nodes of the pressure; between nodes, "
                 "beside the edge of the contact zone, its polynomial may dip below zero. A finer "
                 "mesh or Refinement/Contact edge levels makes the dip smaller.");
    }
    for (const std::string &doubt : doubts_about_load(prm, resultants))
      log.line(doubt);
    if (!locking)
      return;
    log.line("Friction amplifies contact pressure with the gain " + number(locking->gain, 4) +
             " (1: self-locking)");
    if (locking->locks())
      log.line("Warning, self-locking: the friction that a pattern of contact pressure causes "
               "brings back more pressure than that. This steady state is not the one that a "
               "brake reaches when friction grows from zero.");
  }

  void Report::wear(const unsigned int cycle, const std::vector<WearStep> &steps)
  {
    const auto fields_of = [&](const double distance, const WearOfPad &pad) -> Fields
    {
      return {{"cycle", cycle},
              {"sliding_distance_m", distance},
              {"pad", pad.name},
              {"worn_volume_m3", pad.volume},
              {"max_depth_m", pad.largest_depth},
              {"open_area_m2", pad.open_area},
              {"max_pressure_pa", pad.largest_pressure}};
    };
    Table &csv = table("wear.csv", fields_of(0, {}));
    for (const WearStep &step : steps)
      for (const WearOfPad &pad : step.of_pads)
        csv.add(fields_of(step.distance, pad));
    for (const WearOfPad &pad : steps.back().of_pads)
      log.line(formatted("Pad %s: worn up to %.4g m deep, %.4g m^3, after sliding %.6g m; the last "
                         "step of bedding in changed the pressure by %.2g of the largest",
                         pad.name.c_str(), pad.largest_depth, pad.volume, steps.back().distance,
                         steps.back().pressure_change));
  }

  template <int dim>
  void Report::worn_pads(const WornPressure<dim> &worn, const std::vector<ContactResultants> &pads)
  {
    for (unsigned int i = 0; i < pads.size(); ++i)
    {
      log.line("Worn pad " + pads[i].name + ": p = " + worn.formula(i));
      if (worn.is_open(i))
        log.line("Warning, worn free: a part of the pad " + pads[i].name +
                 " has lost contact, where this pressure would be negative. Error bars do not see "
                 "the border of the contact.");
    }
  }
  template void Report::worn_pads(const WornPressure<2> &, const std::vector<ContactResultants> &);
  template void Report::worn_pads(const WornPressure<3> &, const std::vector<ContactResultants> &);

  void Report::describe_joint(const ContactResultants &joint, const bool computed)
  {
    const bool sticks      = joint.kind == ContactKind::stick;
    const std::string name = (sticks ? "Stick contact " : "Frictionless contact ") + joint.name;
    if (!computed)
    {
      log.line(name + ": taken for closed, without a computed steady pressure");
      return;
    }
    log.line(
        formatted("%s: normal force %.6g N, area in contact %.6g m^2, pressure %.4g to %.4g Pa",
                  name.c_str(), joint.normal_force, joint.area, joint.min_pressure,
                  joint.max_pressure) +
        (sticks ? formatted(", tangential force %.6g N; it needs a friction coefficient of "
                            "%.3g at its worst node",
                            joint.friction_force, joint.needed_friction)
                : std::string()));
    if (joint.n_slipping > 0)
      log.line(
          formatted("  %u of its closed nodes slip: stuck they would be pulled apart, open they "
                    "would overlap.",
                    joint.n_slipping));
    if (joint.friction > 0 && joint.needed_friction > joint.friction)
      log.line(
          formatted("Warning: the contact %s has the friction coefficient %g (Joints/Contacts): "
                    "where it needs more it slips, and is taken for stuck all the same.",
                    joint.name.c_str(), joint.friction));
  }

  void Report::modes(const unsigned int cycle, const EigenSolution &found, const ModeTable &table,
                     const double seconds_of_bars)
  {
    Table &modes_csv         = this->table("modes.csv", modes_fields({}) + shape_fields({}));
    Table &contributions_csv = this->table("contributions.csv", contributions_fields(cycle, {}));
    for (const ModeRow &row : table.rows)
      modes_csv.add(modes_fields(row) + shape_fields(row.shape));
    for (const Contribution &part : table.contributions)
      contributions_csv.add(contributions_fields(cycle, part));

    log.line("Completeness: " + found.proof.completeness + ".");
    if (!found.proof.beyond.empty())
      log.line("Growth beyond: " + found.proof.beyond + ".");
    if (const auto &seconds = found.cost.seconds; seconds.factorization > 0)
      log.line(formatted("Eigenproblem, processor seconds: counting %.2f, factorisation %.2f, "
                         "right vectors %.2f, left vectors %.2f, error bars %.2f; %u right-hand "
                         "sides.",
                         seconds.counting, seconds.factorization, seconds.right, seconds.left,
                         seconds_of_bars, found.cost.n_solves));
    if (prm.eigenproblem.is_matrix_free())
      log.line("Eigenproblem without factors: " + std::to_string(found.cost.n_solves) +
               " multigrid cycles.");
    if (found.proof.n_rigid_body_modes > 0)
      log.line(std::any_of(table.rows.begin(), table.rows.end(),
                           [](const ModeRow &row) { return row.verdict == Verdict::divergence; })
                   ? text_of(found.proof.n_rigid_body_modes,
                             " modes of the reference problem have a stiffness of zero or less: "
                             "rigid-body modes, which are not listed, and what diverges.")
                   : text_of("Not listed: ", found.proof.n_rigid_body_modes,
                             " rigid-body modes at zero frequency."));
    log.print("\n" + modes_table(table.rows));
    unsigned int n_unstable = 0, n_undecided = 0;
    for (const ModeRow &row : table.rows)
    {
      n_unstable += row.is_unstable();
      n_undecided += row.verdict == Verdict::undecided;
    }
    log.line(text_of("\n", table.rows.size(), " modes ", window_of(prm.eigenproblem),
                     table.rows.empty() ? " and no verdict."
                                        : text_of(", ", n_unstable, " unstable (marked >), ",
                                                  n_undecided, " undecided.")));
    if (table.rows.empty())
      log.line(no_modes(prm.eigenproblem));
    if (n_unstable == 0 && n_undecided > 0)
      log.line("Squeal cannot be excluded: the error bars of undecided growth rates reach across "
               "zero.");
    if (const std::string doubt = doubt_about_critical_speed(
            table.rows, prm.terms().transport ? prm.operation.angular_velocity : 0,
            prm.prestress.stress_stiffness);
        !doubt.empty())
      log.line(doubt);
    if (found.proof.lacks_growing)
      log.line(lacking_growth);
    if (prm.eigenproblem.minimum_frequency > 0)
      log.line(
          "The window leaves out zero frequency: nothing is said about divergence, and nothing "
          "about flutter below it.");
    explain(table);
  }

  void Report::explain(const ModeTable &table)
  {
    if (table.rows.empty())
      return;
    std::vector<unsigned int> numbers;
    for (const ModeRow &row : table.rows)
      if (row.is_unstable())
        numbers.push_back(row.mode);
    if (numbers.empty())
      numbers = {table.rows[least_stable(table.rows)].mode};
    if (numbers.size() > 10)
      numbers.resize(10);
    // A body without damping at rest has growth rates of rounding: nothing to explain.
    double largest = 0, rounding = 0;
    for (const Contribution &part : table.contributions)
      largest = std::max(largest, std::abs(part.growth_rate));
    for (const ModeRow &row : table.rows)
      rounding = std::max(rounding, 1e-12 * std::abs(row.lambda));
    if (largest > rounding)
      log.print("Why: the growth rate as a sum over its causes\n" +
                contributions_table(table.contributions, numbers));

    for (const ModeRow &row : table.rows)
      if (row.shape && std::find(numbers.begin(), numbers.end(), row.mode) != numbers.end())
        log.line("Mode " + std::to_string(row.mode) + ": " + described(*row.shape) + ".");

    constexpr double large_condition = 100;
    for (const ModeRow &row : table.rows)
      if (row.condition_number.value_or(0) > large_condition)
        log.line("Mode " + std::to_string(row.mode) + " has the condition number " +
                 number(std::round(*row.condition_number)) +
                 ": it is close to coalescence, where errors grow like the square root of a "
                 "perturbation and sensitivities hold only for tiny changes.");
  }

  void Report::bars(const unsigned int cycle, const std::vector<ModeRow> &rows,
                    const std::vector<BarPart> &parts, const NextDegree &next)
  {
    Table &csv = table("bars.csv", bar_fields(cycle, 0, {}, 0));
    for (unsigned int j = 0; j < rows.size(); ++j)
      for (const BarPart &part : parts)
        csv.add(bar_fields(cycle, rows[j].mode, part, j));
    log.print(describe_bars(rows, parts, prm, next));
  }

  void Report::sensitivities(const unsigned int cycle, const EigenPairs &modes,
                             const ModeTable &table,
                             const std::vector<ParameterDerivative> &derivatives)
  {
    Table &csv = this->table("sensitivities.csv", sensitivities_fields(cycle, 0, {}, 0));
    std::vector<VerdictMargin> margins;
    for (const ParameterDerivative &derivative : derivatives)
    {
      const auto d_lambda = squeal::sensitivities(derivative, modes);
      for (unsigned int j = 0; j < table.rows.size(); ++j)
      {
        csv.add(sensitivities_fields(cycle, table.rows[j].mode, derivative, d_lambda[j]));
        margins.push_back({derivative.parameter, j,
                           -table.rows[j].growth_rate() / (derivative.value * d_lambda[j].real())});
      }
    }
    log.print(describe_margins(table.rows, std::move(margins)));
  }

  namespace
  {
    Fields response_fields(const double frequency, const unsigned int force,
                           const unsigned int observation, const std::complex<double> value,
                           const double error)
    {
      return {{"frequency_hz", frequency},
              {"force", force + 1},
              {"observation", observation + 1},
              {"real_m", value.real()},
              {"imaginary_m", value.imag()},
              {"amplitude_m", std::abs(value)},
              {"phase_deg", std::arg(value) * 180 / M_PI},
              {"interpolation_error_m", error}};
    }
  } // namespace

  void Report::response(const FrequencyResponse &response, const EigenPairs &modes)
  {
    Table &csv = table("response.csv", response_fields(0, 0, 0, {}, 0));
    for (unsigned int f = 0; f < response.frequencies.size(); ++f)
      for (unsigned int k = 0; k < response.n_forces; ++k)
        for (unsigned int j = 0; j < response.n_observations; ++j)
          csv.add(response_fields(response.frequencies[f], k, j,
                                  response.values[response.at(f, k, j)],
                                  response.errors[response.at(f, k, j)]));

    const bool is_direct = response.n_direct == response.frequencies.size();
    log.line(text_of("\nFrequency response at ", response.frequencies.size(), " frequencies from ",
                     response.frequencies.front(), " to ", response.frequencies.back(), " Hz by ",
                     is_direct ? "" : text_of(modes.size(), " modes and "), response.n_direct,
                     " direct solutions with ", response.n_factorizations, " factorisations."));
    const unsigned int n_components = prm.n_components();
    const auto forces               = prm.response.list_of_forces(n_components);
    const auto observations         = prm.response.list_of_observations(n_components);
    for (unsigned int k = 0; k < response.n_forces; ++k)
      for (unsigned int j = 0; j < response.n_observations; ++j)
      {
        unsigned int largest = 0;
        for (unsigned int f = 1; f < response.frequencies.size(); ++f)
          if (std::abs(response.values[response.at(f, k, j)]) >
              std::abs(response.values[response.at(largest, k, j)]))
            largest = f;
        log.line(text_of("  force ", k + 1, " (", forces[k].text, "), observation ", j + 1, " (",
                         observations[j].text, "): largest amplitude ",
                         number(std::abs(response.values[response.at(largest, k, j)]), 4), " m at ",
                         number(response.frequencies[largest], 6), " Hz",
                         is_direct ? ""
                                   : text_of(", interpolation error ",
                                             number(response.errors[response.at(largest, k, j)], 2),
                                             " m"),
                         "."));
      }
    const unsigned int n_growing =
        std::count_if(modes.lambda.begin(), modes.lambda.end(),
                      [](const std::complex<double> &l) { return l.real() > 0; });
    if (n_growing > 0)
      log.line(text_of("Warning: ", n_growing, n_growing == 1 ? " mode grows" : " modes grow",
                       ": the steady state does not last. The response is the part of the motion "
                       "that goes with the force, beside what grows."));
  }

  Report::Cost Report::cycle(const unsigned int cycle, const std::uint64_t cells,
                             const unsigned int dofs, const unsigned int multipliers,
                             const EigenSolution::Cost &cost)
  {
    Fields fields = {{"cycle", cycle},
                     {"cells", std::to_string(cells)},
                     {"dofs", dofs},
                     {"multipliers", multipliers}};
    for (const std::string &phase : phase_names)
      fields.emplace_back("seconds_" + phase, timer.seconds(phase));
    const double processor_seconds = dealii::Utilities::MPI::sum(of_cycle.lap(), comm),
                 memory            = peak_memory_mib(comm);
    fields.emplace_back("processor_seconds", processor_seconds);
    fields.emplace_back("seconds_total", timer.total());
    fields.emplace_back("memory_mib", memory);
    table("cycles.csv", fields).add(fields);
    phases(cost);
    const Cost result{timer.total(), memory / 1024};
    timer.restart();
    return result;
  }

  void Report::phases(const EigenSolution::Cost &cost)
  {
    const double total = timer.total();
    log.line("\n  phase            seconds    share");
    for (const std::string &phase : phase_names)
      if (const double seconds = timer.seconds(phase); seconds > 0)
        log.line(
            formatted("  %-14s %9.2f   %5.1f %%", phase.c_str(), seconds, 100 * seconds / total));
    std::string line =
        formatted("  %-14s %9.2f\n  Peak memory %.0f MiB", "total", total, peak_memory_mib(comm));
    if (!timer.peak_phase().empty())
      line += ", reached in the phase " + timer.peak_phase();
    if (cost.factor_memory_mib > 0)
      line += formatted("; the factorisation for shift-invert took %.0f MiB (predicted %.0f)",
                        cost.factor_memory_mib, cost.predicted_memory_mib);
    log.line(line + ".");
  }

  void Report::stage(const std::string &name, const EigenSolution &found,
                     const std::vector<ModeRow> &rows)
  {
    const auto fields_of = [&](const ModeRow &row) {
      return Fields{{"stage", name}} + modes_fields(row);
    };
    Table &csv = table("ladder.csv", fields_of({}));
    for (const ModeRow &row : rows)
      csv.add(fields_of(row));
    log.line(text_of("Stage ", name, ": ", rows.size(), " modes. ", found.proof.completeness, "."));
    if (rows.empty())
      log.line(no_modes(prm.eigenproblem, "in the stage " + name));
  }

  void Report::ladder(const std::vector<std::string> &stages,
                      const std::vector<std::vector<ModeRow>> &rows)
  {
    log.print(
        "\nGrowth rates, 1/s, and verdicts of the stages; modes are paired by their eigenvalues\n" +
        ladder_table(stages, rows) +
        "\nOnly the stage full supports a verdict on a real brake: without damping every "
        "circulatory\ngyroscopic system is unstable, and damping of one kind alone settles "
        "nothing.\n");
  }

  void Report::convergence(const std::vector<ConvergenceRow> &rows, const bool several_meshes)
  {
    Table csv(directory + "/convergence.csv", convergence_fields({}), comm);
    for (const ConvergenceRow &row : rows)
      csv.add(convergence_fields(row));
    write_text(directory + "/convergence.tex", convergence_tex(rows), comm);
    if (several_meshes)
      log.print("\nConvergence (change: of the eigenvalue since the mesh before, relative)\n" +
                convergence_table(rows));
  }

  void Report::end()
  {
    log.repeat_warnings();
    log.line("\nResults: " + directory);
  }

  namespace
  {
    /// Bodies, contact and mesh.
    void describe_scene(const Parameters::All &prm, std::ostream &text)
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
               << prm.contact.friction.coefficient
               << (prm.contact.friction_of_pads.empty() ? ""
                                                        : " (" + prm.contact.friction_of_pads + ")")
               << ", steady pressure " << name_of(prm.contact.steady_pressure);
      }
      text << ", " << prm.operation.angular_velocity
           << (prm.scene == Scene::strip ? " m/s" : " rad/s");
      if (prm.turns() && prm.rotor.transport == Transport::none)
        text << "\nRotor/Transport = none: friction slides with Omega, but the rotor's deformation "
                "is not carried along. Neglected are the\ngyroscopic and centrifugal terms (a mode "
                "with n nodal diameters is moved by up to n Omega/2 pi = n "
             << number(std::abs(prm.operation.angular_velocity) / (2 * M_PI), 4)
             << " Hz) and, of\nfriction damping, Q_R.";
      const auto &d = prm.discretization;
      text << "\nCoarse mesh: "
           << (prm.scene == Scene::mesh
                   ? prm.mesh.file
                   : "rotor " + d.rotor_cells_text + ", each pad " + d.pad_cells_text + " cells")
           << "; degree " << d.degree << "; " << prm.refinement.n_cycles() << " mesh(es), "
           << name_of(prm.refinement.strategy);
      if (prm.refinement.edge_levels > 0)
        text << ", cells at the edge of the contact divided " << prm.refinement.edge_levels
             << " times";
      for (const Parameters::BodyMaterial &body : prm.materials())
        if (const StiffnessFactor::Fit &fit = body.material.stiffness_factor.fit;
            !fit.filename.empty())
          text << "\n"
               << body.section << "/Material/Modulus table = " << fit.filename << ": "
               << fit.prony.size() << " Prony elements and the loss factor "
               << number(fit.loss_factor, 3) << " fit it within " << number(100 * fit.error, 3)
               << " %, at " << prm.operation.temperature << " degrees Celsius";
    }

    /// Parameters with which results are worse than they might be.
    void warn(const Parameters::All &prm, std::ostream &text)
    {
      if (!prm.varies_parameters()) // else check_study() has those of every point
        for (const std::string &doubt : doubts(prm))
          text << doubt << "\n";
      if (prm.scene != Scene::matrices)
        for (const Parameters::BodyMaterial &body : prm.materials())
          if (may_lock(body.material, prm.discretization.degree))
            text << "Warning, nearly incompressible: " << body.section
                 << "/Material/Poisson ratio = " << body.material.poisson_ratio
                 << ". Elements of degree " << prm.discretization.degree
                 << " lock: error bars allow for what may be, and are long. Take degree "
                 << free_of_locking << ".\n";
      if (prm.scene != Scene::matrices && prm.scene != Scene::strip && prm.n_pads() > 0 &&
          prm.terms().friction && prm.operation.angular_velocity == 0 && prm.contact.is_smoothed())
        text << "Warning, no friction: at rest (Operation/Angular velocity = 0) a law with "
                "Contact/Friction/Smoothing speed gives zero.\n";
      if (const double ratio = too_long_cells(prm.rotor, prm.discretization);
          ratio > 0 && prm.scene == Scene::brake)
        text << "Warning, thin rotor: its cells are " << number(std::round(ratio))
             << " times as long as thick. "
             << (prm.discretization.degree < free_of_locking ? "They may lock. "
                                                             : "Error bars may be too short. ")
             << "Take more radial cells.\n";
    }
  } // namespace

  std::string describe(const Parameters::All &prm, const std::string &directory)
  {
    std::ostringstream text;
    text << "Scene " << name_of(prm.scene);
    if (prm.scene != Scene::matrices)
      describe_scene(prm, text);
    if (prm.eigenproblem.is_solved())
      text << "\nEvery mode " << window_of(prm.eigenproblem) << " by the solver "
           << name_of(prm.eigenproblem.solver) << ", tolerance " << prm.eigenproblem.tolerance;
    else
      text << "\nThe static equilibrium only, linear solver "
           << name_of(prm.static_equilibrium.linear_solver);
    text << "\nResults go to " << directory << "\n";
    warn(prm, text);
    return text.str();
  }
} // namespace squeal
