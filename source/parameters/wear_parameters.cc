#include <squeal/parameters/declare.h>
#include <squeal/parameters/entries.h>
#include <squeal/parameters/parameters.h>

#include <cmath>
#include <limits>

namespace squeal
{
  namespace Parameters
  {
    void Wear::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Wear");
      prm.add_parameter("Coefficient", coefficient,
                        "k of the wear law dh/dt = k p^a v^b, worn depth of the pads h in m, "
                        "pressure p in Pa, sliding speed v in m/s; Archard's law a = b = 1: m^2/N. "
                        "Used with Steady pressure = worn, and a Sliding distance that is finite.",
                        positive());
      prm.add_parameter("Pressure exponent", pressure_exponent, "a of the wear law.",
                        Patterns::Double(0.1, 10));
      prm.add_parameter("Speed exponent", speed_exponent, "b of the wear law.",
                        Patterns::Double(0, 10));
      prm.add_parameter("Sliding distance", sliding_distance,
                        "How far the pads have slid at their mean radius, m, or infinite: until "
                        "the pressure does not change any more. 0: new pads.");
      prm.add_parameter("Pressure", pressure,
                        "Pads/Pressure while the pads wore, Pa. 0: Pads/Pressure itself.",
                        not_negative());
    }

    double Wear::distance() const
    {
      if (sliding_distance == "infinite")
        return std::numeric_limits<double>::infinity();
      const std::optional<double> value = to_number(sliding_distance);
      if (!value || *value < 0)
        throw InputError("Contact/Wear/Sliding distance = " + sliding_distance +
                         ": allowed are a number of at least 0, m, and infinite.");
      return *value;
    }

    bool Contact::is_fully_worn() const
    {
      return is_worn() && std::isinf(wear.distance());
    }

    void All::check_wear() const
    {
      const Wear &wear         = contact.wear;
      const std::string key    = "Contact/Steady pressure = worn: ";
      const double distance    = wear.distance();
      const bool is_with_loads = wear.pressure != 0 && wear.pressure != pads.pressure;
      if (n_pads() == 0)
        throw InputError(key + "there are no pads; allowed is computed.");
      const bool ages = distance > 0 && !std::isinf(distance);
      if (is_with_loads && std::isinf(distance))
        throw InputError(text_of("Contact/Wear/Pressure = ", wear.pressure,
                                 ": allowed with a Contact/Wear/Sliding distance that is finite, "
                                 "which may be large, or 0, with infinite."));
      if (ages && wear.pressure > 0 && scene == Scene::mesh && !mesh.surface_pressures.empty())
        throw InputError(text_of("Contact/Wear/Pressure = ", wear.pressure,
                                 ": with Mesh/Pressures, which stay as they are while pads wear, "
                                 "allowed is 0."));
      if (ages && wear.pressure_exponent != 1)
        throw InputError(text_of("Contact/Wear/Pressure exponent = ", wear.pressure_exponent,
                                 ": allowed with Sliding distance = ", wear.sliding_distance,
                                 " is 1, others with infinite."));
      if (ages && wear.speed_exponent != 1 && operation.angular_velocity == 0)
        throw InputError(text_of("Contact/Wear/Speed exponent = ", wear.speed_exponent,
                                 ": allowed at rest, Operation/Angular velocity = 0, is 1."));
      if (ages && output.sensitivities)
        throw InputError("Output/Sensitivities = true: how the wear of Contact/Wear/Sliding "
                         "distance = " +
                         wear.sliding_distance +
                         " depends on parameters is not differentiated; allowed are 0 and "
                         "infinite.");
      if (std::isinf(distance) && !joints.contacts.empty())
        throw InputError(key + "Joints/Contacts = " + joints.contacts +
                         ": where these touch depends on the elasticity of bodies, which the "
                         "pressure of worn pads does not know; allowed are a finite "
                         "Contact/Wear/Sliding distance, or ties, springs and links.");
    }
  } // namespace Parameters
} // namespace squeal
