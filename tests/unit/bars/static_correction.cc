#include "helpers.h"

#include <squeal/bars/static_correction.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/scenes/make_scene.h>

#include <doctest/doctest.h>

#include <cmath>
namespace squeal::tests::static_correction_tests
{
  namespace
  {
    /// A brake about its static state, whose mode the residuals want only to be there.
    struct Brake
    {
      explicit Brake(const Formulation formulation)
          : prm(parameters(formulation)), model(make_brake(prm), prm, MPI_COMM_WORLD, log, timer)
      {
        model.distribute();
        model.assemble(prm);
        EigensolverOptions options;
        options.max_imaginary = 2 * M_PI * prm.eigenproblem.maximum_frequency;
        modes = make_eigensolver(ModeSolver::krylov)->solve(model.problem(), options).modes;
      }

      static Parameters::All parameters(const Formulation formulation)
      {
        Parameters::All prm;
        prm.discretization.degree          = 2;
        prm.discretization.rotor_cells     = {{2, 12, 1}};
        prm.discretization.pad_cells       = {{2, 4, 1}};
        prm.contact.formulation            = formulation;
        prm.contact.penalty_stiffness      = 1e12;
        prm.contact.steady_pressure        = SteadyPressure::computed;
        prm.contact.friction.coefficient   = 0.02; // it touches everywhere
        prm.eigenproblem.maximum_frequency = 1000;
        return prm;
      }

      const Parameters::All prm;
      Log log{MPI_COMM_WORLD};
      PhaseTimer timer;
      BrakeModel<3> model;
      EigenPairs modes;
    };
  } // namespace

  TEST_CASE("static correction: V_h answers, so that pressures stay in equilibrium with the load")
  {
    for (const Formulation formulation : {Formulation::mortar, Formulation::penalty})
    {
      Brake brake(formulation);
      REQUIRE(!brake.modes.empty());
      const EnrichedResiduals<3> residuals(brake.model, brake.modes);
      const EnrichedSpace<3> &space = residuals.space;
      const MultiVector state       = space.interpolate(brake.model.equilibrium()->state);
      const auto forces_with        = [&](MultiVector change)
      {
        change += state;
        return resultants(*residuals.contact, residuals.contact->pressure_of(change), nullptr);
      };

      // Something that is not smooth, as what one degree more adds
      MultiVector local(space.fine.rows, 1);
      for (unsigned int i = 0; i < local.n_local(); ++i)
        local.data()[i] = 0.1 * (1 + std::sin(1. + i * i)) * state.data()[i];
      const auto before     = forces_with(MultiVector(space.fine.rows, 1)),
                 with_local = forces_with(local),
                 corrected  = forces_with(static_correction(brake.model, residuals, local));
      REQUIRE(before.size() == 2);
      for (unsigned int pad = 0; pad < 2; ++pad)
      {
        const double load = before[pad].normal_force;
        CHECK(std::abs(with_local[pad].normal_force - load) > 1e-2 * load);
        CHECK(std::abs(corrected[pad].normal_force - load) < 2e-4 * load);
      }
    }
  }
} // namespace squeal::tests::static_correction_tests
