#include "fields.h"

#include <doctest/doctest.h>

#include <squeal/base/errors.h>

#include <set>
namespace squeal::tests::finite_element_space_tests
{
  using namespace dealii;

  TEST_CASE("spaces: numbers of displacements and multipliers")
  {
    // Nodes of a tensor-product mesh of degree p: p n + 1 along n cells, p n around a ring. The
    // clamped cylinder has no displacements, guided back faces have only the axial ones; one
    // multiplier per node of the contact faces.
    for (const unsigned int p : {1u, 2u, 3u})
      for (const std::string back_face : {"guided", "free", "fixed"})
        for (const bool with_multipliers : {true, false})
        {
          CAPTURE(p);
          CAPTURE(back_face);
          Parameters::All prm;
          prm.discretization.rotor_cells  = {{2, 5, 1}};
          prm.discretization.pad_cells    = {{1, 3, 2}};
          prm.discretization.clamp_layers = 0;
          prm.pads.back_face              = value_named<BackFace>(back_face);
          const Geometry<3> geometry      = make_brake(prm);
          FiniteElementSpace<3> spaces(geometry, p, with_multipliers, MPI_COMM_WORLD);
          spaces.distribute();

          const unsigned int rotor    = 3 * (2 * p + 1) * 5 * p * (p + 1) - 3 * 5 * p * (p + 1);
          const unsigned int face     = (p + 1) * (3 * p + 1);
          const unsigned int per_node = back_face == "guided" ? 2 : back_face == "fixed" ? 3 : 0;
          const unsigned int pad      = 3 * face * (2 * p + 1) - per_node * face;
          CHECK(spaces.n_displacements == rotor + 2 * pad);
          CHECK(spaces.n_multipliers == (with_multipliers ? 2 * face : 0));
          CHECK(spaces.rows.size == spaces.n_displacements + spaces.n_multipliers);
        }
  }

