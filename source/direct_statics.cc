#include <squeal/dense.h>
#include <squeal/direct_statics.h>
#include <squeal/reduced_tools.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

namespace squeal
{
  template <int dim>
  std::vector<Term> static_terms(const std::vector<Term> &body_terms, const Contact<dim> &contact,
                                 const typename Contact<dim>::Pressure &pressure,
                                 const bool with_friction)
  {
    std::vector<Term> terms = {{Origin::contact, 0, 1., contact.shared_normal()}};
    if (with_friction)
    {
      auto [coefficient, matrix] = contact.shared_friction(pressure);
      terms.push_back({Origin::friction, 0, coefficient, std::move(matrix)});
    }
    terms.insert(terms.end(), body_terms.begin(), body_terms.end());
    return terms_of_order(terms, 0);
  }

  /// The linear problems of one mesh for changing sets of released multipliers R, by the
  /// factorisation of the problem A without any. Releasing a multiplier replaces its constraint
  /// by Lambda = 0; the constraint then has a slack s:
  ///     A x = b + E_R s,   x_R = 0   =>   x = x_0 + Y s,   A x_0 = b,   A Y = E_R,   Y_RR s =
  ///     -x_0R.
  /// A new set costs a few solves instead of a factorisation.
  class ReleaseSolver
  {
  public:
    ReleaseSolver(const RowRange &rows, Matrix &&matrix)
        : rows(rows), A(std::move(matrix)),
          factorization(A, Factorization::Kind::lu, "the stiffness of the static equilibrium"),
          Y(rows, 0)
    {
    }

    /// A^{-1} B with one step of iterative refinement.
    Block solve(const Block &right_hand_sides) const
    {
      const std::size_t n = std::size_t(right_hand_sides.n_local()) * right_hand_sides.n_columns();
      Block solution      = factorization.solve(right_hand_sides);
      Block residual      = multiply(A, solution);
      for (std::size_t i = 0; i < n; ++i)
        residual.data()[i] = right_hand_sides.data()[i] - residual.data()[i];
      const Block correction = factorization.solve(residual);
      for (std::size_t i = 0; i < n; ++i)
        solution.data()[i] += correction.data()[i];
      return solution;
    }

    /// x_0 + Y s.
    Block release(Block x, const std::vector<unsigned int> &released)
    {
      std::vector<unsigned int> added;
      for (const unsigned int row : released)
        if (std::find(known.begin(), known.end(), row) == known.end())
          added.push_back(row);
      if (!added.empty())
        Y.append(solve(reduced::unit_columns(rows, added)));
      known.insert(known.end(), added.begin(), added.end());

      // Y_RR and x_0R on all ranks
      const unsigned int n = released.size(), m = x.n_columns();
      std::vector<double> values(n * (n + m));
      for (unsigned int i = 0; i < n; ++i)
        if (rows.contains(released[i]))
          for (unsigned int j = 0; j < n + m; ++j)
            values[i + n * j] = j < n ? Y.column(column_of(released[j]))[released[i] - rows.begin]
                                      : -x.column(j - n)[released[i] - rows.begin];
      MPI_Allreduce(MPI_IN_PLACE, values.data(), values.size(), MPI_DOUBLE, MPI_SUM, rows.comm);
      if (n == 0)
        return x;
      const DenseMatrix slack =
          squeal::solve(DenseMatrix(n, n, {values.begin(), values.begin() + n * n}),
                        DenseMatrix(n, m, {values.begin() + n * n, values.end()}));
      for (unsigned int k = 0; k < m; ++k)
      {
        double *const column = x.column(k);
        for (unsigned int j = 0; j < n; ++j)
        {
          const double *const y = Y.column(column_of(released[j]));
          for (unsigned int i = 0; i < rows.n_local(); ++i)
            column[i] += slack(j, k) * y[i];
        }
        for (const unsigned int row : released) // zero up to rounding: exactly
          if (rows.contains(row))
            column[row - rows.begin] = 0;
      }
      return x;
    }

