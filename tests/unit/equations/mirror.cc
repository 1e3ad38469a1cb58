#include "fields.h"

#include <doctest/doctest.h>

#include <squeal/contact/contact.h>
#include <squeal/contact/contact_matrices.h>
#include <squeal/eigen/find_modes.h>
#include <squeal/equations/parity_space.h>
#include <squeal/model/brake_model.h>
namespace squeal::tests::mirror_tests
{
  using namespace dealii;
  using Complex = std::complex<double>;

  namespace
  {
    Parameters::All small_brake(const std::string &arrangement = "both")
    {
      Parameters::All prm;
      prm.discretization.degree      = 2;
      prm.discretization.rotor_cells = {{2, 9, 1}};
      prm.discretization.pad_cells   = {{1, 2, 1}};
      prm.pads.arrangement           = value_named<Arrangement>(arrangement);
      return prm;
    }

    /// No symmetry of its own: all components are different polynomials with odd and even powers.
    Tensor<1, 3> some_field(const Point<3> &x)
    {
      return Tensor<1, 3>({1 + 3 * x[0] - 50 * x[2] + 9 * x[1] * x[2],
                           2 - x[1] + 70 * x[2] * x[2] + x[2], 4 + x[0] * x[1] + 90 * x[2]});
    }

    /// (S u)(x) = R u(R x) with R = diag(1, 1, -1).
    Tensor<1, 3> reflected_field(const Point<3> &x)
    {
      Tensor<1, 3> u = some_field(Point<3>(x[0], x[1], -x[2]));
      u[2]           = -u[2];
      return u;
    }

    double distance(const MultiVector &a, const MultiVector &b)
    {
      return largest_entry(difference(a, b));
    }

    double dot(const MultiVector &a, const MultiVector &b)
    {
      return inner_product(a, b);
    }

    MultiVector scattered_column(const RowRange &rows, const unsigned int seed)
    {
      return block_of(rows, 1,
                      [&](const unsigned int i, const unsigned int) { return scattered(i, seed); });
    }

    /// What the program solves for a brake of a stage, and its reflection.
    struct Brake
    {
      explicit Brake(const Parameters::All &prm)
          : log(MPI_COMM_WORLD), model(make_brake(prm), prm, MPI_COMM_WORLD, log, timer)
      {
        model.distribute();
        model.assemble(prm);
        equations = model.equations();
        problem   = sum_of(equations);
        symmetry  = find_mirror_symmetry(model.spaces());
      }
      Log log;
      PhaseTimer timer;
      BrakeModel<3> model;
      EquationsOfMotion equations;
      QuadraticEigenproblem problem; ///< summed
      std::optional<MirrorSymmetry> symmetry;
    };

    EigensolverOptions window(const double frequency)
    {
      EigensolverOptions options;
      options.max_imaginary = 2 * M_PI * frequency;
      return options;
    }
  } // namespace

  TEST_CASE("mirror: the reflection of a field" * doctest::test_suite("slow"))
  {
    // Nodes stand mirrored, so the interpolant of S u is S applied to that of u. Only
    // displacements: both pads have pressures, which a field does not have.
    for (const bool refined : {false, true})
    {
      CAPTURE(refined);
      const Parameters::All prm  = small_brake();
      const Geometry<3> geometry = make_brake(prm);
      FiniteElementSpace<3> spaces(geometry, 2, true, MPI_COMM_WORLD);
      spaces.distribute();
      if (refined) // both sides alike, with hanging nodes
        refine_where(spaces,
                     [](const Point<3> &x, const types::material_id) { return x[1] > 0.07; });
      const auto symmetry = find_mirror_symmetry(spaces);
      REQUIRE(symmetry);
      const MultiVector u = interpolate(spaces, all_bodies, some_field);
      CHECK(distance(symmetry->reflect(u), interpolate(spaces, all_bodies, reflected_field)) <=
            1e-10);
      // A pressure on the upper pad stands on the lower one.
      const MultiVector x = scattered_column(spaces.rows, 1);
      CHECK(distance(symmetry->reflect(symmetry->reflect(x)), x) == 0);
      const MultiVector ones = constant_multiplier(spaces, 1.);
      CHECK(distance(symmetry->reflect(ones), ones) == 0);
    }
  }

