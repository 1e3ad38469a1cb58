#include <squeal/base/errors.h>
#include <squeal/parameters/expressions.h>
#include <squeal/parameters/parameters.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <limits>
#include <sstream>
#include <tuple>

namespace squeal
{
  StageTerms terms_of(const Stage stage)
  {
    return {stage >= Stage::transport, stage >= Stage::friction, stage >= Stage::friction_damping,
            stage >= Stage::full};
  }

  namespace Parameters
  {
    namespace
    {
      using dealii::ParameterHandler;
      namespace Patterns = dealii::Patterns;

      constexpr double smallest = std::numeric_limits<double>::min();

      Patterns::Double positive()
      {
        return Patterns::Double(smallest, Patterns::Double::max_double_value);
      }
      Patterns::Double not_negative()
      {
        return Patterns::Double(0, Patterns::Double::max_double_value);
      }

      [[noreturn]] void fail(const std::string &key, const double value,
                             const std::string &what_is_allowed)
      {
        std::ostringstream message;
        message << key << " = " << value << ": " << what_is_allowed;
        throw InputError(message.str());
      }

      std::array<unsigned int, 3> three_counts(const std::string &key, const std::string &text)
      {
        const std::vector<std::string> parts = dealii::Utilities::split_string_list(text, ',');
        if (parts.size() != 3)
          throw InputError(key + " = " + text +
                           ": three numbers of cells are needed: radial, circumferential, axial.");
        std::array<unsigned int, 3> counts;
        for (unsigned int d = 0; d < 3; ++d)
          counts[d] = dealii::Utilities::string_to_int(parts[d]);
        return counts;
      }
    } // namespace

    void Rotor::declare(ParameterHandler &prm)
    {
      prm.enter_subsection("Rotor");
      prm.add_parameter("Inner radius", inner_radius, "Inner radius of the annular disc, m.",
                        positive());
      prm.add_parameter("Outer radius", outer_radius, "Outer radius of the annular disc, m.",
                        positive());
      prm.add_parameter("Thickness", thickness, "Thickness of the disc, m. Its mid-plane is z = 0.",
                        positive());
      prm.add_parameter("Clamped boundary", clamped,
                        "The cylinder on which all displacements are zero.",
                        Patterns::Selection("none|inner|outer"));
      material.declare(prm);
      prm.leave_subsection();
    }

    void Rotor::check() const
    {
      if (inner_radius >= outer_radius)
        fail("Rotor/Inner radius", inner_radius,
             "it must be smaller than Rotor/Outer radius = " + std::to_string(outer_radius) +
                 " m.");
    }

    void Pads::declare(ParameterHandler &prm)
    {
      prm.enter_subsection("Pads");
      prm.add_parameter("Arrangement", arrangement,
                        "Which pads there are: on both faces of the rotor, on the upper one, none.",
                        Patterns::Selection("both|upper|none"));
      prm.add_parameter("Inner radius", inner_radius, "Inner radius of the pad's sector, m.",
                        positive());
      prm.add_parameter("Outer radius", outer_radius, "Outer radius of the pad's sector, m.",
                        positive());
      prm.add_parameter("Sector angle", sector_angle,
                        "Angle of the pad's sector, degrees, centred on phi = 0.",
                        Patterns::Double(smallest, 350));
      prm.add_parameter("Thickness", thickness, "Thickness of a pad, m.", positive());
      prm.add_parameter("Back face", back_face,
                        "Support of the pad's back face. guided: in-plane fixed, axial free.",
                        Patterns::Selection("guided|free|fixed"));
      prm.add_parameter("Pressure", pressure,
                        "Pressure on the pad's back face, towards the rotor, Pa.", not_negative());
      prm.add_parameter(
          "Pressure profile", profile,
          "Factor on the pressure, an expression of the position x, y, z in m; for example "
          "1 + 20*y presses one end of the pad more.");
      material.declare(prm);
      prm.leave_subsection();
    }

    void Pads::check(const Rotor &rotor) const
    {
      if (n_pads() == 0)
        return;
      if (inner_radius >= outer_radius)
        fail("Pads/Inner radius", inner_radius,
             "it must be smaller than Pads/Outer radius = " + std::to_string(outer_radius) + " m.");
      if (inner_radius < rotor.inner_radius || outer_radius > rotor.outer_radius)
      {
        std::ostringstream message;
        message << "Pads/Inner radius = " << inner_radius
                << ", Pads/Outer radius = " << outer_radius
                << ": the pads must lie on the rotor, whose radii are " << rotor.inner_radius
                << " to " << rotor.outer_radius << " m.";
        throw InputError(message.str());
      }
    }

