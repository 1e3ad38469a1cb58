#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/parameters/materials.h>
namespace squeal::tests::materials_tests
{
  namespace
  {
    Material transversely_isotropic()
    {
      Material material{8e9, 0.2, 2600, 0, 0};
      material.transversely_isotropic = true;
      material.axial_young_modulus    = 1e9;
      material.axial_poisson_ratio    = 0.35;
      material.axial_shear_modulus    = 7e8;
      return material;
    }

    /// C_ijkl out of the table [i][k][j][l].
    template <int dim>
    double entry(const Material &material, const int i, const int j, const int k, const int l)
    {
      return elasticity_tensor<dim>(material)[((i * dim + k) * dim + j) * dim + l];
    }
  } // namespace

  TEST_CASE("materials: a transversely isotropic stiffness is the inverse of the compliance")
  {
    // Strains by the definition of the five constants, for each of six states of one stress; C
    // times strain is the stress again.
    const Material m = transversely_isotropic();
    const double E_t = m.young_modulus, E_n = m.axial_young_modulus, nu_t = m.poisson_ratio,
                 nu_tn = m.axial_poisson_ratio, G_t = E_t / (2 * (1 + nu_t));
    const int z = 2;
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b)
      {
        double strain[3][3] = {};
        if (a != b)
          strain[a][b] = strain[b][a] = 1 / (2 * (b == z ? m.axial_shear_modulus : G_t));
        else if (a == z)
        {
          strain[z][z] = 1 / E_n;
          strain[0][0] = strain[1][1] = -nu_tn / E_t;
        }
        else
        {
          strain[a][a]         = 1 / E_t;
          strain[1 - a][1 - a] = -nu_t / E_t;
          strain[z][z]         = -nu_tn / E_t;
        }
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j)
          {
            double stress = 0;
            for (int k = 0; k < 3; ++k)
              for (int l = 0; l < 3; ++l)
                stress += entry<3>(m, i, j, k, l) * strain[k][l];
            const bool is_applied = (i == a && j == b) || (i == b && j == a);
            CHECK(std::abs(stress - is_applied) <= 1e-14);
          }
      }
  }

  TEST_CASE("materials: symmetries, plane strain, and the isotropic case")
  {
    const Material m = transversely_isotropic();
    // In two dimensions the axis is y.
    const int of_plane[2] = {0, 2};
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j)
        for (int k = 0; k < 2; ++k)
          for (int l = 0; l < 2; ++l)
          {
            CHECK(entry<2>(m, i, j, k, l) ==
                  entry<3>(m, of_plane[i], of_plane[j], of_plane[k], of_plane[l]));
            CHECK(entry<2>(m, i, j, k, l) == entry<2>(m, k, l, i, j));
            CHECK(entry<2>(m, i, j, k, l) == entry<2>(m, j, i, k, l));
          }

    // E_n = E, nu_tn = nu, G_tn = G is isotropic.
    Material isotropic{1e10, 0.3, 2500, 0, 0}, same = isotropic;
    same.transversely_isotropic = true;
    same.axial_young_modulus    = 1e10;
    same.axial_poisson_ratio    = 0.3;
    same.axial_shear_modulus    = isotropic.shear_modulus();
    const auto C = elasticity_tensor<3>(isotropic), D = elasticity_tensor<3>(same);
    for (unsigned int n = 0; n < C.size(); ++n)
      CHECK(std::abs(C[n] - D[n]) <= 1e-15 * 1e10 * 4);
  }

  TEST_CASE("materials: positive definite, and proportional")
  {
    Material m = transversely_isotropic();
    CHECK(m.is_positive_definite());
    // 1 - 0.2 - 2 nu_tn^2 / 8 = 0 at nu_tn = sqrt(3.2)
    m.axial_poisson_ratio = std::sqrt(3.2) - 1e-9;
    CHECK(m.is_positive_definite());
    m.axial_poisson_ratio = std::sqrt(3.2) + 1e-9;
    CHECK(!m.is_positive_definite());
    m                     = transversely_isotropic();
    m.axial_shear_modulus = 0;
    CHECK(!m.is_positive_definite());
    CHECK(Material{1, 0.499, 1, 0, 0}.is_positive_definite());
    CHECK(!Material{1, 0.5, 1, 0, 0}.is_positive_definite());

    // Twice all moduli, another density
    const Material one = transversely_isotropic();
    Material two       = one;
    two.young_modulus *= 2;
    CHECK(!two.is_proportional(one));
    two.axial_young_modulus *= 2;
    two.axial_shear_modulus *= 2;
    two.density = 1;
    CHECK(two.is_proportional(one));
    two.axial_poisson_ratio = 0.3;
    CHECK(!two.is_proportional(one));
    CHECK(Material{2, 0.3, 1, 0, 0}.is_proportional(Material{1, 0.3, 5, 0, 0}));
    CHECK(!Material{2, 0.3, 1, 0, 0}.is_proportional(Material{2, 0.2, 1, 0, 0}));
  }

  TEST_CASE("materials: viscous moduli by bulk and shear, and in Voigt's notation")
  {
    const auto at = [](const std::array<double, 81> &table, const int i, const int j, const int k,
                       const int l) { return table[((i * 3 + k) * 3 + j) * 3 + l]; };
    Viscosity viscosity{5, 3};
    const auto isotropic = elasticity_tensor(ElasticModuli<3>(viscosity, 2));
    CHECK(std::abs(at(isotropic, 0, 0, 0, 0) - (5 + 4. / 3 * 3)) < 1e-14);
    CHECK(std::abs(at(isotropic, 2, 2, 0, 0) - (5 - 2. / 3 * 3)) < 1e-14);
    CHECK(std::abs(at(isotropic, 0, 2, 2, 0) - 3) < 1e-14);
    viscosity        = {0, 0, {{11, 4, 2, 9, 6}}};
    const auto axial = elasticity_tensor(ElasticModuli<3>(viscosity, 2));
    CHECK(std::abs(at(axial, 0, 0, 0, 0) - 11) < 1e-14);
    CHECK(std::abs(at(axial, 0, 0, 1, 1) - 4) < 1e-14);
    CHECK(std::abs(at(axial, 1, 1, 2, 2) - 2) < 1e-14);
    CHECK(std::abs(at(axial, 2, 2, 2, 2) - 9) < 1e-14);
    CHECK(std::abs(at(axial, 1, 2, 1, 2) - 6) < 1e-14);
    CHECK(std::abs(at(axial, 0, 1, 0, 1) - 3.5) < 1e-14);
    CHECK(viscosity.is_passive());
    CHECK(viscosity.constants().size() == 5);
    for (const Viscosity &active :
         {Viscosity{0, 0, {{1, 2, 0, 1, 1}}}, Viscosity{-1, 0}, Viscosity{0, 0, {{1, 0, 1, 1, 1}}}})
      CHECK(!active.is_passive());
    // C is the sum over its constants.
    std::array<double, 81> sum{};
    for (const Viscosity::Constant &constant : viscosity.constants())
    {
      const auto unit = elasticity_tensor(ElasticModuli<3>(constant.unit, 2));
      for (unsigned int i = 0; i < sum.size(); ++i)
        sum[i] += constant.value * unit[i];
    }
    for (unsigned int i = 0; i < sum.size(); ++i)
      CHECK(std::abs(sum[i] - axial[i]) < 1e-13);
  }

  TEST_CASE("materials: the stiffness is a sum of laws of which none has a negative energy")
  {
    Material isotropic = transversely_isotropic(), about_x = isotropic;
    isotropic.transversely_isotropic = false;
    about_x.axis                     = 0;
    for (const Material &material : {isotropic, transversely_isotropic(), about_x})
    {
      const auto components = elastic_components<3>(material);
      CHECK(components.size() == (material.transversely_isotropic ? 5 : 2));
      const auto whole = elasticity_tensor<3>(material);
      std::array<double, 81> sum{};
      for (const ElasticComponent<3> &component : components)
      {
        const auto part = elasticity_tensor(component.law);
        for (unsigned int i = 0; i < sum.size(); ++i)
          sum[i] += component.coefficient * part[i];
        // e C e of strains all around
        for (unsigned int sample = 0; sample < 200; ++sample)
        {
          std::array<std::array<double, 3>, 3> e{};
          for (int i = 0; i < 3; ++i)
            for (int j = 0; j <= i; ++j)
              e[i][j] = e[j][i] =
                  std::sin(1. + 7.3 * sample * (1 + i) + 3.1 * j * (1 + sample % 5));
          double energy = 0;
          for (int i = 0, n = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k)
              for (int j = 0; j < 3; ++j)
                for (int l = 0; l < 3; ++l, ++n)
                  energy += e[i][j] * part[n] * e[k][l];
          CHECK(energy >= -1e-14);
        }
      }
      for (unsigned int i = 0; i < sum.size(); ++i)
        CHECK(std::abs(sum[i] - whole[i]) <= 1e-14 * material.longitudinal_modulus());
    }
  }

  TEST_CASE("materials: another axis exchanges the directions")
  {
    const Material about_z = transversely_isotropic();
    for (const unsigned int axis : {0u, 1u})
    {
      Material about_other = about_z;
      about_other.axis     = axis;
      CHECK(!about_other.is_proportional(about_z));
      const auto exchanged = [&](const int i) {
        return i == 2 ? int(axis) : i == int(axis) ? 2 : i;
      };
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          for (int k = 0; k < 3; ++k)
            for (int l = 0; l < 3; ++l)
              CHECK(entry<3>(about_other, i, j, k, l) ==
                    entry<3>(about_z, exchanged(i), exchanged(j), exchanged(k), exchanged(l)));
    }
    // Plane strain across z: about y the second axis, as by default
    Material about_y = about_z;
    about_y.axis     = 1;
    CHECK(entry<2>(about_y, 1, 1, 1, 1) == entry<2>(about_z, 1, 1, 1, 1));
    about_y.axis = 0;
    CHECK(entry<2>(about_y, 0, 0, 0, 0) == entry<2>(about_z, 1, 1, 1, 1));
  }
} // namespace squeal::tests::materials_tests
