#include "chains.h"

#include <doctest/doctest.h>

#include <squeal/eigen/eigensolvers.h>
#include <squeal/reduction/reduced_model.h>
namespace squeal::tests::reduced_model_tests
{
  namespace
  {
    /// A chain of 60 masses and one contact that holds a mass fast:
    ///     K u + (N + mu T) Lambda,   N^T u = 0,   N = e_m, T = e_{m+1},
    /// the friction pushing the next mass. With u_m = 0 the pressure is Lambda = u_{m-1} + u_{m+1},
    /// so that the masses to the left are a chain by themselves, and those to the right are one
    /// with the spring mu more on its first mass. Where the contact is open its row is that of
    /// Lambda = 0.
    struct HeldChain
    {
      static constexpr unsigned int n = 60, held = 20; // masses 0 ... 19, and 21 ... 59
      const RowRange rows                           = even_rows(n + 1);
      const std::shared_ptr<const Matrix> mass      = shared(diagonal(n, 1)),
                                          stiffness = shared(chain(n));

      std::shared_ptr<const Matrix> shared(const std::vector<Entry> &entries) const
      {
        return std::make_shared<const Matrix>(matrix_of(rows, entries));
      }
      std::vector<Term> terms(const double mu, const bool open = false) const
      {
        std::vector<Term> result = {{Origin::inertia, 2, 1., mass},
                                    {Origin::elasticity, 0, 1., stiffness}};
        if (open)
          result.push_back({Origin::contact, 0, 1., shared({{n, n, 1}})});
        else
        {
          result.push_back({Origin::contact, 0, 1., shared({{held, n, 1}, {n, held, 1}})});
          result.push_back({Origin::friction, 0, mu, shared({{held + 1, n, 1}})});
        }
        return result;
      }
      QuadraticEigenproblem problem(const double mu) const
      {
        return problem(terms(mu));
      }
      QuadraticEigenproblem problem(const std::vector<Term> &given) const
      {
        EquationsOfMotion equations;
        equations.rows                = rows;
        equations.terms               = given;
        equations.may_move_rigidly    = false;
        equations.n_constraints       = 1;
        equations.n_local_constraints = rows.contains(n);
        return sum_of(equations);
      }
      /// The frequencies below a limit, from the closed form to the left and LAPACK to the right.
      static std::vector<Complex> eigenvalues(const double mu, const double limit)
      {
        std::vector<Complex> result;
        for (unsigned int j = 1; j <= held; ++j)
          result.emplace_back(0, std::sqrt(chain_square(held, j)));
        const unsigned int m = n - held - 1;
        DenseMatrix k(m, m);
        for (const Entry &entry : chain(m))
          k(entry.row, entry.column) = entry.value;
        k(0, 0) += mu;
        for (const double square : symmetric_eigen(k))
          result.emplace_back(0, std::sqrt(square));
        result.erase(std::remove_if(result.begin(), result.end(),
                                    [&](const Complex l) { return l.imag() > limit; }),
                     result.end());
        return result;
      }
    };

    EigensolverOptions options_for_projection(const double max_imaginary)
    {
      EigensolverOptions options;
      options.max_imaginary = max_imaginary;
      options.keep_factors  = true;
      options.tolerance     = 1e-8;
      return options;
    }

    /// A model of the held chain, which the friction 0.1 has as its expansion point.
    ReducedModel model_of(const HeldChain &chain, const EigensolverOptions &options,
                          const ReducedModel::Course course = ReducedModel::Course::path)
    {
      ReducedModel reduced(options, course);
      const QuadraticEigenproblem problem = chain.problem(0.1);
      reduced.set_expansion_point(
          problem, chain.terms(0.1),
          make_eigensolver(ModeSolver::block_krylov)->solve(problem, options).reuse);
      REQUIRE(reduced.has_expansion_point());
      return reduced;
    }

    double distance(const MultiVector &a, const MultiVector &b)
    {
      return largest_entry(difference(a, b)) / largest_entry(b);
    }
  } // namespace

  TEST_CASE("reduced model: a contact with friction")
  {
    // HeldChain in the window 0.3, disc 0.33: to the left 2 sin(j pi/42) = 0.1495, 0.2981; to the
    // right about 2 sin(j pi/80) = 0.0785, 0.157, 0.235, 0.313. The constraints of the left vectors
    // turn with mu.
    const HeldChain chain;
    const EigensolverOptions options = options_for_projection(0.3);
    ReducedModel reduced             = model_of(chain, options);
    for (const double mu : {0.1, 0.11, 0.12, 0.14, 0.17})
    {
      CAPTURE(mu);
      const auto modes = reduced.solve(chain.terms(mu));
      REQUIRE(modes);
      CHECK(distance_of_sets(modes->lambda, HeldChain::eigenvalues(mu, 0.3)) <= 1e-9);
      // Certified, and truly so.
      const EigenPairs whole = reduced.expand(*modes);
      for (const double error : modes->backward_error)
        CHECK(error <= options.tolerance);
      // The held mass does not move.
      const DenseMatrix x = replicated(whole.right.re);
      for (unsigned int j = 0; j < x.n_columns; ++j)
        CHECK(std::abs(x(HeldChain::held, j)) <= 1e-9);
    }
  }

