#include "chains.h"

#include <doctest/doctest.h>

#include <squeal/projection/backward_error.h>
#include <squeal/reduction/mode_tracker.h>
namespace squeal::tests::mode_tracker_tests
{
  namespace
  {
    EigensolverOptions window(const double max_imaginary)
    {
      EigensolverOptions options;
      options.max_imaginary = max_imaginary;
      return options;
    }

    Parameters::All factors(const double p, const double c)
    {
      Parameters::All parameters;
      parameters.matrices.circulatory_factor = p;
      parameters.matrices.velocity_factor    = c;
      return parameters;
    }

    /// A full solution as the first, to which others are near.
    void begin(ModeTracker &tracker, const Parameters::All &parameters)
    {
      tracker.set_expansion_point(parameters, tracker.solve_fully(parameters).reuse);
    }

    /// |Q(l) x| of whole modes, for the unit mass matrices used here.
    double largest_residual(const ChainModel &model, const EigenPairs &modes)
    {
      const QuadraticEigenproblem problem = model.problem();
      const std::vector<double> errors    = BackwardError(problem)(modes);
      return *std::max_element(errors.begin(), errors.end());
    }
  } // namespace

  TEST_CASE("mode tracker: what is to vary may be looked at before the first solution")
  {
    for (const bool looks : {false, true})
    {
      const auto model = TwoChains::model();
      ModeTracker tracker(window(0.26), ModeSolver::block_krylov);
      tracker.set_model(*model);
      begin(tracker, factors(0.1, 0.002));
      if (looks)
        tracker.look_at(factors(0.2, 0.003));
      CHECK(!tracker.is_whole(tracker.solve(factors(0.1, 0.002)).modes));
      // What has not been seen to vary is in a sum then.
      const EigenPairs modes = tracker.solve(factors(0.2, 0.003)).modes;
      CHECK(tracker.is_whole(modes) == !looks);
      CHECK(distance_of_sets(modes.lambda, TwoChains::eigenvalues(2, 0.2, 0.003)) <= 1e-9);
    }
  }

  TEST_CASE("mode tracker: one full solution serves for many parameters")
  {
    // TwoChains: modes 1 and 2 have frequencies up to sqrt(0.0409 + 0.02) = 0.247, mode 3 from
    // sqrt(0.0917) = 0.303 on; so 4 modes in the window 0.26 and in the disc 0.286. The eigenvalues
    // are those of the closed form, before the coalescences at p = d/(2 w^2) and after.
    const auto model = TwoChains::model();
    ModeTracker tracker(window(0.26), ModeSolver::block_krylov);
    tracker.set_model(*model);
    begin(tracker, factors(0.1, 0.002));
    for (unsigned int k = 1; k <= 30; ++k)
    {
      const double p = 0.1 + 0.01 * k, c = 0.002 + 0.0001 * k;
      CAPTURE(p);
      const EigenPairs modes = tracker.solve(factors(p, c)).modes;
      CHECK(!tracker.is_whole(modes));
      CHECK(distance_of_sets(modes.lambda, TwoChains::eigenvalues(2, p, c)) <= 1e-9);
      for (const double error : modes.backward_error)
        CHECK(error <= 1e-9);
      CHECK(largest_residual(*model, tracker.whole(modes)) <= 1e-9);
    }
    CHECK(tracker.n_full_solutions() == 1);
  }

  TEST_CASE(
      "mode tracker: damping that has grown much asks for a full solution only where modes may "
      "have come in")
  {
    // Damping c times 1, R = 0.286: real pairs of l^2 + c l + w^2 = 0, one in the disc and one not,
    // are where R^2 - c R + w^2 < 0; for the least w^2, 0.006, from c = 0.31 on.
    const auto model = TwoChains::model();
    ModeTracker tracker(window(0.26), ModeSolver::block_krylov);
    tracker.set_model(*model);
    begin(tracker, factors(0.1, 0.002));
    tracker.look_at(factors(0.1, 0.05));
    begin(tracker, factors(0.1, 0.002));
    const unsigned int n_full = tracker.n_full_solutions();
    for (const double c : {0.05, 0.1, 0.004})
    {
      CAPTURE(c);
      const EigenPairs modes = tracker.solve(factors(0.1, c)).modes;
      CHECK(!tracker.is_whole(modes));
      CHECK(distance_of_sets(modes.lambda, TwoChains::eigenvalues(2, 0.1, c)) <= 1e-9);
    }
    CHECK(tracker.n_full_solutions() == n_full);
    CHECK(tracker.is_whole(tracker.solve(factors(0.1, 0.35)).modes));
    CHECK(tracker.n_full_solutions() == n_full + 1);
  }

