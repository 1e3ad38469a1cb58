#include <squeal/assessment/stability.h>
#include <squeal/bars/changed_edges.h>
#include <squeal/equations/term_list.h>
#include <squeal/linalg/factorization.h>
#include <squeal/mesh/finite_element_space.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

// Other edges of contact joints as changes of low rank. SmallProblems solves them for the modes of
// a window, whatever changes: static answers by factors, products with all bases once, then small
// quadratic eigenproblems, one for each change. changed_edges() tells what changes, R and C of each
// contact, and in which directions where that would empty it.

namespace squeal
{
  using Complex = std::complex<double>;
  using Effect  = std::vector<Complex>;

  namespace
  {
    /// Small problems whose vectors are combinations of [Re X, Im X, Y_1, ...] and [Re Z, Im Z,
    /// Y_1, ...]: products with all of them are formed once.
    class SmallProblems
    {
    public:
      SmallProblems(const std::vector<EdgeChange> &changes, const ContactEdge &edge,
                    const EquationsOfMotion &equations, const EigenPairs &modes);
      /// F of a change.
      Effect effect_of(unsigned int change) const;

    private:
      void find_answers(const std::vector<EdgeChange> &changes, const ContactEdge &edge,
                        const EquationsOfMotion &equations, MultiVector &right, MultiVector &left);
      /// The coefficients of X' or Z': unit vectors less T of the answers.
      ComplexDenseMatrix coefficients(unsigned int change, const ComplexDenseMatrix &t) const;
      /// F of the quadratic problem's eigenvalues and vectors nearest to those before.
      Effect effect_of(const ComplexDenseMatrix &mass, const ComplexDenseMatrix &damping,
                       const ComplexDenseMatrix &stiffness) const;

      const std::vector<Complex> &lambda;
      const unsigned int m;
      std::vector<unsigned int> first; ///< of each change's answers in the bases
      std::vector<ComplexDenseMatrix> t_right, t_left;
      std::array<DenseMatrix, 3> products; ///< by order
      struct Relaxing
      {
        DenseMatrix products;
        std::vector<Complex> factors; ///< c (f(l_j) - 1)
      };
      std::vector<Relaxing> relaxing;
    };

    SmallProblems::SmallProblems(const std::vector<EdgeChange> &changes, const ContactEdge &edge,
                                 const EquationsOfMotion &equations, const EigenPairs &modes)
        : lambda(modes.lambda), m(modes.size())
    {
      MultiVector right = modes.right.real_span(), left = modes.left.real_span();
      find_answers(changes, edge, equations, right, left);
      const std::vector<MultiVector> images = TermList(equations.terms).multiply_all(right);
      for (unsigned int order = 0; order < 3; ++order)
        products[order] = inner_products(left, images[order]);
      for (const RelaxationTerm &term : equations.relaxation)
        if (!term.low_rank)
        {
          relaxing.push_back({inner_products(left, multiply(*term.matrix, right)), {}});
          for (const Complex l : lambda)
            relaxing.back().factors.push_back(term.coefficient * (term.factor(l) - 1.));
        }
    }

