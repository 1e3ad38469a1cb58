#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/base/errors.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/ritz.h>

#include <limits>
namespace squeal::tests::backward_error_tests
{
  using Complex = std::complex<double>;

  namespace
  {
    constexpr unsigned int n  = 6;
    constexpr double infinity = std::numeric_limits<double>::infinity();

    /// l^2 = -1, -4, -9 ...: M = 1, Q = diag(1, 4, 9 ...).
    QuadraticEigenproblem oscillators()
    {
      std::vector<Entry> mass, position;
      for (unsigned int i = 0; i < n; ++i)
      {
        mass.push_back({i, i, 1.});
        position.push_back({i, i, (i + 1.) * (i + 1.)});
      }
      QuadraticEigenproblem problem;
      problem.rows = even_rows(n);
      problem.M    = matrix_of(problem.rows, mass);
      problem.Q    = matrix_of(problem.rows, position);
      return problem;
    }

    /// The pairs of the first two; @p wrong stands in row 3 of the second vector.
    EigenPairs pairs_with(const QuadraticEigenproblem &problem, const Complex wrong)
    {
      EigenPairs pairs;
      pairs.lambda = {{0, 1}, {0, 2}};
      pairs.right  = ComplexMultiVector(problem.rows, 2);
      for (unsigned int i = 0; i < problem.rows.n_local(); ++i)
        for (unsigned int j = 0; j < 2; ++j)
        {
          const unsigned int row = problem.rows.begin + i;
          pairs.right.set(i, j, row == j ? Complex(1) : row == 3 && j == 1 ? wrong : Complex());
        }
      return pairs;
    }
  } // namespace

  TEST_CASE("backward error: of exact pairs and of a known residual")
  {
    // With 0.5 in row 3 the residual is 0.5 (16 - 4) = 6; |l|^2 |M| + |Q| = 4 + 36, |x| = 1.
    const QuadraticEigenproblem problem = oscillators();
    CHECK(BackwardError(problem)(pairs_with(problem, 0.)) == std::vector<double>{0., 0.});
    const auto errors = BackwardError(problem)(pairs_with(problem, 0.5));
    CHECK(errors[0] == 0);
    CHECK(relative_error(errors[1], 6. / 40) <= 1e-15);
  }

  TEST_CASE("backward error: what is not finite is infinitely wrong, on all ranks")
  {
    // A maximum passes over NaN as if it were zero, and no comparison with a tolerance refuses it.
    const QuadraticEigenproblem problem = oscillators();
    const BackwardError backward_error(problem);
    for (const Complex wrong :
         {Complex(std::nan(""), 0), Complex(0, std::nan("")), Complex(infinity, 0)})
      CHECK(backward_error(pairs_with(problem, wrong)) == std::vector<double>{0., infinity});
    EigenPairs pairs = pairs_with(problem, 0.);
    for (const Complex wrong : {Complex(std::nan(""), 2), Complex(0, infinity), Complex(0, 1e200)})
    {
      pairs.lambda[1] = wrong;
      CHECK(backward_error(pairs)[0] == 0);
      CHECK(backward_error(pairs)[1] == infinity);
    }
    pairs           = pairs_with(problem, 0.);
    pairs.lambda[1] = {0, 2};
    pairs.right     = ComplexMultiVector(problem.rows, 2); // zeros are no vectors
    CHECK(backward_error(pairs) == std::vector<double>{infinity, infinity});
  }
} // namespace squeal::tests::backward_error_tests
