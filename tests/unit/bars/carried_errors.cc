#include "../helpers.h"

#include <doctest/doctest.h>

#include <squeal/bars/carried_errors.h>
#include <squeal/linalg/dense.h>

#include <algorithm>
#include <complex>
#include <functional>
#include <numeric>

/// Families A(p) of small matrices, on which effects E(p) of a discretisation are known.
namespace squeal::tests::carried_errors
{
  namespace
  {
    using Complex = std::complex<double>;
    using Family  = std::function<ComplexDenseMatrix(double)>;

    ComplexDenseMatrix sum(const ComplexDenseMatrix &a, const Complex factor,
                           const ComplexDenseMatrix &b)
    {
      ComplexDenseMatrix result = a;
      return result.add(factor, b);
    }

    Family line(const ComplexDenseMatrix &a, const ComplexDenseMatrix &slope)
    {
      return [=](const double p) { return sum(a, p, slope); };
    }

    /// Eigenvalues, by their imaginary parts, and vectors with Z^H X = 1.
    struct Modes
    {
      std::vector<Complex> lambda;
      ComplexDenseMatrix x, z;

      explicit Modes(const ComplexDenseMatrix &a) : x(a.n_rows, a.n_rows), z(a.n_rows, a.n_rows)
      {
        const DenseEigenpairs pairs = general_eigen(a, true);
        const unsigned int n        = a.n_rows;
        std::vector<unsigned int> order(n);
        std::iota(order.begin(), order.end(), 0u);
        std::sort(order.begin(), order.end(),
                  [&](const unsigned int i, const unsigned int j)
                  { return pairs.values[i].imag() < pairs.values[j].imag(); });
        for (unsigned int k = 0; k < n; ++k)
        {
          const unsigned int from = order[k];
          Complex product         = 0;
          for (unsigned int i = 0; i < n; ++i)
            product += std::conj(pairs.left(i, from)) * pairs.right(i, from);
          for (unsigned int i = 0; i < n; ++i)
          {
            x(i, k) = pairs.right(i, from);
            z(i, k) = pairs.left(i, from) / std::conj(product);
          }
          lambda.push_back(pairs.values[from]);
        }
      }

      /// Z^H E X.
      ComplexDenseMatrix form(const ComplexDenseMatrix &e, const Modes &right) const
      {
        return z.adjoint() * (e * right.x);
      }
    };

    ErrorEffects effects_of(const ComplexDenseMatrix &f, const unsigned int degree = 2)
    {
      ErrorEffects effects;
      effects.f      = f.values;
      effects.degree = degree;
      return effects;
    }

    ModesOnCourse place(const double p, const Modes &modes, const Modes *before)
    {
      ModesOnCourse result;
      result.value  = p;
      result.lambda = modes.lambda;
      result.branches.resize(modes.lambda.size());
      std::iota(result.branches.begin(), result.branches.end(), 0u);
      if (before)
        result.transition = before->form(ComplexDenseMatrix::identity(modes.x.n_rows), modes);
      return result;
    }

    /// Three modes: one begins to grow near p = 0.4, the others are near it.
    ComplexDenseMatrix a_0()
    {
      ComplexDenseMatrix a(3, 3);
      a.values = {{-2, 100}, {0.4, 1}, {0.1, -0.5}, {0.3, -2}, {-5, 107},
                  {0, 1},    {0.2, 0}, {-0.4, 1},   {-9, 131}};
      return a;
    }
    ComplexDenseMatrix a_1()
    {
      ComplexDenseMatrix a(3, 3);
      a.values = {{5, 1}, {1, -1}, {0, 2}, {-2, 1}, {-1, 3}, {1, 0}, {0.5, 0.5}, {1, 1}, {-2, 1}};
      return a;
    }
    ComplexDenseMatrix error()
    {
      ComplexDenseMatrix e(3, 3);
      e.values = {{0.05, -0.3}, {0.02, 0.1}, {0, 0.05},     {0.03, -0.1}, {-0.04, -0.3},
                  {0.01, 0},    {0.02, 0},   {-0.01, 0.02}, {0.1, -0.4}};
      return e;
    }