  TEST_CASE("reduced model: scattered parameters, and a restart by principal components")
  {
    // The chain that restarts again and again has fewer vectors than the one that only grows, and
    // the modes of the first solution in its coordinates as before.
    const HeldChain chain;
    const EigensolverOptions options = options_for_projection(0.3);
    ReducedModel growing             = model_of(chain, options, ReducedModel::Course::scattered),
                 restarted           = growing;
    const EigenPairs first           = *restarted.solve(chain.terms(0.1));
    const EigenPairs whole           = restarted.expand(first);
    REQUIRE(growing.solve(chain.terms(0.1)));
    EigenPairs coordinates = first;
    for (unsigned int k = 1; k <= 24; ++k)
    {
      const double mu = 0.1 + 0.3 * ((7 * k) % 25) / 25; // to and fro
      CAPTURE(mu);
      for (ReducedModel *reduced : {&growing, &restarted})
      {
        const auto modes = reduced->solve(chain.terms(mu));
        REQUIRE(modes);
        CHECK(distance_of_sets(modes->lambda, HeldChain::eigenvalues(mu, 0.3)) <= 1e-8);
      }
      if (k % 6 != 0)
        continue;
      const EigenPairs before = restarted.expand(coordinates);
      restarted.restart();
      coordinates = restarted.projected().basis.coordinates(before);
      CHECK(distance(restarted.expand(coordinates).right.re, whole.right.re) <= 1e-7);
      CHECK(distance(restarted.expand(coordinates).left.re, whole.left.re) <= 1e-6);
    }
    CHECK(restarted.dimension() <= growing.dimension());
  }

  TEST_CASE("reduced model: a contact opens")
  {
    // The open chain has the frequencies of 60 masses. Either the projection finds them all, with
    // what the response to a gap adds, or it says that it cannot.
    const HeldChain chain;
    const EigensolverOptions options = options_for_projection(0.3);
    ReducedModel reduced             = model_of(chain, options);
    REQUIRE(reduced.solve(chain.terms(0.1)));
    if (const auto modes = reduced.solve(chain.terms(0.1, true)))
    {
      std::vector<Complex> expected;
      for (unsigned int j = 1; std::sqrt(chain_square(HeldChain::n, j)) <= 0.3; ++j)
        expected.emplace_back(0, std::sqrt(chain_square(HeldChain::n, j)));
      CHECK(distance_of_sets(modes->lambda, expected) <= 1e-8);
    }
  }

  TEST_CASE("reduced model: a contact closes")
  {
    // A second contact at the last mass, open at the expansion point. Closed it leaves 38 masses
    // to the right of the first, with frequencies 0.0805, 0.161, 0.241, 0.321 in place of 0.0785,
    // 0.157, 0.235, 0.313 of 39. No combination of modes of the open chain holds that mass.
    constexpr unsigned int n = HeldChain::n, held = HeldChain::held;
    const RowRange rows = even_rows(n + 2);
    const auto shared   = [&](const std::vector<Entry> &entries)
    { return std::make_shared<const Matrix>(matrix_of(rows, entries)); };
    const auto mass = shared(diagonal(n, 1)), stiffness = shared(squeal::tests::chain(n));
    const auto terms_at = [&](const bool closed)
    {
      std::vector<Entry> contact = {{held, n, 1}, {n, held, 1}};
      if (closed)
        contact.insert(contact.end(), {{n - 1, n + 1, 1}, {n + 1, n - 1, 1}});
      else
        contact.push_back({n + 1, n + 1, 1});
      return std::vector<Term>{{Origin::inertia, 2, 1., mass},
                               {Origin::elasticity, 0, 1., stiffness},
                               {Origin::contact, 0, 1., shared(contact)}};
    };
    EquationsOfMotion equations;
    equations.rows                      = rows;
    equations.terms                     = terms_at(false);
    equations.may_move_rigidly          = false;
    equations.n_constraints             = 1;
    equations.n_local_constraints       = rows.contains(n) + rows.contains(n + 1);
    const EigensolverOptions options    = options_for_projection(0.3);
    const QuadraticEigenproblem problem = sum_of(equations);
    ReducedModel reduced(options);
    reduced.set_expansion_point(
        problem, equations.terms,
        make_eigensolver(ModeSolver::block_krylov)->solve(problem, options).reuse);
    for (const bool closed : {false, true, false, true})
    {
      CAPTURE(closed);
      const auto modes = reduced.solve(terms_at(closed));
      REQUIRE(modes);
      std::vector<Complex> expected;
      for (const unsigned int part : {held, closed ? n - held - 2 : n - held - 1})
        for (unsigned int j = 1; std::sqrt(chain_square(part, j)) <= 0.3; ++j)
          expected.emplace_back(0, std::sqrt(chain_square(part, j)));
      CHECK(distance_of_sets(modes->lambda, expected) <= 1e-8);
    }
  }

