#pragma once

#include <squeal/projection/eigenpairs.h>

#include <string>
#include <vector>

namespace squeal
{
  template <int dim>
  class FiniteElementSpace;

  /// How a mode looks, by its kinetic energy rho |u|^2 without the motion of transport.
  struct ModeShape
  {
    /// Share of the kinetic energy of all meshed bodies that is in the rotor.
    double rotor_share = 0;
    /// Share of the rotor's kinetic energy that is in u_z: at least one half in a bending mode,
    /// less in an in-plane one.
    double axial_share = 0;
    /// The order n of the waves exp(+- i n phi) with most of the energy, bending of that of u_z,
    /// in-plane of that of the other components, and their share of it.
    unsigned int nodal_diameters = 0;
    double order_share           = 0;
    /// Zeros along the radius of these waves in their larger component.
    unsigned int nodal_circles = 0;
    /// (E_+ - E_-) / (E_+ + E_-) of the waves with the rotation and against it: 0 for a standing
    /// wave. Of u exp(l t), Im l > 0, exp(- i n phi) turns with +z.
    double travelling = 0;

    bool is_bending() const
    {
      return axial_share >= 0.5;
    }
    bool is_of_rotor() const
    {
      return rotor_share >= 0.5;
    }
  };

  /// bending, in_plane, or pads where less than half of the energy is the rotor's: the pads and all
  /// that does not turn.
  std::string name_of(const ModeShape &shape);
  /// In words: "bending, 6 nodal diameters, 0 circles".
  std::string described(const ModeShape &shape);

  /// The shapes of all modes of bodies that turn about z, or nothing (two dimensions; no rotor).
  /// @p densities by material, kg/m^3. Fourier coefficients are taken in rings of the rotor between
  /// its inner and outer radius, over its thickness together. Collective.
  template <int dim>
  std::vector<ModeShape> mode_shapes(const FiniteElementSpace<dim> &spaces,
                                     const std::vector<double> &densities, const EigenPairs &modes);
} // namespace squeal
