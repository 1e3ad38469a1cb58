#pragma once

#include <squeal/contact/contact.h>

#include <array>
#include <vector>

namespace squeal
{
  /// Where surfaces touch, as points and thus for any mesh of the same bodies: an active set of one
  /// mesh is a start for that of another.
  struct ContactZone
  {
    using Points = std::vector<std::array<double, 3>>; ///< m; in 2D the last number is zero

    /// Points of one interface: nodes of the pad's face (mortar) or quadrature points (penalty).
    struct Interface
    {
      Points closed, open;
    };
    std::vector<Interface> interfaces; ///< the same on all ranks; none: nothing is known
  };

  /// The zone of the present active set. Collective.
  template <int dim>
  ContactZone zone_of(const Contact<dim> &contact);

  /// Gives each multiplier (mortar) or point (penalty) the status of the nearest point of a zone;
  /// of two as near, as halving a face has many, the closed one. With a zone of other interfaces
  /// everything stays closed. Collective.
  template <int dim>
  void start_from(const ContactZone &zone, Contact<dim> &contact);
} // namespace squeal
