#include <squeal/equations/mirror.h>
#include <squeal/equations/term_list.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/mpi.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/grid/grid_tools.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Numbers of each item of a rank (a node, a cell), one after the other, of all ranks.
    template <std::size_t width>
    std::vector<std::array<double, width>> gather_all(std::vector<std::array<double, width>> items,
                                                      const MPI_Comm comm)
    {
      MPI_Datatype item = MPI_DATATYPE_NULL;
      MPI_Type_contiguous(width, MPI_DOUBLE, &item);
      MPI_Type_commit(&item);
      gather(items, item, comm);
      MPI_Type_free(&item);
      return items;
    }

    /// For each item, whose first numbers are its place and its kind (odd: of the rotor), the
    /// number of its mirror image about z = @p plane; empty if one has none, or several. (On the
    /// contact surfaces nodes of rotor and pad stand at one place.)
    template <std::size_t width>
    std::vector<unsigned int> find_images(const std::vector<std::array<double, width>> &items,
                                          const double plane, const double tolerance)
    {
      using Item = std::array<double, width>;
      // Along a direction that no mesh is aligned with, few items are as far as another.
      const auto coordinate = [](const Item &item)
      { return 0.7548 * item[0] + 0.5698 * item[1] + 0.3247 * item[2]; };
      std::vector<std::pair<double, unsigned int>> sorted;
      for (unsigned int i = 0; i < items.size(); ++i)
        sorted.emplace_back(coordinate(items[i]), i);
      std::sort(sorted.begin(), sorted.end());

      std::vector<unsigned int> images;
      for (const Item &item : items)
      {
        Item wanted          = item;
        wanted[2]            = 2 * plane - item[2];
        const double t       = coordinate(wanted);
        unsigned int n_found = 0;
        for (auto candidate = std::lower_bound(sorted.begin(), sorted.end(),
                                               std::make_pair(t - 2 * tolerance, 0u));
             candidate != sorted.end() && candidate->first <= t + 2 * tolerance; ++candidate)
        {
          const Item &other = items[candidate->second];
          if (other[3] == wanted[3] && std::hypot(other[0] - wanted[0], other[1] - wanted[1],
                                                  other[2] - wanted[2]) <= tolerance)
          {
            if (n_found == 0)
              images.push_back(candidate->second);
            ++n_found;
          }
        }
        if (n_found != 1)
          return {};
      }
      for (unsigned int i = 0; i < items.size(); ++i)
        if (images[images[i]] != i)
          return {};
      return images;
    }

    /// Half way between the lowest and the highest item of the rotor.
    template <std::size_t width>
    double mid_plane(const std::vector<std::array<double, width>> &items)
    {
      double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
      for (const auto &item : items)
        if (int(item[3]) % 2 == 1)
        {
          lowest  = std::min(lowest, item[2]);
          highest = std::max(highest, item[2]);
        }
      return (lowest + highest) / 2;
    }

    /// Far below the distance of two nodes, far above rounding.
    double tolerance_of(const FiniteElementSpace<3> &spaces)
    {
      double smallest = std::numeric_limits<double>::infinity();
      for (const auto &cell : spaces.triangulation.active_cell_iterators())
        if (cell->is_locally_owned())
          smallest = std::min(smallest, cell->minimum_vertex_distance());
      return 1e-6 * Utilities::MPI::min(smallest, spaces.comm);
    }

    bool is_of_rotor(const FiniteElementSpace<3> &spaces, const types::material_id id)
    {
      return spaces.geometry.parts[id].body == rotor_body;
    }

    constexpr unsigned int most_fields = 7; ///< of a node, FiniteElementSpace::n_fields()

    /// Place, whether of the rotor (1) and with a tie's traction (2), and the equations of
    /// displacements, pressure and traction (-1: none) of the free nodes of all ranks.
    std::vector<std::array<double, 4 + most_fields>> all_nodes(const FiniteElementSpace<3> &spaces)
    {
      const IndexSet &owned = spaces.nodes.locally_owned_dofs();
      std::vector<bool> done(owned.n_elements(), false);
      std::vector<std::array<double, 4 + most_fields>> nodes;
      FEValues<3> points(spaces.mapping, spaces.fe,
                         Quadrature<3>(spaces.fe.get_unit_support_points()),
                         update_quadrature_points);
      std::vector<types::global_dof_index> cell_nodes(spaces.fe.n_dofs_per_cell());
      const auto number = [](const unsigned int equation)
      { return equation == FiniteElementSpace<3>::none ? -1. : double(equation); };
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          points.reinit(cell);
          cell->get_dof_indices(cell_nodes);
          for (unsigned int a = 0; a < cell_nodes.size(); ++a)
          {
            const auto node = cell_nodes[a];
            if (!owned.is_element(node) || spaces.hanging.is_constrained(node) ||
                done[owned.index_within_set(node)])
              continue;
            done[owned.index_within_set(node)] = true;
            const Point<3> &x                  = points.quadrature_point(a);
            const bool has_tie                 = spaces.tie(node) != FiniteElementSpace<3>::none;
            std::array<double, 4 + most_fields> item{
                {x[0], x[1], x[2], is_of_rotor(spaces, cell->material_id()) + 2. * has_tie}};
            for (unsigned int field = 0; field < most_fields; ++field)
              item[4 + field] =
                  field < spaces.n_fields() ? number(spaces.field_equation(node, field)) : -1.;
            nodes.push_back(item);
          }
        }
      return gather_all(nodes, spaces.comm);
    }
  } // namespace

  template <int dim>
  std::optional<MirrorSymmetry> find_mirror_symmetry(const FiniteElementSpace<dim> &spaces)
  {
    if constexpr (dim == 3)
    {
      // Such rows belong to no node; tangential directions are not those of the image.
      if (spaces.has_nodeless_rows() || spaces.geometry.has_stick())
        return {};
      const auto nodes  = all_nodes(spaces);
      const auto images = find_images(nodes, mid_plane(nodes), tolerance_of(spaces));
      if (images.empty())
        return {};
      MirrorSymmetry symmetry;
      symmetry.rows = spaces.rows;
      symmetry.image.assign(spaces.rows.size, 0);
      symmetry.sign.assign(spaces.rows.size, 1);
      symmetry.is_pressure.assign(spaces.rows.size, false);
      for (unsigned int i = 0; i < nodes.size(); ++i)
        for (unsigned int c = 0; c < most_fields; ++c)
        {
          const double own = nodes[i][4 + c], other = nodes[images[i]][4 + c];
          // What is fixed must be fixed on both sides; two pressures or tractions cannot be one.
          if ((own < 0) != (other < 0) || (c >= 3 && own >= 0 && own == other))
            return {};
          if (own < 0)
            continue;
          symmetry.image[static_cast<unsigned int>(own)]       = static_cast<unsigned int>(other);
          symmetry.sign[static_cast<unsigned int>(own)]        = c == 2 || c == 6 ? -1 : 1;
          symmetry.is_pressure[static_cast<unsigned int>(own)] = c >= 3;
        }
      return symmetry;
    }
    else
    {
      (void)spaces; // the strip slides on one side and stands on the other
      return {};
    }
  }

  template <int dim>
  void average_over_images(const FiniteElementSpace<dim> &spaces, std::vector<double> &by_cell)
  {
    if constexpr (dim == 3)
    {
      std::vector<std::array<double, 5>> own;
      for (const auto &cell : spaces.triangulation.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          const Point<3> x = cell->center();
          own.push_back({{x[0], x[1], x[2], double(is_of_rotor(spaces, cell->material_id())),
                          by_cell[own.size()]}});
        }
      const auto cells  = gather_all(own, spaces.comm);
      const auto images = find_images(cells, mid_plane(cells), tolerance_of(spaces));
      if (images.empty())
        return;
      const unsigned int n = own.size();
      unsigned int first   = 0;
      MPI_Exscan(&n, &first, 1, MPI_UNSIGNED, MPI_SUM, spaces.comm);
      if (Utilities::MPI::this_mpi_process(spaces.comm) == 0)
        first = 0;
      for (unsigned int i = 0; i < n; ++i)
        by_cell[i] = (cells[first + i][4] + cells[images[first + i]][4]) / 2;
    }
    else
    {
      (void)spaces;
      (void)by_cell;
    }
  }

  MultiVector MirrorSymmetry::reflect(const MultiVector &x) const
  {
    MultiVector result(rows, x.n_columns());
    for (unsigned int k = 0; k < x.n_columns(); ++k)
    {
      const std::vector<double> all = replicate(x.columns(k, 1));
      for (unsigned int row = rows.begin; row < rows.end; ++row)
        result.column(k)[row - rows.begin] = sign[row] * all[image[row]];
    }
    return result;
  }

  MultiVector MirrorSymmetry::scattered(const unsigned int n_columns) const
  {
    MultiVector x(rows, n_columns);
    for (unsigned int k = 0; k < n_columns; ++k)
      for (unsigned int row = rows.begin; row < rows.end; ++row)
        x.column(k)[row - rows.begin] = std::sin(1.7 + 2.9 * row + 0.6 * k * row);
    return x;
  }

  namespace
  {
    /// Whether a = b to rounding. Collective.
    bool are_equal(const MultiVector &a, const MultiVector &b)
    {
      // Relative to the largest entry. A pad or a pressure that differs is seen in the product with
      // any scattered vector.
      constexpr double rounding = 1e-10;
      return largest_entry(difference(a, b)) <= rounding * largest_entry(a);
    }
  } // namespace

  std::vector<std::vector<Term>> sums_of(const EquationsOfMotion &equations)
  {
    return {equations.of_order(2), equations.of_order(1), equations.of_order(0)};
  }

  bool is_symmetric(const MultiVector &x, const MirrorSymmetry &symmetry)
  {
    return are_equal(x, symmetry.reflect(x));
  }

  bool is_symmetric(const EquationsOfMotion &equations, const MirrorSymmetry &symmetry)
  {
    std::vector<std::vector<Term>> sums = sums_of(equations);
    sums.push_back(equations.reference_terms());
    return equations.n_constraints % 2 == 0 && is_symmetric(sums, symmetry);
  }

  bool is_symmetric(const std::vector<std::vector<Term>> &sums, const MirrorSymmetry &symmetry)
  {
    constexpr unsigned int n_vectors = 2;
    MultiVector x                    = symmetry.scattered(n_vectors);
    x.append(symmetry.reflect(x)); // [x, S x]

    for (const MultiVector &product : TermList::of_sums(sums).multiply_all(x))
      if (!are_equal(product.columns(0, n_vectors),
                     symmetry.reflect(product.columns(n_vectors, n_vectors))))
        return false;
    return true;
  }

  template std::optional<MirrorSymmetry> find_mirror_symmetry(const FiniteElementSpace<2> &);
  template std::optional<MirrorSymmetry> find_mirror_symmetry(const FiniteElementSpace<3> &);
  template void average_over_images(const FiniteElementSpace<2> &, std::vector<double> &);
  template void average_over_images(const FiniteElementSpace<3> &, std::vector<double> &);
} // namespace squeal