  TEST_CASE("mode tracker: derivatives and Rayleigh coefficients of projected modes")
  {
    // From l^2 + c l + s = 0: dl/dp = -s'/(2 l + c) with s' = -+ p w^4/sqrt(d^2/4 - p^2 w^4) for
    // s = ... +- sqrt, and dl/dc = -l/(2 l + c). The Rayleigh coefficients of a unit mass matrix
    // with damping c: d = c, g = 0.
    const double p = 0.12, c = 0.003;
    const auto model = TwoChains::model();
    ModeTracker tracker(window(0.26), ModeSolver::block_krylov);
    tracker.set_model(*model);
    begin(tracker, factors(0.1, 0.002));
    const EigenPairs modes = tracker.solve(factors(p, c)).modes;
    REQUIRE(!tracker.is_whole(modes));
    const std::vector<Complex> expected = TwoChains::eigenvalues(2, p, c),
                               by_p     = tracker.sensitivities(first_factor, modes),
                               by_c     = tracker.sensitivities(second_factor, modes);
    REQUIRE(by_p.size() == 4);
    REQUIRE(by_c.size() == 4);
    const std::vector<unsigned int> partners = nearest_partners(expected, modes.lambda);
    for (unsigned int k = 0; k < 4; ++k)
    {
      CAPTURE(k);
      const unsigned int j = partners[k];
      const double square  = chain_square(TwoChains::n, k / 2 + 1);
      const Complex root =
          std::sqrt(Complex(TwoChains::d * TwoChains::d / 4 - p * p * square * square));
      const Complex slope = (k % 2 == 0 ? -1. : 1.) * p * square * square / root;
      const Complex l     = expected[k];
      CHECK(std::abs(by_p[j] + slope / (2. * l + c)) <= 1e-6 * std::abs(slope / l));
      CHECK(std::abs(by_c[j] + l / (2. * l + c)) <= 1e-6);
    }
    for (const ModeRow &row : tracker.analyse(modes))
    {
      CHECK(relative_error(row.d, c) <= 1e-8);
      CHECK(std::abs(row.g) <= 1e-10);
    }
    CHECK(tracker.sensitivities("Pads/Pressure", modes).empty());
  }

  TEST_CASE("mode tracker: other modes in the window ask for a full solution")
  {
    // One chain with the stiffness (1 + p) K, told to be elastic: w_j^2 = (1 + p) 4 sin^2(j pi/82).
    // In the disc 1.1 * 0.25: 3 modes at p = 0 (0.0766, 0.1531, 0.2294; the next 0.3053), 4 at
    // p = -0.2 (0.3053 * 0.894 = 0.273 < 0.275). The inertia count tells.
    ChainModel model(40);
    model.add(Origin::inertia, 2, diagonal(40, 1))
        .add(Origin::elasticity, 0, chain(40))
        .add(Origin::elasticity, 0, chain(40), ChainModel::first);
    ModeTracker tracker(window(0.25), ModeSolver::block_krylov);
    tracker.set_model(model);
    begin(tracker, factors(0, 0));
    for (const double p : {-0.01, -0.02})
    {
      const EigenPairs modes = tracker.solve(factors(p, 0)).modes;
      CHECK(modes.lambda.size() == 3);
      CHECK(!tracker.is_whole(modes));
    }
    CHECK(tracker.n_full_solutions() == 1);
    const EigenPairs modes = tracker.solve(factors(-0.2, 0)).modes;
    CHECK(tracker.is_whole(modes));
    CHECK(tracker.n_full_solutions() == 2);
    std::vector<Complex> expected;
    for (unsigned int j = 1; j <= 3; ++j)
      expected.emplace_back(0, std::sqrt(0.8 * chain_square(40, j)));
    CHECK(distance_of_sets(modes.lambda, expected) <= 1e-9);
  }

  namespace
  {
    /// Two chains as in TwoChains, which are their own mirror images: mass i goes to n - 1 - i.
    std::unique_ptr<ChainModel> mirrored_chains(const bool disturbed = false)
    {
      auto model           = TwoChains::model();
      const unsigned int n = TwoChains::n;
      if (disturbed)
        model->add(Origin::friction_damping, 1, {{0, 0, 1}}, ChainModel::second);
      MirrorSymmetry symmetry;
      symmetry.rows = model->rows;
      for (unsigned int i = 0; i < 2 * n; ++i)
        symmetry.image.push_back(i < n ? n - 1 - i : 3 * n - 1 - i);
      symmetry.sign.assign(2 * n, 1);
      symmetry.is_pressure.assign(2 * n, false);
      model->symmetry = std::move(symmetry);
      return model;
    }
  } // namespace

