#include <squeal/linalg/find_root.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace squeal
{
  Root find_root(double low, double f_low, double high, double f_high,
                 const DifferentiableFunction &function,
                 const std::function<bool(double p, double step)> &is_converged)
  {
    constexpr unsigned int max_iterations = 40;
    const double size                     = std::max(std::abs(low), std::abs(high));
    const auto chord = [&]() { return low - f_low * (high - low) / (f_high - f_low); };
    Root root;
    double p = chord();
    for (root.iterations = 1; root.iterations <= max_iterations; ++root.iterations)
    {
      const auto [value, slope] = function(p);
      if (value * f_low > 0)
      {
        low   = p;
        f_low = value;
      }
      else
      {
        high   = p;
        f_high = value;
      }
      double next = p;
      if (value != 0)
        next = std::isfinite(slope) && slope != 0 ? p - value / slope : chord();
      const bool done = is_converged && is_converged(p, std::abs(next - p));
      if (!done && (next - low) * (next - high) > 0) // Newton left the interval
        next = (low + high) / 2;
      root.accuracy = std::abs(next - p);
      p             = next;
      if (done || (!is_converged && root.accuracy <= 1e-11 * size))
        break;
    }
    root.value = p;
    return root;
  }

  std::optional<Root> find_root(const double low, const double high,
                                const DifferentiableFunction &function)
  {
    const auto [f_low, slope_low]   = function(low);
    const auto [f_high, slope_high] = function(high);
    const double size               = std::max(std::abs(low), std::abs(high));
    for (const auto &[p, f, slope] :
         {std::make_tuple(low, f_low, slope_low), std::make_tuple(high, f_high, slope_high)})
    {
      if (f == 0)
        return Root{p, 0, 0};
      if (std::abs(f) <= 1e-11 * size * std::abs(slope))
        return Root{p - f / slope, std::abs(f / slope), 0};
    }
    if (f_low * f_high > 0)
      return {};
    return find_root(low, f_low, high, f_high, function);
  }
} // namespace squeal
