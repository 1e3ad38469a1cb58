#include <squeal/contact/contact_matrices.h>
#include <squeal/linalg/dense.h>
#include <squeal/linalg/factorization.h>
#include <squeal/statics/direct_statics.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <tuple>
#include <utility>

// Static problems by factors. static_terms() is the tangent as a list of terms. ReleaseSolver has
// the factors of one sector and mends what differs from them, released contacts and another
// friction, by changes of low rank. DirectStatics divides a problem among sectors and ranks,
// decides when new factors are needed, and puts the parts together.

namespace squeal
{
  template <int dim>
  std::vector<Term> static_terms(const std::vector<Term> &body_terms, const Contact<dim> &contact,
                                 const ContactPressure &pressure, const bool with_friction,
                                 ContactMatrices<dim> &matrices)
  {
    std::vector<Term> terms = {{Origin::contact, 0, 1., matrices.normal(contact)}};
    if (with_friction)
    {
      auto [coefficient, matrix] = matrices.friction(contact, pressure);
      terms.push_back({Origin::friction, 0, coefficient, std::move(matrix)});
    }
    terms.insert(terms.end(), body_terms.begin(), body_terms.end());
    return terms_of_order(terms, 0);
  }

  namespace
  {
    /// A copy with only a number on the diagonal in some rows, ascending.
    Matrix with_replaced_rows(const Matrix &matrix, const RowRange &rows,
                              const std::vector<unsigned int> &replaced, const double diagonal)
    {
      const std::vector<PetscInt> local(
          std::lower_bound(replaced.begin(), replaced.end(), rows.begin),
          std::lower_bound(replaced.begin(), replaced.end(), rows.end));
      Mat copy = nullptr;
      SQUEAL_PETSC(MatDuplicate(matrix, MAT_COPY_VALUES, &copy));
      Matrix result(copy);
      SQUEAL_PETSC(MatZeroRows(copy, local.size(), local.data(), diagonal, nullptr, nullptr));
      return result;
    }
  } // namespace

  /// The linear problems of one mesh for changing sets of released multipliers R and changing
  /// friction c. A is the problem with all multipliers and the friction of the factorisation; a
  /// released one has Lambda = 0 in place of its constraint. What is factorised is A_0, with the
  /// rows O so replaced; the rows D in which R and O differ are mended by their effects, with L
  /// the multipliers' rows and F Lambda the forces of friction:
  ///     (A + c F) x = b but for the rows R,   x_R = 0
  ///     =>   x = x_0 + Y s,   A_0 x_0 = b,   A_0 Y = E_D,
  ///          x_i = 0 for i in R,   (A x)_i = b_i for i in O, not R,
  /// and where friction has changed, for which O is empty,
  ///          x = x_0 - c Y_F Lambda + Y s,   A Y_F = F E_L,
  ///          (1 + c Y_F,L) Lambda - Y_L s = x_0,L,   Lambda_R = 0.
  /// A new set, or another friction coefficient, costs a few solves instead of a factorisation.
  class ReleaseSolver
  {
  public:
    /// @p given is A, @p replaced O, ascending, @p diagonal what is on the diagonal of its rows.
    ReleaseSolver(const RowRange &rows, Matrix &&given, const std::vector<unsigned int> &replaced,
                  const double diagonal)
        : rows(rows), A(std::move(given)), open(replaced), diagonal(diagonal),
          norm(A.infinity_norm()), factorization(make_factors()), Y(rows, 0)
    {
    }

    /// How many solutions it lacks for these released multipliers.
    unsigned int n_missing(const std::vector<unsigned int> &released) const
    {
      const std::vector<unsigned int> changed = changes(released);
      return std::count_if(changed.begin(), changed.end(),
                           [this](const unsigned int row) { return !is_known(row); });
    }

