#include <squeal/base/memory.h>
#include <squeal/bodies/prestress.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/contact/contact_matrices.h>
#include <squeal/model/brake_model.h>
#include <squeal/model/measured_damping.h>
#include <squeal/model/plausible_load.h>
#include <squeal/parameters/expressions.h>
#include <squeal/statics/bedding.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

// The brake on a mesh, in this order: which terms a body has (body_terms(), theory.md, section 2);
// the two steps of assemble(), find_steady_state() and linearise(), the second a function of the
// state alone; matrices of bodies and joints, assembled once a mesh and scaled from then on; how a
// state is found (find_state()); terms of the contact about it (theory.md, section 3); loads and
// geometric stiffness; questions about the present state.

namespace squeal
{
  using namespace dealii;

  std::vector<BodyTerm> body_terms(const Parameters::All &prm, const Parameters::BodyMaterial &body)
  {
    using Kind             = BodyTerm::Kind;
    const StageTerms stage = prm.terms();
    const double omega     = body.of_rotor && stage.transport ? prm.operation.angular_velocity : 0,
                 alpha = body.material.damping().alpha, beta = body.material.damping().beta;
    std::vector<BodyTerm> terms = {{Origin::inertia, 2, Kind::M, 1},
                                   {Origin::elasticity, 0, Kind::K, 1}};
    const auto add = [&](const Origin origin, const unsigned int order, const Kind matrix,
                         const double coefficient)
    {
      if (coefficient != 0)
        terms.push_back({origin, order, matrix, coefficient});
    };
    add(Origin::transport, 1, Kind::G, 2 * omega);
    add(Origin::transport, 0, Kind::M_star, -omega * omega);
    if (stage.material_damping)
    {
      add(Origin::material_damping, 1, Kind::M, alpha);
      add(Origin::material_damping, 1, Kind::K, beta);
      add(Origin::material_damping, 1, Kind::V, body.material.viscosity.is_active());
      // Damping proportional to mass acts on the material velocity u_t + Omega d_phi u.
      add(Origin::material_damping, 0, Kind::G, alpha * omega);
    }
    return terms;
  }

  namespace
  {
    /// The terms of a body: the static equilibrium needs those of order zero only.
    std::vector<BodyTerm> wanted_terms(const Parameters::All &prm,
                                       const Parameters::BodyMaterial &body, const bool with_motion)
    {
      std::vector<BodyTerm> terms = body_terms(prm, body);
      if (!with_motion)
        terms.erase(std::remove_if(terms.begin(), terms.end(),
                                   [](const BodyTerm &term) { return term.order > 0; }),
                    terms.end());
      return terms;
    }

    BodyMatrixChoice matrices_of(const std::vector<BodyTerm> &terms)
    {
      const auto has = [&](const BodyTerm::Kind kind)
      {
        return std::any_of(terms.begin(), terms.end(),
                           [&](const BodyTerm &term) { return term.matrix == kind; });
      };
      return {has(BodyTerm::Kind::M), has(BodyTerm::Kind::K), has(BodyTerm::Kind::G),
              has(BodyTerm::Kind::M_star), has(BodyTerm::Kind::V)};
    }

    /// The part of a choice that is not there.
    BodyMatrixChoice missing(const BodyMatrixChoice &choice, const BodyMatrices &matrices)
    {
      return {choice.M && !matrices.M, choice.K && !matrices.K, choice.G && !matrices.G,
              choice.M_star && !matrices.M_star, choice.V && !matrices.V};
    }

    void add(BodyMatrices &&more, BodyMatrices &matrices)
    {
      for (auto member : {&BodyMatrices::M, &BodyMatrices::K, &BodyMatrices::G,
                          &BodyMatrices::M_star, &BodyMatrices::V})
        if (more.*member)
          matrices.*member = std::move(more.*member);
    }

