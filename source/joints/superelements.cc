#include <squeal/contact/contact_kinematics.h>
#include <squeal/joints/superelements.h>
#include <squeal/mesh/finite_element_space.h>
#include <squeal/mesh/nearest_point.h>

#include <deal.II/base/mpi.h>

#include <cmath>
#include <iterator>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Entries of a file in the rows from @p first on.
    void add_file(const MatrixMarketFile &file, const unsigned int first, EntryList &entries)
    {
      for (std::size_t k = 0; k < file.values.size(); ++k)
        entries.add(first + file.rows[k], first + file.columns[k], file.values[k]);
    }

    /// All faces of the surfaces of a superelement, on each rank. Collective.
    std::vector<ContactFace<3>> faces_of(const FiniteElementSpace<3> &spaces,
                                         const FaceElement<3> &element,
                                         const Superelement &superelement)
    {
      std::vector<ContactFace<3>> faces;
      for (const types::boundary_id id : superelement.surface)
      {
        auto sides = gather_surfaces(spaces, element, id, id, &FiniteElementSpace<3>::multiplier);
        std::move(sides.rotor_faces.begin(), sides.rotor_faces.end(), std::back_inserter(faces));
      }
      return faces;
    }

    /// v_n - sum_a N_a(x_n) u_a, scaled, and its transpose. Fixed components of u are zero.
    void hold_nodes(const Superelement &superelement, const FaceElement<3> &element,
                    const std::vector<ContactFace<3>> &faces, const unsigned int first_row,
                    unsigned int multiplier, const double scale, EntryList &entries)
    {
      constexpr double rounding                = 1e-13; // nodes that lie on nodes have no others
      const std::vector<SurfaceFace<3>> shapes = shapes_of(faces);
      const auto add = [&](const unsigned int row, const int column, const double value)
      {
        if (column < 0)
          return;
        entries.add(row, column, scale * value);
        entries.add(column, row, scale * value);
      };
      std::vector<double> weights;
      for (unsigned int n = 0; n < superelement.nodes.size(); ++n)
      {
        if (!superelement.is_held[n])
          continue;
        const NearestPoint nearest = nearest_point(element, shapes, superelement.nodes[n]);
        element.evaluate(nearest.xi, weights);
        for (unsigned int c = 0; c < 3; ++c)
        {
          add(multiplier + c, first_row + 3 * n + c, 1);
          for (unsigned int a = 0; a < weights.size(); ++a)
            if (std::abs(weights[a]) > rounding)
              for (const FreeNode<3> &node : faces[nearest.face].nodes[a])
                add(multiplier + c, node.equations[c], -node.weight * weights[a]);
        }
        multiplier += 3;
      }
    }
  } // namespace

  template <>
  Superelements assemble_superelements(const FiniteElementSpace<3> &spaces, const double stiffness)
  {
    const std::vector<Superelement> &all = spaces.geometry.superelements;
    if (all.empty())
      return {};
    // The first rank, whose rows they have, adds all entries.
    const bool is_first = Utilities::MPI::this_mpi_process(spaces.comm) == 0;
    const FaceElement<3> element(spaces.fe.degree);
    Superelements result;
    EntryList K, M, D, holding;
    bool has_damping = false;
    for (unsigned int k = 0; k < all.size(); ++k)
    {
      const std::vector<ContactFace<3>> faces = faces_of(spaces, element, all[k]);
      result.n_active += 3 * all[k].n_held();
      has_damping = has_damping || !all[k].matrices->damping.values.empty();
      if (!is_first)
        continue;
      const unsigned int row = spaces.superelement(k);
      add_file(all[k].matrices->stiffness, row, K);
      add_file(all[k].matrices->mass, row, M);
      add_file(all[k].matrices->damping, row, D);
      hold_nodes(all[k], element, faces, row, spaces.superelement_multiplier(k), stiffness,
                 holding);
    }
    const auto made = [&](const EntryList &entries)
    { return std::make_shared<const Matrix>(entries.make_matrix(spaces.rows)); };
    result.stiffness = made(K);
    result.mass      = made(M);
    result.holding   = made(holding);
    if (has_damping)
      result.damping = made(D);
    return result;
  }

  template <>
  Superelements assemble_superelements(const FiniteElementSpace<2> &, double)
  {
    return {};
  }
} // namespace squeal
