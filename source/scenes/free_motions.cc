#include <squeal/base/errors.h>
#include <squeal/scenes/free_motions.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    const std::string worn = "Contact/Steady pressure = worn: ";
  }

  template <int dim>
  void add_motions_of_pad(const Parameters::All &parameters, const Body pad, const double height,
                          Geometry<dim> &geometry)
  {
    if (!parameters.contact.is_fully_worn())
      return;
    if (const BackFace back = parameters.pads.back_face; back != BackFace::guided)
      throw InputError(worn + "with Pads/Back face = " + name_of(back) +
                       (back == BackFace::free
                            ? " nothing holds the pads against friction"
                            : " the pads cannot follow what they lose: they wear until they "
                              "carry nothing") +
                       "; allowed is guided.");
    // u_n, and rotations about axes in the back face: u = o x (x - back)
    RigidMotion<dim> approach;
    approach.translation[dim - 1] = 1;
    geometry.free_motions.push_back({{pad, approach}});
    for (unsigned int axis = dim == 3 ? 0 : 2; axis < (dim == 3 ? 2 : 3); ++axis)
    {
      RigidMotion<dim> tilt;
      Point<dim> back;
      back[dim - 1]       = height;
      tilt.rotation[axis] = 1;
      tilt.translation    = -tilt.at(back);
      geometry.free_motions.push_back({{pad, tilt}});
    }
  }

  void check_free_motions(const Geometry<3> &geometry)
  {
    for (const ContactInterface &pad : geometry.interfaces)
    {
      // Contact faces lie across z.
      double largest = 0, of_pad = 0;
      for (const auto &motion : geometry.free_motions)
        for (const auto &[body, rigid] : motion)
          for (const double part : {rigid.translation[2], rigid.rotation[0], rigid.rotation[1]})
          {
            largest = std::max(largest, std::abs(part));
            if (body == pad.pad)
              of_pad = std::max(of_pad, std::abs(part));
          }
      if (!(of_pad > 1e-8 * largest))
        throw InputError(worn +
                         "supports and joints (Mesh/Clamped, Fixed in z, Joints/Springs and "
                         "others) hold the pad '" +
                         pad.name +
                         "', so that it cannot follow what it loses: it wears until it carries "
                         "nothing. Allowed are pads that are free to move towards the rotor, as "
                         "with Mesh/Guided, or Contact/Steady pressure = computed.");
    }
  }

  template void add_motions_of_pad<2>(const Parameters::All &, Body, double, Geometry<2> &);
  template void add_motions_of_pad<3>(const Parameters::All &, Body, double, Geometry<3> &);
} // namespace squeal
