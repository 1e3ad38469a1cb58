#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/eigen/nonlinear_eigensolver.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/projected_nonlinear.h>

#include <complex>

namespace squeal::tests::nonlinear_eigensolver_tests
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Masses of 1 between springs of stiffness 1 from wall to wall, as often as @p copies, without
    /// a connection between the copies.
    std::vector<Entry> chains(const unsigned int n, const unsigned int copies)
    {
      std::vector<Entry> entries;
      for (unsigned int first = 0; first < n * copies; first += n)
        for (unsigned int i = 0; i < n; ++i)
        {
          entries.push_back({first + i, first + i, 2.});
          if (i > 0)
          {
            entries.push_back({first + i, first + i - 1, -1.});
            entries.push_back({first + i - 1, first + i, -1.});
          }
        }
      return entries;
    }

    double frequency_of_chain(const unsigned int n, const unsigned int j)
    {
      return 2 * std::sin(j * M_PI / (2 * (n + 1)));
    }

    EquationsOfMotion equations_of(const RowRange &rows, const std::vector<Entry> &stiffness,
                                   const StiffnessFactor &factor)
    {
      std::vector<Entry> unit;
      for (unsigned int i = 0; i < rows.size; ++i)
        unit.push_back({i, i, 1.});
      const auto shared = [&](const std::vector<Entry> &entries)
      { return std::make_shared<const Matrix>(matrix_of(rows, entries)); };
      EquationsOfMotion equations;
      equations.rows           = rows;
      equations.reference      = EquationsOfMotion::Reference::symmetric_part;
      equations.reference_name = "the symmetric part";
      const auto k             = shared(stiffness);
      equations.terms = {{Origin::inertia, 2, 1., shared(unit)}, {Origin::elasticity, 0, 1., k}};
      equations.relaxation = {{Origin::material_damping, 1., k, factor}};
      return equations;
    }

    EigenSolution solve(const EquationsOfMotion &equations, const double max_imaginary,
                        const ModeSolver solver)
    {
      EigensolverOptions options;
      options.max_imaginary = max_imaginary;
      return NonlinearEigensolver(make_eigensolver(solver))
          .solve(sum_of(equations.frozen(max_imaginary)), options);
    }

    /// The root l of l^2 + w^2 f(l) = 0 near i w sqrt(f(i w)), by Newton's method.
    Complex root(const double w, const StiffnessFactor &factor)
    {
      Complex l = Complex(0, w) * std::sqrt(factor(Complex(0, w)));
      for (unsigned int step = 0; step < 50; ++step)
        l -= (l * l + w * w * factor(l)) / (2. * l + w * w * factor.derivative(l));
      return l;
    }
  } // namespace

  TEST_CASE("nonlinear_eigensolver: a chain of one viscoelastic material has a scalar equation for "
            "each mode")
  {
    StiffnessFactor hysteresis, prony, zener;
    hysteresis.loss_factor   = 0.2;
    prony.prony              = {{0.5, 1.5}, {0.8, 0.3}};
    zener.zener              = {30, 0.05, 0.7};
    constexpr unsigned int n = 24;
    for (const StiffnessFactor &factor : {hysteresis, prony, zener})
      for (const unsigned int copies : {1, 2}) // two: each eigenvalue is double
        for (const ModeSolver solver : {ModeSolver::block_krylov, ModeSolver::dense})
        {
          std::vector<Complex> expected;
          double highest = 0;
          for (unsigned int j = 1; j <= 8; ++j)
          {
            const Complex l = root(frequency_of_chain(n, j), factor);
            expected.insert(expected.end(), copies, l);
            highest = l.imag();
          }
          const double next          = root(frequency_of_chain(n, 9), factor).imag(),
                       max_imaginary = (highest + next) / 2;
          const EquationsOfMotion equations =
              equations_of(even_rows(n * copies), chains(n, copies), factor);
          const EigenSolution found = solve(equations, max_imaginary, solver);
          REQUIRE(found.modes.size() == expected.size());
          for (unsigned int j = 0; j < expected.size(); ++j)
          {
            CHECK(std::abs(found.modes.lambda[j] - expected[j]) <= 1e-10 * std::abs(expected[j]));
            CHECK(found.modes.backward_error[j] <= 1e-9);
            CHECK(found.modes.left_backward_error[j] <= 1e-9);
          }
          // x is a real vector of the chain up to a factor, z the same: with x^H x = 1 and Q'(l) =
          // 2
          // l
          // + w^2 f'(l) the condition number is |2 l| / |2 l + w^2 f'(l)|.
          for (unsigned int j = 0; copies == 1 && j < expected.size(); ++j)
          {
            const Complex l    = expected[j];
            const double w     = frequency_of_chain(n, 1 + j / copies);
            const double exact = std::abs(2. * l / (2. * l + w * w * factor.derivative(l)));
            CHECK(std::abs(found.modes.condition[j] - exact) <= 1e-6 * exact);
          }
          // z^H Q'(l) x = 2 l for each mode, and the others are biorthogonal.
          const QuadraticEigenproblem problem = sum_of(equations.frozen(max_imaginary));
          const std::vector<Complex> form     = biorthogonality(problem, found.modes, found.modes);
          for (unsigned int i = 0; i < expected.size(); ++i)
            for (unsigned int j = 0; j < expected.size(); ++j)
              CHECK(std::abs(form[i + expected.size() * j] - (i == j ? 2. * expected[i] : 0.)) <=
                    1e-6 * std::abs(expected[i]));
        }
  }

  TEST_CASE("nonlinear_eigensolver: unsymmetric damping by parts of a structure")
  {
    // Only every third mass hangs on a spring that relaxes: modes are complex. Dense Newton
    // iterations on the whole problem confirm each mode; their number is that of the chain.
    StiffnessFactor factor;
    factor.loss_factor          = 0.05;
    factor.prony                = {{0.4, 2.}};
    constexpr unsigned int n    = 30;
    EquationsOfMotion equations = equations_of(even_rows(n), chains(n, 1), factor);
    std::vector<Entry> springs;
    for (unsigned int i = 0; i < n; i += 3)
      springs.push_back({i, i, 0.3});
    const auto k = std::make_shared<const Matrix>(matrix_of(equations.rows, springs));
    equations.terms.push_back({Origin::elasticity, 0, 1., k});
    equations.relaxation    = {{Origin::material_damping, 1., k, factor}};
    const EigenSolution few = solve(equations, 1.2, ModeSolver::block_krylov),
                        all = solve(equations, 1.2, ModeSolver::dense);
    REQUIRE(few.modes.size() == all.modes.size());
    REQUIRE(few.modes.size() > 5);
    for (unsigned int j = 0; j < all.modes.size(); ++j)
    {
      CHECK(std::abs(few.modes.lambda[j] - all.modes.lambda[j]) <= 1e-10);
      CHECK(few.modes.lambda[j].real() < 0);
      CHECK(few.modes.condition[j] >= 0.9);
    }
  }

  TEST_CASE("nonlinear_eigensolver: modes of a chain that are damped by ratios of their own")
  {
    // M = I: the vectors of the chain, sin(j pi i/(n + 1)), with (l^2 + 2 zeta w l + w^2) = 0;
    // those without a ratio are not damped.
    constexpr unsigned int n = 24, n_damped = 6;
    const auto low_rank         = std::make_shared<LowRank>();
    EquationsOfMotion equations = equations_of(even_rows(n), chains(n, 1), StiffnessFactor());
    low_rank->vectors           = MultiVector(equations.rows, n_damped);
    std::vector<Complex> expected;
    for (unsigned int j = 1; j <= 9; ++j)
    {
      const double w = frequency_of_chain(n, j), zeta = j <= n_damped ? 0.01 * j : 0;
      expected.emplace_back(-zeta * w, w * std::sqrt(1 - zeta * zeta));
      if (j > n_damped)
        continue;
      low_rank->weights.push_back(2 * zeta * w);
      for (unsigned int i = equations.rows.begin; i < equations.rows.end; ++i)
        low_rank->vectors.column(j - 1)[i - equations.rows.begin] =
            std::sqrt(2. / (n + 1)) * std::sin(j * M_PI * (i + 1) / (n + 1));
    }
    StiffnessFactor dashpot;
    dashpot.viscosity    = 1;
    equations.relaxation = {{Origin::material_damping, 1.,
                             std::make_shared<const Matrix>(make_matrix(low_rank)), dashpot,
                             low_rank}};
    for (const ModeSolver solver : {ModeSolver::block_krylov, ModeSolver::dense})
    {
      const EigenSolution found =
          solve(equations, 0.5 * (expected.back().imag() + frequency_of_chain(n, 10)), solver);
      REQUIRE(found.modes.size() == expected.size());
      for (unsigned int j = 0; j < expected.size(); ++j)
        CHECK(std::abs(found.modes.lambda[j] - expected[j]) <= 1e-10);
    }
  }

  TEST_CASE(
      "eigenproblem: equations with relaxation are no quadratic problem before they are frozen")
  {
    StiffnessFactor factor;
    factor.loss_factor                = 0.1;
    const EquationsOfMotion equations = equations_of(even_rows(4), chains(4, 1), factor);
    CHECK_THROWS_AS(sum_of(equations), std::logic_error);
    // The frozen moduli are real: all of the damping is left.
    const QuadraticEigenproblem problem = sum_of(equations.frozen(0.7));
    REQUIRE(problem.frozen.size() == 1);
    CHECK(std::abs(problem.frozen[0].h(Complex(0, 0.7)) - Complex(0, 0.1)) <= 1e-15);
    CHECK(std::abs(problem.frozen[0].h(Complex(0, 0.35)) - Complex(0, 0.1)) <= 1e-15);
  }
} // namespace squeal::tests::nonlinear_eigensolver_tests