  TEST_CASE("mirror: scenes without the symmetry" * doctest::test_suite("slow"))
  {
    for (const std::string arrangement : {"none", "upper", "both"})
    {
      CAPTURE(arrangement);
      const Parameters::All prm  = small_brake(arrangement);
      const Geometry<3> geometry = make_brake(prm);
      FiniteElementSpace<3> spaces(geometry, 1, true, MPI_COMM_WORLD);
      spaces.distribute();
      CHECK(find_mirror_symmetry(spaces).has_value() == (arrangement != "upper"));
    }
    // Refined on one side only.
    const Parameters::All prm  = small_brake();
    const Geometry<3> geometry = make_brake(prm);
    FiniteElementSpace<3> spaces(geometry, 1, true, MPI_COMM_WORLD);
    spaces.distribute();
    refine_where(spaces, [](const Point<3> &, const types::material_id body)
                 { return body == upper_pad_body; });
    CHECK_FALSE(find_mirror_symmetry(spaces));
    // The strip slides on one side and stands on the other.
    const Geometry<2> strip = make_strip(prm);
    FiniteElementSpace<2> strip_spaces(strip, 1, true, MPI_COMM_WORLD);
    strip_spaces.distribute();
    CHECK_FALSE(find_mirror_symmetry(strip_spaces));
  }

  TEST_CASE("mirror: averaged cells are marked on both sides" * doctest::test_suite("slow"))
  {
    // Indicators 1 on the upper pad, 3 on the lower one, 0.1 z + 7 in the rotor: 2, 2, 7.
    const Parameters::All prm  = small_brake();
    const Geometry<3> geometry = make_brake(prm);
    const FiniteElementSpace<3> spaces(geometry, 1, true, MPI_COMM_WORLD);
    std::vector<double> by_cell, expected;
    for (const auto &cell : spaces.triangulation.active_cell_iterators())
      if (cell->is_locally_owned())
      {
        const auto body = cell->material_id();
        by_cell.push_back(body == upper_pad_body   ? 1
                          : body == lower_pad_body ? 3
                                                   : 7 + 0.1 * cell->center()[2]);
        expected.push_back(body == rotor_body ? 7 : 2);
      }
    average_over_images(spaces, by_cell);
    for (unsigned int i = 0; i < by_cell.size(); ++i)
      CHECK(relative_error(by_cell[i], expected[i]) <= 1e-14);
  }