    /// Appends the answers to both bases.
    void SmallProblems::find_answers(const std::vector<EdgeChange> &changes,
                                     const ContactEdge &edge, const EquationsOfMotion &equations,
                                     MultiVector &right, MultiVector &left)
    {
      const RowRange &rows = equations.rows;
      const Factorization factors(sum_of(rows, equations.terms, 0), Factorization::Kind::lu,
                                  "the position terms for the bars of contact joints");
      const auto times = [&](const MultiVector &block, const bool transposed) {
        return transposed ? multiply_transposed(edge.closed, block) : multiply(edge.closed, block);
      };
      for (const EdgeChange &change : changes)
      {
        const MultiVector x = right.columns(0, 2 * m), z = left.columns(0, 2 * m);
        const auto v = [&](const MultiVector &block) -> DenseMatrix
        { return change.directions.transpose() * gather_rows(block, change.rows).transpose(); };
        // E_R D, or a and b^T
        MultiVector sources[2];
        for (const bool of_left : {false, true})
        {
          const MultiVector unit = unit_columns(rows, change.rows);
          sources[of_left] = change.opens ? combine(unit, change.directions) : times(unit, of_left);
        }
        DenseMatrix c = v(sources[0]);
        for (MultiVector &source : sources)
          if (!change.opens)
            clear_rows(source, change.rows);
        const MultiVector y_right = factors.solve(sources[0]),
                          y_left  = factors.solve_transposed(sources[1]);
        DenseMatrix S             = v(change.opens ? y_right : times(y_right, false));
        if (!change.opens)
          S -= c;
        // Static answers, right to some ten digits, tell no stiffness below that.
        const DenseMatrix inverse = pseudo_inverse(std::move(S), 1e-8);
        t_right.push_back(to_complex(inverse * v(change.opens ? x : times(x, false))));
        t_left.push_back(to_complex(inverse.transpose() * v(change.opens ? z : times(z, true))));
        first.push_back(right.n_columns());
        right.append(y_right);
        left.append(y_left);
      }
    }

    ComplexDenseMatrix SmallProblems::coefficients(const unsigned int change,
                                                   const ComplexDenseMatrix &t) const
    {
      ComplexDenseMatrix result(products[0].n_rows, m);
      for (unsigned int j = 0; j < m; ++j)
      {
        result(j, j)     = 1;
        result(m + j, j) = Complex(0, 1);
        for (unsigned int i = 0; i < t.n_rows; ++i)
          result(first[change] + i, j) = -t(i, j);
      }
      return result;
    }

    Effect SmallProblems::effect_of(const unsigned int change) const
    {
      const ComplexDenseMatrix x = coefficients(change, t_right[change]),
                               z = coefficients(change, t_left[change]);
      const auto projected       = [&](const DenseMatrix &of_bases) -> ComplexDenseMatrix
      { return z.adjoint() * (of_bases * x); };
      ComplexDenseMatrix stiffness = projected(products[0]);
      for (const Relaxing &term : relaxing)
      {
        ComplexDenseMatrix part = projected(term.products);
        stiffness += part.scale(term.factors);
      }
      return effect_of(projected(products[2]), projected(products[1]), stiffness);
    }

    Effect SmallProblems::effect_of(const ComplexDenseMatrix &mass,
                                    const ComplexDenseMatrix &damping,
                                    const ComplexDenseMatrix &stiffness) const
    {
      double size = 0;
      for (const Complex l : lambda)
        size = std::max(size, std::abs(l));
      // l = size t:  [0, 1; -M^{-1} Q / size^2, -M^{-1} P / size] [y; t y] = t [y; t y]
      const LuFactors<Complex> factors(mass);
      const ComplexDenseMatrix q = factors.solve(stiffness), p = factors.solve(damping);
      ComplexDenseMatrix companion(2 * m, 2 * m);
      for (unsigned int j = 0; j < m; ++j)
      {
        companion(j, m + j) = 1;
        for (unsigned int i = 0; i < m; ++i)
        {
          companion(m + i, j)     = -q(i, j) / (size * size);
          companion(m + i, m + j) = -p(i, j) / size;
        }
      }
      // Keep the m pairs above the real axis: the others are near their conjugates, and have nearly
      // their vectors.
      const DenseEigenpairs all = general_eigen(std::move(companion));
      std::vector<unsigned int> upper(2 * m);
      std::iota(upper.begin(), upper.end(), 0u);
      std::sort(upper.begin(), upper.end(),
                [&](const unsigned int a, const unsigned int b)
                {
                  const Complex l = all.values[a], other = all.values[b];
                  return std::make_pair(l.imag(), l.real()) >
                         std::make_pair(other.imag(), other.real());
                });
      upper.resize(m);
      std::vector<std::vector<double>> costs(m);
      for (const unsigned int k : upper)
      {
        double square = 0;
        for (unsigned int i = 0; i < m; ++i)
          square += std::norm(all.right(i, k));
        for (unsigned int j = 0; j < m; ++j)
          costs[j].push_back(1 - std::norm(all.right(j, k)) / square +
                             std::abs(all.values[k] - lambda[j] / size));
      }
      const std::vector<int> partners = assign(costs, m);
      // F = V diag(l') V^{-1} - diag(l), by its transpose
      ComplexDenseMatrix vectors(m, m), scaled(m, m);
      for (unsigned int j = 0; j < m; ++j)
        for (unsigned int i = 0; i < m; ++i)
        {
          vectors(j, i) = all.right(i, upper[partners[j]]);
          scaled(j, i)  = size * all.values[upper[partners[j]]] * vectors(j, i);
        }
      const ComplexDenseMatrix f =
          LuFactors<Complex>(std::move(vectors)).solve(std::move(scaled)).transpose();
      Effect result = f.values;
      for (unsigned int j = 0; j < m; ++j)
        result[j * (m + 1)] -= lambda[j];
      return result;
    }

