#pragma once

#include "fields.h"

#include <doctest/doctest.h>

#include <squeal/bodies/body_operators.h>

#include <deal.II/physics/transformations.h>

#include <map>

/// What the tests of joints share.
namespace squeal::tests
{
  using dealii::Tensor;
  namespace types = dealii::types;

  constexpr types::boundary_id first_side = 1, second_side = 2;

  /// A lower block under an upper one of cells that do not match; @p place moves both.
  template <typename Place>
  Geometry<3> make_joined_blocks(const Place &place)
  {
    Geometry<3> geometry;
    geometry.parts        = {{rotor_body, 0, false}, {upper_pad_body, 0, false}};
    geometry.other_bodies = {{upper_pad_body, "block"}};
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
            CoarseCell<3> cell;
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
  inline std::vector<double> free_surface(const FiniteElementSpace<3> &spaces)
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

  /// Hanging nodes: every second cell of each body is divided.
  inline void refine_every_second(FiniteElementSpace<3> &spaces, const std::vector<Body> &bodies)
  {
    const unsigned int before = spaces.triangulation.n_global_active_cells();
    for (const Body body : bodies)
    {
      bool is_second = false;
      refine_where(spaces, [&](const Point<3> &, const types::material_id of_cell)
                   { return of_cell == body && (is_second = !is_second); });
    }
    CHECK(spaces.triangulation.n_global_active_cells() > before);
  }

  // Patch tests: a linear displacement of steel, whose gradient has all components.

  inline Material patch_material()
  {
    Material material;
    material.young_modulus = 2e11;
    material.poisson_ratio = 0.3;
    material.density       = 7850;
    return material;
  }

  inline Tensor<2, 3> patch_gradient()
  {
    return Tensor<2, 3>({{1e-3, 4e-4, -2e-4}, {7e-4, -5e-4, 3e-4}, {-6e-4, 1e-4, 8e-4}});
  }

  inline MultiVector patch_displacement(const FiniteElementSpace<3> &spaces,
                                        const std::vector<Body> &bodies,
                                        const Tensor<2, 3> &gradient)
  {
    return interpolate(spaces, bodies,
                       [&](const Point<3> &at) { return gradient * Tensor<1, 3>(at); });
  }

  inline Matrix patch_stiffness(const FiniteElementSpace<3> &spaces,
                                const std::vector<Body> &bodies)
  {
    return std::move(*std::const_pointer_cast<Matrix>(
        assemble_body(spaces, bodies, patch_material(), BodyMatrixChoice{false, true, false, false})
            .K));
  }

  /// Of the forces of bodies and joint together: the largest sum in a row that no load acts on, and
  /// the largest force of the bodies.
  struct Balance
  {
    double largest = 0, largest_force = 0;
    unsigned int n_checked = 0;
  };
  inline Balance balance_of(const FiniteElementSpace<3> &spaces, const MultiVector &of_bodies,
                            MultiVector residual)
  {
    residual += of_bodies;
    const std::vector<double> r = replicate(residual), forces = replicate(of_bodies),
                              is_free = free_surface(spaces);
    Balance balance;
    for (unsigned int row = 0; row < r.size(); ++row)
    {
      balance.largest_force = std::max(balance.largest_force, std::abs(forces[row]));
      if (is_free[row] == 0)
      {
        balance.largest = std::max(balance.largest, std::abs(r[row]));
        ++balance.n_checked;
      }
    }
    return balance;
  }

  inline Point<3> straight(const Point<3> &x)
  {
    return x;
  }

  /// Sheared along the joint, then turned.
  inline Tensor<2, 3> oblique_turn()
  {
    return dealii::Physics::Transformations::Rotations::rotation_matrix_3d(Point<3>(0.6, 0, 0.8),
                                                                           0.7);
  }
  inline Point<3> oblique(const Point<3> &x)
  {
    return Point<3>(oblique_turn() * Tensor<1, 3>(Point<3>(x[0] + 0.3 * x[1] + 0.2 * x[2],
                                                           x[1] - 0.1 * x[0] + 0.4 * x[2], x[2])));
  }
  /// Out of the upper block.
  inline Tensor<1, 3> oblique_normal()
  {
    return oblique_turn() * Tensor<1, 3>({0, 0, -1});
  }

  /// Of a displacement gradient, Pa.
  inline Tensor<2, 3> stress_of(const Material &material, const Tensor<2, 3> &gradient)
  {
    const double nu = material.poisson_ratio, E = material.young_modulus,
                 lambda       = E * nu / ((1 + nu) * (1 - 2 * nu));
    const Tensor<2, 3> strain = 0.5 * (gradient + transpose(gradient));
    Tensor<2, 3> stress       = E / (1 + nu) * strain;
    for (unsigned int d = 0; d < 3; ++d)
      stress[d][d] += lambda * trace(strain);
    return stress;
  }
} // namespace squeal::tests
