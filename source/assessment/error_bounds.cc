#include <squeal/assessment/error_bounds.h>
#include <squeal/assessment/stability.h>
#include <squeal/linalg/dense.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// The eigenvalues of a matrix, column-major, that belong to its diagonal entries: each to the
    /// one whose unit vector its eigenvector is nearest to. Where vectors are mixtures of several,
    /// the distance from @p lambda counts.
    std::vector<Complex> eigenvalues_by_vector(const std::vector<Complex> &matrix,
                                               const std::vector<Complex> &lambda)
    {
      const unsigned int n = lambda.size();
      if (n <= 1)
        return matrix;
      // Real and imaginary parts: [Re, -Im; Im, Re] has the eigenvalues of A, with the vectors
      // [x; -j x], and those of its conjugate, with the vectors [y; j y]. Of [a; b] the part x =
      // (a + j b) / 2 belongs to A.
      DenseMatrix embedded(2 * n, 2 * n);
      for (unsigned int i = 0; i < n; ++i)
        for (unsigned int j = 0; j < n; ++j)
        {
          embedded(i, j) = embedded(n + i, n + j) = matrix[i + n * j].real();
          embedded(n + i, j)                      = matrix[i + n * j].imag();
          embedded(i, n + j)                      = -matrix[i + n * j].imag();
        }
      const DenseEigenpairs pairs = general_eigen(std::move(embedded));
      double size                 = 0;
      for (const Complex &l : lambda)
        size = std::max(size, std::abs(l - lambda.front()));
      std::vector<Complex> roots;
      std::vector<std::vector<double>> costs(n);
      for (unsigned int k = 0; k < 2 * n; ++k)
      {
        roots.push_back(pairs.values[k]);
        const Complex *const entries = pairs.right.column(k);
        double norm                  = 0;
        for (unsigned int j = 0; j < 2 * n; ++j)
          norm += std::norm(entries[j]) / 2;
        for (unsigned int j = 0; j < n; ++j)
          costs[j].push_back(1 -
                             std::norm((entries[j] + Complex(0, 1) * entries[n + j]) / 2.) / norm +
                             std::abs(roots[k] - lambda[j]) / (5 * size + 1e-300));
      }
      std::vector<Complex> result;
      for (const int partner : assign(costs, 2 * n))
        result.push_back(roots[partner]);
      return result;
    }

    /// The eigenvalues of L + S F S for diagonal L = diag(l_i) and S = diag(sqrt(t_i)), some of the
    /// modes only.
    std::vector<Complex> coupled(const std::vector<Complex> &lambda, const std::vector<Complex> &f,
                                 const std::vector<unsigned int> &members,
                                 const std::vector<double> &t)
    {
      const unsigned int n = members.size(), m = lambda.size();
      std::vector<Complex> matrix(n * n), values;
      for (unsigned int i = 0; i < n; ++i)
      {
        values.push_back(lambda[members[i]]);
        for (unsigned int j = 0; j < n; ++j)
          matrix[i + n * j] = (i == j ? lambda[members[i]] : 0.) +
                              std::sqrt(t[i] * t[j]) * f[members[i] + m * members[j]];
      }
      return eigenvalues_by_vector(matrix, values);
    }

    /// The modes that may come closer to mode k than the errors of both, k first.
    std::vector<unsigned int> neighbours(const std::vector<Complex> &lambda,
                                         const std::vector<Complex> &f, const unsigned int k,
                                         const double factor)
    {
      constexpr unsigned int largest = 8;
      const unsigned int m           = lambda.size();
      std::vector<std::pair<double, unsigned int>> candidates;
      for (unsigned int j = 0; j < m; ++j)
      {
        const double distance = std::abs(lambda[j] - lambda[k]),
                     size     = std::abs(f[j + m * j]) + std::abs(f[k + m * k]);
        // Beyond rounding: modes of a symmetric brake whose parity was not told do not couple.
        if (j != k && std::abs(f[j + m * k] * f[k + m * j]) <= 1e-10 * size * size)
          continue;
        if (distance <= 2 * factor * size)
          candidates.emplace_back(j == k ? -1. : distance, j);
      }
      std::sort(candidates.begin(), candidates.end());
      std::vector<unsigned int> members;
      for (unsigned int i = 0; i < std::min<std::size_t>(largest, candidates.size()); ++i)
        members.push_back(candidates[i].second);
      return members;
    }

    /// Where two modes come closest as their effects grow together: t for which the discriminant of
    /// [l_k, 0; 0, l_j] + t F, (l_k - l_j + t (F_kk - F_jj))^2 + 4 t^2 F_kj F_jk, is stationary.
    double closest_approach(const std::vector<Complex> &lambda, const std::vector<Complex> &f,
                            const unsigned int k, const unsigned int j)
    {
      const unsigned int m   = lambda.size();
      const Complex distance = lambda[k] - lambda[j], difference = f[k + m * k] - f[j + m * j];
      return (-distance * difference / (difference * difference + 4. * f[k + m * j] * f[j + m * k]))
          .real();
    }

    using Effect = ErrorEffects::Effect;

    ErrorBounds bound_errors_of_sector(const std::vector<Complex> &lambda,
                                       const ErrorEffects &effects)
    {
      const Effect &f      = effects.f;
      const unsigned int m = lambda.size();
      const double whole = whole_effect(effects.degree), unequal = 0.25;
      std::vector<unsigned int> all(m);
      std::iota(all.begin(), all.end(), 0u);
      const std::vector<Complex> corrected = coupled(lambda, correcting(effects), all,
                                                     std::vector<double>(m, 1.)),
                                 seen      = coupled(lambda, f, all, std::vector<double>(m, 1.)),
                                 extrapolated =
                                     coupled(lambda, f, all, std::vector<double>(m, whole));
      std::vector<std::vector<std::vector<Complex>>> shifted;
      for (const ErrorEffects::Alternatives &group : effects.alternatives)
      {
        shifted.emplace_back();
        for (std::vector<Complex> sum : group.effects)
        {
          for (unsigned int i = 0; i < m * m; ++i)
            sum[i] += whole * f[i];
          shifted.back().push_back(coupled(lambda, sum, all, std::vector<double>(m, 1.)));
        }
      }
      ErrorBounds bounds;
      bounds.parts = {{"one degree more", "", {}, {}}, {"unlike parts of the mesh", "", {}, {}}};
      for (const ErrorEffects::Alternatives &group : effects.alternatives)
        bounds.parts.push_back({group.name, "", {}, {}});
      for (unsigned int k = 0; k < m; ++k)
      {
        const auto note = [&](const unsigned int part, const double re, const double im)
        {
          bounds.parts[part].growth_rate.push_back(re);
          bounds.parts[part].imaginary.push_back(im);
        };
        bounds.correction.push_back(corrected[k] - lambda[k]);
        UncertainChange growth_rate, imaginary;
        const auto include = [&](const Complex &changed)
        {
          growth_rate.include((changed - lambda[k]).real());
          imaginary.include((changed - lambda[k]).imag());
        };
        include(seen[k]);
        include(extrapolated[k]);
        const std::vector<unsigned int> members = neighbours(lambda, f, k, whole);
        for (unsigned int varied = 0; varied < members.size() && members.size() > 1; ++varied)
          for (const bool seen_only : {true, false})
          {
            std::vector<double> t(members.size(), seen_only ? 1. : whole);
            t[varied] *= seen_only ? 1 + unequal : 1 - unequal;
            include(coupled(lambda, f, members, t)[0]);
          }
        // Two that meet on the way are as they were on both sides of it, and flutter between.
        for (const unsigned int j : members)
          if (const double t = j == k ? 0 : closest_approach(lambda, f, k, j);
              t >= 1 - unequal && t <= (1 + unequal) * whole)
            include(coupled(lambda, f, members, std::vector<double>(members.size(), t))[0]);
        const double unlike = unequal_parts * whole * effects.growth_rate_parts(k);
        growth_rate.set_parts(unlike);
        note(0, growth_rate.largest_change(), imaginary.largest_change());
        note(1, unlike, 0);
        for (unsigned int g = 0; g < shifted.size(); ++g)
        {
          std::vector<double> re, im;
          for (const std::vector<Complex> &roots : shifted[g])
          {
            re.push_back((roots[k] - extrapolated[k]).real());
            im.push_back((roots[k] - extrapolated[k]).imag());
          }
          note(2 + g, growth_rate.add(effects.alternatives[g], re),
               imaginary.add(effects.alternatives[g], im));
        }
        bounds.growth_rate.push_back(growth_rate.bound());
        bounds.imaginary.push_back(imaginary.bound());
      }
      return bounds;
    }
  } // namespace

  double ErrorEffects::growth_rate_parts(const unsigned int mode) const
  {
    const std::size_t diagonal = mode * (std::size_t(n_modes()) + 1);
    double sum                 = 0;
    for (const Effect &effect : kinds)
      sum += std::abs(effect[diagonal].real());
    return sum;
  }

  ErrorEffects::Effect correcting(const ErrorEffects &effects)
  {
    Effect sum = effects.f;
    for (const ErrorEffects::Alternatives &group : effects.alternatives)
      if (group.with_likeliest)
        for (std::size_t k = 0; k < sum.size(); ++k)
          sum[k] += group.effects.back()[k];
    return sum;
  }

  double UncertainChange::add(const ErrorEffects::Alternatives &alternatives,
                              const std::vector<double> &changes)
  {
    double &sum = alternatives.with_likeliest ? both_sides : at_most, of_these = 0;
    for (const double change : changes)
      of_these = std::max(of_these, std::abs(change));
    sum += of_these;
    return of_these;
  }

  double whole_effect(const unsigned int degree)
  {
    const double p = degree, seen = 1 - p * p / ((p + 1) * (p + 1));
    return 1.2 / seen;
  }

  ErrorBounds bound_errors(const std::vector<Complex> &lambda, const std::vector<Parity> &parity,
                           const ErrorEffects &effects)
  {
    const unsigned int m = lambda.size();
    ErrorBounds bounds;
    bounds.correction.resize(m);
    bounds.growth_rate.resize(m);
    bounds.imaginary.resize(m);
    for (const Parity sector : {Parity::none, Parity::symmetric, Parity::antisymmetric})
    {
      std::vector<unsigned int> members;
      for (unsigned int j = 0; j < m; ++j)
        if ((parity.empty() ? Parity::none : parity[j]) == sector)
          members.push_back(j);
      if (members.empty())
        continue;
      std::vector<Complex> own_lambda;
      for (const unsigned int j : members)
        own_lambda.push_back(lambda[j]);
      const ErrorBounds own = bound_errors_of_sector(own_lambda, select(effects, members));
      if (bounds.parts.empty())
        for (const BarPart &part : own.parts)
          bounds.parts.push_back(
              {part.cause, part.at, std::vector<double>(m), std::vector<double>(m)});
      for (unsigned int k = 0; k < members.size(); ++k)
      {
        bounds.correction[members[k]]  = own.correction[k];
        bounds.growth_rate[members[k]] = own.growth_rate[k];
        bounds.imaginary[members[k]]   = own.imaginary[k];
        for (unsigned int part = 0; part < own.parts.size(); ++part)
        {
          bounds.parts[part].growth_rate[members[k]] = own.parts[part].growth_rate[k];
          bounds.parts[part].imaginary[members[k]]   = own.parts[part].imaginary[k];
        }
      }
    }
    return bounds;
  }

  ErrorEffects select(const ErrorEffects &effects, const std::vector<unsigned int> &members)
  {
    const unsigned int m = effects.n_modes();
    const auto within    = [&](const Effect &effect)
    {
      Effect part;
      for (const unsigned int j : members)
        for (const unsigned int i : members)
          part.push_back(effect[i + m * j]);
      return part;
    };
    ErrorEffects result;
    result.degree = effects.degree;
    result.f      = within(effects.f);
    for (const Effect &effect : effects.kinds)
      result.kinds.push_back(within(effect));
    for (const ErrorEffects::Alternatives &group : effects.alternatives)
    {
      result.alternatives.push_back({{}, group.with_likeliest, group.name});
      for (const Effect &effect : group.effects)
        result.alternatives.back().effects.push_back(within(effect));
    }
    return result;
  }
} // namespace squeal
