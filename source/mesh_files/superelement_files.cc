#include <squeal/base/csv_reader.h>
#include <squeal/base/errors.h>
#include <squeal/base/files.h>
#include <squeal/linalg/factorization.h>
#include <squeal/mesh/nearest_point.h>
#include <squeal/mesh_files/joined_surfaces.h>
#include <squeal/mesh_files/mesh_checks.h>
#include <squeal/mesh_files/mesh_file.h>
#include <squeal/mesh_files/superelement_files.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <tuple>

// A superelement of files: matrices in the format of Matrix Market, nodes as a table. What is read
// must be symmetric and of one size; then nodes are held to the surfaces that are near enough, and
// the report tells how far they were. rigid_stiffness() is what the stiffness does to rigid
// motions, for the check of supports.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Refuses names of nodes that are numbers from 0 or 1 on in another order than that of the
    /// matrices: a table that was sorted by something else.
    void check_order(const CsvReader &reader, const std::vector<std::string> &names)
    {
      for (const unsigned int first : {0, 1})
      {
        std::set<std::string> numbers;
        bool in_order = true;
        for (unsigned int k = 0; k < names.size(); ++k)
        {
          numbers.insert(std::to_string(first + k));
          in_order = in_order && names[k] == std::to_string(first + k);
        }
        if (!in_order && numbers == std::set<std::string>(names.begin(), names.end()))
          reader.fail("the nodes are numbered from " + std::to_string(first) +
                      " on, but do not stand in this order, that of the rows of the matrices.");
      }
    }

    /// The table of nodes: a line "node,x_m,y_m,z_m", then one for each.
    std::vector<Point<3>> read_nodes(const std::string &filename)
    {
      CsvReader reader(superelements_key + " = " + filename, filename);
      if (reader.columns() != std::vector<std::string>{"node", "x_m", "y_m", "z_m"})
        reader.fail("expected 'node,x_m,y_m,z_m', found other names of columns.");
      std::vector<Point<3>> nodes;
      std::set<std::string> known;
      std::vector<std::string> names;
      while (reader.next())
      {
        names.push_back(reader.field(0));
        if (!known.insert(names.back()).second)
          reader.fail("the node '" + names.back() + "' is there twice.");
        const Point<3> x(reader.number(1), reader.number(2), reader.number(3));
        check_distance(filename, x, x);
        nodes.push_back(x);
      }
      if (nodes.empty())
        reader.fail("there are no nodes.");
      check_order(reader, names);
      return nodes;
    }

    /// A symmetric matrix of @p size (0: any), each entry once, by rows.
    MatrixMarketFile read_symmetric(const std::string &filename, const unsigned int size)
    {
      constexpr double tolerance  = 1e-8; // of the largest entry: what texts of nine digits leave
      const MatrixMarketFile file = read_matrix_market(filename, superelements_key);
      const auto fail             = [&](const std::string &what)
      { throw InputError(superelements_key + " = " + filename + ": " + what); };
      const std::string shape =
          std::to_string(file.n_rows) + " rows and " + std::to_string(file.n_columns) + " columns";
      if (file.n_rows != file.n_columns)
        fail("the matrix has " + shape + "; it must be square.");
      if (size > 0 && file.n_rows != size)
        fail("the matrix has " + shape + ", the stiffness matrix " + std::to_string(size) +
             "; all matrices must have one size.");
      using Entry = std::tuple<PetscInt, PetscInt, double>;
      std::vector<Entry> entries;
      double largest = 0;
      for (std::size_t k = 0; k < file.values.size(); ++k)
        if (file.values[k] != 0)
        {
          entries.emplace_back(file.rows[k], file.columns[k], file.values[k]);
          largest = std::max(largest, std::abs(file.values[k]));
        }
      std::sort(entries.begin(), entries.end());
      const auto place = [](const Entry &entry)
      { return std::make_pair(std::get<0>(entry), std::get<1>(entry)); };
      const auto text = [](const Entry &entry)
      {
        return "(" + std::to_string(std::get<0>(entry) + 1) + ", " +
               std::to_string(std::get<1>(entry) + 1) + ")";
      };
      for (std::size_t k = 1; k < entries.size(); ++k)
        if (place(entries[k]) == place(entries[k - 1]))
          fail("the entry " + text(entries[k]) + " is there twice.");
      MatrixMarketFile result;
      result.n_rows = result.n_columns = file.n_rows;
      for (const Entry &entry : entries)
      {
        const auto [row, column, value] = entry;
        const auto other =
            std::lower_bound(entries.begin(), entries.end(), Entry(column, row, -INFINITY));
        const bool is_there   = other != entries.end() && place(*other) == place({column, row, 0});
        const double mirrored = is_there ? std::get<2>(*other) : 0;
        if (std::abs(mirrored - value) > tolerance * largest)
          fail("the matrix is not symmetric: the entry " + text(entry) + " is " +
               exact_text(value) + ", that across the diagonal " + exact_text(mirrored) + ".");
        if (!is_there)
          continue; // as small as rounding
        result.rows.push_back(row);
        result.columns.push_back(column);
        result.values.push_back((value + mirrored) / 2);
      }
      return result;
    }

    std::vector<double> diagonal_of(const MatrixMarketFile &matrix)
    {
      std::vector<double> diagonal(matrix.n_rows);
      for (std::size_t k = 0; k < matrix.values.size(); ++k)
        if (matrix.rows[k] == matrix.columns[k])
          diagonal[matrix.rows[k]] = matrix.values[k];
      return diagonal;
    }

    /// Refuses a table with another number of nodes than this program wrote into the comment of
    /// the matrix, or where the rows behind those of the table are coupled with them by threes, as
    /// displacements of further nodes are, and others behind these are not: a table that was cut.
    void check_number_of_nodes(const std::string &where, const std::string &files,
                               const MatrixMarketFile &stiffness, const unsigned int n)
    {
      const std::string table = files + "-nodes.csv";
      std::ifstream in        = open_regular_file(files + "-K.mtx");
      const std::string mark  = "three displacements of each of the ";
      std::string line;
      std::getline(in, line);
      std::getline(in, line);
      if (const std::size_t at = line.find(mark); line[0] == '%' && at != std::string::npos)
      {
        const std::string written =
            line.substr(at + mark.size(), line.find(' ', at + mark.size()) - at - mark.size());
        if (written != std::to_string(n))
          throw InputError(where + "the table " + table + " has " + std::to_string(n) +
                           " nodes, the matrix was written for " + written + ".");
        return;
      }
      constexpr double rounding = 1e-9; // of the largest entry
      double largest            = 0;
      for (const double value : stiffness.values)
        largest = std::max(largest, std::abs(value));
      std::vector<char> is_coupled(stiffness.n_rows);
      for (std::size_t k = 0; k < stiffness.values.size(); ++k)
        if (stiffness.rows[k] != stiffness.columns[k] &&
            std::abs(stiffness.values[k]) > rounding * largest)
          is_coupled[stiffness.rows[k]] = true;
      unsigned int end = 3 * n; // of the rows that are coupled
      while (end < is_coupled.size() && is_coupled[end])
        ++end;
      const bool others_are_alone =
          std::count(is_coupled.begin() + end, is_coupled.end(), true) == 0;
      if (end > 3 * n && end % 3 == 0 && end < is_coupled.size() && others_are_alone)
        throw InputError(where + "the table " + table + " has " + std::to_string(n) +
                         " nodes, but the stiffness matrix couples its first " +
                         std::to_string(end) + " rows, three displacements of each of " +
                         std::to_string(end / 3) + " nodes, and none behind them.");
    }

    /// Refuses a stiffness that lets the nodes move as one along all axes, but not turn as one: the
    /// nodes of the table are not where those of the matrix are. Places are in units of the size.
    void check_turning(const std::string &where, const Superelement &element)
    {
      const unsigned int n = element.nodes.size();
      Point<3> middle;
      for (const Point<3> &x : element.nodes)
        middle += x / double(n);
      double size = 0;
      for (const Point<3> &x : element.nodes)
        size = std::max(size, middle.distance(x));
      if (!(size > 0))
        return;
      std::vector<Point<3>> places;
      for (const Point<3> &x : element.nodes)
        places.push_back(Point<3>((x - middle) / size));
      const DenseMatrix energy = rigid_stiffness(element, places);
      double largest = 0, moving = 0, turning = 0;
      for (const double value : diagonal_of(element.matrices->stiffness))
        largest = std::max(largest, value);
      for (unsigned int c = 0; c < 3; ++c)
      {
        moving  = std::max(moving, std::abs(energy(c, c)));
        turning = std::max(turning, std::abs(energy(3 + c, 3 + c)));
      }
      constexpr double nothing = 1e-6, much = 1e-3; // places enter the energy by their squares
      if (moving <= nothing * largest && turning > much * largest)
        throw InputError(where +
                         "its stiffness is that of a free part, which may move along all axes, but "
                         "holds it against turning: the nodes of the table are not those of the "
                         "matrices, or stand in another order.");
    }

    /// The number of eigenvalues below @p limit of the rows and columns from @p first on of a
    /// symmetric matrix, scaled to a diagonal of one. A negative diagonal counts, and an entry
    /// beside a zero of the diagonal.
    unsigned int n_eigenvalues_below(const double limit, const MatrixMarketFile &matrix,
                                     const unsigned int first = 0)
    {
      const std::vector<double> diagonal = diagonal_of(matrix);
      const auto n_negative              = std::count_if(diagonal.begin() + first, diagonal.end(),
                                                         [](const double value) { return value < 0; });
      if (n_negative > 0)
        return n_negative;
      const unsigned int n = matrix.n_rows;
      EntryList entries;
      for (std::size_t k = 0; k < matrix.values.size(); ++k)
      {
        const unsigned int i = matrix.rows[k], j = matrix.columns[k];
        if (i < first || j < first)
          continue;
        if (diagonal[i] == 0 || diagonal[j] == 0)
          return 1;
        entries.add(i - first, j - first, matrix.values[k] / std::sqrt(diagonal[i] * diagonal[j]));
      }
      for (unsigned int i = first; i < n; ++i)
        entries.add(i - first, i - first, diagonal[i] == 0 ? 1 : -limit);
      return Factorization(entries.make_matrix(small_rows(n - first)), Factorization::Kind::ldlt,
                           "the definiteness of a superelement")
          .inertia()
          .negative;
    }

    /// What texts of nine digits leave of a zero eigenvalue. Six rigid motions are zero ones of a
    /// free part's stiffness, and condensation adds its own rounding.
    constexpr double mass_rounding = 1e-8, stiffness_rounding = 1e-6;
    constexpr double singular = 1e-12; ///< what factors leave of it

    /// Reads the matrices of a superelement with @p n nodes. Throws InputError where sizes do not
    /// fit or an energy may be negative.
    Superelement::Matrices read_matrices(const Parameters::Joints::Superelement &entry,
                                         const unsigned int n)
    {
      const std::string where = superelements_key + ": '" + entry.name + "': ";
      Superelement::Matrices matrices;
      matrices.stiffness      = read_symmetric(entry.files + "-K.mtx", 0);
      const unsigned int size = matrices.stiffness.n_rows;
      if (size < 3 * n)
        throw InputError(where + "the stiffness matrix has " + std::to_string(size) +
                         " rows, but the table " + entry.files + "-nodes.csv has " +
                         std::to_string(n) + " nodes with three displacements each.");
      check_number_of_nodes(where, entry.files, matrices.stiffness, n);
      matrices.mass = read_symmetric(entry.files + "-M.mtx", size);
      if (const std::string file = entry.files + "-D.mtx"; std::filesystem::exists(file))
        matrices.damping = read_symmetric(file, size);
      if (n_eigenvalues_below(-mass_rounding, matrices.mass) > 0)
        throw InputError(where + "the mass matrix " + entry.files +
                         "-M.mtx is indefinite: there are motions with a negative energy.");
      if (const unsigned int n_negative =
              n_eigenvalues_below(-stiffness_rounding, matrices.stiffness))
        throw InputError(where + "the stiffness matrix " + entry.files +
                         "-K.mtx is indefinite: " + std::to_string(n_negative) +
                         " of its eigenvalues are negative, motions that release energy.");
      return matrices;
    }

    /// Holds each node to the nearest surface that is near enough. Returns distances by node, m.
    /// Throws InputError for a surface that no node is near to.
    std::vector<double> hold_nodes(const std::string &where,
                                   const std::vector<HoldingSurface> &surfaces,
                                   const double tolerance, PlacedSuperelement &result)
    {
      Superelement &element = result.element;
      const unsigned int n  = element.nodes.size();
      const FaceElement<3> patch(2);
      result.surface_of_node.assign(n, PlacedSuperelement::free);
      element.is_held.assign(n, false);
      std::vector<double> distance(n, INFINITY);
      for (unsigned int s = 0; s < surfaces.size(); ++s)
      {
        const double allowed = allowed_distance(tolerance, surfaces[s].faces);
        double least         = INFINITY;
        for (unsigned int k = 0; k < n; ++k)
        {
          const double found = nearest_point(patch, surfaces[s].faces, element.nodes[k]).distance;
          least              = std::min(least, found);
          if (found <= allowed && found < distance[k])
            result.surface_of_node[k] = s;
          distance[k] = std::min(distance[k], found);
        }
        if (least > allowed)
          throw InputError(where + "no node is within " + exact_text(allowed) + " m of '" +
                           surfaces[s].name + "' (Joints/Position tolerance); the nearest is " +
                           exact_text(least) + " m away.");
      }
      for (unsigned int k = 0; k < n; ++k)
        element.is_held[k] = result.surface_of_node[k] != PlacedSuperelement::free;
      return distance;
    }

    /// Throws InputError where the stiffness holds neither a node that is free nor the internal
    /// coordinates.
    void check_free_coordinates(const std::string &where, const Superelement &element,
                                const std::vector<double> &distance)
    {
      const unsigned int n = element.nodes.size(), size = element.size();
      const std::vector<double> diagonal = diagonal_of(element.matrices->stiffness);
      for (unsigned int k = 0; k < n; ++k)
        for (unsigned int c = 0; c < 3; ++c)
          if (!element.is_held[k] && diagonal[3 * k + c] == 0)
            throw InputError(where + "the node at " + text_of(element.nodes[k]) + " is " +
                             exact_text(distance[k]) +
                             " m away from the nearest surface, more than is allowed "
                             "(Joints/Position tolerance), and the stiffness matrix does not hold "
                             "it: its row " +
                             std::to_string(3 * k + c + 1) + " has a zero on the diagonal.");
      for (unsigned int i = 3 * n; i < size; ++i)
        if (diagonal[i] == 0)
          throw InputError(where +
                           "the stiffness matrix does not hold the internal coordinate of "
                           "row " +
                           std::to_string(i + 1) + ": there is a zero on the diagonal.");
      if (const unsigned int n_singular =
              size > 3 * n ? n_eigenvalues_below(singular, element.matrices->stiffness, 3 * n) : 0)
        throw InputError(where +
                         "the stiffness matrix does not hold the internal coordinates, rows " +
                         std::to_string(3 * n + 1) + " to " + std::to_string(size) +
                         ": their block has " + std::to_string(n_singular) +
                         " eigenvalues that are zero to rounding, motions without energy while all "
                         "nodes rest.");
    }

    /// A line for the report: nodes, how they are held, mass.
    std::string describe(const PlacedSuperelement &placed,
                         const std::vector<HoldingSurface> &surfaces,
                         const std::vector<double> &distance)
    {
      const Superelement &element            = placed.element;
      const Superelement::Matrices &matrices = *element.matrices;
      const unsigned int n = element.nodes.size(), size = element.size();
      std::vector<unsigned int> n_of_surface(surfaces.size());
      double largest = 0;
      for (unsigned int k = 0; k < n; ++k)
        if (element.is_held[k])
        {
          ++n_of_surface[placed.surface_of_node[k]];
          largest = std::max(largest, distance[k]);
        }
      // The mass that moves with the nodes along x, its internal coordinates at rest
      double mass = 0;
      for (std::size_t k = 0; k < matrices.mass.values.size(); ++k)
        if (matrices.mass.rows[k] < PetscInt(3 * n) && matrices.mass.columns[k] < PetscInt(3 * n) &&
            matrices.mass.rows[k] % 3 == 0 && matrices.mass.columns[k] % 3 == 0)
          mass += matrices.mass.values[k];
      std::ostringstream report;
      report << "'" << element.name << "': " << n << " nodes, ";
      for (unsigned int s = 0; s < surfaces.size(); ++s)
        report << n_of_surface[s] << " held by '" << surfaces[s].name << "', ";
      report << "at most " << largest << " m away, " << n - element.n_held() << " free, "
             << size - 3 * n << " internal coordinates, "
             << (matrices.damping.n_rows > 0 ? "" : "no damping, ") << mass << " kg";
      return report.str();
    }
  } // namespace

  PlacedSuperelement read_superelement(const Parameters::Joints::Superelement &entry,
                                       const std::vector<HoldingSurface> &surfaces,
                                       const double tolerance)
  {
    PlacedSuperelement result;
    Superelement &element   = result.element;
    const std::string where = superelements_key + ": '" + entry.name + "': ";
    element.name            = entry.name;
    element.nodes           = read_nodes(entry.files + "-nodes.csv");
    element.matrices =
        std::make_shared<const Superelement::Matrices>(read_matrices(entry, element.nodes.size()));
    check_turning(where, element);
    const std::vector<double> distance = hold_nodes(where, surfaces, tolerance, result);
    check_free_coordinates(where, element, distance);
    result.report = describe(result, surfaces, distance);
    return result;
  }

  DenseMatrix rigid_stiffness(const Superelement &element, const std::vector<Point<3>> &places)
  {
    constexpr double rounding = 1e-9;
    const MatrixMarketFile &K = element.matrices->stiffness;
    const unsigned int n = element.size(), n_placed = 3 * places.size(), n_inner = n - n_placed;
    DenseMatrix motions(n, 6);
    for (unsigned int k = 0; k < places.size(); ++k)
      for (unsigned int c = 0; c < 3; ++c)
      {
        motions(3 * k + c, c) = 1;
        // o x x
        motions(3 * k + c, 3 + (c + 1) % 3) = places[k][(c + 2) % 3];
        motions(3 * k + c, 3 + (c + 2) % 3) = -places[k][(c + 1) % 3];
      }
    DenseMatrix forces(n, 6), sizes(n, 6);
    EntryList inner;
    for (std::size_t k = 0; k < K.values.size(); ++k)
    {
      const unsigned int i = K.rows[k], j = K.columns[k];
      for (unsigned int m = 0; m < 6; ++m)
      {
        forces(i, m) += K.values[k] * motions(j, m);
        sizes(i, m) += std::abs(K.values[k] * motions(j, m));
      }
      if (i >= n_placed && j >= n_placed)
        inner.add(i - n_placed, j - n_placed, K.values[k]);
    }
    DenseMatrix energy(6, 6);
    double scale = 0;
    for (unsigned int i = 0; i < n_placed; ++i)
      for (unsigned int a = 0; a < 6; ++a)
      {
        scale = std::max(scale, std::abs(motions(i, a)) * sizes(i, a));
        for (unsigned int b = 0; b < 6; ++b)
          energy(a, b) += motions(i, a) * forces(i, b);
      }
    // What internal coordinates give way: - B^T K_ii^{-1} B
    bool is_coupled = false;
    for (unsigned int i = n_placed; i < n; ++i)
      for (unsigned int m = 0; m < 6; ++m)
        is_coupled = is_coupled || std::abs(forces(i, m)) > rounding * sizes(i, m);
    if (is_coupled)
    {
      const RowRange rows = small_rows(n_inner);
      MultiVector right(rows, 6);
      for (unsigned int m = 0; m < 6; ++m)
        for (unsigned int i = 0; i < n_inner; ++i)
          right.column(m)[i] = forces(n_placed + i, m);
      const MultiVector moved = Factorization(inner.make_matrix(rows), Factorization::Kind::ldlt,
                                              "the internal coordinates of a superelement")
                                    .solve(right);
      for (unsigned int a = 0; a < 6; ++a)
        for (unsigned int b = 0; b < 6; ++b)
          for (unsigned int i = 0; i < n_inner; ++i)
            energy(a, b) -= forces(n_placed + i, a) * moved.column(b)[i];
    }
    for (double &value : energy.values)
      if (std::abs(value) <= rounding * scale)
        value = 0;
    return energy;
  }
} // namespace squeal