    /// Whether a load has no part along the axis, the last component.
    template <int dim>
    bool acts_across_axis(const FiniteElementSpace<dim> &spaces, const MultiVector &load)
    {
      constexpr double rounding = 1e-10;
      std::array<double, 2> largest{}; // across, along
      for (const types::global_dof_index node : spaces.nodes.locally_owned_dofs())
        for (unsigned int c = 0; c < dim; ++c)
          if (const unsigned int row = spaces.equation(node, c); spaces.rows.contains(row))
          {
            double &size = largest[c + 1 == dim];
            size         = std::max(size, std::abs(load.column(0)[row - spaces.rows.begin]));
          }
      MPI_Allreduce(MPI_IN_PLACE, largest.data(), 2, MPI_DOUBLE, MPI_MAX, spaces.rows.comm);
      return largest[1] <= rounding * largest[0];
    }

    /// Memory that LU of the static equilibrium takes with its matrices, a guess before there are
    /// any: what prm/brake.prm takes on a mesh twice as fine, and by nested dissection in three
    /// dimensions factors grow like n^(4/3). Factorization predicts it from the matrix.
    double expected_factor_mib(const double n_unknowns)
    {
      constexpr double unknowns = 188000, mib = 4600;
      return mib * std::pow(n_unknowns / unknowns, 4. / 3);
    }
  } // namespace

  template <int dim>
  BrakeModel<dim>::BrakeModel(const Geometry<dim> &geometry, const Parameters::All &parameters,
                              const MPI_Comm comm, Log &log, PhaseTimer &timer)
      : geometry(geometry), comm(comm), log(log), timer(timer),
        spaces_(this->geometry, parameters.discretization.degree, parameters.contact.mortar(),
                comm),
        load_pressure(pressure_of_loads(parameters.pads.pressure))
  {
    steady.parameters = parameters;
  }

  template <int dim>
  BrakeModel<dim>::BrakeModel(const BrakeModel &other, const Parameters::All &parameters,
                              PhaseTimer &timer)
      : geometry(other.geometry), comm(other.comm), log(other.log), timer(timer),
        spaces_(other.spaces_, parameters.discretization.degree), load_pressure(other.load_pressure)
  {
    steady.parameters = parameters;
  }

  namespace
  {
    /// A state at these parameters, of which nothing is known.
    template <int dim>
    SteadyState<dim> unknown_state(const Parameters::All &parameters)
    {
      SteadyState<dim> state;
      state.parameters = parameters;
      return state;
    }
  } // namespace

  template <int dim>
  void BrakeModel<dim>::distribute()
  {
    equations_ = {};
    steady     = unknown_state<dim>(parameters());
    static_solver.drop_factors();
    bodies.clear();
    ties_           = {};
    points_         = {};
    superelements_  = {};
    joint_stiffness = 0;
    spaces_.distribute();
  }

  template <int dim>
  const SteadyState<dim> &BrakeModel<dim>::find_steady_state(const Parameters::All &parameters,
                                                             const LinearOperator &nearby,
                                                             const StateOptions &options)
  {
    equations_              = {};
    SteadyState<dim> before = std::exchange(steady, unknown_state<dim>(parameters));
    before.body_terms.clear(); // others may be made in place of their matrices
    before.iterative.reset();
    // Mass and gyroscopic matrices only after the factors of the static equilibrium are gone.
    if (!parameters.eigenproblem.is_matrix_free() &&
        (parameters.eigenproblem.is_solved() || !solves_iteratively(parameters)))
      steady.body_terms = bodies_and_joints(parameters, false, bool(nearby));
    find_state(steady, std::move(before), nearby, options);
    return steady;
  }