    /// The friction matrix F and the rows L of all multipliers.
    void set_friction(std::shared_ptr<const Matrix> matrix, std::vector<unsigned int> all)
    {
      if (!open.empty())
        throw std::logic_error("Another friction needs factors with all contacts closed.");
      F           = std::move(matrix);
      multipliers = std::move(all);
      responses   = DenseMatrix();
    }

    /// x with (A + c F) x = b but for the rows R, and x_R = 0.
    MultiVector solve(const MultiVector &b, const double c,
                      const std::vector<unsigned int> &released)
    {
      if (!is_last(b))
      {
        unreleased      = solve(b);
        right_hand_side = b;
      }
      if (c != 0 && responses.values.empty())
        find_responses();
      MultiVector x =
          c == 0 ? change(unreleased, b, released) : solve_changed(b, unreleased, c, released);
      MultiVector residual = residual_of(x, b, c, released);
      // What another friction leaves of b is due to rounding, and so is what contacts leave that
      // close again: A_0 may be soft where they are open. It is corrected as often as it is more
      // than in one multiplication.
      constexpr double rounding           = 2e-15;
      constexpr unsigned int most_repeats = 2;
      for (unsigned int repeat = 0; repeat < most_repeats && (c != 0 || !open.empty()); ++repeat)
      {
        if (largest_entry(residual) <= rounding * (norm * largest_entry(x) + largest_entry(b)))
          break;
        x += c == 0 ? change(solve(residual), residual, released)
                    : solve_changed(residual, factorization->solve(residual), c, released);
        residual = residual_of(x, b, c, released);
      }
      residual_ = length_of(residual) / length_of(b);
      return x;
    }
    /// |b - (A + c F) x| / |b| but for the rows R of the last solution.
    double relative_residual() const
    {
      return residual_;
    }

    /// Without friction's change, for any number of right sides.
    MultiVector solve_columns(const MultiVector &b, const std::vector<unsigned int> &released)
    {
      return change(solve(b), b, released);
    }

  private:
    std::unique_ptr<const Factorization> make_factors() const
    {
      const std::string what = "the stiffness of the static equilibrium";
      if (open.empty())
        return std::make_unique<const Factorization>(A, Factorization::Kind::lu, what);
      return std::make_unique<const Factorization>(with_replaced_rows(A, rows, open, diagonal),
                                                   Factorization::Kind::lu, what);
    }

    /// A_0 x
    MultiVector product(const MultiVector &x) const
    {
      MultiVector y = multiply(A, x);
      for (unsigned int k = 0; k < x.n_columns(); ++k)
        for (const unsigned int row : open)
          if (rows.contains(row))
            y.column(k)[row - rows.begin] = diagonal * x.column(k)[row - rows.begin];
      return y;
    }

    /// A_0^{-1} B with one step of iterative refinement; B is taken for zero in the rows O.
    MultiVector solve(MultiVector b) const
    {
      clear_rows(b, open);
      MultiVector solution = factorization->solve(b);
      solution += factorization->solve(difference(b, product(solution)));
      return solution;
    }

    /// D
    std::vector<unsigned int> changes(const std::vector<unsigned int> &released) const
    {
      std::vector<unsigned int> changed;
      std::set_symmetric_difference(released.begin(), released.end(), open.begin(), open.end(),
                                    std::back_inserter(changed));
      return changed;
    }

    bool is_known(const unsigned int row) const
    {
      return std::find(known.begin(), known.end(), row) != known.end();
    }

    unsigned int column_of(const unsigned int row) const
    {
      return std::find(known.begin(), known.end(), row) - known.begin();
    }

    bool is_last(const MultiVector &b) const
    {
      int same = unreleased.n_columns() == 1 && b.n_columns() == 1 &&
                 std::equal(b.data(), b.data() + b.n_local(), right_hand_side.data());
      MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, rows.comm);
      return same;
    }

