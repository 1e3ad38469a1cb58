#include <squeal/eigen/inertia_count.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/projection/shift_invert.h>
#include <squeal/reduction/reduced_model.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

// A new expansion point; restarts, on a path and of scattered parameters. Then what enlarges V:
// responses where contacts have opened or closed, corrections by inverse iteration. Then what a
// solution is made of: pairs of the projected problem, which of them count and fail, how far
// corrections moved them. solve_by_projection() is the loop over these; make_modes() puts accepted
// pairs into the form of all modes.

namespace squeal
{
  namespace
  {
    constexpr unsigned int most_corrections = 10;
    constexpr double known_beyond = 1e-6; ///< backward error of a mode that only is to be counted

    /// The number of real eigenvalues that grow.
    unsigned int n_real(const std::vector<std::complex<double>> &lambda)
    {
      return std::count_if(lambda.begin(), lambda.end(),
                           [](const std::complex<double> &l)
                           { return is_nearly_real(l) && !is_overdamped(l); });
    }

    /// x^H V^T M V x = 1, z^H W^T Q'(l) V x = 2 l, and the condition numbers.
    void normalise(const ReducedProjection &projection, EigenPairs &modes)
    {
      const unsigned int n = modes.size();
      const Matrix m_right = to_matrix(projection.operator_of(ReducedProjection::of_right, 2)),
                   m_left  = to_matrix(projection.operator_of(ReducedProjection::of_left, 2));
      const auto of_x      = sesquilinear_form(modes.right, m_right, modes.right),
                 of_z      = sesquilinear_form(modes.left, m_left, modes.left),
                 both =
                     biorthogonality(projection.problem(ReducedProjection::petrov), modes, modes);
      modes.condition.clear();
      std::vector<std::complex<double>> right_factors, left_factors;
      for (unsigned int k = 0; k < n; ++k)
      {
        const std::size_t at = k + std::size_t(k) * n;
        const double x_norm = std::sqrt(of_x[at].real()), z_norm = std::sqrt(of_z[at].real());
        modes.condition.push_back(z_norm * x_norm * std::abs(2. * modes.lambda[k]) /
                                  std::abs(both[at]));
        right_factors.push_back(1 / x_norm);
        left_factors.push_back(std::conj(2. * modes.lambda[k] / (both[at] / x_norm)));
      }
      modes.right.scale(right_factors);
      modes.left.scale(left_factors);
    }
  } // namespace

  void ReducedModel::set_expansion_point(const QuadraticEigenproblem &problem,
                                         const std::vector<Term> &terms,
                                         const EigenSolution::Reuse &found)
  {
    AffineTerms affine(terms, projection.terms);
    *this            = ReducedModel(options, course);
    projection.terms = affine;
    // A small problem is solved as fast as projected.
    if (!found.factorization || problem.rows.size <= 2 * found.disc_right.n_columns())
      return;
    factors           = found.factorization;
    counts.in_disc    = std::count_if(found.disc_lambda.begin(), found.disc_lambda.end(),
                                      [](const Complex &l) { return !is_overdamped(l); });
    counts.overdamped = counts.in_disc < found.disc_lambda.size();
    counts.real       = n_real(found.disc_lambda);
    if (problem.n_constraints > 0)
      open_at_expansion = open_constraints(problem.rows, problem.n_local_constraints, {&problem.Q});
    projection             = ReducedProjection(problem);
    projection.terms       = std::move(affine);
    ProjectionBasis &basis = projection.basis;
    // The left vectors were given as Q^T y = 0, y = conj(z): the same span.
    basis.begin(basis.displacements(found.disc_right), basis.displacements(found.disc_left));
    // The search knows the modes beyond the disc roughly; corrections find them slowly.
    MultiVector of_search = found.search_space;
    clear_pressures(problem.n_local_constraints, of_search);
    basis.append(basis.modes_of(problem, of_search, radius(), 2 * radius()), 1e-2);
  }

  DenseMatrix ReducedModel::coordinates_of(const ComplexDenseMatrix &vectors) const
  {
    DenseMatrix parts = real_and_imaginary(vectors);
    parts.resize_rows(dimension());
    return parts;
  }

  MultiVector ReducedModel::whole(const SmallPairs &solutions, const bool of_left) const
  {
    return projection.basis.expanded(
        to_multi_vector(coordinates_of(of_left ? solutions.left : solutions.right)), of_left);
  }