  template <int dim>
  EquationsOfMotion BrakeModel<dim>::linearise(SteadyState<dim> &state)
  {
    const Parameters::All &prm = state.parameters;
    EquationsOfMotion equations;
    if (prm.eigenproblem.is_matrix_free())
      equations.terms = matrix_free_bodies(state);
    else
    {
      equations.terms      = bodies_and_joints(prm, true, false); // stiffnesses are there
      equations.relaxation = relaxation_of_bodies(prm);
    }
    equations.rows          = spaces_.rows;
    equations.n_constraints = (state.contact ? state.contact->n_active_multipliers() : 0) +
                              ties_.n_active + points_.n_active + superelements_.n_active;
    equations.n_local_constraints = spaces_.rows.end - spaces_.first_local_multiplier;
    equations.compliant           = prm.contact.compliance() > 0;
    equations.reference_name      = "the same bodies in frictionless contact";
    equations.may_move_rigidly    = geometry.may_move_rigidly;
    if (!geometry.interfaces.empty())
    {
      PhaseTimer::Scope scope(timer, "contact");
      for (Term &term : contact_terms(*state.contact, state.pressure, prm, state.contact_matrices))
        equations.terms.push_back(std::move(term));
    }
    if (prm.prestress.needs_state())
    {
      PhaseTimer::Scope scope(timer, "assembly");
      for (Matrix &matrix : stress_stiffnesses(prm, state.equilibrium->state))
        if (matrix)
          equations.terms.push_back(
              {Origin::prestress, 0, 1., std::make_shared<const Matrix>(std::move(matrix))});
    }
    if (prm.terms().material_damping && prm.modal_damping.is_active())
    {
      PhaseTimer::Scope scope(timer, "modal damping");
      equations.relaxation.push_back(measured_damping(equations, sectors_for(prm), prm));
    }
    return equations;
  }

  template <int dim>
  void BrakeModel<dim>::assemble(const Parameters::All &parameters, const LinearOperator &nearby)
  {
    find_steady_state(parameters, nearby);
    if (!parameters.eigenproblem.is_solved())
      return;
    if (!nearby)
      return_freed_memory();
    linearise();
  }

  template <int dim>
  bool BrakeModel<dim>::solves_iteratively(const Parameters::All &prm) const
  {
    const LinearSolver solver = prm.static_equilibrium.linear_solver;
    if (prm.eigenproblem.is_matrix_free())
      return true;
    if (spaces_.has_ties() || spaces_.has_nodeless_rows())
      return false;
    if (solver != LinearSolver::automatic || prm.eigenproblem.is_solved() ||
        prm.contact.self_locking_check)
      return solver == LinearSolver::iterative;
    int n_ranks = 0;
    MPI_Comm_size(comm, &n_ranks);
    return memory_load(expected_factor_mib(spaces_.rows.size) / n_ranks, comm) > 1;
  }

  template <int dim>
  std::vector<std::pair<double, std::shared_ptr<const Matrix>>>
  BrakeModel<dim>::AssembledBody::stiffness_of(const Material &present) const
  {
    if (stiffnesses.empty())
      return {{present.young_modulus / material.young_modulus, matrices.K}};
    std::vector<std::pair<double, std::shared_ptr<const Matrix>>> result;
    const std::vector<ElasticComponent<dim>> components = elastic_components<dim>(present);
    for (unsigned int k = 0; k < components.size(); ++k)
      result.emplace_back(components[k].coefficient, stiffnesses[k]);
    return result;
  }

  template <int dim>
  std::vector<Term> BrakeModel<dim>::AssembledBody::terms(const std::vector<BodyTerm> &wanted,
                                                          const Material &present) const
  {
    using Kind = BodyTerm::Kind;
    std::vector<Term> result;
    // M, G, M* are proportional to the density.
    const double rho = present.density / material.density;
    for (const auto &[origin, order, kind, coefficient] : wanted)
      if (kind == Kind::K)
        for (const auto &[modulus, matrix] : stiffness_of(present))
          result.push_back({origin, order, coefficient * modulus, matrix});
      else if (kind == Kind::V)
        result.push_back({origin, order, coefficient, matrices.V});
      else
        result.push_back({origin, order, coefficient * rho,
                          kind == Kind::M   ? matrices.M
                          : kind == Kind::G ? matrices.G
                                            : matrices.M_star});
    return result;
  }

