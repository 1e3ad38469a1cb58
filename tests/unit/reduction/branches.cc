#include "chains.h"

#include <doctest/doctest.h>

#include <squeal/reduction/branches.h>
namespace squeal::tests::branches_tests
{
  namespace
  {
    /// The problem l^2 x + diag(w^2) x = 0; branches need M only.
    QuadraticEigenproblem unit_masses(const unsigned int n)
    {
      QuadraticEigenproblem problem;
      problem.rows = even_rows(n);
      problem.M    = matrix_of(problem.rows, diagonal(n, 1));
      return problem;
    }

    /// Modes l = i w whose real vectors are the columns given, left ones equal to the right ones:
    /// z^H Q'(l) x = 2 l.
    BranchPoint point_of(const QuadraticEigenproblem &problem,
                         const std::vector<double> &frequencies,
                         const std::vector<std::vector<double>> &vectors)
    {
      BranchPoint point;
      for (const double w : frequencies)
        point.modes.lambda.emplace_back(0, w);
      point.modes.right.re = block_of(problem.rows, vectors.size(),
                                      [&](const unsigned int row, const unsigned int column)
                                      { return vectors[column][row]; });
      point.modes.right.im = MultiVector(problem.rows, vectors.size());
      point.modes.left     = point.modes.right;
      return point;
    }

    BranchPoint first_point(const QuadraticEigenproblem &problem,
                            const std::vector<double> &frequencies,
                            const std::vector<std::vector<double>> &vectors)
    {
      BranchPoint point = point_of(problem, frequencies, vectors);
      for (; point.n_branches < frequencies.size(); ++point.n_branches)
        point.branches.push_back(point.n_branches);
      return point;
    }

    bool follow(const QuadraticEigenproblem &problem, const BranchPoint &before, BranchPoint &next)
    {
      const auto form = biorthogonality(problem, before.modes, next.modes);
      return continue_branches(transition_of(form, before.modes), before, 10, next);
    }
  } // namespace

  TEST_CASE("branches: vectors, not frequencies, tell which branch a mode continues")
  {
    // e_1 goes from 1 to 1.2 and e_2 from 1.1 to 1.0: they cross. The overlaps are
    // |l + l'| / |2 l| = (1 + 1.2)/2 = 1.1 and (1.1 + 1)/2.2 = 0.9545, those with the other zero.
    const auto problem       = unit_masses(2);
    const BranchPoint before = first_point(problem, {1, 1.1}, {{1, 0}, {0, 1}});
    BranchPoint next         = point_of(problem, {1.0, 1.2}, {{0, 1}, {1, 0}});
    CHECK(follow(problem, before, next));
    CHECK(next.branches == std::vector<unsigned int>{1, 0});
    CHECK(next.n_branches == 2);
    CHECK(relative_error(next.overlaps[0], 2.1 / 2.2) <= 1e-14);
    CHECK(relative_error(next.overlaps[1], 1.1) <= 1e-14);
  }

  TEST_CASE("branches: mixed vectors leave a doubt")
  {
    // Both new vectors are (e_1 +- e_2)/sqrt 2: each overlap is 0.707, below 0.8 and equal to the
    // second best. The nearer eigenvalue decides.
    const auto problem       = unit_masses(2);
    const double h           = std::sqrt(0.5);
    const BranchPoint before = first_point(problem, {1, 1.1}, {{1, 0}, {0, 1}});
    BranchPoint next         = point_of(problem, {1, 1.1}, {{h, h}, {h, -h}});
    CHECK(!follow(problem, before, next));
    CHECK(next.branches == std::vector<unsigned int>{0, 1});
  }

  TEST_CASE("branches: modes come and go at the rim of the window only")
  {
    // Up to 10: 9.95 is in the uppermost hundredth, 5 is not. e_3 is new.
    const auto problem       = unit_masses(3);
    const BranchPoint before = first_point(problem, {1, 2}, {{1, 0, 0}, {0, 1, 0}});
    for (const double w : {9.95, 5.})
    {
      CAPTURE(w);
      BranchPoint next = point_of(problem, {1, 2, w}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
      CHECK(follow(problem, before, next) == (w == 9.95));
      CHECK(next.branches == std::vector<unsigned int>{0, 1, 2});
      CHECK(next.n_branches == 3);
      CHECK(next.overlaps[2] == 0);
      // And back: the branch ends.
      next.overlaps.clear();
      BranchPoint last = point_of(problem, {1, 2}, {{1, 0, 0}, {0, 1, 0}});
      CHECK(follow(problem, next, last) == (w == 9.95));
      CHECK(last.branches == std::vector<unsigned int>{0, 1});
      CHECK(last.n_branches == 3);
    }
  }

  TEST_CASE("branches: by eigenvalues, where vectors cannot be compared")
  {
    // 1 -> 1.05 and 2 -> 1.95 move by less than a tenth; 3 -> 3.4 by more: a new branch.
    const auto problem       = unit_masses(3);
    const BranchPoint before = first_point(problem, {1, 2, 3}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    BranchPoint next = point_of(problem, {1.05, 1.95, 3.4}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    continue_by_eigenvalues(before, next);
    CHECK(next.branches == std::vector<unsigned int>{0, 1, 3});
    CHECK(next.n_branches == 4);
    CHECK(next.overlaps == std::vector<double>{0, 0, 0});
  }
} // namespace squeal::tests::branches_tests
