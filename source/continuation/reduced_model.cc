#include <squeal/continuation/reduced_model.h>
#include <squeal/eigen/shift_invert.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

namespace squeal
{
  namespace
  {
    constexpr unsigned int most_corrections = 10;
    constexpr double known_beyond = 1e-6; ///< backward error of a mode that only is to be counted

    /// Of those that grow.
    unsigned int n_real(const std::vector<std::complex<double>> &lambda)
    {
      return std::count_if(lambda.begin(), lambda.end(),
                           [](const std::complex<double> &l)
                           { return is_nearly_real(l) && !is_overdamped(l); });
    }
  } // namespace

  void ReducedModel::set_expansion_point(const QuadraticEigenproblem &problem,
                                         const std::vector<Term> &terms,
                                         const EigenSolution::Reuse &found)
  {
    const Members known_to_vary = std::move(varying), present = members_of(terms);
    *this = ReducedModel(options);
    for (const Member &member : known_to_vary)
      if (find(present, member)) // else its matrix is gone
        varying.push_back(member);
    // A small problem is solved as fast as projected.
    if (!found.factorization || problem.rows.size <= 2 * found.disc_right.n_columns())
      return;
    rows                = problem.rows;
    n_local_constraints = problem.n_local_constraints;
    factors             = found.factorization;
    n_disc              = std::count_if(found.disc_lambda.begin(), found.disc_lambda.end(),
                                        [](const Complex &l) { return !is_overdamped(l); });
    has_overdamped      = n_disc < found.disc_lambda.size();
    n_real_at_expansion = n_real(found.disc_lambda);
    interface =
        InterfaceTerms(rows, n_local_constraints, problem.n_constraints > 0, problem.compliant);
    expansion_terms = terms;
    basis           = ProjectionBasis(rows, n_local_constraints);
    // The left vectors were given as Q^T y = 0, y = conj(z): the same span.
    basis.begin(basis.displacements(found.disc_right), basis.displacements(found.disc_left));
    // The search knows the modes beyond the disc roughly; corrections find them slowly.
    MultiVector of_search = found.search_space;
    clear_pressures(n_local_constraints, of_search);
    basis.append(basis.modes_of(problem, of_search, radius(), 2 * radius()), 1e-2);
  }

  // Terms.

  ReducedModel::Members ReducedModel::members_of(const std::vector<Term> &terms)
  {
    Members members;
    const bool in_contact =
        std::any_of(terms.begin(), terms.end(),
                    [](const Term &term) { return term.origin == Origin::contact; });
    for (const Term &term : terms)
      if (term.matrix && *term.matrix)
      {
        const Member member{term.matrix, term.order, term.coefficient,
                            in_contact && is_of_contact(term.origin)};
        if (const Member *known = find(members, member))
          members[known - members.data()].coefficient += term.coefficient;
        else
          members.push_back(member);
      }
    return members;
  }

  std::vector<double> ReducedModel::varying_terms() const
  {
    std::vector<double> numbers;
    const Members members = members_of(expansion_terms);
    for (unsigned int k = 0; k < members.size(); ++k)
      if (find(varying, members[k]))
        numbers.push_back(k);
    return numbers;
  }

  void ReducedModel::keep_apart(const std::vector<double> &numbers)
  {
    const Members members = members_of(expansion_terms);
    for (const double k : numbers)
      if (k < members.size() && !find(varying, members[static_cast<unsigned int>(k)]))
        varying.push_back(members[static_cast<unsigned int>(k)]);
  }

  const ReducedModel::Member *ReducedModel::find(const Members &members, const Member &member)
  {
    for (const Member &other : members)
      if (other.matrix == member.matrix && other.order == member.order)
        return &other;
    return nullptr;
  }

