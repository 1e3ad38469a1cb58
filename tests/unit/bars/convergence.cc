#include <squeal/bars/convergence.h>

#include <doctest/doctest.h>

#include <cmath>
namespace squeal::tests::convergence_tests
{
  using Complex = std::complex<double>;

  namespace
  {
    ModeRow row_of(const unsigned int cycle, const unsigned int mode, const Complex lambda)
    {
      ModeRow row;
      row.cycle  = cycle;
      row.mode   = mode;
      row.lambda = lambda;
      return row;
    }
  } // namespace

  TEST_CASE("convergence: order and limit of x + C h^q on meshes of any sizes")
  {
    // One mode whose growth rate and frequency both converge with the order q, on sizes in a
    // constant ratio and in another: order and limits are exact but for cancellation in the
    // differences.
    for (const std::vector<double> &h :
         {std::vector<double>{1, 0.5, 0.25, 0.125}, std::vector<double>{1, 0.7, 0.6, 0.37}})
      for (const double q : {0.7, 1., 2., 3.8})
      {
        const Complex limit(-30, 3e4), constant(20, 2000);
        std::vector<std::vector<ModeRow>> cycles;
        for (unsigned int c = 0; c < h.size(); ++c)
          cycles.push_back({row_of(c, 1, limit + constant * std::pow(h[c], q))});
        const auto rows = convergence_rows(cycles, {1, 2, 3, 4}, h, 2, {});
        REQUIRE(rows.size() == 4);
        CHECK(!rows[0].change);
        CHECK(!rows[1].rate);
        CHECK(!rows[1].extrapolated_frequency);
        for (const unsigned int c : {2u, 3u})
        {
          REQUIRE(rows[c].rate);
          CHECK(std::abs(*rows[c].rate - q) < 1e-8);
          REQUIRE(rows[c].extrapolated_frequency);
          REQUIRE(rows[c].extrapolated_growth_rate);
          CHECK(std::abs(*rows[c].extrapolated_frequency - 3e4 / (2 * M_PI)) < 1e-6);
          CHECK(std::abs(*rows[c].extrapolated_growth_rate + 30) < 1e-6);
        }
      }
  }

  TEST_CASE("convergence: no limit where the order is not stable")
  {
    const auto rows_of = [](const std::vector<double> &frequencies)
    {
      std::vector<std::vector<ModeRow>> cycles;
      for (unsigned int c = 0; c < frequencies.size(); ++c)
        cycles.push_back({row_of(c, 1, Complex(0, 100 + frequencies[c]))});
      return convergence_rows(cycles, std::vector<unsigned int>(frequencies.size(), 1),
                              {1, 0.5, 0.25, 0.125}, 2, {})
          .back();
    };
    // Orders 2 and 2; 2 and 1; changes that grow; changes of alternating sign (a rate of |l| only).
    CHECK(rows_of({16, 4, 1, 0.25}).extrapolated_frequency);
    CHECK(!rows_of({16, 4, 1, -0.5}).extrapolated_frequency);
    CHECK(!rows_of({1, 2, 4, 8}).extrapolated_frequency);
    CHECK(!rows_of({1, 2, 4, 8}).rate);
    CHECK(!rows_of({4, 0, 2, 1}).extrapolated_frequency);
    // A mode that does not change has no order.
    CHECK(!rows_of({1, 1, 1, 1}).rate);
    CHECK(!observed_order(4, 1, 1, 0.5));
  }

  TEST_CASE("convergence: meshes and reference are paired by corrected eigenvalues")
  {
    // On the coarse mesh the two modes lie in the wrong order; their corrected values do not.
    const Complex a(-1, 1000), b(-2, 1010);
    std::vector<std::vector<ModeRow>> cycles          = {{row_of(0, 1, b), row_of(0, 2, a)},
                                                         {row_of(1, 1, a), row_of(1, 2, b)}};
    const std::vector<std::vector<Complex>> corrected = {{a, b}, {a, b}};
    for (unsigned int c = 0; c < 2; ++c)
      for (unsigned int m = 0; m < 2; ++m)
        cycles[c][m].corrected = corrected[c][m];
    const auto rows = convergence_rows(cycles, {10, 80}, {1, 0.5}, 1, {b, a, Complex(0, 5000)});
    REQUIRE(rows.size() == 4);
    for (const ConvergenceRow &row : rows)
    {
      REQUIRE(row.reference);
      CHECK(*row.reference == (row.number == 1 ? a : b));
      CHECK(*row.mode.corrected == *row.reference);
    }
    CHECK(std::abs(*rows[1].change - std::abs(a - b) / std::abs(a)) < 1e-14);
    // Fields: a true error of zero leaves the effectivity empty, as does a bar that was not
    // computed.
    const auto fields = convergence_fields(rows[0]);
    CHECK(fields.size() == 19);
    CHECK(fields.back().text.empty());
  }
} // namespace squeal::tests::convergence_tests