  template <int dim>
  void BrakeModel<dim>::assemble_missing(const unsigned int number, const Material &material,
                                         const BodyMatrixChoice &choice, const bool follows)
  {
    AssembledBody &body             = bodies[number];
    const std::vector<Body> &of_all = geometry.bodies_of(number);
    const bool is_same_kind         = material.is_of_kind(body.material),
               keeps_stiffness = body.stiffnesses.empty() ? material.is_proportional(body.material)
                                                          : is_same_kind;
    if (!keeps_stiffness)
    {
      static_solver.drop_factors(); // they keep the matrices
      if (follows && is_same_kind && body.matrices.K)
      {
        body.stiffnesses = assemble_stiffnesses(spaces_, of_all, material);
        body.matrices.K.reset();
      }
      else
        body = {};
    }
    // Those that are added must fit to the present ones: of the material of these.
    const bool is_new = !body.matrices.M && !body.matrices.K && body.stiffnesses.empty();
    if (is_new)
      body.material = material;
    if (material.viscosity != body.material.viscosity)
    {
      body.matrices.V.reset();
      body.material.viscosity = material.viscosity;
    }
    BodyMatrixChoice lacking = missing(choice, body.matrices);
    lacking.K &= body.stiffnesses.empty();
    add(assemble_body(spaces_, of_all, body.material, lacking), body.matrices);
  }

  template <int dim>
  std::vector<Term> BrakeModel<dim>::bodies_and_joints(const Parameters::All &prm,
                                                       const bool with_motion, const bool follows)
  {
    PhaseTimer::Scope scope(timer, "assembly");
    const std::vector<Parameters::BodyMaterial> materials = prm.materials();
    bodies.resize(materials.size());
    std::vector<Term> terms;
    for (unsigned int m = 0; m < materials.size(); ++m)
    {
      if (geometry.bodies_of(m).empty())
        continue;
      const Material &material           = materials[m].material;
      const std::vector<BodyTerm> wanted = wanted_terms(prm, materials[m], with_motion);
      assemble_missing(m, material, matrices_of(wanted), follows);
      for (Term &term : bodies[m].terms(wanted, material))
        terms.push_back(std::move(term));
    }
    assemble_joints();
    for (Term &term : joint_terms(ties_, points_, superelements_, prm.terms().material_damping))
      if (with_motion || term.order == 0)
        terms.push_back(std::move(term));
    return terms;
  }

  template <int dim>
  std::vector<RelaxationTerm>
  BrakeModel<dim>::relaxation_of_bodies(const Parameters::All &prm) const
  {
    std::vector<RelaxationTerm> relaxation;
    const std::vector<Parameters::BodyMaterial> materials = prm.materials();
    for (unsigned int m = 0; m < materials.size(); ++m)
      if (const Material &material = materials[m].material; !geometry.bodies_of(m).empty() &&
                                                            prm.terms().material_damping &&
                                                            material.stiffness_factor.is_active())
        for (const auto &[coefficient, matrix] : bodies[m].stiffness_of(material))
          relaxation.push_back(
              {Origin::material_damping, coefficient, matrix, material.stiffness_factor});
    return relaxation;
  }

  template <int dim>
  void BrakeModel<dim>::assemble_joints()
  {
    if (spaces_.has_ties() && !ties_.matrix)
      ties_ = assemble_ties(spaces_, stiffness_of_joints());
    if (spaces_.has_points() && !points_.stiffness)
      points_ = assemble_points(spaces_, stiffness_of_joints());
    if (!geometry.superelements.empty() && !superelements_.stiffness)
      superelements_ = assemble_superelements(spaces_, stiffness_of_joints());
  }

  template <int dim>
  double BrakeModel<dim>::stiffness_of_joints()
  {
    if (joint_stiffness == 0)
      for (const AssembledBody &body : bodies)
        if (body.matrices.K)
          joint_stiffness = std::max(joint_stiffness, body.matrices.K->infinity_norm());
    return joint_stiffness;
  }

