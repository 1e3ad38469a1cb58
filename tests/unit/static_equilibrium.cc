#include "fields.h"

#include <doctest/doctest.h>

#include <deal.II/grid/tria.h>

#include <squeal/body_operators.h>
#include <squeal/contact.h>
#include <squeal/static_equilibrium.h>

using namespace dealii;
using namespace squeal;
using namespace squeal::tests;

namespace
{
  const double p = 1e6, thickness = 0.012, E_rotor = 1.25e11, E_pad = 1e10, k_C = 1e12;

  // Without lateral contraction, so that uniaxial stress needs no lateral support.
  const Material rotor_material{E_rotor, 0, 7200, 0, 0}, pad_material{E_pad, 0, 2500, 0, 0};

  struct Result
  {
    Block state;
    double pressure_scale;
    std::vector<ContactResultants> resultants;
  };

  /// As BrakeSqueal does it, with optional friction.
  Result solve(const Spaces<3> &spaces, const ContactModel<3> &model, const bool friction,
               const std::vector<Body> &pads)
  {
    const BodyMatrices rotor = assemble_body(spaces, {rotor_body}, rotor_material, false);
    const BodyMatrices pad   = assemble_body(spaces, pads, pad_material, false);
    Contact<3> contact(spaces, model);
    if (model.mortar)
      contact.scale_constraints(1e11 * contact.normal().infinity_norm());
    // The terms of other orders do not belong to the static state.
    const std::vector<Term> terms = {{Origin::elasticity, 0, 1., rotor.K},
                                     {Origin::elasticity, 0, 1., pad.K},
                                     {Origin::material_damping, 1, 1e3, pad.K},
                                     {Origin::inertia, 2, 1e3, pad.M}};
    StaticEquilibrium equilibrium = solve_static_equilibrium(spaces.rows, terms, contact, friction,
                                                             assemble_pressure_load(spaces));
    Result result{std::move(equilibrium.state), contact.pressure_scale(), {}};
    result.resultants = contact.resultants(equilibrium.pressure, &result.state);
    return result;
  }

  /// The largest deviation of the displacements of some bodies from a field, and of the multipliers
  /// from a constant pressure, relative to the field and the pressure.
  template <typename Field>
  double deviation(const Spaces<3> &spaces, const Result &result, const std::vector<Body> &bodies,
                   const Field &field)
  {
    const Block expected = interpolate(spaces, bodies, field);
    const Block ones     = interpolate(spaces, bodies,
                                       [](const Point<3> &) {
                                     return Tensor<1, 3>({1., 1., 1.});
                                   });
    double largest       = 0;
    for (unsigned int i = 0; i < expected.n_local(); ++i)
      if (ones.column(0)[i] != 0)
        largest = std::max(largest, std::abs(result.state.column(0)[i] - expected.column(0)[i]));
    return Utilities::MPI::max(largest, MPI_COMM_WORLD) / largest_entry(expected);
  }

  double deviation_of_multipliers(const Spaces<3> &spaces, const Result &result,
                                  const double expected)
  {
    double largest = 0;
    for (unsigned int i = spaces.first_local_multiplier - spaces.rows.begin;
         i < spaces.rows.n_local(); ++i)
      largest =
          std::max(largest, std::abs(result.pressure_scale * result.state.column(0)[i] - expected));
    return Utilities::MPI::max(largest, MPI_COMM_WORLD) / expected;
  }

