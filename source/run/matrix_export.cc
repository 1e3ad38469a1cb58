#include <squeal/base/files.h>
#include <squeal/linalg/matrix_market.h>
#include <squeal/run/matrix_export.h>

#include <deal.II/base/mpi.h>
#include <deal.II/dofs/dof_tools.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

// What is written follows from the equations' terms alone, whatever they are made of:
//     M = sum of c_k A_k over the terms of order 2, P of order 1, Q of order 0   (terms.csv),
// beside which there may be sum of c_k (f_k(l) - 1) A_k   (functions.csv).
// Rows keep the program's order, without those of pressures that are zero. Numbers in tables count
// from zero.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    constexpr unsigned int left_out = -1;

    /// Which rows are written, and their numbers in the files.
    struct Selection
    {
      RowRange rows;
      std::vector<unsigned int> number; ///< by global row; or left_out
      unsigned int size = 0;

      bool has(const unsigned int row) const
      {
        return number[row] != left_out;
      }
    };

    /// All rows but those of pressures of which Q says nothing but that they are zero.
    Selection select_rows(const EquationsOfMotion &equations, const Matrix &Q)
    {
      const RowRange &rows = equations.rows;
      Selection result{rows, std::vector<unsigned int>(rows.size, left_out), 0};
      std::vector<bool> is_coupled(rows.n_local(), false);
      for_entries(Q,
                  [&](const unsigned int row, const unsigned int column, double)
                  {
                    if (row != column)
                      is_coupled[row - rows.begin] = true;
                  });
      const unsigned int first_pressure = rows.n_local() - equations.n_local_constraints;
      unsigned int n_kept = 0, offset = 0;
      for (unsigned int i = 0; i < rows.n_local(); ++i)
        if (i < first_pressure || is_coupled[i])
          result.number[rows.begin + i] = n_kept++;
      MPI_Exscan(&n_kept, &offset, 1, MPI_UNSIGNED, MPI_SUM, rows.comm);
      if (is_rank_zero(rows.comm))
        offset = 0;
      for (unsigned int row = rows.begin; row < rows.end; ++row)
        if (result.has(row))
          result.number[row] += offset;
      MPI_Allreduce(MPI_IN_PLACE, result.number.data(), rows.size, MPI_UNSIGNED, MPI_MIN,
                    rows.comm);
      result.size = Utilities::MPI::sum(n_kept, rows.comm);
      return result;
    }

    MatrixMarketFile entries_of(const Matrix &matrix, const Selection &kept)
    {
      MatrixMarketFile own;
      own.n_rows = own.n_columns = kept.size;
      if (matrix)
        for_entries(matrix,
                    [&](const unsigned int row, const unsigned int column, const double value)
                    {
                      if (!kept.has(row) || !kept.has(column))
                        return;
                      own.rows.push_back(kept.number[row]);
                      own.columns.push_back(kept.number[column]);
                      own.values.push_back(value);
                    });
      return own;
    }

    /// Text, to be handed over as one piece.
    std::function<std::string()> once(std::string text)
    {
      return [text = std::move(text)]() mutable { return std::exchange(text, {}); };
    }

    /// Writes the files of one run.
    class Export
    {
    public:
      Export(const EquationsOfMotion &equations,
             const std::pair<std::vector<std::string>, std::vector<unsigned int>> &bodies,
             const std::string &directory)
          : equations(equations), comm(equations.rows.comm), bodies(bodies),
            directory(directory + "/")
      {
      }

      void write_sums()
      {
        // Q first: it says which rows there are.
        for (const unsigned int order : {0u, 1u, 2u})
        {
          const Matrix sum = sum_of_terms(equations.rows, equations.of_order(order));
          if (order == 0)
            kept = select_rows(equations, sum);
          const std::string name = name_of_sum(order);
          write_matrix_market(directory + name + ".mtx", entries_of(sum, kept),
                              {name + " of (l^2 M + l P + Q) x = 0",
                               "the sum of factor times file over the lines of terms.csv that "
                               "belong to " +
                                   name},
                              comm);
        }
      }

      /// The matrices of the terms, each once, and how they make up the sums. Those that damping
      /// shares with inertia and elasticity are named after these.
      void write_terms()
      {
        std::string table           = "term,origin,bodies,belongs_to,power_of_lambda,factor,file\n";
        unsigned int number_of_term = 0;
        for (const unsigned int order : {2u, 0u, 1u})
          for (const Term &term : equations.of_order(order))
          {
            const MatrixMarketFile own = entries_of(*term.matrix, kept);
            const std::string name     = name_of(term.origin);
            auto [file, is_new]        = files.try_emplace(term.matrix.get());
            ++number_of_term;
            if (is_new)
            {
              file->second = "term-" + Utilities::int_to_string(number_of_term, 2) + "-" + name;
              std::replace(file->second.begin(), file->second.end(), ' ', '-');
              file->second += ".mtx";
              write_matrix_market(directory + file->second, own,
                                  {name + "; terms.csv has the factors with which it enters M, P "
                                          "and Q"},
                                  comm);
            }
            table += std::to_string(number_of_term) + "," + name + "," + bodies_of(*term.matrix) +
                     "," + name_of_sum(order) + "," + std::to_string(order) + "," +
                     exact_text(term.coefficient) + "," + file->second + "\n";
          }
        write_text(directory + "terms.csv", table, comm);
      }

      /// What depends on l otherwise: c (f(l) - 1) A, A a term's matrix or B B^T.
      void write_functions()
      {
        if (equations.relaxation.empty())
          return;
        std::string table   = "function,origin,bodies,factor,form,file,loss_factor,prony_series,"
                              "fractional_zener,viscosity_s\n";
        unsigned int number = 0;
        for (const RelaxationTerm &term : equations.relaxation)
        {
          const bool is_low_rank = bool(term.low_rank);
          const std::string file = is_low_rank ? "modal-damping.mtx" : files.at(term.matrix.get());
          if (is_low_rank)
            write_matrix_market(directory + file, factor_of(*term.low_rank),
                                {"B of the matrix B B^T of damping by measured ratios"}, comm);
          table += std::to_string(++number) + "," + name_of(term.origin) + "," +
                   (is_low_rank ? "all" : bodies_of(*term.matrix)) + "," +
                   exact_text(term.coefficient) + "," + (is_low_rank ? "B B^T" : "A") + "," + file +
                   "," + law_of(term.factor) + "\n";
        }
        write_text(directory + "functions.csv", table, comm);
      }

      void write_modes(const EigenPairs &modes) const
      {
        write_matrix_market(directory + "eigenvalues.mtx", {modes.lambda},
                            {"l, 1/s, in the order of modes.csv"}, comm);
        write_vectors("right_vectors.mtx", "x, (l^2 M + l P + Q) x = 0", modes.right);
        write_vectors("left_vectors.mtx", "z, z^H (l^2 M + l P + Q) = 0", modes.left);
      }

      /// unknowns.csv, nodes.csv and expansion.mtx. A pressure is @p pressure_scale times its
      /// unknown, a tie's traction @p tie_scale times.
      template <int dim>
      void write_unknowns(const FiniteElementSpace<dim> &spaces, const double pressure_scale,
                          const double tie_scale, const Points &points) const
      {
        std::map<types::global_dof_index, Point<dim>> positions;
        DoFTools::map_dofs_to_support_points(spaces.mapping, spaces.nodes, positions);
        const std::vector<std::string> body_of_node = bodies_of_nodes(spaces);
        const IndexSet &owned                       = spaces.nodes.locally_owned_dofs();
        std::vector<std::string> lines(spaces.rows.n_local());
        std::string nodes;
        MatrixMarketFile expansion;
        const unsigned int n_fields = spaces.n_fields();
        expansion.n_rows            = n_fields * spaces.nodes.n_dofs();
        expansion.n_columns         = kept.size;
        for (const auto node : owned)
        {
          std::string place;
          for (unsigned int c = 0; c < 3; ++c)
            place += "," + exact_text(c < dim ? positions.at(node)[c] : 0);
          nodes += std::to_string(node) + "," + body_of_node[owned.index_within_set(node)] + place +
                   "\n";
          for (unsigned int c = 0; c < n_fields; ++c)
          {
            const unsigned int first_stick = spaces.first_stick_field();
            const bool is_tie              = c > dim && c < first_stick;
            const double scale             = c < dim ? 1 : is_tie ? tie_scale : pressure_scale;
            const std::string kind =
                c < dim    ? std::string("displacement,") + "xyz"[c]
                : c == dim ? "multiplier,normal"
                : is_tie   ? std::string("multiplier,") + "xyz"[c - dim - 1]
                           : std::string("multiplier,tangential ") + "eb"[c - first_stick];
            for (const WeightedNode &parent :
                 c < dim ? spaces.expand(node) : spaces.expand_multiplier(node))
              if (const unsigned int row = spaces.field_equation(parent.node, c);
                  row != left_out && kept.has(row))
              {
                expansion.rows.push_back(n_fields * node + c);
                expansion.columns.push_back(kept.number[row]);
                expansion.values.push_back(parent.weight * scale);
              }
            if (const unsigned int row = spaces.field_equation(node, c);
                row != left_out && kept.has(row))
              lines[row - spaces.rows.begin] =
                  std::to_string(kept.number[row]) + "," +
                  bodies.first[bodies.second[row - spaces.rows.begin]] + "," + kind + "," +
                  std::to_string(node) + place + "," + exact_text(scale) + "\n";
          }
        }
        if (is_rank_zero(comm))
        {
          add_points(spaces, points, lines);
          add_superelements(spaces.geometry.superelements, spaces, lines);
        }
        std::string unknowns;
        for (const std::string &line : lines)
          unknowns += line;
        write_table("unknowns.csv", "row,body,kind,component,node,x_m,y_m,z_m,scale\n", unknowns);
        write_table("nodes.csv", "node,body,x_m,y_m,z_m\n", nodes);
        const std::string n = std::to_string(n_fields);
        write_matrix_market(
            directory + "expansion.mtx", expansion,
            {"E: E x has for each line of nodes.csv " + n + " rows, the " +
             (dim == 3 ? "displacements x, y, z (m)" : "displacements x, y (m)") +
             ", the contact pressure" + (spaces.has_ties() ? " and the tractions of ties" : "") +
             (spaces.geometry.has_stick() ? " and the tangential tractions e, b of stick contacts"
                                          : "") +
             " (Pa)"},
            comm);
      }

    private:
      /// The lines of the motions of points and of the multipliers that define and link them.
      template <int dim>
      void add_points(const FiniteElementSpace<dim> &spaces, const Points &points,
                      std::vector<std::string> &lines) const
      {
        static const std::array<std::string, 6> motions = {
            {"x", "y", "z", "about_x", "about_y", "about_z"}};
        const unsigned int n_points = points.places.size(),
                           n_links  = spaces.geometry.point_joints.links.size();
        const auto add = [&](const unsigned int row, const std::string &kind, const unsigned int p,
                             const unsigned int k, const double scale)
        {
          if (!kept.has(row))
            return;
          std::string place;
          for (unsigned int c = 0; c < 3; ++c)
            place += "," + exact_text(points.places[p][c]);
          lines[row] = std::to_string(kept.number[row]) + "," + bodies.first[bodies.second[row]] +
                       "," + kind + "," + motions[k] + "," + place + "," + exact_text(scale) + "\n";
        };
        for (unsigned int k = 0; k < 6; ++k)
        {
          for (unsigned int p = 0; p < n_points; ++p)
          {
            add(spaces.point(p, k), "point", p, k, k < 3 ? 1 : 1 / points.lengths[p]);
            add(spaces.point_multiplier(p, k), "multiplier", p, k, 1);
          }
          for (unsigned int l = 0; l < n_links; ++l)
            add(spaces.point_multiplier(n_points + l, k), "multiplier",
                spaces.geometry.point_joints.links[l].first, k, 1);
        }
      }

      /// The lines of the coordinates of superelements and of the multipliers that hold nodes.
      template <int dim>
      void add_superelements(const std::vector<Superelement> &superelements,
                             const FiniteElementSpace<dim> &spaces,
                             std::vector<std::string> &lines) const
      {
        for (unsigned int k = 0; k < superelements.size(); ++k)
        {
          const Superelement &element = superelements[k];
          unsigned int multiplier     = spaces.superelement_multiplier(k);
          const auto add              = [&](const unsigned int row, const std::string &kind,
                               const unsigned int n, const std::string &component)
          {
            std::string place = ",,,";
            if (n < element.nodes.size())
            {
              place.clear();
              for (unsigned int c = 0; c < 3; ++c)
                place += "," + exact_text(element.nodes[n][c]);
            }
            if (kept.has(row))
              lines[row] = std::to_string(kept.number[row]) + "," +
                           bodies.first[bodies.second[row]] + "," + kind + "," + component + "," +
                           place + ",1\n";
          };
          for (unsigned int n = 0; n < element.nodes.size(); ++n)
            for (unsigned int c = 0; c < 3; ++c)
            {
              add(spaces.superelement(k) + 3 * n + c, "superelement", n, std::string(1, "xyz"[c]));
              if (element.is_held[n])
                add(multiplier++, "multiplier", n, std::string(1, "xyz"[c]));
            }
          for (unsigned int i = 3 * element.nodes.size(); i < element.size(); ++i)
            add(spaces.superelement(k) + i, "superelement", element.nodes.size(), "internal");
        }
      }

      /// B = [sqrt(c_k) b_k], weights being positive.
      MatrixMarketFile factor_of(const LowRank &low_rank) const
      {
        MatrixMarketFile own;
        own.n_rows    = kept.size;
        own.n_columns = low_rank.weights.size();
        for (unsigned int k = 0; k < low_rank.weights.size(); ++k)
          for (unsigned int i = 0; i < low_rank.vectors.n_local(); ++i)
            if (const double value = std::sqrt(low_rank.weights[k]) * low_rank.vectors.column(k)[i];
                value != 0 && kept.has(equations.rows.begin + i))
            {
              own.rows.push_back(kept.number[equations.rows.begin + i]);
              own.columns.push_back(k);
              own.values.push_back(value);
            }
        return own;
      }

      /// The constants of f as the last columns of functions.csv; a table's fit is added to the
      /// others.
      static std::string law_of(const StiffnessFactor &factor)
      {
        std::string series, zener;
        for (const auto *part : {&factor.prony, &factor.fit.prony})
          for (const StiffnessFactor::Relaxation &element : *part)
            series += (series.empty() ? "" : " ") + exact_text(element.strength) + ":" +
                      exact_text(element.time);
        if (factor.zener.ratio != 1)
          zener = exact_text(factor.zener.ratio) + ":" + exact_text(factor.zener.time) + ":" +
                  exact_text(factor.zener.order);
        return exact_text(factor.loss_factor + factor.fit.loss_factor) + "," + series + "," +
               zener + "," + exact_text(factor.viscosity);
      }

      static std::string name_of_sum(const unsigned int order)
      {
        return order == 0 ? "Q" : order == 1 ? "P" : "M";
      }

      /// Names of the bodies on whose rows a matrix acts, as "rotor+upper". Collective.
      std::string bodies_of(const Matrix &matrix) const
      {
        std::vector<int> acts(bodies.first.size(), 0);
        for_entries(matrix,
                    [&](const unsigned int row, unsigned int, double)
                    {
                      if (kept.has(row))
                        acts[bodies.second[row - equations.rows.begin]] = 1;
                    });
        MPI_Allreduce(MPI_IN_PLACE, acts.data(), acts.size(), MPI_INT, MPI_MAX, comm);
        std::string names;
        for (unsigned int body = 0; body < acts.size(); ++body)
          if (acts[body] == 1)
            names += (names.empty() ? "" : "+") + bodies.first[body];
        return names;
      }

      /// Names of the bodies of own nodes.
      template <int dim>
      std::vector<std::string> bodies_of_nodes(const FiniteElementSpace<dim> &spaces) const
      {
        std::map<types::material_id, std::string> names;
        for (const auto &[name, body] : spaces.geometry.named_bodies())
          names[body] = name;
        const IndexSet &owned = spaces.nodes.locally_owned_dofs();
        std::vector<std::string> result(owned.n_elements());
        std::vector<types::global_dof_index> cell_nodes(spaces.fe.n_dofs_per_cell());
        for (const auto &cell : spaces.nodes.active_cell_iterators())
          if (!cell->is_artificial())
          {
            cell->get_dof_indices(cell_nodes);
            for (const auto node : cell_nodes)
              if (owned.is_element(node))
                result[owned.index_within_set(node)] =
                    names[spaces.geometry.parts[cell->material_id()].body];
          }
        return result;
      }

      void write_vectors(const std::string &name, const std::string &meaning,
                         const ComplexMultiVector &vectors) const
      {
        std::vector<std::vector<std::complex<double>>> columns(vectors.n_columns());
        for (unsigned int j = 0; j < columns.size(); ++j)
        {
          std::vector<double> parts;
          for (unsigned int i = 0; i < vectors.re.n_local(); ++i)
            if (kept.has(equations.rows.begin + i))
              parts.insert(parts.end(), {vectors.re.column(j)[i], vectors.im.column(j)[i]});
          gather(parts, MPI_DOUBLE, comm);
          if (is_rank_zero(comm))
            for (std::size_t k = 0; k < parts.size(); k += 2)
              columns[j].emplace_back(parts[k], parts[k + 1]);
        }
        write_matrix_market(directory + name, columns, {meaning + "; a column for each eigenvalue"},
                            comm);
      }

      /// A table of lines that each rank has some of.
      void write_table(const std::string &name, const std::string &header,
                       const std::string &own_lines) const
      {
        write_in_pieces(directory + name, once((is_rank_zero(comm) ? header : "") + own_lines),
                        comm);
      }

      const EquationsOfMotion &equations;
      const MPI_Comm comm;
      const std::pair<std::vector<std::string>, std::vector<unsigned int>> &bodies;
      const std::string directory;
      Selection kept;
      std::map<const Matrix *, std::string> files; ///< of the terms' matrices
    };
  } // namespace

  std::string names_of_exported_files()
  {
    return "(M|P|Q|term-[0-9].*|eigenvalues|(right|left)_vectors|expansion|superelement-[KMD]|"
           "modal-damping)\\."
           "mtx|"
           "(terms|functions|unknowns|nodes|superelement-nodes)\\.csv";
  }

  template <int dim>
  void export_matrices(const BrakeModel<dim> &model, const EquationsOfMotion &equations,
                       const EigenPairs &modes, const std::string &directory)
  {
    const auto bodies = model.bodies_of_rows();
    Export files(equations, bodies, directory);
    files.write_sums();
    files.write_terms();
    files.write_functions();
    files.write_modes(modes);
    files.write_unknowns(model.spaces(), model.contact() ? model.contact()->pressure_scale() : 1,
                         model.ties().scale, model.points());
  }

  void export_matrices(const MatrixModel &model, const EigenPairs &modes,
                       const std::string &directory)
  {
    const EquationsOfMotion equations = model.equations();
    const auto bodies                 = model.bodies_of_rows();
    Export files(equations, bodies, directory);
    files.write_sums();
    files.write_terms();
    files.write_functions();
    files.write_modes(modes);
  }

  template void export_matrices(const BrakeModel<2> &, const EquationsOfMotion &,
                                const EigenPairs &, const std::string &);
  template void export_matrices(const BrakeModel<3> &, const EquationsOfMotion &,
                                const EigenPairs &, const std::string &);
} // namespace squeal