    void Operation::declare(ParameterHandler &prm)
    {
      prm.enter_subsection("Operation");
      prm.add_parameter(
          "Angular velocity", angular_velocity,
          "Angular velocity Omega of the rotor about +z, rad/s (strip: belt speed, m/s).");
      prm.leave_subsection();
    }

    void Contact::declare(ParameterHandler &prm)
    {
      prm.enter_subsection("Contact");
      prm.add_parameter(
          "Formulation", formulation,
          "mortar: Lagrange multiplier on the pad's face. penalty: pressure = stiffness times "
          "penetration in every point; on faces whose meshes do not match it locks if it is stiff. "
          "mortar_penalty: the same relation weakly, for the multiplier: tends to mortar on any "
          "mesh.",
          Patterns::Selection("mortar|penalty|mortar_penalty"));
      prm.add_parameter(
          "Penalty stiffness", penalty_stiffness,
          "Contact stiffness k_C, N/m^3. Used by the formulations penalty and mortar_penalty.",
          positive());
      prm.add_parameter(
          "Steady pressure", steady_pressure,
          "The pressure p_0 about which friction is linearised. computed: from the static "
          "equilibrium. uniform: the applied pressure.",
          Patterns::Selection("computed|uniform"));
      prm.add_parameter(
          "Initial gap", initial_gap,
          "Distance g_0 >= 0 of the unloaded surfaces, an expression of the position x, y, z "
          "in m. Used with Steady pressure = computed.");
      prm.add_parameter("Self-locking check", self_locking_check,
                        "Whether it is computed, at the cost of one factorisation for each mesh, "
                        "how much friction "
                        "amplifies the contact pressure that causes it.");
      prm.enter_subsection("Friction");
      prm.add_parameter(
          "Law", friction_law,
          "mu(v). constant: Coefficient. falling: mu_k + (mu_s - mu_k) exp(-v/v_d) with "
          "mu_s = Coefficient, mu_k = Coefficient at speed, v_d = Decay speed. smoothed: "
          "constant with Smoothing speed. expression: Expression.",
          Patterns::Selection("constant|falling|smoothed|expression"));
      prm.add_parameter("Coefficient", friction_coefficient,
                        "Friction coefficient mu (falling: at rest), -.", not_negative());
      prm.add_parameter("Coefficient at speed", friction_coefficient_moving,
                        "Friction coefficient at high sliding speed, -. Used by the law falling.",
                        not_negative());
      prm.add_parameter(
          "Decay speed", friction_decay_speed,
          "Sliding speed over which the coefficient falls, m/s. Used by the law falling.",
          positive());
      prm.add_parameter(
          "Expression", friction_expression,
          "mu as an expression of the sliding speed v, m/s, and the contact pressure p, Pa. "
          "Used by the law expression; for example 0.4*(p/1e6)^(-0.1).");
      prm.add_parameter(
          "Smoothing speed", smoothing_speed,
          "v_s, m/s: the traction is mu p v/sqrt(v^2 + v_s^2), which has a value at rest. 0: not "
          "smoothed. The law smoothed needs it, the others may have it.",
          not_negative());
      prm.leave_subsection();
      prm.leave_subsection();
    }

    void Contact::check(const Stage stage, const double angular_velocity) const
    {
      if (friction_law == "smoothed" && smoothing_speed == 0)
        fail("Contact/Friction/Smoothing speed", smoothing_speed,
             "the law smoothed needs a positive speed, m/s.");
      if (friction_law == "expression" && friction_expression.empty())
        throw InputError(
            "Contact/Friction/Expression: the law expression needs mu as a function of v and p.");
      law();
      if (angular_velocity == 0 && terms_of(stage).friction_damping && smoothing_speed == 0)
        fail("Operation/Angular velocity", angular_velocity,
             "the friction damping of the stages friction_damping and full grows like 1/Omega and "
             "has "
             "no value at rest. Choose a speed other than 0, one of the stages elastic, transport, "
             "friction, or a Contact/Friction/Smoothing speed.");
    }

