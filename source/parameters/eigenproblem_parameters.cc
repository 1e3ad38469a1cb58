#include <squeal/parameters/declare.h>
#include <squeal/parameters/parameters.h>

namespace squeal
{
  namespace Parameters
  {

    void Eigenproblem::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Eigenproblem");
      prm.add_parameter(
          "Maximum frequency", maximum_frequency,
          "Every mode with 0 < |Im lambda|/(2 pi) up to this frequency is wanted, Hz.",
          Patterns::Double(smallest));
      prm.add_parameter("Minimum frequency", minimum_frequency,
                        "0, or the lower end of the window: only modes from this frequency up to "
                        "Maximum frequency are wanted, Hz. A window far from zero, from 3/4 of "
                        "Maximum frequency on, does not pay for the modes below it (solver "
                        "block_krylov). It says nothing about divergence. Not in sweeps.",
                        Patterns::Double(0));
      add_choice(
          prm, "Solver", solver,
          "block_krylov: block second-order Arnoldi, shift-invert with MUMPS on blocks of "
          "right-hand sides. krylov: SLEPc's PEP (TOAR) with the same factorisation, one vector "
          "at a time: slower, an independent check. dense: LAPACK, for small problems. "
          "block_davidson: without factors, for models whose factors do not fit: modes of "
          "elements of one degree less, found by block_krylov, are corrected with multigrid. "
          "none: the run ends with the static equilibrium.");
      prm.add_parameter("Tolerance", tolerance,
                        "Backward error that every reported mode reaches, -; with block_davidson "
                        "the estimated relative error of every eigenvalue.",
                        Patterns::Double(1e-15, 1e-2));
      prm.add_parameter(
          "Shift", shift,
          "Real shift of the shift-invert transform relative to 2 pi times Maximum "
          "frequency, -. 0: chosen by the program (nonzero only where a body is free to "
          "move as a rigid body).",
          Patterns::Double(0, 1));
      prm.add_parameter("Error bars", error_bars,
                        "Estimate what the mesh does to every growth rate and frequency (scenes "
                        "with a mesh). Without, verdicts trust the mesh.",
                        Patterns::Bool());
      prm.add_parameter(
          "Mirror symmetry", mirror_symmetry,
          "Where the brake is its own mirror image about the rotor's mid-plane, solve for "
          "symmetric and antisymmetric modes one after the other, and for the "
          "symmetric half of the static equilibrium: faster, and less memory. Other brakes are "
          "solved as a whole.",
          Patterns::Bool());
    }

    void StaticEquilibrium::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Static equilibrium");
      add_choice(
          prm, "Linear solver", linear_solver,
          "How the steady sliding state is solved for. direct: LU by MUMPS. iterative: GMRES "
          "with multigrid, for models whose factors do not fit. auto: iterative with "
          "Eigenproblem/Solver = block_davidson, and where modes are not asked for and the "
          "expected factors do not fit, else direct.");
      add_choice(
          prm, "Multigrid", multigrid,
          "Algebraic multigrid of the iterative solver, on the displacements of degree 1. gamg: of "
          "PETSc. ml: of Trilinos. boomeramg: of hypre.");
      prm.add_parameter("Maximum iterations", maximum_iterations,
                        "Steps of GMRES for one linear problem of the iterative solver, -; more "
                        "are an error.",
                        Patterns::Integer(1, 10000));
    }

    void Eigenproblem::check() const
    {
      if (minimum_frequency >= maximum_frequency)
        fail("Eigenproblem/Minimum frequency", minimum_frequency,
             "it must be below Maximum frequency.");
    }

    void All::check_matrix_free() const
    {
      const auto refuse = [](const bool given, const std::string &why)
      {
        if (given)
          throw InputError("Eigenproblem/Solver = block_davidson: " + why);
      };
      refuse(scene == Scene::matrices || varies_parameters() || stage == Stage::ladder,
             "Scene = matrices, sweeps, samples and Stage = ladder need block_krylov, krylov or "
             "dense.");
      refuse(discretization.degree < 2,
             "it begins with one degree less; allowed for Discretization/Degree are 2 and more.");
      refuse(eigenproblem.minimum_frequency > 0,
             "it finds all from zero on; allowed for Eigenproblem/Minimum frequency is 0.");
      refuse(output.sensitivities || contact.self_locking_check,
             "Output/Sensitivities and Contact/Self-locking check need factors; allowed is false.");
      refuse(static_equilibrium.linear_solver == LinearSolver::direct,
             "without matrices allowed for Static equilibrium/Linear solver are iterative and "
             "auto.");
      for (const BodyMaterial &body : materials())
        refuse(has_damping() && is_used(body) && body.material.viscosity.is_active(),
               body.section + "/Material has a viscosity; it needs block_krylov, krylov or dense.");
    }
  } // namespace Parameters
} // namespace squeal
