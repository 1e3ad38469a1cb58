#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh/finite_element_space.h>
#include <squeal/statics/worn_pressure.h>

#include <algorithm>
#include <cmath>

// The pressure of worn pads: what loads do in the free motions (work_of_loads()), what the points
// of the contact know of these (PadPoints), the balance of virtual work and its solution (Balance),
// then WornPressure, which evaluates the pressure on any mesh and opens what is worn free.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// The virtual work of loads in each free motion, L(v_j), of displacements at nodes.
    template <int dim>
    std::vector<double> work_of_loads(const FiniteElementSpace<dim> &spaces,
                                      const MultiVector &load)
    {
      const Geometry<dim> &geometry = spaces.geometry;
      MultiVector motions(spaces.rows, geometry.free_motions.size());
      std::vector<types::global_dof_index> cell_nodes(spaces.fe.n_dofs_per_cell());
      for (const auto &cell : spaces.nodes.active_cell_iterators())
      {
        if (cell->is_artificial())
          continue;
        const Body body = geometry.parts[cell->material_id()].body;
        std::vector<std::pair<unsigned int, const RigidMotion<dim> *>> of_body;
        for (unsigned int j = 0; j < motions.n_columns(); ++j)
          if (const auto found = geometry.free_motions[j].find(body);
              found != geometry.free_motions[j].end())
            of_body.emplace_back(j, &found->second);
        cell->get_dof_indices(cell_nodes);
        for (unsigned int a = 0; a < cell_nodes.size() && !of_body.empty(); ++a)
        {
          const Point<dim> x = geometry.own.empty()
                                   ? spaces.mapping.transform_unit_to_real_cell(
                                         cell, spaces.fe.get_unit_support_points()[a])
                                   : spaces.position(cell_nodes[a]);
          for (const auto &[j, motion] : of_body)
          {
            const Tensor<1, dim> v = motion->at(x);
            for (unsigned int c = 0; c < dim; ++c)
              if (const unsigned int row = spaces.equation(cell_nodes[a], c);
                  row != FiniteElementSpace<dim>::none && spaces.rows.contains(row))
                motions.column(j)[row - spaces.rows.begin] = v[c];
          }
        }
      }
      return inner_products(motions, load).values;
    }

    /// What the pads' points know of the free motions.
    struct PadPoints
    {
      unsigned int n_motions;
      std::vector<double> normal, along; ///< v_j.n, v_j.e: j within a point
      std::vector<double> weights, speeds, radii;
      std::vector<const FrictionLaw *> laws; ///< null: no friction
    };

    template <int dim>
    PadPoints points_of(const Contact<dim> &contact, const bool with_friction)
    {
      const Geometry<dim> &geometry = contact.spaces().geometry;
      PadPoints points;
      points.n_motions = geometry.free_motions.size();
      contact.for_each_sliding_pair(
          [&](const unsigned int i, const ContactKinematics<dim> &k)
          {
            for (unsigned int q = 0; q < k.n_points; ++q)
            {
              points.weights.push_back(k.weights[q]);
              points.speeds.push_back(k.speeds[q]);
              points.radii.push_back(k.radii[q]);
              points.laws.push_back(with_friction ? &contact.friction(i) : nullptr);
              for (const auto &motion : geometry.free_motions)
              {
                const auto of_pad = motion.find(geometry.interfaces[i].pad);
                const Tensor<1, dim> v =
                    of_pad == motion.end() ? Tensor<1, dim>() : of_pad->second.at(k.positions[q]);
                points.normal.push_back(v * k.direction(0, q));
                points.along.push_back(v * k.direction(1, q));
              }
            }
          });
      return points;
    }

    /// The balance of virtual work as a problem for the numbers a_j,
    ///     F_j(a) = L_j + int (p n + tau e).v_j = 0,   p = p_0 (sum_i a_i v_i.n /
    ///     r^beta)_+^(1/alpha).
    class Balance
    {
    public:
      Balance(const PadPoints &points, const WearExponents &exponents, std::vector<double> load,
              const MPI_Comm comm)
          : points(points), exponents(exponents), load(std::move(load)), comm(comm),
            n(points.n_motions)
      {
        for (const double r : points.radii)
          radii.push_back(std::pow(r, exponents.of_speed));
      }

      /// a of the constant pressure that is next to what presses, whose size p_0 becomes. Returns
      /// whether anything presses.
      bool start(std::vector<double> &a)
      {
        // min int (sum a_j v_j.n - r^beta)^2
        DenseMatrix gram(n, n), right(n, 1);
        for (unsigned int q = 0; q < points.weights.size(); ++q)
          for (unsigned int i = 0; i < n; ++i)
          {
            const double w = points.weights[q] * points.normal[q * n + i];
            right(i, 0) += w * radii[q];
            for (unsigned int j = 0; j < n; ++j)
              gram(i, j) += w * points.normal[q * n + j];
          }
        add_up(gram.values);
        add_up(right.values);
        a            = squeal::solve(std::move(gram), std::move(right)).values;
        double loads = 0, pressures[2] = {0, 0};
        for (unsigned int j = 0; j < n; ++j)
          loads -= a[j] * load[j];
        scale = 1;
        for (unsigned int q = 0; q < points.weights.size(); ++q)
          if (const double s = approach(a, q); s > 0)
            pressures[0] += points.weights[q] * s * radii[q] * at(s);
        MPI_Allreduce(MPI_IN_PLACE, pressures, 1, MPI_DOUBLE, MPI_SUM, comm);
        scale = pressures[0] > 0 ? loads / pressures[0] : 0;
        return scale > 0;
      }

      /// F and, on demand, dF/da. The size of its summands goes to @p size.
      std::vector<double> residual(const std::vector<double> &a, std::vector<double> &size,
                                   DenseMatrix *slopes) const
      {
        std::vector<double> f(n), sizes(n), jacobian(n * n);
        for (unsigned int q = 0; q < points.weights.size(); ++q)
        {
          const double s = approach(a, q), p = scale * at(s), w = points.weights[q],
                       dp = p / (exponents.of_pressure * s) / radii[q];
          if (s <= 0)
            continue;
          double tau = 0, d_tau = 0;
          if (points.laws[q])
          {
            const auto law = points.laws[q]->traction(points.speeds[q], p);
            tau            = law.value;
            d_tau          = law.d_pressure;
          }
          const double *normal = &points.normal[q * n], *along = &points.along[q * n];
          for (unsigned int j = 0; j < n; ++j)
          {
            f[j] += w * (p * normal[j] + tau * along[j]);
            sizes[j] += w * (p * std::abs(normal[j]) + std::abs(tau * along[j]));
            for (unsigned int i = 0; i < n && slopes; ++i)
              jacobian[j + i * n] += w * (normal[j] + d_tau * along[j]) * dp * normal[i];
          }
        }
        add_up(f);
        add_up(sizes);
        for (unsigned int j = 0; j < n; ++j)
        {
          f[j] += load[j];
          size[j] = std::max(size[j], std::max(sizes[j], std::abs(load[j])));
        }
        if (slopes)
        {
          add_up(jacobian);
          *slopes        = DenseMatrix(n, n);
          slopes->values = std::move(jacobian);
        }
        return f;
      }

      /// Newton's method; steps are shortened until the residual falls.
      void solve(std::vector<double> &a) const
      {
        constexpr unsigned int max_steps = 100;
        constexpr double small = 1e-9, rounding = 1e-15;
        std::vector<double> size(n);
        DenseMatrix slopes;
        std::vector<double> f = residual(a, size, &slopes);
        bool is_last          = false;
        for (unsigned int step = 0; step < max_steps; ++step)
        {
          const double before = relative(f, size);
          if (is_last || before <= rounding)
            return;
          is_last = before <= small; // quadratic: one more is exact
          DenseMatrix right(n, 1);
          right.values                     = f;
          const std::vector<double> change = (pseudo_inverse(slopes, 1e-13) * right).values;
          double length                    = 1;
          std::vector<double> next         = a;
          do
          {
            for (unsigned int j = 0; j < n; ++j)
              next[j] = a[j] - length * change[j];
            f = residual(next, size, &slopes);
            length /= 2;
          } while (!is_last && !(relative(f, size) < before) && length > 1e-6);
          a = std::move(next);
        }
        throw SolverError("The pressure of worn pads is not found: no pressure that only presses "
                          "balances loads and friction in the motions that supports leave free. "
                          "Try a smaller friction coefficient, or a pad with a shorter lever arm "
                          "between its face and its support.");
      }

      /// p_0 a_j: the approach of the same pressure in Pa (p_0^alpha a_j).
      double factor() const
      {
        return std::pow(scale, exponents.of_pressure);
      }

    private:
      /// sum_j a_j v_j.n / r^beta at a point.
      double approach(const std::vector<double> &a, const unsigned int q) const
      {
        double s = 0;
        for (unsigned int j = 0; j < n; ++j)
          s += a[j] * points.normal[q * n + j];
        return s / radii[q];
      }
      double at(const double s) const
      {
        return s <= 0 ? 0 : exponents.of_pressure == 1 ? s : std::pow(s, 1 / exponents.of_pressure);
      }
      double relative(const std::vector<double> &f, const std::vector<double> &size) const
      {
        double largest = 0;
        for (unsigned int j = 0; j < n; ++j)
          if (size[j] > 0)
            largest = std::max(largest, std::abs(f[j]) / size[j]);
        return largest;
      }
      void add_up(std::vector<double> &values) const
      {
        MPI_Allreduce(MPI_IN_PLACE, values.data(), values.size(), MPI_DOUBLE, MPI_SUM, comm);
      }

      const PadPoints &points;
      const WearExponents &exponents;
      const std::vector<double> load;
      const MPI_Comm comm;
      const unsigned int n;
      std::vector<double> radii; ///< r^beta
      double scale = 1;          ///< p_0
    };
  } // namespace

  template <int dim>
  WornPressure<dim>::WornPressure(const Contact<dim> &contact, const WearExponents &exponents,
                                  const MultiVector &load, const bool with_friction)
      : exponents(exponents), motions(contact.paired_interfaces().size()), normals(motions.size()),
        open(motions.size(), false)
  {
    const Geometry<dim> &geometry = contact.spaces().geometry;
    const PadPoints points        = points_of(contact, with_friction);
    Balance balance(points, this->exponents, work_of_loads(contact.spaces(), load),
                    contact.spaces().comm);
    std::vector<double> a;
    if (balance.start(a))
      balance.solve(a);
    else
      std::fill(a.begin(), a.end(), 0.);
    for (unsigned int i = 0; i < motions.size(); ++i)
      for (unsigned int j = 0; j < a.size(); ++j)
        if (const auto of_pad = geometry.free_motions[j].find(geometry.interfaces[i].pad);
            of_pad != geometry.free_motions[j].end())
          motions[i].add(balance.factor() * a[j], of_pad->second);
    for_each_approach(
        contact,
        [&](const unsigned int i, const ContactKinematics<dim> &k, const std::vector<double> &s)
        {
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            open[i] = open[i] || s[q] < 0;
            normals[i] += k.weights[q] * k.direction(0, q);
          }
        });
    for (unsigned int i = 0; i < open.size(); ++i)
    {
      open[i]    = Utilities::MPI::max(int(open[i]), contact.spaces().comm) > 0;
      normals[i] = Utilities::MPI::sum(normals[i], contact.spaces().comm);
      normals[i] /= normals[i].norm();
    }
  }

  template <int dim>
  std::string WornPressure<dim>::formula(const unsigned int interface) const
  {
    // (t + o x x).n = t.n + x.(n x o)
    Tensor<1, 3> n;
    for (unsigned int d = 0; d < dim; ++d)
      n[d] = normals[interface][d];
    const Tensor<1, 3> slope = cross_product_3d(n, motions[interface].rotation);
    std::string text         = dim == 2 ? "A + B x" : "A + B x + C y";
    if (dim == 3 && exponents.of_speed != 0)
      text =
          "(" + text + ")/" + (exponents.of_speed == 1 ? "r" : "r^" + number(exponents.of_speed));
    if (exponents.of_pressure != 1)
      text = "(" + text + ")^(1/" + number(exponents.of_pressure) + ")";
    text += ", A = " + number(motions[interface].translation * normals[interface], 10) +
            ", B = " + number(slope[0], 10);
    if (dim == 3)
      text += ", C = " + number(slope[1], 10);
    return text + " (Pa, m)";
  }

  template <int dim>
  void WornPressure<dim>::for_each_approach(
      const Contact<dim> &contact,
      const std::function<void(unsigned int, const ContactKinematics<dim> &,
                               const std::vector<double> &)> &work) const
  {
    contact.for_each_sliding_pair(
        [&](const unsigned int i, const ContactKinematics<dim> &k)
        {
          std::vector<double> s(k.n_points);
          for (unsigned int q = 0; q < k.n_points; ++q)
            s[q] = motions[i].at(k.positions[q]) * k.direction(0, q);
          work(i, k, s);
        });
  }

  template <int dim>
  double WornPressure<dim>::at(const double approach, const double radius) const
  {
    if (approach <= 0)
      return 0;
    const double s = approach / std::pow(radius, exponents.of_speed);
    return exponents.of_pressure == 1 ? s : std::pow(s, 1 / exponents.of_pressure);
  }

  template <int dim>
  double WornPressure<dim>::at(const Geometry<dim> &geometry, const unsigned int interface,
                               const Point<dim> &x, const Tensor<1, dim> &normal) const
  {
    const Tensor<1, dim> w = geometry.transport(x);
    return at(motions[interface].at(x) * normal, (w - (w * normal) * normal).norm());
  }

  template <int dim>
  ContactPressure WornPressure<dim>::on(const Contact<dim> &contact) const
  {
    ContactPressure pressure = contact.uniform_pressure(0);
    for_each_approach(
        contact,
        [&](const unsigned int i, const ContactKinematics<dim> &k, const std::vector<double> &s)
        {
          for (unsigned int q = 0; q < k.n_points; ++q)
            pressure[i][k.first_point + q] = at(s[q], k.radii[q]);
        });
    return pressure;
  }

  template <int dim>
  double WornPressure<dim>::largest(const Contact<dim> &contact, const unsigned int interface) const
  {
    const Geometry<dim> &geometry = contact.spaces().geometry;
    double result                 = 0;
    contact.for_each_sliding_pair(
        [&](const unsigned int i, const ContactKinematics<dim> &k)
        {
          if (i != interface)
            return;
          for (const Point<dim> &x : k.pad->shape.nodes)
            result = std::max(result, at(geometry, i, x, k.direction(0, 0)));
        });
    return Utilities::MPI::max(result, contact.spaces().comm);
  }

  template <int dim>
  void WornPressure<dim>::release(Contact<dim> &contact) const
  {
    if (std::none_of(open.begin(), open.end(), [](const bool is_open) { return is_open; }))
      return;
    // int psi V.n of the multipliers
    std::vector<double> means(contact.spaces().rows.size);
    std::vector<std::pair<unsigned int, unsigned int>> open_points;
    for_each_approach(
        contact,
        [&](const unsigned int i, const ContactKinematics<dim> &k, const std::vector<double> &s)
        {
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            if (s[q] <= 0)
              open_points.emplace_back(i, k.first_point + q);
            for (unsigned int m = 0; m < k.pad->free.size(); ++m)
              if (const int row = k.pad->free[m].equations[dim]; row >= 0)
                means[row] += k.weights[q] * k.psi(m, q) * s[q];
          }
        });
    if (!contact.contact_model().mortar)
    {
      for (const auto &[interface, point] : open_points)
        contact.release_point(interface, point);
      return;
    }
    MPI_Allreduce(MPI_IN_PLACE, means.data(), means.size(), MPI_DOUBLE, MPI_SUM,
                  contact.spaces().comm);
    std::vector<unsigned int> released;
    for (unsigned int row = 0; row < means.size(); ++row)
      if (means[row] < 0)
        released.push_back(row);
    contact.set_closed(released, false);
  }

  template class WornPressure<2>;
  template class WornPressure<3>;
} // namespace squeal
