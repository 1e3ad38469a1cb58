#include <squeal/parameters/declare.h>
#include <squeal/parameters/parameters.h>

#include <utility>

namespace squeal
{
  namespace Parameters
  {

    void MaterialSection::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Material");
      prm.declare_entry("Law", "isotropic", Patterns::Selection(all_names<ElasticLaw>("|")),
                        "isotropic: Young modulus and Poisson ratio. transversely_isotropic: these "
                        "in the plane across the z axis (strip: the y axis), and Axial Young "
                        "modulus, Axial Poisson ratio, Axial shear modulus.");
      prm.add_action("Law",
                     [this](const std::string &law) {
                       transversely_isotropic =
                           value_named<ElasticLaw>(law) == ElasticLaw::transversely_isotropic;
                     });
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
    }

    void MaterialSection::check(const std::string &section) const
    {
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
