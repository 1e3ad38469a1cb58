#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/projection/search_space.h>

#include <cmath>
namespace squeal::tests::search_space_tests
{
  namespace
  {
    constexpr unsigned int n = 40;

    /// Discrete sines, orthonormal.
    double sine(const unsigned int i, const unsigned int k)
    {
      return std::sin((i + 1) * (k + 1) * M_PI / (n + 1)) * std::sqrt(2. / (n + 1));
    }

    /// |U^T U - I|
    double defect(const MultiVector &u)
    {
      const std::vector<double> gram = inner_products(u, u).values;
      double largest                 = 0;
      for (unsigned int i = 0; i < u.n_columns(); ++i)
        for (unsigned int j = 0; j < u.n_columns(); ++j)
          largest = std::max(largest, std::abs(gram[i + j * u.n_columns()] - (i == j)));
      return largest;
    }

    /// max |a - U U^T a|
    double distance_to(const SearchSpace &space, const MultiVector &a)
    {
      return largest_entry(difference(a, combine(space.basis(), inner_products(space.basis(), a))));
    }

    /// s_0, s_0 + 1e-3 s_1, s_0 + 1e-3 s_1 + 1e-8 s_2 to a space of s_0: remainders 0 (but
    /// rounding), 1e-3 s_1, and 1e-3 (s_1 + 1e-5 s_2).
    MultiVector graded(const RowRange &rows)
    {
      return block_of(rows, 3,
                      [](const unsigned int i, const unsigned int j) {
                        return sine(i, 0) + (j > 0 ? 1e-3 * sine(i, 1) : 0) +
                               (j > 1 ? 1e-8 * sine(i, 2) : 0);
                      });
    }
  } // namespace

  TEST_CASE("search space: what is new depends on the thresholds")
  {
    const RowRange rows = even_rows(n);
    struct
    {
      Novelty novelty;
      unsigned int n_new;
    } const cases[] = {
        {{1e-10}, 2},         // s_1 and s_2, all but rounding
        {{1e-10, 1e-7}, 2},   // unit remainders differ by 1e-5
        {{1e-10, 1e-4}, 1},   // ... which is too little
        {{1e-2, 1e-7}, 0},    // remainders are 1e-3 of their columns
        {{1e-4, 0, true}, 1}, // components of lengths 1.4e-3 and 0.7e-8
        {{1e-9, 0, true}, 2},
    };
    for (const auto &[novelty, n_new] : cases)
    {
      CAPTURE(novelty.shortest);
      CAPTURE(novelty.dependent);
      SearchSpace space(
          block_of(rows, 1, [](const unsigned int i, unsigned int) { return sine(i, 0); }));
      const MultiVector added = space.add(graded(rows), novelty);
      CHECK(added.n_columns() == n_new);
      CHECK(space.n_columns() == 1 + n_new);
      CHECK(defect(space.basis()) <= 1e-13);
      // What is left out is as short as allowed.
      CHECK(distance_to(space, graded(rows)) <= (n_new == 2 ? 1e-15 : n_new == 1 ? 2e-8 : 2e-3));
    }
  }

  TEST_CASE("search space: coefficients and the largest dimension")
  {
    // Nine columns of which six fit: the space of all of them if there are no more rows.
    const RowRange rows      = even_rows(6);
    const MultiVector first  = block_of(rows, 2, scattered),
                      second = block_of(rows, 7,
                                        [](const unsigned int i, const unsigned int j)
                                        { return scattered(i, j + 2); });
    SearchSpace space(rows, 6);
    space.add(first, {1e-13});
    DenseMatrix coefficients;
    const MultiVector added = space.add(second, {1e-13}, {}, &coefficients);
    CHECK(added.n_columns() == 4);
    CHECK(defect(space.basis()) <= 1e-13);
    REQUIRE(coefficients.n_rows == 6);
    REQUIRE(coefficients.n_columns == 7);
    CHECK(largest_entry(difference(second, combine(space.basis(), coefficients))) <= 1e-13);
  }

  TEST_CASE("search space: images follow")
  {
    // A = diag(1 + i): A U stays the image of U, whatever is combined and left out.
    const RowRange rows = even_rows(n);
    const auto image_of = [&](const MultiVector &x)
    {
      MultiVector result = x;
      for (unsigned int k = 0; k < x.n_columns(); ++k)
        for (unsigned int i = 0; i < x.n_local(); ++i)
          result.column(k)[i] *= 1 + rows.begin + i;
      return result;
    };
    SearchSpace space(rows);
    MultiVector images(rows, 0);
    for (unsigned int step = 0; step < 3; ++step)
    {
      MultiVector columns = block_of(rows, 3,
                                     [&](const unsigned int i, const unsigned int j)
                                     { return scattered(i, 2 * step + j); }); // one comes again
      MultiVector image   = image_of(columns);
      space.add(std::move(columns), {1e-12, 1e-6}, {{image, images}});
      images.append(image);
      CHECK(space.n_columns() == 2 * step + 3);
      CHECK(defect(space.basis()) <= 1e-13);
      CHECK(largest_entry(difference(images, image_of(space.basis()))) <= 1e-11);
    }
  }
} // namespace squeal::tests::search_space_tests