    /// Y of the rows that it does not have yet, and of A Y the rows O.
    void find_effects(const std::vector<unsigned int> &changed)
    {
      std::vector<unsigned int> added;
      for (const unsigned int row : changed)
        if (!is_known(row))
          added.push_back(row);
      if (added.empty())
        return;
      // The rows O of A_0 are not cleared here: effects of those that close are wanted, too.
      MultiVector effects = factorization->solve(unit_columns(rows, added));
      effects += factorization->solve(difference(unit_columns(rows, added), product(effects)));
      if (!open.empty())
      {
        const DenseMatrix gaps = gather_rows(multiply(A, effects), open).transpose();
        constraints.insert(constraints.end(), gaps.values.begin(), gaps.values.end());
      }
      Y.append(effects);
      known.insert(known.end(), added.begin(), added.end());
    }

    /// x_0 + Y s with its conditions in the rows D.
    MultiVector change(MultiVector x, const MultiVector &b,
                       const std::vector<unsigned int> &released)
    {
      const std::vector<unsigned int> changed = changes(released);
      find_effects(changed);
      const unsigned int n = changed.size(), m = x.n_columns();
      if (n > 0)
      {
        const DenseMatrix of_Y = gather_rows(Y, changed), of_x = gather_rows(x, changed);
        DenseMatrix defects;
        if (!open.empty())
          defects = gather_rows(difference(b, multiply(A, x)), changed);
        DenseMatrix equations(n, n), right(n, m);
        for (unsigned int i = 0; i < n; ++i)
        {
          const auto place    = std::lower_bound(open.begin(), open.end(), changed[i]);
          const bool closes   = place != open.end() && *place == changed[i];
          const std::size_t o = place - open.begin();
          for (unsigned int j = 0; j < n; ++j)
          {
            const unsigned int k = column_of(changed[j]);
            equations(i, j)      = closes ? constraints[o + open.size() * k] : of_Y(k, i);
          }
          for (unsigned int k = 0; k < m; ++k)
            right(i, k) = closes ? defects(k, i) : -of_x(k, i);
        }
        add_effects(changed, squeal::solve(std::move(equations), std::move(right)), x);
      }
      clear_rows(x, released); // zero up to rounding: exactly
      return x;
    }

    /// Y_F,L, some columns at a time: the other rows of Y_F are not kept.
    void find_responses()
    {
      constexpr unsigned int most_columns = 64;
      const unsigned int n                = multipliers.size();
      responses                           = DenseMatrix(n, n);
      for (unsigned int first = 0; first < n; first += most_columns)
      {
        const unsigned int last = std::min(n, first + most_columns);
        const std::vector<unsigned int> some(multipliers.begin() + first,
                                             multipliers.begin() + last);
        const DenseMatrix at_multipliers =
            gather_rows(factorization->solve(multiply(*F, unit_columns(rows, some))), multipliers);
        for (unsigned int j = first; j < last; ++j)
          for (unsigned int i = 0; i < n; ++i)
            responses(i, j) = at_multipliers(j - first, i);
      }
    }

    /// The solution up to rounding, given x_0 = A^{-1} b.
    MultiVector solve_changed(const MultiVector &b, const MultiVector &x_0, const double c,
                              const std::vector<unsigned int> &released)
    {
      find_effects(released);
      const unsigned int n = multipliers.size(), n_released = released.size();
      // Columns of 1 + c Y_F,L, of those released -Y_L in their place
      DenseMatrix equations = responses;
      for (double &value : equations.values)
        value *= c;
      for (unsigned int i = 0; i < n; ++i)
        equations(i, i) += 1;
      const DenseMatrix at_multipliers = gather_rows(Y, multipliers);
      std::vector<unsigned int> places;
      for (unsigned int r = 0; r < n_released; ++r)
      {
        places.push_back(std::lower_bound(multipliers.begin(), multipliers.end(), released[r]) -
                         multipliers.begin());
        for (unsigned int i = 0; i < n; ++i)
          equations(i, places[r]) = -at_multipliers(column_of(released[r]), i);
      }
      DenseMatrix solution =
          squeal::solve(std::move(equations), gather_rows(x_0, multipliers).transpose());
      DenseMatrix slack(n_released, 1);
      for (unsigned int r = 0; r < n_released; ++r)
        std::swap(slack(r, 0), solution(places[r], 0));

      MultiVector pressures(rows, 1);
      for (unsigned int i = 0; i < n; ++i)
        if (rows.contains(multipliers[i]))
          pressures.data()[multipliers[i] - rows.begin] = solution(i, 0);
      MultiVector forces = b;
      MultiVector x      = factorization->solve(forces.add(-c, multiply(*F, pressures)));
      add_effects(released, slack, x);
      clear_rows(x, released); // zero up to rounding: exactly
      return x;
    }

