#include "statics.h"

#include <doctest/doctest.h>

#include <squeal/bodies/displacement_multigrid.h>
#include <squeal/contact/contact_matrices.h>

#include <array>
#include <cmath>
#include <functional>
namespace squeal::tests::iterative_statics_tests
{
  using namespace dealii;

  namespace
  {
    /// A small brake whose pads are of a transversely isotropic lining.
    Parameters::All small_brake(const unsigned int degree)
    {
      Parameters::All p;
      p.discretization.degree                = degree;
      p.discretization.rotor_cells           = {{2, 9, 1}};
      p.discretization.pad_cells             = {{1, 2, 1}};
      p.pads.material.transversely_isotropic = true;
      p.pads.material.axial_young_modulus    = 2e9;
      p.pads.material.axial_poisson_ratio    = 0.15;
      p.pads.material.axial_shear_modulus    = 1.5e9;
      return p;
    }

    /// A few cells of rotor and pads under the upper pad.
    bool under_pad(const Point<3> &centre)
    {
      return centre[0] > 0 && std::abs(centre[1]) < 0.05 && centre[2] > -0.0061;
    }

    void refine_under_pad(FiniteElementSpace<3> &spaces)
    {
      refine_where(spaces, [](const Point<3> &centre, const types::material_id)
                   { return under_pad(centre); });
    }

    std::vector<MaterialOperator> bodies_of(const Parameters::All &p, const double m_star,
                                            const double g)
    {
      return {{{rotor_body}, p.rotor.material, m_star, g},
              {{upper_pad_body, lower_pad_body}, p.pads.material}};
    }

    /// Numbers without a pattern on the displacements.
    MultiVector some_displacements(const RowRange &rows, const unsigned int first_multiplier)
    {
      MultiVector x(rows, 1);
      for (unsigned int row = rows.begin; row < first_multiplier; ++row)
        x.data()[row - rows.begin] = std::sin(1.3 * row + 0.001 * row * row);
      return x;
    }

    double largest_difference(const MultiVector &a, const MultiVector &b)
    {
      double largest = 0;
      for (std::size_t i = 0; i < std::size_t(a.n_local()) * a.n_columns(); ++i)
        largest = std::max(largest, std::abs(a.data()[i] - b.data()[i]));
      return Utilities::MPI::max(largest, MPI_COMM_WORLD);
    }

    /// Multiples of stiffness, M*, G and mass.
    struct Factors
    {
      double k, m_star, g, m;
    };

    /// Compares products without matrices, of several columns, with those of the assembled
    /// matrices.
    template <int dim>
    void check_products(const Geometry<dim> &geometry, const Parameters::All &p,
                        const std::function<bool(const Point<dim> &)> &is_refined)
    {
      // Equal to rounding: the quadrature is the same. The factors make G, M* and M as large as K.
      // Each alone and several together, because what is not needed is not computed.
      const Factors factors[]   = {{1, 0, 0, 0},      {0, -1e9, 0, 0},    {0, 0, 3e5, 0},
                                   {0, 0, 0, 2e9},    {1, 0, 0, 2e9},     {0, 0, 3e5, -2e9},
                                   {1, -1e9, 3e5, 0}, {1, -1e9, 3e5, 2e9}};
      const unsigned int degree = p.discretization.degree;
      CAPTURE(dim);
      CAPTURE(degree);
      FiniteElementSpace<dim> spaces(geometry, degree, true, MPI_COMM_WORLD);
      refine_where(spaces, [&](const Point<dim> &centre, const types::material_id)
                   { return is_refined(centre); });
      CHECK(Utilities::MPI::max(spaces.hanging.n_constraints(), MPI_COMM_WORLD) > 0);
      const BodyMatrices rotor = assemble_body(spaces, {rotor_body}, p.rotor.material, true),
                         pads  = assemble_body(spaces, {upper_pad_body, lower_pad_body},
                                               p.pads.material, false);
      const DisplacementOperator<dim> first(spaces, bodies_of(p, 0, 0));
      MultiVector x = some_displacements(spaces.rows, spaces.first_local_multiplier);
      for (unsigned int column = 1; column < 3; ++column)
      {
        MultiVector other = x.columns(0, 1);
        for (unsigned int i = 0; i < x.n_local(); ++i)
          other.data()[i] *= std::cos(0.7 * column * (spaces.rows.begin + i));
        x.append(other);
      }
      // Of each matrix once: sums of matrices as dense as these would take most of the time.
      const std::array<std::pair<const Matrix *, double Factors::*>, 6> matrices{
          {{rotor.K.get(), &Factors::k},
           {pads.K.get(), &Factors::k},
           {rotor.M_star.get(), &Factors::m_star},
           {rotor.G.get(), &Factors::g},
           {rotor.M.get(), &Factors::m},
           {pads.M.get(), &Factors::m}}};
      for (const bool transposed : {false, true})
      {
        CAPTURE(transposed);
        std::vector<MultiVector> products;
        for (const auto &[matrix, factor] : matrices)
          products.push_back(transposed ? multiply_transposed(*matrix, x) : multiply(*matrix, x));
        for (const Factors &f : factors)
        {
          CAPTURE(f.k);
          CAPTURE(f.m_star);
          CAPTURE(f.g);
          CAPTURE(f.m);
          std::vector<MaterialOperator> bodies = bodies_of(p, f.m_star, f.g);
          for (MaterialOperator &body : bodies)
          {
            body.k = f.k;
            body.m = f.m;
          }
          const DisplacementOperator<dim> product(first, bodies);
          MultiVector y(spaces.rows, x.n_columns());
          for (unsigned int i = 0; i < matrices.size(); ++i)
            for (std::size_t j = 0; j < std::size_t(y.n_local()) * y.n_columns(); ++j)
              y.data()[j] += f.*matrices[i].second * products[i].data()[j];
          CHECK(largest_difference(product.multiply(x, transposed), y) <= 2e-13 * largest_entry(y));
        }
      }
    }
  } // namespace

