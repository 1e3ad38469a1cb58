#include <squeal/base/errors.h>
#include <squeal/joints/points.h>
#include <squeal/mesh/boundary_faces.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/mpi.h>

#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// The matrix of a x (...).
    Tensor<2, 3> cross_matrix(const Tensor<1, 3> &a)
    {
      return Tensor<2, 3>({{0, -a[2], a[1]}, {a[2], 0, -a[0]}, {-a[1], a[0], 0}});
    }

    const UpdateFlags wanted = update_values | update_quadrature_points | update_JxW_values;

    template <typename Value>
    Value sum_of(Value value, const MPI_Comm comm)
    {
      return Utilities::MPI::sum(value, comm);
    }

    /// What defines a point on a surface.
    struct Definition
    {
      double area = 0;
      Point<3> place;
      Tensor<2, 3> moments; ///< J
    };

    Definition measure(const FiniteElementSpace<3> &spaces, const JointPoint &point)
    {
      Definition result;
      Tensor<1, 3> sum;
      for_boundary_faces(spaces, point.surface, wanted,
                         [&](const auto &, const FEFaceValues<3> &values)
                         {
                           for (const unsigned int q : values.quadrature_point_indices())
                           {
                             result.area += values.JxW(q);
                             sum += values.JxW(q) * Tensor<1, 3>(values.quadrature_point(q));
                           }
                         });
      result.area  = sum_of(result.area, spaces.comm);
      result.place = Point<3>(sum_of(sum, spaces.comm) / result.area);
      Tensor<2, 3> moments;
      for_boundary_faces(spaces, point.surface, wanted,
                         [&](const auto &, const FEFaceValues<3> &values)
                         {
                           for (const unsigned int q : values.quadrature_point_indices())
                           {
                             const Tensor<1, 3> x = values.quadrature_point(q) - result.place;
                             for (unsigned int i = 0; i < 3; ++i)
                             {
                               moments[i][i] += values.JxW(q) * x.norm_square();
                               for (unsigned int j = 0; j < 3; ++j)
                                 moments[i][j] -= values.JxW(q) * x[i] * x[j];
                             }
                           }
                         });
      result.moments = sum_of(moments, spaces.comm);
      if (!(determinant(result.moments) > 1e-12 * std::pow(trace(result.moments), 3)))
        throw SolverError("The point '" + point.name +
                          "' has no rotation: its surface is a line (Joints/Points).");
      return result;
    }

    /// Collects the entries of the points' matrices.
    class Assembly
    {
    public:
      Assembly(const FiniteElementSpace<3> &spaces, const double stiffness)
          : spaces(spaces), joints(spaces.geometry.point_joints), scale(stiffness),
            is_first(Utilities::MPI::this_mpi_process(spaces.comm) == 0)
      {
      }

      Points run()
      {
        for (unsigned int p = 0; p < joints.points.size(); ++p)
          if (joints.points[p].surface.empty())
            add_free(p);
          else
            add_definition(p);
        for (unsigned int l = 0; l < joints.links.size(); ++l)
          add_link(joints.points.size() + l, joints.links[l]);
        bool has_mass = false, has_damping = false;
        for (unsigned int p = 0; p < joints.points.size(); ++p)
          for (unsigned int k = 0; k < 6; ++k)
          {
            const double value = joints.points[p].mass[k];
            has_mass           = has_mass || value > 0;
            add(mass, spaces.point(p, k), spaces.point(p, k), value * factor(p, k) * factor(p, k));
          }
        for (const PointConnection &spring : joints.springs)
        {
          add_spring(spring, spring.stiffness, springs);
          add_spring(spring, spring.damping, damping);
          for (const double c : spring.damping)
            has_damping = has_damping || c > 0;
        }
        result.stiffness = made(springs);
        if (has_mass)
          result.mass = made(mass);
        if (has_damping)
          result.damping = made(damping);
        return std::move(result);
      }

    private:
      /// What a motion is of its unknown: a rotation is 1/L of it.
      double factor(const unsigned int p, const unsigned int k) const
      {
        return k < 3 ? 1 : 1 / result.lengths[p];
      }
      std::shared_ptr<const Matrix> made(const EntryList &entries) const
      {
        return std::make_shared<const Matrix>(entries.make_matrix(spaces.rows));
      }
      /// The first rank alone adds what no cell has.
      void add(EntryList &entries, const unsigned int row, const unsigned int column,
               const double value) const
      {
        if (is_first)
          entries.add(row, column, value);
      }
      void add_both(const unsigned int row, const unsigned int column, const double value)
      {
        springs.add(row, column, value);
        springs.add(column, row, value);
      }

      /// A point in space: its motions are not defined by anything else.
      void add_free(const unsigned int p)
      {
        constexpr double length = 0.1; // as brakes have it
        result.places.push_back(joints.points[p].place);
        result.lengths.push_back(length);
        for (unsigned int k = 0; k < 6; ++k)
          add(springs, spaces.point_multiplier(p, k), spaces.point_multiplier(p, k), scale);
      }

      /// 1/|A| int u - r_t = 0,   L J^{-1} int (x - x_c) x u - L r_r = 0.
      void add_definition(const unsigned int p)
      {
        const JointPoint &point = joints.points[p];
        const Definition of     = measure(spaces, point);
        const double length     = std::sqrt(trace(of.moments) / (2 * of.area));
        result.places.push_back(of.place);
        result.lengths.push_back(length);
        const Tensor<2, 3> rotation = length * invert(of.moments);
        std::vector<types::global_dof_index> nodes(spaces.fe.n_dofs_per_cell());
        for_boundary_faces(spaces, point.surface, wanted,
                           [&](const auto &cell, const FEFaceValues<3> &values)
                           {
                             cell->get_dof_indices(nodes);
                             for (unsigned int a = 0; a < nodes.size(); ++a)
                             {
                               double area = 0;
                               Tensor<1, 3> first; // int N (x - x_c)
                               for (const unsigned int q : values.quadrature_point_indices())
                               {
                                 const double w = values.JxW(q) * values.shape_value(a, q);
                                 area += w;
                                 first += w * (values.quadrature_point(q) - of.place);
                               }
                               if (area == 0 && first.norm() == 0)
                                 continue;
                               const Tensor<2, 3> turned = rotation * cross_matrix(first);
                               for (const WeightedNode &w : spaces.expand(nodes[a]))
                                 for (unsigned int c = 0; c < 3; ++c)
                                 {
                                   const unsigned int column = spaces.equation(w.node, c);
                                   if (column == FiniteElementSpace<3>::none)
                                     continue;
                                   add_both(spaces.point_multiplier(p, c), column,
                                            scale * w.weight * area / of.area);
                                   for (unsigned int k = 0; k < 3; ++k)
                                     add_both(spaces.point_multiplier(p, 3 + k), column,
                                              scale * w.weight * turned[k][c]);
                                 }
                             }
                           });
        if (is_first)
          for (unsigned int k = 0; k < 6; ++k)
            add_both(spaces.point_multiplier(p, k), spaces.point(p, k), -scale);
        result.n_active += 6;
      }

      /// r_2t - r_1t - r_1r x (x_2 - x_1) = 0,   r_2r - r_1r = 0; to the ground r_1 = 0.
      void add_link(const unsigned int number, const PointConnection &link)
      {
        result.n_active += 6;
        if (!is_first)
          return;
        const unsigned int a = link.first, b = link.second;
        const double length = result.lengths[a];
        for (unsigned int k = 0; k < 6; ++k)
        {
          const double size      = k < 3 ? scale : scale * length;
          const unsigned int row = spaces.point_multiplier(number, k);
          add_both(row, spaces.point(a, k), -size * factor(a, k));
          if (b != PointConnection::ground)
            add_both(row, spaces.point(b, k), size * factor(b, k));
        }
        if (b == PointConnection::ground)
          return;
        // - r_r x d = d x r_r
        const Tensor<2, 3> arm = cross_matrix(result.places[b] - result.places[a]);
        for (unsigned int i = 0; i < 3; ++i)
          for (unsigned int k = 0; k < 3; ++k)
            add_both(spaces.point_multiplier(number, i), spaces.point(a, 3 + k),
                     scale * arm[i][k] * factor(a, 3 + k));
      }

      /// K (r_1 - r_2) on the first, its opposite on the second, K = sum of k_c a_c a_c^T over the
      /// axes a_c, of displacements and of rotations.
      void add_spring(const PointConnection &spring, const std::array<double, 6> &values,
                      EntryList &entries) const
      {
        std::array<Tensor<2, 3>, 2> stiffness; // along, about
        for (unsigned int k = 0; k < 6; ++k)
          for (unsigned int i = 0; i < 3; ++i)
            for (unsigned int j = 0; j < 3; ++j)
              stiffness[k / 3][i][j] += values[k] * spring.axes[k % 3][i] * spring.axes[k % 3][j];
        for (unsigned int k = 0; k < 6; ++k)
          for (unsigned int l = k / 3 * 3; l < k / 3 * 3 + 3; ++l)
            for (const unsigned int p : {spring.first, spring.second})
              for (const unsigned int q : {spring.first, spring.second})
                if (p != PointConnection::ground && q != PointConnection::ground)
                  add(entries, spaces.point(p, k), spaces.point(q, l),
                      (p == q ? 1 : -1) * stiffness[k / 3][k % 3][l % 3] * factor(p, k) *
                          factor(q, l));
      }

      const FiniteElementSpace<3> &spaces;
      const PointJoints &joints;
      const double scale;
      const bool is_first;
      EntryList springs, damping, mass;
      Points result;
    };
  } // namespace

  template <>
  Points assemble_points(const FiniteElementSpace<3> &spaces, const double stiffness)
  {
    return spaces.has_points() ? Assembly(spaces, stiffness).run() : Points();
  }

  template <>
  Points assemble_points(const FiniteElementSpace<2> &, double)
  {
    return {};
  }
} // namespace squeal