    FrictionLaw Contact::law() const
    {
      FrictionLaw law;
      law.kind = friction_law == "falling"      ? FrictionLaw::Kind::falling
                 : friction_law == "expression" ? FrictionLaw::Kind::expression
                                                : FrictionLaw::Kind::constant;
      if (law.kind == FrictionLaw::Kind::expression)
        law.expression =
            squeal::friction_expression(friction_expression, "Contact/Friction/Expression");
      law.smoothing_speed    = smoothing_speed;
      law.coefficient        = friction_coefficient;
      law.coefficient_moving = friction_coefficient_moving;
      law.decay_speed        = friction_decay_speed;
      return law;
    }

    void Strip::declare(ParameterHandler &prm)
    {
      prm.enter_subsection("Strip");
      prm.add_parameter("Length", length, "Period of the layer in x, m.", positive());
      prm.add_parameter("Thickness", thickness,
                        "Thickness of the layer, m; its lower face is fixed.", positive());
      prm.add_parameter("Block length", block_length, "Length of the block, centred on x = 0, m.",
                        positive());
      prm.add_parameter("Block thickness", block_thickness, "Thickness of the block, m.",
                        positive());
      prm.leave_subsection();
    }

    void Strip::check() const
    {
      if (block_length >= length)
        fail("Strip/Block length", block_length,
             "it must be shorter than Strip/Length = " + std::to_string(length) + " m.");
    }

    void Discretization::declare(ParameterHandler &prm)
    {
      prm.enter_subsection("Discretization");
      prm.add_parameter(
          "Degree", degree,
          "Polynomial degree of the displacement; the geometry is mapped with the same.",
          Patterns::Integer(1, 8));
      const Patterns::List counts(Patterns::Integer(1, 100000), 3, 3, ",");
      prm.add_parameter("Rotor cells", rotor_cells_text,
                        "Cells of the rotor's coarse mesh: radial, circumferential, axial (strip: "
                        "unused, along x, "
                        "through the thickness).",
                        counts);
      prm.add_parameter("Pad cells", pad_cells_text,
                        "Cells of a pad's coarse mesh: radial, circumferential, axial (strip: "
                        "unused, along x, through "
                        "the thickness).",
                        counts);
      prm.add_parameter("Align rotor", align_rotor,
                        "The rotor's cells end where the pads do (scene brake), because stresses "
                        "have kinks there. false: equal cells.",
                        Patterns::Bool());
      prm.add_parameter(
          "Clamp layers", clamp_layers,
          "Number of layers of small cells around the two edges of the rotor's clamped "
          "boundary, where the stress is singular. The rest of the mesh stays as it is.",
          Patterns::Integer(0, 20));
      prm.add_parameter(
          "Pad edge layers", pad_edge_layers,
          "Number of thin cell layers by which the pads' meshes are graded towards the "
          "edges of the contact face, where the contact pressure is singular.",
          Patterns::Integer(0, 20));
      prm.add_parameter("Layer ratio", layer_ratio,
                        "Distance of each layer from the edge relative to the next one inwards, -.",
                        Patterns::Double(0.01, 0.5));
      prm.leave_subsection();
    }

    void Discretization::check()
    {
      rotor_cells = three_counts("Discretization/Rotor cells", rotor_cells_text);
      pad_cells   = three_counts("Discretization/Pad cells", pad_cells_text);
      // With fewer cells around, the edges of one cell would meet at the same two lines.
      if (rotor_cells[1] < 3)
        fail("Discretization/Rotor cells", rotor_cells[1],
             "at least 3 cells are needed in the circumferential direction.");
      // Every rank keeps the whole coarse mesh; fine meshes are refined from coarser ones.
      constexpr double most_cells = 1e6, most_unknowns = 2e7;
      for (const auto &[key, text, counts] :
           {std::make_tuple("Rotor", &rotor_cells_text, &rotor_cells),
            std::make_tuple("Pad", &pad_cells_text, &pad_cells)})
      {
        const double n_cells    = double((*counts)[0]) * (*counts)[1] * (*counts)[2],
                     n_unknowns = 3 * n_cells * degree * degree * degree;
        if (n_cells > most_cells || n_unknowns > most_unknowns)
        {
          std::ostringstream message;
          message << "Discretization/" << key << " cells = " << *text << " of Degree " << degree
                  << ": a coarse mesh of " << n_cells << " cells and about " << n_unknowns
                  << " unknowns; allowed are " << most_cells << " cells and " << most_unknowns
                  << " unknowns.";
          throw InputError(message.str());
        }
      }
    }

