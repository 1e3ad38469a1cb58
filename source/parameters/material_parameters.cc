#include <squeal/parameters/declare.h>
#include <squeal/parameters/entries.h>
#include <squeal/parameters/parameters.h>

#include <algorithm>
#include <array>
#include <utility>

namespace squeal
{
  namespace Parameters
  {
    namespace
    {
      using dealii::Utilities::split_string_list;
      /// The numbers of "a : b : ...", as often as the pattern asks for.
      std::vector<double> numbers_of(const std::string &text)
      {
        std::vector<double> result;
        for (const std::string &word : split_string_list(text, ':'))
          result.push_back(to_number(word).value());
        return result;
      }
    } // namespace

    void declare(ParameterHandler &prm, StiffnessFactor &factor)
    {
      prm.add_parameter("Loss factor", factor.loss_factor,
                        "eta of a stiffness (1 + i eta) K, -: hysteresis, whatever the frequency. "
                        "Used in the stage full, as the two keys below; all of them add up.",
                        Patterns::Double());
      // No list of lists: ParameterHandler makes patterns of their descriptions, and that of an
      // inner list ends the outer one's.
      const Patterns::Double number;
      prm.declare_entry(
          "Prony series", "", Patterns::Map(number, number, 0, 20),
          "Pairs g : tau, g : tau of the factor 1 + sum g l tau / (1 + l tau), by which the "
          "stiffness of motions exp(l t) exceeds the relaxed one, that of the moduli given; g is "
          "a part of it, -, tau a time, s.");
      prm.add_action("Prony series",
                     [&factor](const std::string &text)
                     {
                       factor.prony.clear();
                       for (const std::string &pair : split_string_list(text, ','))
                       {
                         const std::vector<double> numbers = numbers_of(pair);
                         factor.prony.push_back({numbers[0], numbers[1]});
                       }
                     });
      prm.declare_entry("Fractional Zener", "", Patterns::List(number, 0, 3, ":"),
                        "c : tau : a of the factor (1 + c z) / (1 + z), z = (l tau)^a, for motions "
                        "exp(l t): c is the glassy stiffness relative to the relaxed one, that of "
                        "the moduli given, -, tau a time, s, and 0 < a <= 1. Empty: none.");
      prm.add_action("Fractional Zener",
                     [&factor](const std::string &text)
                     {
                       std::vector<double> numbers = numbers_of(text);
                       factor.zener                = {};
                       if (numbers.empty())
                         return;
                       numbers.resize(3); // a missing one is zero, which check() refuses
                       factor.zener = {numbers[0], numbers[1], numbers[2]};
                     });
    }

    void check(const std::string &section, const StiffnessFactor &factor)
    {
      if (factor.loss_factor < 0)
        fail(section + "/Loss factor", factor.loss_factor,
             "it would feed energy into every motion; allowed are 0 and positive ones, -.");
      // Glassy and relaxed stiffness are positive, and every element takes energy.
      for (const StiffnessFactor::Relaxation &element : factor.prony)
      {
        if (element.strength <= 0)
          fail(section + "/Prony series", element.strength,
               "a part g of the stiffness that relaxes must be positive, -: the moduli are the "
               "relaxed ones, the lowest.");
        if (element.time <= 0)
          fail(section + "/Prony series", element.time, "a time tau must be positive, s.");
      }
      const StiffnessFactor::FractionalZener &zener = factor.zener;
      if (zener.ratio == 1 && zener.time == 0) // none
        return;
      if (zener.ratio < 1)
        fail(section + "/Fractional Zener", zener.ratio,
             "c must be at least 1, -: the moduli are the relaxed ones, the lowest.");
      if (zener.time <= 0)
        fail(section + "/Fractional Zener", zener.time, "tau must be positive, s.");
      if (zener.order <= 0 || zener.order > 1)
        fail(section + "/Fractional Zener", zener.order, "the order a must be in 0 < a <= 1, -.");
    }

