#include <squeal/contact/contact_fields.h>
#include <squeal/mesh/finite_element_space.h>
#include <squeal/statics/bedding.h>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// What h grows by with the pressure and the distance slid, (dh/ds)/p, 1/Pa at every point:
    /// with dt = ds/(|Omega| r_m), k (|Omega| r)^beta dt = k |Omega|^(beta - 1) r^beta/r_m ds.
    template <int dim>
    ContactPressure wear_rates(const Contact<dim> &contact, const WearLaw &law)
    {
      double sums[2] = {0, 0}; // int r, int 1
      contact.for_each_sliding_pair(
          [&](unsigned int, const ContactKinematics<dim> &k)
          {
            for (unsigned int q = 0; q < k.n_points; ++q)
            {
              sums[0] += k.weights[q] * k.radii[q];
              sums[1] += k.weights[q];
            }
          });
      MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, contact.spaces().comm);
      const double mean_radius = sums[0] / sums[1],
                   speed       = std::abs(contact.contact_model().angular_velocity),
                   factor      = law.coefficient / mean_radius *
                            (law.speed_exponent == 1 ? 1 : std::pow(speed, law.speed_exponent - 1));
      ContactPressure rates = contact.uniform_pressure(0);
      contact.for_each_sliding_pair(
          [&](const unsigned int i, const ContactKinematics<dim> &k)
          {
            for (unsigned int q = 0; q < k.n_points; ++q)
              rates[i][k.first_point + q] = factor * std::pow(k.radii[q], law.speed_exponent);
          });
      return rates;
    }

    template <int dim>
    std::vector<WearOfPad> wear_of_pads(const Contact<dim> &contact, const ContactPressure &depth,
                                        const StaticEquilibrium &equilibrium)
    {
      std::vector<WearOfPad> pads;
      const std::vector<ContactResultants> of_all =
          resultants(contact, equilibrium.pressure, &equilibrium.state);
      for (unsigned int i = 0; i < of_all.size(); ++i)
      {
        WearOfPad pad{of_all[i].name};
        double area = 0;
        contact.for_each_sliding_pair(
            [&](const unsigned int interface, const ContactKinematics<dim> &k)
            {
              for (unsigned int q = 0; q < k.n_points && interface == i; ++q)
              {
                const double h = depth[i][k.first_point + q];
                area += k.weights[q];
                pad.volume += k.weights[q] * h;
                pad.largest_depth = std::max(pad.largest_depth, h);
              }
            });
        const MPI_Comm comm  = contact.spaces().comm;
        pad.volume           = Utilities::MPI::sum(pad.volume, comm);
        pad.largest_depth    = Utilities::MPI::max(pad.largest_depth, comm);
        pad.open_area        = std::max(0., Utilities::MPI::sum(area, comm) - of_all[i].area);
        pad.largest_pressure = of_all[i].max_pressure;
        if (contact.slides(i))
          pads.push_back(std::move(pad));
      }
      return pads;
    }
  } // namespace

  template <int dim>
  std::vector<WearStep> bed_in(Contact<dim> &contact, const WearLaw &law,
                               const std::function<StaticEquilibrium()> &equilibrium)
  {
    // Contact's matrices are kept by this number.
    static std::atomic<unsigned int> number{0};
    constexpr unsigned int n_steps = 12, steps_per_decade = 3;
    const ContactPressure rates = wear_rates(contact, law);
    ContactPressure depth = contact.uniform_pressure(0), pressure = depth;
    std::vector<WearStep> steps;
    double before = 0;
    for (unsigned int step = 1; step <= n_steps; ++step)
    {
      const double distance =
                       law.distance * std::pow(10., (double(step) - n_steps) / steps_per_decade),
                   length = distance - before;
      auto wear           = std::make_shared<WearState>();
      wear->depth         = depth;
      wear->rate          = rates;
      wear->number        = ++number;
      for (std::vector<double> &of_interface : wear->rate)
        for (double &rate : of_interface)
          rate *= length;
      contact.set_wear(wear);
      const StaticEquilibrium found = equilibrium();
      for (unsigned int i = 0; i < depth.size(); ++i)
        for (unsigned int q = 0; q < depth[i].size(); ++q)
          depth[i][q] += wear->rate[i][q] * found.pressure[i][q];
      steps.push_back(
          {distance,
           step == 1 ? 0 : relative_change(pressure, found.pressure, contact.spaces().comm),
           wear_of_pads(contact, depth, found)});
      pressure = found.pressure;
      before   = distance;
    }
    auto wear   = std::make_shared<WearState>();
    wear->depth = std::move(depth);
    contact.set_wear(std::move(wear));
    return steps;
  }

  template <int dim>
  void take_wear(const Contact<dim> &other, Contact<dim> &contact)
  {
    if (!other.worn())
      return;
    const auto at_nodes = project_to_faces(other, other.worn()->depth);
    auto wear           = std::make_shared<WearState>();
    wear->depth         = contact.uniform_pressure(0);
    std::vector<double> psi;
    for (unsigned int i = 0; i < wear->depth.size(); ++i)
    {
      unsigned int point = 0;
      for (const FacePair<dim> &pair : contact.paired_interfaces()[i].pairs)
        for (const PairedPoint<dim> &place : pair.points)
        {
          const std::vector<double> &nodes = at_nodes[i][pair.pad_face];
          other.face_element().evaluate(place.xi_pad, psi);
          for (unsigned int a = 0; a < nodes.size(); ++a)
            wear->depth[i][point] += psi[a] * nodes[a];
          ++point;
        }
    }
    contact.set_wear(std::move(wear));
  }

  template std::vector<WearStep> bed_in(Contact<2> &, const WearLaw &,
                                        const std::function<StaticEquilibrium()> &);
  template std::vector<WearStep> bed_in(Contact<3> &, const WearLaw &,
                                        const std::function<StaticEquilibrium()> &);
  template void take_wear(const Contact<2> &, Contact<2> &);
  template void take_wear(const Contact<3> &, Contact<3> &);
} // namespace squeal