  void ReducedModel::remember(const SmallPairs &solutions)
  {
    if (course == Course::path)
    {
      recent.insert(recent.begin(), solutions);
      if (recent.size() > most_recent)
        recent.pop_back();
      return;
    }
    if (scattered.n_solutions == 0)
    {
      scattered.first_right = whole(solutions, false);
      scattered.first_left  = whole(solutions, true);
    }
    scattered.products =
        grow(scattered.products, dimension(),
             [](unsigned int, const unsigned int n, unsigned int, const unsigned int n_columns)
             { return DenseMatrix(n, n_columns); });
    const DenseMatrix parts = coordinates_of(solutions.right);
    add_product(1, parts, parts.transpose(), scattered.products);
    ++scattered.n_solutions;
    ++scattered.n_since_restart;
  }

  /// (Measured: with 3 and 22 modes.)
  bool ReducedModel::is_crowded() const
  {
    if (counts.overdamped) // these are in V, but not in what solutions span
      return false;
    if (course == Course::scattered)
    {
      constexpr unsigned int enough = 48; // solutions, from which components are to be told
      return scattered.n_since_restart >= enough && dimension() > 3 * counts.in_disc &&
             dimension() > 1.25 * scattered.dimension_at_restart;
    }
    // Solutions with the same contacts tell more of those to come.
    const bool is_steady = n_steady >= most_recent;
    return !recent.empty() &&
           dimension() > (is_steady ? 56 + 6 * counts.in_disc : 106 + 9 * counts.in_disc);
  }

  /// The coordinates of before last solutions stand for other vectors afterwards.
  void ReducedModel::restart()
  {
    if (course == Course::path)
      restart_on_path();
    else
      restart_by_components();
    predictor = {};
    last      = {};
  }

  void ReducedModel::restart_on_path()
  {
    std::vector<ProjectionBasis::Within> others;
    for (unsigned int k = 1; k < recent.size(); ++k)
      others.push_back({coordinates_of(recent[k].right), 1e-9});
    projection.turn(projection.basis.begin_within(coordinates_of(recent.front().right),
                                                  whole(recent.front(), true), others));
    recent.clear();
    opened.clear();
    closed.clear();
  }

  /// Keeps the eigenvectors of the sum of x x^H whose root mean square in the solutions matters.
  /// What was dropped is in no later sum: what is needed again comes again.
  void ReducedModel::restart_by_components()
  {
    ProjectionBasis &basis = projection.basis;
    const unsigned int m   = dimension();
    // Parts of vectors are not errors of backward errors: stiffness makes these smaller.
    const double smallest = std::max(30 * accepted_error(), 1e-7); // squares have no more digits
    DenseMatrix vectors   = scattered.products;
    const std::vector<double> squares = symmetric_eigen(vectors); // ascending
    unsigned int n_dropped            = 0;
    while (n_dropped < m && squares[n_dropped] < smallest * smallest * scattered.n_solutions)
      ++n_dropped;
    const DenseMatrix of_first   = inner_products(basis.right(), scattered.first_right),
                      components = vectors.columns(n_dropped, m - n_dropped),
                      change     = basis.begin_within(of_first, scattered.first_left,
                                                      {{components, smallest}});
    projection.turn(change);
    scattered.products             = change.transpose() * (scattered.products * change);
    scattered.n_since_restart      = 0;
    scattered.dimension_at_restart = dimension();
  }

  namespace
  {
    std::vector<unsigned int> without(std::vector<unsigned int> list,
                                      const std::vector<unsigned int> &known)
    {
      list.erase(std::remove_if(list.begin(), list.end(),
                                [&](const unsigned int r)
                                { return std::count(known.begin(), known.end(), r) > 0; }),
                 list.end());
      return list;
    }
  } // namespace

  /// The responses of the expansion point to a gap where contacts have opened since.
  void ReducedModel::add_openings()
  {
    const InterfaceTerms &interface = projection.interface_terms();
    if (!interface.is_constrained())
      return;
    const std::vector<unsigned int> added  = without(interface.open_contacts(), opened),
                                    newly  = without(added, open_before),
                                    before = without(added, newly);
    opened.insert(opened.end(), added.begin(), added.end());
    const auto gaps_at = [&](const std::vector<unsigned int> &contacts)
    {
      std::vector<unsigned int> rows;
      for (const unsigned int r : contacts)
        rows.push_back(interface.rows()[r]);
      return unit_columns(projection.basis.rows, rows);
    };
    // V has modes with the gaps of those that were open before, but these go on to change, each by
    // itself: corrections by the expansion point's factors, for which they are closed, do not.
    add_responses(gaps_at(before), 1);
    add_responses(gaps_at(newly), 4);
  }