  TEST_CASE("reduced model: a coefficient that changes needs a new expansion point")
  {
    // Springs to the ground at all masses, a second matrix of order 0 beside the chain's: they add
    // their stiffness g to each square of a frequency. The expansion point sums both matrices with
    // g = 0.001; once g has changed the sum is of no use, however often it is asked for.
    const HeldChain chain;
    const auto ground   = chain.shared(diagonal(HeldChain::n, 1));
    const auto terms_at = [&](const double g)
    {
      std::vector<Term> terms = chain.terms(0.1);
      terms.push_back({Origin::elasticity, 0, g, ground});
      return terms;
    };
    const auto expected_at = [&](const double g)
    {
      std::vector<Complex> result;
      for (const Complex l : HeldChain::eigenvalues(0.1, std::sqrt(0.3 * 0.3 - g)))
        result.emplace_back(0, std::sqrt(l.imag() * l.imag() + g));
      return result;
    };
    const EigensolverOptions options = options_for_projection(0.3);
    ReducedModel reduced(options);
    const auto expand_at = [&](const double g)
    {
      const QuadraticEigenproblem problem = chain.problem(terms_at(g));
      reduced.set_expansion_point(
          problem, terms_at(g),
          make_eigensolver(ModeSolver::block_krylov)->solve(problem, options).reuse);
    };
    expand_at(0.001);
    REQUIRE(reduced.solve(terms_at(0.001)));
    for (unsigned int attempt = 0; attempt < 2; ++attempt)
      CHECK_FALSE(reduced.solve(terms_at(0.002)));
    CHECK_FALSE(reduced.has_expansion_point());
    // The next one keeps the matrix apart.
    expand_at(0.002);
    for (const double g : {0.002, 0.003})
    {
      CAPTURE(g);
      const auto modes = reduced.solve(terms_at(g));
      REQUIRE(modes);
      CHECK(distance_of_sets(modes->lambda, expected_at(g)) <= 1e-9);
    }
  }

  TEST_CASE("reduced model: coordinates and whole vectors")
  {
    // V c of coordinates c = V^T x is x for every x of the span, and restart() keeps the last
    // solutions in it. TwoChains: no constraints.
    const auto model                 = TwoChains::model();
    const EigensolverOptions options = options_for_projection(0.26);
    const auto terms_at              = [&](const double p)
    {
      Parameters::All parameters;
      parameters.matrices.circulatory_factor = p;
      parameters.matrices.velocity_factor    = 0.002;
      model->assemble(parameters);
      return model->terms();
    };
    const std::vector<Term> first = terms_at(0.1);
    ReducedModel reduced(options);
    reduced.set_expansion_point(
        model->problem(), first,
        make_eigensolver(ModeSolver::block_krylov)->solve(model->problem(), options).reuse);
    // p varies: the first attempt finds out, and the next expansion point keeps the matrix apart.
    reduced.solve(first);
    CHECK(!reduced.solve(terms_at(0.11)));
    CHECK(reduced.terms().varying_terms() == std::vector<double>{3 * 2 + 0}); // matrix 2, order 0
    terms_at(0.1);
    reduced.set_expansion_point(
        model->problem(), model->terms(),
        make_eigensolver(ModeSolver::block_krylov)->solve(model->problem(), options).reuse);
    std::optional<EigenPairs> modes;
    for (const double p : {0.1, 0.12, 0.14})
      modes = reduced.solve(terms_at(p));
    REQUIRE(modes);
    const unsigned int before = reduced.dimension();
    const EigenPairs whole    = reduced.expand(*modes),
                     again    = reduced.projected().basis.coordinates(whole);
    CHECK(distance(again.right.re, modes->right.re) <= 1e-12);
    CHECK(distance(again.left.re, modes->left.re) <= 1e-10);
    reduced.restart();
    CHECK(reduced.dimension() < before);
    const EigenPairs after = reduced.expand(reduced.projected().basis.coordinates(whole));
    CHECK(distance(after.right.re, whole.right.re) <= 1e-8);
    CHECK(distance(after.left.re, whole.left.re) <= 1e-7);
    const auto next = reduced.solve(terms_at(0.141));
    REQUIRE(next);
    CHECK(distance_of_sets(next->lambda, TwoChains::eigenvalues(2, 0.141, 0.002)) <= 1e-9);
  }

  TEST_CASE("reduced model: a small problem is not projected")
  {
    // 8 unknowns, and 4 modes in the disc, which are as many as Re and Im of 4 vectors can span.
    ChainModel model(8);
    model.add(Origin::inertia, 2, diagonal(8, 1)).add(Origin::elasticity, 0, chain(8));
    model.assemble({});
    const EigensolverOptions options = options_for_projection(1.2);
    ReducedModel reduced(options);
    reduced.set_expansion_point(
        model.problem(), model.terms(),
        make_eigensolver(ModeSolver::block_krylov)->solve(model.problem(), options).reuse);
    CHECK(!reduced.has_expansion_point());
  }
} // namespace squeal::tests::reduced_model_tests
