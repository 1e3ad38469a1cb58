#include "blocks.h"
#include "statics.h"

#include <squeal/contact/contact_matrices.h>

#include <doctest/doctest.h>
namespace squeal::tests::contacts_tests
{
  using namespace dealii;

  namespace
  {
    /// A constant stress that passes the contact: of a stick contact any, of a frictionless one
    /// that of a change of volume. K u + N Lambda = 0 with its pressure and tangential tractions at
    /// all nodes that no load acts on.
    void check_patch(Geometry<3> geometry, const Tensor<1, 3> &normal, const ContactKind kind,
                     const unsigned int degree, const bool hanging)
    {
      CAPTURE(degree);
      CAPTURE(hanging);
      CAPTURE(kind == ContactKind::stick);
      Tensor<1, 3> along;
      along[1]            = 1;
      geometry.interfaces = {
          {"upper : lower", upper_pad_body, first_side, second_side, 1e-3, kind, along}};
      FiniteElementSpace<3> spaces(geometry, degree, true, MPI_COMM_WORLD);
      spaces.distribute();
      const std::vector<Body> bodies = {rotor_body, upper_pad_body};
      if (hanging)
        refine_every_second(spaces, bodies);
      const Matrix K = patch_stiffness(spaces, bodies);
      Contact<3> contact(spaces, frictionless<3>(true));
      contact.scale_constraints(K.infinity_norm());
      CHECK(contact.n_active_multipliers() == spaces.n_multipliers);

      Tensor<2, 3> gradient = patch_gradient();
      if (kind == ContactKind::frictionless)
        gradient = -1e-3 * Tensor<2, 3>(unit_symmetric_tensor<3>());
      MultiVector x = patch_displacement(spaces, bodies, gradient);
      // On the first side, along the second side's normal, e and b
      const Tensor<1, 3> traction = stress_of(patch_material(), gradient) * normal, n = -normal,
                         e = direction_in_surface(n, along), b = binormal_of(n, e);
      const auto set = [&](const unsigned int row, const double value)
      { x.data()[row - spaces.rows.begin] = value / contact.pressure_scale(); };
      for (const auto node : spaces.nodes.locally_owned_dofs())
      {
        if (const unsigned int row = spaces.multiplier(node); row != FiniteElementSpace<3>::none)
          set(row, traction * n);
        if (const unsigned int row = spaces.stick(node); row != FiniteElementSpace<3>::none)
        {
          set(row, traction * e);
          set(row + 1, traction * b);
        }
      }
      const Balance balance =
          balance_of(spaces, multiply(K, x), multiply(normal_matrix(contact), x));
      CHECK(balance.n_checked > spaces.n_multipliers + 3);
      CHECK(balance.largest <= 1e-10 * balance.largest_force);
    }

    /// The upper of two blocks, guided at its back, is pressed at one end only.
    Geometry<3> pressed_at_one_end(const ContactKind kind)
    {
      Geometry<3> geometry        = make_blocks({{2, 5, 1}}, {{3, 6, 1}});
      geometry.loads              = {{5, [](const Point<3> &x) { return p * (1 + 40 * x[1]); }}};
      geometry.interfaces[0].kind = kind;
      geometry.interfaces[0].distance = 1e-4;
      geometry.interfaces[0].along[0] = 1;
      return geometry;
    }
  } // namespace

  TEST_CASE(
      "contact joints: constant stress passes a plane contact, straight and oblique, on meshes "
      "that do not match and hanging nodes")
  {
    for (const unsigned int degree : {1u, 2u, 3u})
      for (const bool hanging : {false, true})
        for (const ContactKind kind : {ContactKind::stick, ContactKind::frictionless})
        {
          check_patch(make_joined_blocks(straight), Point<3>(0, 0, -1), kind, degree, hanging);
          check_patch(make_joined_blocks(oblique), oblique_normal(), kind, degree, hanging);
        }
  }

