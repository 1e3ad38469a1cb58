#pragma once

#include <array>
#include <cmath>

namespace squeal
{
  /// Linear elastic, isotropic material with Rayleigh damping D = alpha M + beta K. SI units.
  struct Material
  {
    double young_modulus     = 0; ///< E, Pa
    double poisson_ratio     = 0; ///< nu
    double density           = 0; ///< rho, kg/m^3
    double mass_damping      = 0; ///< alpha, 1/s
    double stiffness_damping = 0; ///< beta, s

    double lame_lambda() const
    {
      return young_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio));
    }
    double shear_modulus() const
    {
      return young_modulus / (2 * (1 + poisson_ratio));
    }
    /// The modulus of uniaxial strain (that of the P wave), lambda + 2 mu.
    double longitudinal_modulus() const
    {
      return lame_lambda() + 2 * shear_modulus();
    }
  };

  /// C_ijkl = lambda d_ij d_kl + mu (d_ik d_jl + d_il d_jk), as table[i][k][j][l]: the block (i,k)
  /// maps int d_j N_a d_l N_b to the stiffness between component i of node a and component k of
  /// node b. In two dimensions this is plane strain.
  template <int dim>
  std::array<double, dim * dim * dim * dim> elasticity_tensor(const Material &material)
  {
    const double lambda = material.lame_lambda();
    const double mu     = material.shear_modulus();

    std::array<double, dim * dim * dim * dim> table{};
    for (int i = 0, n = 0; i < dim; ++i)
      for (int k = 0; k < dim; ++k)
        for (int j = 0; j < dim; ++j)
          for (int l = 0; l < dim; ++l, ++n)
            table[n] =
                lambda * (i == j) * (k == l) + mu * ((i == k) * (j == l) + (i == l) * (j == k));
    return table;
  }
} // namespace squeal