    double difference(const std::vector<Complex> &a, const std::vector<Complex> &b)
    {
      REQUIRE(a.size() == b.size());
      double largest = 0;
      for (std::size_t k = 0; k < a.size(); ++k)
        largest = std::max(largest, std::abs(a[k] - b[k]));
      return largest;
    }

    /// Where a family is critical: by bisection.
    double critical(const std::function<double(double)> &function, double low, double high)
    {
      const double at_low = function(low);
      REQUIRE(at_low * function(high) < 0);
      for (unsigned int i = 0; i < 60; ++i)
      {
        const double middle                          = (low + high) / 2;
        (function(middle) * at_low > 0 ? low : high) = middle;
      }
      return low;
    }
  } // namespace

  TEST_CASE("carried errors: effects on other modes of the same family")
  {
    const Family a                   = line(a_0(), a_1()),
                 e                   = line(error(), sum(ComplexDenseMatrix(3, 3), 0.3, error()));
    const std::vector<double> values = {0, 0.2, 0.5, 1};
    std::vector<Modes> modes;
    std::vector<ModesOnCourse> course;
    for (const double p : values)
    {
      modes.emplace_back(a(p));
      const unsigned int k = modes.size() - 1;
      course.push_back(place(p, modes[k], k > 0 ? &modes[k - 1] : nullptr));
    }
    const auto exact = [&](const unsigned int k, const unsigned int of)
    { return modes[k].form(e(values[of]), modes[k]).values; };

    const KnownEffects first = all_known(effects_of(modes[0].form(e(0), modes[0])));
    // The same operator's, exactly
    const KnownEffects next = carry_forward(first, course[0], course[1]);
    CHECK(difference(next.effects.f, exact(1, 0)) <= 1e-12);
    CHECK(difference(carry_back(next, course[0], course[1]).effects.f, first.effects.f) <= 1e-12);
    // E is linear in p, and so is what is between two estimates.
    const auto along =
        effects_along(course, first.effects, effects_of(modes[3].form(e(1), modes[3])));
    for (unsigned int k = 0; k < 4; ++k)
      CHECK(difference(along[k].effects.f, exact(k, k)) <= 1e-11);
  }

  TEST_CASE("carried errors: a mode that ceases to oscillate")
  {
    // l^2 = p, of which the mesh changes d: 2 l f = d, before divergence at p = 0 and beyond it.
    constexpr double d = 1e-3;
    ModesOnCourse before{-1, {{0, 1}}, {}, {0}, {}},
        beyond{4, {{2, 0}}, {}, {0}, ComplexDenseMatrix(1, 1)};
    beyond.transition(0, 0) = {0.5, 0.3};
    const auto effect       = [&](const ModesOnCourse &at) { return d / (2. * at.lambda[0]); };
    ComplexDenseMatrix f(1, 1);
    f(0, 0)                  = effect(before);
    const KnownEffects known = all_known(effects_of(f)),
                       there = carry_forward(known, before, beyond);
    CHECK(std::abs(there.effects.f[0] - effect(beyond)) <= 1e-15);
    const KnownEffects again = carry_back(there, before, beyond);
    CHECK(std::abs(again.effects.f[0] - effect(before)) <= 1e-15);
    const auto bar = bound_critical_value(beyond, there, 0, 1 / (2. * 2));
    REQUIRE(bar);
    CHECK(std::abs(bar->correction + d) <= 1e-15);
    CHECK(bar->error >= d);
  }