  TEST_CASE("contact joints: partly open, pressures and gaps are complementary, resultants balance "
            "the load, and where it sticks nothing moves")
  {
    for (const ContactKind kind : {ContactKind::stick, ContactKind::frictionless})
      for (const unsigned int degree : {1u, 2u})
      {
        CAPTURE(kind == ContactKind::stick);
        CAPTURE(degree);
        const Geometry<3> geometry = pressed_at_one_end(kind);
        FiniteElementSpace<3> spaces(geometry, degree, true, MPI_COMM_WORLD);
        spaces.distribute();
        const Result<3> result     = solve(spaces, frictionless<3>(true), true, {upper_pad_body});
        const ContactResultants &r = result.resultants[0];
        // Forces on the upper block along z: what presses its back goes through the contact.
        const std::vector<double> pressing = replicate(assemble_pressure_load(spaces));
        const MultiVector up_marks         = translation(spaces, {upper_pad_body}, 2);
        const std::vector<double> up       = replicate(up_marks);
        double load                        = 0;
        for (unsigned int row = 0; row < up.size(); ++row)
          load -= pressing[row] * up[row];
        CHECK(load > 0);
        CHECK(std::abs(r.normal_force - load) <= 1e-10 * load);
        CHECK(r.kind == kind);

        // All gaps by the rows of a contact all of whose multipliers are active, all but those that
        // a support holds.
        const Contact<3> closed(spaces, frictionless<3>(true));
        const std::vector<double> gaps  = replicate(multiply(normal_matrix(closed), result.state));
        const std::vector<double> state = replicate(result.state);
        double largest_gap = 0, largest_p = 0, tension = 0, product = 0, left = 0, largest_T = 0;
        unsigned int n_open = 0, n_closed = 0;
        for (const unsigned int row : closed.multipliers())
          if (closed.with_tractions(row).front() == row)
            largest_gap = std::max(largest_gap, std::abs(gaps[row]));
        for (const unsigned int row : closed.multipliers())
          largest_p = std::max(largest_p, std::abs(state[row]));
        std::vector<bool> is_pressure(spaces.rows.size, false);
        for (const PairedInterface<3> &interface : closed.paired_interfaces())
          for (const ContactFace<3> &face : interface.pad_faces)
            for (const auto &nodes : face.nodes)
              for (const FreeNode<3> &node : nodes)
                is_pressure[node.multiplier(0)] = true;
        const double tolerance = 1e-10;
        for (const unsigned int row : closed.multipliers())
          if (is_pressure[row])
          {
            const bool is_closed = result.contact.is_closed(row);
            ++(is_closed ? n_closed : n_open);
            tension = std::max(tension, -state[row] / largest_p);
            product = std::max(product, std::abs(state[row] * gaps[row]) / largest_p / largest_gap);
            CHECK(gaps[row] <= tolerance * largest_gap);
            for (const unsigned int traction : result.contact.with_tractions(row))
              if (traction != row)
              {
                largest_T = std::max(largest_T, std::abs(state[traction]) / largest_p);
                if (is_closed)
                  left = std::max(left, std::abs(gaps[traction]) / largest_gap);
                else
                  CHECK(state[traction] == 0);
              }
          }
        CHECK(tension <= tolerance);
        CHECK(product <= tolerance);
        CHECK(left <= tolerance);
        const unsigned int n = Utilities::MPI::n_mpi_processes(MPI_COMM_WORLD);
        if (n == 1) // each rank sees its share of the faces
        {
          CHECK(n_open > 0);
          CHECK(n_closed > 0);
          if (kind == ContactKind::stick)
            CHECK(largest_T > 1e-3);
        }
        if (kind == ContactKind::stick)
          CHECK(r.needed_friction > 0);
        else
          CHECK(r.friction_force == 0);
      }
  }

  TEST_CASE("contact joints: where a support holds a tangential direction its traction is zero")
  {
    Geometry<3> geometry = make_joined_blocks(straight);
    Tensor<1, 3> along;
    along[0]            = 1;
    geometry.interfaces = {{"upper : lower", upper_pad_body, first_side, second_side, 1e-3,
                            ContactKind::stick, along}};
    geometry.supports   = {{first_side, {{true, false, false}}}};
    FiniteElementSpace<3> spaces(geometry, 2, true, MPI_COMM_WORLD);
    spaces.distribute();
    const Contact<3> contact(spaces, frictionless<3>(true));
    CHECK(spaces.n_multipliers == 3 * 35);
    CHECK(contact.n_active_multipliers() == 2 * 35);
  }
} // namespace squeal::tests::contacts_tests
