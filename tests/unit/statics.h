#pragma once

#include "fields.h"

#include <squeal/bodies/body_operators.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/statics/static_equilibrium.h>

/// What the tests of the static equilibrium share.
namespace squeal::tests
{
  const double p = 1e6, thickness = 0.012, E_rotor = 1.25e11, E_pad = 1e10, k_C = 1e12;

  // Without lateral contraction, so that uniaxial stress needs no lateral support.
  const Material rotor_material{E_rotor, 0, 7200, 0, 0}, pad_material{E_pad, 0, 2500, 0, 0};

  template <int dim>
  struct Result
  {
    Contact<dim> contact; ///< with the active set of the state
    MultiVector state;
    ContactPressure pressure;
    std::vector<ContactResultants> resultants;
    unsigned int n_iterations;
  };

  /// As Driver does it, with optional friction.
  template <int dim>
  Result<dim> solve(const FiniteElementSpace<dim> &spaces, const ContactModel<dim> &model,
                    const bool friction, const std::vector<Body> &pads)
  {
    const BodyMatrices rotor = assemble_body(spaces, {rotor_body}, rotor_material, false);
    const BodyMatrices pad   = assemble_body(spaces, pads, pad_material, false);
    Contact<dim> contact(spaces, model);
    if (model.mortar)
      contact.scale_constraints(std::max(rotor.K->infinity_norm(), pad.K->infinity_norm()));
    // The terms of other orders do not belong to the static state.
    const std::vector<Term> terms = {{Origin::elasticity, 0, 1., rotor.K},
                                     {Origin::elasticity, 0, 1., pad.K},
                                     {Origin::material_damping, 1, 1e3, pad.K},
                                     {Origin::inertia, 2, 1e3, pad.M}};
    StaticEquilibrium equilibrium =
        solve_static_equilibrium({terms, friction, assemble_pressure_load(spaces)}, contact);
    auto resultants = squeal::resultants(contact, equilibrium.pressure, &equilibrium.state);
    return {std::move(contact), std::move(equilibrium.state), std::move(equilibrium.pressure),
            std::move(resultants), static_cast<unsigned int>(equilibrium.iterations.size())};
  }

  template <int dim>
  ContactModel<dim> frictionless(const bool mortar)
  {
    ContactModel<dim> model;
    model.mortar            = mortar;
    model.penalty_stiffness = k_C;
    return model;
  }

  /// The largest deviation of the displacements of some bodies from a field, relative to the field.
  template <int dim, typename Field>
  double deviation(const FiniteElementSpace<dim> &spaces, const MultiVector &state,
                   const std::vector<Body> &bodies, const Field &field)
  {
    const MultiVector expected = interpolate(spaces, bodies, field);
    const MultiVector ones     = interpolate(spaces, bodies,
                                             [](const Point<dim> &)
                                             {
                                           Tensor<1, dim> one;
                                           for (unsigned int c = 0; c < dim; ++c)
                                             one[c] = 1;
                                           return one;
                                         });
    double largest             = 0;
    for (unsigned int i = 0; i < expected.n_local(); ++i)
      if (ones.column(0)[i] != 0)
        largest = std::max(largest, std::abs(state.column(0)[i] - expected.column(0)[i]));
    return dealii::Utilities::MPI::max(largest, MPI_COMM_WORLD) / largest_entry(expected);
  }

  /// The largest deviation of the multipliers from a constant pressure, relative to it.
  template <int dim>
  double deviation_of_multipliers(const FiniteElementSpace<dim> &spaces, const Result<dim> &result,
                                  const double expected)
  {
    double largest = 0;
    for (unsigned int i = spaces.first_local_multiplier - spaces.rows.begin;
         i < spaces.rows.n_local(); ++i)
      largest =
          std::max(largest, std::abs(result.contact.pressure_scale() * result.state.column(0)[i] -
                                     expected));
    return dealii::Utilities::MPI::max(largest, MPI_COMM_WORLD) / expected;
  }

  /// Appends a sector 0.09 < r < 0.14, |phi| < 25 degrees of heights z_0 < z < z_1. @p bias shifts
  /// the radii inside.
  inline void append_sector(Geometry<3> &geometry, const Body body,
                            const std::array<unsigned int, 3> &cells, const double z_0,
                            const double z_1, const double bias = 0)
  {
    const unsigned int first = geometry.vertices.size(), n_r = cells[0] + 1, n_phi = cells[1] + 1;
    for (unsigned int k = 0; k <= cells[2]; ++k)
      for (unsigned int j = 0; j <= cells[1]; ++j)
        for (unsigned int i = 0; i <= cells[0]; ++i)
        {
          const double s = double(i) / cells[0], r = 0.09 + 0.05 * (s + bias * s * (1 - s)),
                       phi = (-25 + 50. * j / cells[1]) * M_PI / 180;
          geometry.vertices.emplace_back(r * std::cos(phi), r * std::sin(phi),
                                         z_0 + (z_1 - z_0) * k / cells[2]);
        }
    for (unsigned int k = 0; k < cells[2]; ++k)
      for (unsigned int j = 0; j < cells[1]; ++j)
        for (unsigned int i = 0; i < cells[0]; ++i)
        {
          CoarseCell<3> cell;
          for (unsigned int v = 0; v < 8; ++v)
            cell.vertices[v] = first + (i + v % 2) + n_r * ((j + v / 2 % 2) + n_phi * (k + v / 4));
          cell.material_id = body;
          geometry.cells.push_back(cell);
        }
  }

  /// Two sectors of the same outline on top of each other, 0 < z < 2 thickness, the lower one, the
  /// rotor, on a fixed base, the upper one guided and pressed by p.
  inline Geometry<3> make_blocks(const std::array<unsigned int, 3> &rotor_cells,
                                 const std::array<unsigned int, 3> &pad_cells,
                                 const double pad_bias = 0)
  {
    Geometry<3> geometry;
    append_sector(geometry, rotor_body, rotor_cells, 0, thickness);
    append_sector(geometry, upper_pad_body, pad_cells, thickness, 2 * thickness, pad_bias);
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
    geometry.boundaries = {{"upper_pad.contact", 4}, {"upper_pad.back", 5}};
    geometry.supports   = {{1, {{true, true, true}}}, {5, {{true, true, false}}}};
    geometry.loads      = {{5, [](const Point<3> &) { return p; }}};
    geometry.interfaces = {{"upper", upper_pad_body, 4, 2}};
    return geometry;
  }
} // namespace squeal::tests
