#include <squeal/base/text.h>
#include <squeal/parameters/plausibility.h>

#include <cmath>

namespace squeal
{
  namespace
  {
    struct Unit
    {
      const char *name;
      double factor; ///< in SI units
    };
    constexpr Range usual_modulus  = {1e5, 1.3e12}, // Pa: foam to diamond
        usual_density              = {500, 25000},  // kg/m^3: wood to platinum
        usual_wave                 = {20, 13000},   // m/s, sqrt(E/rho): rubber to beryllium
        wave_of_rotor              = {1000, 12000}; // m/s
    constexpr double fastest       = 300;           // rad/s: 320 km/h on wheels of 0.3 m
    constexpr double lowest_squeal = 100;           // Hz

    /// The unit in which a value that is out of its range would be in it, as a hint.
    std::string meant_modulus(const double modulus)
    {
      for (const auto &[unit, factor] : {Unit{"MPa", 1e6}, Unit{"GPa", 1e9}})
        if (modulus < usual_modulus.low * 100 &&
            Range{1e8, usual_modulus.high}.holds(modulus * factor))
          return text_of("; in ", unit, " it would be ", number(modulus * factor, 4), " Pa");
      return "";
    }

    std::string meant_density(const double density)
    {
      for (const auto &[unit, factor] :
           {Unit{"g/cm^3", 1e3}, Unit{"kg/mm^3", 1e9}, Unit{"t/mm^3", 1e12},
            Unit{"kg/mm^3, taken for t/mm^3,", 1e-3}})
        if (usual_density.holds(density * factor))
          return text_of("; in ", unit, " it would be ", number(density * factor, 4), " kg/m^3");
      return "";
    }

    /// One line for a material, whatever is unusual about it.
    std::string doubt_about_material(const Parameters::BodyMaterial &body, const bool is_disc)
    {
      const double modulus = body.material.young_modulus, density = body.material.density,
                   wave = std::sqrt(modulus / density);
      const Range waves = is_disc ? wave_of_rotor : usual_wave;
      std::string what;
      if (!usual_modulus.holds(modulus))
        what += text_of("; Young modulus = ", number(modulus), " Pa (usual are ", usual_modulus.low,
                        " to ", usual_modulus.high, ")", meant_modulus(modulus));
      if (!usual_density.holds(density))
        what += text_of("; Density = ", number(density), " kg/m^3 (usual are ", usual_density.low,
                        " to ", usual_density.high, ")", meant_density(density));
      if (!waves.holds(wave))
        what += text_of("; waves run with sqrt(E/rho) = ", number(wave, 3), " m/s (usual are ",
                        waves.low, " to ", waves.high, is_disc ? " in a rotor)" : ")",
                        what.empty() ? meant_modulus(modulus) : "");
      return what.empty() ? ""
                          : text_of("Warning, units: ", body.section, "/Material: ", what.substr(2),
                                    ". Units are Pa and kg/m^3.");
    }

    void add(std::vector<std::string> &all, const std::string &doubt)
    {
      if (!doubt.empty())
        all.push_back(doubt);
    }

    void add_doubts_about_load(const Parameters::All &prm, std::vector<std::string> &all)
    {
      if (prm.n_pads() == 0 || !prm.terms().friction)
        return;
      const auto look_at = [&](const std::string &key, const double pressure)
      {
        if (pressure != 0 && !usual_pressure.holds(std::abs(pressure)))
          all.push_back(text_of("Warning, pressure: ", key, " = ", number(pressure),
                                " Pa. Usual are 1e3 to 1e8 Pa; 1 MPa is 1e6."));
      };
      const bool is_of_surfaces = prm.scene == Scene::mesh &&
                                  prm.contact.steady_pressure != SteadyPressure::uniform,
                 is_loaded = is_of_surfaces ? prm.mesh.is_loaded(prm.pads.pressure)
                                            : prm.pads.pressure != 0;
      if (!is_of_surfaces || !prm.mesh.pressure_on.empty())
        look_at("Pads/Pressure", prm.pads.pressure);
      if (is_of_surfaces)
        for (const auto &[surface, pressure] : prm.mesh.surface_pressures)
          look_at(Parameters::Mesh::pressure_path + surface, pressure);
      if (!is_loaded)
        all.push_back(
            text_of("Warning, no load: ",
                    prm.pads.pressure == 0 ? "Pads/Pressure = 0" : "Mesh/Pressure on is empty",
                    is_of_surfaces ? ", and so is Mesh/Pressures" : "",
                    ". Pads that nothing presses have no friction."));
    }

