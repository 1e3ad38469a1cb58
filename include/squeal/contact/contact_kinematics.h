#pragma once

#include <squeal/linalg/compressed_rows.h>
#include <squeal/linalg/dense.h>
#include <squeal/mesh/geometry.h>
#include <squeal/mesh/mortar.h>

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

// What a pair of contact faces knows of sliding (theory.md, section 3). FreeNode and ContactFace
// are a face's nodes with their equations; PairShapes has the shape functions of both faces at the
// points that the pair shares; ContactKinematics makes of them, when they are asked for, the traces
// [[u]].n, [[u]].e, [[u]].b and their derivatives along the turning as matrices (unknowns by
// points), and distributes products of two traces over the unknowns. PairedInterface holds all
// pairs of a pad and the rotor, or of two bodies that stick.

namespace squeal
{
  template <int dim>
  class FiniteElementSpace;

  /// A node that carries unknowns, as a node of a contact face sees it.
  template <int dim>
  struct FreeNode
  {
    double weight;            ///< of its displacements
    double multiplier_weight; ///< of its pressure and tractions
    /// Displacement components, multiplier (of a tie: the first of dim), the first of the dim - 1
    /// tangential ones of a stick contact; -1: none
    std::array<int, dim + 2> equations;
    /// Components in which the node moves, by an equation of its own or with other nodes: those of
    /// pressures need not be those of displacements.
    std::array<bool, dim> moves;

    /// The equation of the pressure (0) or of the tangential traction along e (1) or b (2), or -1.
    int multiplier(const unsigned int direction) const
    {
      return direction == 0           ? equations[dim]
             : equations[dim + 1] < 0 ? -1
                                      : equations[dim + 1] + int(direction) - 1;
    }
  };

  /// A face with the equations of its nodes: each node is interpolated from free nodes.
  template <int dim>
  struct ContactFace
  {
    SurfaceFace<dim> shape;
    std::vector<std::vector<FreeNode<dim>>> nodes;
    /// The free nodes of all its nodes, each once, with weights 1, and where they are others: the
    /// interpolation of the nodes' displacements and multipliers, (free node, node).
    std::vector<FreeNode<dim>> free;
    DenseMatrix moves, multipliers;
    /// Makes these of the nodes.
    void gather_free_nodes();
    /// Values of the free nodes' functions out of those of the nodes.
    std::vector<double> of_free_nodes(const DenseMatrix &interpolation,
                                      const std::vector<double> &of_nodes) const;
    /// How often a cell of the coarse mesh was divided until it had the face.
    unsigned int level = 0;
  };

  /// The direction in the surface with that normal that is nearest to @p along, which is not
  /// normal to it.
  template <int dim>
  dealii::Tensor<1, dim> direction_in_surface(const dealii::Tensor<1, dim> &normal,
                                              const dealii::Tensor<1, 3> &along);

  /// b = n x e; zero in 2D.
  template <int dim>
  dealii::Tensor<1, dim> binormal_of(const dealii::Tensor<1, dim> &normal,
                                     const dealii::Tensor<1, dim> &direction);

  /// What the kinematics on one pair of faces are made of: shape functions of both faces and the
  /// directions at the pair's quadrature points. Less than a seventh of the kinematics themselves.
  template <int dim>
  struct PairShapes
  {
    unsigned int n_points = 0, first_point = 0;
    DenseMatrix on_rotor, on_pad; ///< (free node, point)
    DenseMatrix multipliers;      ///< of the pad's free nodes; empty: as on_pad
    DenseMatrix d_phi;            ///< of the rotor's shape functions, along the transport field
    std::vector<dealii::Tensor<1, dim>> normals, directions; ///< n, e
    std::vector<double> weights, speeds, radii;
    std::vector<dealii::Point<dim>> positions;
    const ContactFace<dim> *rotor = nullptr, *pad = nullptr;

    /// Where nothing slides, @p along has e as its direction in the surface.
    PairShapes(const FaceElement<dim> &element, const ContactFace<dim> &rotor_face,
               const ContactFace<dim> &pad_face, const FacePair<dim> &pair,
               const Geometry<dim> &geometry, double angular_velocity,
               const dealii::Tensor<1, 3> *along = nullptr);
  };

