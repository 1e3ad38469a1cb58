#include <squeal/contact/contact_kinematics.h>
#include <squeal/joints/ties.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/mpi.h>

#include <vector>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Whether the traction has that component at a node of the first side: no support holds it.
    template <int dim>
    bool is_active(const FreeNode<dim> &node, const unsigned int component)
    {
      return node.equations[dim] >= 0 && node.moves[component];
    }

    /// Adds the factor times int Psi_m N_a of the nodes of one face to both blocks.
    template <int dim>
    void add_face(const ContactFace<dim> &face, const ContactFace<dim> &first,
                  const DenseMatrix &products, const double factor, EntryList &entries)
    {
      for (unsigned int m = 0; m < first.free.size(); ++m)
        for (unsigned int a = 0; a < face.free.size(); ++a)
          for (unsigned int c = 0; c < dim; ++c)
            if (is_active(first.free[m], c) && face.free[a].equations[c] >= 0)
            {
              const int moved = face.free[a].equations[c], traction = first.free[m].equations[dim];
              const double value = factor * products(a, m);
              entries.add(moved, traction + c, value);
              entries.add(traction + c, moved, value);
            }
    }

    /// The sum of w N_a Psi_m over points: (node, multiplier).
    DenseMatrix products_of(const std::vector<double> &weights,
                            const std::vector<std::vector<double>> &shapes,
                            const std::vector<std::vector<double>> &psi)
    {
      const unsigned int n = weights.size(), n_nodes = shapes[0].size(), n_psi = psi[0].size();
      DenseMatrix result(n_nodes, n_psi);
      for (unsigned int q = 0; q < n; ++q)
        for (unsigned int m = 0; m < n_psi; ++m)
          for (unsigned int a = 0; a < n_nodes; ++a)
            result(a, m) += weights[q] * shapes[q][a] * psi[q][m];
      return result;
    }

    /// B and B^T.
    template <int dim>
    EntryList couplings(const FiniteElementSpace<dim> &spaces, const double scale)
    {
      const FaceElement<dim> element(spaces.fe.degree);
      EntryList entries;
      for (const TiedSurfaces &tie : spaces.geometry.ties)
      {
        const PairedInterface<dim> sides = pair_tie(spaces, element, tie);
        for (const FacePair<dim> &pair : sides.pairs)
        {
          const unsigned int n_points = pair.points.size();
          std::vector<double> weights(n_points);
          std::vector<std::vector<double>> on_first(n_points), on_second(n_points), psi(n_points);
          const ContactFace<dim> &first  = sides.pad_faces[pair.pad_face],
                                 &second = sides.rotor_faces[pair.rotor_face];
          for (unsigned int q = 0; q < n_points; ++q)
          {
            weights[q] = pair.points[q].weight;
            element.evaluate(pair.points[q].xi_pad, on_first[q]);
            element.evaluate(pair.points[q].xi_rotor, on_second[q]);
            psi[q]       = first.of_free_nodes(first.multipliers, on_first[q]);
            on_first[q]  = first.of_free_nodes(first.moves, on_first[q]);
            on_second[q] = second.of_free_nodes(second.moves, on_second[q]);
          }
          add_face(first, first, products_of(weights, on_first, psi), -scale, entries);
          add_face(second, first, products_of(weights, on_second, psi), scale, entries);
        }
      }
      return entries;
    }
  } // namespace

  template <int dim>
  PairedInterface<dim> pair_tie(const FiniteElementSpace<dim> &spaces,
                                const FaceElement<dim> &element, const TiedSurfaces &tie)
  {
    PairedInterface<dim> sides =
        gather_surfaces(spaces, element, tie.side, tie.other, &FiniteElementSpace<dim>::tie);
    sides.pairs = pair_facing_surfaces(element, shapes_of(sides.pad_faces),
                                       shapes_of(sides.rotor_faces), tie.distance);
    return sides;
  }

  template <int dim>
  Ties assemble_ties(const FiniteElementSpace<dim> &spaces, const double stiffness)
  {
    if (!spaces.has_ties())
      return {};
    const Matrix unscaled = couplings(spaces, 1.).make_matrix(spaces.rows);
    Ties scaled;
    scaled.scale     = stiffness / unscaled.infinity_norm();
    scaled.stiffness = stiffness;
    return assemble_ties_as(scaled, spaces);
  }

  template <int dim>
  Ties assemble_ties_as(const Ties &given, const FiniteElementSpace<dim> &spaces)
  {
    if (!spaces.has_ties())
      return {};
    Ties ties;
    ties.scale        = given.scale;
    ties.stiffness    = given.stiffness;
    EntryList entries = couplings(spaces, ties.scale);
    for (const auto node : spaces.nodes.locally_owned_dofs())
      if (const unsigned int row = spaces.tie(node); row != FiniteElementSpace<dim>::none)
        for (unsigned int c = 0; c < dim; ++c)
        {
          const bool is_fixed = !spaces.moves(node, c);
          ties.n_active += !is_fixed;
          if (is_fixed)
            entries.add(row + c, row + c, ties.stiffness);
        }
    ties.matrix   = std::make_shared<const Matrix>(entries.make_matrix(spaces.rows));
    ties.n_active = Utilities::MPI::sum(ties.n_active, spaces.comm);
    return ties;
  }

  template PairedInterface<2> pair_tie(const FiniteElementSpace<2> &, const FaceElement<2> &,
                                       const TiedSurfaces &);
  template PairedInterface<3> pair_tie(const FiniteElementSpace<3> &, const FaceElement<3> &,
                                       const TiedSurfaces &);
  template Ties assemble_ties(const FiniteElementSpace<2> &, double);
  template Ties assemble_ties(const FiniteElementSpace<3> &, double);
  template Ties assemble_ties_as(const Ties &, const FiniteElementSpace<2> &);
  template Ties assemble_ties_as(const Ties &, const FiniteElementSpace<3> &);
} // namespace squeal
