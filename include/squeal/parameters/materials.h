#pragma once

#include <squeal/parameters/stiffness_factor.h>
#include <squeal/parameters/viscosity.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace squeal
{
  /// Linear elastic material with the damping D = alpha M + beta K, and a stiffness that may depend
  /// on how fast it is strained: f(l) K. SI units.
  ///
  /// Isotropic, or transversely isotropic about a coordinate axis n, the last one (the normal of
  /// the pads) unless another is chosen, with t any direction of the plane across it:
  ///     e_tt = (s_tt - nu_t s_t't') / E_t - nu_tn / E_t s_nn,    g_tt' = s_tt' / G_t,
  ///     e_nn = -nu_tn / E_t (s_tt + s_t't') + s_nn / E_n,        g_tn  = s_tn / G_tn,
  /// G_t = E_t / (2 (1 + nu_t)).
  struct Material
  {
    double young_modulus     = 0; ///< E, Pa; E_t
    double poisson_ratio     = 0; ///< nu; nu_t
    double density           = 0; ///< rho, kg/m^3
    double mass_damping      = 0; ///< alpha, 1/s
    double stiffness_damping = 0; ///< beta, s

    bool transversely_isotropic = false;
    double axial_young_modulus  = 0; ///< E_n, Pa
    double axial_poisson_ratio  = 0; ///< nu_tn
    double axial_shear_modulus  = 0; ///< G_tn, Pa
    unsigned int axis           = 2; ///< of n; in two dimensions 2 is the second one, too

    StiffnessFactor stiffness_factor = {}; ///< f; Young's moduli are relaxed ones
    Viscosity viscosity              = {};

    /// The factors of D = alpha M + beta K.
    struct Damping
    {
      double alpha = 0; ///< 1/s
      double beta  = 0; ///< s
    };
    Damping damping() const
    {
      return {mass_damping, stiffness_damping};
    }

    /// A constant that eigenvalues are differentiated by: its key in the section Material.
    struct Constant
    {
      std::string key;
      double Material::*value;
    };
    static std::vector<Constant> damping_constants()
    {
      return {{"Mass proportional damping", &Material::mass_damping},
              {"Stiffness proportional damping", &Material::stiffness_damping}};
    }
    /// The elastic constants of the law transversely_isotropic.
    static std::vector<Constant> elastic_constants()
    {
      return {{"Young modulus", &Material::young_modulus},
              {"Poisson ratio", &Material::poisson_ratio},
              {"Axial Young modulus", &Material::axial_young_modulus},
              {"Axial Poisson ratio", &Material::axial_poisson_ratio},
              {"Axial shear modulus", &Material::axial_shear_modulus}};
    }

    /// Whether both have the same elastic_components().
    bool is_of_kind(const Material &other) const
    {
      return transversely_isotropic == other.transversely_isotropic && axis == other.axis;
    }
    /// Whether the stiffness is that of @p other times the quotient of the Young's moduli.
    bool is_proportional(const Material &other) const
    {
      const double factor = young_modulus / other.young_modulus;
      return is_of_kind(other) && poisson_ratio == other.poisson_ratio &&
             (!transversely_isotropic ||
              (axial_poisson_ratio == other.axial_poisson_ratio &&
               axial_young_modulus == factor * other.axial_young_modulus &&
               axial_shear_modulus == factor * other.axial_shear_modulus));
    }
    /// Whether every strain has a positive energy.
    bool is_positive_definite() const
    {
      if (!transversely_isotropic)
        return young_modulus > 0 && poisson_ratio > -1 && poisson_ratio < 0.5;
      return young_modulus > 0 && axial_young_modulus > 0 && axial_shear_modulus > 0 &&
             poisson_ratio > -1 && coupling() > 0;
    }
    /// 1 - nu_t - 2 nu_tn^2 E_n / E_t, positive for every material.
    double coupling() const
    {
      return 1 - poisson_ratio -
             2 * axial_poisson_ratio * axial_poisson_ratio * axial_young_modulus / young_modulus;
    }

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

  /// The moduli of C_ijkl = l_ik d_ij d_kl + m_ij (d_ik d_jl + d_il d_jk), both symmetric.
  /// Isotropic: l = lambda, m = mu. Transversely isotropic, with D = 1 - nu_t - 2 nu_tn^2 E_n /
  /// E_t:
  ///     l_tt = l_tt' = E_t (nu_t + nu_tn^2 E_n / E_t) / ((1 + nu_t) D),   m_tt = m_tt' = G_t,
  ///     l_tn = nu_tn E_n / D,   l_nn = E_n (1 - nu_t) / D - 2 G_tn,       m_tn = m_nn  = G_tn.
  /// Of a viscosity: l_ik = kappa - 2/3 eta, m_ik = eta, and with the entries C of the tensor
  ///     l_tt = l_tt' = C12,  m_tt = m_tt' = (C11 - C12)/2,  l_tn = C13,  l_nn = C33 - 2 C44,
  ///     m_tn = m_nn = C44.
  /// In two dimensions this is plane strain.
  template <int dim>
  struct ElasticModuli
  {
    std::array<std::array<double, dim>, dim> l, m;

    explicit ElasticModuli(const Material &material)
    {
      double l_tt, l_tn, l_nn, m_n;
      const double m_t = material.shear_modulus();
      if (material.transversely_isotropic)
      {
        const double nu_t = material.poisson_ratio, nu_tn = material.axial_poisson_ratio,
                     E_t = material.young_modulus, E_n = material.axial_young_modulus,
                     D = material.coupling();
        m_n            = material.axial_shear_modulus;
        l_tt           = (E_t * nu_t + nu_tn * nu_tn * E_n) / ((1 + nu_t) * D);
        l_tn           = nu_tn * E_n / D;
        l_nn           = E_n * (1 - nu_t) / D - 2 * m_n;
      }
      else
      {
        l_tt = l_tn = l_nn = material.lame_lambda();
        m_n                = m_t;
      }
      fill(material.axis, l_tt, l_tn, l_nn, m_t, m_n);
    }

    /// @p axis as of a material.
    ElasticModuli(const Viscosity &viscosity, const unsigned int axis)
    {
      const auto &[c11, c12, c13, c33, c44] = viscosity.tensor;
      const double l = viscosity.bulk - 2 * viscosity.shear / 3, m = viscosity.shear;
      fill(axis, l + c12, l + c13, l + c33 - 2 * c44, m + (c11 - c12) / 2, m + c44);
    }

    /// By the numbers of the formulas above.
    ElasticModuli(const unsigned int axis, const double l_tt, const double l_tn, const double l_nn,
                  const double m_t, const double m_n)
    {
      fill(axis, l_tt, l_tn, l_nn, m_t, m_n);
    }

  private:
    void fill(const unsigned int axis, const double l_tt, const double l_tn, const double l_nn,
              const double m_t, const double m_n)
    {
      const int n = std::min<int>(axis, dim - 1);
      for (int i = 0; i < dim; ++i)
        for (int k = 0; k < dim; ++k)
        {
          const int n_axial = (i == n) + (k == n);
          l[i][k]           = n_axial == 2 ? l_nn : n_axial == 1 ? l_tn : l_tt;
          m[i][k]           = n_axial > 0 ? m_n : m_t;
        }
    }
  };

  /// A law that materials of one kind have in common, and how much of it one of them has.
  template <int dim>
  struct ElasticComponent
  {
    ElasticModuli<dim> law;
    double coefficient; ///< Pa
  };

  /// The stiffness as a sum of laws under which no strain has a negative energy, whatever the
  /// coefficients: a larger coefficient makes a body stiffer. The energies of the laws are,
  /// isotropic,
  ///     kappa (tr e)^2 + 2 mu |dev e|^2,
  /// and transversely isotropic, with the entries C of the tensor and s = e_tt + e_t't',
  ///     (C11 - C12)/2 [(e_tt - e_t't')^2 + g_tt'^2] + C44 (g_tn^2 + g_t'n^2)
  ///     + [(C11 + C12)/2 - C13] s^2 + (C33 - C13) e_nn^2 + C13 (s + e_nn)^2.
  template <int dim>
  std::vector<ElasticComponent<dim>> elastic_components(const Material &material)
  {
    const unsigned int axis = material.axis;
    const auto law          = [axis](const double l_tt, const double l_tn, const double l_nn,
                            const double m_t, const double m_n)
    { return ElasticModuli<dim>(axis, l_tt, l_tn, l_nn, m_t, m_n); };
    if (!material.transversely_isotropic)
    {
      const double mu = material.shear_modulus();
      return {{law(1, 1, 1, 0, 0), material.lame_lambda() + 2 * mu / 3},
              {law(-2. / 3, -2. / 3, -2. / 3, 1, 1), mu}};
    }
    const ElasticModuli<3> c(material);
    const unsigned int n = axis, t = (axis + 1) % 3;
    return {{law(-1, 0, 0, 1, 0), c.m[t][t]},
            {law(0, 0, -2, 0, 1), c.m[n][n]},
            {law(1, 0, 0, 0, 0), c.l[t][t] + c.m[t][t] - c.l[t][n]},
            {law(0, 0, 1, 0, 0), c.l[n][n] + 2 * c.m[n][n] - c.l[t][n]},
            {law(1, 1, 1, 0, 0), c.l[t][n]}};
  }

  /// C_ijkl as table[i][k][j][l]: the block (i,k) maps int d_j N_a d_l N_b to the stiffness between
  /// component i of node a and component k of node b.
  template <int dim>
  std::array<double, dim * dim * dim * dim> elasticity_tensor(const ElasticModuli<dim> &moduli)
  {
    std::array<double, dim * dim * dim * dim> table{};
    for (int i = 0, n = 0; i < dim; ++i)
      for (int k = 0; k < dim; ++k)
        for (int j = 0; j < dim; ++j)
          for (int l = 0; l < dim; ++l, ++n)
            table[n] = moduli.l[i][k] * (i == j) * (k == l) +
                       moduli.m[i][j] * ((i == k) * (j == l) + (i == l) * (j == k));
    return table;
  }
  template <int dim>
  std::array<double, dim * dim * dim * dim> elasticity_tensor(const Material &material)
  {
    return elasticity_tensor(ElasticModuli<dim>(material));
  }
} // namespace squeal
