#include <squeal/parameters/declare.h>
#include <squeal/parameters/entries.h>
#include <squeal/parameters/expressions.h>
#include <squeal/parameters/modulus_table.h>
#include <squeal/parameters/parameters.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <tuple>

// The sections that have no file of their own, in the order of the parameter file: keys by
// declare(), rules of a section by check(). At the end Parameters::All: its sections, what a stage
// has, and the rules across sections.

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
      const Subsection section(prm, "Rotor");
      prm.add_parameter("Inner radius", inner_radius, "Inner radius of the annular disc, m.",
                        positive());
      prm.add_parameter("Outer radius", outer_radius, "Outer radius of the annular disc, m.",
                        positive());
      prm.add_parameter("Thickness", thickness, "Thickness of the disc, m. Its mid-plane is z = 0.",
                        positive());
      add_choice(prm, "Clamped boundary", clamped,
                 "The cylinder on which all displacements are zero.");
      add_choice(
          prm, "Transport", transport,
          "Whether turning carries the rotor's deformation through the mesh. full: the rotor "
          "must be a body of revolution. none: friction slides with Angular velocity, but "
          "G, M*, Q_R and what they split are neglected; for vented and bolted discs.");
      material.declare(prm);
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
      const Subsection section(prm, "Pads");
      add_choice(prm, "Arrangement", arrangement,
                 "Which pads there are: on both faces of the rotor, on the upper one, none.");
      prm.add_parameter("Inner radius", inner_radius, "Inner radius of the pad's sector, m.",
                        positive());
      prm.add_parameter("Outer radius", outer_radius, "Outer radius of the pad's sector, m.",
                        positive());
      prm.add_parameter("Sector angle", sector_angle,
                        "Angle of the pad's sector, degrees, centred on phi = 0.",
                        Patterns::Double(smallest, 350));
      prm.add_parameter("Thickness", thickness, "Thickness of a pad, m.", positive());
      add_choice(prm, "Back face", back_face,
                 "Support of the pad's back face. guided: in-plane fixed, axial free.");
      prm.add_parameter("Pressure", pressure,
                        "Pressure on the pad's back face, towards the rotor, Pa.", not_negative());
      prm.add_parameter(
          "Pressure profile", profile,
          "Factor on the pressure, an expression of the position x, y, z in m; for example "
          "1 + 20*y presses one end of the pad more.");
      material.declare(prm);
    }

    void Pads::check(const Rotor &rotor) const
    {
      if (n_pads() == 0)
        return;
      if (inner_radius >= outer_radius)
        fail("Pads/Inner radius", inner_radius,
             "it must be smaller than Pads/Outer radius = " + std::to_string(outer_radius) + " m.");
      if (inner_radius < rotor.inner_radius || outer_radius > rotor.outer_radius)
        throw InputError(text_of("Pads/Inner radius = ", inner_radius, ", Pads/Outer radius = ",
                                 outer_radius, ": the pads must lie on the rotor, whose radii are ",
                                 rotor.inner_radius, " to ", rotor.outer_radius, " m."));
    }

    void Operation::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Operation");
      prm.add_parameter(
          "Angular velocity", angular_velocity,
          "Angular velocity Omega of the rotor about +z, rad/s (strip: belt speed, m/s).");
      add_choice(prm, "Direction at rest", direction_at_rest,
                 "The direction of sliding where Angular velocity is 0, the limit of slow turning "
                 "about +z or -z. Elsewhere the sign of Angular velocity is the direction.");
      prm.add_parameter("Temperature", temperature,
                        "Degrees Celsius. Used by tables of moduli (Material/Modulus table) that "
                        "have a column temperature_c.",
                        Patterns::Double());
    }

    void Contact::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Contact");
      add_choice(
          prm, "Formulation", formulation,
          "mortar: Lagrange multiplier on the pad's face. penalty: pressure = stiffness times "
          "penetration in every point; on faces whose meshes do not match it locks if it is stiff. "
          "mortar_penalty: the same relation weakly, for the multiplier: tends to mortar on any "
          "mesh.");
      prm.add_parameter(
          "Penalty stiffness", penalty_stiffness,
          "Contact stiffness k_C, N/m^3. Used by the formulations penalty and mortar_penalty.",
          positive());
      prm.add_parameter("Normal dashpot", normal_dashpot,
                        "Damping c_n of the closed contact against approach, N s/m^3. Used in the "
                        "stage full, by the formulations penalty and mortar_penalty: that of "
                        "mortar does not give way.",
                        not_negative());
      prm.add_parameter("Tangential dashpot", tangential_dashpot,
                        "Damping c_t of the closed contact against changes of the sliding "
                        "velocity, N s/m^3, but for what turning carries along. Used in the stage "
                        "full.",
                        not_negative());
      add_choice(prm, "Steady pressure", steady_pressure,
                 "The pressure p_0 about which friction is linearised. computed: from the static "
                 "equilibrium. uniform: the applied pressure. worn: that of pads bedded in by "
                 "Contact/Wear.");
      prm.add_parameter(
          "Initial gap", initial_gap,
          "Distance g_0 >= 0 of the unloaded surfaces, an expression of the position x, y, z "
          "in m. Used with Steady pressure = computed.");
      prm.add_parameter("Self-locking check", self_locking_check,
                        "Whether it is computed, at the cost of one factorisation for each mesh, "
                        "how much friction "
                        "amplifies the contact pressure that causes it.");
      friction.declare(prm);
      wear.declare(prm);
      const Subsection of_friction(prm, "Friction");
      prm.add_parameter(
          "Of pads", friction_of_pads,
          "Pads whose friction differs: pad : key value; key value, and so on, with keys of this "
          "section. What is not given is that of the section. Pads are named as in static.csv.");
    }

    bool Contact::is_smoothed() const
    {
      bool all = friction.smoothing_speed > 0;
      for (const auto &[pad, law] : friction_by_pad())
        all = all && law.smoothing_speed > 0;
      return all;
    }

    std::vector<std::pair<std::string, FrictionLaw>> Contact::friction_by_pad() const
    {
      using dealii::Utilities::split_string_list;
      const std::string key = "Contact/Friction/Of pads";
      std::vector<std::pair<std::string, FrictionLaw>> result;
      for (const std::string &entry : friction_of_pads.empty()
                                          ? std::vector<std::string>()
                                          : split_string_list(friction_of_pads, ','))
      {
        const std::size_t colon = entry.find(':');
        const auto wrong        = [&](const std::string &what)
        {
          throw InputError(key + " = " + friction_of_pads + ": '" + entry + "' " + what +
                           ". Wanted is pad : key value; key value, with keys and values of the "
                           "section Contact/Friction.");
        };
        if (colon == std::string::npos)
          wrong("has no colon");
        FrictionLaw law = friction;
        ParameterHandler handler;
        law.declare(handler);
        handler.enter_subsection("Friction");
        for (const std::string &setting : split_string_list(entry.substr(colon + 1), ';'))
        {
          const std::size_t blank = setting.rfind(' ');
          try
          {
            if (blank == std::string::npos)
              wrong("has '" + setting + "' without a value");
            handler.set(dealii::Utilities::trim(setting.substr(0, blank)),
                        setting.substr(blank + 1));
          }
          catch (const dealii::ExceptionBase &)
          {
            wrong("has '" + setting + "', which is no key with a value that it may have");
          }
        }
        handler.leave_subsection();
        law.check();
        result.emplace_back(dealii::Utilities::trim(entry.substr(0, colon)), law);
      }
      return result;
    }

    void Contact::check(const Stage stage, const double angular_velocity)
    {
      if (normal_dashpot > 0 && formulation == Formulation::mortar)
        fail("Contact/Normal dashpot", normal_dashpot,
             "closed surfaces do not approach with Contact/Formulation = mortar; allowed are "
             "penalty and mortar_penalty, or 0.");
      wear.distance();
      friction.check();
      if (angular_velocity == 0 && terms_of(stage).friction_damping && !is_smoothed())
        fail("Operation/Angular velocity", angular_velocity,
             "the friction damping of the stages friction_damping and full grows like 1/Omega "
             "and has no value at rest. Choose a speed other than 0, one of the stages elastic, "
             "transport, friction, or a Contact/Friction/Smoothing speed.");
    }

    void Strip::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Strip");
      prm.add_parameter("Length", length, "Period of the layer in x, m.", positive());
      prm.add_parameter("Thickness", thickness,
                        "Thickness of the layer, m; its lower face is fixed.", positive());
      prm.add_parameter("Block length", block_length, "Length of the block, centred on x = 0, m.",
                        positive());
      prm.add_parameter("Block thickness", block_thickness, "Thickness of the block, m.",
                        positive());
    }

    void Strip::check() const
    {
      if (block_length >= length)
        fail("Strip/Block length", block_length,
             "it must be shorter than Strip/Length = " + std::to_string(length) + " m.");
    }

    void Discretization::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Discretization");
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
          throw InputError(text_of("Discretization/", key, " cells = ", *text, " of Degree ",
                                   degree, ": a coarse mesh of ", n_cells, " cells and about ",
                                   n_unknowns, " unknowns; allowed are ", most_cells, " cells and ",
                                   most_unknowns, " unknowns."));
      }
    }

    void Prestress::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Prestress");
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
    }

    void Matrices::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Matrices");
      prm.add_parameter("Mass", mass, "Matrix Market file of M. Required by the scene matrices.");
      prm.add_parameter("Velocity", velocity, "Matrix Market file of P; empty: zero.");
      prm.add_parameter("Stiffness", stiffness,
                        "Matrix Market file of K. Required by the scene matrices.");
      prm.add_parameter("Circulatory", circulatory,
                        "Matrix Market file of N in K + p N; empty: zero.");
      prm.add_parameter("Circulatory factor", circulatory_factor, "The factor p in K + p N, -.");
      prm.add_parameter("Velocity factor", velocity_factor, "A factor of P, -.");
      for (unsigned int k = 0; k < viscoelastic.size(); ++k)
      {
        const Subsection of_one(prm, "Viscoelastic " + std::to_string(k + 1));
        prm.add_parameter("Stiffness", viscoelastic[k].stiffness,
                          "Matrix Market file of A in K + f(l) c A, a relaxed stiffness; empty: "
                          "there is none.");
        prm.add_parameter("Factor", viscoelastic[k].factor, "The factor c of A.");
        Parameters::declare(prm, viscoelastic[k].stiffness_factor);
      }
    }

    void Matrices::check() const
    {
      if (mass.empty())
        throw InputError("Matrices/Mass: the scene matrices needs the file of the mass matrix.");
      if (stiffness.empty())
        throw InputError("Matrices/Stiffness: the scene matrices needs the file of the stiffness "
                         "matrix.");
      for (unsigned int k = 0; k < viscoelastic.size(); ++k)
      {
        const std::string section = "Matrices/Viscoelastic " + std::to_string(k + 1);
        Parameters::check(section, viscoelastic[k].stiffness_factor);
        if (viscoelastic[k].stiffness.empty() && viscoelastic[k].stiffness_factor.is_active())
          throw InputError(section + "/Stiffness: its damping needs the file of a matrix.");
      }
    }

    void Output::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Output");
      prm.add_parameter("Directory", directory,
                        "Where the results go; empty: output/<name of the parameter file>.");
      add_choice(prm, "Fields", fields,
                 "Modes written for ParaView. unstable: those not stable, or, if there are none, "
                 "the least stable one.");
      prm.add_parameter(
          "Animation frames", animation_frames,
          "Frames over one period of the modes that grow and the least stable one, with "
          "Fields = all of each, in the directory frames; 0: no animation.",
          Patterns::Integer(0, 1000));
      prm.add_parameter("Sensitivities", sensitivities,
                        "Whether sensitivities.csv tells how each eigenvalue depends on each "
                        "parameter.");
      prm.add_parameter("Matrices", matrices,
                        "Whether the matrices of (l^2 M + l P + Q) x = 0 on the last mesh, their "
                        "terms, tables of the unknowns and the modes are written as Matrix Market "
                        "and CSV files.");
      prm.add_parameter("Superelement", superelement,
                        "A body that is written as a superelement, and the surface groups on which "
                        "it hangs on others: body : surface [: surface ...]. The body neither "
                        "turns nor touches the rotor. The files superelement-K.mtx, -M.mtx, -D.mtx "
                        "and -nodes.csv are what Joints/Superelements reads.");
      prm.add_parameter("Superelement modes", superelement_modes,
                        "The number of its modes with the surfaces held, the lowest, that go with "
                        "the displacements of the surfaces.",
                        Patterns::Integer(0, 100000));
      prm.add_parameter("Superelement frequency", superelement_frequency,
                        "Those above it are left out, Hz; 0: no limit.", not_negative());
    }

    void All::declare(ParameterHandler &prm)
    {
      add_choice(
          prm, "Scene", scene,
          "brake: annular rotor and sector pads. strip: two-dimensional, a layer moving under a "
          "block (plane strain). mesh: bodies of a mesh file. matrices: Matrix Market files.");
      add_choice(
          prm, "Stage", stage,
          "What the model contains. elastic: M, K. transport: and G, M*. friction: and mu T. "
          "friction_damping: and P_R, Q_R. full: and material damping. ladder: all of them one "
          "after the other, side by side.");
      rotor.declare(prm);
      pads.declare(prm);
      strip.declare(prm);
      mesh.declare(prm);
      joints.declare(prm);
      operation.declare(prm);
      modal_damping.declare(prm);
      contact.declare(prm);
      discretization.declare(prm);
      refinement.declare(prm);
      static_equilibrium.declare(prm);
      eigenproblem.declare(prm);
      prestress.declare(prm);
      sweep.declare(prm);
      sampling.declare(prm);
      response.declare(prm);
      matrices.declare(prm);
      output.declare(prm);
    }

    std::vector<BodyMaterial> All::materials() const
    {
      std::vector<BodyMaterial> result = {{"Rotor", true, rotor.material, mesh.rotor},
                                          {"Pads", false, pads.material, mesh.pads}};
      for (unsigned int k = 0; k < mesh.parts.size() && scene == Scene::mesh; ++k)
        if (const MeshPart &part = mesh.parts[k]; !part.volumes.empty())
          result.push_back({"Mesh/Part " + std::to_string(k + 1), part.body == PartOf::rotor,
                            part.material, part.volumes});
      return result;
    }

    MaterialSection &All::material(const std::string &section)
    {
      return section == "Rotor" ? rotor.material
             : section == "Pads"
                 ? pads.material
                 : mesh.parts[std::stoul(section.substr(std::string("Mesh/Part ").size())) - 1]
                       .material;
    }

    bool All::has_relaxation() const
    {
      if (scene == Scene::matrices)
        return modal_damping.is_active() ||
               std::any_of(matrices.viscoelastic.begin(), matrices.viscoelastic.end(),
                           [](const Matrices::Viscoelastic &matrix)
                           { return matrix.stiffness_factor.is_active(); });
      if (!has_damping())
        return false;
      const std::vector<BodyMaterial> all = materials();
      return modal_damping.is_active() ||
             std::any_of(all.begin(), all.end(),
                         [this](const BodyMaterial &body)
                         { return is_used(body) && body.material.stiffness_factor.is_active(); });
    }

    bool All::is_used(const BodyMaterial &body) const
    {
      return body.of_rotor || n_pads() > 0 || joints.active() ||
             (scene == Scene::mesh && !body.volumes.empty()); // a part alone
    }

    void All::fit_modulus_tables()
    {
      for (const BodyMaterial &body : materials())
      {
        MaterialSection &section     = material(body.section);
        section.stiffness_factor.fit = {};
        if (section.modulus_table.empty() || scene == Scene::matrices || !has_damping() ||
            !is_used(body))
          continue;
        if (!section.stiffness_factor.prony.empty() || section.stiffness_factor.zener.ratio != 1)
          throw InputError(body.section + "/Material/Modulus table = " + section.modulus_table +
                           ": it stands in place of Prony series and Fractional Zener; allowed is "
                           "one of them.");
        section.stiffness_factor.fit =
            fit_modulus_table({body.section + "/Material/Modulus table = " + section.modulus_table,
                               section.modulus_table, section.young_modulus, operation.temperature,
                               eigenproblem.minimum_frequency, eigenproblem.maximum_frequency});
      }
    }

    void All::check_relaxation() const
    {
      const auto refuse = [](const bool given, const std::string &what)
      {
        if (given)
          throw InputError("Loss factor, Prony series, Fractional Zener, Modal damping: " + what);
      };
      refuse(eigenproblem.solver == ModeSolver::krylov || eigenproblem.is_matrix_free(),
             "Eigenproblem/Solver = " + name_of(eigenproblem.solver) +
                 " finds no modes with them; allowed are block_krylov and dense.");
      refuse(eigenproblem.solver == ModeSolver::block_krylov &&
                 eigenproblem.minimum_frequency > 0 &&
                 eigenproblem.minimum_frequency >= far_from_zero * eigenproblem.maximum_frequency,
             text_of("Eigenproblem/Minimum frequency = ", eigenproblem.minimum_frequency,
                     ": with them allowed are those below ", far_from_zero, " Maximum frequency."));
      refuse(!output.superelement.empty(),
             "Output/Superelement: its files do not hold them; allowed is none.");
    }

    namespace
    {
      /// Refuses a key for runs with several values or stages. @p results: what there would be.
      void need_one_result(const All &all, const std::string &key, const std::string &results)
      {
        const auto refuse = [&](const std::string &what, const std::string &each)
        {
          throw InputError(key + ": with " + what + " there would be " + results + " for each " +
                           each + ". Run the " + each + " that is wanted by itself.");
        };
        if (all.varies_parameters())
          refuse(all.sweep.active() ? "Sweep/Parameter = " + all.sweep.parameter
                                    : "the section Sampling",
                 "value");
        if (all.stage == Stage::ladder)
          refuse("Stage = ladder", "stage");
      }
    } // namespace

    void All::check_export() const
    {
      const std::string key = output.matrices ? "Output/Matrices = true"
                                              : "Output/Superelement = " + output.superelement;
      if (!output.superelement.empty())
      {
        output.superelement_of();
        if (scene != Scene::mesh)
          throw InputError("Output/Superelement: allowed with Scene = mesh only.");
      }
      need_one_result(*this, key, "matrices");
      if (!eigenproblem.is_solved() || eigenproblem.is_matrix_free())
        throw InputError(key + ": with Eigenproblem/Solver = " + name_of(eigenproblem.solver) +
                         " there are no matrices; allowed are block_krylov, krylov and dense.");
    }

    void All::check_response() const
    {
      response.check(eigenproblem, n_components());
      if (!response.active())
        return;
      const std::string key = "Response/Forces";
      if (scene == Scene::matrices)
        throw InputError(key + ": with Scene = matrices there are no places; export to another "
                               "program instead.");
      need_one_result(*this, key, "a response");
      if (eigenproblem.is_matrix_free())
        throw InputError(key + ": with Eigenproblem/Solver = " + name_of(eigenproblem.solver) +
                         " there are no matrices; allowed are block_krylov, krylov, dense and "
                         "none.");
    }

    void All::check_friction_of_pads() const
    {
      std::vector<std::string> pads_there;
      if (scene == Scene::mesh)
        for (const auto &pair : mesh.pairs())
          pads_there.push_back(pair.first);
      else if (scene == Scene::strip)
        pads_there = {"block"};
      else
        for (const std::string name : {"upper", "lower"})
          if (pads.n_pads() == 2 || name_of(pads.arrangement) == name)
            pads_there.push_back(name);
      std::vector<std::string> named;
      for (const auto &[pad, law] : contact.friction_by_pad())
      {
        if (std::count(pads_there.begin(), pads_there.end(), pad) == 0)
        {
          std::string allowed;
          for (const std::string &name : pads_there)
            allowed += (allowed.empty() ? "" : ", ") + name;
          throw InputError("Contact/Friction/Of pads: there is no pad '" + pad + "'; allowed are " +
                           allowed + ".");
        }
        if (std::count(named.begin(), named.end(), pad) > 0)
          throw InputError("Contact/Friction/Of pads: the pad '" + pad + "' is named twice.");
        named.push_back(pad);
      }
    }

    void All::check()
    {
      sweep.check();
      sampling.check();
      if (sweep.active() && sampling.active())
        throw InputError(
            "Sampling/Parameters: allowed without a sweep only, with Sweep/Parameter = none.");
      eigenproblem.check();
      if (eigenproblem.is_matrix_free())
        check_matrix_free();
      if (varies_parameters() && eigenproblem.minimum_frequency > 0)
        fail("Eigenproblem/Minimum frequency", eigenproblem.minimum_frequency,
             "sweeps, maps and samples follow all modes from zero on; allowed with them is 0.");
      refinement.check();
      if (output.matrices || !output.superelement.empty())
        check_export();
      check_response();
      if (!refinement.reference.empty() &&
          (varies_parameters() || stage == Stage::ladder || scene == Scene::matrices))
        throw InputError(
            "Refinement/Reference = " + refinement.reference +
            ": the modes of one scene with a mesh are compared; not in a sweep or of samples, in "
            "Stage = ladder or in Scene = matrices.");
      if (refinement.edge_levels > 0)
        check_edge_levels();
      if (refinement.strategy == Strategy::adaptive && !eigenproblem.error_bars)
        throw InputError(
            "Refinement/Strategy = adaptive: it needs Eigenproblem/Error bars = true.");
      if (!eigenproblem.is_solved() &&
          (varies_parameters() || stage == Stage::ladder || scene == Scene::matrices ||
           refinement.strategy == Strategy::adaptive))
        throw InputError("Eigenproblem/Solver = none: sweeps, Stage = ladder, Scene = matrices and "
                         "Refinement/Strategy = adaptive need modes.");
      if (stage == Stage::ladder &&
          (varies_parameters() || refinement.n_cycles() > 1 || scene == Scene::matrices))
        throw InputError(
            "Stage = ladder: it climbs on one mesh of the scenes brake, strip and mesh, without a "
            "sweep.");
      if (sweep.active() && refinement.n_cycles() > 1)
        for (const std::string &parameter : {sweep.parameter, sweep.second_parameter})
          if (parameter != Sweep::nothing && !Sweep::keeps_mesh(parameter))
            throw InputError("Refinement/Strategy = " + name_of(refinement.strategy) +
                             ": a sweep over " + parameter +
                             " makes a mesh for each value; allowed is none.");
      if (joints.active() || !joints.masses.empty() || !joints.springs.empty() ||
          !joints.dashpots.empty() || !joints.links.empty())
        check_joints();
      fit_modulus_tables();
      modal_damping.check();
      if (has_relaxation())
        check_relaxation();
      if (scene == Scene::matrices)
      {
        matrices.check();
        return;
      }
      discretization.check();
      if (scene == Scene::strip)
      {
        strip.check();
        position_expression<2>(pads.profile, "Pads/Pressure profile");
        position_expression<2>(contact.initial_gap, "Contact/Initial gap");
      }
      else
      {
        if (scene == Scene::mesh)
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
        if (is_used(body))
        {
          body.material.check(body.section);
          if (body.of_rotor && scene != Scene::strip && body.material.axis != 2)
            fail(body.section + "/Material/Axis", std::string(1, "xy"[body.material.axis]),
                 "what turns looks the same from all sides about z; allowed is z.");
        }
      if (has_contact())
      {
        contact.check(stage, operation.angular_velocity);
        check_friction_of_pads();
        if (n_pads() > 0 && contact.steady_pressure == SteadyPressure::uniform &&
            to_number(pads.profile) != 1.)
          throw InputError("Pads/Pressure profile = " + pads.profile +
                           ": Contact/Steady pressure = uniform takes Pads/Pressure itself for the "
                           "contact pressure; allowed are computed and worn, or the profile 1.");
        if (n_pads() > 0 && contact.steady_pressure == SteadyPressure::uniform &&
            scene == Scene::mesh && !mesh.surface_pressures.empty())
          throw InputError(
              "Mesh/Pressures = " + mesh.pressures +
              ": Contact/Steady pressure = uniform takes Pads/Pressure for the contact "
              "pressure; allowed are computed and worn.");
        if (contact.is_worn())
          check_wear();
      }
      if (prestress.needs_state() && has_contact() && !contact.computes_pressure())
        throw InputError("Contact/Steady pressure = " + name_of(contact.steady_pressure) +
                         ": Prestress/Centrifugal load and Prestress/Stress stiffness need the "
                         "static equilibrium; allowed is computed.");
      if (prestress.centrifugal_load && scene == Scene::strip)
        throw InputError(
            "Prestress/Centrifugal load = true: the layer of the scene strip does not turn.");
      if (prestress.centrifugal_load && !turns())
        throw InputError("Prestress/Centrifugal load = true: Stage = " + name_of(stage) +
                         " is at rest; allowed are transport and the stages after it.");
      if (scene == Scene::brake && rotor.clamped == Clamped::none && terms().transport &&
          operation.angular_velocity != 0)
        throw InputError(
            "Rotor/Clamped boundary = none: the rigid-body motions of a free rotor that "
            "turns need its centrifugal stress, without which they seem to diverge. "
            "Allowed are inner and outer, Stage = elastic, or Operation/Angular "
            "velocity = 0.");
      if (prestress.centrifugal_load && scene == Scene::brake && rotor.clamped == Clamped::none)
        throw InputError("Prestress/Centrifugal load = true: a rotor with Rotor/Clamped boundary = "
                         "none has no static equilibrium; allowed are inner and outer.");
    }
  } // namespace Parameters
} // namespace squeal
