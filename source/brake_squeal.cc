#include <squeal/body_operators.h>
#include <squeal/brake_squeal.h>
#include <squeal/contact.h>
#include <squeal/contact_fields.h>
#include <squeal/expressions.h>
#include <squeal/fields.h>
#include <squeal/matrix_market.h>
#include <squeal/static_equilibrium.h>

#include <slepcsys.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace squeal
{
  namespace
  {
    const std::vector<std::string> phase_names = {"mesh",   "assembly",     "contact",
                                                  "static", "eigenproblem", "output"};

    std::string cycles_header()
    {
      std::string header = "cycle,cells,dofs,multipliers";
      for (const std::string &phase : phase_names)
        header += ",seconds_" + phase;
      return header + ",seconds_total,memory_mib";
    }
  } // namespace

  Analysis::Analysis(const ParameterFile &file, const std::string &directory, const MPI_Comm comm)
      : file(file), prm(file.parameters()), directory(directory), comm(comm), log(comm)
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
  }

  void Analysis::find_modes(const QuadraticEigenproblem &problem, const unsigned int cycle)
  {
    PhaseTimer::Scope scope(timer, "eigenproblem");
    EigensolverOptions options;
    options.max_imaginary = 2 * M_PI * prm.eigenproblem.maximum_frequency;
    options.tolerance     = prm.eigenproblem.tolerance;
    options.shift         = prm.eigenproblem.shift;
    options.progress      = [this](const std::string &text) { log.progress(text); };

    modes = make_eigensolver(prm.eigenproblem.solver)->solve(problem, options);
    const std::vector<ModeRow> rows = analyse(problem, modes, cycle, options.tolerance);
    for (const ModeRow &row : rows)
      modes_csv->add(modes_fields(row));
    rows_of_cycle.push_back(rows);

    log.line("Completeness: " + modes.completeness + ".");
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
  }

  void Analysis::finish_cycle(const unsigned int cycle, const std::uint64_t cells,
                              const unsigned int dofs, const unsigned int multipliers)
  {
    dofs_of_cycle.push_back(dofs);
    std::vector<std::string> fields = {std::to_string(cycle), std::to_string(cells),
                                       std::to_string(dofs), std::to_string(multipliers)};
    for (const std::string &phase : phase_names)
      fields.push_back(number(timer.seconds(phase)));
    fields.push_back(number(timer.total()));
    fields.push_back(number(peak_memory_mib(comm)));
    cycles_csv->add(fields);
    report_phases();
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
    std::string iteration_table(const std::vector<StaticIteration> &iterations, const bool mortar)
    {
      std::string text = std::string("Static equilibrium, active set:\n  step   active ") +
                         (mortar ? "multipliers" : "points     ") +
                         "   changes   tension, Pa   penetration, m   pressure change\n";
      for (unsigned int i = 0; i < iterations.size(); ++i)
      {
        char line[160];
        std::snprintf(line, sizeof(line), "  %4u   %18u   %7u   %11.3e   %14.3e   %15.3e\n", i,
                      iterations[i].n_active, iterations[i].n_changed,
                      iterations[i].largest_tension, iterations[i].largest_penetration,
                      iterations[i].pressure_change);
        text += line;
      }
      return text;
    }

    /// Bodies meshed by finite elements, on a sequence of meshes.
    template <int dim>
    class BrakeSqueal : public Analysis
    {
    public:
      BrakeSqueal(const Geometry<dim> &geometry, const ParameterFile &file,
                  const std::string &directory, const MPI_Comm comm)
          : Analysis(file, directory, comm), geometry(geometry),
            spaces(this->geometry, prm.discretization.degree, prm.contact.mortar(), comm),
            static_csv(
                directory + "/static.csv",
                "cycle,pad,normal_force_n,friction_force_n,friction_torque_nm,contact_area_m2,"
                "max_pressure_pa,max_penetration_m",
                comm)
      {
      }

      void run() override
      {
        for (unsigned int cycle = 0; cycle < prm.refinement.n_cycles(); ++cycle)
        {
          if (!make_mesh(cycle))
            break;
          assemble_bodies();
          couple_bodies(cycle);
          find_modes(linearised_problem(), cycle);
          write_fields(cycle);
          finish_cycle(cycle, spaces.triangulation.n_global_active_cells(), spaces.rows.size,
                       spaces.n_multipliers);
        }
        if (rows_of_cycle.size() > 1)
          log.print("\nConvergence (change: |l - l of the mesh before| / |l|)\n" +
                    convergence_table(rows_of_cycle, dofs_of_cycle));
        log.line("\nResults: " + directory);
      }

    private:
      bool make_mesh(unsigned int cycle);
      void assemble_bodies();
      void couple_bodies(unsigned int cycle);
      void report_static(const typename Contact<dim>::Pressure &pressure, unsigned int cycle);
      QuadraticEigenproblem linearised_problem() const;
      void write_fields(unsigned int cycle);

      std::shared_ptr<const Matrix> add_term(Origin origin, unsigned int order, double coefficient,
                                             Matrix matrix)
      {
        if (!matrix)
          return nullptr;
        const auto shared = std::make_shared<const Matrix>(std::move(matrix));
        terms.push_back({origin, order, coefficient, shared});
        return shared;
      }

      const Geometry<dim> geometry;
      Spaces<dim> spaces;
      Table static_csv;
      std::vector<Term> terms;
      std::unique_ptr<Contact<dim>> contact;
      Block state; ///< the static equilibrium; no rows if it was not computed
      bool state_computed = false;
    };

    /// Refines after the first cycle and numbers the unknowns. False if the budget of unknowns is
    /// spent.
    template <int dim>
    bool BrakeSqueal<dim>::make_mesh(const unsigned int cycle)
    {
      PhaseTimer::Scope scope(timer, "mesh");
      if (cycle > 0)
      {
        // Every unknown of a volume becomes 2^dim, roughly.
        const double expected = std::pow(2., dim) * spaces.rows.size;
        if (expected > prm.refinement.maximum_unknowns)
        {
          log.line("\nNo further mesh: it would have about " + number(std::round(expected)) +
                   " unknowns, more than Refinement/Maximum unknowns = " +
                   std::to_string(prm.refinement.maximum_unknowns) + ".");
          return false;
        }
        spaces.triangulation.refine_global(1);
      }
      terms.clear();
      contact.reset();
      modes = Modes();
      spaces.distribute();
      log.line("\nMesh " + std::to_string(cycle) + ": " +
               std::to_string(spaces.triangulation.n_global_active_cells()) + " cells of degree " +
               std::to_string(spaces.fe.degree) + ", " + std::to_string(spaces.n_displacements) +
               " displacements, " + std::to_string(spaces.n_multipliers) + " contact pressures");
      return true;
    }

    /// M q'' + (D + 2 Omega G) q' + (K - Omega^2 M*) q of theory.md, section 2, as far as the stage
    /// has it.
    template <int dim>
    void BrakeSqueal<dim>::assemble_bodies()
    {
      PhaseTimer::Scope scope(timer, "assembly");
      const StageTerms stage = prm.terms();
      const double omega     = prm.operation.angular_velocity;
      const bool moves       = stage.transport && omega != 0;

      std::vector<Body> pads;
      for (const ContactInterface &interface : geometry.interfaces)
        pads.push_back(interface.pad);
      for (const bool rotor : {true, false})
      {
        if (!rotor && pads.empty())
          continue;
        const Material &material =
            rotor ? static_cast<const Material &>(prm.rotor.material) : prm.pads.material;
        const BodyMatrices body = assemble_body(
            spaces, rotor ? std::vector<Body>{rotor_body} : pads, material, rotor && moves);
        terms.push_back({Origin::inertia, 2, 1., body.M});
        terms.push_back({Origin::elasticity, 0, 1., body.K});
        if (rotor && moves)
        {
          terms.push_back({Origin::transport, 1, 2 * omega, body.G});
          terms.push_back({Origin::transport, 0, -omega * omega, body.M_star});
        }
        if (stage.material_damping)
        {
          const double alpha = material.mass_damping, beta = material.stiffness_damping;
          if (alpha != 0)
            terms.push_back({Origin::material_damping, 1, alpha, body.M});
          if (beta != 0)
            terms.push_back({Origin::material_damping, 1, beta, body.K});
          // Damping proportional to mass acts on the material velocity u_t + Omega d_phi u.
          if (alpha != 0 && rotor && moves)
            terms.push_back({Origin::material_damping, 0, alpha * omega, body.G});
        }
      }
    }

    /// N, mu T, the steady state, P_R and Q_R of theory.md, section 3, as far as the stage has
    /// them. With a computed steady pressure the static equilibrium also decides where the pads
    /// touch, in every stage.
    template <int dim>
    void BrakeSqueal<dim>::couple_bodies(const unsigned int cycle)
    {
      state_computed = false;
      if (geometry.interfaces.empty())
        return;
      const StageTerms stage = prm.terms();
      ContactModel<dim> model;
      model.mortar            = prm.contact.mortar();
      model.penalty_stiffness = prm.contact.penalty_stiffness;
      model.friction          = prm.contact.law();
      model.angular_velocity  = prm.operation.angular_velocity;
      const bool computed     = prm.contact.steady_pressure == "computed";
      if (computed && prm.contact.initial_gap != "0")
        model.initial_gap =
            position_expression<dim>(prm.contact.initial_gap, "Contact/Initial gap");
      {
        PhaseTimer::Scope scope(timer, "contact");
        contact = std::make_unique<Contact<dim>>(spaces, model);
        if (model.mortar)
        {
          // Rows of the constraint as large as those of the stiffness.
          double stiffness = 0;
          for (const Term &term : terms)
            if (term.origin == Origin::elasticity && term.order == 0)
              stiffness = std::max(stiffness, term.matrix->infinity_norm());
          contact->scale_constraints(stiffness);
        }
      }

      typename Contact<dim>::Pressure pressure;
      if (computed)
      {
        PhaseTimer::Scope scope(timer, "static");
        log.progress("  static equilibrium");
        auto equilibrium = solve_static_equilibrium(spaces.rows, terms, *contact, stage.friction,
                                                    assemble_pressure_load(spaces));
        state            = std::move(equilibrium.state);
        state_computed   = true;
        pressure         = std::move(equilibrium.pressure);
        log.print(iteration_table(equilibrium.iterations, model.mortar));
      }
      else
        pressure = contact->uniform_pressure(prm.pads.pressure);

      PhaseTimer::Scope scope(timer, "contact");
      report_static(pressure, cycle);
      add_term(Origin::contact, 0, 1., contact->normal());
      if (stage.friction)
        add_term(Origin::friction, 0, 1., contact->friction(pressure));
      if (stage.friction_damping)
      {
        auto damping = contact->friction_damping(pressure);
        add_term(Origin::friction_damping, 1, 1., std::move(damping.P));
        add_term(Origin::friction_damping, 0, 1., std::move(damping.Q));
        add_term(Origin::falling_friction, 1, 1., std::move(damping.P_falling));
        add_term(Origin::falling_friction, 0, 1., std::move(damping.Q_falling));
      }
    }

    /// The resultants of the steady pressure: static.csv and a line for each pad.
    template <int dim>
    void BrakeSqueal<dim>::report_static(const typename Contact<dim>::Pressure &pressure,
                                         const unsigned int cycle)
    {
      const bool slides = prm.terms().friction;
      for (const ContactResultants &r :
           contact->resultants(pressure, state_computed ? &state : nullptr))
      {
        static_csv.add({std::to_string(cycle), r.name, number(r.normal_force),
                        slides ? number(r.friction_force) : "",
                        slides ? number(r.friction_torque) : "", number(r.area),
                        number(r.max_pressure), state_computed ? number(r.max_penetration) : ""});
        char text[240];
        std::snprintf(text, sizeof(text),
                      "Pad %s: normal force %.6g N, friction force %.6g N, torque %.6g N m, area "
                      "in contact %.6g m^2, "
                      "pressure %.4g to %.4g Pa",
                      r.name.c_str(), r.normal_force, slides ? r.friction_force : 0.,
                      slides ? r.friction_torque : 0., r.area, r.min_pressure, r.max_pressure);
        log.line(text);
      }
    }

    /// { M, P, Q } of theory.md, section 3, and the reference problem for counting modes: the same
    /// bodies in frictionless contact.
    template <int dim>
    QuadraticEigenproblem BrakeSqueal<dim>::linearised_problem() const
    {
      QuadraticEigenproblem problem;
      problem.rows                = spaces.rows;
      problem.M                   = sum_of(spaces.rows, terms, 2);
      problem.P                   = sum_of(spaces.rows, terms, 1);
      problem.Q                   = sum_of(spaces.rows, terms, 0);
      problem.n_constraints       = contact ? contact->n_active_multipliers() : 0;
      problem.n_local_constraints = spaces.rows.end - spaces.first_local_multiplier;
      std::vector<Term> symmetric;
      bool is_reference = !problem.P;
      for (const Term &term : terms)
        if (term.order == 0)
        {
          const bool conservative = term.origin == Origin::elasticity ||
                                    term.origin == Origin::contact ||
                                    (term.origin == Origin::transport);
          if (conservative)
            symmetric.push_back(term);
          is_reference &= conservative;
        }
      if (!is_reference)
        problem.reference = sum_of(spaces.rows, symmetric, 0);
      problem.reference_name = "the same bodies in frictionless contact";

      // Bodies without enough supports can move rigidly: a clamped rotor cannot, a guided pad is
      // held by the contact.
      problem.may_move_rigidly = (prm.scene == "brake" && prm.rotor.clamped == "none") ||
                                 (prm.n_pads() > 0 && prm.pads.back_face == "free");
      return problem;
    }

    template <int dim>
    void BrakeSqueal<dim>::write_fields(const unsigned int cycle)
    {
      PhaseTimer::Scope scope(timer, "output");
      if (prm.output.fields == "none")
        return;
      const double pressure_scale = contact ? contact->pressure_scale() : 1;
      if (state_computed)
      {
        write_state(spaces, state, pressure_scale, directory, cycle);
        write_contact(spaces, *contact, state, prm.terms().friction, directory, cycle);
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
      }
    }

    /// Matrix Market files in, modes out; no mesh.
    class MatrixAnalysis : public Analysis
    {
    public:
      using Analysis::Analysis;
      void run() override
      {
        QuadraticEigenproblem problem;
        {
          PhaseTimer::Scope scope(timer, "assembly");
          const Parameters::Matrices &names = prm.matrices;
          const auto mass                   = read_matrix_market(names.mass, "Matrices/Mass");
          if (mass.n_rows != mass.n_columns)
            throw InputError("Matrices/Mass = " + names.mass + ": the matrix has " +
                             std::to_string(mass.n_rows) + " rows and " +
                             std::to_string(mass.n_columns) + " columns; it must be square.");
          int n_ranks = 1;
          MPI_Comm_size(comm, &n_ranks);
          if (n_ranks > int(mass.n_rows))
            throw InputError("Matrices/Mass = " + names.mass + ": the matrix has fewer rows (" +
                             std::to_string(mass.n_rows) + ") than there are ranks (" +
                             std::to_string(n_ranks) + "). Use fewer ranks.");
          problem.rows = even_rows(mass.n_rows);
          problem.M    = distribute(mass, problem.rows);
          check_symmetric(problem);

          const auto read = [&](const std::string &filename, const std::string &key)
          {
            if (filename.empty())
              return Matrix();
            const auto matrix = read_matrix_market(filename, key);
            if (matrix.n_rows != mass.n_rows || matrix.n_columns != mass.n_rows)
              throw InputError(key + " = " + filename + ": the matrix is " +
                               std::to_string(matrix.n_rows) + " x " +
                               std::to_string(matrix.n_columns) + ", the mass matrix " +
                               std::to_string(mass.n_rows) + " x " + std::to_string(mass.n_rows) +
                               ": all matrices must have one size.");
            return distribute(matrix, problem.rows);
          };
          problem.P                = read(names.velocity, "Matrices/Velocity");
          const Matrix stiffness   = read(names.stiffness, "Matrices/Stiffness");
          const Matrix circulatory = read(names.circulatory, "Matrices/Circulatory");
          problem.Q =
              sum_of(problem.rows, {{1., stiffness}, {names.circulatory_factor, circulatory}});
          problem.reference = symmetric_part(problem.rows, problem.Q);
          problem.reference_name =
              "the symmetric part of the position matrix, without velocity terms,";
          log.line("\nMatrices of size " + std::to_string(problem.rows.size));
        }
        find_modes(problem, 0);
        finish_cycle(0, 0, problem.rows.size, 0);
        log.line("\nResults: " + directory);
      }

    private:
      RowRange even_rows(const unsigned int n) const
      {
        int rank = 0, n_ranks = 1;
        MPI_Comm_rank(comm, &rank);
        MPI_Comm_size(comm, &n_ranks);
        RowRange rows;
        rows.comm  = comm;
        rows.begin = static_cast<std::uint64_t>(n) * rank / n_ranks;
        rows.end   = static_cast<std::uint64_t>(n) * (rank + 1) / n_ranks;
        rows.size  = n;
        return rows;
      }

      void check_symmetric(const QuadraticEigenproblem &problem) const
      {
        Mat transpose = nullptr;
        SQUEAL_PETSC(MatTranspose(problem.M, MAT_INITIAL_MATRIX, &transpose));
        const Matrix owner(transpose);
        const Matrix difference = sum_of(problem.rows, {{1., problem.M}, {-1., owner}});
        if (difference.infinity_norm() > 1e-10 * problem.M.infinity_norm())
          throw InputError("Matrices/Mass = " + prm.matrices.mass +
                           ": the mass matrix must be symmetric.");
      }
    };
  } // namespace

  std::unique_ptr<Analysis> make_analysis(const ParameterFile &file, const std::string &directory,
                                          const MPI_Comm comm)
  {
    const Parameters::All &prm = file.parameters();
    if (prm.scene == "matrices")
      return std::make_unique<MatrixAnalysis>(file, directory, comm);
    if (prm.scene == "strip")
      return std::make_unique<BrakeSqueal<2>>(make_strip(prm), file, directory, comm);
    return std::make_unique<BrakeSqueal<3>>(make_brake(prm), file, directory, comm);
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
        text << ", contact by "
             << (prm.contact.mortar()
                     ? "mortar"
                     : "penalty " + number(prm.contact.penalty_stiffness) + " N/m^3");
        if (prm.terms().friction)
          text << ", friction " << prm.contact.friction_law << " "
               << prm.contact.friction_coefficient << ", steady pressure "
               << prm.contact.steady_pressure;
      }
      text << ", " << prm.operation.angular_velocity << " rad/s";
      const auto &d = prm.discretization;
      text << "\nCoarse mesh: rotor " << d.rotor_cells_text << ", each pad " << d.pad_cells_text
           << " cells; degree " << d.degree << "; " << prm.refinement.n_cycles() << " mesh(es), "
           << prm.refinement.strategy;
    }
    text << "\nEvery mode up to " << number(prm.eigenproblem.maximum_frequency)
         << " Hz by the solver " << prm.eigenproblem.solver << ", tolerance "
         << prm.eigenproblem.tolerance << "\nResults go to " << directory << "\n";
    return text.str();
  }
} // namespace squeal