  /// The responses of the expansion point to pressures of contacts that were open there. With them
  /// V has combinations without a gap.
  void ReducedModel::add_closings()
  {
    const InterfaceTerms &interface = projection.interface_terms();
    if (!interface.is_constrained() || open_at_expansion.empty())
      return;
    const InterfaceTerms::Constraints &constraints = interface.left_constraints();
    std::vector<unsigned int> added;
    for (unsigned int k = 0; k < constraints.rows.size(); ++k)
      if (const unsigned int r = constraints.rows[k];
          std::count(open_at_expansion.begin(), open_at_expansion.end(), interface.rows()[r]) > 0 &&
          std::count(closed.begin(), closed.end(), r) == 0)
      {
        closed.push_back(r);
        added.push_back(k);
      }
    if (added.empty())
      return;
    DenseMatrix pressures(added.size(), constraints.rows.size());
    for (unsigned int j = 0; j < added.size(); ++j)
      pressures(j, added[j]) = 1;
    const DenseMatrix at_rows = constraints.forces_of(pressures);
    const RowRange &rows      = projection.basis.rows;
    MultiVector forces(rows, added.size());
    for (unsigned int r = 0; r < interface.n_rows(); ++r)
      if (rows.contains(interface.rows()[r]))
        for (unsigned int j = 0; j < added.size(); ++j)
          forces.column(j)[interface.rows()[r] - rows.begin] = at_rows(j, r);
    add_responses(std::move(forces), 4);
  }

  void ReducedModel::add_responses(MultiVector forces, const unsigned int n_summands)
  {
    if (forces.n_columns() == 0)
      return;
    ProjectionBasis &basis = projection.basis;
    // The response at l, (l^2 M + Q)^{-1} e = Q^{-1} e - l^2 Q^{-1} M Q^{-1} e + ...; the modes,
    // which make this series slow, are in V.
    for (unsigned int k = 0; k < n_summands; ++k)
    {
      MultiVector responses     = basis.displacements(factors->solve(forces));
      const DenseMatrix squares = inner_products(responses, responses);
      std::vector<double> lengths;
      for (unsigned int j = 0; j < responses.n_columns(); ++j)
        lengths.push_back(1 / std::sqrt(std::max(squares(j, j), 1e-300)));
      scale_columns(responses, lengths);
      const unsigned int before = dimension();
      basis.append(std::move(responses), ProjectionBasis::smallest);
      if (dimension() == before || k + 1 == n_summands)
        break;
      // Of what is new only: what V has is not to come again.
      forces = projection.terms.multiply(2, basis.right().columns(before, dimension() - before));
    }
  }

  /// Selects the pairs in the disc with the smallest residuals: others are no modes of the whole
  /// problem.
  std::vector<unsigned int> ReducedModel::best_pairs(const SmallPairs &solutions) const
  {
    std::vector<unsigned int> best(solutions.lambda.size());
    std::iota(best.begin(), best.end(), 0u);
    std::stable_sort(best.begin(), best.end(),
                     [&](const unsigned int a, const unsigned int b)
                     { return solutions.errors[a] < solutions.errors[b]; });
    best.resize(std::min<std::size_t>(best.size(), counts.in_disc));
    return best;
  }

  std::vector<unsigned int> ReducedModel::failing(const SmallPairs &solutions,
                                                  const std::vector<unsigned int> &which,
                                                  const double largest_error) const
  {
    std::vector<unsigned int> result;
    for (const unsigned int i : which)
      if (!(solutions.errors[i] <=
            (is_in_window(solutions.lambda[i]) ? largest_error : known_beyond)))
        result.push_back(i);
    return result;
  }