    void Prestress::declare(ParameterHandler &prm)
    {
      prm.enter_subsection("Prestress");
      prm.add_parameter(
          "Centrifugal load", centrifugal_load,
          "Whether the static equilibrium contains the load rho Omega^2 (x, y, 0), and "
          "the equations of motion the geometric stiffness of the rotor's static "
          "stress.");
      prm.add_parameter("Stress stiffness", stress_stiffness,
                        "Whether the equations of motion contain the geometric stiffness of the "
                        "static stress in all bodies.");
      prm.add_parameter(
          "Turning contact", turning_contact,
          "Whether the steady pressure and friction turn with the rotor's surface and "
          "follow the contact point along it.");
      prm.leave_subsection();
    }

    void Matrices::declare(ParameterHandler &prm)
    {
      prm.enter_subsection("Matrices");
      prm.add_parameter("Mass", mass, "Matrix Market file of M. Required by the scene matrices.");
      prm.add_parameter("Velocity", velocity, "Matrix Market file of P; empty: zero.");
      prm.add_parameter("Stiffness", stiffness,
                        "Matrix Market file of K. Required by the scene matrices.");
      prm.add_parameter("Circulatory", circulatory,
                        "Matrix Market file of N in K + p N; empty: zero.");
      prm.add_parameter("Circulatory factor", circulatory_factor, "The factor p in K + p N, -.");
      prm.add_parameter("Velocity factor", velocity_factor, "A factor of P, -.");
      prm.leave_subsection();
    }

    void Matrices::check() const
    {
      if (mass.empty())
        throw InputError("Matrices/Mass: the scene matrices needs the file of the mass matrix.");
      if (stiffness.empty())
        throw InputError("Matrices/Stiffness: the scene matrices needs the file of the stiffness "
                         "matrix.");
    }

    void Output::declare(ParameterHandler &prm)
    {
      prm.enter_subsection("Output");
      prm.add_parameter("Directory", directory,
                        "Where the results go; empty: output/<name of the parameter file>.");
      prm.add_parameter(
          "Fields", fields,
          "Modes written for ParaView. unstable: those not stable, or, if there are none, "
          "the least stable one.",
          Patterns::Selection("none|unstable|all"));
      prm.add_parameter("Animation frames", animation_frames,
                        "Frames over one period of each written mode; 0: no animation.",
                        Patterns::Integer(0, 1000));
      prm.add_parameter("Sensitivities", sensitivities,
                        "Whether sensitivities.csv tells how each eigenvalue depends on each "
                        "parameter.");
      prm.leave_subsection();
    }

    const std::vector<std::string> stage_names = {"elastic", "transport", "friction",
                                                  "friction_damping", "full"};

    void All::declare(ParameterHandler &prm)
    {
      prm.add_parameter(
          "Scene", scene,
          "brake: annular rotor and sector pads. strip: two-dimensional, a layer moving under a "
          "block (plane strain). mesh: bodies of a mesh file. matrices: Matrix Market files.",
          Patterns::Selection("brake|strip|mesh|matrices"));
      prm.add_parameter(
          "Stage", stage_name,
          "What the model contains. elastic: M, K. transport: and G, M*. friction: and "
          "mu T. friction_damping: and P_R, Q_R. full: and material damping. ladder: all of them "
          "one "
          "after the other, side by side.",
          Patterns::Selection("elastic|transport|friction|friction_damping|full|ladder"));
      rotor.declare(prm);
      pads.declare(prm);
      strip.declare(prm);
      mesh.declare(prm);
      operation.declare(prm);
      contact.declare(prm);
      discretization.declare(prm);
      refinement.declare(prm);
      static_equilibrium.declare(prm);
      eigenproblem.declare(prm);
      prestress.declare(prm);
      sweep.declare(prm);
      matrices.declare(prm);
      output.declare(prm);
    }

    Stage All::stage() const
    {
      // The ladder ends at the top, and what is checked is checked for that.
      const auto at = std::find(stage_names.begin(), stage_names.end(), stage_name);
      return at == stage_names.end() ? Stage::full : Stage(at - stage_names.begin());
    }

    std::vector<BodyMaterial> All::materials() const
    {
      std::vector<BodyMaterial> result = {{"Rotor", true, rotor.material, mesh.rotor},
                                          {"Pads", false, pads.material, mesh.pads}};
      for (unsigned int k = 0; k < mesh.parts.size() && scene == "mesh"; ++k)
        if (const MeshPart &part = mesh.parts[k]; !part.volumes.empty())
          result.push_back({"Mesh/Part " + std::to_string(k + 1), part.body == "rotor",
                            part.material, part.volumes});
      return result;
    }

