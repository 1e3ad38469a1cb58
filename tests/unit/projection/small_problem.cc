#include "../helpers.h"

#include <doctest/doctest.h>

#include <squeal/base/errors.h>
#include <squeal/projection/small_problem.h>

namespace squeal::tests::small_problem
{
  using Complex = std::complex<double>;

  namespace
  {
    /// One of SmallProblem's pairs, in lists.
    struct DensePair
    {
      Complex lambda;
      std::vector<Complex> vector, left;
    };
    std::vector<DensePair> quadratic_eigenpairs(const DenseMatrix &m, const DenseMatrix &p,
                                                const DenseMatrix &q, const double shift,
                                                const double scale, const bool with_left = false)
    {
      const SmallPairs pairs = SmallProblem{m, p, q, {}, nullptr}.solve(shift, scale, with_left);
      std::vector<DensePair> result;
      for (unsigned int k = 0; k < pairs.size(); ++k)
      {
        result.push_back(
            {pairs.lambda[k], ComplexDenseMatrix(pairs.right.columns(k, 1)).values, {}});
        if (with_left)
          result.back().left = ComplexDenseMatrix(pairs.left.columns(k, 1)).values;
      }
      return result;
    }

    /// Row by row, as one writes a matrix.
    DenseMatrix matrix(const unsigned int n, const std::vector<double> &rows)
    {
      DenseMatrix result(n, rows.size() / n);
      for (unsigned int i = 0; i < n; ++i)
        for (unsigned int j = 0; j < result.n_columns; ++j)
          result(i, j) = rows[i * result.n_columns + j];
      return result;
    }

    /// |(l^2 M + l P + Q) x| / ((|l|^2 |M| + |l| |P| + |Q|) |x|) in the norms of largest entries.
    double residual(const DensePair &pair, const DenseMatrix &m, const DenseMatrix &p,
                    const DenseMatrix &q)
    {
      double largest = 0, size = 0;
      for (unsigned int i = 0; i < m.n_rows; ++i)
      {
        Complex r = 0;
        for (unsigned int j = 0; j < m.n_rows; ++j)
          r += (pair.lambda * pair.lambda * m(i, j) +
                (p.n_rows > 0 ? pair.lambda * p(i, j) : Complex(0)) + q(i, j)) *
               pair.vector[j];
        largest = std::max(largest, std::abs(r));
        size    = std::max(size, std::abs(pair.vector[i]));
      }
      const double l = std::abs(pair.lambda);
      return largest / size /
             (l * l * m.largest_entry() + l * p.largest_entry() + q.largest_entry());
    }

    /// The distance to the nearest computed eigenvalue.
    double distance(const std::vector<DensePair> &pairs, const Complex lambda)
    {
      double nearest = 1e300;
      for (const DensePair &pair : pairs)
        nearest = std::min(nearest, std::abs(pair.lambda - lambda));
      return nearest;
    }

    const DenseMatrix none;

    // Ziegler's pendulum, T9 of the reference: M, D = b [2 -1; -1 1], K + N = [2-p, p-1; -1, 1]
    const DenseMatrix ziegler_mass = matrix(2, {3, 1, 1, 1});
    DenseMatrix ziegler_damping(const double b)
    {
      return matrix(2, {2 * b, -b, -b, b});
    }
    DenseMatrix ziegler_stiffness(const double p)
    {
      return matrix(2, {2 - p, p - 1, -1, 1});
    }
  } // namespace