  TEST_CASE("carried errors: a branch that ends and one that begins")
  {
    const Family a = line(a_0(), a_1());
    const Modes m_0(a(0)), m_1(a(0.3));
    ModesOnCourse from = place(0, m_0, nullptr), to = place(0.3, m_1, &m_0);
    to.branches[2]           = 7; // branch 2 has ended
    const KnownEffects first = all_known(effects_of(m_0.form(error(), m_0))),
                       next  = carry_forward(first, from, to);
    const auto full          = m_1.form(error(), m_1);
    CHECK(next.modes == std::vector<unsigned int>{0, 1});
    // What the lost mode had mixed in is missing: a few per cent.
    for (unsigned int j = 0; j < 2; ++j)
      CHECK(std::abs(next.effects.f[j + 2 * j] - full(j, j)) <= 0.05 * std::abs(full(j, j)));
    // Where only one end knows a mode, that.
    const KnownEffects back = all_known(effects_of(full)), both = blend(next, back, 0.25);
    CHECK(both.modes == std::vector<unsigned int>{0, 1, 2});
    CHECK(std::abs(both.effects.f[8] - full(2, 2)) <= 1e-14);
  }

  TEST_CASE("carried errors: what contact zones add, by the share of each end")
  {
    const auto known = [](const double size)
    {
      ErrorEffects effects = effects_of(ComplexDenseMatrix::identity(2));
      effects.alternatives = {{{{size, 0, 0, size}, {-size, 0, 0, -size}}, false}};
      return all_known(effects);
    };
    const auto bar = [](const KnownEffects &of) {
      return bound_errors({{0, 1}, {0, 50}}, {}, of.effects).growth_rate[0];
    };
    const double none = bar(all_known(effects_of(ComplexDenseMatrix::identity(2))));
    // The zone of one end has no edge.
    for (const double share : {0., 0.25, 1.})
    {
      CHECK(bar(blend(known(0.1), known(0.3), share)) - none ==
            doctest::Approx(0.1 * (1 - share) + 0.3 * share).epsilon(1e-10));
      CHECK(bar(blend(known(0.1), all_known(effects_of(ComplexDenseMatrix::identity(2))), share)) -
                none ==
            doctest::Approx(0.1 * (1 - share)).epsilon(1e-10));
    }
  }

  TEST_CASE("carried errors: the bar of an onset")
  {
    const Family a         = line(a_0(), a_1());
    const auto growth_rate = [&](const double s)
    { return [&a, s](const double p) { return Modes(sum(a(p), s, error())).lambda[0].real(); }; };
    const double p_c = critical(growth_rate(0), 0, 1);
    const Modes before(a(0)), at(a(p_c)), after(a(1));
    const ModesOnCourse from = place(0, before, nullptr), here = place(p_c, at, &before),
                        to = place(1, after, &before);
    const auto known       = [&](const Modes &modes)
    { return all_known(effects_of(modes.form(error(), modes))); };
    const Complex slope = at.form(a_1(), at)(0, 0);
    const auto bar      = bound_critical_value(from, here, to, known(before), known(after),
                                               CriticalModes{0, -1, at.lambda[0]});
    REQUIRE(bar);
    const double corrected = critical(growth_rate(1), 0, 1),
                 all       = critical(growth_rate(whole_effect(2)), 0, 1);
    CHECK(bar->correction == doctest::Approx(corrected - p_c).epsilon(1e-3));
    CHECK(bar->error == doctest::Approx(std::abs(all - p_c)).epsilon(1e-3));
    // By the slope alone: nearly the same, far from other modes.
    const auto linear_bar = bound_critical_value(here, known(at), 0, slope.real());
    REQUIRE(linear_bar);
    CHECK(linear_bar->correction == doctest::Approx(corrected - p_c).epsilon(0.05));
    CHECK(linear_bar->error == doctest::Approx(bar->error).epsilon(0.3));
  }

