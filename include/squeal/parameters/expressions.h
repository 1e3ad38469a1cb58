#pragma once

#include <deal.II/base/point.h>

#include <functional>
#include <optional>
#include <string>

namespace squeal
{
  /// A function of position from its text (muParser): variables x, y and, in three dimensions, z;
  /// m. Throws InputError that names the key if the text cannot be read.
  template <int dim>
  std::function<double(const dealii::Point<dim> &)> position_expression(const std::string &text,
                                                                        const std::string &key);

  /// Pads/Pressure for which the loads of a scene are made, Pa: models scale them to their own, and
  /// loads of zero could not be scaled.
  inline double pressure_of_loads(const double pressure)
  {
    return pressure > 0 ? pressure : 1;
  }

  /// The number that an expression without variables is, such as 2*pi*3; nothing for any other
  /// text, a comma (it is no decimal point), or if it is not finite.
  std::optional<double> constant_expression(const std::string &text);

  /// mu(v, p) from its text: sliding speed v, m/s, and contact pressure p, Pa. Throws InputError.
  std::function<double(double, double)> friction_expression(const std::string &text,
                                                            const std::string &key);
} // namespace squeal
