#include <squeal/contact/contact_matrices.h>
#include <squeal/statics/contact_edge.h>

#include <cstdlib>

namespace squeal
{
  namespace
  {
    /// The given rows of a block, on all ranks: one row each.
    DenseMatrix rows_of(const MultiVector &block, const std::vector<unsigned int> &numbers)
    {
      return transposed(gather_rows(block, numbers));
    }

    /// Multipliers, pressures with their tangential tractions, of nodes next to each other on a
    /// pad's face of which one is closed, the other open: the closed ones and the open ones,
    /// ascending, the same on all ranks.
    template <int dim>
    std::array<std::vector<unsigned int>, 2> multipliers_beside_edge(const Contact<dim> &contact,
                                                                     const RowRange &rows)
    {
      const unsigned int n_1d = contact.face_element().degree() + 1;
      const auto adjacent     = [n_1d](const unsigned int a, const unsigned int b)
      {
        const int across = int(a % n_1d) - int(b % n_1d), along = int(a / n_1d) - int(b / n_1d);
        return std::abs(across) <= 1 && std::abs(along) <= 1;
      };
      std::vector<char> marked(rows.size);
      for (const PairedInterface<dim> &interface : contact.paired_interfaces())
        for (const ContactFace<dim> &face : interface.pad_faces)
          for (unsigned int a = 0; a < face.nodes.size(); ++a)
            for (unsigned int b = 0; b < face.nodes.size(); ++b)
              for (unsigned int k = 0; adjacent(a, b) && k < face.nodes[a].size(); ++k)
                for (const FreeNode<dim> &other : face.nodes[b])
                {
                  const int row = face.nodes[a][k].equations[dim], beside = other.equations[dim];
                  if (row >= 0 && beside >= 0 &&
                      contact.is_closed(row) != contact.is_closed(beside))
                    marked[row] = true;
                }
      MPI_Allreduce(MPI_IN_PLACE, marked.data(), marked.size(), MPI_CHAR, MPI_MAX, rows.comm);
      std::array<std::vector<unsigned int>, 2> result;
      for (unsigned int row = 0; row < rows.size; ++row)
        if (marked[row])
          for (const unsigned int changed : contact.with_tractions(row))
            result[contact.is_closed(row) ? 0 : 1].push_back(changed);
      return result;
    }

    /// The inverse in the directions that static solutions, right to some ten digits, can tell from
    /// those without stiffness.
    DenseMatrix inverse_of(DenseMatrix a)
    {
      return pseudo_inverse(std::move(a), 1e-8);
    }

    /// L^H A R of complex L and R, and the parts of its diagonal by row.
    struct Form
    {
      Form(const DenseMatrix &l_re, const DenseMatrix &l_im, const DenseMatrix &A,
           const DenseMatrix &r_re, const DenseMatrix &r_im)
      {
        if (A.n_rows == 0)
        {
          values.resize(std::size_t(l_re.n_columns) * r_re.n_columns);
          return;
        }
        const auto product = [](const bool transpose, const DenseMatrix &a, const DenseMatrix &b)
        {
          DenseMatrix c(transpose ? a.n_columns : a.n_rows, b.n_columns);
          gemm(transpose, 1, a, b, 0, c);
          return c;
        };
        const DenseMatrix a_re = product(false, A, r_re), a_im = product(false, A, r_im);
        const DenseMatrix rr = product(true, l_re, a_re), ri = product(true, l_re, a_im),
                          ir = product(true, l_im, a_re), ii = product(true, l_im, a_im);
        for (std::size_t k = 0; k < rr.values.size(); ++k)
          values.emplace_back(rr.values[k] + ii.values[k], ri.values[k] - ir.values[k]);
        for (unsigned int i = 0; i < A.n_rows; ++i)
        {
          parts.emplace_back();
          for (unsigned int j = 0; j < r_re.n_columns; ++j)
            parts.back().push_back(std::complex<double>(l_re(i, j), -l_im(i, j)) *
                                   std::complex<double>(a_re(i, j), a_im(i, j)));
        }
      }
      std::vector<std::complex<double>> values;
      std::vector<std::vector<std::complex<double>>> parts;
    };
  } // namespace

  template <int dim>
  ContactEdge find_contact_edge(const Contact<dim> &contact, const ContactPressure &pressure,
                                const RowRange &rows, const bool with_friction,
                                const ColumnSolver &solve)
  {
    ContactEdge edge;
    if (!contact.contact_model().mortar)
      return edge;
    std::array<std::vector<unsigned int>, 2> beside = multipliers_beside_edge(contact, rows);
    edge.releasing                                  = std::move(beside[0]);
    edge.closing                                    = std::move(beside[1]);
    if (!edge.releasing.empty())
    {
      edge.slack =
          rows_of(solve(unit_columns(rows, edge.releasing), edge.releasing), edge.releasing);
      edge.slack = inverse_of(std::move(edge.slack));
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
      edge.pressure = inverse_of(std::move(c));
    }
    return edge;
  }

  EdgeEffects edge_effects(const ContactEdge &edge, const ComplexMultiVector &x,
                           const ComplexMultiVector &z)
  {
    EdgeEffects effects;
    const std::vector<unsigned int> &R = edge.releasing, &C = edge.closing;
    if (R.empty() && C.empty())
      return effects;
    const Form opening(rows_of(z.re, R), rows_of(z.im, R), edge.slack, rows_of(x.re, R),
                       rows_of(x.im, R));
    // Neither vector has a pressure in C: a^T z and b x are whole columns and rows of the matrix.
    const Form closing(rows_of(multiply_transposed(edge.closed, z.re), C),
                       rows_of(multiply_transposed(edge.closed, z.im), C), edge.pressure,
                       rows_of(multiply(edge.closed, x.re), C),
                       rows_of(multiply(edge.closed, x.im), C));
    for (unsigned int k = 0; k < opening.values.size(); ++k)
    {
      const std::complex<double> F_o = opening.values[k], F_c = -closing.values[k];
      effects.smaller.push_back(3. / 8 * F_o - 1. / 8 * F_c);
      effects.larger.push_back(3. / 8 * F_c - 1. / 8 * F_o);
    }
    for (const Form *form : {&opening, &closing})
      for (std::vector<std::complex<double>> parts : form->parts)
      {
        for (std::complex<double> &part : parts)
          part *= 3. / 8;
        effects.parts.push_back(std::move(parts));
      }
    effects.rows = R;
    effects.rows.insert(effects.rows.end(), C.begin(), C.end());
    return effects;
  }

  template ContactEdge find_contact_edge(const Contact<2> &, const ContactPressure &,
                                         const RowRange &, bool, const ColumnSolver &);
  template ContactEdge find_contact_edge(const Contact<3> &, const ContactPressure &,
                                         const RowRange &, bool, const ColumnSolver &);
} // namespace squeal