  /// Appends a sector 0.09 < r < 0.14, |phi| < 25 degrees of heights z_0 < z < z_1.
  void append_sector(Geometry<3> &geometry, const Body body,
                     const std::array<unsigned int, 3> &cells, const double z_0, const double z_1)
  {
    const unsigned int first = geometry.vertices.size(), n_r = cells[0] + 1, n_phi = cells[1] + 1;
    for (unsigned int k = 0; k <= cells[2]; ++k)
      for (unsigned int j = 0; j <= cells[1]; ++j)
        for (unsigned int i = 0; i <= cells[0]; ++i)
        {
          const double r   = 0.09 + 0.05 * i / cells[0],
                       phi = (-25 + 50. * j / cells[1]) * M_PI / 180;
          geometry.vertices.emplace_back(r * std::cos(phi), r * std::sin(phi),
                                         z_0 + (z_1 - z_0) * k / cells[2]);
        }
    for (unsigned int k = 0; k < cells[2]; ++k)
      for (unsigned int j = 0; j < cells[1]; ++j)
        for (unsigned int i = 0; i < cells[0]; ++i)
        {
          CellData<3> cell;
          for (unsigned int v = 0; v < 8; ++v)
            cell.vertices[v] = first + (i + v % 2) + n_r * ((j + v / 2 % 2) + n_phi * (k + v / 4));
          cell.material_id = body;
          geometry.cells.push_back(cell);
        }
  }
} // namespace

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
      prm.rotor.clamped              = "none";
      prm.pads.arrangement           = "upper";
      prm.pads.pressure              = p;
      prm.discretization.rotor_cells = {{2, 16, 1}};
      prm.discretization.pad_cells   = {{3, 5, 2}};
      Geometry<3> geometry           = make_brake(prm);
      geometry.supports.push_back({geometry.boundaries.at("rotor.top"), {{true, true, true}}});
      Spaces<3> spaces(geometry, degree, mortar, MPI_COMM_WORLD);
      spaces.distribute();
      ContactModel<3> model;
      model.mortar            = mortar;
      model.penalty_stiffness = k_C;
      const Result result     = solve(spaces, model, false, {upper_pad_body});

      const double approach = mortar ? 0 : p / k_C;
      CHECK(
          deviation(spaces, result, {upper_pad_body},
                    [&](const Point<3> &x) {
                      return Tensor<1, 3>({0., 0., -approach - p * (x[2] - thickness / 2) / E_pad});
                    }) <= 1e-10);
      CHECK(deviation_of_multipliers(spaces, result, p) <= 1e-10);
      CHECK(relative_error(result.resultants[0].max_pressure, p) <= 1e-10);
      CHECK(relative_error(result.resultants[0].normal_force, p * result.resultants[0].area) <=
            1e-10);
      CHECK(result.resultants[0].min_pressure == 0);
      CHECK(relative_error(result.resultants[0].max_penetration, approach, p * thickness / E_pad) <=
            1e-10);
    }
}

TEST_CASE("static_equilibrium: two elastic blocks with different meshes, pressed together")
{
  // Two sectors of the same outline, the lower one, the rotor, on a fixed base: stress -p in both,
  // u_z = -p z/E_rotor below and -p h/E_rotor - p (z - h)/E_pad above (with z = 0 the base), minus
  // p/k_C for penalty. The arcs of the outline must be the same polynomials, so the meshes differ
  // along r and z only.
  Geometry<3> geometry;
  append_sector(geometry, rotor_body, {{3, 4, 2}}, 0, thickness);
  append_sector(geometry, upper_pad_body, {{2, 4, 1}}, thickness, 2 * thickness);
  for (const auto &[body, base, top, side, bottom_z] :
       {std::make_tuple(rotor_body, 1u, 2u, 3u, 0.),
        std::make_tuple(upper_pad_body, 4u, 5u, 6u, thickness)})
  {
    geometry.rules.push_back({body, 2, bottom_z, base});
    geometry.rules.push_back({body, 2, bottom_z + thickness, top});
    for (const double r : {0.09, 0.14})
      geometry.rules.push_back({body, 0, r, side});
    for (const double phi : {-25., 25.})
      geometry.rules.push_back({body, 1, phi * M_PI / 180, side});
  }
  geometry.supports   = {{1, {{true, true, true}}}, {5, {{true, true, false}}}};
  geometry.loads      = {{5, [](const Point<3> &) { return p; }}};
  geometry.interfaces = {{"upper", upper_pad_body, 4, 2}};

  for (const bool mortar : {true, false})
    for (const unsigned int degree : {1u, 2u, 3u})
    {
      CAPTURE(mortar);
      CAPTURE(degree);
      Spaces<3> spaces(geometry, degree, mortar, MPI_COMM_WORLD);
      spaces.distribute();
      ContactModel<3> model;
      model.mortar            = mortar;
      model.penalty_stiffness = k_C;
      const Result result     = solve(spaces, model, false, {upper_pad_body});
      const double approach   = mortar ? 0 : p / k_C;
      CHECK(deviation(spaces, result, {rotor_body},
                      [&](const Point<3> &x) {
                        return Tensor<1, 3>({0., 0., -p * x[2] / E_rotor});
                      }) <= 1e-10);
      CHECK(deviation(spaces, result, {upper_pad_body},
                      [&](const Point<3> &x)
                      {
                        return Tensor<1, 3>(
                            {0., 0.,
                             -p * thickness / E_rotor - approach - p * (x[2] - thickness) / E_pad});
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
    Spaces<3> spaces(geometry, 2, mortar, MPI_COMM_WORLD);
    spaces.distribute();
    ContactModel<3> model;
    model.mortar               = mortar;
    model.penalty_stiffness    = k_C;
    model.angular_velocity     = 20;
    model.friction.coefficient = 0.6;
    const Result result        = solve(spaces, model, true, {upper_pad_body, lower_pad_body});
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
