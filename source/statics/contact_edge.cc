#include <squeal/contact/contact_forces.h>
#include <squeal/contact/contact_matrices.h>
#include <squeal/statics/contact_edge.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace squeal
{
  namespace
  {
    /// The given rows of a block, on all ranks: one row each.
    DenseMatrix rows_of(const MultiVector &block, const std::vector<unsigned int> &numbers)
    {
      return gather_rows(block, numbers).transpose();
    }
    ComplexDenseMatrix rows_of(const ComplexMultiVector &block,
                               const std::vector<unsigned int> &numbers)
    {
      return to_complex(rows_of(block.real_span(), numbers));
    }

    /// Sets R and C, pressures with their tangential tractions, of nodes next to each other on a
    /// pad's face of which one is closed, the other open: ascending, the same on all ranks.
    template <int dim>
    void find_multipliers_beside_edge(const Contact<dim> &contact, const RowRange &rows,
                                      ContactEdge &edge)
    {
      const unsigned int n_1d = contact.face_element().degree() + 1;
      const auto adjacent     = [n_1d](const unsigned int a, const unsigned int b)
      {
        const int across = int(a % n_1d) - int(b % n_1d), along = int(a / n_1d) - int(b / n_1d);
        return std::abs(across) <= 1 && std::abs(along) <= 1;
      };
      const auto &interfaces = contact.paired_interfaces();
      unsigned int finest    = 0;
      for (const PairedInterface<dim> &interface : interfaces)
        for (const ContactFace<dim> &face : interface.pad_faces)
          finest = std::max(finest, face.level);
      MPI_Allreduce(MPI_IN_PLACE, &finest, 1, MPI_UNSIGNED, MPI_MAX, rows.comm);
      for (unsigned int level = 0; level <= finest; ++level)
        for (unsigned int i = 0; i < interfaces.size(); ++i)
          edge.parts.push_back({i, level});

      // The part's number plus one; of a node of several levels the finest one's
      std::vector<unsigned int> marked(rows.size);
      for (unsigned int i = 0; i < interfaces.size(); ++i)
        for (const ContactFace<dim> &face : interfaces[i].pad_faces)
          for (unsigned int a = 0; a < face.nodes.size(); ++a)
            for (unsigned int b = 0; b < face.nodes.size(); ++b)
              for (unsigned int k = 0; adjacent(a, b) && k < face.nodes[a].size(); ++k)
                for (const FreeNode<dim> &other : face.nodes[b])
                {
                  const int row = face.nodes[a][k].equations[dim], beside = other.equations[dim];
                  if (row >= 0 && beside >= 0 &&
                      contact.is_closed(row) != contact.is_closed(beside))
                    marked[row] =
                        std::max<unsigned int>(marked[row], face.level * interfaces.size() + i + 1);
                }
      MPI_Allreduce(MPI_IN_PLACE, marked.data(), marked.size(), MPI_UNSIGNED, MPI_MAX, rows.comm);
      for (unsigned int row = 0; row < rows.size; ++row)
        if (marked[row])
          for (const unsigned int changed : contact.with_tractions(row))
          {
            const bool is_closed = contact.is_closed(row);
            (is_closed ? edge.releasing : edge.closing).push_back(changed);
            (is_closed ? edge.releasing_at : edge.closing_at).push_back(marked[row] - 1);
          }
    }

    /// |sum a_i (A a)_i| / 2 of each part of an interface that slides; zero of the others, by which
    /// the position of the edge has not been measured.
    template <int dim>
    std::vector<double> energies(const Contact<dim> &contact, const DenseMatrix &A,
                                 const DenseMatrix &a, const std::vector<ContactEdge::Part> &parts,
                                 const std::vector<unsigned int> &part_of_row)
    {
      const DenseMatrix answer = A * a;
      std::vector<double> result(parts.size());
      for (unsigned int i = 0; i < part_of_row.size(); ++i)
        if (contact.slides(parts[part_of_row[i]].interface))
          result[part_of_row[i]] += a(i, 0) * answer(i, 0) / 2;
      for (double &energy : result)
        energy = std::abs(energy);
      return result;
    }

    /// The inverse in the directions that static solutions, right to some ten digits, can tell from
    /// those without stiffness.
    DenseMatrix inverse_of(DenseMatrix a)
    {
      return pseudo_inverse(std::move(a), 1e-8);
    }

    /// L^H A R: the summands of each group of rows, and by row what they add to the diagonal.
    struct Form
    {
      Form(const ComplexDenseMatrix &l, const DenseMatrix &A, const ComplexDenseMatrix &r,
           const std::vector<unsigned int> &groups, const unsigned int n_groups)
          : by_group(n_groups, Effect(std::size_t(l.n_columns) * r.n_columns))
      {
        if (A.n_rows == 0)
          return;
        const ComplexDenseMatrix a_r = A * r;
        for (unsigned int group = 0; group < n_groups; ++group)
        {
          ComplexDenseMatrix own = l;
          for (unsigned int j = 0; j < own.n_columns; ++j)
            for (unsigned int i = 0; i < own.n_rows; ++i)
              if (groups[i] != group)
                own(i, j) = 0;
          by_group[group] = (own.adjoint() * a_r).values;
        }
        for (unsigned int i = 0; i < A.n_rows; ++i)
        {
          parts.emplace_back();
          for (unsigned int j = 0; j < r.n_columns; ++j)
            parts.back().push_back(std::conj(l(i, j)) * a_r(i, j));
        }
      }
      using Effect = EdgeEffects::Effect;
      std::vector<Effect> by_group;
      std::vector<std::vector<std::complex<double>>> parts;
    };

    /// Where a part of the edge is: shifts of the present one towards the open nodes, in spacings.
    struct EdgePosition
    {
      double smaller = -0.5, likeliest = 0, larger = 0.5;
    };

    /// s of EdgeEffects. @p opening and @p closing: F_o and F_c of the part.
    EdgePosition position_of(const ContactEdge &edge, const unsigned int part,
                             const EdgeEffects::Effect &opening, const EdgeEffects::Effect &closing,
                             const unsigned int n_modes)
    {
      constexpr double largest_q = 1.2, accuracy = 0.2;
      const auto of_modes = [n_modes](const EdgeEffects::Effect &effect)
      {
        double sum = 0;
        for (unsigned int j = 0; j < n_modes; ++j)
          sum += std::abs(effect[j + n_modes * j]);
        return sum;
      };
      const auto energy = [part](const std::vector<double> &of_parts)
      { return part < of_parts.size() ? of_parts[part] : 0; };
      const double released = energy(edge.release_energy) * of_modes(closing),
                   closed   = energy(edge.closing_energy) * of_modes(opening);
      if (!(closed <= largest_q * largest_q * released) || closed == 0)
        return {};
      const double q = std::sqrt(closed / released), s = (1 - q) / (1 + q) / 2 - 0.2;
      return {s - accuracy, s, s + accuracy};
    }
  } // namespace

  template <int dim>
  ContactEdge find_contact_edge(const Contact<dim> &contact, const ContactPressure &pressure,
                                const RowRange &rows, const bool with_friction,
                                const MultiVector &state, const ColumnSolver &solve)
  {
    ContactEdge edge;
    if (!contact.contact_model().mortar)
      return edge;
    find_multipliers_beside_edge(contact, rows, edge);
    if (!edge.releasing.empty())
    {
      edge.slack =
          rows_of(solve(unit_columns(rows, edge.releasing), edge.releasing), edge.releasing);
      edge.slack          = inverse_of(std::move(edge.slack));
      edge.release_energy = energies(contact, edge.slack, rows_of(state, edge.releasing),
                                     edge.parts, edge.releasing_at);
    }
    if (!edge.closing.empty())
    {
      Contact<dim> wider = contact;
      wider.set_closed(edge.closing, true);
      const Matrix normal   = normal_matrix(wider),
                   friction = with_friction ? friction_matrix(wider, pressure) : Matrix();
      edge.closed           = sum_of(rows, {{1., normal}, {1., friction}});
      MultiVector a         = multiply(edge.closed, unit_columns(rows, edge.closing));
      DenseMatrix c         = rows_of(a, edge.closing);
      clear_rows(a, edge.closing);
      const DenseMatrix b_y = rows_of(multiply(edge.closed, solve(a, edge.closing)), edge.closing);
      for (std::size_t k = 0; k < c.values.size(); ++k)
        c.values[k] -= b_y.values[k];
      edge.pressure    = inverse_of(std::move(c));
      DenseMatrix gaps = rows_of(multiply(edge.closed, state), edge.closing);
      const DenseMatrix initial =
          rows_of(contact_load(wider, pressure, with_friction), edge.closing);
      for (unsigned int i = 0; i < gaps.n_rows; ++i)
        gaps(i, 0) -= initial(i, 0);
      edge.closing_energy = energies(contact, edge.pressure, gaps, edge.parts, edge.closing_at);
    }
    return edge;
  }

  EdgeEffects edge_effects(const ContactEdge &edge, const ComplexMultiVector &x,
                           const ComplexMultiVector &z)
  {
    using Effect = EdgeEffects::Effect;
    EdgeEffects effects;
    const std::vector<unsigned int> &R = edge.releasing, &C = edge.closing;
    if (R.empty() && C.empty())
      return effects;
    const unsigned int n_parts = edge.parts.size();
    const Form opening(rows_of(z, R), edge.slack, rows_of(x, R), edge.releasing_at, n_parts);
    // Neither vector has a pressure in C: a^T z and b x are whole columns and rows of the matrix.
    const ComplexMultiVector a_z(multiply_transposed(edge.closed, z.re),
                                 multiply_transposed(edge.closed, z.im));
    Form closing(rows_of(a_z, C), edge.pressure, rows_of(multiply(edge.closed, x), C),
                 edge.closing_at, n_parts);
    for (Effect &effect : closing.by_group)
      for (std::complex<double> &entry : effect)
        entry = -entry;

    const unsigned int m = x.n_columns();
    const Effect none(std::size_t(m) * m);
    effects.opening = effects.closing = none;
    effects.by_level.assign(n_parts > 0 ? edge.parts.back().level + 1 : 0, {none, none, none});
    // F(s) = (s^2 - s)/2 F_o + (s^2 + s)/2 F_c
    const auto of_opening = [](const double s) { return (s * s - s) / 2; };
    const auto of_closing = [](const double s) { return (s * s + s) / 2; };
    std::vector<double> largest_of_opening, largest_of_closing;
    for (unsigned int i = 0; i < n_parts; ++i)
    {
      const Effect &F_o = opening.by_group[i], &F_c = closing.by_group[i];
      const EdgePosition at       = position_of(edge, i, F_o, F_c, m);
      EdgeEffects::Shifts &shifts = effects.by_level[edge.parts[i].level];
      const auto F                = [&](const std::size_t k, const double s)
      { return of_opening(s) * F_o[k] + of_closing(s) * F_c[k]; };
      for (std::size_t k = 0; k < F_o.size(); ++k)
      {
        effects.opening[k] += F_o[k];
        effects.closing[k] += F_c[k];
        shifts.smaller[k] += F(k, at.smaller);
        shifts.likeliest[k] += F(k, at.likeliest);
        shifts.larger[k] += F(k, at.larger);
      }
      std::vector<std::complex<double>> &here = effects.by_interface[edge.parts[i].interface];
      here.resize(m);
      for (unsigned int j = 0; j < m; ++j)
      {
        const std::size_t jj               = j * (std::size_t(m) + 1);
        const std::complex<double> smaller = F(jj, at.smaller), larger = F(jj, at.larger);
        here[j] += std::abs(smaller) > std::abs(larger) ? smaller : larger;
      }
      const auto largest = [&](const auto &weight)
      { return std::max(std::abs(weight(at.smaller)), std::abs(weight(at.larger))); };
      largest_of_opening.push_back(largest(of_opening));
      largest_of_closing.push_back(largest(of_closing));
    }
    const auto add_parts = [&](const Form &form, const std::vector<unsigned int> &part_of_row,
                               const std::vector<double> &weights)
    {
      for (unsigned int i = 0; i < form.parts.size(); ++i)
      {
        effects.parts.push_back(form.parts[i]);
        for (std::complex<double> &part : effects.parts.back())
          part *= weights[part_of_row[i]];
      }
    };
    add_parts(opening, edge.releasing_at, largest_of_opening);
    add_parts(closing, edge.closing_at, largest_of_closing);
    effects.rows = R;
    effects.rows.insert(effects.rows.end(), C.begin(), C.end());
    return effects;
  }

  template ContactEdge find_contact_edge(const Contact<2> &, const ContactPressure &,
                                         const RowRange &, bool, const MultiVector &,
                                         const ColumnSolver &);
  template ContactEdge find_contact_edge(const Contact<3> &, const ContactPressure &,
                                         const RowRange &, bool, const MultiVector &,
                                         const ColumnSolver &);
} // namespace squeal
