#include <squeal/mesh/geometry.h>

#include <algorithm>

namespace squeal
{
  using namespace dealii;

  template <int dim>
  std::vector<Body> Geometry<dim>::bodies_of(const unsigned int material) const
  {
    std::vector<Body> result;
    for (unsigned int id = 0; id < parts.size(); ++id)
      if (parts[id].material == material &&
          (parts[id].body == rotor_body || other_bodies.count(parts[id].body) > 0 ||
           std::any_of(interfaces.begin(), interfaces.end(),
                       [&](const ContactInterface &interface)
                       { return interface.pad == parts[id].body; })))
        result.push_back(Body(id));
    return result;
  }

  template <int dim>
  std::vector<std::pair<std::string, Body>> Geometry<dim>::named_bodies() const
  {
    std::vector<std::pair<std::string, Body>> result;
    if (has_rotor())
      result.emplace_back("rotor", rotor_body);
    for (const ContactInterface &interface : interfaces)
      if (interface.slides())
        result.emplace_back(interface.name, interface.pad);
    for (const auto &[body, name] : other_bodies)
      result.emplace_back(name, body);
    return result;
  }

  template <int dim>
  Tensor<1, dim> Geometry<dim>::transport(const Point<dim> &x) const
  {
    // brake: w = e_z x x = (-y, x, 0); strip: w = e_x
    Tensor<1, dim> w;
    if (dim == 2)
      w[0] = 1;
    else
    {
      w[0] = -x[1];
      w[1] = x[0];
    }
    return w;
  }

  template struct Geometry<2>;
  template struct Geometry<3>;
} // namespace squeal
