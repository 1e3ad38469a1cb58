#include <squeal/contact/contact_kinematics.h>
#include <squeal/mesh/finite_element_space.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

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
  void ContactFace<dim>::gather_free_nodes()
  {
    const auto is_whole = [](const std::vector<FreeNode<dim>> &node)
    { return node.size() == 1 && node[0].weight == 1 && node[0].multiplier_weight == 1; };
    if (std::all_of(nodes.begin(), nodes.end(), is_whole))
    {
      for (const std::vector<FreeNode<dim>> &node : nodes)
        free.push_back(node[0]);
      return;
    }
    std::map<std::array<int, dim + 2>, unsigned int> numbers;
    for (const std::vector<FreeNode<dim>> &node : nodes)
      for (const FreeNode<dim> &of_node : node)
        if (numbers.emplace(of_node.equations, free.size()).second)
          free.push_back({1, 1, of_node.equations, of_node.moves});
    moves = multipliers = DenseMatrix(free.size(), nodes.size());
    for (unsigned int a = 0; a < nodes.size(); ++a)
      for (const FreeNode<dim> &of_node : nodes[a])
      {
        const unsigned int k = numbers.at(of_node.equations);
        moves(k, a) += of_node.weight;
        multipliers(k, a) += of_node.multiplier_weight;
      }
  }

  template <int dim>
  std::vector<double> ContactFace<dim>::of_free_nodes(const DenseMatrix &interpolation,
                                                      const std::vector<double> &of_nodes) const
  {
    if (interpolation.values.empty())
      return of_nodes;
    std::vector<double> result(free.size());
    for (unsigned int a = 0; a < of_nodes.size(); ++a)
      for (unsigned int k = 0; k < result.size(); ++k)
        result[k] += interpolation(k, a) * of_nodes[a];
    return result;
  }

  template <int dim>
  PairShapes<dim>::PairShapes(const FaceElement<dim> &element, const ContactFace<dim> &rotor_face,
                              const ContactFace<dim> &pad_face, const FacePair<dim> &pair,
                              const Geometry<dim> &geometry, const double angular_velocity,
                              const Tensor<1, 3> *const along)
      : n_points(pair.points.size()), rotor(&rotor_face), pad(&pad_face)
  {
    const unsigned int n_rotor = rotor_face.free.size(), n_pad = pad_face.free.size();
    const bool own_multipliers = !pad_face.multipliers.values.empty();
    on_rotor = d_phi = DenseMatrix(n_rotor, n_points);
    on_pad           = DenseMatrix(n_pad, n_points);
    multipliers      = DenseMatrix(own_multipliers ? n_pad : 0, n_points);
    normals.reserve(n_points);
    directions.reserve(n_points);
    positions.reserve(n_points);
    for (std::vector<double> *values : {&weights, &speeds, &radii})
      values->reserve(n_points);
    std::vector<double> rotor_values, pad_values, turned(element.n_nodes());
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
      for (unsigned int a = 0; a < turned.size(); ++a)
        turned[a] = gradients[a] * turning;
      const auto set = [q](DenseMatrix &matrix, const std::vector<double> &values)
      { std::copy(values.begin(), values.end(), &matrix.values[std::size_t(q) * matrix.n_rows]); };
      set(on_rotor, rotor_face.of_free_nodes(rotor_face.moves, rotor_values));
      set(d_phi, rotor_face.of_free_nodes(rotor_face.moves, turned));
      set(on_pad, pad_face.of_free_nodes(pad_face.moves, pad_values));
      if (own_multipliers)
        set(multipliers, pad_face.of_free_nodes(pad_face.multipliers, pad_values));
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
    const unsigned int n_rotor = on_rotor.n_rows, n_pad = pad->free.size();
    kept = DenseMatrix((n_rotor + n_pad) * dim, n_points);
    for (unsigned int q = 0; q < n_points; ++q)
    {
      const Tensor<1, dim> d = this->direction(direction, q);
      for (unsigned int c = 0; c < dim; ++c)
      {
        for (unsigned int a = 0; a < n_rotor; ++a)
          kept(a * dim + c, q) = on_rotor(a, q) * d[c];
        for (unsigned int a = 0; a < n_pad && on_pad; ++a)
          kept((n_rotor + a) * dim + c, q) = -(*on_pad)(a, q) * d[c];
      }
    }
    return kept;
  }

  template <int dim>
  void ContactKinematics<dim>::add_across(RepeatedEntries &entries, const std::vector<double> &c,
                                          const bool turned_right) const
  {
    const unsigned int n_rotor = shapes->on_rotor.n_rows, n_all = n_rotor + shapes->on_pad.n_rows;
    // Points as rows
    DenseMatrix jump(n_points, n_all), turned(n_points, turned_right ? n_rotor : 0);
    std::vector<Tensor<1, dim>> directions;
    std::array<bool, dim> is_there{}; // a direction across a flat face has fewer components
    for (unsigned int q = 0; q < n_points; ++q)
    {
      for (unsigned int a = 0; a < n_rotor; ++a)
      {
        jump(q, a) = shapes->on_rotor(a, q);
        if (turned_right)
          turned(q, a) = shapes->d_phi(a, q);
      }
      for (unsigned int a = n_rotor; a < n_all; ++a)
        jump(q, a) = -shapes->on_pad(a - n_rotor, q);
      directions.push_back(direction(2, q));
      for (unsigned int i = 0; i < dim; ++i)
        is_there[i] |= directions.back()[i] != 0;
    }
    const DenseMatrix &right = turned_right ? turned : jump;
    DenseMatrix weighted(n_points, n_all), local(n_all, right.n_columns);
    std::vector<double> weights(n_points);
    for (unsigned int i = 0; i < dim; ++i)
      for (unsigned int k = i; k < dim; ++k)
      {
        if (!is_there[i] || !is_there[k])
          continue;
        for (unsigned int q = 0; q < n_points; ++q)
          weights[q] = c[q] * directions[q][i] * directions[q][k];
        for (unsigned int a = 0; a < n_all; ++a)
          for (unsigned int q = 0; q < n_points; ++q)
            weighted(q, a) = weights[q] * jump(q, a);
        gemm<double>(1, weighted.transpose(), right, 0, local.values.data());
        for (unsigned int b = 0; b < right.n_columns && !turned_right; ++b)
          for (unsigned int a = 0; a < b; ++a) // symmetric to the last digit
            local(b, a) = local(a, b);
        for (unsigned int b = 0; b < right.n_columns; ++b)
          for (unsigned int a = 0; a < n_all; ++a)
          {
            entries.add(node(a).equations[i], node(b).equations[k], local(a, b));
            if (i != k)
              entries.add(node(a).equations[k], node(b).equations[i], local(a, b));
          }
      }
  }

  template <int dim>
  void ContactKinematics<dim>::add_slopes(const FaceElement<dim> &element,
                                          const FacePair<dim> &pair, const Geometry<dim> &geometry)
  {
    const unsigned int n_rotor = rotor->free.size(), n_pad = pad->free.size(),
                       n_rows = (n_rotor + n_pad) * dim;
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
        std::vector<double> along_t;
        for (const auto &gradient : gradients)
          along_t.push_back(gradient * t);
        along_t = rotor->of_free_nodes(rotor->moves, along_t);
        for (unsigned int c = 0; c < dim; ++c)
        {
          for (unsigned int a = 0; a < n_rotor; ++a)
          {
            for (unsigned int d = 0; d < dim; ++d)
              slopes[s][d](a * dim + c, q) = along_t[a] * basis[d][c];
            for (unsigned int d = 1; d < dim; ++d)
              moved_w[s](a * dim + c, q) -= shapes->on_rotor(a, q) * change[d] * basis[d][c];
          }
          for (unsigned int a = 0; a < n_pad; ++a)
            for (unsigned int d = 1; d < dim; ++d)
              moved_w[s]((n_rotor + a) * dim + c, q) +=
                  shapes->on_pad(a, q) * change[d] * basis[d][c];
        }
      }
    }
  }

  namespace
  {
    template <int dim>
    using Numbering = unsigned int (FiniteElementSpace<dim>::*)(
        types::global_dof_index) const; ///< of multipliers

    /// The free nodes of a node of a face: weights of displacements, of multipliers, and the node.
    template <int dim>
    std::vector<std::tuple<double, double, types::global_dof_index>>
    weights_of(const FiniteElementSpace<dim> &spaces, const types::global_dof_index node)
    {
      std::vector<std::tuple<double, double, types::global_dof_index>> result;
      const bool own = !spaces.geometry.own.empty();
      for (const WeightedNode &w : spaces.expand(node))
        result.emplace_back(w.weight, own ? 0 : w.weight, w.node);
      if (own)
        for (const WeightedNode &w : spaces.expand_multiplier(node))
        {
          const auto found =
              std::find_if(result.begin(), result.end(),
                           [&](const auto &known) { return std::get<2>(known) == w.node; });
          if (found == result.end())
            result.emplace_back(0, w.weight, w.node);
          else
            std::get<1>(*found) = w.weight;
        }
      return result;
    }

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
                for (const auto &[weight, multiplier_weight, node] :
                     weights_of(spaces, cell_nodes[a]))
                {
                  FreeNode<dim> free_node{weight, multiplier_weight, {}, {}};
                  for (unsigned int c = 0; c < dim; ++c)
                  {
                    free_node.equations[c] = static_cast<int>(spaces.equation(node, c));
                    free_node.moves[c]     = spaces.moves(node, c);
                  }
                  free_node.equations[dim]     = static_cast<int>((spaces.*multiplier)(node));
                  free_node.equations[dim + 1] = static_cast<int>(spaces.stick(node));
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
            flat.push_back(free_node.multiplier_weight);
            flat.insert(flat.end(), free_node.equations.begin(), free_node.equations.end());
            flat.insert(flat.end(), free_node.moves.begin(), free_node.moves.end());
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
            free_node.weight            = *number++;
            free_node.multiplier_weight = *number++;
            for (int &equation : free_node.equations)
              equation = static_cast<int>(*number++);
            for (bool &moves : free_node.moves)
              moves = *number++ != 0;
          }
        }
        face.gather_free_nodes();
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