  private:
    unsigned int column_of(const unsigned int row) const
    {
      return std::find(known.begin(), known.end(), row) - known.begin();
    }

    const RowRange rows;
    const Matrix A;
    const Factorization factorization;
    Block Y;
    std::vector<unsigned int> known; ///< the rows of Y's columns
  };

  template <int dim>
  DirectStatics<dim>::DirectStatics(const RowRange &rows, const std::vector<Term> &body_terms,
                                    const ContactModel<dim> &model, const bool with_friction,
                                    const MirrorSymmetry *symmetry, const bool both_halves)
      : rows(rows), body_terms(body_terms), with_friction(with_friction), both_halves(both_halves),
        factor_once(model.mortar && model.friction.kind != FrictionLaw::Kind::expression),
        symmetry(symmetry)
  {
  }

  template <int dim>
  DirectStatics<dim>::~DirectStatics() = default;

  template <int dim>
  void DirectStatics<dim>::make_parts()
  {
    if (!parts.empty())
      return;
    parts.resize(symmetry && both_halves ? 2 : 1);
    if (!symmetry)
      return;
    int n_ranks = 0;
    MPI_Comm_size(rows.comm, &n_ranks);
    for (unsigned int p = 0; p < parts.size(); ++p)
    {
      Part &part = parts[p];
      if (parts.size() == 2 && n_ranks > 1)
      {
        const unsigned int n_symmetric = (n_ranks + 1) / 2;
        part.group = p == 0 ? std::make_unique<const RankGroup>(rows.comm, 0, n_symmetric)
                            : std::make_unique<const RankGroup>(rows.comm, n_symmetric,
                                                                n_ranks - n_symmetric);
        part.space = std::make_unique<const HalfSpace>(*symmetry, p == 0, *part.group);
      }
      else
        part.space = std::make_unique<const HalfSpace>(*symmetry, p == 0);
    }
  }

  template <int dim>
  void DirectStatics<dim>::forget_symmetry()
  {
    symmetry = nullptr;
    parts.clear();
  }

  template <int dim>
  bool DirectStatics<dim>::contains_images(const std::vector<unsigned int> &multipliers) const
  {
    return std::all_of(multipliers.begin(), multipliers.end(),
                       [&](const unsigned int row)
                       {
                         return std::find(multipliers.begin(), multipliers.end(),
                                          symmetry->image[row]) != multipliers.end();
                       });
  }

  template <int dim>
  void DirectStatics<dim>::factorise(const Contact<dim> &contact,
                                     const typename Contact<dim>::Pressure &pressure)
  {
    for (Part &part : parts)
      part.solver.reset();
    const std::vector<std::vector<Term>> sum(
        1, static_terms(body_terms, contact, pressure, with_friction));
    if (symmetry && !squeal::is_symmetric(sum, *symmetry))
      forget_symmetry();
    make_parts();
    std::vector<Matrix> matrices;
    std::vector<HalfSpace::Wanted> wanted;
    for (const Part &part : parts)
      if (part.space)
        wanted.push_back({part.space.get(), sum});
    if (wanted.empty())
      matrices.push_back(sum_of_terms(rows, sum.front()));
    else
      for (std::vector<Matrix> &of_space : HalfSpace::restrict(wanted))
        matrices.push_back(std::move(of_space.front()));
    work_apart(rows.comm,
               [&]()
               {
                 for (unsigned int p = 0; p < parts.size(); ++p)
                   if (const RowRange &own = rows_of(parts[p], rows); own.comm != MPI_COMM_NULL)
                     parts[p].solver = std::make_unique<ReleaseSolver>(own, std::move(matrices[p]));
               });
  }

