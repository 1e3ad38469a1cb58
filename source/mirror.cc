#include <squeal/mirror.h>
#include <squeal/spaces.h>

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
    std::vector<std::array<double, width>>
    gather_all(const std::vector<std::array<double, width>> &own, const MPI_Comm comm)
    {
      std::vector<std::array<double, width>> all;
      for (const auto &part : Utilities::MPI::all_gather(comm, own))
        all.insert(all.end(), part.begin(), part.end());
      return all;
    }

    /// For each item, whose first numbers are its place and whether it belongs to the rotor, the
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
        if (item[3] != 0)
        {
          lowest  = std::min(lowest, item[2]);
          highest = std::max(highest, item[2]);
        }
      return (lowest + highest) / 2;
    }

    /// Far below the distance of two nodes, far above rounding.
    double tolerance_of(const Spaces<3> &spaces)
    {
      double smallest = std::numeric_limits<double>::infinity();
      for (const auto &cell : spaces.triangulation.active_cell_iterators())
        if (cell->is_locally_owned())
          smallest = std::min(smallest, cell->minimum_vertex_distance());
      return 1e-6 * Utilities::MPI::min(smallest, spaces.comm);
    }

    bool is_of_rotor(const Spaces<3> &spaces, const types::material_id id)
    {
      return spaces.geometry.parts[id].body == rotor_body;
    }

    /// Place, rotor or not, and the equations of three displacements and a pressure (-1: none) of
    /// the free nodes of all ranks.
    std::vector<std::array<double, 8>> all_nodes(const Spaces<3> &spaces)
    {
      const IndexSet &owned = spaces.nodes.locally_owned_dofs();
      std::vector<bool> done(owned.n_elements(), false);
      std::vector<std::array<double, 8>> nodes;
      FEValues<3> points(spaces.mapping, spaces.fe,
                         Quadrature<3>(spaces.fe.get_unit_support_points()),
                         update_quadrature_points);
      std::vector<types::global_dof_index> cell_nodes(spaces.fe.n_dofs_per_cell());
      const auto number = [](const unsigned int equation)
      { return equation == Spaces<3>::none ? -1. : double(equation); };
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
            nodes.push_back({{x[0], x[1], x[2], double(is_of_rotor(spaces, cell->material_id())),
                              number(spaces.equation(node, 0)), number(spaces.equation(node, 1)),
                              number(spaces.equation(node, 2)), number(spaces.multiplier(node))}});
          }
        }
      return gather_all(nodes, spaces.comm);
    }
  } // namespace

  template <int dim>
  std::optional<MirrorSymmetry> find_mirror_symmetry(const Spaces<dim> &spaces)
  {
    if constexpr (dim == 3)
    {
      const auto nodes  = all_nodes(spaces);
      const auto images = find_images(nodes, mid_plane(nodes), tolerance_of(spaces));
      if (images.empty())
        return {};
      MirrorSymmetry symmetry;
      symmetry.rows = spaces.rows;
      symmetry.image.assign(spaces.rows.size, 0);
      symmetry.sign.assign(spaces.rows.size, 1);
      for (unsigned int i = 0; i < nodes.size(); ++i)
        for (unsigned int c = 0; c < 4; ++c)
        {
          const double own = nodes[i][4 + c], other = nodes[images[i]][4 + c];
          // What is fixed must be fixed on both sides; two pressures cannot be one.
          if ((own < 0) != (other < 0) || (c == 3 && own >= 0 && own == other))
            return {};
          if (own < 0)
            continue;
          symmetry.image[static_cast<unsigned int>(own)] = static_cast<unsigned int>(other);
          symmetry.sign[static_cast<unsigned int>(own)]  = c == 2 ? -1 : 1;
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
  void average_mirror_cells(const Spaces<dim> &spaces, std::vector<double> &by_cell)
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

  Block MirrorSymmetry::reflect(const Block &x) const
  {
    Block result(rows, x.n_columns());
    for (unsigned int k = 0; k < x.n_columns(); ++k)
    {
      const std::vector<double> all = replicate(x.columns(k, 1));
      for (unsigned int row = rows.begin; row < rows.end; ++row)
        result.column(k)[row - rows.begin] = sign[row] * all[image[row]];
    }
    return result;
  }

  Block MirrorSymmetry::scattered(const unsigned int n_columns) const
  {
    Block x(rows, n_columns);
    for (unsigned int k = 0; k < n_columns; ++k)
      for (unsigned int row = rows.begin; row < rows.end; ++row)
        x.column(k)[row - rows.begin] = std::sin(1.7 + 2.9 * row + 0.6 * k * row);
    return x;
  }

  bool is_symmetric(const QuadraticEigenproblem &problem, const MirrorSymmetry &symmetry)
  {
    // Relative to the largest entry of the product. A pad or a pressure that differs is seen in any
    // scattered vector.
    constexpr double rounding = 1e-10;
    if (problem.n_constraints % 2 != 0)
      return false;
    const Block x = symmetry.scattered(2), s_x = symmetry.reflect(x);
    for (const Matrix *matrix : {&problem.M, &problem.P, &problem.Q, &problem.reference})
    {
      const Block a_x = multiply(*matrix, x), s_a_s_x = symmetry.reflect(multiply(*matrix, s_x));
      std::array<double, 2> largest{{0, 0}}; // of the product, of the difference
      for (std::size_t i = 0; i < std::size_t(a_x.n_local()) * a_x.n_columns(); ++i)
      {
        largest[0] = std::max(largest[0], std::abs(a_x.data()[i]));
        largest[1] = std::max(largest[1], std::abs(a_x.data()[i] - s_a_s_x.data()[i]));
      }
      MPI_Allreduce(MPI_IN_PLACE, largest.data(), 2, MPI_DOUBLE, MPI_MAX, problem.rows.comm);
      if (!(largest[1] <= rounding * largest[0]))
        return false;
    }
    return true;
  }

  HalfSpace::HalfSpace(const MirrorSymmetry &symmetry, const bool symmetric)
      : whole(symmetry.rows), images(symmetry.image), columns(whole.size, none),
        entries(whole.size, 0.), is_second(whole.size, false)
  {
    const double parity = symmetric ? 1 : -1;
    // One row of each pair stands for both: the lower or the higher one in turn, since one side may
    // belong to one rank.
    const auto stands_for_pair = [&](const unsigned int row)
    {
      const unsigned int image = symmetry.image[row];
      return (row < image) == ((row + image) % 2 == 0);
    };
    rows.comm      = whole.comm;
    unsigned int n = 0;
    for (unsigned int row = 0; row < whole.size; ++row)
    {
      if (row == whole.begin)
        rows.begin = n;
      const bool alone = symmetry.image[row] == row;
      if (alone ? symmetry.sign[row] == parity : stands_for_pair(row))
      {
        columns[row] = n++;
        entries[row] = alone ? 1. : std::sqrt(0.5);
        if (whole.contains(row))
          representatives.push_back(row);
      }
    }
    rows.size = n;
    if (whole.begin == whole.size)
      rows.begin = n;
    rows.end = rows.begin + representatives.size();
    for (unsigned int row = 0; row < whole.size; ++row)
      if (const unsigned int image = symmetry.image[row]; image != row && !stands_for_pair(row))
      {
        is_second[row] = true;
        columns[row]   = columns[image];
        entries[row]   = parity * symmetry.sign[row] * entries[image];
      }
  }

  namespace
  {
    /// Rows of a distributed matrix, own ones and some of other ranks. Collective.
    class Rows
    {
    public:
      Rows(const Matrix &matrix, const RowRange &own, const std::vector<PetscInt> &others)
          : matrix(matrix), own(own), others(others)
      {
        int n_ranks = 0;
        MPI_Comm_size(own.comm, &n_ranks);
        if (n_ranks == 1)
          return;
        IS rows = nullptr, columns = nullptr;
        SQUEAL_PETSC(ISCreateGeneral(PETSC_COMM_SELF, others.size(), others.data(),
                                     PETSC_COPY_VALUES, &rows));
        SQUEAL_PETSC(ISCreateStride(PETSC_COMM_SELF, own.size, 0, 1, &columns));
        SQUEAL_PETSC(
            MatCreateSubMatrices(matrix, 1, &rows, &columns, MAT_INITIAL_MATRIX, &received));
        SQUEAL_PETSC(ISDestroy(&rows));
        SQUEAL_PETSC(ISDestroy(&columns));
      }
      ~Rows()
      {
        if (received)
          MatDestroySubMatrices(1, &received);
      }
      Rows(const Rows &)            = delete;
      Rows &operator=(const Rows &) = delete;

      /// Calls visit(column, value) for the entries of a row.
      template <typename Visit>
      void for_entries(const PetscInt row, const Visit &visit) const
      {
        const bool is_own = own.contains(row);
        Mat mat           = is_own ? Mat(matrix) : *received;
        const PetscInt place =
            is_own ? row : std::lower_bound(others.begin(), others.end(), row) - others.begin();
        PetscInt n                = 0;
        const PetscInt *columns   = nullptr;
        const PetscScalar *values = nullptr;
        SQUEAL_PETSC(MatGetRow(mat, place, &n, &columns, &values));
        for (PetscInt k = 0; k < n; ++k)
          visit(columns[k], values[k]);
        SQUEAL_PETSC(MatRestoreRow(mat, place, &n, &columns, &values));
      }

    private:
      const Matrix &matrix;
      const RowRange own;
      const std::vector<PetscInt> others; ///< ascending
      Mat *received = nullptr;
    };
  } // namespace

  /// With a pair of rows i, i' and one of columns k, k', an entry of V^T A V is
  ///     (v_i v_k a_ik + v_i' v_k' a_i'k') + (v_i v_k' a_ik' + v_i' v_k a_i'k).
  /// Summed like this a symmetric matrix stays symmetric, and a skew one skew, to the last digit:
  /// otherwise rounding would damp or feed the vibration.
  Matrix HalfSpace::restrict(const Matrix &matrix) const
  {
    if (!matrix)
      return {};
    std::vector<PetscInt> others;
    for (const unsigned int i : representatives)
      if (!whole.contains(images[i]))
        others.push_back(images[i]);
    std::sort(others.begin(), others.end());
    const Rows all_rows(matrix, whole, others);

    std::vector<PetscInt> begins = {0}, all_columns, row_columns;
    std::vector<PetscScalar> values, direct(rows.size, 0.), crossed(rows.size, 0.);
    std::vector<bool> is_met(rows.size, false);
    for (const unsigned int i : representatives)
    {
      row_columns.clear();
      const auto add_row = [&](const unsigned int row, const bool is_image)
      {
        all_rows.for_entries(row,
                             [&](const PetscInt k, const PetscScalar a)
                             {
                               const unsigned int column = columns[k];
                               if (column == none)
                                 return;
                               if (!is_met[column])
                                 row_columns.push_back(column);
                               is_met[column] = true;
                               (is_image == is_second[k] ? direct : crossed)[column] +=
                                   (entries[row] * entries[k]) * a;
                             });
      };
      add_row(i, false);
      if (images[i] != i)
        add_row(images[i], true);
      std::sort(row_columns.begin(), row_columns.end());
      for (const PetscInt column : row_columns)
      {
        if (const double sum = direct[column] + crossed[column]; sum != 0)
        {
          all_columns.push_back(column);
          values.push_back(sum);
        }
        direct[column] = crossed[column] = 0;
        is_met[column]                   = false;
      }
      begins.push_back(all_columns.size());
    }
    Mat mat = nullptr;
    SQUEAL_PETSC(MatCreate(rows.comm, &mat));
    Matrix result(mat);
    SQUEAL_PETSC(MatSetSizes(mat, rows.n_local(), rows.n_local(), rows.size, rows.size));
    SQUEAL_PETSC(MatSetType(mat, MATAIJ));
    // Only the call of the matrix' own type has an effect.
    SQUEAL_PETSC(
        MatSeqAIJSetPreallocationCSR(mat, begins.data(), all_columns.data(), values.data()));
    SQUEAL_PETSC(
        MatMPIAIJSetPreallocationCSR(mat, begins.data(), all_columns.data(), values.data()));
    return result;
  }

  QuadraticEigenproblem HalfSpace::restrict(const QuadraticEigenproblem &problem) const
  {
    QuadraticEigenproblem half;
    half.rows           = rows;
    half.M              = restrict(problem.M);
    half.P              = restrict(problem.P);
    half.Q              = restrict(problem.Q);
    half.reference      = restrict(problem.reference);
    half.reference_name = problem.reference_name;
    // In parallel the whole is symmetric to rounding only, which would turn double eigenvalues of a
    // conservative problem into complex pairs.
    if (!problem.reference)
    {
      half.M = symmetric_part(rows, half.M);
      half.Q = symmetric_part(rows, half.Q);
    }
    // Pressures come in pairs, both in contact or both released.
    half.n_constraints       = problem.n_constraints / 2;
    half.n_local_constraints = n_local_last(problem.n_local_constraints);
    half.compliant           = problem.compliant;
    half.may_move_rigidly    = problem.may_move_rigidly;
    return half;
  }

  unsigned int HalfSpace::n_local_last(const unsigned int n_of_whole) const
  {
    return std::count_if(representatives.begin(), representatives.end(),
                         [&](const unsigned int row) { return row >= whole.end - n_of_whole; });
  }

  Block HalfSpace::restrict(const Block &x) const
  {
    Block y(rows, x.n_columns());
    for (unsigned int k = 0; k < x.n_columns(); ++k)
    {
      const std::vector<double> all = replicate(x.columns(k, 1));
      for (unsigned int i = 0; i < rows.n_local(); ++i)
      {
        const unsigned int row = representatives[i], image = images[row];
        y.column(k)[i] = entries[row] * all[row] + (image != row ? entries[image] * all[image] : 0);
      }
    }
    return y;
  }

  Block HalfSpace::expand(const Block &y) const
  {
    Block x(whole, y.n_columns());
    for (unsigned int k = 0; k < y.n_columns(); ++k)
    {
      const std::vector<double> all = replicate(y.columns(k, 1));
      for (unsigned int row = whole.begin; row < whole.end; ++row)
        if (columns[row] != none)
          x.column(k)[row - whole.begin] = entries[row] * all[columns[row]];
    }
    return x;
  }

  template std::optional<MirrorSymmetry> find_mirror_symmetry(const Spaces<2> &);
  template std::optional<MirrorSymmetry> find_mirror_symmetry(const Spaces<3> &);
  template void average_mirror_cells(const Spaces<2> &, std::vector<double> &);
  template void average_mirror_cells(const Spaces<3> &, std::vector<double> &);
} // namespace squeal