  /// The displacement jump and its parts on one pair of faces, as rows over the local displacements
  /// (rotor nodes, then pad nodes; components within) and columns over the pair's quadrature
  /// points: jump(u).b = sum_i b(i, q) u_i for the direction b. Made when first asked for, and
  /// kept.
  template <int dim>
  struct ContactKinematics
  {
    const std::shared_ptr<const PairShapes<dim>> shapes;
    const unsigned int n_points, first_point;
    const DenseMatrix &psi; ///< multiplier's shape functions of the pad face
    const std::vector<double> &weights, &speeds, &radii;
    const std::vector<dealii::Point<dim>> &positions;
    const ContactFace<dim> *const rotor, *const pad;
    /// For the turning of the directions: slopes[a][c] = (d_a u_R).c with a in {e, b} and c in {n,
    /// e, b}, and the change -W [[.]]_tangential of the transport field w, W = grad w, where the
    /// contact point moves along the rotor: its components along e and b. Empty unless asked for.
    std::array<std::array<DenseMatrix, 3>, 2> slopes;
    std::array<DenseMatrix, 2> moved_w;

    explicit ContactKinematics(std::shared_ptr<const PairShapes<dim>> given)
        : shapes(std::move(given)), n_points(shapes->n_points), first_point(shapes->first_point),
          psi(shapes->multipliers.values.empty() ? shapes->on_pad : shapes->multipliers),
          weights(shapes->weights), speeds(shapes->speeds), radii(shapes->radii),
          positions(shapes->positions), rotor(shapes->rotor), pad(shapes->pad)
    {
    }
    ContactKinematics(const FaceElement<dim> &element, const ContactFace<dim> &rotor_face,
                      const ContactFace<dim> &pad_face, const FacePair<dim> &pair,
                      const Geometry<dim> &geometry, double angular_velocity)
        : ContactKinematics(std::make_shared<const PairShapes<dim>>(
              element, rotor_face, pad_face, pair, geometry, angular_velocity))
    {
    }

    /// [[.]].n
    const DenseMatrix &n() const
    {
      return jump_along(0);
    }
    /// [[.]].e
    const DenseMatrix &e() const
    {
      return jump_along(1);
    }
    /// [[.]].b with b = n x e; empty in 2D.
    const DenseMatrix &b() const
    {
      return jump_along(2);
    }
    /// n (0), e (1) or b (2) at a point.
    dealii::Tensor<1, dim> direction(unsigned int number, unsigned int q) const;
    /// (d_phi u_R).e
    const DenseMatrix &e_phi() const
    {
      return slope_along(1);
    }
    /// (d_phi u_R).b; empty in 2D.
    const DenseMatrix &b_phi() const
    {
      return slope_along(2);
    }

    /// Makes slopes and moved_w.
    void add_slopes(const FaceElement<dim> &element, const FacePair<dim> &pair,
                    const Geometry<dim> &geometry);

    /// Distributes a local matrix over displacements x displacements.
    void add(EntryList &entries, const DenseMatrix &local) const
    {
      for_nodes(
          [&](const unsigned int a, const FreeNode<dim> &row)
          {
            for_nodes(
                [&](const unsigned int b, const FreeNode<dim> &column)
                {
                  for (unsigned int i = 0; i < dim; ++i)
                    for (unsigned int k = 0; k < dim; ++k)
                      entries.add(row.equations[i], column.equations[k],
                                  local(a * dim + i, b * dim + k));
                });
          });
    }

    /// Distributes a local matrix over displacements x multipliers, pressures or tangential
    /// tractions (FreeNode::multiplier), and its transpose on demand. Only active multipliers
    /// (flags by equation) couple.
    void add_coupling(EntryList &entries, const DenseMatrix &local, const std::vector<bool> &active,
                      const bool transpose_too, const unsigned int direction = 0) const
    {
      for_nodes(
          [&](const unsigned int a, const FreeNode<dim> &row)
          {
            for (unsigned int m = 0; m < pad->free.size(); ++m)
              for (unsigned int i = 0; i < dim && is_active(active, pad->free[m], direction); ++i)
              {
                const int column   = pad->free[m].multiplier(direction);
                const double value = local(a * dim + i, m);
                entries.add(row.equations[i], column, value);
                if (transpose_too)
                  entries.add(column, row.equations[i], value);
              }
          });
    }

