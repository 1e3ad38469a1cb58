#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/statics/self_locking.h>
namespace squeal::tests::self_locking_tests
{
  TEST_CASE("self-locking: one spring-held point")
  {
    // K = [[k, c], [c, k]] along n and e, pressure along n, friction mu along e:
    // A_0 = [[k, c, 1], [c, k, 0], [1, 0, 0]], B = mu at (e, p). The unit pressure's friction mu
    // moves the point by -mu/k along e, since n is held, and the constraint then takes the force c
    // mu/k: the gain is mu c/k. So A_0 + B, with determinant mu c - k, is singular at gain 1.
    const double k = 4, c = 1.5;
    const RowRange rows = even_rows(3);
    const Matrix tangent =
        matrix_of(rows, {{0, 0, k}, {0, 1, c}, {1, 0, c}, {1, 1, k}, {0, 2, 1}, {2, 0, 1}});
    for (const double mu : {0.1, 1., 5.})
    {
      const SelfLocking result = self_locking(rows, tangent, matrix_of(rows, {{1, 2, mu}}));
      CHECK(relative_error(result.gain, mu * c / k) <= 1e-12);
      CHECK(result.locks() == (mu * c > k));
    }
    // Sliding the other way, friction lifts the point off: no gain.
    CHECK(self_locking(rows, tangent, matrix_of(rows, {{1, 2, -1.}})).gain == 0);
    CHECK(self_locking(rows, tangent, Matrix()).gain == 0);
  }

  TEST_CASE("self-locking: the largest real eigenvalue among complex ones")
  {
    // With A_0 = I the feedback is -B. Its blocks: rotations with eigenvalues r exp(+-i phi) of
    // modulus 3 to 5, which are no gains, and a nearly diagonal triangular part with the real
    // eigenvalues 0.9 - 0.02 i, i = 0, 1, ...: the gain is 0.9.
    const unsigned int n_blocks = 20, n_real = 40, n = 2 * n_blocks + n_real;
    const RowRange rows = even_rows(n);
    std::vector<Entry> unit, friction;
    for (unsigned int i = 0; i < n; ++i)
      unit.push_back({i, i, 1});
    for (unsigned int b = 0; b < n_blocks; ++b)
    {
      const double r = 3 + 0.1 * b, phi = 0.5 + 0.1 * b;
      const unsigned int i = 2 * b, j = i + 1;
      friction.insert(friction.end(), {{i, i, -r * std::cos(phi)},
                                       {i, j, r * std::sin(phi)},
                                       {j, i, -r * std::sin(phi)},
                                       {j, j, -r * std::cos(phi)}});
    }
    for (unsigned int i = 0; i < n_real; ++i)
    {
      friction.push_back({2 * n_blocks + i, 2 * n_blocks + i, -(0.9 - 0.02 * i)});
      if (i > 0)
        friction.push_back({2 * n_blocks + i - 1, 2 * n_blocks + i, 0.005 * scattered(i)});
    }
    const SelfLocking result = self_locking(rows, matrix_of(rows, unit), matrix_of(rows, friction));
    CHECK(std::abs(result.gain - 0.9) <= 1e-5);
    CHECK_FALSE(result.locks());
  }
} // namespace squeal::tests::self_locking_tests