  template <int dim>
  std::vector<Term> BrakeModel<dim>::joint_terms(const Ties &ties, const Points &points,
                                                 const Superelements &superelements,
                                                 const bool has_damping)
  {
    std::vector<Term> terms;
    if (ties.matrix)
      terms.push_back({Origin::joint, 0, 1., ties.matrix});
    if (points.stiffness)
      terms.push_back({Origin::joint, 0, 1., points.stiffness});
    if (points.damping && has_damping)
      terms.push_back({Origin::joint, 1, 1., points.damping});
    if (points.mass)
      terms.push_back({Origin::inertia, 2, 1., points.mass});
    if (superelements.holding)
      terms.push_back({Origin::joint, 0, 1., superelements.holding});
    if (superelements.stiffness)
      terms.push_back({Origin::elasticity, 0, 1., superelements.stiffness});
    if (superelements.damping && has_damping)
      terms.push_back({Origin::material_damping, 1, 1., superelements.damping});
    if (superelements.mass)
      terms.push_back({Origin::inertia, 2, 1., superelements.mass});
    return terms;
  }

  template <int dim>
  std::vector<Term> BrakeModel<dim>::joint_terms(const FiniteElementSpace<dim> &spaces) const
  {
    return joint_terms(assemble_ties_as(ties_, spaces), assemble_points(spaces, joint_stiffness),
                       assemble_superelements(spaces, joint_stiffness),
                       parameters().terms().material_damping);
  }

  /// With a computed pressure the static equilibrium also decides where the pads touch, in every
  /// stage. A rotor alone has a static state only under the centrifugal load.
  template <int dim>
  void BrakeModel<dim>::find_state(SteadyState<dim> &state, SteadyState<dim> before,
                                   const LinearOperator &nearby, const StateOptions &options)
  {
    const Parameters::All &prm = state.parameters;
    const bool has_pads        = !geometry.interfaces.empty(),
               is_matrix_free  = prm.eigenproblem.is_matrix_free();
    if (!has_pads && !prm.prestress.needs_state() && !is_matrix_free)
      return;
    const bool computed = has_pads ? prm.contact.computes_pressure() : prm.prestress.needs_state();
    const bool beds_in =
        has_pads && computed && prm.contact.is_worn() && prm.contact.wear.distance() > 0;
    const bool follows = nearby && !beds_in && (before.equilibrium || !computed);
    // Sweeps estimate errors where states are solved without factors nearby, maps nowhere.
    const bool has_bars = prm.eigenproblem.error_bars && prm.eigenproblem.is_solved() && !nearby &&
                          !(prm.sweep.active() && prm.sweep.is_map());
    {
      PhaseTimer::Scope scope(timer, "contact");
      state.contact          = std::move(before.contact);
      state.contact_matrices = std::move(before.contact_matrices);
      if (state.contact)
        state.contact->set_model(contact_model(prm));
      else
        state.contact.emplace(spaces_, contact_model(prm));
      state.contact->set_wear(nullptr);
    }
    if ((is_matrix_free || (computed && solves_iteratively(prm))) && !follows)
      state.iterative = make_iterative_solver(prm, has_bars && computed);
    if (!follows)
    {
      PhaseTimer::Scope scope(timer, "contact");
      close_contact(*state.contact, state.body_terms, state.iterative.get());
      if (options.zone && computed)
        start_from(*options.zone, *state.contact);
    }
    if (!computed)
    {
      state.worn = worn_pressure(prm, *state.contact);
      if (state.worn)
      {
        state.contact->close();
        state.worn->release(*state.contact);
      }
      state.pressure = known_pressure(prm, state.worn, *state.contact);
      if (state.worn && prm.terms().friction)
        need_load(prm, squeal::resultants(*state.contact, state.pressure, nullptr));
      return;
    }

    PhaseTimer::Scope scope(timer, "static");
    log.progress("  static equilibrium");
    // What follows it are modes: pressures far more accurate than these.
    const double tolerance = std::clamp(1e-3 * prm.eigenproblem.tolerance, 1e-12, 1e-8);
    const MultiVector load = static_load(prm, spaces_);
    try
    {
      if (beds_in)
        bed_in(state, tolerance);
      state.equilibrium = static_solver.solve(
          {state.body_terms, prm.terms().friction, load, has_bars && options.with_edge, tolerance,
           [&]() { return sectors_for(prm); }},
          *state.contact, state.contact_matrices, std::move(before.equilibrium), nearby,
          state.iterative.get());
    }
    catch (const SolverError &)
    {
      if (has_pads && prm.terms().friction && acts_across_axis(spaces_, load))
        refuse_load_across_axis(prm);
      throw;
    }
    if (!is_matrix_free)
      state.iterative.reset();
    state.pressure = state.equilibrium->pressure;
    if (has_pads && prm.terms().friction)
      need_load(prm, squeal::resultants(*state.contact, state.pressure, &state.equilibrium->state));
  }

