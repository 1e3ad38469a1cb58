#include <squeal/base/errors.h>
#include <squeal/parameters/parameters.h>

#include <limits>
#include <sstream>

namespace squeal
{
  namespace Parameters
  {
    namespace Patterns = dealii::Patterns;

    void MaterialSection::declare(dealii::ParameterHandler &prm)
    {
      const Patterns::Double positive(std::numeric_limits<double>::min(),
                                      Patterns::Double::max_double_value),
          not_negative(0, Patterns::Double::max_double_value);
      prm.enter_subsection("Material");
      prm.declare_entry("Law", "isotropic", Patterns::Selection("isotropic|transversely_isotropic"),
                        "isotropic: Young modulus and Poisson ratio. transversely_isotropic: these "
                        "in the plane across the z axis (strip: the y axis), and Axial Young "
                        "modulus, Axial Poisson ratio, Axial shear modulus.");
      prm.add_action("Law", [this](const std::string &law)
                     { transversely_isotropic = law == "transversely_isotropic"; });
      prm.add_parameter("Young modulus", young_modulus,
                        "Young's modulus E, Pa. transversely_isotropic: E_t, in the plane.",
                        positive);
      prm.add_parameter("Poisson ratio", poisson_ratio,
                        "Poisson's ratio nu, -. Between -1 and 0.5, both excluded. "
                        "transversely_isotropic: nu_t, in the plane.",
                        Patterns::Double());
      prm.add_parameter("Axial Young modulus", axial_young_modulus,
                        "Young's modulus E_n along the axis, Pa. Used by the law "
                        "transversely_isotropic.",
                        not_negative);
      prm.add_parameter("Axial Poisson ratio", axial_poisson_ratio,
                        "nu_tn, -: contraction along the axis by stretch in the plane under stress "
                        "in the plane; nu_nt = nu_tn E_n / E_t. Used by the law "
                        "transversely_isotropic.",
                        Patterns::Double());
      prm.add_parameter("Axial shear modulus", axial_shear_modulus,
                        "Shear modulus G_tn between plane and axis, Pa. Used by the law "
                        "transversely_isotropic.",
                        not_negative);
      prm.add_parameter("Density", density, "Density rho, kg/m^3.", positive);
      prm.add_parameter(
          "Mass proportional damping", mass_damping,
          "Rayleigh damping alpha in D = alpha M + beta K, 1/s. Used in the stage full.",
          not_negative);
      prm.add_parameter("Stiffness proportional damping", stiffness_damping,
                        "Rayleigh damping beta in D = alpha M + beta K, s. Used in the stage full.",
                        not_negative);
      prm.leave_subsection();
    }

    void MaterialSection::check(const std::string &section) const
    {
      if (is_positive_definite())
        return;
      std::ostringstream message;
      message << section << "/Material/";
      if (!transversely_isotropic)
        message << "Poisson ratio = " << poisson_ratio
                << ": it must lie between -1 and 0.5, both excluded. At 0.5 the material is "
                   "incompressible and its stiffness infinite; 0.499 is accepted.";
      else if (axial_young_modulus == 0)
        message << "Axial Young modulus = 0: the law transversely_isotropic needs a positive one, "
                   "Pa.";
      else if (axial_shear_modulus == 0)
        message << "Axial shear modulus = 0: the law transversely_isotropic needs a positive one, "
                   "Pa.";
      else
        message << "Law = transversely_isotropic: some strain would have no or negative energy. "
                   "Needed are Poisson ratio > -1, here "
                << poisson_ratio << ", and 1 - nu_t - 2 nu_tn^2 E_n / E_t > 0, here " << coupling()
                << ".";
      throw InputError(message.str());
    }
  } // namespace Parameters
} // namespace squeal