  TEST_CASE(
      "small problem: Ziegler's pendulum without damping flutters as the quadratic formula says")
  {
    // det(L M + K) = 2 L^2 + (7 - 2p) L + 1 with L = l^2. At p = 2.2 the discriminant 2.6^2 - 8 is
    // negative: L = (-2.6 +- i sqrt(1.24))/4, and l = +- sqrt(L): two eigenvalues with Im l > 0, of
    // opposite real parts.
    const DenseMatrix stiffness = ziegler_stiffness(2.2);
    const Complex l             = std::sqrt(Complex(-2.6, std::sqrt(1.24)) / 4.);
    // The reference table prints +-0.16897749 +- 0.82374352 i.
    CHECK(std::abs(l - Complex(0.16897749, 0.82374352)) <= 1e-8);

    for (const double shift : {0., 0.3, -0.2})
      for (const bool zero_matrix : {false, true}) // an explicit zero takes the general path
      {
        CAPTURE(shift);
        CAPTURE(zero_matrix);
        const DenseMatrix p = zero_matrix ? DenseMatrix(2, 2) : none;
        const auto pairs    = quadratic_eigenpairs(ziegler_mass, p, stiffness, shift, 0.8);
        CHECK(pairs.size() == 2);
        CHECK(distance(pairs, l) <= 1e-14);
        CHECK(distance(pairs, -std::conj(l)) <= 1e-14);
        for (const DensePair &pair : pairs)
          CHECK(residual(pair, ziegler_mass, p, stiffness) <= 1e-14);
      }
  }

  TEST_CASE("small problem: without a velocity term eigenvalues come in exact +- pairs, "
            "oscillations are exactly "
            "imaginary")
  {
    // Below p_cr = 7/2 - sqrt 2 = 2.0858 both L are negative real: at p = 1, 2 L^2 + 5 L + 1 = 0.
    const auto below = quadratic_eigenpairs(ziegler_mass, none, ziegler_stiffness(1), 0, 1);
    CHECK(below.size() == 2);
    for (const double sign : {-1., 1.})
      CHECK(distance(below, {0, std::sqrt((5 + sign * std::sqrt(17.)) / 4)}) <= 1e-14);
    for (const DensePair &pair : below)
      CHECK(pair.lambda.real() == 0);

    const auto flutter = quadratic_eigenpairs(ziegler_mass, none, ziegler_stiffness(2.2), 0, 1);
    CHECK(flutter.size() == 2);
    CHECK(flutter[0].lambda == -std::conj(flutter[1].lambda));

    // Divergence: at p = 5, 2 L^2 - 3 L + 1 = 0 has L = 1/2 and 1, all four l real and all four are
    // listed.
    const auto divergence = quadratic_eigenpairs(ziegler_mass, none, ziegler_stiffness(5), 0, 1);
    CHECK(divergence.size() == 4);
    for (const double l : {1., -1., std::sqrt(0.5), -std::sqrt(0.5)})
      CHECK(distance(divergence, l) <= 1e-14);
  }

  TEST_CASE("small problem: Ziegler's pendulum with damping")
  {
    // b = 0.1, p = 2: 0.04821683 +- 0.67592482 i (reference T9). trace(M^-1 D) = 7 b / 2 and det K
    // / det M = 1/2 fix sum and product of the four eigenvalues, hence the other pair.
    const double b            = 0.1;
    const DenseMatrix damping = ziegler_damping(b), stiffness = ziegler_stiffness(2);
    for (const double shift : {0., 0.3})
    {
      CAPTURE(shift);
      const auto pairs = quadratic_eigenpairs(ziegler_mass, damping, stiffness, shift, 1);
      CHECK(pairs.size() == 2);
      CHECK(distance(pairs, {0.04821683, 0.67592482}) <= 1e-8);
      double sum = 0, product = 1;
      for (const DensePair &pair : pairs)
      {
        CHECK(pair.lambda.imag() > 0);
        CHECK(residual(pair, ziegler_mass, damping, stiffness) <= 1e-14);
        sum += 2 * pair.lambda.real();
        product *= std::norm(pair.lambda);
      }
      CHECK(std::abs(sum + 3.5 * b) <= 1e-14);
      CHECK(std::abs(product - 0.5) <= 1e-14);
    }

    // Ziegler's paradox: the border is at p_cr(b) = 41/28 + b^2/2 with omega = sqrt(2/7), far below
    // that without damping.
    const auto border =
        quadratic_eigenpairs(ziegler_mass, damping, ziegler_stiffness(41. / 28 + b * b / 2), 0, 1);
    CHECK(distance(border, {0, std::sqrt(2. / 7)}) <= 1e-14);
  }

