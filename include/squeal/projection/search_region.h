#pragma once

#include <algorithm>
#include <cmath>
#include <complex>

namespace squeal
{
  /// The part of the plane of l in which a solver looks for every eigenvalue: |l^2 - s| <= r^2 with
  /// a real centre s of l^2. About s = 0 it is the disc |l| <= r; about s = -w^2, w > r, an oval of
  /// Cassini around i w that cuts the imaginary axis at sqrt(w^2 -+ r^2), and its image around
  /// -i w.
  struct SearchRegion
  {
    double square = 0; ///< s, 1/s^2
    double radius = 0; ///< r, 1/s

    /// The region with lower < |l| < upper on the imaginary axis; lower = 0: the disc.
    static SearchRegion between(const double lower, const double upper)
    {
      if (lower == 0)
        return {0, upper};
      return {-(upper * upper + lower * lower) / 2, std::sqrt((upper * upper - lower * lower) / 2)};
    }

    /// Relative to the rim: 1 on it. A square root, so that it is |l|/r for the disc.
    double distance(const std::complex<double> &l) const
    {
      return square == 0 ? std::abs(l) / radius : std::sqrt(std::abs(l * l - square)) / radius;
    }
    bool contains(const std::complex<double> &l) const
    {
      return distance(l) <= 1;
    }
    bool is_disc() const
    {
      return square == 0;
    }
    double lower() const
    {
      return std::sqrt(std::max(0., -square - radius * radius));
    }
    double upper() const
    {
      return std::sqrt(radius * radius - square);
    }
  };
} // namespace squeal
