#include <squeal/bars/second_sides.h>
#include <squeal/joints/ties.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/quadrature_lib.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Nodes of the reference cell on a face, those inside of it alone or all.
    template <int dim>
    std::vector<unsigned int> nodes_on_face(const FiniteElementSpace<dim> &spaces,
                                            const unsigned int face, const bool inside_only)
    {
      const std::vector<Point<dim>> &points = spaces.fe.get_unit_support_points();
      std::vector<unsigned int> result;
      for (unsigned int a = 0; a < points.size(); ++a)
      {
        bool on_face = std::abs(points[a][face / 2] - face % 2) < 1e-12;
        for (unsigned int d = 0; d < dim && inside_only; ++d)
          on_face &= d == face / 2 || std::abs(points[a][d] - 0.5) < 0.5 - 1e-12;
        if (on_face)
          result.push_back(a);
      }
      return result;
    }

    /// Calls function(number of the own cell, cell, face) for this rank's faces of a surface, but
    /// for those of elements with own polynomials, whose residuals stay whole.
    template <int dim, typename Function>
    void for_each_own_face(const FiniteElementSpace<dim> &spaces, const types::boundary_id boundary,
                           const Function &function)
    {
      unsigned int number = 0;
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          for (const unsigned int f : cell->face_indices())
            if (cell->face(f)->at_boundary() && cell->face(f)->boundary_id() == boundary &&
                !(cell->level() == 0 && spaces.geometry.own.has(cell->index())))
              function(number, cell, f);
          ++number;
        }
    }

    template <int dim>
    double area_of(const FaceElement<dim> &element, const SurfaceFace<dim> &face)
    {
      const QGauss<dim - 1> points(element.degree() + 1);
      double area = 0;
      for (unsigned int q = 0; q < points.size(); ++q)
        area += points.weight(q) * element.frame(face, points.point(q)).measure;
      return area;
    }

    /// Two surfaces that move together, paired: in which directions, and which parts do.
    template <int dim>
    struct Joined
    {
      types::boundary_id first, second;
      PairedInterface<dim> sides;
      bool unilateral, along_normal_only;
    };

    template <int dim>
    std::vector<Joined<dim>> joined_surfaces(const FiniteElementSpace<dim> &spaces,
                                             const FaceElement<dim> &element,
                                             const Contact<dim> *contact)
    {
      std::vector<Joined<dim>> result;
      for (const TiedSurfaces &tie : spaces.geometry.ties)
        result.push_back({tie.side, tie.other, pair_tie(spaces, element, tie), false, false});
      for (unsigned int i = 0; contact && i < contact->paired_interfaces().size(); ++i)
        if (!contact->slides(i))
        {
          const ContactInterface &description = spaces.geometry.interfaces[i];
          result.push_back({description.pad_face, description.rotor_face,
                            contact->paired_interfaces()[i], true, !contact->sticks(i)});
        }
      return result;
    }
  } // namespace

  template <int dim>
  SecondSides<dim>::SecondSides(const FiniteElementSpace<dim> &spaces, const Contact<dim> *contact,
                                const std::vector<std::vector<double>> &resistances)
  {
    const FaceElement<dim> element(spaces.fe.degree);
    const std::vector<Joined<dim>> joints = joined_surfaces(spaces, element, contact);
    if (joints.empty())
      return;
    const unsigned int n = spaces.fe.n_dofs_per_cell();
    std::vector<types::global_dof_index> nodes(n);

    // A node inside of a face stands for the face, and has its resistance: by equation, since
    // pairs are not on the ranks of their cells.
    std::vector<double> resistance(spaces.rows.size), opposite(spaces.rows.size);
    for (const Joined<dim> &joint : joints)
      for_each_own_face(spaces, joint.first,
                        [&](const unsigned int number, const auto &cell, const unsigned int f)
                        {
                          if (resistances[number].empty()) // part of an element with own functions
                            return;
                          cell->get_dof_indices(nodes);
                          for (const unsigned int a : nodes_on_face(spaces, f, true))
                            for (unsigned int c = 0; c < dim; ++c)
                              if (const unsigned int row = spaces.equation(nodes[a], c);
                                  row != FiniteElementSpace<dim>::none)
                                resistance[row] = resistances[number][c * n + a];
                        });
    MPI_Allreduce(MPI_IN_PLACE, resistance.data(), resistance.size(), MPI_DOUBLE, MPI_MAX,
                  spaces.comm);

    // The first node inside of a face, lexicographic
    const unsigned int inside = dim == 3 ? element.degree() + 2 : 1;
    for (const Joined<dim> &joint : joints)
      for (const FacePair<dim> &pair : joint.sides.pairs)
      {
        const ContactFace<dim> &first  = joint.sides.pad_faces[pair.pad_face],
                               &second = joint.sides.rotor_faces[pair.rotor_face];
        const FreeNode<dim> &from = first.nodes[inside].front(), &to = second.nodes[inside].front();
        if (joint.unilateral && !contact->is_active(from))
          continue;
        const double area = area_of(element, first.shape);
        for (const PairedPoint<dim> &point : pair.points)
        {
          const Tensor<1, dim> normal = element.frame(first.shape, point.xi_pad).normal;
          for (unsigned int c = 0; c < dim; ++c)
            if (from.equations[c] >= 0 && to.equations[c] >= 0)
              opposite[to.equations[c]] += point.weight / area * resistance[from.equations[c]] *
                                           (joint.along_normal_only ? normal[c] * normal[c] : 1.);
        }
      }
    MPI_Allreduce(MPI_IN_PLACE, opposite.data(), opposite.size(), MPI_DOUBLE, MPI_SUM, spaces.comm);

    for (const Joined<dim> &joint : joints)
      for_each_own_face(
          spaces, joint.second,
          [&](const unsigned int number, const auto &cell, const unsigned int f)
          {
            if (resistances[number].empty())
              return;
            cell->get_dof_indices(nodes);
            const unsigned int a = nodes_on_face(spaces, f, true).front();
            for (unsigned int c = 0; c < dim; ++c)
            {
              const unsigned int row = spaces.equation(nodes[a], c);
              if (row == FiniteElementSpace<dim>::none || opposite[row] == 0)
                continue;
              const double own = resistances[number][c * n + a];
              for (const unsigned int b : nodes_on_face(spaces, f, false))
                factors.push_back({number, c * n + b, std::sqrt(own / (own + opposite[row]))});
            }
          });
  }

  template <int dim>
  void SecondSides<dim>::reduce(std::vector<std::vector<double>> &shares) const
  {
    for (const Factor &factor : factors)
      shares[factor.cell][factor.unknown] *= factor.value;
  }

  template class SecondSides<2>;
  template class SecondSides<3>;
} // namespace squeal