  template <int dim>
  Block DirectStatics<dim>::solve(const Contact<dim> &contact,
                                  const typename Contact<dim>::Pressure &pressure,
                                  const Block &right_hand_side)
  {
    constexpr unsigned int most_releases = 400;
    std::vector<unsigned int> released   = contact.released_multipliers();
    if (symmetry &&
        !(squeal::is_symmetric(right_hand_side, *symmetry) && contains_images(released)))
      forget_symmetry();
    if (released.size() > most_releases)
      factor_once = false;
    const bool is_known = factor_once && !parts.empty();
    if (!is_known)
    {
      if (factor_once && !released.empty())
      {
        Contact<dim> closed = contact;
        closed.close();
        factorise(closed, pressure);
      }
      else
        factorise(contact, pressure);
    }
    Part &part    = parts.front();
    const Block b = part.space ? part.space->restrict(right_hand_side) : right_hand_side;
    if (!factor_once) // the matrix is that of the active set
      released.clear();
    else if (part.space)
      released = part.space->restrict(released);
    Block x(b.row_range(), 1);
    work_apart(rows.comm,
               [&]()
               {
                 if (!part.solver)
                   return;
                 if (!is_known)
                   part.unreleased = part.solver->solve(b);
                 x = part.solver->release(part.unreleased, released);
               });
    return part.space ? part.space->expand(x) : x;
  }

  /// With S the reflection, solutions of A x = b and A x' = S b are
  ///     x = V_+ y_+ + V_- y_-,   x' = S x = V_+ y_+ - V_- y_-,   V^T A V y = V^T b.
  template <int dim>
  Block DirectStatics<dim>::solve_columns(const Contact<dim> &contact,
                                          const Block &right_hand_sides,
                                          const std::vector<unsigned int> &multipliers)
  {
    const std::vector<unsigned int> released =
        factor_once ? contact.released_multipliers() : std::vector<unsigned int>();
    if (!symmetry)
      return parts.front().solver->release(parts.front().solver->solve(right_hand_sides), released);
    if (parts.size() != 2)
      throw std::logic_error("DirectStatics has no antisymmetric half.");

    // Of a pair one is solved for.
    std::vector<unsigned int> image_of, solved;
    Block b(rows, 0);
    for (unsigned int j = 0; j < multipliers.size(); ++j)
    {
      const auto image =
          std::find(multipliers.begin(), multipliers.end(), symmetry->image[multipliers[j]]);
      image_of.push_back(image == multipliers.end() ? j : image - multipliers.begin());
      if (image_of[j] >= j)
      {
        solved.push_back(j);
        b.append(right_hand_sides.columns(j, 1));
      }
    }
    std::array<Block, 2> y;
    for (unsigned int p = 0; p < 2; ++p)
      y[p] = parts[p].space->restrict(b);
    work_apart(rows.comm,
               [&]()
               {
                 for (unsigned int p = 0; p < 2; ++p)
                   if (parts[p].solver)
                     y[p] = parts[p].solver->release(parts[p].solver->solve(y[p]),
                                                     parts[p].space->restrict(released));
               });
    const Block plus = parts[0].space->expand(y[0]), minus = parts[1].space->expand(y[1]);
    Block x(rows, multipliers.size());
    for (unsigned int k = 0; k < solved.size(); ++k)
    {
      const unsigned int j = solved[k];
      for (unsigned int i = 0; i < rows.n_local(); ++i)
      {
        x.column(image_of[j])[i] = plus.column(k)[i] - minus.column(k)[i];
        x.column(j)[i]           = plus.column(k)[i] + minus.column(k)[i];
      }
    }
    return x;
  }

  template std::vector<Term> static_terms(const std::vector<Term> &, const Contact<2> &,
                                          const Contact<2>::Pressure &, bool);
  template std::vector<Term> static_terms(const std::vector<Term> &, const Contact<3> &,
                                          const Contact<3>::Pressure &, bool);
  template class DirectStatics<2>;
  template class DirectStatics<3>;
} // namespace squeal