  TEST_CASE(
      "spaces: every equation belongs to one component of one node, ranks own contiguous rows")
  {
    Parameters::All prm;
    prm.discretization.rotor_cells = {{1, 6, 1}};
    prm.discretization.pad_cells   = {{2, 2, 1}};
    prm.pads.arrangement           = Arrangement::upper;
    const Geometry<3> geometry     = make_brake(prm);
    FiniteElementSpace<3> spaces(geometry, 2, true, MPI_COMM_WORLD);
    spaces.distribute();
    // One corner cell of the pad and one cell of the rotor, so that nodes hang.
    refine_where(spaces,
                 [](const Point<3> &x, const types::material_id body) {
                   return body == upper_pad_body ? x[1] > 0 && std::hypot(x[0], x[1]) < 0.115
                                                 : x[1] > 0.08;
                 });

    const RowRange &rows = spaces.rows;
    const auto parts =
        Utilities::MPI::all_gather(MPI_COMM_WORLD, std::make_pair(rows.begin, rows.end));
    CHECK(parts.front().first == 0);
    CHECK(parts.back().second == rows.size);
    for (unsigned int r = 1; r < parts.size(); ++r)
      CHECK(parts[r].first == parts[r - 1].second);

    // Own nodes give the own rows, each once, displacements before multipliers.
    std::set<unsigned int> displacements, multipliers;
    unsigned int n = 0, n_hanging = 0;
    for (const auto node : spaces.nodes.locally_owned_dofs())
      if (spaces.hanging.is_constrained(node))
      {
        ++n_hanging;
        for (unsigned int c = 0; c < 3; ++c)
          CHECK(spaces.equation(node, c) == FiniteElementSpace<3>::none);
        CHECK(spaces.multiplier(node) == FiniteElementSpace<3>::none);
      }
      else
      {
        for (unsigned int c = 0; c < 3; ++c)
          if (const unsigned int row = spaces.equation(node, c); row != FiniteElementSpace<3>::none)
          {
            displacements.insert(row);
            ++n;
          }
        if (const unsigned int row = spaces.multiplier(node); row != FiniteElementSpace<3>::none)
        {
          multipliers.insert(row);
          ++n;
        }
      }
    CHECK(n == rows.n_local());
    CHECK(displacements.size() + multipliers.size() == n);
    if (!displacements.empty())
    {
      CHECK(*displacements.begin() == rows.begin);
      CHECK(*displacements.rbegin() + 1 == spaces.first_local_multiplier);
    }
    if (!multipliers.empty())
    {
      CHECK(*multipliers.begin() == spaces.first_local_multiplier);
      CHECK(*multipliers.rbegin() + 1 == rows.end);
    }
    CHECK(Utilities::MPI::sum(n_hanging, MPI_COMM_WORLD) > 0);
    CHECK(Utilities::MPI::sum(unsigned(multipliers.size()), MPI_COMM_WORLD) ==
          spaces.n_multipliers);

    // Every node of every cell that this rank sees is interpolated from free nodes with weights of
    // sum 1; of contact faces from nodes with multipliers.
    std::vector<types::global_dof_index> cell_nodes(spaces.fe.n_dofs_per_cell());
    double worst      = 0;
    bool all_are_free = true;
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned())
      {
        cell->get_dof_indices(cell_nodes);
        for (const auto node : cell_nodes)
        {
          double sum = 0;
          for (const WeightedNode &w : spaces.expand(node))
          {
            sum += w.weight;
            all_are_free &= !spaces.hanging.is_constrained(w.node);
          }
          worst = std::max(worst, std::abs(sum - 1));
        }
        for (const unsigned int f : cell->face_indices())
          if (cell->face(f)->at_boundary() &&
              cell->face(f)->boundary_id() == geometry.boundaries.at("upper_pad.contact"))
          {
            std::vector<types::global_dof_index> face_nodes(spaces.fe.n_dofs_per_face());
            cell->face(f)->get_dof_indices(face_nodes);
            for (const auto node : face_nodes)
              for (const WeightedNode &w : spaces.expand(node))
                all_are_free &= spaces.multiplier(w.node) != FiniteElementSpace<3>::none;
          }
      }
    CHECK(worst <= 1e-14);
    CHECK(all_are_free);
  }

  TEST_CASE("spaces: distribute forgets the mesh before")
  {
    // Refining the pad only leaves the rotor's numbers alone and makes (2 n p + 1) nodes of n p
    // + 1.
    Parameters::All prm;
    prm.discretization.rotor_cells  = {{1, 6, 1}};
    prm.discretization.pad_cells    = {{1, 2, 1}};
    prm.discretization.clamp_layers = 0;
    prm.pads.arrangement            = Arrangement::upper;
    const Geometry<3> geometry      = make_brake(prm);
    FiniteElementSpace<3> spaces(geometry, 2, true, MPI_COMM_WORLD);
    spaces.distribute();
    const unsigned int rotor = 3 * 2 * 12 * 3; // clamped inside: 2 of 3 nodes along r
    CHECK(spaces.n_displacements == rotor + 3 * 3 * 5 * 3 - 2 * 3 * 5);
    CHECK(spaces.n_multipliers == 3 * 5);
    refine_where(spaces, [](const Point<3> &, const types::material_id body)
                 { return body == upper_pad_body; });
    CHECK(spaces.n_displacements == rotor + 3 * 5 * 9 * 5 - 2 * 5 * 9);
    CHECK(spaces.n_multipliers == 5 * 9);
  }

  namespace
  {
    /// The largest distance between the two sides of the faces that have hanging nodes, over the
    /// points of a quadrature.
    double gap_at_hanging_faces(const FiniteElementSpace<3> &spaces)
    {
      const QGauss<2> rule(3);
      FEFaceValues<3> fine(spaces.mapping, spaces.fe, rule, update_quadrature_points);
      FESubfaceValues<3> coarse(spaces.mapping, spaces.fe, rule, update_quadrature_points);
      double largest = 0;
      unsigned int n = 0;
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
          for (const unsigned int f : cell->face_indices())
            if (!cell->face(f)->at_boundary() && cell->neighbor_is_coarser(f))
            {
              const auto [face, subface] = cell->neighbor_of_coarser_neighbor(f);
              fine.reinit(cell, f);
              coarse.reinit(cell->neighbor(f), face, subface);
              for (unsigned int q = 0; q < rule.size(); ++q)
                largest = std::max(largest,
                                   fine.quadrature_point(q).distance(coarse.quadrature_point(q)));
              ++n;
            }
      CHECK(Utilities::MPI::sum(n, MPI_COMM_WORLD) > 0);
      return Utilities::MPI::max(largest, MPI_COMM_WORLD);
    }

    /// Once and twice refined cells within a quarter of the ring: some nodes hang on hanging nodes.
    void refine_towards_corner(FiniteElementSpace<3> &spaces)
    {
      for (const double reach : {0.07, 0.04})
        refine_where(spaces, [=](const Point<3> &x, const types::material_id)
                     { return x.distance(Point<3>(0.1, 0.02, 0.006)) < reach; });
    }
  } // namespace

  TEST_CASE("spaces: curved faces with hanging nodes fit together")
  {
    Parameters::All prm;
    prm.discretization.rotor_cells = {{2, 8, 1}};
    prm.pads.arrangement           = Arrangement::none;
    const Geometry<3> geometry     = make_brake(prm);
    for (const unsigned int p : {1u, 2u, 3u})
    {
      CAPTURE(p);
      FiniteElementSpace<3> spaces(geometry, p, false, MPI_COMM_WORLD);
      refine_towards_corner(spaces);
      CHECK(gap_at_hanging_faces(spaces) <= 1e-15);
      // Closed without gaps: 3 V = int div x = int x.n over the boundary.
      double flux = 0;
      for (const auto &[name, id] : geometry.boundaries)
        flux += integrate_boundary(spaces, id,
                                   [](const Point<3> &x, const Tensor<1, 3> &n) { return x * n; });
      CHECK(relative_error(flux, 3 * integrate(spaces, {rotor_body},
                                               [](const Point<3> &) { return 1.; })) <= 1e-13);
      // Cells without hanging nodes are those of the manifold.
      const std::vector<Point<3>> &support = spaces.fe.get_unit_support_points();
      const MappingQ<3> on_manifold(p);
      std::vector<types::global_dof_index> cell_nodes(support.size());
      double distance = 0;
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          cell->get_dof_indices(cell_nodes);
          for (unsigned int a = 0; a < support.size(); ++a)
            if (!spaces.hanging.is_constrained(cell_nodes[a]))
              distance = std::max(
                  distance,
                  spaces.mapping.transform_unit_to_real_cell(cell, support[a])
                      .distance(on_manifold.transform_unit_to_real_cell(cell, support[a])));
        }
      CHECK(distance <= 1e-15);
    }
  }

  TEST_CASE("spaces: hanging nodes must not turn a thin cell inside out")
  {
    // Straight sides, a cell in 60 degrees, the inner of two rings refined: between the rings, at
    // radius 0.12, nodes hang on chords, at radius 0.12 cos 30 = 0.1039, which is less than the
    // 0.105 in the middle of the inner ring.
    Parameters::All prm;
    prm.pads.arrangement           = Arrangement::none;
    prm.rotor.inner_radius         = 0.09;
    prm.rotor.outer_radius         = 0.15;
    prm.discretization.rotor_cells = {{2, 6, 1}};
    const Geometry<3> geometry     = make_brake(prm);
    const auto refine_inside       = [&](const unsigned int degree)
    {
      FiniteElementSpace<3> spaces(geometry, degree, false, MPI_COMM_WORLD);
      refine_where(spaces, [](const Point<3> &x, const types::material_id)
                   { return std::hypot(x[0], x[1]) < 0.105; });
    };
    CHECK_NOTHROW(refine_inside(2));
    CHECK(contains(message_of<SolverError>([&]() { refine_inside(1); }), "inside out"));
  }

  TEST_CASE("spaces: chains of hanging nodes end at free nodes on every rank")
  {
    // A free ring, where every node that does not hang has an equation, refined at scattered
    // places.
    Parameters::All prm;
    prm.discretization.rotor_cells = {{2, 6, 2}};
    prm.rotor.clamped              = Clamped::none;
    prm.pads.arrangement           = Arrangement::none;
    const Geometry<3> geometry     = make_brake(prm);
    for (const unsigned int seed : {1u, 2u, 3u})
    {
      CAPTURE(seed);
      FiniteElementSpace<3> spaces(geometry, 2, false, MPI_COMM_WORLD);
      for (unsigned int level = 0; level < 3; ++level)
        refine_where(spaces,
                     [&](const Point<3> &x, const types::material_id)
                     {
                       const double random =
                           1e4 * std::sin(seed + 321 * x[0] + 507 * x[1] + 1203 * x[2]);
                       return random - std::floor(random) < 0.1;
                     });
      std::vector<types::global_dof_index> cell_nodes(spaces.fe.n_dofs_per_cell());
      unsigned int n_missing = 0;
      double worst           = 0;
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (!cell->is_artificial())
        {
          cell->get_dof_indices(cell_nodes);
          for (const auto node : cell_nodes)
          {
            double sum = 0;
            for (const WeightedNode &w : spaces.expand(node))
            {
              sum += w.weight;
              n_missing += spaces.equation(w.node, 0) == FiniteElementSpace<3>::none;
            }
            worst = std::max(worst, std::abs(sum - 1));
          }
        }
      CHECK(n_missing == 0);
      CHECK(worst <= 1e-13);
      CHECK(gap_at_hanging_faces(spaces) <= 1e-15);
    }
  }
} // namespace squeal::tests::finite_element_space_tests
