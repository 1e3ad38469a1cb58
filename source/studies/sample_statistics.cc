#include <squeal/studies/sample_statistics.h>

#include <boost/random/sobol.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace squeal
{
  namespace
  {
    constexpr double of_95_percent = 1.959964;
  }

  std::vector<std::vector<double>> sobol_points(const unsigned int n_points,
                                                const unsigned int dimension)
  {
    boost::random::sobol_engine<std::uint32_t, 32> engine(dimension);
    std::vector<std::vector<double>> points(n_points, std::vector<double>(dimension));
    // The sequence begins with the corner zero. In the middle of intervals of 2^-32 no point lies
    // on the border, but that one would be all but there: the engine of Boost leaves it out.
    for (std::vector<double> &point : points)
      for (double &x : point)
        x = (engine() + 0.5) / 4294967296.;
    return points;
  }

  Share share_of(const unsigned int n_hits, const unsigned int n)
  {
    if (n == 0)
      return {std::numeric_limits<double>::quiet_NaN(), 1};
    const double p = double(n_hits) / n, z = of_95_percent, z2 = z * z / n;
    const double centre = (p + z2 / 2) / (1 + z2),
                 half   = z / (1 + z2) * std::sqrt(p * (1 - p) / n + z2 / (4 * n));
    // The interval is not symmetric: the longer side of it
    return {p, std::abs(centre - p) + half};
  }

  namespace
  {
    /// sum of terms / (2 n V), with the error of the mean of the terms.
    Share ratio_of(const std::vector<double> &terms, const double variance)
    {
      const std::size_t n = terms.size();
      double mean = 0, square = 0;
      for (const double term : terms)
        mean += term / n;
      for (const double term : terms)
        square += (term - mean) * (term - mean) / n;
      return {mean / (2 * variance), of_95_percent * std::sqrt(square / n) / (2 * variance)};
    }
  } // namespace

  SensitivityIndices sensitivity_indices(const std::vector<double> &at_a,
                                         const std::vector<double> &at_b,
                                         const std::vector<double> &at_ab)
  {
    std::vector<double> of_first, of_total, values;
    for (std::size_t k = 0; k < at_a.size(); ++k)
    {
      if (!std::isfinite(at_a[k]) || !std::isfinite(at_b[k]) || !std::isfinite(at_ab[k]))
        continue;
      of_first.push_back(std::pow(at_b[k] - at_ab[k], 2));
      of_total.push_back(std::pow(at_a[k] - at_ab[k], 2));
      values.insert(values.end(), {at_a[k], at_b[k]});
    }
    double mean = 0, variance = 0;
    for (const double value : values)
      mean += value / values.size();
    for (const double value : values)
      variance += (value - mean) * (value - mean) / values.size();
    SensitivityIndices result;
    if (!(variance > 0)) // a constant, or nothing known
    {
      const double unknown = std::numeric_limits<double>::quiet_NaN();
      result.first_order = result.total = {unknown, unknown};
      return result;
    }
    result.first_order       = ratio_of(of_first, variance);
    result.first_order.value = 1 - result.first_order.value;
    result.total             = ratio_of(of_total, variance);
    return result;
  }

  double quantile_of(std::vector<double> numbers, const double share)
  {
    if (numbers.empty())
      return std::numeric_limits<double>::quiet_NaN();
    std::sort(numbers.begin(), numbers.end());
    const double at      = share * (numbers.size() - 1);
    const std::size_t k  = std::min<std::size_t>(at, numbers.size() - 1);
    const double between = k + 1 < numbers.size() ? (at - k) * (numbers[k + 1] - numbers[k]) : 0;
    return numbers[k] + between;
  }
} // namespace squeal