    /// The rows of a list that belong to an interface.
    std::vector<unsigned int> rows_at(const std::vector<unsigned int> &rows,
                                      const std::vector<unsigned int> &part_of_row,
                                      const ContactEdge &edge, const unsigned int interface)
    {
      std::vector<unsigned int> result;
      for (unsigned int i = 0; i < rows.size(); ++i)
        if (edge.parts[part_of_row[i]].interface == interface)
          result.push_back(rows[i]);
      return result;
    }

    /// The closed pressures of an interface, ascending, the same on all ranks.
    template <int dim>
    std::vector<unsigned int> closed_pressures(const Contact<dim> &contact,
                                               const unsigned int interface)
    {
      const RowRange &rows = contact.spaces().rows;
      std::vector<char> is_one(rows.size);
      for (const ContactFace<dim> &face : contact.paired_interfaces()[interface].pad_faces)
        for (const auto &nodes : face.nodes)
          for (const FreeNode<dim> &node : nodes)
            if (const int row = node.equations[dim]; row >= 0 && contact.is_closed(row))
              is_one[row] = 1;
      MPI_Allreduce(MPI_IN_PLACE, is_one.data(), is_one.size(), MPI_CHAR, MPI_MAX, rows.comm);
      std::vector<unsigned int> result;
      for (unsigned int row = 0; row < rows.size; ++row)
        if (is_one[row])
          result.push_back(row);
      return result;
    }

    /// The directions in R across those in which pressures, or tractions along one direction, are
    /// in proportion to the pressures p of their nodes: the eigenvectors of 1 of 1 - w w^T.
    template <int dim>
    DenseMatrix across_resultants(const Contact<dim> &contact,
                                  const std::vector<unsigned int> &releasing,
                                  const std::vector<unsigned int> &pressures, const MultiVector &p)
    {
      const DenseMatrix values = gather_rows(p, pressures);
      std::vector<std::vector<double>> resultants; // by multiplier
      for (unsigned int i = 0; i < pressures.size(); ++i)
      {
        const std::vector<unsigned int> of_node = contact.with_tractions(pressures[i]);
        for (unsigned int k = 0; k < of_node.size(); ++k)
        {
          const auto at = std::find(releasing.begin(), releasing.end(), of_node[k]);
          if (resultants.size() <= k)
            resultants.emplace_back(releasing.size());
          if (at != releasing.end())
            resultants[k][at - releasing.begin()] = values.values[i];
        }
      }
      const unsigned int n  = releasing.size();
      DenseMatrix projector = DenseMatrix::identity(n);
      for (const std::vector<double> &w : resultants)
      {
        double square = 0;
        for (const double entry : w)
          square += entry * entry;
        for (unsigned int j = 0; j < n && square > 0; ++j)
          for (unsigned int i = 0; i < n; ++i)
            projector(i, j) -= w[i] * w[j] / square;
      }
      const std::vector<double> eigenvalues = symmetric_eigen(projector);
      const unsigned int n_zero =
          std::count_if(eigenvalues.begin(), eigenvalues.end(),
                        [](const double eigenvalue) { return eigenvalue < 0.5; });
      return projector.columns(n_zero, n - n_zero);
    }
  } // namespace

