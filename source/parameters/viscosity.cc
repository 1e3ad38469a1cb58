#include <squeal/parameters/viscosity.h>

#include <cmath>

namespace squeal
{
  bool Viscosity::is_passive() const
  {
    const auto &[c11, c12, c13, c33, c44] = tensor;
    return bulk >= 0 && shear >= 0 && c44 >= 0 && c11 >= std::abs(c12) && c33 >= 0 &&
           (c11 + c12) * c33 >= 2 * c13 * c13;
  }

  std::vector<Viscosity::Constant> Viscosity::constants() const
  {
    std::vector<Constant> result;
    const auto add = [&](const std::string &key, const double value, const Viscosity &unit)
    {
      if (value != 0)
        result.push_back({key, value, unit});
    };
    add("Bulk viscosity", bulk, {1, 0});
    add("Shear viscosity", shear, {0, 1});
    const std::array<std::string, 5> names = {{"11", "12", "13", "33", "44"}};
    for (unsigned int k = 0; k < names.size(); ++k)
    {
      Viscosity unit;
      unit.tensor[k] = 1;
      add("Viscosity tensor/" + names[k], tensor[k], unit);
    }
    return result;
  }
} // namespace squeal