  TEST_CASE("iterative_statics: products without matrices are those with the assembled matrices" *
            doctest::test_suite("slow, two ranks at most, optimised"))
  {
    // Hanging and fixed nodes and curved cells
    for (unsigned int degree = 1; degree <= 4; ++degree)
    {
      const Parameters::All p = small_brake(degree);
      check_products<3>(make_brake(p), p, under_pad);
    }
  }

  TEST_CASE("iterative_statics: products without matrices, strip" *
            doctest::test_suite("slow, two ranks at most"))
  {
    // Hanging, fixed and periodic nodes, some of these hanging. All degrees that the program takes.
    for (unsigned int degree = 1; degree <= 8; ++degree)
    {
      Parameters::All p            = small_brake(degree);
      p.discretization.rotor_cells = {{1, 11, 2}};
      p.discretization.pad_cells   = {{1, 3, 1}};
      check_products<2>(make_strip(p), p,
                        [](const Point<2> &centre) { return centre[0] > 0.05 || centre[1] > 0; });
    }
  }

  TEST_CASE("iterative_statics: the diagonal without a matrix" * doctest::test_suite("slow"))
  {
    // On a conforming mesh it is the matrix's; nodes that others hang on have a part of it only.
    const Parameters::All p    = small_brake(2);
    const Geometry<3> geometry = make_brake(p);
    FiniteElementSpace<3> spaces(geometry, 2, true, MPI_COMM_WORLD);
    spaces.distribute();
    const DisplacementOperator<3> stiffness(spaces, bodies_of(p, -1e6, 3e5));
    const BodyMatrices rotor = assemble_body(spaces, {rotor_body}, p.rotor.material, true),
                       pads  = assemble_body(spaces, {upper_pad_body, lower_pad_body},
                                             p.pads.material, false);
    const Matrix sum = sum_of(spaces.rows, {{1, *rotor.K}, {1, *pads.K}, {-1e6, *rotor.M_star}});
    MultiVector expected(spaces.rows, 1);
    for (unsigned int row = spaces.rows.begin; row < spaces.first_local_multiplier; ++row)
    {
      const PetscInt index = row;
      SQUEAL_PETSC(
          MatGetValues(sum, 1, &index, 1, &index, expected.data() + row - spaces.rows.begin));
    }
    CHECK(largest_difference(stiffness.diagonal(), expected) <= 1e-13 * largest_entry(expected));
  }

