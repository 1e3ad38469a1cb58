#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/model/plausible_load.h>
#include <squeal/parameters/plausibility.h>

#include <algorithm>

namespace squeal
{
  namespace
  {
    std::string reason_for_no_load(const Parameters::All &prm)
    {
      const bool has_own = prm.scene == Scene::mesh && !prm.mesh.surface_pressures.empty();
      if (prm.pads.pressure == 0 && !has_own)
        return "Pads/Pressure = 0.";
      if (prm.scene == Scene::mesh && prm.mesh.pressure_on.empty() && !has_own)
        return "Mesh/Pressure on and Mesh/Pressures are empty: no surface is pressed.";
      if (prm.scene == Scene::mesh)
        return "Pads/Pressure acts on Mesh/Pressure on = " + prm.mesh.pressure_on +
               (has_own ? ", beside Mesh/Pressures = " + prm.mesh.pressures : "") +
               ": these surfaces are held (Mesh/Clamped, Guided, Fixed), are not of this pad, lie "
               "along the axis, or Pads/Pressure profile is zero there.";
      return "What Pads/Pressure acts on is held (Pads/Back face), or Pads/Pressure profile is "
             "zero there.";
    }
  } // namespace

  void need_load(const Parameters::All &prm, const std::vector<ContactResultants> &pads)
  {
    constexpr double rounding = 1e-14; // of a modulus, as a pressure
    double modulus            = 0;
    for (const Parameters::BodyMaterial &body : prm.materials())
      if (prm.is_used(body))
        modulus = std::max(modulus, body.material.young_modulus);
    if (prm.terms().friction)
      for (const ContactResultants &pad : pads)
        if (pad.kind == ContactKind::sliding && !(pad.normal_force > rounding * modulus * pad.area))
          throw NoLoad("The pad '" + pad.name + "' carries no force in the static state (" +
                       number(pad.normal_force, 3) +
                       " N): friction has nothing to act on, and no verdict is given. " +
                       reason_for_no_load(prm) + " Stage = elastic and transport need no load.");
  }

  void refuse_load_across_axis(const Parameters::All &prm)
  {
    const std::string surfaces =
        prm.scene == Scene::mesh
            ? " Mesh/Pressure on = " + prm.mesh.pressure_on +
                  (prm.mesh.pressures.empty() ? "" : ", Mesh/Pressures = " + prm.mesh.pressures) +
                  " are surfaces along the axis; name the backs of the pads."
            : "";
    throw NoLoad("The loads act across the axis only: nothing presses the pads on the rotor, and "
                 "there is no static state." +
                 surfaces);
  }

  std::vector<std::string> doubts_about_load(const Parameters::All &prm,
                                             const std::vector<ContactResultants> &pads)
  {
    std::vector<std::string> all;
    if (!prm.terms().friction)
      return all;
    const ContactResultants *least = nullptr, *most = nullptr;
    for (const ContactResultants &pad : pads)
    {
      if (pad.kind != ContactKind::sliding)
        continue;
      if (!least || pad.normal_force < least->normal_force)
        least = &pad;
      if (!most || pad.normal_force > most->normal_force)
        most = &pad;
      const double mean = pad.area > 0 ? pad.normal_force / pad.area : 0;
      if (!usual_pressure.holds(mean))
        all.push_back(text_of("Warning, pressure: the mean pressure of the pad ", pad.name, " is ",
                              number(mean, 4),
                              " Pa; usual are 1e3 to 1e8 Pa. Pads/Pressure is in Pa: 1 MPa is "
                              "1e6."));
    }
    // Both pads of a floating caliper carry the same force.
    if (least && least->normal_force < 2. / 3 * most->normal_force)
      all.push_back(text_of("Warning, uneven load: the pad ", least->name, " is pressed with ",
                            number(least->normal_force, 4), " N, the pad ", most->name, " with ",
                            number(most->normal_force, 4), " N."));
    return all;
  }
} // namespace squeal