  TEST_CASE("small problem: friction-type system")
  {
    // M = I, K = [11, -3 + 5 mu; -3, 9]: L^2 + 20 L + 90 + 15 mu = 0, L = -10 +- sqrt(10 - 15 mu):
    // coalescence at mu_c = 2/3 with omega = sqrt 10; at mu = 1, l = sqrt(-10 + i sqrt 5) =
    // 0.35139064 + 3.18174094 i.
    const DenseMatrix identity = matrix(2, {1, 0, 0, 1});
    const auto stiffness = [](const double mu) { return matrix(2, {11, -3 + 5 * mu, -3, 9}); };

    const auto below = quadratic_eigenpairs(identity, none, stiffness(0.5), 0, 3);
    for (const double sign : {-1., 1.})
      CHECK(distance(below, {0, std::sqrt(10 + sign * std::sqrt(2.5))}) <= 1e-14);

    // A double eigenvalue is accurate to the square root of rounding.
    for (const DensePair &pair : quadratic_eigenpairs(identity, none, stiffness(2. / 3), 0, 3))
      CHECK(std::abs(pair.lambda - Complex(0, std::sqrt(10.))) <= 1e-7);

    const auto above = quadratic_eigenpairs(identity, none, stiffness(1), 0, 3);
    CHECK(distance(above, {0.35139064, 3.18174094}) <= 1e-8);
    CHECK(distance(above, std::sqrt(Complex(-10, std::sqrt(5.)))) <= 1e-14);
    CHECK(distance(above, {-0.35139064, 3.18174094}) <= 1e-8);

    // Mass-proportional damping P = c I: l^2 + c l - L = 0 for the same L.
    const double c    = 0.4;
    const auto damped = quadratic_eigenpairs(identity, matrix(2, {c, 0, 0, c}), stiffness(1), 0, 3);
    for (const Complex root : {std::sqrt(Complex(c * c / 4 - 10, std::sqrt(5.))),
                               std::sqrt(Complex(c * c / 4 - 10, -std::sqrt(5.)))})
      CHECK(distance(damped, -c / 2 + (root.imag() > 0 ? root : -root)) <= 1e-14);
  }

  TEST_CASE("small problem: infinite eigenvalues of a singular mass matrix are left out")
  {
    // Static condensation of the massless component: M = diag(1, 0), K = [2 1; 1 2] leaves k = 2 -
    // 1/2.
    const DenseMatrix mass = matrix(2, {1, 0, 0, 0}), stiffness = matrix(2, {2, 1, 1, 2});
    const auto plain = quadratic_eigenpairs(mass, none, stiffness, 0, 1);
    CHECK(plain.size() == 1);
    CHECK(distance(plain, {0, std::sqrt(1.5)}) <= 1e-14);
    const auto shifted = quadratic_eigenpairs(mass, none, stiffness, 0.5, 1);
    CHECK(shifted.size() == 1);
    CHECK(distance(shifted, {0, std::sqrt(1.5)}) <= 1e-14);

    // Damping on the mass only: l^2 + 0.2 l + 1.5 = 0.
    const auto damped = quadratic_eigenpairs(mass, matrix(2, {0.2, 0, 0, 0}), stiffness, 0, 1);
    CHECK(damped.size() == 1);
    CHECK(distance(damped, {-0.1, std::sqrt(1.49)}) <= 1e-14);

    // A dashpot without mass gives one real eigenvalue: M = diag(1, 0), P = diag(0, 3), K = diag(2,
    // 6).
    const auto dashpot =
        quadratic_eigenpairs(mass, matrix(2, {0, 0, 0, 3}), matrix(2, {2, 0, 0, 6}), 0, 1);
    CHECK(dashpot.size() == 2);
    CHECK(distance(dashpot, {0, std::sqrt(2.)}) <= 1e-14);
    CHECK(distance(dashpot, -2.) <= 1e-14);

    // A constraint x_2 = 0 with its multiplier has infinite eigenvalues in Jordan blocks; what is
    // left is the oscillator x_1: M = diag(1, 1, 0), K = [4 1 0; 1 5 1; 0 1 0], l = 2 i.
    const DenseMatrix saddle_mass = matrix(3, {1, 0, 0, 0, 1, 0, 0, 0, 0});
    const DenseMatrix saddle      = matrix(3, {4, 1, 0, 1, 5, 1, 0, 1, 0});
    CHECK(distance(quadratic_eigenpairs(saddle_mass, none, saddle, 0, 2), {0, 2}) <= 1e-14);
    CHECK(distance(quadratic_eigenpairs(saddle_mass, none, saddle, 0.5, 2), {0, 2}) <= 1e-14);
  }