  TEST_CASE("mirror: half spaces are isometric, orthogonal, and together the whole" *
            doctest::test_suite("slow"))
  {
    const Brake brake(small_brake());
    REQUIRE(brake.symmetry);
    REQUIRE(is_symmetric(brake.equations, *brake.symmetry));
    const ParitySpace plus(*brake.symmetry, true), minus(*brake.symmetry, false);
    CHECK(plus.row_range().size + minus.row_range().size == brake.problem.rows.size);

    const MultiVector y   = scattered_column(plus.row_range(), 3),
                      z   = scattered_column(plus.row_range(), 4),
                      w   = scattered_column(minus.row_range(), 5);
    const MultiVector v_y = plus.expand(y), v_z = plus.expand(z), v_w = minus.expand(w);
    CHECK(relative_error(dot(v_y, v_z), dot(y, z), dot(y, y)) <= 1e-13);
    CHECK(std::abs(dot(v_y, v_w)) <= 1e-13 * dot(v_y, v_y));
    CHECK(relative_error(dot(v_w, v_w), dot(w, w)) <= 1e-13);
    CHECK(distance(brake.symmetry->reflect(v_y), v_y) <= 1e-15);
    MultiVector minus_v_w = v_w;
    for (unsigned int i = 0; i < minus_v_w.n_local(); ++i)
      minus_v_w.data()[i] *= -1;
    CHECK(distance(brake.symmetry->reflect(v_w), minus_v_w) <= 1e-15);

    // y^T (V^T A V) z = (V y)^T A (V z), and nothing between the halves.
    const QuadraticEigenproblem half = plus.restrict(brake.equations);
    const auto check                 = [&](const Matrix &of_half, const Matrix &whole)
    {
      const MultiVector a_v_z = multiply(whole, v_z);
      const double scale      = std::sqrt(dot(v_y, v_y) * dot(a_v_z, a_v_z));
      REQUIRE(scale > 0);
      CHECK(relative_error(bilinear_form(y, of_half, z), dot(v_y, a_v_z), scale) <= 1e-12);
      CHECK(std::abs(dot(v_w, a_v_z)) <= 1e-11 * scale);
      // The product with a basis vector has a entries of two rows at most: no fill.
      CHECK(of_half.n_nonzeros() <= 0.55 * whole.n_nonzeros());
    };
    for (const auto member :
         {&QuadraticEigenproblem::M, &QuadraticEigenproblem::P, &QuadraticEigenproblem::Q})
      check(half.*member, brake.problem.*member);
    REQUIRE(half.has_reference());
    check(half.shifted_reference(1000), brake.problem.shifted_reference(1000));
    // Made along for the first of some frequencies, it is given once and made anew then.
    const QuadraticEigenproblem counted = plus.restrict(brake.equations, {2000, 1000});
    for (const double omega : {2000, 1000, 2000})
      check(counted.shifted_reference(omega), brake.problem.shifted_reference(omega));
    check(counted.Q, brake.problem.Q);
    CHECK(half.n_constraints == brake.problem.n_constraints / 2);
    CHECK(Utilities::MPI::sum(half.n_local_constraints, MPI_COMM_WORLD) ==
          brake.model.spaces().n_multipliers / 2);
    // M vanishes in the rows of pressures, the last ones.
    const MultiVector ones = block_of(half.rows, 1, [](unsigned int, unsigned int) { return 1.; });
    const MultiVector mass = multiply(half.M, ones);
    for (unsigned int i = 0; i < half.rows.n_local(); ++i)
      CHECK((mass.data()[i] == 0) == (i >= half.rows.n_local() - half.n_local_constraints));
  }

  TEST_CASE("mirror: matrices decide" * doctest::test_suite("slow"))
  {
    // The mesh is symmetric; one entry of one pad is not.
    Brake brake(small_brake());
    REQUIRE(brake.symmetry);
    CHECK(is_symmetric(brake.equations, *brake.symmetry));
    const unsigned int row = brake.problem.rows.size / 2;
    brake.equations.terms.push_back(
        {Origin::elasticity, 0, 1e-6 * brake.problem.Q.infinity_norm(),
         std::make_shared<const Matrix>(matrix_of(brake.problem.rows, {{row, row, 1}}))});
    CHECK_FALSE(is_symmetric(brake.equations, *brake.symmetry));
  }