  TEST_CASE("iterative_statics: multigrid is symmetric and needs the same steps on a finer mesh" *
            doctest::test_suite("slow, two ranks at most, optimised"))
  {
    // Pads hang on penalty springs of the size of their stiffness, E/thickness. The cycle smooths
    // in the same way before and after, so that it is a symmetric matrix. Steps of GMRES to 1e-8
    // from a rough error hardly change when all cells are divided, hanging nodes included: the
    // bounds are 50, and a quarter more on the finer mesh. (33 and 38 were found.)
    Parameters::All p            = small_brake(2);
    p.discretization.rotor_cells = {{5, 36, 1}};
    p.discretization.pad_cells   = {{3, 6, 1}};
    const Geometry<3> geometry   = make_brake(p);
    FiniteElementSpace<3> spaces(geometry, 2, false, MPI_COMM_WORLD);
    refine_under_pad(spaces);
    std::vector<unsigned int> steps;
    for (unsigned int mesh = 0; mesh < 2; ++mesh)
    {
      if (mesh == 1)
        refine_where(spaces, [](const Point<3> &, const types::material_id) { return true; });
      const DisplacementOperator<3> stiffness(spaces, bodies_of(p, 0, 0));
      ContactModel<3> model;
      model.mortar            = false;
      model.penalty_stiffness = E_pad / thickness;
      const Matrix contact    = normal_matrix(Contact<3>(spaces, model));
      DisplacementMultigrid<3> multigrid(spaces, bodies_of(p, 0, 0), stiffness, Multigrid::gamg);
      multigrid.set_up(contact);
      const auto A = [&](const MultiVector &x)
      {
        MultiVector y = stiffness.multiply(x), z = multiply(contact, x);
        for (unsigned int i = 0; i < y.n_local(); ++i)
          y.data()[i] += z.data()[i];
        return y;
      };
      const auto B        = [&](const MultiVector &x) { return multigrid.apply(x); };
      const MultiVector u = some_displacements(spaces.rows, spaces.first_local_multiplier);
      MultiVector v       = u;
      for (unsigned int i = 0; i < v.n_local(); ++i)
        v.data()[i] = std::cos(0.7 * (spaces.rows.begin + i));
      CHECK(std::abs(inner_product(v, B(u)) - inner_product(u, B(v))) <=
            1e-10 * std::sqrt(inner_product(u, B(u)) * inner_product(v, B(v))));
      MultiVector x(spaces.rows, 1);
      const auto n_steps = gmres(A, B, A(u), x, 1e-8, 200);
      REQUIRE(n_steps);
      steps.push_back(*n_steps);
      CHECK(largest_difference(x, u) <= 1e-5 * largest_entry(u));
    }
    CAPTURE(steps[0]);
    CHECK(steps[1] <= 1.25 * steps[0]);
    CHECK(steps[0] < 50);
  }

  TEST_CASE("iterative_statics: the state is that of the direct solver where nodes hang" *
            doctest::test_suite("slow, optimised"))
  {
    // Friction 0.5, contact faces with hanging nodes, pads that lift off. Both solvers to 1e-9 of
    // the largest displacement and multiplier.
    const Parameters::All p    = small_brake(2);
    const Geometry<3> geometry = make_brake(p);
    for (const bool mortar : {true, false})
    {
      CAPTURE(mortar);
      FiniteElementSpace<3> spaces(geometry, 2, mortar, MPI_COMM_WORLD);
      refine_under_pad(spaces);
      ContactModel<3> model;
      model.mortar                  = mortar;
      model.penalty_stiffness       = k_C;
      model.friction.coefficient    = 0.5;
      model.angular_velocity        = 10;
      const BodyMatrices rotor      = assemble_body(spaces, {rotor_body}, p.rotor.material, false),
                         pads       = assemble_body(spaces, {upper_pad_body, lower_pad_body},
                                                    p.pads.material, false);
      const std::vector<Term> terms = {{Origin::elasticity, 0, 1., rotor.K},
                                       {Origin::elasticity, 0, 1., pads.K}};
      const MultiVector load        = assemble_pressure_load(spaces);
      Contact<3> contact(spaces, model), other(spaces, model);
      IterativeStatics<3> solver(spaces, bodies_of(p, 0, 0), {});
      if (mortar)
        for (Contact<3> *c : {&contact, &other})
          c->scale_constraints(solver.stiffness_scale());
      const auto direct    = solve_static_equilibrium({terms, true, load}, contact);
      const auto iterative = solve_static_equilibrium(solver, {{}, true, load}, other);
      CHECK(contact.active_set().hash(MPI_COMM_WORLD) == other.active_set().hash(MPI_COMM_WORLD));
      CHECK(largest_difference(iterative.state, direct.state) <=
            1e-9 * largest_entry(direct.state));
    }
  }

  TEST_CASE("iterative_statics: too few iterations are an error" * doctest::test_suite("slow"))
  {
    const Parameters::All p    = small_brake(2);
    const Geometry<3> geometry = make_brake(p);
    FiniteElementSpace<3> spaces(geometry, 2, true, MPI_COMM_WORLD);
    spaces.distribute();
    Contact<3> contact(spaces, ContactModel<3>());
    IterativeStatics<3> solver(spaces, bodies_of(p, 0, 0), {Multigrid::gamg, 2});
    contact.scale_constraints(solver.stiffness_scale());
    const StaticProblem problem{{}, false, assemble_pressure_load(spaces)};
    CHECK_THROWS_AS(solve_static_equilibrium(solver, problem, contact), SolverError);
  }
} // namespace squeal::tests::iterative_statics_tests
