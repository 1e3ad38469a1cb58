#include <squeal/base/files.h>
#include <squeal/base/text.h>
#include <squeal/linalg/matrix_market.h>
#include <squeal/reduction/craig_bampton.h>
#include <squeal/run/superelement_export.h>

#include <deal.II/base/mpi.h>
#include <deal.II/dofs/dof_tools.h>

#include <array>
#include <map>
#include <vector>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    constexpr unsigned int without_number = -1;

    struct InterfaceNode
    {
      std::array<double, 3> place;
      std::array<unsigned int, 3> rows;
    };

    /// The nodes of the interface that do not hang on others, by their numbers, on all ranks.
    std::map<types::global_dof_index, InterfaceNode>
    nodes_of(const FiniteElementSpace<3> &spaces, const std::set<types::boundary_id> &boundaries)
    {
      std::map<types::global_dof_index, Point<3>> positions;
      DoFTools::map_dofs_to_support_points(spaces.mapping, spaces.nodes, positions);
      std::vector<double> own;
      std::vector<types::global_dof_index> face_nodes(spaces.fe.n_dofs_per_face());
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
          for (const unsigned int f : cell->face_indices())
            if (cell->face(f)->at_boundary() && boundaries.count(cell->face(f)->boundary_id()) > 0)
            {
              cell->face(f)->get_dof_indices(face_nodes);
              for (const auto node : face_nodes)
                if (!spaces.hanging.is_constrained(node))
                {
                  own.push_back(node);
                  for (unsigned int c = 0; c < 3; ++c)
                    own.push_back(positions.at(node)[c]);
                  for (unsigned int c = 0; c < 3; ++c)
                    own.push_back(spaces.equation(node, c));
                }
            }
      gather(own, MPI_DOUBLE, spaces.comm);
      std::map<types::global_dof_index, InterfaceNode> nodes;
      for (std::size_t k = 0; k < own.size(); k += 7)
      {
        InterfaceNode &node = nodes[static_cast<types::global_dof_index>(own[k])];
        for (unsigned int c = 0; c < 3; ++c)
        {
          node.place[c] = own[k + 1 + c];
          node.rows[c]  = static_cast<unsigned int>(own[k + 4 + c]);
        }
      }
      return nodes;
    }

    /// What the terms of one order say of the part alone, in its own numbers; the empty matrix if
    /// there are none. Only the first rank's has entries. Collective.
    Matrix part_of(const EquationsOfMotion &equations, const unsigned int order,
                   const Origin origin, const std::vector<unsigned int> &number,
                   const RowRange &part)
    {
      std::vector<int> places;
      std::vector<double> values;
      for (const Term &term : equations.terms)
        if (term.order == order && term.origin == origin)
          for_entries(*term.matrix,
                      [&](const unsigned int row, const unsigned int column, const double value)
                      {
                        if (number[row] == without_number || number[column] == without_number)
                          return;
                        places.push_back(number[row]);
                        places.push_back(number[column]);
                        values.push_back(term.coefficient * value);
                      });
      gather(places, MPI_INT, equations.rows.comm);
      gather(values, MPI_DOUBLE, equations.rows.comm);
      if (values.empty())
        return {};
      EntryList entries;
      if (is_rank_zero(equations.rows.comm))
        for (std::size_t k = 0; k < values.size(); ++k)
          entries.add(places[2 * k], places[2 * k + 1], values[k]);
      return entries.make_matrix(part);
    }

    MatrixMarketFile file_of(const DenseMatrix &matrix)
    {
      MatrixMarketFile file;
      file.n_rows    = matrix.n_rows;
      file.n_columns = matrix.n_columns;
      for (unsigned int j = 0; j < matrix.n_columns; ++j)
        for (unsigned int i = 0; i < matrix.n_rows; ++i)
          if (matrix(i, j) != 0)
          {
            file.rows.push_back(i);
            file.columns.push_back(j);
            file.values.push_back(matrix(i, j));
          }
      return file;
    }

    /// The reduced part, on the first rank; all ranks know whether it went well.
    ReducedPart reduce(const Matrix &K, const Matrix &M, const Matrix &D, const RowRange &part,
                       const unsigned int n_interface, const Parameters::Output &output,
                       const MPI_Comm comm)
    {
      ReducedPart reduced;
      std::string failure;
      if (is_rank_zero(comm)) // who writes has the matrices
        try
        {
          reduced = craig_bampton(K, M, D, part, n_interface, output.superelement_modes,
                                  output.superelement_frequency);
        }
        catch (const SolverError &error)
        {
          failure = error.what();
        }
      failure = Utilities::MPI::broadcast(comm, failure);
      if (!failure.empty())
        throw SolverError(failure);
      return reduced;
    }

    template <typename Nodes>
    void write_nodes(const Nodes &nodes, const std::string &directory, const MPI_Comm comm)
    {
      std::string table = "node,x_m,y_m,z_m\n";
      unsigned int k    = 0;
      for (const auto &node : nodes)
      {
        table += std::to_string(k++);
        for (const double x : node.second.place)
          table += "," + exact_text(x);
        table += "\n";
      }
      write_text(directory + "/superelement-nodes.csv", table, comm);
    }
  } // namespace

  template <>
  std::string export_superelement(const BrakeModel<3> &model, const EquationsOfMotion &equations,
                                  const std::string &directory)
  {
    const FiniteElementSpace<3> &spaces    = model.spaces();
    const SuperelementInterface &interface = *spaces.geometry.superelement_out;
    const std::string name                 = spaces.geometry.other_bodies.at(Body(interface.body));
    const RowRange &rows                   = equations.rows;
    const auto nodes                       = nodes_of(spaces, interface.boundaries);
    const unsigned int n_interface         = 3 * nodes.size();
    const auto &[names_of_bodies, body_of_row] = model.bodies_of_rows();

    // The interface first, node by node, then the inside of the part
    std::vector<unsigned int> own, number(rows.size, without_number);
    for (unsigned int i = 0; i < rows.n_local(); ++i)
      if (names_of_bodies[body_of_row[i]] == name)
        own.push_back(rows.begin + i);
    gather(own, MPI_UNSIGNED, rows.comm);
    unsigned int n = 0;
    for (const auto &node : nodes)
      for (const unsigned int row : node.second.rows)
        number[row] = n++;
    for (const unsigned int row : own)
      if (number[row] == without_number)
        number[row] = n++;
    const RowRange part = small_rows(n);
    const Matrix K      = part_of(equations, 0, Origin::elasticity, number, part),
                 M      = part_of(equations, 2, Origin::inertia, number, part),
                 D      = part_of(equations, 1, Origin::material_damping, number, part);

    const ReducedPart reduced =
        reduce(K, M, D, part, n_interface, model.parameters().output, rows.comm);
    const auto write = [&](const std::string &letter, const DenseMatrix &matrix)
    {
      const MatrixMarketFile file = file_of(matrix);
      write_matrix_market(directory + "/superelement-" + letter + ".mtx", file,
                          {letter + " of the superelement of '" + name +
                           text_of("': three displacements of each of the ", nodes.size(),
                                   " nodes of superelement-nodes.csv, then amplitudes of modes")},
                          rows.comm);
    };
    write("K", reduced.K);
    write("M", reduced.M);
    if (D)
      write("D", reduced.D);
    write_nodes(nodes, directory, rows.comm);
    return text_of("\nSuperelement of '", name, "': ", nodes.size(), " nodes of the interface, ",
                   reduced.n_modes, " of ", reduced.n_internal, " modes with the interface held",
                   reduced.n_modes > 0 ? text_of(", up to ", reduced.highest, " Hz") : "",
                   "; superelement-K.mtx and others, doc/joints.md.");
  }

  template <>
  std::string export_superelement(const BrakeModel<2> &, const EquationsOfMotion &,
                                  const std::string &)
  {
    return {};
  }
} // namespace squeal