    /// x += Y s
    void add_effects(const std::vector<unsigned int> &changed, const DenseMatrix &s,
                     MultiVector &x) const
    {
      for (unsigned int k = 0; k < x.n_columns(); ++k)
        for (unsigned int j = 0; j < changed.size(); ++j)
          add_multiple(s(j, k), Y.column(column_of(changed[j])), rows.n_local(), x.column(k));
    }

    /// b - (A + c F) x but for the rows R.
    MultiVector residual_of(const MultiVector &x, const MultiVector &b, const double c,
                            const std::vector<unsigned int> &released) const
    {
      MultiVector product = multiply(A, x);
      if (c != 0)
        product.add(c, multiply(*F, x));
      MultiVector residual = difference(b, product);
      clear_rows(residual, released);
      return residual;
    }

    const RowRange rows;
    const Matrix A;
    const std::vector<unsigned int> open; ///< O
    const double diagonal, norm;
    const std::unique_ptr<const Factorization> factorization; ///< of A_0
    double residual_ = 0;
    MultiVector unreleased, right_hand_side; ///< x_0 and its b
    MultiVector Y;
    std::vector<unsigned int> known; ///< the rows of Y's columns
    std::vector<double> constraints; ///< (A Y)_O, column by column
    std::shared_ptr<const Matrix> F;
    std::vector<unsigned int> multipliers; ///< L, ascending
    DenseMatrix responses;                 ///< Y_F in the rows L
  };

  template <int dim>
  DirectStatics<dim>::DirectStatics(const RowRange &rows, const std::vector<Term> &body_terms,
                                    const ContactModel<dim> &model, const bool with_friction,
                                    Sectors given, const bool all_sectors, const bool for_one_state)
      : rows(rows), of_bodies(terms_of_order(body_terms, 0)), with_friction(with_friction),
        all_sectors(all_sectors), for_one_state(for_one_state), factor_once(may_serve(model)),
        sectors(std::move(given))
  {
  }

  template <int dim>
  DirectStatics<dim>::~DirectStatics() = default;

  template <int dim>
  void DirectStatics<dim>::make_parts()
  {
    if (!parts.empty())
      return;
    int n_ranks = 0;
    MPI_Comm_size(rows.comm, &n_ranks);
    const std::vector<Sector> wanted = all_sectors
                                           ? sectors.all(rows, n_ranks > 1, (n_ranks + 1) / 2)
                                           : std::vector<Sector>{sectors.symmetric(rows)};
    for (const Sector &sector : wanted)
      parts.push_back({sector, {}});
  }

  template <int dim>
  void DirectStatics<dim>::forget_sectors()
  {
    sectors = {};
    parts.clear();
  }

  template <int dim>
  void DirectStatics<dim>::factorise(const Contact<dim> &contact, const ContactPressure &pressure,
                                     const std::vector<unsigned int> &open)
  {
    for (Part &part : parts)
      part.solver.reset();
    const std::vector<Term> sum =
        static_terms(of_bodies, contact, pressure, with_friction, contact_matrices);
    if (sectors.are_two() && !sectors.keep(std::vector<std::vector<Term>>{sum}))
      forget_sectors();
    make_parts();
    std::vector<Sector> wanted;
    std::vector<std::vector<unsigned int>> replaced;
    for (const Part &part : parts)
    {
      wanted.push_back(part.sector);
      replaced.push_back(part.sector.restrict(open));
    }
    std::vector<Matrix> matrices = Sector::sums(wanted, sum);
    work_apart(rows.comm,
               [&]()
               {
                 for (unsigned int p = 0; p < parts.size(); ++p)
                   if (const Sector &sector = parts[p].sector; sector.is_here())
                     parts[p].solver = std::make_unique<ReleaseSolver>(
                         sector.row_range(), std::move(matrices[p]), replaced[p],
                         contact.constraint_stiffness());
               });
    if (!factor_once)
      return;
    base.emplace(Base{contact, 0., {}, {}});
    if (with_friction)
      std::tie(base->coefficient, base->slopes) = friction_slopes(contact, pressure);
    if (base->coefficient == 0)
      base->slopes.clear();
  }

  template <int dim>
  void DirectStatics<dim>::factorise_once(const Contact<dim> &contact,
                                          const ContactPressure &pressure)
  {
    Contact<dim> closed = contact;
    closed.close();
    factorise(closed, pressure,
              for_one_state ? contact.released_multipliers() : std::vector<unsigned int>());
  }

  template <int dim>
  bool DirectStatics<dim>::needs_factors(const std::vector<unsigned int> &released) const
  {
    if (parts.empty())
      return true;
    if (!for_one_state)
      return false;
    const Part &part = parts.front();
    int n_missing    = 0;
    if (const std::vector<unsigned int> in_sector = part.sector.restrict(released); part.solver)
      n_missing = part.solver->n_missing(in_sector);
    MPI_Allreduce(MPI_IN_PLACE, &n_missing, 1, MPI_INT, MPI_MAX, rows.comm);
    return n_missing > int(most_changes);
  }

  template <int dim>
  bool DirectStatics<dim>::serves(const std::vector<Term> &body_terms,
                                  const Contact<dim> &contact) const
  {
    if (!base || !factor_once || !may_serve(contact) ||
        contact.constants_of_normal() != base->contact.constants_of_normal() ||
        !KnownTerms(of_bodies).are(terms_of_order(body_terms, 0)))
      return false;
    if (!with_friction)
      return true;
    // Friction turns round with the sliding.
    if (contact.contact_model().direction() != base->contact.contact_model().direction())
      return false;
    if (base->slopes.empty())
      return true;
    const auto [coefficient, slopes] = friction_slopes(contact, contact.uniform_pressure(0));
    int same                         = coefficient == 0 || slopes == base->slopes;
    MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, rows.comm);
    return same;
  }

  /// The friction coefficient less that of the factorisation; where that is not zero, the solver
  /// has the matrix of friction then.
  template <int dim>
  double DirectStatics<dim>::change_of_friction(const Contact<dim> &contact,
                                                const ContactPressure &pressure)
  {
    if (!with_friction || for_one_state)
      return 0;
    auto [coefficient, slopes] = friction_slopes(contact, pressure);
    if (coefficient == base->coefficient || base->friction)
      return coefficient - base->coefficient;
    if (base->slopes.empty())
      base->slopes = std::move(slopes);
    base->contact.set_model(contact.contact_model());
    base->friction = contact_matrices.friction(base->contact, pressure).second;
    if (sectors.are_two() &&
        !sectors.keep(std::vector<std::vector<Term>>{{{Origin::friction, 0, 1., base->friction}}}))
    {
      forget_sectors();
      factorise_once(contact, pressure);
      return 0;
    }
    Part &part                           = parts.front();
    std::shared_ptr<const Matrix> matrix = part.sector.restrict(base->friction);
    if (part.solver)
      part.solver->set_friction(std::move(matrix), part.sector.restrict(contact.multipliers()));
    return coefficient - base->coefficient;
  }

  template <int dim>
  MultiVector DirectStatics<dim>::solve(const Contact<dim> &contact,
                                        const ContactPressure &pressure,
                                        const MultiVector &right_hand_side)
  {
    std::vector<unsigned int> released = contact.released_multipliers();
    if (sectors.are_two() && !(sectors.keep(right_hand_side) && sectors.keep(released)))
      forget_sectors();
    if (!for_one_state && released.size() > most_releases)
      factor_once = false;
    if (!factor_once) // the matrix is that of the active set
      factorise(contact, pressure, {});
    else if (needs_factors(released))
      factorise_once(contact, pressure);
    const double change = factor_once ? change_of_friction(contact, pressure) : 0;

    const Part &part    = parts.front();
    const MultiVector b = part.sector.restrict(right_hand_side);
    if (!factor_once)
      released.clear();
    else
      released = part.sector.restrict(released);
    MultiVector x(b.row_range(), 1);
    work_apart(rows.comm,
               [&]()
               {
                 if (part.solver)
                   x = part.solver->solve(b, change, released);
               });
    return part.sector.expand(x);
  }

  template <int dim>
  double DirectStatics<dim>::relative_residual() const
  {
    const Part &part = parts.front();
    double residual  = part.solver ? part.solver->relative_residual() : 0;
    // Not a number stays one.
    MPI_Allreduce(MPI_IN_PLACE, &residual, 1, MPI_DOUBLE, MPI_SUM, rows.comm);
    int n_ranks = part.solver ? 1 : 0;
    MPI_Allreduce(MPI_IN_PLACE, &n_ranks, 1, MPI_INT, MPI_SUM, rows.comm);
    return residual / n_ranks;
  }

  /// With S the reflection, solutions of A x = b and A x' = S b are
  ///     x = V_+ y_+ + V_- y_-,   x' = S x = V_+ y_+ - V_- y_-,   V^T A V y = V^T b.
  template <int dim>
  MultiVector DirectStatics<dim>::solve_columns(const Contact<dim> &contact,
                                                const MultiVector &right_hand_sides,
                                                const std::vector<unsigned int> &multipliers)
  {
    const std::vector<unsigned int> released =
        factor_once ? contact.released_multipliers() : std::vector<unsigned int>();
    if (!sectors.are_two())
      return parts.front().solver->solve_columns(right_hand_sides, released);
    if (parts.size() != 2)
      throw std::logic_error("DirectStatics has no antisymmetric half.");

    // Of a pair one is solved for.
    std::vector<unsigned int> image_of, solved;
    MultiVector b(rows, 0);
    for (unsigned int j = 0; j < multipliers.size(); ++j)
    {
      const auto image =
          std::find(multipliers.begin(), multipliers.end(), sectors.image(multipliers[j]));
      image_of.push_back(image == multipliers.end() ? j : image - multipliers.begin());
      if (image_of[j] >= j)
      {
        solved.push_back(j);
        b.append(right_hand_sides.columns(j, 1));
      }
    }
    std::array<MultiVector, 2> y;
    std::array<std::vector<unsigned int>, 2> released_in;
    for (unsigned int p = 0; p < 2; ++p)
    {
      y[p]           = parts[p].sector.restrict(b);
      released_in[p] = parts[p].sector.restrict(released);
    }
    work_apart(rows.comm,
               [&]()
               {
                 for (unsigned int p = 0; p < 2; ++p)
                   if (parts[p].solver)
                     y[p] = parts[p].solver->solve_columns(y[p], released_in[p]);
               });
    const MultiVector plus = parts[0].sector.expand(y[0]), minus = parts[1].sector.expand(y[1]);
    MultiVector x(rows, multipliers.size());
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
                                          const ContactPressure &, bool, ContactMatrices<2> &);
  template std::vector<Term> static_terms(const std::vector<Term> &, const Contact<3> &,
                                          const ContactPressure &, bool, ContactMatrices<3> &);
  template class DirectStatics<2>;
  template class DirectStatics<3>;
} // namespace squeal
