#include "fields.h"

#include <squeal/bodies/body_operators.h>
#include <squeal/joints/ties.h>

#include <deal.II/physics/transformations.h>

#include <doctest/doctest.h>

#include <map>

using namespace dealii;
using namespace squeal;
using namespace squeal::tests;

namespace
{
  constexpr types::boundary_id first_side = 1, second_side = 2;

  /// A lower block under an upper one of cells that do not match; @p place moves both.
  template <typename Place>
  Geometry<3> make_blocks(const Place &place)
  {
    Geometry<3> geometry;
    geometry.parts        = {{rotor_body, 0, false}, {upper_pad_body, 0, false}};
    geometry.other_bodies = {{upper_pad_body, "block"}};
    geometry.ties         = {{"upper : lower", first_side, second_side, 1e-3}};
    const auto add        = [&](const unsigned int body, const std::array<unsigned int, 3> &n,
                         const Point<3> &low, const Point<3> &high)
    {
      std::map<std::array<unsigned int, 3>, unsigned int> numbers;
      const auto vertex = [&](const std::array<unsigned int, 3> &at)
      {
        const auto [found, is_new] = numbers.emplace(at, geometry.vertices.size());
        Point<3> x;
        for (unsigned int d = 0; d < 3; ++d)
          x[d] = low[d] + (high[d] - low[d]) * at[d] / n[d];
        if (is_new)
          geometry.vertices.push_back(place(x));
        return found->second;
      };
      for (unsigned int k = 0; k < n[2]; ++k)
        for (unsigned int j = 0; j < n[1]; ++j)
          for (unsigned int i = 0; i < n[0]; ++i)
          {
            CellData<3> cell;
            cell.material_id = body;
            for (unsigned int v = 0; v < 8; ++v)
              cell.vertices[v] = vertex({{i + v % 2, j + v / 2 % 2, k + v / 4}});
            geometry.cells.push_back(cell);
            if (k != (body == rotor_body ? n[2] - 1 : 0))
              continue;
            std::array<unsigned int, 4> face;
            for (unsigned int v = 0; v < 4; ++v)
              face[v] = cell.vertices[body == rotor_body ? 4 + v : v];
            std::sort(face.begin(), face.end());
            geometry.named_faces[face] = body == rotor_body ? second_side : first_side;
          }
    };
    add(rotor_body, {{2, 3, 2}}, Point<3>(0, 0, 0), Point<3>(0.1, 0.09, 0.03));
    add(upper_pad_body, {{3, 2, 1}}, Point<3>(0, 0, 0.03), Point<3>(0.1, 0.09, 0.05));
    return geometry;
  }

  /// Rows of nodes on the free surface, for one replicated flag a row.
  std::vector<double> free_surface(const FiniteElementSpace<3> &spaces)
  {
    MultiVector flags(spaces.rows, 1);
    std::vector<int> equations;
    std::vector<double> ones;
    std::vector<types::global_dof_index> nodes(spaces.fe.n_dofs_per_face());
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (!cell->is_artificial())
        for (const unsigned int f : cell->face_indices())
          if (cell->face(f)->at_boundary() && cell->face(f)->boundary_id() == 0)
          {
            cell->face(f)->get_dof_indices(nodes);
            for (const auto node : nodes)
              for (const WeightedNode &w : spaces.expand(node))
                for (unsigned int c = 0; c < 3; ++c)
                {
                  const unsigned int row = spaces.equation(w.node, c);
                  if (row != FiniteElementSpace<3>::none && spaces.rows.contains(row))
                    flags.data()[row - spaces.rows.begin] = 1;
                }
          }
    return replicate(flags);
  }