    /// Adds doubts about numbers of the contact, each used by this formulation and law.
    void add_doubts_about_contact(const Parameters::All &prm, std::vector<std::string> &all)
    {
      constexpr double largest_friction = 1.5;
      constexpr Range usual_penalty     = {1e8, 1e18}; // Pa/m
      if (prm.n_pads() == 0)
        return;
      const FrictionLaw &law = prm.contact.friction;
      const bool has_numbers = prm.terms().friction && law.kind != FrictionLaw::Kind::expression;
      if (has_numbers && std::abs(law.coefficient) > largest_friction)
        all.push_back(text_of("Warning, friction: Contact/Friction/Coefficient = ",
                              number(law.coefficient), ". Usual are 0 to 1; 40 % are 0.4."));
      if (const double k = prm.contact.penalty_stiffness;
          prm.contact.formulation != Formulation::mortar && !usual_penalty.holds(k))
        all.push_back(text_of("Warning, penalty: Contact/Penalty stiffness = ", number(k),
                              " Pa/m. Usual are ", usual_penalty.low, " to ", usual_penalty.high,
                              " Pa/m; 1 MPa/mm is 1e9 Pa/m."));
    }

    /// Adds doubts about stresses by the rate of strain. A stiffness K with the damping beta K
    /// damps a mode of the frequency w with the ratio beta w / 2; a viscosity over its modulus is a
    /// beta.
    void add_doubts_about_viscosity(const Parameters::BodyMaterial &body,
                                    const double maximum_frequency, std::vector<std::string> &all)
    {
      struct Key
      {
        const char *name, *unit;
        double value, modulus;
      };
      const Material &material = body.material;
      const double shear       = material.shear_modulus(),
                   frequency   = std::min(1000., maximum_frequency); // Hz, squeal's least
      for (const Key &key :
           {Key{"Stiffness proportional damping", " s", material.stiffness_damping, 1},
            Key{"Shear viscosity", " Pa s", material.viscosity.shear, shear},
            Key{"Bulk viscosity", " Pa s", material.viscosity.bulk,
                material.longitudinal_modulus() - 4 * shear / 3}})
        if (const double one = key.modulus / (M_PI * frequency), ratio = key.value / one; ratio > 1)
          all.push_back(text_of("Warning, damping: ", body.section, "/Material/", key.name, " = ",
                                number(key.value), key.unit, ": motions of ", frequency,
                                " Hz have the damping ratio ", number(std::min(ratio, 1e300), 3),
                                " and do not vibrate; a ratio of 1 % there are ",
                                number(0.01 * one, 2), key.unit, "."));
    }

    /// Adds doubts about damping that lets nothing vibrate.
    void add_doubts_about_damping(const Parameters::All &prm, std::vector<std::string> &all)
    {
      constexpr double largest_loss = 2;
      if (!prm.has_damping() || !prm.eigenproblem.is_solved())
        return;
      for (const Parameters::BodyMaterial &body : prm.materials())
      {
        if (!prm.is_used(body))
          continue;
        add_doubts_about_viscosity(body, prm.eigenproblem.maximum_frequency, all);
        const double loss = body.material.stiffness_factor.loss_factor;
        if (loss > largest_loss)
          all.push_back(text_of("Warning, damping: ", body.section, "/Material/Loss factor = ",
                                number(loss), ". Usual are 0 to 1; 5 % are 0.05."));
      }
      constexpr double largest_ratio = 0.5;
      for (const Parameters::ModalDamping::Ratio &ratio : prm.modal_damping.ratios)
        if (ratio.value * prm.modal_damping.factor > largest_ratio)
        {
          all.push_back(text_of("Warning, damping: Modal damping/Ratios = ... ",
                                number(ratio.frequency), " : ", number(ratio.value),
                                ". Usual are below 0.1 of critical damping; 2 % are 0.02."));
          break;
        }
    }

    void add_doubts_about_motion(const Parameters::All &prm, std::vector<std::string> &all)
    {
      const double speed = std::abs(prm.operation.angular_velocity);
      if (prm.scene != Scene::strip && speed > fastest)
        all.push_back(text_of(
            "Warning, speed: Operation/Angular velocity = ", number(prm.operation.angular_velocity),
            " rad/s are ", number(speed * 30 / M_PI, 4),
            " revolutions a minute, more than wheels make (", fastest, " rad/s); ",
            number(speed, 6), " revolutions a minute would be ", number(speed * M_PI / 30, 4),
            " rad/s. Beyond the rotor's critical speed the centrifugal stress is missing unless "
            "Prestress/Stress stiffness = true."));
    }

