#include <squeal/assessment/critical_speed.h>
#include <squeal/base/text.h>

#include <cmath>

namespace squeal
{
  // Waves of n nodal diameters and of the frequency w_n on the disc have, seen from beside it,
  //     w = w_n + n Omega (with the rotation) and w = |w_n - n Omega|,
  // of which the second ones stand still at the critical speed w_n / n. Beyond it they turn with
  // the disc, too: what turns with it and has w < 2 n Omega has w_n = |w - n Omega| < n Omega.
  std::string doubt_about_critical_speed(const std::vector<ModeRow> &modes, const double speed,
                                         const bool has_stress_stiffness)
  {
    constexpr double mostly = 0.5; // of the energy, more with the rotation than against it
    const ModeRow *slowest  = nullptr;
    double critical         = std::abs(speed);
    const double sense      = speed < 0 ? -1 : 1; // of the rotation about z
    for (const ModeRow &row : modes)
    {
      if (!row.shape || !row.shape->is_of_rotor() || row.shape->nodal_diameters == 0)
        continue;
      const double n = row.shape->nodal_diameters, w = std::abs(row.lambda.imag());
      const double of_wave = std::abs(w / n - std::abs(speed));
      if (row.shape->travelling * sense < mostly || row.shape->order_share < mostly ||
          of_wave >= critical)
        continue;
      critical = of_wave;
      slowest  = &row;
    }
    if (!slowest)
      return "";
    return text_of(
        "Warning, critical speed: the rotor turns with ", number(std::abs(speed), 6),
        " rad/s, faster than the wave of mode ", slowest->mode, " (",
        slowest->shape->nodal_diameters, " nodal diameters, ", number(slowest->frequency(), 5),
        " Hz), whose critical speed is ", number(critical, 4), " rad/s. No brake does.",
        has_stress_stiffness ? ""
                             : " The stiffness by centrifugal stress, which matters there, is "
                               "left out (Prestress/Stress stiffness = false).");
  }
} // namespace squeal
