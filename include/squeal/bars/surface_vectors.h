#pragma once

#include <squeal/contact/contact_products.h>
#include <squeal/mesh/cell_map.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

namespace squeal
{
  /// Many vectors on the surfaces in contact: their values at the points of a pair of faces, and
  /// sums of what acts there. The contact's products applied to them need no matrix, which would
  /// have one entry for each two nodes that see each other across the surface, and no vectors of
  /// all unknowns.
  template <int dim>
  class SurfaceVectors
  {
  public:
    using Kinematics = ContactKinematics<dim>;

    /// Some columns of the given vectors. Collective.
    SurfaceVectors(const Contact<dim> &contact, const MultiVector &vectors,
                   const unsigned int first, const unsigned int n)
        : contact(contact), first(first), rows(rows_of(contact)),
          values(gather_rows(vectors.columns(first, n), rows)), sums(n, rows.size()),
          place(contact.spaces().rows.size, 0)
    {
      for (unsigned int r = 0; r < rows.size(); ++r)
        place[rows[r]] = r;
    }

    /// The vectors' traces on a pair: one row for each vector, one column for each point.
    DenseMatrix traces(const Trace trace, const Kinematics &k) const
    {
      const Functions &functions = functions_on(trace, k);
      DenseMatrix local(values.n_rows, functions.unknowns.size());
      for (unsigned int u = 0; u < functions.unknowns.size(); ++u)
        for_free_nodes(
            functions.unknowns[u], trace, k,
            [&](const unsigned int row)
            { add_multiple(1., &values.values[row * size()], size(), &local.values[u * size()]); });
      return local * functions.at_points;
    }

    /// Adds the forces that act on a trace at the points, one row for each vector.
    void add(const Trace trace, const Kinematics &k, const DenseMatrix &at_points)
    {
      const Functions &functions = functions_on(trace, k);
      const DenseMatrix local    = at_points * functions.at_points.transpose();
      for (unsigned int u = 0; u < functions.unknowns.size(); ++u)
        for_free_nodes(
            functions.unknowns[u], trace, k,
            [&](const unsigned int row)
            { add_multiple(1., &local.values[u * size()], size(), &sums.values[row * size()]); });
    }

    /// Adds the sums of all ranks to this rank's rows of the columns that the vectors were in.
    /// Collective.
    void add_to(std::vector<Column> &columns)
    {
      const RowRange &range = contact.spaces().rows;
      MPI_Allreduce(MPI_IN_PLACE, sums.values.data(), sums.values.size(), MPI_DOUBLE, MPI_SUM,
                    range.comm);
      for (unsigned int j = 0; j < sums.n_rows; ++j)
        for (unsigned int r = 0; r < rows.size(); ++r)
          if (range.contains(rows[r]))
            columns[first + j].local_element(rows[r] - range.begin) += sums(j, r);
      std::fill(sums.values.begin(), sums.values.end(), 0.);
    }

  private:
    /// Functions of a trace that do not vanish: directions in or across a flat face have components
    /// that do.
    struct Functions
    {
      Functions() = default;
      Functions(const Trace trace, const Kinematics &k)
      {
        const DenseMatrix &all = functions_of(trace, k);
        std::vector<char> is_there(all.n_rows);
        for (unsigned int q = 0; q < all.n_columns; ++q)
          for (unsigned int i = 0; i < all.n_rows; ++i)
            is_there[i] |= all(i, q) != 0;
        for (unsigned int i = 0; i < all.n_rows; ++i)
          if (is_there[i])
            unknowns.push_back(i);
        at_points = DenseMatrix(unknowns.size(), all.n_columns);
        for (unsigned int q = 0; q < all.n_columns; ++q)
          for (unsigned int u = 0; u < unknowns.size(); ++u)
            at_points(u, q) = all(unknowns[u], q);
      }
      std::vector<unsigned int> unknowns; ///< of the pair, local numbers
      DenseMatrix at_points;
    };

    /// Finds the functions of a trace. They stay while the pair does: traces and forces need them.
    const Functions &functions_on(const Trace trace, const Kinematics &k) const
    {
      if (pair != k.shapes)
        functions = {};
      pair         = k.shapes;
      Functions &f = functions[static_cast<unsigned int>(trace)];
      if (f.unknowns.empty())
        f = Functions(trace, k);
      return f;
    }

    std::size_t size() const
    {
      return values.n_rows;
    }

    /// Calls visit(place of the row) if a local unknown has one that counts.
    template <typename Visit>
    void for_free_nodes(const unsigned int unknown, const Trace trace, const Kinematics &k,
                        const Visit &visit) const
    {
      const bool multiplies      = is_multiplier(trace);
      const unsigned int n_rotor = k.rotor->free.size(),
                         number  = multiplies ? n_rotor + unknown : unknown / dim;
      const FreeNode<dim> &node =
          number < n_rotor ? k.rotor->free[number] : k.pad->free[number - n_rotor];
      const int row =
          multiplies ? node.multiplier(multiplier_of(trace)) : node.equations[unknown % dim];
      if (row >= 0 && (!multiplies || contact.is_closed(row)))
        visit(place[row]);
    }

    /// The equations of all nodes of the paired faces, ascending, the same on all ranks.
    static std::vector<unsigned int> rows_of(const Contact<dim> &contact)
    {
      std::vector<unsigned int> rows;
      const auto add_nodes = [&](const ContactFace<dim> &face)
      {
        for (const std::vector<FreeNode<dim>> &nodes : face.nodes)
          for (const FreeNode<dim> &node : nodes)
          {
            for (unsigned int c = 0; c < dim; ++c)
              if (node.equations[c] >= 0)
                rows.push_back(node.equations[c]);
            for (unsigned int direction = 0; direction < dim; ++direction)
              if (const int row = node.multiplier(direction); row >= 0)
                rows.push_back(row);
          }
      };
      const auto make_unique = [&]
      {
        std::sort(rows.begin(), rows.end());
        rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
      };
      for (const PairedInterface<dim> &interface : contact.paired_interfaces())
        for (const FacePair<dim> &pair : interface.pairs)
        {
          add_nodes(interface.rotor_faces[pair.rotor_face]);
          add_nodes(interface.pad_faces[pair.pad_face]);
        }
      make_unique();
      gather(rows, MPI_UNSIGNED, contact.spaces().comm);
      make_unique();
      return rows;
    }

    const Contact<dim> &contact;
    const unsigned int first;
    const std::vector<unsigned int> rows;
    const DenseMatrix values; ///< one column for each of these rows
    DenseMatrix sums;
    std::vector<unsigned int> place; ///< among the rows, by equation
    mutable std::shared_ptr<const PairShapes<dim>> pair;
    mutable std::array<Functions, 8> functions; ///< of that pair, by trace
  };
} // namespace squeal