  namespace
  {
    // M = v v^T of rank 1 in three dimensions, K = diag(1, 2, 3): one finite pair,
    // omega^2 = 1 / (v^T K^-1 v) with v = (0.1, 0.7, 0.3): 1 / (0.01 + 0.245 + 0.03) = 1 / 0.285.
    std::vector<DensePair> rank_one_pairs(const double shift)
    {
      const std::vector<double> v = {0.1, 0.7, 0.3};
      DenseMatrix mass(3, 3);
      for (unsigned int i = 0; i < 3; ++i)
        for (unsigned int j = 0; j < 3; ++j)
          mass(i, j) = v[i] * v[j];
      return quadratic_eigenpairs(mass, none, matrix(3, {1, 0, 0, 0, 2, 0, 0, 0, 3}), shift, 2);
    }
  } // namespace

  TEST_CASE("small problem: a mass matrix that is singular only up to rounding")
  {
    for (const double shift : {0., 0.2})
      CHECK(distance(rank_one_pairs(shift), {0, std::sqrt(1 / 0.285)}) <= 1e-14);
  }

  TEST_CASE("small problem: infinite eigenvalues that rounding makes finite are left out")
  {
    CHECK(rank_one_pairs(0).size() == 1);
    CHECK(rank_one_pairs(0.2).size() == 1);
  }

