#pragma once

#include <array>
#include <string>
#include <vector>

namespace squeal
{
  /// Viscous moduli, Pa s: the stress is C_v times the rate of strain. An isotropic part and one
  /// that is transversely isotropic about the material's axis add up.
  struct Viscosity
  {
    double bulk = 0, shear = 0;
    /// 11, 12, 13, 33 and 44 of the matrix of Voigt, 3 the axis.
    std::array<double, 5> tensor = {{0, 0, 0, 0, 0}};

    bool is_active() const
    {
      return *this != Viscosity();
    }
    bool operator!=(const Viscosity &other) const
    {
      return bulk != other.bulk || shear != other.shear || tensor != other.tensor;
    }
    struct Constant;
    /// The constants that are not zero; C_v is linear in them.
    std::vector<Constant> constants() const;
    /// Whether no rate of strain feeds energy.
    bool is_passive() const;
  };

  /// One of the moduli as the keys name it, and the viscosity that has 1 Pa s of it alone.
  struct Viscosity::Constant
  {
    std::string key;
    double value;
    Viscosity unit;
  };
} // namespace squeal