    void MaterialSection::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Material");
      prm.declare_entry("Law", "isotropic", Patterns::Selection(all_names<ElasticLaw>("|")),
                        "isotropic: Young modulus and Poisson ratio. transversely_isotropic: these "
                        "in the plane across the axis that Axis names, and Axial Young modulus, "
                        "Axial Poisson ratio, Axial shear modulus.");
      prm.add_action("Law",
                     [this](const std::string &law) {
                       transversely_isotropic =
                           value_named<ElasticLaw>(law) == ElasticLaw::transversely_isotropic;
                     });
      prm.declare_entry(
          "Axis", "z", Patterns::Selection("x|y|z"),
          "The axis of the law transversely_isotropic and of a Viscosity tensor, "
          "after Mesh/Axis; in the strip z stands for y, too. A disc has its own, z.");
      prm.add_action("Axis", [this](const std::string &name) { this->axis = name[0] - 'x'; });
      prm.add_parameter("Young modulus", young_modulus,
                        "Young's modulus E, Pa. transversely_isotropic: E_t, in the plane.",
                        positive());
      prm.add_parameter("Poisson ratio", poisson_ratio,
                        "Poisson's ratio nu, -. Between -1 and 0.5, both excluded. "
                        "transversely_isotropic: nu_t, in the plane.",
                        Patterns::Double());
      prm.add_parameter("Axial Young modulus", axial_young_modulus,
                        "Young's modulus E_n along the axis, Pa. Used by the law "
                        "transversely_isotropic.",
                        not_negative());
      prm.add_parameter("Axial Poisson ratio", axial_poisson_ratio,
                        "nu_tn, -: contraction along the axis by stretch in the plane under stress "
                        "in the plane; nu_nt = nu_tn E_n / E_t. Used by the law "
                        "transversely_isotropic.",
                        Patterns::Double());
      prm.add_parameter("Axial shear modulus", axial_shear_modulus,
                        "Shear modulus G_tn between plane and axis, Pa. Used by the law "
                        "transversely_isotropic.",
                        not_negative());
      prm.add_parameter("Density", density, "Density rho, kg/m^3.", positive());
      prm.add_parameter(
          "Mass proportional damping", mass_damping,
          "Rayleigh damping alpha in D = alpha M + beta K, 1/s. Used in the stage full.",
          not_negative());
      prm.add_parameter("Stiffness proportional damping", stiffness_damping,
                        "Rayleigh damping beta in D = alpha M + beta K, s. Used in the stage full.",
                        not_negative());
      prm.add_parameter("Bulk viscosity", viscosity.bulk,
                        "kappa of a stress kappa tr(e') I + 2 eta (e' - tr(e')/3 I) by the rate of "
                        "strain e', Pa s. Used in the stage full, as the two keys below; all of "
                        "them add up, also with Rayleigh damping.",
                        not_negative());
      prm.add_parameter("Shear viscosity", viscosity.shear, "eta of that stress, Pa s.",
                        not_negative());
      prm.declare_entry("Viscosity tensor", "", Patterns::List(Patterns::Double(), 0, 5, ":"),
                        "C11 : C12 : C13 : C33 : C44, Pa s, of a viscosity that is transversely "
                        "isotropic about Axis: the stress, in Voigt's "
                        "notation with 3 for the axis, by the rate of strain. Empty: none.");
      prm.add_action("Viscosity tensor",
                     [this](const std::string &text)
                     {
                       const std::vector<double> numbers = numbers_of(text);
                       if (!numbers.empty() && numbers.size() != viscosity.tensor.size())
                         throw InputError("Viscosity tensor = " + text +
                                          ": it needs five numbers, C11 : C12 : C13 : C33 : C44.");
                       viscosity.tensor = {};
                       std::copy(numbers.begin(), numbers.end(), viscosity.tensor.begin());
                     });
      Parameters::declare(prm, stiffness_factor);
      prm.add_parameter(
          "Modulus table", modulus_table,
          "A file of comma separated values with the columns frequency_hz, storage_modulus_pa, "
          "loss_factor and, if it depends on it, temperature_c, in place of a Prony series. Young "
          "modulus is the relaxed modulus, at most the smallest of the table. Between its "
          "frequencies and beside the axis a series that is fitted to it is used; the log tells "
          "its error. It must reach from a tenth of Eigenproblem/Maximum frequency to all of it. "
          "Used in the stage full.",
          Patterns::FileName());
    }

    void MaterialSection::check(const std::string &section) const
    {
      Parameters::check(section + "/Material", stiffness_factor);
      if (!viscosity.is_passive())
        fail(section + "/Material/Viscosity tensor", text_of(viscosity.tensor[0], " : ..."),
             "some rate of strain would feed energy. Needed are C44 >= 0, C11 >= |C12|, C33 >= 0 "
             "and (C11 + C12) C33 >= 2 C13^2.");
      if (is_positive_definite())
        return;
      const std::string start = section + "/Material/";
      for (const auto &[key, value] : {std::make_pair("Axial Young modulus", axial_young_modulus),
                                       std::make_pair("Axial shear modulus", axial_shear_modulus)})
        if (transversely_isotropic && value == 0)
          fail(start + key, 0, "the law transversely_isotropic needs a positive one, Pa.");
      if (!transversely_isotropic)
        fail(start + "Poisson ratio", poisson_ratio,
             "it must lie between -1 and 0.5, both excluded. At 0.5 the material is "
             "incompressible and its stiffness infinite; 0.499 is accepted.");
      fail(start + "Law", name_of(ElasticLaw::transversely_isotropic),
           text_of("some strain would have no or negative energy. Needed are Poisson ratio > -1, "
                   "here ",
                   poisson_ratio, ", and 1 - nu_t - 2 nu_tn^2 E_n / E_t > 0, here ", coupling(),
                   "."));
    }
  } // namespace Parameters
} // namespace squeal
