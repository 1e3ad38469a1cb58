#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/eigen/find_modes.h>
#include <squeal/equations/sector.h>

#include <cmath>
namespace squeal::tests::find_modes_tests
{
  using Complex = std::complex<double>;

  // n unit masses and springs between walls, each damped by alpha: modes sin(j pi i/(n + 1)), which
  // the reflection about the middle turns into (-1)^(j + 1) times themselves, w_j = 2 sin(j pi/(2
  // (n
  // + 1))), and l^2 + alpha l + w_j^2 = 0.

  namespace
  {
    constexpr unsigned int n_masses = 41; // one of them in the middle
    constexpr double alpha          = 0.01;

    EquationsOfMotion damped_chain(const double last_mass)
    {
      EquationsOfMotion equations;
      equations.rows             = even_rows(n_masses);
      equations.may_move_rigidly = false;
      equations.reference_name   = "the undamped chain";
      std::vector<Entry> mass, damping, position;
      for (unsigned int i = 0; i < n_masses; ++i)
      {
        mass.push_back({i, i, i + 1 == n_masses ? last_mass : 1});
        damping.push_back({i, i, 1});
        position.push_back({i, i, 2});
        if (i > 0)
        {
          position.push_back({i, i - 1, -1});
          position.push_back({i - 1, i, -1});
        }
      }
      const auto term = [&](const Origin origin, const unsigned int order, const double coefficient,
                            const std::vector<Entry> &entries)
      {
        equations.terms.push_back(
            {origin, order, coefficient,
             std::make_shared<const Matrix>(matrix_of(equations.rows, entries))});
      };
      term(Origin::inertia, 2, 1, mass);
      term(Origin::material_damping, 1, alpha, damping);
      term(Origin::elasticity, 0, 1, position);
      return equations;
    }

    MirrorSymmetry reflection_of_chain()
    {
      MirrorSymmetry symmetry;
      symmetry.rows = even_rows(n_masses);
      symmetry.sign.assign(n_masses, 1);
      symmetry.is_pressure.assign(n_masses, false);
      for (unsigned int i = 0; i < n_masses; ++i)
        symmetry.image.push_back(n_masses - 1 - i);
      return symmetry;
    }

    EigenSolution solve(const EquationsOfMotion &equations)
    {
      EigensolverOptions options;
      options.max_imaginary = 0.5;
      return find_modes(ModeSolver::block_krylov, equations, options, reflection_of_chain());
    }
  } // namespace

  TEST_CASE("sectors: the modes of a chain of masses are symmetric and antisymmetric in turn")
  {
    const EigenSolution found = solve(damped_chain(1));
    const EigenPairs &modes   = found.modes;
    REQUIRE(modes.size() == 6); // 84/pi asin(0.25) = 6.76
    REQUIRE(modes.parity.size() == modes.size());
    for (unsigned int k = 0; k < modes.size(); ++k)
    {
      const unsigned int j = k + 1;
      const double w       = 2 * std::sin(j * M_PI / (2 * (n_masses + 1)));
      const Complex l(-alpha / 2, std::sqrt(w * w - alpha * alpha / 4));
      CHECK(std::abs(modes.lambda[k] - l) <= 1e-10 * std::abs(l));
      CHECK(modes.parity[k] == (j % 2 == 1 ? Parity::symmetric : Parity::antisymmetric));
    }
    // |l| <= 1.1 * 0.5: 84/pi asin(0.275) = 7.45, those of both sectors together
    CHECK(found.proof.n_reference == 7);
    CHECK(contains(found.proof.completeness, "; antisymmetric, 20 unknowns: "));
  }

  TEST_CASE("sectors: a heavier mass at one end leaves one sector without parity")
  {
    const EigenSolution found = solve(damped_chain(1.5));
    CHECK(found.modes.size() >= 6);
    CHECK(found.modes.parity.empty());
    CHECK(found.reuse.sectors.empty());
  }
} // namespace squeal::tests::find_modes_tests