  TEST_CASE("carried errors: the bar of a coalescence")
  {
    // l = j (100 +- sqrt(1 - 2 p)) and a third mode: they meet at p = 1/2 and grow from there on.
    ComplexDenseMatrix c_0(3, 3), c_1(3, 3), e(3, 3);
    const Complex j(0, 1);
    c_0(0, 0) = 101. * j;
    c_0(1, 1) = 99. * j;
    c_0(2, 2) = 140. * j;
    // ((101 - 99)/2)^2 + b c with b = p j, c = 2 j ... : half difference squared of a/j is 1 - 2 p
    c_1(0, 1)      = 2. * j;
    c_1(1, 0)      = -1. * j;
    e(0, 0)        = 0.02 * j;
    e(1, 1)        = -0.03 * j;
    e(0, 1)        = 0.01 * j;
    e(2, 2)        = -0.5 * j;
    const Family a = [&](const double p)
    {
      ComplexDenseMatrix result = c_0; // b c = -2 p: the one grows, the other one stays
      result(0, 1)              = c_1(0, 1);
      result(1, 0)              = p * c_1(1, 0);
      return result;
    };
    const auto discriminant = [&](const double s)
    {
      return [&, s](const double p)
      {
        const ComplexDenseMatrix m = sum(a(p), s, e);
        return (std::pow((m(0, 0) - m(1, 1)) / 2. / j, 2) + m(0, 1) * m(1, 0) / (j * j)).real();
      };
    };
    const double p_c = critical(discriminant(0), 0.1, 0.9);
    CHECK(p_c == doctest::Approx(0.5));
    // As the search does: not at the double root, where vectors are parallel, but beside it.
    const double beside = p_c - 1e-4;
    const Modes before(a(0.3)), at(a(beside)), after(a(0.7));
    ModesOnCourse from = place(0.3, before, nullptr), here = place(beside, at, &before),
                  to = place(0.7, after, &before);
    const auto known = [&](const Modes &modes)
    { return all_known(effects_of(modes.form(e, modes))); };
    const auto bar = bound_critical_value(from, here, to, known(before), known(after),
                                          CriticalModes{0, 1, 100. * j});
    REQUIRE(bar);
    const double corrected = critical(discriminant(1), 0.1, 0.9),
                 all       = critical(discriminant(whole_effect(2)), 0.1, 0.9);
    CHECK(std::abs(bar->correction - (corrected - p_c)) <= 0.05 * std::abs(corrected - p_c));
    CHECK(bar->error == doctest::Approx(std::abs(all - p_c)).epsilon(0.02));

    // Two kinds of cells, whose parts nearly cancel
    ComplexDenseMatrix first(3, 3), second = e;
    first(0, 0) = 0.2 * j;
    second(0, 0) -= 0.2 * j;
    const auto with_kinds = [&](const Modes &modes)
    {
      ErrorEffects effects = effects_of(modes.form(e, modes));
      effects.kinds        = {modes.form(first, modes).values, modes.form(second, modes).values};
      return all_known(effects);
    };
    const auto both = bound_critical_value(from, here, to, with_kinds(before), with_kinds(after),
                                           CriticalModes{0, 1, 100. * j});
    REQUIRE(both);
    double by_kinds = 0;
    for (const ComplexDenseMatrix *kind : {&first, &second})
    {
      const Family other = [&](const double p) { return sum(a(p), whole_effect(2), e); };
      double largest     = 0;
      for (const double sign : {-1., 1.})
      {
        const auto changed = [&](const double p)
        {
          const ComplexDenseMatrix m = sum(other(p), sign * unequal_parts * whole_effect(2), *kind);
          return (std::pow((m(0, 0) - m(1, 1)) / 2. / j, 2) + m(0, 1) * m(1, 0) / (j * j)).real();
        };
        largest = std::max(largest, std::abs(critical(changed, -0.5, 1.5) - all));
      }
      by_kinds += largest;
    }
    CHECK(by_kinds > 2 * std::abs(all - p_c));
    CHECK(both->error == doctest::Approx(std::hypot(all - p_c, by_kinds)).epsilon(0.05));
  }
} // namespace squeal::tests::carried_errors