  TEST_CASE("small problem: constraints in unknowns that mix displacements and multipliers")
  {
    // A damped chain of 60 masses, every fifth held by a multiplier, in coordinates that are
    // reflected, A -> H A H: what M does not hold is no longer exactly zero. Runs of four masses
    // between walls, k = 1e6: omega^2 = 4 k sin^2(j pi / 10).
    const unsigned int n_masses = 60, n_held = 12, n = n_masses + n_held;
    DenseMatrix mass(n, n), damping(n, n), stiffness(n, n), reflection(n, n);
    const double k = 1e6, c = 20;
    for (unsigned int i = 0; i < n_masses; ++i)
    {
      mass(i, i)      = 1;
      damping(i, i)   = c;
      stiffness(i, i) = 2 * k;
      if (i > 0)
        stiffness(i, i - 1) = stiffness(i - 1, i) = -k;
    }
    for (unsigned int h = 0; h < n_held; ++h)
      stiffness(n_masses + h, 5 * h + 4) = stiffness(5 * h + 4, n_masses + h) = k;
    double square = 0;
    for (unsigned int i = 0; i < n; ++i)
      square += std::pow(scattered(i, 5), 2);
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int j = 0; j < n; ++j)
        reflection(i, j) = (i == j) - 2 * scattered(i, 5) * scattered(j, 5) / square;
    const auto reflected = [&](const DenseMatrix &a) { return reflection * a * reflection; };
    for (const double shift : {150., 1500.})
      for (const bool with_left : {false, true})
      {
        const auto pairs = quadratic_eigenpairs(reflected(mass), reflected(damping),
                                                reflected(stiffness), shift, 1500, with_left);
        CHECK(pairs.size() == n_masses - n_held);
        for (unsigned int j = 1; j <= 4; ++j)
        {
          const double omega_square = 4 * k * std::pow(std::sin(j * M_PI / 10), 2);
          CHECK(distance(pairs, {-c / 2, std::sqrt(omega_square - c * c / 4)}) <= 1e-9 * 1500);
        }
      }
  }

  TEST_CASE("small problem: zero eigenvalues need a shift")
  {
    // Two unit masses joined by a spring of stiffness 1: l = 0 (double) and l = i sqrt 2.
    const DenseMatrix identity = matrix(2, {1, 0, 0, 1}), free = matrix(2, {1, -1, -1, 1});
    CHECK_THROWS_AS(quadratic_eigenpairs(identity, none, free, 0, 1), SolverError);
    const auto pairs = quadratic_eigenpairs(identity, none, free, 0.1, 1);
    // Rounding is amplified by the nearness of the shift to the zero, 1/0.1^2.
    CHECK(distance(pairs, {0, std::sqrt(2.)}) <= 2e-13);
    // The double zero is defective: rounding spreads it to the square root of rounding.
    CHECK(distance(pairs, 0) <= 1e-7);

    CHECK(quadratic_eigenpairs(none, none, none, 0, 1).empty());
  }

  TEST_CASE("small problem: pairs nearby are corrected together, or left as they are")
  {
    // A damped chain with circulatory forces; pairs of a softer one are where the search begins.
    constexpr unsigned int n = 12;
    const auto chain         = [](const double stiffness)
    {
      SmallProblem problem{DenseMatrix(n, n), DenseMatrix(n, n), DenseMatrix(n, n), {}, nullptr};
      for (unsigned int i = 0; i < n; ++i)
      {
        problem.m(i, i) = 1;
        problem.p(i, i) = 0.02;
        problem.q(i, i) = stiffness * (2 + 0.1 * i);
        if (i > 0)
        {
          problem.q(i, i - 1) = -0.9;
          problem.q(i - 1, i) = -1.1;
        }
      }
      return problem;
    };
    const SmallProblem problem = chain(1);
    const SmallPairs expected  = problem.solve(0, 1, true);
    SmallPairs pairs           = chain(1.001).solve(0, 1, true);
    REQUIRE(pairs.size() == n);
    const SmallPairs before = pairs;
    CHECK(problem.improve(pairs, {3, 1e-8}));
    for (unsigned int k = 0; k < n; ++k)
    {
      double nearest = 1;
      for (const Complex &l : expected.lambda)
        nearest = std::min(nearest, std::abs(l - pairs.lambda[k]));
      CHECK(nearest <= 1e-12);
      const ComplexDenseMatrix at = problem.at(pairs.lambda[k]);
      CHECK((at * pairs.right.columns(k, 1)).largest_entry() <= 1e-9);
      CHECK((at.transpose() * pairs.left.columns(k, 1)).largest_entry() <= 1e-9);
      const ComplexDenseMatrix h    = problem.derivative(pairs.lambda[k]),
                               next = problem.at(pairs.lambda[k] + 1e-6);
      ComplexDenseMatrix slope      = next;
      slope -= at;
      slope.add(-1e-6, h);
      CHECK(slope.largest_entry() <= 2e-12); // l^2 M
    }
    // Beyond the disc, and where two begin at one
    pairs = before;
    CHECK(!problem.improve(pairs, {0.5, 1e-8}));
    CHECK(pairs.lambda == before.lambda);
    pairs = before.select({0, 0});
    CHECK(!problem.improve(pairs, {3, 1e-8}));
    CHECK(pairs.right.values == before.select({0, 0}).right.values);
  }

  TEST_CASE("small problem: left vectors come with the right ones, of the same eigenvalue")
  {
    // Flutter, divergence, and a system whose left vectors differ much from the right ones; by l^2,
    // by the companion matrix, and at a shift.
    for (const double load : {1., 2.2, 5.})
      for (const double b : {0., 0.1})
        for (const double shift : {0., 0.3})
        {
          CAPTURE(load);
          CAPTURE(b);
          CAPTURE(shift);
          const DenseMatrix stiffness = ziegler_stiffness(load),
                            damping   = b == 0 ? none : ziegler_damping(b);
          const auto pairs =
              quadratic_eigenpairs(ziegler_mass, damping, stiffness, shift, 0.9, true);
          CHECK(pairs.size() >= 2);
          for (const DensePair &pair : pairs)
          {
            CHECK(residual(pair, ziegler_mass, damping, stiffness) <= 1e-14);
            const DensePair adjoint{pair.lambda, pair.left, {}};
            REQUIRE(pair.left.size() == 2);
            CHECK(residual(adjoint, ziegler_mass.transpose(), damping.transpose(),
                           stiffness.transpose()) <= 1e-14);
          }
        }
    CHECK(quadratic_eigenpairs(ziegler_mass, none, ziegler_stiffness(1), 0, 1)[0].left.empty());
  }
} // namespace squeal::tests::small_problem