  /// Solves the projected problem and certifies the pairs. The last pairs are where to start from.
  SmallPairs ReducedModel::solve_projected()
  {
    projection.project(small);
    SmallPairs solutions = last;
    if (solutions.empty() || !small.improve(solutions))
    {
      solutions = small.solve();
      // Dense pairs have rounding errors of stiff vectors, and may be more than there are modes.
      if (solutions.size() > counts.in_disc)
      {
        projection.certify(solutions);
        std::vector<double> errors = solutions.errors;
        std::nth_element(errors.begin(), errors.begin() + counts.in_disc, errors.end());
        has_others |= errors[counts.in_disc] <= known_beyond;
        solutions = solutions.select(best_pairs(solutions));
      }
      small.improve(solutions); // or they stay as they are
    }
    projection.certify(solutions);
    if (solutions.size() == counts.in_disc)
      last = solutions;
    return solutions;
  }

  void ReducedModel::observe(const SmallPairs &before, const SmallPairs &after)
  {
    if (before.lambda.empty())
      return;
    constexpr double rounding = 1e-13, forgotten = 0.1;
    double largest = 1;
    for (unsigned int i = 0; i < before.lambda.size(); ++i)
      if (const Complex l = before.lambda[i]; is_in_window(l) && before.errors[i] > rounding)
      {
        double change = HUGE_VAL;
        for (const Complex next : after.lambda)
          change = std::min(change, std::abs(next - l));
        if (std::isfinite(change))
          largest = std::max(largest, change / (std::abs(l) * before.errors[i]));
      }
    largest_move = std::max(largest, (1 - forgotten) * largest_move);
  }

  /// The residuals of pairs that fail, with a margin, so that the next parameters need none.
  MultiVector ReducedModel::residuals_to_correct(const SmallPairs &x) const
  {
    const std::vector<unsigned int> lacking = failing(x, best_pairs(x), 0.3 * accepted_error());
    return lacking.empty() ? MultiVector(projection.basis.rows, 0)
                           : projection.residuals(x.select(lacking));
  }

  /// By inverse iteration, Q_0^{-1} Q(l) x.
  bool ReducedModel::enrich(const MultiVector &residuals)
  {
    if (residuals.n_columns() == 0)
      return false;
    const unsigned int before = dimension();
    MultiVector added         = projection.basis.displacements(factors->solve(residuals));
    DenseMatrix products      = inner_products(added, added);
    const double largest      = std::sqrt(std::max(0., symmetric_eigen(products).back()));
    // Something is to come of what fails, however little it fails by.
    projection.basis.append(
        std::move(added),
        std::min(0.1 * largest, std::max(ProjectionBasis::smallest, 1e-2 * largest)));
    return dimension() > before;
  }

  std::optional<EigenPairs> ReducedModel::solve(const std::vector<Term> &terms)
  {
    try
    {
      return solve_by_projection(terms);
    }
    catch (const SingularMatrix &) // a divergence lies exactly here
    {
      return std::nullopt;
    }
  }

  bool ReducedModel::has_number_of_expansion_point() const
  {
    if (has_others)
      return false;
    if (!counts.overdamped)
      return true;
    return small.solve().size() == counts.in_disc;
  }

  bool ReducedModel::take(const std::vector<Term> &terms)
  {
    const bool is_anew = projection.terms.size() == 0;
    const auto split   = [&]
    {
      last = {};
      for (std::vector<unsigned int> *in_interface : {&opened, &closed, &open_before})
        in_interface->clear(); // it is numbered anew
      return projection.split(terms);
    };
    if (is_anew && !split())
      return false;
    std::optional<TermList> changing = projection.terms.update(terms);
    if (!changing)
      return false;
    if (projection.set_changing(*changing))
      return true;
    // Contacts that were open before lie beyond the interface.
    return !is_anew && split() && (changing = projection.terms.update(terms)) &&
           projection.set_changing(*changing);
  }