  template <int dim>
  void BrakeModel<dim>::bed_in(SteadyState<dim> &state, const double tolerance)
  {
    const Parameters::All &prm   = state.parameters;
    const Parameters::Wear &wear = prm.contact.wear;
    Parameters::All while_worn   = prm;
    if (wear.pressure > 0)
      while_worn.pads.pressure = wear.pressure;
    const StaticProblem problem = {state.body_terms,
                                   prm.terms().friction,
                                   static_load(while_worn, spaces_),
                                   false,
                                   tolerance,
                                   [&]() { return sectors_for(prm); }};
    state.wear_steps =
        squeal::bed_in(*state.contact, {wear.coefficient, wear.speed_exponent, wear.distance()},
                       [&]()
                       {
                         log.progress("  bedding in");
                         return static_solver.solve(problem, *state.contact, state.contact_matrices,
                                                    std::nullopt, {}, state.iterative.get());
                       });
  }

  template <int dim>
  MultiVector BrakeModel<dim>::static_load(const Parameters::All &parameters,
                                           const FiniteElementSpace<dim> &spaces) const
  {
    MultiVector load = assemble_pressure_load<dim>(
        spaces,
        [&](const PressureLoad<dim> &of)
        {
          return of.entry ? parameters.mesh.surface_pressures[*of.entry].second
                          : parameters.pads.pressure / load_pressure;
        });
    if (parameters.prestress.centrifugal_load)
      load += centrifugal_load(parameters, spaces);
    return load;
  }

  template <int dim>
  ContactModel<dim> BrakeModel<dim>::contact_model(const Parameters::All &parameters)
  {
    ContactModel<dim> model;
    model.mortar            = parameters.contact.mortar();
    model.penalty_stiffness = parameters.contact.penalty_stiffness;
    model.compliance        = parameters.contact.compliance();
    if (parameters.terms().material_damping)
    {
      model.normal_dashpot     = parameters.contact.normal_dashpot;
      model.tangential_dashpot = parameters.contact.tangential_dashpot;
    }
    model.friction         = parameters.contact.friction;
    model.friction_of_pads = parameters.contact.friction_by_pad();
    model.angular_velocity = parameters.operation.directed_velocity();
    model.transports       = parameters.rotor.transport == Transport::full;
    if (parameters.contact.computes_pressure() && parameters.contact.initial_gap != "0")
      model.initial_gap =
          position_expression<dim>(parameters.contact.initial_gap, "Contact/Initial gap");
    return model;
  }

  template <int dim>
  std::optional<WornPressure<dim>> BrakeModel<dim>::worn_pressure(const Parameters::All &parameters,
                                                                  const Contact<dim> &contact) const
  {
    if (geometry.interfaces.empty() || !parameters.contact.is_fully_worn())
      return {};
    const Parameters::Wear &wear = parameters.contact.wear;
    return WornPressure<dim>(contact, {wear.pressure_exponent, wear.speed_exponent},
                             static_load(parameters, spaces_), parameters.terms().friction);
  }

