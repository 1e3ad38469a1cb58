#include <squeal/contact/contact_kinematics.h>
#include <squeal/mesh/finite_element_space.h>

#include <algorithm>
#include <cmath>

// Kinematics of a pair of contact faces: tangential directions; shape functions of both faces at
// common points and their derivative along the turning; traces along a direction; products of two
// traces and where they go in a matrix; slopes of the surfaces, on demand, for contact that turns
// with them.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Derivatives on the surface along a tangential direction t: (grad_surface N) . t = (d N/d
    /// xi_i) a_i. Returns a, which solves t_i . t_j a_j = t_i . t.
    template <int dim, typename Frame>
    Tensor<1, dim - 1> surface_coordinates(const Frame &frame, const Tensor<1, dim> &t)
    {
      Tensor<2, dim - 1> metric;
      Tensor<1, dim - 1> components;
      for (unsigned int i = 0; i < dim - 1; ++i)
      {
        for (unsigned int j = 0; j < dim - 1; ++j)
          metric[i][j] = frame.tangents[i] * frame.tangents[j];
        components[i] = frame.tangents[i] * t;
      }
      return invert(metric) * components;
    }

  } // namespace

  template <int dim>
  Tensor<1, dim> binormal_of(const Tensor<1, dim> &normal, const Tensor<1, dim> &direction)
  {
    Tensor<1, dim> binormal;
    if constexpr (dim == 3)
      binormal = cross_product_3d(normal, direction);
    else
    {
      (void)normal;
      (void)direction;
    }
    return binormal;
  }

  template <int dim>
  Tensor<1, dim> direction_in_surface(const Tensor<1, dim> &normal, const Tensor<1, 3> &along)
  {
    Tensor<1, dim> e;
    for (unsigned int d = 0; d < dim; ++d)
      e[d] = along[d];
    e -= (e * normal) * normal;
    return e / e.norm();
  }

  template <int dim>
  PairShapes<dim>::PairShapes(const FaceElement<dim> &element, const ContactFace<dim> &rotor_face,
                              const ContactFace<dim> &pad_face, const FacePair<dim> &pair,
                              const Geometry<dim> &geometry, const double angular_velocity,
                              const Tensor<1, 3> *const along)
      : n_points(pair.points.size()), rotor(&rotor_face), pad(&pad_face)
  {
    const unsigned int n_nodes = element.n_nodes();
    on_rotor = on_pad = d_phi = DenseMatrix(n_nodes, n_points);
    normals.reserve(n_points);
    directions.reserve(n_points);
    positions.reserve(n_points);
    for (std::vector<double> *values : {&weights, &speeds, &radii})
      values->reserve(n_points);
    std::vector<double> rotor_values, pad_values;
    std::vector<typename FaceElement<dim>::Gradient> gradients;
    for (unsigned int q = 0; q < n_points; ++q)
    {
      const PairedPoint<dim> &point = pair.points[q];
      element.evaluate(point.xi_rotor, rotor_values, &gradients);
      element.evaluate(point.xi_pad, pad_values);
      const auto frame            = element.frame(rotor_face.shape, point.xi_rotor);
      const Tensor<1, dim> normal = frame.normal;

      // The transport field is tangential on the rotor's surface; e = v_0/|v_0| follows the
      // turning, and at rest the forward direction.
      Tensor<1, dim> w = along ? Tensor<1, dim>() : geometry.transport(frame.x);
      w -= (w * normal) * normal;
      const double speed = w.norm();
      normals.push_back(normal);
      directions.push_back(along ? direction_in_surface(normal, *along)
                                 : (std::signbit(angular_velocity) ? -1 : 1) * w / speed);
      weights.push_back(point.weight);
      positions.push_back(frame.x);
      speeds.push_back(std::abs(angular_velocity) * speed);
      radii.push_back(speed);
      const Tensor<1, dim - 1> turning = surface_coordinates<dim>(frame, w);
      for (unsigned int a = 0; a < n_nodes; ++a)
      {
        on_rotor(a, q) = rotor_values[a];
        on_pad(a, q)   = pad_values[a];
        d_phi(a, q)    = gradients[a] * turning;
      }
    }
  }

  template <int dim>
  Tensor<1, dim> ContactKinematics<dim>::direction(const unsigned int number,
                                                   const unsigned int q) const
  {
    const Tensor<1, dim> &n = shapes->normals[q], &e = shapes->directions[q];
    return number == 0 ? n : number == 1 ? e : binormal_of<dim>(n, e);
  }

  template <int dim>
  const DenseMatrix &
  ContactKinematics<dim>::along(const unsigned int direction, const DenseMatrix &on_rotor,
                                const DenseMatrix *const on_pad, DenseMatrix &kept) const
  {
    if (!kept.values.empty() || direction == dim)
      return kept;
    const unsigned int n_nodes = on_rotor.n_rows;
    kept                       = DenseMatrix(2 * n_nodes * dim, n_points);
    for (unsigned int q = 0; q < n_points; ++q)
    {
      const Tensor<1, dim> d = this->direction(direction, q);
      for (unsigned int a = 0; a < n_nodes; ++a)
        for (unsigned int c = 0; c < dim; ++c)
        {
          kept(a * dim + c, q) = on_rotor(a, q) * d[c];
          if (on_pad)
            kept((n_nodes + a) * dim + c, q) = -(*on_pad)(a, q) * d[c];
        }
    }
    return kept;
  }

  template <int dim>
  void ContactKinematics<dim>::add_across(RepeatedEntries &entries, const std::vector<double> &c,
                                          const bool turned_right) const
  {
    const unsigned int n_nodes = shapes->on_rotor.n_rows;
    // Points as rows
    DenseMatrix jump(n_points, 2 * n_nodes), turned(n_points, turned_right ? n_nodes : 0);
    std::vector<Tensor<1, dim>> directions;
    std::array<bool, dim> is_there{}; // a direction across a flat face has fewer components
    for (unsigned int q = 0; q < n_points; ++q)
    {
      for (unsigned int a = 0; a < n_nodes; ++a)
      {
        jump(q, a)           = shapes->on_rotor(a, q);
        jump(q, n_nodes + a) = -shapes->on_pad(a, q);
        if (turned_right)
          turned(q, a) = shapes->d_phi(a, q);
      }
      directions.push_back(direction(2, q));
      for (unsigned int i = 0; i < dim; ++i)
        is_there[i] |= directions.back()[i] != 0;
    }
    const DenseMatrix &right = turned_right ? turned : jump;
    DenseMatrix weighted(n_points, 2 * n_nodes), local(2 * n_nodes, right.n_columns);
    std::vector<double> weights(n_points);
    for (unsigned int i = 0; i < dim; ++i)
      for (unsigned int k = i; k < dim; ++k)
      {
        if (!is_there[i] || !is_there[k])
          continue;
        for (unsigned int q = 0; q < n_points; ++q)
          weights[q] = c[q] * directions[q][i] * directions[q][k];
        for (unsigned int a = 0; a < 2 * n_nodes; ++a)
          for (unsigned int q = 0; q < n_points; ++q)
            weighted(q, a) = weights[q] * jump(q, a);
        gemm<double>(1, weighted.transpose(), right, 0, local.values.data());
        for (unsigned int b = 0; b < right.n_columns && !turned_right; ++b)
          for (unsigned int a = 0; a < b; ++a) // symmetric to the last digit
            local(b, a) = local(a, b);
        for (unsigned int b = 0; b < right.n_columns; ++b)
          for (const FreeNode<dim> &column : node(b))
            for (unsigned int a = 0; a < 2 * n_nodes; ++a)
              for (const FreeNode<dim> &row : node(a))
              {
                const double value = row.weight * column.weight * local(a, b);
                entries.add(row.equations[i], column.equations[k], value);
                if (i != k)
                  entries.add(row.equations[k], column.equations[i], value);
              }
      }
  }

  template <int dim>
  void ContactKinematics<dim>::add_slopes(const FaceElement<dim> &element,
                                          const FacePair<dim> &pair, const Geometry<dim> &geometry)
  {
    const unsigned int n_nodes = element.n_nodes(), n_rows = 2 * n_nodes * dim;
    for (unsigned int along = 0; along < dim - 1; ++along)
    {
      moved_w[along] = DenseMatrix(n_rows, n_points);
      for (unsigned int c = 0; c < dim; ++c)
        slopes[along][c] = DenseMatrix(n_rows, n_points);
    }
    std::vector<double> values;
    std::vector<typename FaceElement<dim>::Gradient> gradients;
    for (unsigned int q = 0; q < n_points; ++q)
    {
      const auto &xi = pair.points[q].xi_rotor;
      element.evaluate(xi, values, &gradients);
      const auto frame                          = element.frame(rotor->shape, xi);
      const Tensor<1, dim> &direction           = shapes->directions[q];
      const std::array<Tensor<1, dim>, 3> basis = {
          {frame.normal, direction, binormal_of<dim>(frame.normal, direction)}};
      for (unsigned int s = 0; s < dim - 1; ++s)
      {
        const Tensor<1, dim - 1> t = surface_coordinates<dim>(frame, basis[1 + s]);
        // w is affine, so this difference is exact: the tangential change of w along n, e, b.
        std::array<double, 3> change{};
        for (unsigned int d = 1; d < dim; ++d)
          change[d] =
              basis[1 + s] * (geometry.transport(frame.x + basis[d]) - geometry.transport(frame.x));
        for (unsigned int a = 0; a < n_nodes; ++a)
          for (unsigned int c = 0; c < dim; ++c)
          {
            const unsigned int r = a * dim + c, p = (n_nodes + a) * dim + c;
            for (unsigned int d = 0; d < dim; ++d)
              slopes[s][d](r, q) = gradients[a] * t * basis[d][c];
            for (unsigned int d = 1; d < dim; ++d)
            {
              moved_w[s](r, q) -= shapes->on_rotor(a, q) * change[d] * basis[d][c];
              moved_w[s](p, q) += shapes->on_pad(a, q) * change[d] * basis[d][c];
            }
          }
      }
    }
  }

  namespace
  {
    template <int dim>
    using Numbering = unsigned int (FiniteElementSpace<dim>::*)(
        types::global_dof_index) const; ///< of multipliers

    template <int dim>
    std::vector<ContactFace<dim>>
    local_faces(const FiniteElementSpace<dim> &spaces, const FaceElement<dim> &element,
                const types::boundary_id boundary, const Numbering<dim> multiplier)
    {
      std::vector<ContactFace<dim>> faces;
      std::vector<types::global_dof_index> cell_nodes(spaces.fe.n_dofs_per_cell());
      const std::vector<Point<dim>> &unit_points = spaces.fe.get_unit_support_points();
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
          for (const unsigned int f : cell->face_indices())
            if (cell->face(f)->at_boundary() && cell->face(f)->boundary_id() == boundary)
            {
              cell->get_dof_indices(cell_nodes);
              // The cell's own reference coordinates without the one normal to the face parametrise
              // it; sorted with the first coordinate running fastest, the nodes on the face are
              // lexicographic.
              const unsigned int normal_direction = f / 2;
              std::vector<unsigned int> on_face;
              for (unsigned int a = 0; a < cell_nodes.size(); ++a)
                if (std::abs(unit_points[a][normal_direction] - f % 2) < 1e-12)
                  on_face.push_back(a);
              std::sort(on_face.begin(), on_face.end(),
                        [&](const unsigned int a, const unsigned int b)
                        {
                          for (int d = dim - 1; d >= 0; --d)
                            if (std::abs(unit_points[a][d] - unit_points[b][d]) > 1e-12)
                              return unit_points[a][d] < unit_points[b][d];
                          return false;
                        });

              ContactFace<dim> face;
              face.level = cell->level();
              for (const unsigned int a : on_face)
              {
                face.shape.nodes.push_back(
                    spaces.mapping.transform_unit_to_real_cell(cell, unit_points[a]));
                std::vector<FreeNode<dim>> expansion;
                for (const WeightedNode &w : spaces.expand(cell_nodes[a]))
                {
                  FreeNode<dim> free_node{w.weight, {}};
                  for (unsigned int c = 0; c < dim; ++c)
                    free_node.equations[c] = static_cast<int>(spaces.equation(w.node, c));
                  free_node.equations[dim]     = static_cast<int>((spaces.*multiplier)(w.node));
                  free_node.equations[dim + 1] = static_cast<int>(spaces.stick(w.node));
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

    /// The faces of all ranks, in their order, on all ranks. Collective.
    template <int dim>
    std::vector<ContactFace<dim>> gather_faces(const MPI_Comm comm, const unsigned int n_nodes,
                                               const std::vector<ContactFace<dim>> &own)
    {
      // Flat numbers, because every rank sends the same structure.
      std::vector<double> flat;
      for (const ContactFace<dim> &face : own)
      {
        flat.push_back(face.shape.orientation);
        flat.push_back(face.level);
        for (const Point<dim> &x : face.shape.nodes)
          for (unsigned int d = 0; d < dim; ++d)
            flat.push_back(x[d]);
        for (const std::vector<FreeNode<dim>> &node : face.nodes)
        {
          flat.push_back(node.size());
          for (const FreeNode<dim> &free_node : node)
          {
            flat.push_back(free_node.weight);
            flat.insert(flat.end(), free_node.equations.begin(), free_node.equations.end());
          }
        }
      }
      std::vector<ContactFace<dim>> faces;
      gather(flat, MPI_DOUBLE, comm);
      for (auto number = flat.cbegin(); number != flat.cend();)
      {
        ContactFace<dim> face;
        face.shape.orientation = *number++;
        face.level             = static_cast<unsigned int>(*number++);
        face.shape.nodes.resize(n_nodes);
        for (Point<dim> &x : face.shape.nodes)
          for (unsigned int d = 0; d < dim; ++d)
            x[d] = *number++;
        face.nodes.resize(n_nodes);
        for (std::vector<FreeNode<dim>> &node : face.nodes)
        {
          node.resize(static_cast<unsigned int>(*number++));
          for (FreeNode<dim> &free_node : node)
          {
            free_node.weight = *number++;
            for (int &equation : free_node.equations)
              equation = static_cast<int>(*number++);
          }
        }
        faces.push_back(std::move(face));
      }
      return faces;
    }

    /// The part of the faces that this rank works on: as many on each, next to each other.
    template <typename Face>
    std::vector<Face> share_of(const MPI_Comm comm, const std::vector<Face> &faces)
    {
      const std::size_t n = faces.size(), n_ranks = Utilities::MPI::n_mpi_processes(comm),
                        rank = Utilities::MPI::this_mpi_process(comm);
      return {faces.begin() + n * rank / n_ranks, faces.begin() + n * (rank + 1) / n_ranks};
    }
  } // namespace

  template <int dim>
  PairedInterface<dim>
  gather_surfaces(const FiniteElementSpace<dim> &spaces, const FaceElement<dim> &element,
                  const types::boundary_id first, const types::boundary_id second,
                  const Numbering<dim> multiplier)
  {
    const auto faces_of = [&](const types::boundary_id boundary)
    {
      return gather_faces(spaces.comm, element.n_nodes(),
                          local_faces(spaces, element, boundary, multiplier));
    };
    PairedInterface<dim> result;
    result.pad_faces   = share_of(spaces.comm, faces_of(first));
    result.rotor_faces = faces_of(second);
    return result;
  }

  template <int dim>
  std::vector<SurfaceFace<dim>> shapes_of(const std::vector<ContactFace<dim>> &faces)
  {
    std::vector<SurfaceFace<dim>> shapes;
    for (const ContactFace<dim> &face : faces)
      shapes.push_back(face.shape);
    return shapes;
  }

  template <int dim>
  std::vector<PairedInterface<dim>> pair_interfaces(const FiniteElementSpace<dim> &spaces,
                                                    const FaceElement<dim> &element)
  {
    std::vector<PairedInterface<dim>> interfaces;
    for (const ContactInterface &description : spaces.geometry.interfaces)
    {
      PairedInterface<dim> interface =
          gather_surfaces(spaces, element, description.pad_face, description.rotor_face,
                          &FiniteElementSpace<dim>::multiplier);
      interface.name     = description.name;
      interface.kind     = description.kind;
      interface.along    = description.along;
      interface.friction = description.friction;
      // Pads touch a plane as a whole. Joints are as they are: curved, behind an edge.
      interface.pairs =
          (description.slides()
               ? pair_surfaces<dim>
               : pair_facing_surfaces<dim>)(element, shapes_of(interface.pad_faces),
                                            shapes_of(interface.rotor_faces), description.distance);
      interfaces.push_back(std::move(interface));
    }
    return interfaces;
  }

  template Tensor<1, 2> direction_in_surface(const Tensor<1, 2> &, const Tensor<1, 3> &);
  template Tensor<1, 3> direction_in_surface(const Tensor<1, 3> &, const Tensor<1, 3> &);
  template Tensor<1, 2> binormal_of(const Tensor<1, 2> &, const Tensor<1, 2> &);
  template Tensor<1, 3> binormal_of(const Tensor<1, 3> &, const Tensor<1, 3> &);
  template struct PairShapes<2>;
  template struct PairShapes<3>;
  template struct ContactKinematics<2>;
  template struct ContactKinematics<3>;
#define SQUEAL_INSTANTIATE(dim)                                                                    \
  template PairedInterface<dim> gather_surfaces(const FiniteElementSpace<dim> &,                   \
                                                const FaceElement<dim> &, types::boundary_id,      \
                                                types::boundary_id, Numbering<dim>);               \
  template std::vector<SurfaceFace<dim>> shapes_of(const std::vector<ContactFace<dim>> &);
  SQUEAL_INSTANTIATE(2)
  SQUEAL_INSTANTIATE(3)
#undef SQUEAL_INSTANTIATE
  template std::vector<PairedInterface<2>> pair_interfaces(const FiniteElementSpace<2> &,
                                                           const FaceElement<2> &);
  template std::vector<PairedInterface<3>> pair_interfaces(const FiniteElementSpace<3> &,
                                                           const FaceElement<3> &);
} // namespace squeal