  namespace
  {
    /// Both ways give the same modes; what is said of them is right.
    void check_modes(const Parameters::All &prm, const double frequency)
    {
      const Brake brake(prm);
      const auto solver             = ModeSolver::block_krylov;
      const auto options            = window(frequency);
      const EigenSolution of_whole  = find_modes(solver, brake.equations, options, {}),
                          of_halves = find_modes(solver, brake.equations, options, brake.symmetry);
      const EigenPairs &whole = of_whole.modes, &by_half = of_halves.modes;
      const unsigned int n = whole.size();
      CHECK(whole.parity.empty());
      REQUIRE(by_half.size() == n);
      REQUIRE(by_half.parity.size() == n);
      CHECK(n > 8);
      CHECK(of_halves.proof.n_reference == of_whole.proof.n_reference);
      CHECK(of_halves.cost.factor_memory_mib < of_whole.cost.factor_memory_mib);
      CHECK(std::is_sorted(by_half.lambda.begin(), by_half.lambda.end(), precedes));
      const std::vector<unsigned int> partner = nearest_partners(whole.lambda, by_half.lambda);
      const ComplexMultiVector &x             = by_half.right,
                               s_x(brake.symmetry->reflect(x.re), brake.symmetry->reflect(x.im)),
                               m_x = multiply(brake.problem.M, x);
      const auto form              = biorthogonality(brake.problem, by_half, by_half);
      for (unsigned int j = 0; j < n; ++j)
      {
        const unsigned int k = partner[j];
        CHECK(std::abs(whole.lambda[j] - by_half.lambda[k]) <= 1e-9 * std::abs(whole.lambda[j]));
        CHECK(relative_error(by_half.condition[k], whole.condition[j]) <= 1e-5);
        CHECK(by_half.backward_error[j] <= options.tolerance);
        CHECK(by_half.left_backward_error[j] <= 1e-7);
        const double sign = by_half.parity[j] == Parity::symmetric ? 1 : -1;
        CHECK((sign > 0 || by_half.parity[j] == Parity::antisymmetric));
        MultiVector error(x.row_range(), 1);
        for (unsigned int i = 0; i < error.n_local(); ++i)
          error.data()[i] = std::abs(s_x(i, j) - sign * x(i, j));
        CHECK(largest_entry(error) <= 1e-14 * largest_entry(x.re.columns(j, 1)));
        // x^H M x = 1 and z^H Q'(l) x = 2 l
        CHECK(relative_error(dot(x.re.columns(j, 1), m_x.re.columns(j, 1)) +
                                 dot(x.im.columns(j, 1), m_x.im.columns(j, 1)),
                             1) <= 1e-12);
        CHECK(std::abs(form[j * (n + 1)] - 2. * by_half.lambda[j]) <=
              1e-10 * std::abs(by_half.lambda[j]));
      }
      for (const Parity parity : {Parity::symmetric, Parity::antisymmetric})
        CHECK(std::count(by_half.parity.begin(), by_half.parity.end(), parity) > 0);
    }
  } // namespace

  TEST_CASE("mirror: both spectra are the whole one, mortar" * doctest::test_suite("slow"))
  {
    check_modes(small_brake(), 6000);
  }

  TEST_CASE("mirror: both spectra are the whole one, penalty and free bodies" *
            doctest::test_suite("slow"))
  {
    Parameters::All prm         = small_brake();
    prm.contact.formulation     = Formulation::penalty;
    prm.contact.steady_pressure = SteadyPressure::uniform;
    prm.pads.back_face          = BackFace::free;
    check_modes(prm, 6000);
  }

  TEST_CASE("mirror: double eigenvalues of a conservative problem stay imaginary" *
            doctest::test_suite("slow"))
  {
    // A disc's waves with nodal diameters come in pairs; its halves are symmetric matrices too.
    Parameters::All prm = small_brake("none");
    prm.stage           = Stage::elastic;
    const Brake brake(prm);
    REQUIRE(brake.symmetry);
    REQUIRE_FALSE(brake.problem.has_reference());
    const QuadraticEigenproblem half =
        ParitySpace(*brake.symmetry, false).restrict(brake.equations);
    CHECK(asymmetry(half.rows, half.M) == 0);
    CHECK(asymmetry(half.rows, half.Q) == 0);
    const EigenPairs modes =
        find_modes(ModeSolver::block_krylov, brake.equations, window(6000), brake.symmetry).modes;
    CHECK(modes.parity.size() > 8);
    for (const Complex &l : modes.lambda)
      CHECK(l.real() == 0);
  }