  template <int dim>
  ContactPressure BrakeModel<dim>::known_pressure(const Parameters::All &parameters,
                                                  const std::optional<WornPressure<dim>> &worn,
                                                  const Contact<dim> &contact)
  {
    return worn ? worn->on(contact) : contact.uniform_pressure(parameters.pads.pressure);
  }

  template <int dim>
  std::vector<Term>
  BrakeModel<dim>::contact_terms(const Contact<dim> &contact, const ContactPressure &pressure,
                                 const Parameters::All &parameters, ContactMatrices<dim> &matrices)
  {
    std::vector<Term> terms;
    const auto add = [&](const Origin origin, const unsigned int order, Matrix &&matrix)
    {
      if (matrix)
        terms.push_back({origin, order, 1., std::make_shared<const Matrix>(std::move(matrix))});
    };
    const StageTerms stage = parameters.terms();
    terms.push_back({Origin::contact, 0, 1., matrices.normal(contact)});
    if (stage.friction)
    {
      auto [coefficient, matrix] = matrices.friction(contact, pressure);
      terms.push_back({Origin::friction, 0, coefficient, std::move(matrix)});
    }
    if (stage.friction_damping)
    {
      auto damping = matrices.damping(contact, pressure);
      add(Origin::friction_damping, 1, std::move(damping.P));
      add(Origin::friction_damping, 0, std::move(damping.Q));
      add(Origin::falling_friction, 1, std::move(damping.P_falling));
      add(Origin::falling_friction, 0, std::move(damping.Q_falling));
      add(Origin::contact_damping, 1, std::move(damping.P_dashpots));
    }
    if (parameters.prestress.turning_contact)
    {
      auto turning = turning_contact(contact, pressure, stage.friction);
      add(Origin::prestress, 0, std::move(turning.pressure));
      add(Origin::turning_friction, 0, std::move(turning.friction));
    }
    return terms;
  }

  template <int dim>
  MultiVector BrakeModel<dim>::centrifugal_load(const Parameters::All &parameters,
                                                const FiniteElementSpace<dim> &spaces) const
  {
    const std::vector<Parameters::BodyMaterial> materials = parameters.materials();
    MultiVector load(spaces.rows, 1);
    for (unsigned int m = 0; m < materials.size(); ++m)
      if (materials[m].of_rotor)
        load += assemble_centrifugal_load(spaces, geometry.bodies_of(m), materials[m].material,
                                          parameters.operation.angular_velocity);
    return load;
  }

  template <int dim>
  std::vector<Matrix> BrakeModel<dim>::stress_stiffnesses(const Parameters::All &parameters,
                                                          const MultiVector &state) const
  {
    const std::vector<Parameters::BodyMaterial> materials = parameters.materials();
    std::vector<Matrix> result;
    for (unsigned int m = 0; m < materials.size(); ++m)
      if (!geometry.bodies_of(m).empty() &&
          (materials[m].of_rotor || parameters.prestress.stress_stiffness))
        result.push_back(assemble_stress_stiffness(spaces_, geometry.bodies_of(m),
                                                   materials[m].material, state));
    return result;
  }

  template <int dim>
  std::vector<ContactResultants> BrakeModel<dim>::resultants() const
  {
    if (geometry.interfaces.empty())
      return {};
    std::vector<ContactResultants> result =
        squeal::resultants(*steady.contact, steady.pressure,
                           steady.equilibrium ? &steady.equilibrium->state : nullptr);
    for (unsigned int i = 0; i < result.size() && steady.worn; ++i)
      result[i].max_pressure = steady.worn->largest(*steady.contact, i);
    return result;
  }

  template <int dim>
  SelfLocking BrakeModel<dim>::self_locking() const
  {
    if (geometry.interfaces.empty() || !parameters().terms().friction)
      return {};
    return squeal::self_locking(spaces_.rows, steady.body_terms, *steady.contact, steady.pressure);
  }