    /// Adds doubts about lengths of the scenes that parameters give.
    void add_doubts_about_size(const Parameters::All &prm, std::vector<std::string> &all)
    {
      const auto add_one = [&](const char *key, const double length, const Range &usual)
      {
        if (!usual.holds(length))
          all.push_back(text_of("Warning, size: ", key, " = ", number(length), " m. Usual are ",
                                usual.low, " to ", usual.high, " m; 1 mm is 1e-3 m."));
      };
      if (prm.scene == Scene::brake)
      {
        add_one("Rotor/Outer radius", prm.rotor.outer_radius, {0.01, 2.5});
        add_one("Rotor/Thickness", prm.rotor.thickness, {5e-4, 0.3});
        if (prm.n_pads() > 0)
          add_one("Pads/Thickness", prm.pads.thickness, {5e-4, 0.3});
      }
      else if (prm.scene == Scene::strip)
        add_one("Strip/Length", prm.strip.length, {5e-3, 5});
    }

    /// Adds doubts about the cells of the scene brake, which the parameters give.
    void add_doubts_about_cells(const Parameters::All &prm, std::vector<std::string> &all)
    {
      if (prm.scene != Scene::brake)
        return;
      const Parameters::Discretization &d = prm.discretization;
      const auto longest = [](const double inner, const double outer, const double angle,
                              const std::array<unsigned int, 3> &cells)
      { return std::max((outer - inner) / cells[0], angle * (inner + outer) / 2 / cells[1]); };
      for (const Parameters::BodyMaterial &body : prm.materials())
        if (body.of_rotor || prm.n_pads() > 0)
          add(all, doubt_about_window(
                       prm, body,
                       body.of_rotor ? longest(prm.rotor.inner_radius, prm.rotor.outer_radius,
                                               2 * M_PI, d.rotor_cells)
                                     : longest(prm.pads.inner_radius, prm.pads.outer_radius,
                                               prm.pads.sector_angle * M_PI / 180, d.pad_cells)));
    }
  } // namespace

  std::string window_of(const Parameters::Eigenproblem &prm)
  {
    const std::string maximum = number(prm.maximum_frequency) + " Hz";
    return prm.minimum_frequency > 0 ? "from " + number(prm.minimum_frequency) + " to " + maximum
                                     : "up to " + maximum;
  }

  std::string no_modes(const Parameters::Eigenproblem &prm, const std::string &where)
  {
    return "Warning, no modes: there is none " + window_of(prm) + (where.empty() ? "" : " ") +
           where +
           ". That says nothing about squeal: is the window (Hz) that of the brake, and are the "
           "units of moduli (Pa), densities (kg/m^3) and lengths (m) right?";
  }

  // Shear waves of the frequency f are sqrt(G/rho) / f long.
  std::string doubt_about_window(const Parameters::All &prm, const Parameters::BodyMaterial &body,
                                 const double cell_size)
  {
    constexpr double fewest = 4; // nodes in a wavelength
    if (!prm.eigenproblem.is_solved() || prm.refinement.strategy == Strategy::adaptive)
      return "";
    const double size = cell_size * std::pow(0.5, prm.refinement.n_cycles() - 1.),
                 wave = std::sqrt(body.material.shear_modulus() / body.material.density) /
                        prm.eigenproblem.maximum_frequency,
                 nodes = wave * prm.discretization.degree / size;
    if (nodes >= fewest)
      return "";
    return text_of("Warning, coarse mesh: shear waves in ", body.section,
                   " of Eigenproblem/Maximum frequency = ",
                   number(prm.eigenproblem.maximum_frequency), " Hz are ", number(1e3 * wave, 3),
                   " mm long, cells ", number(1e3 * size, 3), " mm of degree ",
                   prm.discretization.degree, ": ", number(nodes, 2), " nodes in a wavelength, ",
                   fewest, " are needed. Take a finer mesh, a higher degree or a lower window.");
  }

  std::vector<std::string> doubts(const Parameters::All &prm)
  {
    std::vector<std::string> all;
    if (prm.scene == Scene::matrices)
      return all;
    for (const Parameters::BodyMaterial &body : prm.materials())
      if (prm.is_used(body))
        add(all, doubt_about_material(body, body.section == "Rotor" && prm.scene != Scene::strip));
    add_doubts_about_load(prm, all);
    add_doubts_about_contact(prm, all);
    add_doubts_about_damping(prm, all);
    add_doubts_about_size(prm, all);
    add_doubts_about_motion(prm, all);
    if (prm.eigenproblem.is_solved() && prm.scene != Scene::strip &&
        prm.eigenproblem.maximum_frequency < lowest_squeal)
      all.push_back(text_of("Warning, window: Eigenproblem/Maximum frequency = ",
                            number(prm.eigenproblem.maximum_frequency), " Hz. Brakes squeal above ",
                            lowest_squeal, " Hz; 4 kHz are 4000."));
    add_doubts_about_cells(prm, all);
    return all;
  }
} // namespace squeal