  std::vector<Effect> effects_of_changes(const std::vector<EdgeChange> &changes,
                                         const ContactEdge &edge,
                                         const EquationsOfMotion &equations,
                                         const EigenPairs &modes)
  {
    std::vector<Effect> effects;
    if (changes.empty() || modes.empty())
      return effects;
    const SmallProblems problems(changes, edge, equations, modes);
    for (unsigned int k = 0; k < changes.size(); ++k)
      effects.push_back(problems.effect_of(k));
    return effects;
  }

  template <int dim>
  std::vector<ChangedEdge>
  changed_edges(const ContactEdge &edge, const Contact<dim> &contact, const MultiVector &state,
                const EquationsOfMotion &equations, const EigenPairs &modes)
  {
    std::vector<ChangedEdge> result;
    std::vector<EdgeChange> changes;
    std::vector<unsigned int> owners, in_one_node; // of the changes, in the result
    for (unsigned int i = 0; i < contact.paired_interfaces().size(); ++i)
    {
      if (contact.slides(i))
        continue;
      const Effect none(std::size_t(modes.size()) * modes.size());
      result.push_back({i, none, none});
      std::vector<unsigned int> R = rows_at(edge.releasing, edge.releasing_at, edge, i),
                                C = rows_at(edge.closing, edge.closing_at, edge, i);
      const auto add = [&](const bool opens, std::vector<unsigned int> rows, DenseMatrix D)
      {
        if (D.n_columns == 0)
          return;
        changes.push_back({opens, std::move(rows), std::move(D)});
        owners.push_back(result.size() - 1);
      };
      const std::vector<unsigned int> closed = closed_pressures(contact, i);
      const bool empties =
          !R.empty() && std::includes(R.begin(), R.end(), closed.begin(), closed.end());
      DenseMatrix D =
          empties ? across_resultants(contact, R, closed, state) : DenseMatrix::identity(R.size());
      if (empties && D.n_columns == 0)
        in_one_node.push_back(result.size() - 1);
      add(true, std::move(R), std::move(D));
      D = DenseMatrix::identity(C.size());
      add(false, std::move(C), std::move(D));
    }
    std::vector<Effect> effects = effects_of_changes(changes, edge, equations, modes);
    for (unsigned int k = 0; k < effects.size(); ++k)
      (changes[k].opens ? result[owners[k]].opening : result[owners[k]].closing) =
          std::move(effects[k]);
    for (const unsigned int k : in_one_node)
      for (std::size_t i = 0; i < result[k].opening.size(); ++i)
        result[k].opening[i] = -result[k].closing[i];
    return result;
  }

  template <int dim>
  ContactEdge sliding_edge(const ContactEdge &edge, const Contact<dim> &contact)
  {
    ContactEdge result{edge.parts,          edge.releasing,
                       edge.closing,        edge.releasing_at,
                       edge.closing_at,     edge.release_energy,
                       edge.closing_energy, edge.slack,
                       edge.pressure,       sum_of(contact.spaces().rows, {{1., edge.closed}})};
    const auto clear = [&](DenseMatrix &a, const std::vector<unsigned int> &part_of_row)
    {
      for (unsigned int j = 0; j < a.n_columns; ++j)
        for (unsigned int i = 0; i < a.n_rows; ++i)
          if (!contact.slides(edge.parts[part_of_row[i]].interface) ||
              !contact.slides(edge.parts[part_of_row[j]].interface))
            a(i, j) = 0;
    };
    clear(result.slack, edge.releasing_at);
    clear(result.pressure, edge.closing_at);
    return result;
  }

  template std::vector<ChangedEdge> changed_edges(const ContactEdge &, const Contact<2> &,
                                                  const MultiVector &, const EquationsOfMotion &,
                                                  const EigenPairs &);
  template std::vector<ChangedEdge> changed_edges(const ContactEdge &, const Contact<3> &,
                                                  const MultiVector &, const EquationsOfMotion &,
                                                  const EigenPairs &);
  template ContactEdge sliding_edge(const ContactEdge &, const Contact<2> &);
  template ContactEdge sliding_edge(const ContactEdge &, const Contact<3> &);
} // namespace squeal
