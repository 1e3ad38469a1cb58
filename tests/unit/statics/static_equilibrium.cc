#include "statics.h"
#include <squeal/contact/contact_forces.h>

#include <doctest/doctest.h>
namespace squeal::tests::static_equilibrium_tests
{
  using namespace dealii;

  TEST_CASE("static_equilibrium: a pad on a rigid rotor, meshes that do not match")
  {
    // The rotor's top is fixed, the pad is pressed by p: uniaxial stress -p, contact pressure p
    // everywhere, u_z = -p (z - h/2)/E_pad, for penalty and another -p/k_C.
    for (const bool mortar : {true, false})
      for (const unsigned int degree : {1u, 2u})
      {
        CAPTURE(mortar);
        CAPTURE(degree);
        Parameters::All prm;
        prm.rotor.clamped              = Clamped::none;
        prm.pads.arrangement           = Arrangement::upper;
        prm.pads.pressure              = p;
        prm.discretization.rotor_cells = {{2, 16, 1}};
        prm.discretization.pad_cells   = {{3, 5, 2}};
        Geometry<3> geometry           = make_brake(prm);
        geometry.supports.push_back({geometry.boundaries.at("rotor.top"), {{true, true, true}}});
        FiniteElementSpace<3> spaces(geometry, degree, mortar, MPI_COMM_WORLD);
        spaces.distribute();
        ContactModel<3> model;
        model.mortar            = mortar;
        model.penalty_stiffness = k_C;
        const Result<3> result  = solve(spaces, model, false, {upper_pad_body});

        const double approach = mortar ? 0 : p / k_C;
        CHECK(deviation(
                  spaces, result.state, {upper_pad_body},
                  [&](const Point<3> &x) {
                    return Tensor<1, 3>({0., 0., -approach - p * (x[2] - thickness / 2) / E_pad});
                  }) <= 1e-10);
        CHECK(deviation_of_multipliers(spaces, result, p) <= 1e-10);
        CHECK(relative_error(result.resultants[0].max_pressure, p) <= 1e-10);
        CHECK(relative_error(result.resultants[0].normal_force, p * result.resultants[0].area) <=
              1e-10);
        CHECK(result.resultants[0].min_pressure == 0);
        CHECK(relative_error(result.resultants[0].max_penetration, approach,
                             p * thickness / E_pad) <= 1e-10);
      }
  }

  TEST_CASE("static_equilibrium: two elastic blocks with different meshes, pressed together")
  {
    // Two sectors of the same outline, the lower one, the rotor, on a fixed base: stress -p in
    // both, u_z = -p z/E_rotor below and -p h/E_rotor - p (z - h)/E_pad above (with z = 0 the
    // base), minus p/k_C for penalty. The arcs of the outline must be the same polynomials, so the
    // meshes differ along r and z only.
    const Geometry<3> geometry = make_blocks({{3, 4, 2}}, {{2, 4, 1}});
    for (const bool mortar : {true, false})
      for (const unsigned int degree : {1u, 2u, 3u})
      {
        CAPTURE(mortar);
        CAPTURE(degree);
        FiniteElementSpace<3> spaces(geometry, degree, mortar, MPI_COMM_WORLD);
        spaces.distribute();
        ContactModel<3> model;
        model.mortar            = mortar;
        model.penalty_stiffness = k_C;
        const Result<3> result  = solve(spaces, model, false, {upper_pad_body});
        const double approach   = mortar ? 0 : p / k_C;
        CHECK(deviation(spaces, result.state, {rotor_body},
                        [&](const Point<3> &x) {
                          return Tensor<1, 3>({0., 0., -p * x[2] / E_rotor});
                        }) <= 1e-10);
        CHECK(deviation(spaces, result.state, {upper_pad_body},
                        [&](const Point<3> &x)
                        {
                          return Tensor<1, 3>({0., 0.,
                                               -p * thickness / E_rotor - approach -
                                                   p * (x[2] - thickness) / E_pad});
                        }) <= 1e-10);
        CHECK(deviation_of_multipliers(spaces, result, p) <= 1e-10);
        CHECK(relative_error(result.resultants[0].max_pressure, p) <= 1e-10);
      }
  }

  TEST_CASE("static_equilibrium: forces of a sliding brake balance")
  {
    // Guided pads are free along z: whatever the distribution of the pressure, its resultant is p A
    // (A the back face's area, equal to the contact face's), and the friction force mu times that.
    for (const bool mortar : {true, false})
    {
      CAPTURE(mortar);
      Parameters::All prm;
      prm.pads.pressure              = p;
      prm.discretization.rotor_cells = {{2, 12, 1}};
      prm.discretization.pad_cells   = {{2, 3, 1}};
      const Geometry<3> geometry     = make_brake(prm);
      FiniteElementSpace<3> spaces(geometry, 2, mortar, MPI_COMM_WORLD);
      spaces.distribute();
      ContactModel<3> model;
      model.mortar               = mortar;
      model.penalty_stiffness    = k_C;
      model.angular_velocity     = 20;
      model.friction.coefficient = 0.6;
      const Result<3> result     = solve(spaces, model, true, {upper_pad_body, lower_pad_body});
      const double back =
          integrate_boundary(spaces, geometry.boundaries.at("upper_pad.back"),
                             [](const Point<3> &, const Tensor<1, 3> &) { return 1.; });
      for (const ContactResultants &r : result.resultants)
      {
        CHECK(relative_error(r.area, back) <= 1e-12);
        CHECK(relative_error(r.normal_force, p * back) <= 1e-10);
        CHECK(relative_error(r.friction_force, 0.6 * p * back) <= 1e-10);
        CHECK(r.max_pressure > p); // friction tilts the pads: the pressure is not uniform
      }
      // The two pads are mirror images.
      CHECK(relative_error(result.resultants[0].friction_torque,
                           result.resultants[1].friction_torque) <= 1e-10);
      // The lever of the friction lies between the pad's radii.
      for (const ContactResultants &r : result.resultants)
      {
        CHECK(r.friction_torque > 0.09 * r.friction_force);
        CHECK(r.friction_torque < 0.14 * r.friction_force);
      }
    }
  }
} // namespace squeal::tests::static_equilibrium_tests
