#include <squeal/reduction/craig_bampton.h>

#include "helpers.h"

#include <doctest/doctest.h>

#include <cmath>
namespace squeal::tests::craig_bampton_tests
{
  namespace
  {
    /// A chain of n masses 1 with springs 1 between neighbours, the last one to the ground.
    Matrix chain(const unsigned int n)
    {
      EntryList entries;
      for (unsigned int i = 0; i < n; ++i)
      {
        entries.add(i, i, i == 0 ? 1 : 2);
        if (i + 1 < n)
        {
          entries.add(i, i + 1, -1);
          entries.add(i + 1, i, -1);
        }
      }
      return entries.make_matrix(small_rows(n));
    }

    Matrix identity(const unsigned int n)
    {
      EntryList entries;
      for (unsigned int i = 0; i < n; ++i)
        entries.add(i, i, 1);
      return entries.make_matrix(small_rows(n));
    }

    /// w^2 of mode k = 1, 2, ... of n masses 1 on springs 1 between two walls: 4 sin^2(k pi / (2 (n
    /// + 1))).
    double square_of(const unsigned int k, const unsigned int n)
    {
      return 4 * std::pow(std::sin(k * M_PI / (2 * (n + 1))), 2);
    }
  } // namespace

  TEST_CASE("craig_bampton: a chain held at its first mass")
  {
    // The others are a chain of n - 1 between two walls. The first mass alone, statically: n
    // springs in series, k = 1/n, and the others follow linearly, so that its mass is
    // sum_(j=0..n-1) (1 - j/n)^2 = (n + 1)(2 n + 1)/(6 n). 40 masses have a dense problem, 700 an
    // iterative one.
    for (const unsigned int n : {40u, 700u})
    {
      CAPTURE(n);
      const Matrix K = chain(n), M = identity(n);
      const ReducedPart part = craig_bampton(K, M, {}, small_rows(n), 1, 5, 0);
      CHECK(part.n_modes == 5);
      CHECK(part.n_internal == n - 1);
      CHECK(part.D.n_rows == 0);
      REQUIRE(part.K.n_rows == 6);
      CHECK(relative_error(part.K(0, 0), 1. / n) <= 1e-9);
      CHECK(relative_error(part.M(0, 0), (n + 1.) * (2 * n + 1) / (6 * n)) <= 1e-9);
      for (unsigned int k = 1; k <= 5; ++k)
      {
        CHECK(relative_error(part.K(k, k), square_of(k, n - 1)) <= 1e-9);
        CHECK(part.K(0, k) == 0);
        CHECK(part.M(k, k) == 1);
      }
      CHECK(relative_error(part.highest, std::sqrt(square_of(5, n - 1)) / (2 * M_PI)) <= 1e-9);
      // Between the third and the fourth
      const double frequency =
          (std::sqrt(square_of(3, n - 1)) + std::sqrt(square_of(4, n - 1))) / (4 * M_PI);
      CHECK(craig_bampton(K, M, {}, small_rows(n), 1, 5, frequency).n_modes == 3);
      CHECK(craig_bampton(K, M, {}, small_rows(n), 1, 0, 0).K.n_rows == 1);
    }
  }

  TEST_CASE("craig_bampton: damping, all modes, nothing inside")
  {
    // D = 3 M + 0.2 K stays that in any coordinates; with all modes the eigenvalues are those of
    // the chain.
    const unsigned int n = 12;
    const Matrix K = chain(n), M = identity(n), D = sum_of(small_rows(n), {{3., M}, {0.2, K}});
    const ReducedPart part = craig_bampton(K, M, D, small_rows(n), 2, 1000, 0);
    CHECK(part.n_modes == n - 2);
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int j = 0; j < n; ++j)
        CHECK(std::abs(part.D(i, j) - 3 * part.M(i, j) - 0.2 * part.K(i, j)) <= 1e-13);
    // Free at its first mass and held beyond the last: w^2 = 4 sin^2((2 k - 1) pi / (2 (2 n + 1))).
    // A = M^-1 K.
    const DenseEigenpairs pairs = general_eigen(solve(part.M, part.K));
    for (unsigned int k = 1; k <= n; ++k)
    {
      const double expected = 4 * std::pow(std::sin((2 * k - 1) * M_PI / (2 * (2 * n + 1))), 2);
      double nearest        = 1e300;
      for (const std::complex<double> &value : pairs.values)
        nearest = std::min(nearest, std::abs(value - expected));
      CHECK(nearest <= 1e-12);
    }
    const ReducedPart whole = craig_bampton(K, M, {}, small_rows(n), n, 5, 0);
    CHECK(whole.n_modes == 0);
    CHECK(whole.K.n_rows == n);
    CHECK(whole.K(0, 1) == -1);
  }
} // namespace squeal::tests::craig_bampton_tests
