#include <squeal/assessment/mode_shapes.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_values.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <string>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    using Complex = std::complex<double>;
    using Vector  = LinearAlgebra::distributed::Vector<double>;

    constexpr unsigned int n_rings = 12, n_orders = 31; ///< orders 0 to 30
    enum Component
    {
      radial,
      tangential,
      axial,
      n_components
    };

    /// Sums over the quadrature points of a ring: of the weights rho dV, and for each component of
    /// weights times u cos(n phi) and u sin(n phi).
    struct Ring
    {
      double weight = 0;
      std::array<std::array<Complex, 2 * n_orders>, n_components> sums{};

      /// Weight times the amplitude of exp(+ i n phi) and of exp(- i n phi).
      std::array<Complex, 2> waves(const unsigned int component, const unsigned int n) const
      {
        const Complex c = sums[component][n], i_s = Complex(0, 1) * sums[component][n_orders + n];
        return {{c - i_s, c + i_s}};
      }
    };

    /// What is summed over the cells for one mode.
    struct Sums
    {
      double energy = 0, energy_of_rotor = 0, axial = 0;
      std::array<Ring, n_rings> rings;
    };

    /// Fills @p field with a component of a column at all locally relevant nodes. In place: copies
    /// of such vectors, as a container makes when it grows, have zeros for the nodes of other
    /// ranks.
    template <int dim>
    void find_nodal_values(const FiniteElementSpace<dim> &spaces, const double *column,
                           const unsigned int component, Vector &field)
    {
      field.reinit(spaces.nodes.locally_owned_dofs(), spaces.relevant_nodes, spaces.comm);
      for (const auto node : spaces.nodes.locally_owned_dofs())
        if (const unsigned int row = spaces.equation(node, component);
            row != FiniteElementSpace<dim>::none)
          field(node) = column[row - spaces.rows.begin];
      spaces.hanging.distribute(field);
      field.update_ghost_values();
    }

    /// Zeros of a function given in rings, complex with one phase; parts below a tenth of the
    /// largest do not count.
    unsigned int n_zeros(const std::vector<Complex> &profile)
    {
      Complex largest = 0;
      for (const Complex value : profile)
        if (std::abs(value) > std::abs(largest))
          largest = value;
      unsigned int n = 0;
      double last    = 0;
      for (const Complex value : profile)
      {
        const double in_phase = (value * std::conj(largest)).real() / std::norm(largest);
        if (std::abs(in_phase) < 0.1)
          continue;
        n += last * in_phase < 0;
        last = in_phase;
      }
      return n;
    }

    /// Adds a quadrature point: Re and Im of the components of several modes, one after the other.
    void add_point(const Point<3> &x, const double weight, const bool is_rotor, const double inner,
                   const double outer, const double *at_point, const unsigned int n_modes,
                   Sums *sums)
    {
      const double radius = std::hypot(x[0], x[1]);
      const double cosine = radius > 0 ? x[0] / radius : 1, sine = radius > 0 ? x[1] / radius : 0;
      const unsigned int place =
          std::clamp(int(n_rings * (radius - inner) / (outer - inner)), 0, int(n_rings) - 1);
      std::array<double, 2 * n_orders> waves; // weight times cos(n phi), then sin(n phi)
      if (is_rotor)
      {
        double cos_n = weight, sin_n = 0;
        for (unsigned int n = 0; n < n_orders; ++n)
        {
          waves[n]            = cos_n;
          waves[n_orders + n] = sin_n;
          const double next   = cos_n * cosine - sin_n * sine;
          sin_n               = sin_n * cosine + cos_n * sine;
          cos_n               = next;
        }
      }
      for (unsigned int j = 0; j < n_modes; ++j, at_point += 6)
      {
        double square = 0;
        for (unsigned int k = 0; k < 6; ++k)
          square += at_point[k] * at_point[k];
        sums[j].energy += weight * square;
        if (!is_rotor)
          continue;
        const Complex u_x(at_point[0], at_point[1]), u_y(at_point[2], at_point[3]),
            u_z(at_point[4], at_point[5]);
        sums[j].energy_of_rotor += weight * square;
        sums[j].axial += weight * std::norm(u_z);
        const std::array<Complex, n_components> turned = {
            {cosine * u_x + sine * u_y, cosine * u_y - sine * u_x, u_z}};
        Ring &ring = sums[j].rings[place];
        ring.weight += weight;
        for (unsigned int c = 0; c < n_components; ++c)
          for (unsigned int n = 0; n < 2 * n_orders; ++n)
            ring.sums[c][n] += waves[n] * turned[c];
      }
    }

    ModeShape shape_of(const Sums &sums)
    {
      ModeShape shape;
      shape.rotor_share = sums.energy > 0 ? sums.energy_of_rotor / sums.energy : 0;
      if (!(sums.energy_of_rotor > 0))
        return shape;
      shape.axial_share = sums.axial / sums.energy_of_rotor;
      const std::vector<unsigned int> components =
          shape.is_bending() ? std::vector<unsigned int>{axial}
                             : std::vector<unsigned int>{radial, tangential};
      // Parseval: (|a_+|^2 + |a_-|^2) / weight in a ring, for n = 0 once
      double sum = 0, largest = -1, with = 0, against = 0;
      for (unsigned int n = 0; n < n_orders; ++n)
      {
        double of_plus = 0, of_minus = 0;
        for (const Ring &ring : sums.rings)
          for (const unsigned int component : components)
            if (ring.weight > 0)
            {
              const auto [plus, minus] = ring.waves(component, n);
              of_plus += std::norm(plus) / ring.weight;
              of_minus += n > 0 ? std::norm(minus) / ring.weight : 0;
            }
        sum += of_plus + of_minus;
        if (of_plus + of_minus <= largest)
          continue;
        largest               = of_plus + of_minus;
        with                  = of_minus;
        against               = of_plus;
        shape.nodal_diameters = n;
      }
      if (!(sum > 0))
        return shape;
      const unsigned int n = shape.nodal_diameters;
      shape.order_share    = largest / sum;
      shape.travelling     = n > 0 ? (with - against) / (with + against) : 0;
      double most          = -1;
      for (const unsigned int component : components)
      {
        std::vector<Complex> profile;
        double size = 0;
        for (const Ring &ring : sums.rings)
          if (ring.weight > 0)
          {
            const auto waves = ring.waves(component, n);
            profile.push_back(waves[with > against ? 1 : 0] / ring.weight);
            size += ring.weight * std::norm(profile.back());
          }
        if (size <= most)
          continue;
        most                = size;
        shape.nodal_circles = n_zeros(profile);
      }
      return shape;
    }
  } // namespace

  std::string name_of(const ModeShape &shape)
  {
    return !shape.is_of_rotor() ? "pads" : shape.is_bending() ? "bending" : "in_plane";
  }

  std::string described(const ModeShape &shape)
  {
    const auto several = [](const unsigned int n, const std::string &of)
    { return std::to_string(n) + " " + of + (n == 1 ? "" : "s"); };
    return std::string(!shape.is_of_rotor() ? "mostly pads, disc " : "") +
           (shape.is_bending() ? "bending" : "in-plane") + ", " +
           several(shape.nodal_diameters, "nodal diameter") + ", " +
           several(shape.nodal_circles, "circle");
  }

  template <>
  std::vector<ModeShape> mode_shapes<2>(const FiniteElementSpace<2> &, const std::vector<double> &,
                                        const EigenPairs &)
  {
    return {};
  }

  template <>
  std::vector<ModeShape> mode_shapes<3>(const FiniteElementSpace<3> &spaces,
                                        const std::vector<double> &densities,
                                        const EigenPairs &modes)
  {
    constexpr unsigned int dim = 3;
    const unsigned int n_modes = modes.size(), n_dofs = spaces.fe.n_dofs_per_cell();
    const auto part_of = [&](const auto &cell) -> const Part &
    { return spaces.geometry.parts[cell->material_id()]; };
    double inner = std::numeric_limits<double>::max(), outer = 0;
    for (const auto &cell : spaces.triangulation.active_cell_iterators())
      if (cell->is_locally_owned() && part_of(cell).body == rotor_body)
        for (const unsigned int v : cell->vertex_indices())
        {
          const double radius = std::hypot(cell->vertex(v)[0], cell->vertex(v)[1]);
          inner               = std::min(inner, radius);
          outer               = std::max(outer, radius);
        }
    inner = Utilities::MPI::min(inner, spaces.comm);
    outer = Utilities::MPI::max(outer, spaces.comm);
    if (!(outer > inner))
      return {};

    std::vector<Sums> all(n_modes);
    const QGauss<dim> quadrature(spaces.fe.degree + 1);
    FEValues<dim> values(spaces.mapping, spaces.fe, quadrature,
                         update_values | update_quadrature_points | update_JxW_values);
    std::vector<types::global_dof_index> nodes(n_dofs);
    constexpr unsigned int most = 8; // modes at a time: bounds the memory
    std::array<double, 2 * dim * most> at_point;
    std::vector<std::array<double, 2 * dim * most>> at_nodes(n_dofs);
    for (unsigned int first = 0; first < n_modes; first += most)
    {
      const unsigned int n_now = std::min(most, n_modes - first);
      std::vector<Vector> fields(2 * dim * n_now); // Re and Im by component, mode by mode
      for (unsigned int k = 0; k < fields.size(); ++k)
      {
        const MultiVector &part = k % 2 == 0 ? modes.right.re : modes.right.im;
        find_nodal_values(spaces, part.column(first + k / (2 * dim)), k / 2 % dim, fields[k]);
      }
      for (const auto &cell : spaces.nodes.active_cell_iterators())
      {
        if (!cell->is_locally_owned())
          continue;
        const Part &part    = part_of(cell);
        const bool is_rotor = part.body == rotor_body;
        values.reinit(cell);
        cell->get_dof_indices(nodes);
        for (unsigned int i = 0; i < n_dofs; ++i)
        {
          const unsigned int local = fields[0].get_partitioner()->global_to_local(nodes[i]);
          for (unsigned int k = 0; k < fields.size(); ++k)
            at_nodes[i][k] = fields[k].local_element(local);
        }
        for (const unsigned int q : values.quadrature_point_indices())
        {
          at_point.fill(0);
          for (unsigned int i = 0; i < n_dofs; ++i)
          {
            const double shape = values.shape_value(i, q);
            for (unsigned int k = 0; k < at_point.size(); ++k)
              at_point[k] += shape * at_nodes[i][k];
          }
          add_point(values.quadrature_point(q), densities[part.material] * values.JxW(q), is_rotor,
                    inner, outer, at_point.data(), n_now, all.data() + first);
        }
      }
    }

    std::vector<ModeShape> result;
    static_assert(sizeof(Sums) % sizeof(double) == 0);
    MPI_Allreduce(MPI_IN_PLACE, all.data(), int(all.size() * (sizeof(Sums) / sizeof(double))),
                  MPI_DOUBLE, MPI_SUM, spaces.comm);
    for (const Sums &sums : all)
      result.push_back(shape_of(sums));
    return result;
  }
} // namespace squeal
