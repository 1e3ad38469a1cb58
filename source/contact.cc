#include <squeal/contact.h>
#include <squeal/dense.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Collects entries (row, column, value), own rows or not, and makes a matrix of them. Exact zeros are
    /// not stored.
    class EntryList
    {
    public:
      void add(const int row, const int column, const double value)
      {
        if (row >= 0 && column >= 0 && value != 0)
        {
          rows.push_back(row);
          columns.push_back(column);
          values.push_back(value);
        }
      }

      Matrix make_matrix(const RowRange &range)
      {
        Mat mat = nullptr;
        SQUEAL_PETSC(MatCreate(range.comm, &mat));
        Matrix matrix(mat);
        SQUEAL_PETSC(MatSetSizes(mat, range.n_local(), range.n_local(), range.size, range.size));
        SQUEAL_PETSC(MatSetType(mat, MATAIJ));
        SQUEAL_PETSC(MatSetPreallocationCOO(mat, rows.size(), rows.data(), columns.data()));
        SQUEAL_PETSC(MatSetValuesCOO(mat, values.data(), ADD_VALUES));
        return matrix;
      }

    private:
      std::vector<PetscInt>    rows, columns;
      std::vector<PetscScalar> values;
    };

    /// The values of a distributed column on every rank.
    std::vector<double> replicate(const Block &column)
    {
      const RowRange  &range = column.row_range();
      int              n_ranks = 0, n_local = range.n_local(), begin = range.begin;
      MPI_Comm_size(range.comm, &n_ranks);
      std::vector<int> counts(n_ranks), offsets(n_ranks);
      MPI_Allgather(&n_local, 1, MPI_INT, counts.data(), 1, MPI_INT, range.comm);
      MPI_Allgather(&begin, 1, MPI_INT, offsets.data(), 1, MPI_INT, range.comm);
      std::vector<double> all(range.size);
      MPI_Allgatherv(
        column.data(), n_local, MPI_DOUBLE, all.data(), counts.data(), offsets.data(), MPI_DOUBLE, range.comm);
      return all;
    }
  } // namespace



  /// The displacement jump and its parts on one pair of faces, as rows over the local displacements
  /// (rotor nodes, then pad nodes; components within) and columns over the pair's quadrature points:
  /// jump(u).b = sum_i b_rows(i, q) u_i for the direction b of that name.
  template <int dim>
  struct Contact<dim>::Kinematics
  {
    unsigned int        n_points = 0, first_point = 0;
    DenseMatrix         n, e, b;      ///< [[.]].n, [[.]].e, [[.]].b with b = n x e (empty in 2D)
    DenseMatrix         e_phi, b_phi; ///< (d_phi u_R).e, (d_phi u_R).b
    DenseMatrix         psi;          ///< multiplier's shape functions of the pad face
    std::vector<double> weights, speeds, radii;
    const Face         *rotor = nullptr, *pad = nullptr;

    Kinematics(const FaceElement<dim> &element,
               const Face             &rotor_face,
               const Face             &pad_face,
               const FacePair<dim>    &pair,
               const Geometry<dim>    &geometry,
               const double            angular_velocity);

    /// Distributes a local matrix over displacements x displacements.
    void add(EntryList &entries, const DenseMatrix &local) const
    {
      for_nodes([&](const unsigned int a, const FreeNode &row) {
        for_nodes([&](const unsigned int b, const FreeNode &column) {
          for (unsigned int i = 0; i < dim; ++i)
            for (unsigned int k = 0; k < dim; ++k)
              entries.add(row.equations[i],
                          column.equations[k],
                          row.weight * column.weight * local(a * dim + i, b * dim + k));
        });
      });
    }

    /// Distributes a local matrix over displacements x multipliers, and its transpose on demand.
    void add_coupling(EntryList &entries, const DenseMatrix &local, const bool transpose_too) const
    {
      for_nodes([&](const unsigned int a, const FreeNode &row) {
        for (unsigned int m = 0; m < pad->nodes.size(); ++m)
          for (const FreeNode &column : pad->nodes[m])
            for (unsigned int i = 0; i < dim; ++i)
            {
              const double value = row.weight * column.weight * local(a * dim + i, m);
              entries.add(row.equations[i], column.equations[dim], value);
              if (transpose_too)
                entries.add(column.equations[dim], row.equations[i], value);
            }
      });
    }

    template <typename Function>
    void for_nodes(const Function &function) const
    {
      const unsigned int n_rotor = rotor->nodes.size();
      for (unsigned int a = 0; a < n_rotor; ++a)
        for (const FreeNode &node : rotor->nodes[a])
          function(a, node);
      for (unsigned int a = 0; a < pad->nodes.size(); ++a)
        for (const FreeNode &node : pad->nodes[a])
          function(n_rotor + a, node);
    }

    /// sum_q c_q left(:, q) right(:, q)^T
    DenseMatrix product(const DenseMatrix &left, std::vector<double> c, const DenseMatrix &right) const
    {
      DenseMatrix scaled(n_points, left.n_rows), transposed(n_points, right.n_rows);
      for (unsigned int q = 0; q < n_points; ++q)
      {
        for (unsigned int i = 0; i < left.n_rows; ++i)
          scaled(q, i) = c[q] * left(i, q);
        for (unsigned int i = 0; i < right.n_rows; ++i)
          transposed(q, i) = right(i, q);
      }
      DenseMatrix result(left.n_rows, right.n_rows);
      gemm(true, 1, scaled, transposed, 0, result);
      return result;
    }

    /// The local displacements out of a replicated vector.
    std::vector<double> local_values(const std::vector<double> &global) const
    {
      std::vector<double> local(n.n_rows);
      for_nodes([&](const unsigned int a, const FreeNode &node) {
        for (unsigned int c = 0; c < dim; ++c)
          if (node.equations[c] >= 0)
            local[a * dim + c] += node.weight * global[node.equations[c]];
      });
      return local;
    }
  };



  template <int dim>
  Contact<dim>::Kinematics::Kinematics(const FaceElement<dim> &element,
                                       const Face             &rotor_face,
                                       const Face             &pad_face,
                                       const FacePair<dim>    &pair,
                                       const Geometry<dim>    &geometry,
                                       const double            angular_velocity)
    : n_points(pair.points.size()), rotor(&rotor_face), pad(&pad_face)
  {
    const unsigned int n_nodes = element.n_nodes(), n_rows = 2 * n_nodes * dim;
    n = e = e_phi = DenseMatrix(n_rows, n_points);
    if (dim == 3)
      b = b_phi = DenseMatrix(n_rows, n_points);
    psi = DenseMatrix(n_nodes, n_points);
    std::vector<double>                                  on_rotor, on_pad;
    std::vector<typename FaceElement<dim>::Gradient>     gradients;
    for (unsigned int q = 0; q < n_points; ++q)
    {
      const PairedPoint<dim> &point = pair.points[q];
      element.evaluate(point.xi_rotor, on_rotor, &gradients);
      element.evaluate(point.xi_pad, on_pad);
      const auto           frame  = element.frame(rotor_face.shape, point.xi_rotor);
      const Tensor<1, dim> normal = frame.normal;

      // The transport field is tangential on the rotor's surface; e = v_0/|v_0| follows the turning, and at
      // rest the forward direction.
      Tensor<1, dim> w = geometry.transport(frame.x);
      w -= (w * normal) * normal;
      const double         speed     = w.norm();
      const Tensor<1, dim> direction = (angular_velocity < 0 ? -1 : 1) * w / speed;
      weights.push_back(point.weight);
      speeds.push_back(std::abs(angular_velocity) * speed);
      radii.push_back(speed);

      // d_phi N = grad_surface N . w = (d N/d xi_i) a_i, where a solves t_i . t_j a_j = t_i . w
      Tensor<2, dim - 1> metric;
      Tensor<1, dim - 1> components;
      for (unsigned int i = 0; i < dim - 1; ++i)
      {
        components[i] = frame.tangents[i] * w;
        for (unsigned int j = 0; j < dim - 1; ++j)
          metric[i][j] = frame.tangents[i] * frame.tangents[j];
      }
      const Tensor<1, dim - 1> along = invert(metric) * components;

      Tensor<1, dim> binormal;
      if constexpr (dim == 3)
        binormal = cross_product_3d(normal, direction);

      for (unsigned int a = 0; a < n_nodes; ++a)
      {
        const double d_phi = gradients[a] * along;
        psi(a, q)          = on_pad[a];
        for (unsigned int c = 0; c < dim; ++c)
        {
          const unsigned int r = a * dim + c, p = (n_nodes + a) * dim + c;
          n(r, q)     = on_rotor[a] * normal[c];
          n(p, q)     = -on_pad[a] * normal[c];
          e(r, q)     = on_rotor[a] * direction[c];
          e(p, q)     = -on_pad[a] * direction[c];
          e_phi(r, q) = d_phi * direction[c];
          if (dim == 3)
          {
            b(r, q)     = on_rotor[a] * binormal[c];
            b(p, q)     = -on_pad[a] * binormal[c];
            b_phi(r, q) = d_phi * binormal[c];
          }
        }
      }
    }
  }



  template <int dim>
  Contact<dim>::Contact(const Spaces<dim> &spaces, const ContactModel &model)
    : spaces(spaces), model(model), element(spaces.fe.degree)
  {
    for (const ContactInterface &description : spaces.geometry.interfaces)
    {
      Interface interface;
      interface.name      = description.name;
      interface.pad_faces = local_faces(description.pad_face);

      // Gather the rotor's side: flat numbers, because every rank sends the same structure.
      std::vector<double> flat;
      for (const Face &face : local_faces(description.rotor_face))
      {
        flat.push_back(face.shape.orientation);
        for (const Point<dim> &x : face.shape.nodes)
          for (unsigned int d = 0; d < dim; ++d)
            flat.push_back(x[d]);
        for (const std::vector<FreeNode> &node : face.nodes)
        {
          flat.push_back(node.size());
          for (const FreeNode &free_node : node)
          {
            flat.push_back(free_node.weight);
            flat.insert(flat.end(), free_node.equations.begin(), free_node.equations.end());
          }
        }
      }
      for (const std::vector<double> &part : Utilities::MPI::all_gather(spaces.comm, flat))
        for (auto number = part.begin(); number != part.end();)
        {
          Face face;
          face.shape.orientation = *number++;
          face.shape.nodes.resize(element.n_nodes());
          for (Point<dim> &x : face.shape.nodes)
            for (unsigned int d = 0; d < dim; ++d)
              x[d] = *number++;
          face.nodes.resize(element.n_nodes());
          for (std::vector<FreeNode> &node : face.nodes)
          {
            node.resize(static_cast<unsigned int>(*number++));
            for (FreeNode &free_node : node)
            {
              free_node.weight = *number++;
              for (int &equation : free_node.equations)
                equation = static_cast<int>(*number++);
            }
          }
          interface.rotor_faces.push_back(std::move(face));
        }

      std::vector<SurfaceFace<dim>> pad_shapes, rotor_shapes;
      for (const Face &face : interface.pad_faces)
        pad_shapes.push_back(face.shape);
      for (const Face &face : interface.rotor_faces)
        rotor_shapes.push_back(face.shape);
      interface.pairs = pair_surfaces(element, pad_shapes, rotor_shapes, 0.);
      interfaces.push_back(std::move(interface));
    }
  }



  template <int dim>
  std::vector<typename Contact<dim>::Face>
  Contact<dim>::local_faces(const types::boundary_id boundary) const
  {
    std::vector<Face>                    faces;
    std::vector<types::global_dof_index> cell_nodes(spaces.fe.n_dofs_per_cell());
    const std::vector<Point<dim>>       &unit_points = spaces.fe.get_unit_support_points();
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned())
        for (const unsigned int f : cell->face_indices())
          if (cell->face(f)->at_boundary() && cell->face(f)->boundary_id() == boundary)
          {
            cell->get_dof_indices(cell_nodes);
            // The cell's own reference coordinates without the one normal to the face parametrise it; sorted
            // with the first coordinate running fastest, the nodes on the face are lexicographic.
            const unsigned int        normal_direction = f / 2;
            std::vector<unsigned int> on_face;
            for (unsigned int a = 0; a < cell_nodes.size(); ++a)
              if (std::abs(unit_points[a][normal_direction] - f % 2) < 1e-12)
                on_face.push_back(a);
            std::sort(on_face.begin(), on_face.end(), [&](const unsigned int a, const unsigned int b) {
              for (int d = dim - 1; d >= 0; --d)
                if (std::abs(unit_points[a][d] - unit_points[b][d]) > 1e-12)
                  return unit_points[a][d] < unit_points[b][d];
              return false;
            });

            Face face;
            for (const unsigned int a : on_face)
            {
              face.shape.nodes.push_back(spaces.mapping.transform_unit_to_real_cell(cell, unit_points[a]));
              std::vector<FreeNode> expansion;
              for (const WeightedNode &w : spaces.expand(cell_nodes[a]))
              {
                FreeNode free_node{w.weight, {}};
                for (unsigned int c = 0; c < dim; ++c)
                  free_node.equations[c] = static_cast<int>(spaces.equation(w.node, c));
                free_node.equations[dim] = static_cast<int>(spaces.multiplier(w.node));
                expansion.push_back(free_node);
              }
              face.nodes.push_back(std::move(expansion));
            }
            Point<dim - 1> middle;
            for (unsigned int d = 0; d < dim - 1; ++d)
              middle[d] = 0.5;
            const auto frame = element.frame(face.shape, middle);
            if (frame.normal * (frame.x - cell->center()) < 0)
              face.shape.orientation = -1;
            faces.push_back(std::move(face));
          }
    return faces;
  }



  template <int dim>
  void Contact<dim>::for_each_pair(
    const std::function<void(unsigned int interface, const Kinematics &)> &work) const
  {
    for (unsigned int i = 0; i < interfaces.size(); ++i)
    {
      unsigned int first_point = 0;
      for (const FacePair<dim> &pair : interfaces[i].pairs)
      {
        Kinematics kinematics(element,
                              interfaces[i].rotor_faces[pair.rotor_face],
                              interfaces[i].pad_faces[pair.pad_face],
                              pair,
                              spaces.geometry,
                              model.angular_velocity);
        kinematics.first_point = first_point;
        work(i, kinematics);
        first_point += pair.points.size();
      }
    }
  }



  template <int dim>
  Matrix Contact<dim>::normal() const
  {
    EntryList entries;
    for_each_pair([&](const unsigned int, const Kinematics &k) {
      std::vector<double> c = k.weights;
      if (model.mortar)
      {
        for (double &value : c)
          value *= pressure_scale;
        k.add_coupling(entries, k.product(k.n, c, k.psi), true);
      }
      else
      {
        for (double &value : c)
          value *= model.penalty_stiffness;
        k.add(entries, k.product(k.n, c, k.n));
      }
    });
    return entries.make_matrix(spaces.rows);
  }



  template <int dim>
  Matrix Contact<dim>::friction() const
  {
    EntryList entries;
    for_each_pair([&](const unsigned int, const Kinematics &k) {
      std::vector<double> c = k.weights;
      for (unsigned int q = 0; q < k.n_points; ++q)
        c[q] *= model.friction(k.speeds[q]) * (model.mortar ? pressure_scale : model.penalty_stiffness);
      if (model.mortar)
        k.add_coupling(entries, k.product(k.e, c, k.psi), false);
      else
        k.add(entries, k.product(k.e, c, k.n));
    });
    return entries.make_matrix(spaces.rows);
  }



  template <int dim>
  typename Contact<dim>::Pressure Contact<dim>::uniform_pressure(const double value) const
  {
    Pressure pressure(interfaces.size());
    for_each_pair([&](const unsigned int i, const Kinematics &k) {
      pressure[i].insert(pressure[i].end(), k.n_points, value);
    });
    return pressure;
  }



  template <int dim>
  typename Contact<dim>::Pressure Contact<dim>::pressure_of(const Block &state) const
  {
    const std::vector<double> global = replicate(state);
    Pressure                  pressure(interfaces.size());
    for_each_pair([&](const unsigned int i, const Kinematics &k) {
      // Mortar: p = Psi^T Lambda. Penalty: p = k_C [[u]].n.
      std::vector<double> local = k.local_values(global);
      if (model.mortar)
      {
        local.assign(k.psi.n_rows, 0.);
        for (unsigned int m = 0; m < k.pad->nodes.size(); ++m)
          for (const FreeNode &node : k.pad->nodes[m])
            if (node.equations[dim] >= 0)
              local[m] += node.weight * global[node.equations[dim]];
      }
      const DenseMatrix &shape  = model.mortar ? k.psi : k.n;
      const double       factor = model.mortar ? pressure_scale : model.penalty_stiffness;
      for (unsigned int q = 0; q < k.n_points; ++q)
      {
        double p = 0;
        for (unsigned int m = 0; m < local.size(); ++m)
          p += shape(m, q) * local[m];
        pressure[i].push_back(factor * p);
      }
    });
    return pressure;
  }



  template <int dim>
  typename Contact<dim>::FrictionDamping Contact<dim>::friction_damping(const Pressure &pressure) const
  {
    EntryList P, Q, P_falling, Q_falling;
    for_each_pair([&](const unsigned int i, const Kinematics &k) {
      std::vector<double> turning(k.n_points), falling(k.n_points);
      bool                falls = false;
      for (unsigned int q = 0; q < k.n_points; ++q)
      {
        const auto [mu, slope] = model.friction.value_and_derivative(k.speeds[q]);
        const double force     = k.weights[q] * pressure[i][k.first_point + q];
        turning[q]             = mu * force / k.speeds[q];
        falling[q]             = slope * force;
        falls |= slope != 0;
      }
      const auto times_omega = [&](std::vector<double> c) {
        for (double &value : c)
          value *= model.angular_velocity;
        return c;
      };
      if (dim == 3) // P_perp = b b^T
      {
        k.add(P, k.product(k.b, turning, k.b));
        k.add(Q, k.product(k.b, times_omega(turning), k.b_phi));
      }
      if (falls)
      {
        k.add(P_falling, k.product(k.e, falling, k.e));
        k.add(Q_falling, k.product(k.e, times_omega(falling), k.e_phi));
      }
    });
    FrictionDamping result;
    if (dim == 3)
    {
      result.P = P.make_matrix(spaces.rows);
      result.Q = Q.make_matrix(spaces.rows);
    }
    if (model.friction.kind != FrictionLaw::Kind::constant)
    {
      result.P_falling = P_falling.make_matrix(spaces.rows);
      result.Q_falling = Q_falling.make_matrix(spaces.rows);
    }
    return result;
  }



  template <int dim>
  std::vector<ContactResultants> Contact<dim>::resultants(const Pressure &pressure, const Block *state) const
  {
    const std::vector<double>      global = state ? replicate(*state) : std::vector<double>();
    std::vector<ContactResultants> results(interfaces.size());
    for (unsigned int i = 0; i < interfaces.size(); ++i)
      results[i].name = interfaces[i].name;
    for_each_pair([&](const unsigned int i, const Kinematics &k) {
      ContactResultants        &r     = results[i];
      const std::vector<double> local = state ? k.local_values(global) : std::vector<double>();
      for (unsigned int q = 0; q < k.n_points; ++q)
      {
        const double p     = pressure[i][k.first_point + q];
        const double force = p * k.weights[q], friction = model.friction(k.speeds[q]) * force;
        r.area += k.weights[q];
        r.normal_force += force;
        r.friction_force += friction;
        r.friction_torque += friction * k.radii[q];
        r.max_pressure = std::max(r.max_pressure, p);
        r.tension_area += p < 0 ? k.weights[q] : 0;
        double penetration = 0;
        for (unsigned int m = 0; m < local.size(); ++m)
          penetration += k.n(m, q) * local[m];
        r.max_penetration = std::max(r.max_penetration, penetration);
      }
    });
    for (ContactResultants &r : results)
    {
      for (double *sum : {&r.area, &r.tension_area, &r.normal_force, &r.friction_force, &r.friction_torque})
        *sum = Utilities::MPI::sum(*sum, spaces.comm);
      for (double *maximum : {&r.max_pressure, &r.max_penetration})
        *maximum = Utilities::MPI::max(*maximum, spaces.comm);
    }
    return results;
  }



  template <int dim>
  unsigned int Contact<dim>::n_points() const
  {
    unsigned int n = 0;
    for (const Interface &interface : interfaces)
      for (const FacePair<dim> &pair : interface.pairs)
        n += pair.points.size();
    return Utilities::MPI::sum(n, spaces.comm);
  }

  template class Contact<3>;
} // namespace squeal