  TEST_CASE(
      "mirror: factors that are kept are those of the halves; no symmetry without a mirror image" *
      doctest::test_suite("slow"))
  {
    const Brake brake(small_brake());
    EigensolverOptions options = window(3000);
    options.keep_factors       = true;
    const auto solver          = ModeSolver::block_krylov;
    const EigenSolution found  = find_modes(solver, brake.equations, options, brake.symmetry);
    CHECK_FALSE(found.reuse.factorization);
    REQUIRE(found.reuse.sectors.size() == 2);
    std::size_t n_modes = 0;
    for (unsigned int h = 0; h < 2; ++h)
    {
      const EigenSolution &half = *found.reuse.sectors[h];
      CHECK(half.reuse.factorization);
      // On all ranks, each with its part.
      const RowRange rows = ParitySpace(*brake.symmetry, h == 0).row_range();
      CHECK(half.modes.right.row_range().size == rows.size);
      CHECK(half.modes.right.row_range().n_local() == rows.n_local());
      n_modes += half.modes.size();
    }
    CHECK(n_modes == found.modes.size());
    const EigenSolution whole = find_modes(solver, brake.equations, options, std::nullopt);
    CHECK(whole.modes.parity.empty());
    CHECK(whole.reuse.sectors.empty());
    CHECK(whole.reuse.factorization);
    CHECK_FALSE(Brake(small_brake("upper")).symmetry);
  }

  TEST_CASE("mirror: the contact of surfaces whose edges coincide is symmetric to rounding" *
            doctest::test_suite("slow"))
  {
    // The rotor's edges run along the pads'. Nodes of degree 3 are mirror images to rounding only,
    // which must not decide how the faces are cut: the quadrature of curved pieces is exact to
    // 1e-8.
    Parameters::All prm            = small_brake();
    prm.discretization.degree      = 3;
    prm.discretization.rotor_cells = {{5, 36, 1}};
    prm.discretization.pad_cells   = {{3, 6, 1}};
    const Geometry<3> geometry     = make_brake(prm);
    FiniteElementSpace<3> spaces(geometry, 3, true, MPI_COMM_WORLD);
    spaces.distribute();
    const auto symmetry = find_mirror_symmetry(spaces);
    REQUIRE(symmetry);
    ContactModel<3> model;
    model.friction.coefficient = 0.5;
    model.angular_velocity     = 20;
    const Contact<3> contact(spaces, model);
    const MultiVector x = scattered_column(spaces.rows, 1);
    const auto check    = [&](const Matrix &matrix)
    {
      const MultiVector a_x = multiply(matrix, x);
      CHECK(distance(symmetry->reflect(multiply(matrix, symmetry->reflect(x))), a_x) <=
            1e-12 * largest_entry(a_x));
    };
    check(normal_matrix(contact));
    check(friction_matrix(contact, contact.uniform_pressure(1e6)));
  }

  TEST_CASE("mirror: half spaces on a group of ranks" * doctest::test_suite("slow"))
  {
    // The same half as with every rank's own rows, only placed elsewhere.
    const Brake brake(small_brake());
    REQUIRE(brake.symmetry);
    const unsigned int n_ranks = Utilities::MPI::n_mpi_processes(MPI_COMM_WORLD);
    const RowRange &whole      = brake.problem.rows;
    const MultiVector x        = scattered_column(whole, 6);
    for (const bool last : {false, true})
      for (const bool symmetric : {true, false})
      {
        CAPTURE(last);
        CAPTURE(symmetric);
        const unsigned int n = (n_ranks + 1) / 2;
        const Subcommunicator group(MPI_COMM_WORLD, last ? n_ranks - n : 0, n);
        const ParitySpace own(*brake.symmetry, symmetric), space(*brake.symmetry, symmetric, group);
        CHECK(space.is_here() == group.has_this_rank());
        CHECK(space.row_range().size == own.row_range().size);
        CHECK(Utilities::MPI::sum(space.row_range().n_local(), MPI_COMM_WORLD) ==
              own.row_range().size);
        // V V^T x is the part of x in the half.
        MultiVector part  = brake.symmetry->reflect(x);
        const double sign = symmetric ? 1 : -1;
        for (unsigned int i = 0; i < part.n_local(); ++i)
          part.data()[i] = (x.data()[i] + sign * part.data()[i]) / 2;
        CHECK(distance(own.expand(own.restrict(x)), part) <= 1e-15);
        CHECK(distance(space.expand(space.restrict(x)), part) <= 1e-15);
        // V (V^T A V) V^T x
        const QuadraticEigenproblem half  = own.restrict(brake.equations),
                                    there = space.restrict(brake.equations);
        CHECK(there.n_constraints == half.n_constraints);
        CHECK(Utilities::MPI::sum(there.n_local_constraints, MPI_COMM_WORLD) ==
              brake.model.spaces().n_multipliers / 2);
        for (const auto member :
             {&QuadraticEigenproblem::M, &QuadraticEigenproblem::P, &QuadraticEigenproblem::Q})
        {
          const MultiVector product = own.expand(multiply(half.*member, own.restrict(x)));
          MultiVector y             = space.restrict(x);
          if (space.is_here())
            y = multiply(there.*member, y);
          CHECK(distance(space.expand(y), product) <= 1e-14 * largest_entry(product));
        }
      }
  }