  template <int dim>
  MultiVector BrakeModel<dim>::static_response(const MultiVector &force) const
  {
    const bool with_friction = parameters().terms().friction;
    if (steady.iterative)
    {
      constexpr double tolerance = 1e-3; // of what is an estimate
      MultiVector response(spaces_.rows, 1);
      steady.iterative->solve(*steady.contact, steady.pressure, with_friction, force, tolerance,
                              response);
      return response;
    }
    // Without what is the rotor's alone
    std::vector<Term> terms;
    const std::vector<Parameters::BodyMaterial> materials = parameters().materials();
    for (unsigned int m = 0; m < materials.size(); ++m)
      if (!materials[m].of_rotor && !geometry.bodies_of(m).empty())
        for (auto &[coefficient, matrix] : bodies[m].stiffness_of(materials[m].material))
          terms.push_back({Origin::elasticity, 0, coefficient, std::move(matrix)});
    for (Term &term : joint_terms(ties_, points_, superelements_, false)) // at rest
      terms.push_back(std::move(term));
    std::vector<char> is_rotor(spaces_.rows.size);
    const auto &[names, body_of_row] = bodies_of_rows();
    for (unsigned int i = 0; i < body_of_row.size(); ++i)
      is_rotor[spaces_.rows.begin + i] = names[body_of_row[i]] == "rotor";
    ContactMatrices<dim> matrices = steady.contact_matrices;
    return solve_beside_held(
        sum_of_terms(spaces_.rows, static_terms(terms, *steady.contact, steady.pressure,
                                                with_friction, matrices)),
        std::move(is_rotor), force, "the stiffness of the static equilibrium");
  }

  template <int dim>
  FrictionWork BrakeModel<dim>::friction_work(const EigenPairs &modes,
                                              const unsigned int mode) const
  {
    return squeal::friction_work(*steady.contact, modes.right.columns({mode}),
                                 modes.lambda[mode].imag(), steady.pressure,
                                 parameters().terms().friction_damping);
  }

  template <int dim>
  std::pair<std::vector<std::string>, std::vector<unsigned int>>
  BrakeModel<dim>::bodies_of_rows() const
  {
    std::vector<std::string> names;
    std::map<Body, unsigned int> number_of_body;
    for (const auto &[name, body] : geometry.named_bodies())
    {
      number_of_body[body] = names.size();
      names.push_back(name);
    }
    const RowRange &rows = spaces_.rows;
    std::vector<unsigned int> body(rows.n_local());
    const auto name_rows = [&](const std::string &name, const unsigned int first)
    {
      std::fill(body.begin() + (first - rows.begin), body.end(), names.size());
      names.push_back(name);
    };
    const bool is_first = Utilities::MPI::this_mpi_process(comm) == 0;
    if (spaces_.has_points())
      name_rows("points", is_first ? spaces_.first_point : rows.end);
    for (unsigned int k = 0; k < geometry.superelements.size(); ++k)
      name_rows(geometry.superelements[k].name, is_first ? spaces_.superelement(k) : rows.end);
    if (spaces_.n_multipliers > 0)
      name_rows("contact", spaces_.first_local_multiplier);
    if (spaces_.has_ties() || spaces_.has_nodeless_rows())
      name_rows("joints", spaces_.first_local_tie);
    std::vector<types::global_dof_index> cell_nodes(spaces_.fe.n_dofs_per_cell());
    for (const auto &cell : spaces_.nodes.active_cell_iterators())
      if (!cell->is_artificial())
      {
        const unsigned int number = number_of_body.at(geometry.parts[cell->material_id()].body);
        cell->get_dof_indices(cell_nodes);
        for (const auto node : cell_nodes)
          for (unsigned int c = 0; c < dim; ++c)
          {
            const unsigned int row = spaces_.equation(node, c);
            if (row != FiniteElementSpace<dim>::none && rows.contains(row))
              body[row - rows.begin] = number;
          }
      }
    return {names, body};
  }

  template class BrakeModel<2>;
  template class BrakeModel<3>;
} // namespace squeal
