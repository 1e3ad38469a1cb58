#include "blocks.h"

#include <squeal/bodies/body_operators.h>
#include <squeal/joints/ties.h>

#include <doctest/doctest.h>
namespace squeal::tests::ties_tests
{
  using namespace dealii;

  namespace
  {
    template <typename Place>
    Geometry<3> make_tied(const Place &place)
    {
      Geometry<3> geometry = make_joined_blocks(place);
      geometry.ties        = {{"upper : lower", first_side, second_side, 1e-3}};
      return geometry;
    }

    /// A linear displacement satisfies the tie, and the constant stress that belongs to it passes
    /// from one block to the other by its constant traction: K u + B^T Lambda = 0 at all nodes that
    /// no load acts on, those of the second side under and beside the first among them.
    void check_patch(const Geometry<3> &geometry, const Tensor<1, 3> &normal,
                     const unsigned int degree, const bool hanging)
    {
      CAPTURE(degree);
      CAPTURE(hanging);
      FiniteElementSpace<3> spaces(geometry, degree, true, MPI_COMM_WORLD);
      spaces.distribute();
      const std::vector<Body> bodies = {rotor_body, upper_pad_body};
      if (hanging)
        refine_every_second(spaces, bodies);
      const Matrix K  = patch_stiffness(spaces, bodies);
      const Ties ties = assemble_ties(spaces, K.infinity_norm());
      CHECK(ties.n_active == spaces.n_ties);

      const Tensor<2, 3> gradient = patch_gradient();
      MultiVector x               = patch_displacement(spaces, bodies, gradient);
      const Tensor<2, 3> stress   = stress_of(patch_material(), gradient);
      const Tensor<1, 3> traction =
          stress * normal; // on the first side, whose outward normal it is
      for (const auto node : spaces.nodes.locally_owned_dofs())
        if (const unsigned int row = spaces.tie(node); row != FiniteElementSpace<3>::none)
          for (unsigned int c = 0; c < 3; ++c)
            x.data()[row + c - spaces.rows.begin] = traction[c] / ties.scale;

      const Balance balance = balance_of(spaces, multiply(K, x), multiply(*ties.matrix, x));
      CHECK(balance.n_checked > spaces.n_ties + 3);
      CHECK(balance.largest <= 1e-10 * balance.largest_force);
    }
  } // namespace

  TEST_CASE("ties: constant stress passes a plane tie, straight and oblique, on meshes that do not "
            "match and hanging nodes")
  {
    for (const unsigned int degree : {1u, 2u, 3u})
      for (const bool hanging : {false, true})
      {
        check_patch(make_tied(straight), Point<3>(0, 0, -1), degree, hanging);
        check_patch(make_tied(oblique), oblique_normal(), degree, hanging);
      }
  }

  TEST_CASE("ties: where a component is fixed its traction is zero and does not count")
  {
    Geometry<3> geometry = make_tied(straight);
    for (const auto &[face, id] : std::map(geometry.named_faces))
      if (id == first_side)
        geometry.supports = {{first_side, {{true, false, false}}}};
    FiniteElementSpace<3> spaces(geometry, 2, true, MPI_COMM_WORLD);
    spaces.distribute();
    const Ties ties = assemble_ties(spaces, 1e9);
    CHECK(spaces.n_ties == 3 * 35);
    CHECK(ties.n_active == 2 * 35);
  }
} // namespace squeal::tests::ties_tests