    /// Distributes a local matrix over active multipliers x active multipliers.
    void add_multipliers(EntryList &entries, const DenseMatrix &local,
                         const std::vector<bool> &active) const
    {
      for (unsigned int a = 0; a < pad->free.size(); ++a)
        for (unsigned int b = 0; b < pad->free.size() && is_active(active, pad->free[a]); ++b)
          if (is_active(active, pad->free[b]))
            entries.add(pad->free[a].equations[dim], pad->free[b].equations[dim], local(a, b));
    }

    static bool is_active(const std::vector<bool> &active, const FreeNode<dim> &node,
                          const unsigned int direction = 0)
    {
      const int row = node.multiplier(direction);
      return row >= 0 && active[row];
    }

    /// Adds the local forces sum_q c_q rows(:, q) on the displacements to a list of vector entries.
    void add_forces(std::vector<PetscInt> &equations, std::vector<double> &values,
                    const DenseMatrix &rows, const std::vector<double> &c) const
    {
      for_nodes(
          [&](const unsigned int a, const FreeNode<dim> &node)
          {
            for (unsigned int i = 0; i < dim; ++i)
            {
              double force = 0;
              for (unsigned int q = 0; q < n_points; ++q)
                force += rows(a * dim + i, q) * c[q];
              equations.push_back(node.equations[i]);
              values.push_back(force);
            }
          });
    }

    /// sum_i rows(i, q) local_i at every point.
    std::vector<double> at_points(const DenseMatrix &rows, const std::vector<double> &local) const
    {
      std::vector<double> result(n_points);
      for (unsigned int q = 0; q < n_points; ++q)
        for (unsigned int i = 0; i < rows.n_rows; ++i)
          result[q] += rows(i, q) * local[i];
      return result;
    }

    template <typename Function>
    void for_nodes(const Function &function) const
    {
      for (unsigned int a = 0; a < rotor->free.size() + pad->free.size(); ++a)
        function(a, node(a));
    }

    /// sum_q c_q left(:, q) right(:, q)^T, of rows that do not vanish.
    DenseMatrix product(const DenseMatrix &left, const std::vector<double> &c,
                        const DenseMatrix &right) const
    {
      const std::vector<unsigned int> left_rows = rows_of(left), right_rows = rows_of(right);
      DenseMatrix scaled(n_points, left_rows.size()), transposed(n_points, right_rows.size()),
          result(left.n_rows, right.n_rows);
      for (unsigned int i = 0; i < left_rows.size(); ++i)
        for (unsigned int q = 0; q < n_points; ++q)
          scaled(q, i) = c[q] * left(left_rows[i], q);
      for (unsigned int i = 0; i < right_rows.size(); ++i)
        for (unsigned int q = 0; q < n_points; ++q)
          transposed(q, i) = right(right_rows[i], q);
      const DenseMatrix dense = scaled.transpose() * transposed;
      for (unsigned int j = 0; j < right_rows.size(); ++j)
        for (unsigned int i = 0; i < left_rows.size(); ++i)
          result(left_rows[i], right_rows[j]) = dense(i, j);
      return result;
    }

    /// Distributes sum_q c_q ([[.]].b) ([[.]].b)^T over displacements x displacements, or with
    /// (d_phi u_R).b on the right: the same places whatever c is. Block by block of components,
    ///     int c b_i b_k N_a N_b,
    /// which is the same for i, k and for k, i.
    void add_across(RepeatedEntries &entries, const std::vector<double> &c,
                    const bool turned_right) const;