  bool ReducedModel::find_fixed(const std::vector<Term> &terms)
  {
    const Members before = members_of(expansion_terms), now = members_of(terms);
    std::vector<char> touched(rows.size);
    const auto touch = [&](const Members &members, const Members &others)
    {
      for (const Member &member : members)
        if (member.of_contact || !find(others, member))
          for_entries(*member.matrix, [&](const PetscInt row, const PetscInt column, double)
                      { touched[row] = touched[column] = 1; });
    };
    touch(before, now);
    touch(now, before);

    // Matrices with constant coefficients as one sum an order, others each by itself
    for (unsigned int order = 0; order < 3; ++order)
    {
      Members members;
      std::vector<Summand> summands;
      for (const Member &member : now)
      {
        const Member *of_expansion = find(before, member);
        if (!of_expansion || member.of_contact || member.order != order)
          continue;
        if (of_expansion->coefficient != member.coefficient && !find(varying, member))
          varying.push_back(member);
        if (find(varying, member))
          fixed.push_back({order, member.matrix, {member}});
        else
        {
          members.push_back(member);
          summands.push_back({member.coefficient, *member.matrix});
        }
      }
      if (!members.empty())
        fixed.push_back(
            {order, std::make_shared<const Matrix>(sum_of(rows, summands)), std::move(members)});
    }
    for (const Fixed &part : fixed)
      fixed_norms.push_back(part.matrix->infinity_norm());

    interface.set_rows(std::move(touched));
    forget_images();
    return !fixed.empty() && 2 * interface.n_rows() < rows.size;
  }

  void ReducedModel::forget_images()
  {
    n_imaged = 0;
    images.assign(fixed.size(), MultiVector(rows, 0));
    at_rows.assign(fixed.size(), {});
    for (auto &of_form : projected)
      of_form.assign(fixed.size(), {});
    projected[petrov].assign(fixed.size(), DenseMatrix(basis.left.n_columns(), 0));
    right_change = DenseMatrix();
    last_right = last_left = {};
  }

  /// The coordinates of before last solutions stand for other vectors afterwards.
  void ReducedModel::restart()
  {
    const auto whole = [&](const ReducedPairs &solutions, const bool of_left)
    {
      MultiVector block =
          basis.expanded(to_multi_vector(with_rows(solutions.re, dimension())), of_left);
      block.append(basis.expanded(to_multi_vector(with_rows(solutions.im, dimension())), of_left));
      return block;
    };
    std::vector<MultiVector> of_right;
    for (const auto &[x, y] : recent)
      of_right.push_back(whole(x, false));
    basis.begin(of_right.front(), whole(recent.front().second, true));
    for (unsigned int k = 1; k < of_right.size(); ++k)
      basis.append(std::move(of_right[k]), 1e-9);
    recent.clear();
    predictor = {};
    opened.clear();
    forget_images();
  }

  bool ReducedModel::gather_changing(const std::vector<Term> &terms)
  {
    const Members now = members_of(terms);
    for (auto &of_order : coefficients)
      of_order.assign(fixed.size(), 0.);
    Members stay;
    bool known = true;
    for (unsigned int i = 0; i < fixed.size(); ++i)
    {
      coefficients[fixed[i].order][i] = 1;
      for (const Member &member : fixed[i].members)
      {
        stay.push_back(member);
        const Member *present    = find(now, member);
        const double coefficient = present ? present->coefficient : 0.;
        if (find(varying, member))
          coefficients[fixed[i].order][i] = coefficient;
        else if (coefficient != member.coefficient)
        {
          // The sum no longer holds: the next expansion point, for which these projections must
          // wait, keeps this matrix apart.
          varying.push_back(member);
          factors.reset();
          known = false;
        }
      }
    }
    if (!known)
      return false;

    has_velocity_terms = std::any_of(terms.begin(), terms.end(),
                                     [](const Term &term)
                                     { return term.order == 1 && term.matrix && *term.matrix; });
    std::array<std::vector<InterfaceTerms::Summand>, 3> summands;
    for (const Member &member : now)
      if (!find(stay, member))
        summands[member.order].emplace_back(member.coefficient, member.matrix.get());
    const unsigned int n_changes = interface.n_changes();
    if (!interface.set_terms(summands))
      return false;
    if (interface.n_changes() != n_changes)
      right_change = DenseMatrix();
    return true;
  }

