#include <squeal/contact/contact_zone.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/numerics/rtree.h>

#include <limits>
#include <set>
#include <utility>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Calls function(point, interface, place) for each node of this rank's pad faces with a
    /// multiplier, whose equation is the place, or for each of its quadrature points. A node may
    /// come several times.
    template <int dim, typename Function>
    void for_each_point(const Contact<dim> &contact, const Function &function)
    {
      if (!contact.contact_model().mortar)
      {
        contact.for_each_pair(
            [&](const unsigned int i, const ContactKinematics<dim> &k)
            {
              for (unsigned int q = 0; q < k.n_points; ++q)
                function(k.positions[q], i, k.first_point + q);
            });
        return;
      }
      for (unsigned int i = 0; i < contact.paired_interfaces().size(); ++i)
        for (const ContactFace<dim> &face : contact.paired_interfaces()[i].pad_faces)
          for (unsigned int m = 0; m < face.nodes.size(); ++m)
            // Hanging nodes have no multiplier of their own.
            for (const FreeNode<dim> &node : face.nodes[m])
              if (node.multiplier_weight == 1 && node.equations[dim] >= 0)
                function(face.shape.nodes[m], i, node.equations[dim]);
    }

    /// Finds the point of some that is nearest to others.
    class Nearest
    {
    public:
      explicit Nearest(const ContactZone::Points &given)
      {
        std::vector<Point<3>> points;
        for (const std::array<double, 3> &x : given)
          points.emplace_back(x[0], x[1], x[2]);
        tree = pack_rtree(points);
      }
      double distance_to(const Point<3> &x) const
      {
        double distance = std::numeric_limits<double>::infinity();
        for (const Point<3> &nearest : tree | boost::geometry::index::adaptors::queried(
                                                  boost::geometry::index::nearest(x, 1)))
          distance = nearest.distance(x);
        return distance;
      }

    private:
      RTree<Point<3>> tree;
    };

    template <int dim>
    Point<3> in_space(const Point<dim> &x)
    {
      Point<3> result;
      for (unsigned int d = 0; d < dim; ++d)
        result[d] = x[d];
      return result;
    }
  } // namespace

  template <int dim>
  ContactZone zone_of(const Contact<dim> &contact)
  {
    const bool mortar            = contact.contact_model().mortar;
    const ActiveSet &set         = contact.active_set();
    const unsigned int n_numbers = 6; // interface, place, closed, x
    std::vector<double> numbers;
    for_each_point(contact,
                   [&](const Point<dim> &x, const unsigned int i, const unsigned int place)
                   {
                     const bool closed = mortar ? set.by_row[place] : set.by_point[i][place];
                     const Point<3> y  = in_space(x);
                     numbers.insert(numbers.end(),
                                    {double(i), double(place), double(closed), y[0], y[1], y[2]});
                   });
    ContactZone zone;
    zone.interfaces.resize(contact.paired_interfaces().size());
    std::set<double> met; // equations
    gather(numbers, MPI_DOUBLE, contact.spaces().comm);
    for (std::size_t k = 0; k < numbers.size(); k += n_numbers)
    {
      if (mortar && !met.insert(numbers[k + 1]).second)
        continue;
      ContactZone::Interface &interface = zone.interfaces[static_cast<unsigned int>(numbers[k])];
      (numbers[k + 2] > 0 ? interface.closed : interface.open)
          .push_back({{numbers[k + 3], numbers[k + 4], numbers[k + 5]}});
    }
    return zone;
  }

  template <int dim>
  void start_from(const ContactZone &zone, Contact<dim> &contact)
  {
    contact.close();
    if (zone.interfaces.size() != contact.paired_interfaces().size())
      return;
    std::vector<std::array<Nearest, 2>> nearest;
    for (const ContactZone::Interface &interface : zone.interfaces)
      nearest.push_back({{Nearest(interface.closed), Nearest(interface.open)}});
    std::vector<std::pair<unsigned int, unsigned int>> open; // interface, place
    for_each_point(contact,
                   [&](const Point<dim> &x, const unsigned int i, const unsigned int place)
                   {
                     constexpr double rounding = 1e-6;
                     const Point<3> y          = in_space(x);
                     if (nearest[i][1].distance_to(y) <
                         (1 - rounding) * nearest[i][0].distance_to(y))
                       open.emplace_back(i, place);
                   });
    if (!contact.contact_model().mortar)
    {
      for (const auto &[interface, point] : open)
        contact.release_point(interface, point);
      return;
    }
    std::vector<unsigned int> equations;
    for (const auto &[interface, equation] : open)
      equations.push_back(equation);
    gather(equations, MPI_UNSIGNED, contact.spaces().comm);
    for (const unsigned int pressure : equations)
      contact.set_closed(contact.with_tractions(pressure), false);
  }

  template ContactZone zone_of(const Contact<2> &);
  template ContactZone zone_of(const Contact<3> &);
  template void start_from(const ContactZone &, Contact<2> &);
  template void start_from(const ContactZone &, Contact<3> &);
} // namespace squeal