    /// The local multipliers out of a replicated vector; with flags by equation those that are
    /// active, zero for the others.
    std::vector<double> local_multipliers(const std::vector<double> &global,
                                          const std::vector<bool> *active = nullptr,
                                          const unsigned int direction    = 0) const
    {
      std::vector<double> local(psi.n_rows);
      for (unsigned int m = 0; m < pad->free.size(); ++m)
        if (active ? is_active(*active, pad->free[m], direction)
                   : pad->free[m].multiplier(direction) >= 0)
          local[m] = global[pad->free[m].multiplier(direction)];
      return local;
    }

    /// The local displacements out of a replicated vector.
    std::vector<double> local_values(const std::vector<double> &global) const
    {
      std::vector<double> local((rotor->free.size() + pad->free.size()) * dim);
      for_nodes(
          [&](const unsigned int a, const FreeNode<dim> &node)
          {
            for (unsigned int c = 0; c < dim; ++c)
              if (node.equations[c] >= 0)
                local[a * dim + c] = global[node.equations[c]];
          });
      return local;
    }

  private:
    /// The rows that do not vanish: directions in or across a flat face have such components.
    static std::vector<unsigned int> rows_of(const DenseMatrix &a)
    {
      std::vector<char> is_there(a.n_rows);
      for (unsigned int q = 0; q < a.n_columns; ++q)
        for (unsigned int i = 0; i < a.n_rows; ++i)
          is_there[i] |= a(i, q) != 0;
      std::vector<unsigned int> rows;
      for (unsigned int i = 0; i < a.n_rows; ++i)
        if (is_there[i])
          rows.push_back(i);
      return rows;
    }
    /// Rotor nodes, then pad nodes.
    const FreeNode<dim> &node(const unsigned int a) const
    {
      const unsigned int n_rotor = rotor->free.size();
      return a < n_rotor ? rotor->free[a] : pad->free[a - n_rotor];
    }
    /// Directions are 0: n, 1: e, 2: b.
    const DenseMatrix &jump_along(const unsigned int direction) const
    {
      return along(direction, shapes->on_rotor, &shapes->on_pad, jumps[direction]);
    }
    const DenseMatrix &slope_along(const unsigned int direction) const
    {
      return along(direction, shapes->d_phi, nullptr, turning_slopes[direction]);
    }
    /// The component of (node, point) values on the rotor minus those on the pad, if any.
    const DenseMatrix &along(unsigned int direction, const DenseMatrix &on_rotor,
                             const DenseMatrix *on_pad, DenseMatrix &kept) const;
    mutable std::array<DenseMatrix, 3> jumps, turning_slopes;
  };

  /// One pad against the rotor, or one body against another: this rank's share of the pad's faces,
  /// all faces of the rotor's side, their common quadrature.
  template <int dim>
  struct PairedInterface
  {
    std::string name;
    ContactKind kind = ContactKind::sliding;
    dealii::Tensor<1, 3> along; ///< where nothing slides, e is its direction in the surface
    double friction = 0;        ///< that a stick contact may need; zero: not known
    std::vector<ContactFace<dim>> pad_faces, rotor_faces;
    std::vector<FacePair<dim>> pairs;
  };

  /// The faces of two surfaces, the first shared among the ranks, the second as a whole on each:
  /// the ghost cells of a distributed mesh do not contain the opposite surface. Each rank gets as
  /// many of the first's faces as the others, whoever owns the cells: a pad is often one rank's. @p
  /// multiplier is the member of the space that numbers the multipliers. Collective.
  template <int dim>
  PairedInterface<dim> gather_surfaces(
      const FiniteElementSpace<dim> &spaces, const FaceElement<dim> &element,
      dealii::types::boundary_id first, dealii::types::boundary_id second,
      unsigned int (FiniteElementSpace<dim>::*multiplier)(dealii::types::global_dof_index) const);

  /// The shapes of faces.
  template <int dim>
  std::vector<SurfaceFace<dim>> shapes_of(const std::vector<ContactFace<dim>> &faces);

  /// Pairs the contact surfaces of a scene. Collective.
  template <int dim>
  std::vector<PairedInterface<dim>> pair_interfaces(const FiniteElementSpace<dim> &spaces,
                                                    const FaceElement<dim> &element);
} // namespace squeal