  /// A linear displacement satisfies the tie, and the constant stress that belongs to it passes
  /// from one block to the other by its constant traction: K u + B^T Lambda = 0 at all nodes that
  /// no load acts on, those of the second side under and beside the first among them.
  void check_patch(const Geometry<3> &geometry, const Tensor<1, 3> &normal,
                   const unsigned int degree, const bool hanging)
  {
    CAPTURE(degree);
    CAPTURE(hanging);
    Material material;
    material.young_modulus = 2e11;
    material.poisson_ratio = 0.3;
    material.density       = 7850;
    FiniteElementSpace<3> spaces(geometry, degree, true, MPI_COMM_WORLD);
    spaces.distribute();
    if (hanging)
    {
      const unsigned int before = spaces.triangulation.n_global_active_cells();
      bool is_lower             = false;
      refine_where(spaces, [&](const Point<3> &, const types::material_id body)
                   { return body == rotor_body && (is_lower = !is_lower); });
      bool is_upper = false;
      refine_where(spaces, [&](const Point<3> &, const types::material_id body)
                   { return body == upper_pad_body && (is_upper = !is_upper); });
      CHECK(spaces.triangulation.n_global_active_cells() > before);
    }
    const Matrix K  = std::move(*std::const_pointer_cast<Matrix>(
        assemble_body(spaces, {rotor_body, upper_pad_body}, material,
                       BodyMatrixChoice{false, true, false, false})
            .K));
    const Ties ties = assemble_ties(spaces, K.infinity_norm());
    CHECK(ties.n_active == spaces.n_ties);

    const Tensor<2, 3> gradient({{1e-3, 4e-4, -2e-4}, {7e-4, -5e-4, 3e-4}, {-6e-4, 1e-4, 8e-4}});
    MultiVector x       = interpolate(spaces, {rotor_body, upper_pad_body},
                                      [&](const Point<3> &at) { return gradient * Tensor<1, 3>(at); });
    const double lambda = material.young_modulus * material.poisson_ratio /
                          ((1 + material.poisson_ratio) * (1 - 2 * material.poisson_ratio)),
                 mu           = material.young_modulus / (2 * (1 + material.poisson_ratio));
    const Tensor<2, 3> strain = 0.5 * (gradient + transpose(gradient));
    Tensor<2, 3> stress       = 2 * mu * strain;
    for (unsigned int d = 0; d < 3; ++d)
      stress[d][d] += lambda * trace(strain);
    const Tensor<1, 3> traction = stress * normal; // on the first side, whose outward normal it is
    for (const auto node : spaces.nodes.locally_owned_dofs())
      if (const unsigned int row = spaces.tie(node); row != FiniteElementSpace<3>::none)
        for (unsigned int c = 0; c < 3; ++c)
          x.data()[row + c - spaces.rows.begin] = traction[c] / ties.scale;

    const MultiVector of_bodies = multiply(K, x);
    MultiVector residual        = multiply(*ties.matrix, x);
    residual += of_bodies;
    const std::vector<double> r = replicate(residual), forces = replicate(of_bodies),
                              is_free = free_surface(spaces);
    double largest = 0, largest_force = 0;
    unsigned int n_checked = 0;
    for (unsigned int row = 0; row < r.size(); ++row)
    {
      largest_force = std::max(largest_force, std::abs(forces[row]));
      if (is_free[row] == 0)
      {
        largest = std::max(largest, std::abs(r[row]));
        ++n_checked;
      }
    }
    CHECK(n_checked > spaces.n_ties + 3);
    CHECK(largest <= 1e-10 * largest_force);
  }
} // namespace

TEST_CASE("ties: constant stress passes a plane tie, straight and oblique, on meshes that do not "
          "match and hanging nodes")
{
  const Tensor<2, 3> turn =
      Physics::Transformations::Rotations::rotation_matrix_3d(Point<3>(0.6, 0, 0.8), 0.7);
  const auto straight = [](const Point<3> &x) { return x; };
  const auto oblique  = [&](const Point<3> &x)
  {
    // Sheared along the tie, then turned
    return Point<3>(turn * Tensor<1, 3>(Point<3>(x[0] + 0.3 * x[1] + 0.2 * x[2],
                                                 x[1] - 0.1 * x[0] + 0.4 * x[2], x[2])));
  };
  for (const unsigned int degree : {1u, 2u, 3u})
    for (const bool hanging : {false, true})
    {
      check_patch(make_blocks(straight), Point<3>(0, 0, -1), degree, hanging);
      check_patch(make_blocks(oblique), turn * Tensor<1, 3>({0, 0, -1}), degree, hanging);
    }
}

TEST_CASE("ties: where a component is fixed its traction is zero and does not count")
{
  Geometry<3> geometry = make_blocks([](const Point<3> &x) { return x; });
  for (const auto &[face, id] : std::map(geometry.named_faces))
    if (id == first_side)
      geometry.supports = {{first_side, {{true, false, false}}}};
  FiniteElementSpace<3> spaces(geometry, 2, true, MPI_COMM_WORLD);
  spaces.distribute();
  const Ties ties = assemble_ties(spaces, 1e9);
  CHECK(spaces.n_ties == 3 * 35);
  CHECK(ties.n_active == 2 * 35);
}