  std::optional<EigenPairs> ReducedModel::solve_by_projection(const std::vector<Term> &terms)
  {
    const double largest_error = accepted_error();
    if (!has_expansion_point())
      return std::nullopt;
    if (!take(terms))
    {
      factors.reset(); // these projections must wait for the next expansion point
      return std::nullopt;
    }
    add_openings();
    add_closings();
    // What is going to fail is corrected by the residuals of before: the projected problem is
    // solved and certified once less.
    if (projection.interface_terms().open_contacts() == open_before &&
        dimension() < largest_dimension())
      enrich(predictor.residuals);
    predictor.residuals = {};
    has_others          = false;
    SmallPairs x;
    double last_error = HUGE_VAL, before_last = HUGE_VAL;
    // Not the loop of Davidson: terms change from value to value, so that what is projected is kept
    // by matrix, and a value begins with the pairs of the last one.
    for (unsigned int n_corrections = 0;; ++n_corrections)
    {
      const SmallPairs before = std::move(x);
      x                       = solve_projected();
      observe(before, x);
      const std::vector<unsigned int> best    = best_pairs(x),
                                      lacking = failing(x, best, largest_error);
      double worst                            = 0;
      for (const unsigned int i : best)
        if (is_in_window(x.lambda[i]))
          worst = std::max(worst, x.errors[i]);
      std::ostringstream text;
      text << "  projected on " << dimension() << " vectors: " << best.size() << " of "
           << counts.in_disc << " modes, backward errors " << worst;
      options.progress(text.str());
      // A pair +-i w that has become two real eigenvalues: one of them is not among these.
      if (n_real(x.select(best).lambda) > counts.real)
        return std::nullopt;
      if (best.size() == counts.in_disc && lacking.empty())
      {
        if (!has_number_of_expansion_point())
          return std::nullopt;
        projection.project_tests();
        if (std::vector<unsigned int> open = projection.interface_terms().open_contacts();
            open != open_before)
        {
          open_before = std::move(open);
          n_steady    = 0;
        }
        ++n_steady;
        remember(x.select(best));
        const double growth = predictor.worst > 0 && n_steady > 1 ? worst / predictor.worst : 1;
        predictor.worst     = worst;
        if (worst * growth > largest_error)
          predictor.residuals = residuals_to_correct(x);
        return make_modes(x, best);
      }
      constexpr double hopeless = 1e-2;
      // A correction divides errors by 20 or more and costs a vector a mode; a basis too large
      // costs more than a new expansion point.
      const double n_needed = std::ceil(std::log(worst / largest_error) / std::log(20.));
      const bool stagnates  = worst > 0.5 * before_last;
      before_last           = last_error;
      last_error            = worst;
      if (n_corrections == most_corrections || lacking.empty() || worst > hopeless || stagnates ||
          dimension() + n_needed * lacking.size() > largest_dimension())
        return std::nullopt;
      if (!enrich(residuals_to_correct(x)))
        return std::nullopt;
    }
  }

  EigenPairs ReducedModel::make_modes(const SmallPairs &x,
                                      const std::vector<unsigned int> &which) const
  {
    std::vector<Complex> lambda;
    for (const unsigned int k : which)
      lambda.push_back(x.lambda[k]);
    std::vector<unsigned int> numbers;
    EigenPairs modes, transposed;
    for (const unsigned int k : order_of_modes(lambda))
      if (is_in_window(lambda[k]) && (lambda[k].imag() > 0 || lambda[k].real() > 0))
      {
        numbers.push_back(which[k]);
        modes.lambda.push_back(lambda[k]);
        modes.backward_error.push_back(x.errors[which[k]]);
      }
    modes.right      = to_multi_vector(x.right.columns(numbers));
    transposed.right = to_multi_vector(x.left.columns(numbers));
    transposed.backward_error.assign(numbers.size(), std::nan("")); // not computed
    attach_left_vectors(projection.problem(ReducedProjection::petrov), std::move(transposed),
                        modes);
    normalise(projection, modes);
    return modes;
  }

  EigenPairs ReducedModel::expand(const EigenPairs &modes) const
  {
    EigenPairs result = in_coordinates(modes, dimension());
    result.right      = {projection.basis.expanded(result.right.re, false),
                         projection.basis.expanded(result.right.im, false)};
    result.left       = {projection.basis.expanded(result.left.re, true),
                         projection.basis.expanded(result.left.im, true)};
    return result;
  }

  EigenPairs in_coordinates(EigenPairs modes, const unsigned int n)
  {
    for (ComplexMultiVector *vectors : {&modes.right, &modes.left})
      for (MultiVector *part : {&vectors->re, &vectors->im})
      {
        MultiVector fitting(small_rows(n), part->n_columns());
        for (unsigned int k = 0; k < part->n_columns(); ++k)
          std::copy_n(part->column(k), std::min(part->n_local(), n), fitting.column(k));
        *part = std::move(fitting);
      }
    return modes;
  }
} // namespace squeal