  /// The responses of the expansion point to a gap where contacts have opened since.
  void ReducedModel::add_openings()
  {
    const auto without = [](std::vector<unsigned int> list, const std::vector<unsigned int> &known)
    {
      list.erase(std::remove_if(list.begin(), list.end(),
                                [&](const unsigned int r)
                                { return std::count(known.begin(), known.end(), r) > 0; }),
                 list.end());
      return list;
    };
    if (!interface.is_constrained())
      return;
    const std::vector<unsigned int> added  = without(interface.open_contacts(), opened),
                                    newly  = without(added, open_before),
                                    before = without(added, newly);
    opened.insert(opened.end(), added.begin(), added.end());
    // V has modes with the gaps of those that were open before, but these go on to change, each by
    // itself: corrections by the expansion point's factors, for which they are closed, do not.
    add_responses(before, 1);
    add_responses(newly, 4);
  }

  void ReducedModel::add_responses(const std::vector<unsigned int> &added,
                                   const unsigned int n_summands)
  {
    if (added.empty())
      return;
    std::vector<unsigned int> added_rows;
    for (const unsigned int r : added)
      added_rows.push_back(interface.rows()[r]);
    // The response at l, (l^2 M + Q)^{-1} e = Q^{-1} e - l^2 Q^{-1} M Q^{-1} e + ...; the modes,
    // which make this series slow, are in V.
    MultiVector forces = unit_columns(rows, added_rows);
    for (unsigned int k = 0; k < n_summands; ++k)
    {
      MultiVector responses             = basis.displacements(factors->solve(forces));
      const std::vector<double> squares = inner_products(responses, responses);
      std::vector<double> lengths;
      for (unsigned int j = 0; j < responses.n_columns(); ++j)
        lengths.push_back(1 /
                          std::sqrt(std::max(squares[j * (responses.n_columns() + 1)], 1e-300)));
      scale_columns(responses, lengths);
      const unsigned int before = dimension();
      basis.append(std::move(responses), ProjectionBasis::smallest);
      if (dimension() == before || k + 1 == n_summands)
        break;
      // Of what is new only: what V has is not to come again.
      const MultiVector last = basis.right().columns(before, dimension() - before);
      forces                 = MultiVector(rows, last.n_columns());
      for (unsigned int i = 0; i < fixed.size(); ++i)
        if (coefficients[2][i] != 0)
        {
          const MultiVector image = multiply(*fixed[i].matrix, last);
          for (std::size_t e = 0; e < std::size_t(rows.n_local()) * last.n_columns(); ++e)
            forces.data()[e] += coefficients[2][i] * image.data()[e];
        }
    }
  }

  /// Of the pairs in the disc those with the smallest residuals: others are no modes of the whole
  /// problem.
  std::vector<unsigned int> ReducedModel::best_pairs(const ReducedPairs &solutions) const
  {
    std::vector<unsigned int> best(solutions.lambda.size());
    std::iota(best.begin(), best.end(), 0u);
    std::stable_sort(best.begin(), best.end(),
                     [&](const unsigned int a, const unsigned int b)
                     { return solutions.errors[a] < solutions.errors[b]; });
    best.resize(std::min<std::size_t>(best.size(), n_disc));
    return best;
  }