  TEST_CASE("mirror: the errors of groups that work apart" * doctest::test_suite("slow"))
  {
    // The first rank's error is thrown on all, of its kind.
    const unsigned int rank = Utilities::MPI::this_mpi_process(MPI_COMM_WORLD);
    CHECK_NOTHROW(work_apart(MPI_COMM_WORLD, []() {}));
    CHECK_THROWS_WITH_AS(work_apart(MPI_COMM_WORLD,
                                    [&]()
                                    {
                                      if (rank == 0)
                                        throw SingularMatrix("of rank 0");
                                    }),
                         "of rank 0", SingularMatrix);
    CHECK_THROWS_AS(work_apart(MPI_COMM_WORLD, []() { throw InputError("on all"); }), InputError);
  }

  TEST_CASE("mirror: the static equilibrium by halves is that of the whole" *
            doctest::test_suite("slow"))
  {
    // Friction tilts the pads: at this coefficient they lift off at one edge.
    Parameters::All prm              = small_brake();
    prm.discretization.rotor_cells   = {{2, 12, 1}};
    prm.discretization.pad_cells     = {{2, 4, 1}};
    prm.contact.friction.coefficient = 0.7;
    const Brake halves(prm);
    prm.eigenproblem.mirror_symmetry = false;
    const Brake whole(prm);
    const StaticEquilibrium &a = *halves.model.equilibrium(), &b = *whole.model.equilibrium();
    REQUIRE(a.iterations.size() == b.iterations.size());
    CHECK(a.iterations.size() > 1);
    for (unsigned int k = 0; k < a.iterations.size(); ++k)
      CHECK(a.iterations[k].n_active == b.iterations[k].n_active);
    CHECK(distance(a.state, b.state) <= 1e-11 * largest_entry(b.state));
    CHECK(distance(halves.symmetry->reflect(a.state), a.state) <= 1e-14 * largest_entry(a.state));
    REQUIRE_FALSE(b.edge.releasing.empty());
    REQUIRE_FALSE(b.edge.closing.empty());
    CHECK(a.edge.releasing == b.edge.releasing);
    CHECK(a.edge.closing == b.edge.closing);
    for (const auto member : {&ContactEdge::slack, &ContactEdge::pressure})
    {
      const std::vector<double> &x = (a.edge.*member).values, &y = (b.edge.*member).values;
      REQUIRE(x.size() == y.size());
      double largest = 0, error = 0;
      for (unsigned int k = 0; k < x.size(); ++k)
      {
        largest = std::max(largest, std::abs(y[k]));
        error   = std::max(error, std::abs(x[k] - y[k]));
      }
      CHECK(error <= 1e-10 * largest);
    }
  }

  TEST_CASE("mirror: a static state without symmetry is solved for as a whole" *
            doctest::test_suite("slow"))
  {
    // The mesh is symmetric, the gaps are not.
    Parameters::All prm     = small_brake();
    prm.contact.initial_gap = "if(z > 0, 1e-6, 0)";
    const Brake by_default(prm);
    prm.eigenproblem.mirror_symmetry = false;
    const Brake whole(prm);
    const MultiVector &a = by_default.model.equilibrium()->state,
                      &b = whole.model.equilibrium()->state;
    CHECK(distance(a, b) <= 1e-11 * largest_entry(b));
    CHECK(distance(by_default.symmetry->reflect(a), a) > 1e-6 * largest_entry(a));
  }
} // namespace squeal::tests::mirror_tests