    MaterialSection &All::material(const std::string &section)
    {
      return section == "Rotor"  ? rotor.material
             : section == "Pads" ? pads.material
                                 : mesh.parts[section.back() - '1'].material;
    }

    void All::check()
    {
      sweep.check();
      eigenproblem.check();
      if (eigenproblem.is_matrix_free())
        check_matrix_free();
      if (sweep.active() && eigenproblem.minimum_frequency > 0)
        fail("Eigenproblem/Minimum frequency", eigenproblem.minimum_frequency,
             "sweeps and maps follow all modes from zero on; allowed with Sweep/Parameter is 0.");
      refinement.check();
      if (!refinement.reference.empty() &&
          (sweep.active() || stage_name == "ladder" || scene == "matrices"))
        throw InputError("Refinement/Reference = " + refinement.reference +
                         ": the modes of one scene with a mesh are compared; not in a sweep, in "
                         "Stage = ladder or in Scene = matrices.");
      if (refinement.strategy == "adaptive" && !eigenproblem.error_bars)
        throw InputError(
            "Refinement/Strategy = adaptive: it needs Eigenproblem/Error bars = true.");
      if (!eigenproblem.is_solved() && (sweep.active() || stage_name == "ladder" ||
                                        scene == "matrices" || refinement.strategy == "adaptive"))
        throw InputError("Eigenproblem/Solver = none: sweeps, Stage = ladder, Scene = matrices and "
                         "Refinement/Strategy = adaptive need modes.");
      if (stage_name == "ladder" &&
          (sweep.active() || refinement.n_cycles() > 1 || scene == "matrices"))
        throw InputError(
            "Stage = ladder: it climbs on one mesh of the scenes brake, strip and mesh, without a "
            "sweep.");
      if (sweep.active() && refinement.n_cycles() > 1)
        for (const std::string &parameter : {sweep.parameter, sweep.second_parameter})
          if (parameter != "none" && !Sweep::keeps_mesh(parameter))
            throw InputError("Refinement/Strategy = " + refinement.strategy + ": a sweep over " +
                             parameter + " makes a mesh for each value; allowed is none.");
      if (scene == "matrices")
      {
        matrices.check();
        return;
      }
      discretization.check();
      if (scene == "strip")
      {
        strip.check();
        position_expression<2>(pads.profile, "Pads/Pressure profile");
        position_expression<2>(contact.initial_gap, "Contact/Initial gap");
      }
      else
      {
        if (scene == "mesh")
          mesh.check();
        else
        {
          rotor.check();
          pads.check(rotor);
        }
        position_expression<3>(pads.profile, "Pads/Pressure profile");
        position_expression<3>(contact.initial_gap, "Contact/Initial gap");
      }
      for (const BodyMaterial &body : materials())
        if (body.of_rotor || n_pads() > 0)
          body.material.check(body.section);
      if (n_pads() > 0)
        contact.check(stage(), operation.angular_velocity);
      if (prestress.needs_state() && n_pads() > 0 && contact.steady_pressure != "computed")
        throw InputError("Contact/Steady pressure = " + contact.steady_pressure +
                         ": Prestress/Centrifugal load and Prestress/Stress stiffness need the "
                         "static equilibrium; allowed is computed.");
      if (prestress.centrifugal_load && scene == "strip")
        throw InputError(
            "Prestress/Centrifugal load = true: the layer of the scene strip does not turn.");
      if (prestress.centrifugal_load && !terms().transport)
        throw InputError("Prestress/Centrifugal load = true: Stage = " + stage_name +
                         " is at rest; allowed are transport and the stages after it.");
      if (scene == "brake" && rotor.clamped == "none" && terms().transport &&
          operation.angular_velocity != 0)
        throw InputError(
            "Rotor/Clamped boundary = none: the rigid-body motions of a free rotor that "
            "turns need its centrifugal stress, without which they seem to diverge. "
            "Allowed are inner and outer, Stage = elastic, or Operation/Angular "
            "velocity = 0.");
      if (prestress.centrifugal_load && scene == "brake" && rotor.clamped == "none")
        throw InputError("Prestress/Centrifugal load = true: a rotor with Rotor/Clamped boundary = "
                         "none has no static equilibrium; allowed are inner and outer.");
    }
  } // namespace Parameters
} // namespace squeal