  TEST_CASE("reduced sectors: symmetric and antisymmetric modes, each by its own reduced model")
  {
    // The j-th mode of a chain, sin(i j pi/(n + 1)), is symmetric for odd j and antisymmetric for
    // even j; so each sector has the two modes of one j. 30 unknowns in each sector, and 2 modes in
    // the disc, leave room for a projection.
    const auto model = mirrored_chains();
    ModeTracker tracker(window(0.26), ModeSolver::block_krylov);
    tracker.set_model(*model);
    begin(tracker, factors(0.1, 0.002));
    for (const double p : {0.11, 0.13, 0.17, 0.2, 0.23, 0.26, 0.3})
    {
      CAPTURE(p);
      const EigenPairs modes = tracker.solve(factors(p, 0.002)).modes;
      REQUIRE(!tracker.is_whole(modes));
      CHECK(distance_of_sets(modes.lambda, TwoChains::eigenvalues(2, p, 0.002)) <= 1e-9);
      const EigenPairs whole = tracker.whole(modes);
      CHECK(largest_residual(*model, whole) <= 1e-9);
      const std::vector<Complex> of_first = TwoChains::eigenvalues(1, p, 0.002);
      for (unsigned int k = 0; k < modes.lambda.size(); ++k)
      {
        const bool is_symmetric = std::any_of(
            of_first.begin(), of_first.end(),
            [&](const Complex l) { return std::abs(l - modes.lambda[k]) < 1e-8 * std::abs(l); });
        CHECK(modes.parity[k] == (is_symmetric ? Parity::symmetric : Parity::antisymmetric));
        const MultiVector x = whole.right.re.columns(k, 1), s_x = model->symmetry->reflect(x);
        MultiVector minus_x = x;
        for (unsigned int i = 0; i < x.n_local(); ++i)
          minus_x.data()[i] *= -1;
        CHECK(largest_entry(difference(s_x, is_symmetric ? x : minus_x)) <=
              1e-9 * std::max(largest_entry(x), 1e-3));
      }
      for (const ModeRow &row : tracker.analyse(modes))
        CHECK(relative_error(row.d, 0.002) <= 1e-8);
    }
    CHECK(tracker.n_full_solutions() == 1);
  }

  TEST_CASE("reduced sectors: branches go on in coordinates, from whole modes and after a restart")
  {
    // Between close parameters every branch goes on with an overlap near 1, whether the modes
    // before are whole (the full solution), in coordinates of fewer vectors, or in those of a
    // restart; and the eigenvalues stay those of the closed form. (|(l + l')| / |2 l| is 1 to the
    // relative change of l, a hundredth here.)
    for (const bool in_sectors : {false, true})
    {
      CAPTURE(in_sectors);
      const auto model = in_sectors ? mirrored_chains() : TwoChains::model();
      ModeTracker tracker(window(0.26), ModeSolver::block_krylov);
      tracker.set_model(*model);
      BranchPoint before;
      const EigenSolution first = tracker.solve_fully(factors(0.1, 0.002));
      before.modes              = first.modes;
      tracker.set_expansion_point(factors(0.1, 0.002), first.reuse);
      before.branches   = {0, 1, 2, 3};
      before.n_branches = 4;
      for (unsigned int k = 1; k <= 10; ++k)
      {
        CAPTURE(k);
        BranchPoint next;
        const double p = 0.1 + 0.002 * k;
        next.modes     = tracker.solve(factors(p, 0.002)).modes;
        REQUIRE(!tracker.is_whole(next.modes));
        CHECK(continue_branches(tracker.transition(before.modes, next.modes), before, 0.26, next));
        CHECK(next.n_branches == 4);
        CHECK(next.branches == std::vector<unsigned int>{0, 1, 2, 3});
        for (const double overlap : next.overlaps)
          CHECK(std::abs(overlap - 1) <= 0.05);
        CHECK(distance_of_sets(next.modes.lambda, TwoChains::eigenvalues(2, p, 0.002)) <= 1e-9);
        before = std::move(next);
        if (k == 5)
        {
          const EigenPairs whole = tracker.whole(before.modes);
          before.modes           = tracker.restart(before.modes);
          CHECK(tracker.n_restarts() == 1);
          const EigenPairs again = tracker.whole(before.modes);
          CHECK(largest_entry(difference(whole.right.re, again.right.re)) <=
                1e-7 * largest_entry(whole.right.re));
          CHECK(largest_entry(difference(whole.left.im, again.left.im)) <=
                1e-6 * largest_entry(whole.left.re));
        }
      }
      CHECK(tracker.n_full_solutions() == 1);
    }
  }

  TEST_CASE("reduced sectors: terms that lose the symmetry ask for a full solution")
  {
    // A damper at one end of one chain, c times 1: without it (c = 0) the mirror symmetry holds.
    const auto model = mirrored_chains(true);
    ModeTracker tracker(window(0.26), ModeSolver::block_krylov);
    tracker.set_model(*model);
    begin(tracker, factors(0.1, 0));
    CHECK(!tracker.is_whole(tracker.solve(factors(0.11, 0)).modes));
    CHECK(tracker.n_full_solutions() == 1);
    const EigenPairs modes = tracker.solve(factors(0.12, 0.01)).modes;
    CHECK(tracker.is_whole(modes));
    CHECK(tracker.n_full_solutions() == 2);
    CHECK(largest_residual(*model, modes) <= 1e-9);
  }
} // namespace squeal::tests::mode_tracker_tests