  std::vector<unsigned int> ReducedModel::failing(const ReducedPairs &solutions,
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

  /// Solves the projected problem and certifies the pairs; gives their residuals. The last pairs
  /// are where to start from.
  MultiVector ReducedModel::solve_projected(ReducedPairs &x, ReducedPairs &y)
  {
    if (n_imaged < dimension())
      add_images();
    satisfy_constraints();
    project_terms();
    x = last_right;
    y = last_left;
    if (x.lambda.empty() || !small.improve(x, y))
    {
      small.solve_densely(x, y);
      // Dense pairs have rounding errors of stiff vectors, and may be more than there are modes.
      if (x.lambda.size() > n_disc)
      {
        certify(residuals(x), x);
        std::vector<double> errors = x.errors;
        std::nth_element(errors.begin(), errors.begin() + n_disc, errors.end());
        has_others |= errors[n_disc] <= known_beyond;
        const std::vector<unsigned int> best = best_pairs(x);
        x                                    = x.select(best);
        y                                    = y.select(best);
      }
      ReducedPairs refined_x = x, refined_y = y;
      if (small.improve(refined_x, refined_y))
      {
        x = std::move(refined_x);
        y = std::move(refined_y);
      }
    }
    MultiVector result = residuals(x);
    certify(result, x);
    if (x.lambda.size() == n_disc)
    {
      last_right = x;
      last_left  = y;
    }
    return result;
  }

  bool ReducedModel::enrich(const MultiVector &residuals_of_x, const ReducedPairs &x)
  {
    // With a margin, so that the next parameters need none
    const std::vector<unsigned int> lacking = failing(x, best_pairs(x), 0.3 * accepted_error());
    if (lacking.empty())
      return false;
    const unsigned int before = dimension();
    MultiVector added         = corrections(residuals_of_x, lacking);
    DenseMatrix products(added.n_columns(), added.n_columns(), inner_products(added, added));
    const double largest = std::sqrt(std::max(0., symmetric_eigen(products).back()));
    basis.append(std::move(added), std::max(ProjectionBasis::smallest, 1e-2 * largest));
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
    if (!has_overdamped)
      return true;
    ReducedPairs x, y;
    small.solve_densely(x, y);
    return x.lambda.size() == n_disc;
  }

  std::optional<EigenPairs> ReducedModel::solve_by_projection(const std::vector<Term> &terms)
  {
    const double largest_error = accepted_error();
    if (!has_expansion_point())
      return std::nullopt;
    if (fixed.empty() && !find_fixed(terms))
    {
      factors.reset();
      return std::nullopt;
    }
    if (!gather_changing(terms))
      return std::nullopt;
    add_openings();
    // What is going to fail is corrected by the residuals of before: the projected problem is
    // solved and certified once less.
    if (predictor.residuals.n_columns() > 0 && interface.open_contacts() == open_before &&
        predictor.worst * predictor.growth > largest_error && dimension() < largest_dimension())
      enrich(predictor.residuals, predictor.solutions);
    predictor.residuals = {};
    has_others          = false;
    ReducedPairs x, y;
    for (unsigned int n_corrections = 0;; ++n_corrections)
    {
      const MultiVector residuals_of_x        = solve_projected(x, y);
      const std::vector<unsigned int> best    = best_pairs(x),
                                      lacking = failing(x, best, largest_error);
      double worst                            = 0;
      for (const unsigned int i : best)
        if (is_in_window(x.lambda[i]))
          worst = std::max(worst, x.errors[i]);
      std::ostringstream text;
      text << "  projected on " << dimension() << " vectors: " << best.size() << " of " << n_disc
           << " modes, backward errors " << worst;
      options.progress(text.str());
      // A pair +-i w that has become two real eigenvalues: one of them is not among these.
      if (n_real(x.select(best).lambda) > n_real_at_expansion)
        return std::nullopt;
      if (best.size() == n_disc && lacking.empty())
      {
        if (!has_number_of_expansion_point())
          return std::nullopt;
        project_tests();
        if (std::vector<unsigned int> open = interface.open_contacts(); open != open_before)
        {
          open_before = std::move(open);
          n_steady    = 0;
        }
        ++n_steady;
        recent.insert(recent.begin(), {x.select(best), y.select(best)});
        if (recent.size() > most_recent)
          recent.pop_back();
        predictor.growth    = predictor.worst > 0 && n_steady > 1 ? worst / predictor.worst : 1;
        predictor.worst     = worst;
        predictor.residuals = residuals_of_x;
        predictor.solutions = x;
        return make_modes(x, y, best);
      }
      // Contacts that have closed since the expansion point are beyond the bases.
      constexpr double hopeless = 1e-4;
      // A correction divides errors by 20 or more and costs a vector a mode; a basis too large
      // costs more than a new expansion point.
      const double n_needed = std::ceil(std::log(worst / largest_error) / std::log(20.));
      if (n_corrections == most_corrections || lacking.empty() || worst > hopeless ||
          dimension() + n_needed * lacking.size() > largest_dimension())
        return std::nullopt;
      if (!enrich(residuals_of_x, x))
        return std::nullopt;
    }
  }
} // namespace squeal
