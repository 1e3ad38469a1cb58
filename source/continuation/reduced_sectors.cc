#include <squeal/continuation/reduced_sectors.h>
#include <squeal/eigen/eigensolvers.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace squeal
{
  namespace
  {
    /// (A_h)_ij of all parts as one matrix with blocks on the diagonal.
    Matrix block_diagonal(const std::vector<const Matrix *> &parts,
                          const std::vector<unsigned int> &sizes)
    {
      if (std::none_of(parts.begin(), parts.end(), [](const Matrix *part) { return bool(*part); }))
        return {};
      const unsigned int n = std::accumulate(sizes.begin(), sizes.end(), 0u);
      DenseMatrix whole(n, n);
      unsigned int first = 0;
      for (unsigned int h = 0; h < parts.size(); first += sizes[h++])
        if (*parts[h])
          for_entries(*parts[h], [&](const PetscInt row, const PetscInt column, const double value)
                      { whole(first + row, first + column) = value; });
      return to_matrix(whole);
    }

    /// Rows of a block of MPI_COMM_SELF at a place of a longer one.
    void insert(const MultiVector &rows, const unsigned int first, const unsigned int first_column,
                MultiVector &to)
    {
      for (unsigned int k = 0; k < rows.n_columns(); ++k)
        std::copy_n(rows.column(k), rows.n_local(), to.column(first_column + k) + first);
    }

    void insert(const ComplexMultiVector &rows, const unsigned int first,
                const unsigned int first_column, ComplexMultiVector &to)
    {
      insert(rows.re, first, first_column, to.re);
      insert(rows.im, first, first_column, to.im);
    }

    constexpr std::array<ComplexMultiVector EigenPairs::*, 2> both_sides = {
        {&EigenPairs::right, &EigenPairs::left}};
  } // namespace

  void ReducedSectors::set_expansion_point(const QuadraticEigenproblem &problem,
                                           const std::vector<Term> &terms,
                                           const EigenSolution::Reuse &solution,
                                           const std::optional<MirrorSymmetry> &of_sectors)
  {
    std::vector<Part> before = std::move(parts);
    parts.clear();
    sizes.clear();
    inverse_factors.clear();
    symmetry = of_sectors;
    for (unsigned int order = 0; order < 3; ++order)
      norms[order] = (order == 0 ? problem.Q : order == 1 ? problem.P : problem.M).infinity_norm();

    const unsigned int n_parts = solution.sectors.empty() ? 1 : solution.sectors.size();
    for (unsigned int h = 0; h < n_parts; ++h)
    {
      // What it has learnt of the terms stays.
      const bool stays = before.size() == n_parts;
      if (stays)
        parts.push_back(std::move(before[h]));
      else
        parts.push_back({{}, Parity::none, ReducedModel(options), {}, 0, 0, {}, {}});
      Part &part = parts.back();
      if (n_parts > 1 && !stays)
      {
        part.space.emplace(*symmetry, h == 0);
        part.parity = h == 0 ? Parity::symmetric : Parity::antisymmetric;
      }
    }
    restrict(terms);
    for (unsigned int h = 0; h < n_parts; ++h)
    {
      Part &part                        = parts[h];
      const EigenSolution::Reuse &found = n_parts == 1 ? solution : solution.sectors[h]->reuse;
      QuadraticEigenproblem of_sector;
      if (part.space)
      {
        of_sector.rows                = part.space->row_range();
        of_sector.M                   = sum_of(of_sector.rows, part.terms, 2);
        of_sector.Q                   = sum_of(of_sector.rows, part.terms, 0);
        of_sector.n_constraints       = problem.n_constraints / 2;
        of_sector.n_local_constraints = part.space->n_local_pressures();
        of_sector.compliant           = problem.compliant;
      }
      const QuadraticEigenproblem &own = part.space ? of_sector : problem;
      part.n_modes                     = found.disc_right.n_columns() / 2;
      part.expansion_count             = found.n_reference;
      if (part.n_modes > 0)
        part.reduced.set_expansion_point(own, part.terms, found);
      else
        part.reduced = ReducedModel(options);
      if (!part.reference)
        part.reference = std::make_shared<InertiaCount>(own.rows, own.n_local_constraints,
                                                        search_radius(options.max_imaginary));
    }
    if (!has_expansion_point())
      return;
    for (unsigned int h = 0; h < n_parts; ++h)
      inverse_factors.push_back(n_parts == 1 ? solution.factorization
                                             : solution.sectors[h]->reuse.factorization);
  }

  MultiVector ReducedSectors::apply_inverse(const MultiVector &b) const
  {
    ++n_inverse_;
    if (parts.size() == 1)
      return inverse_factors.front()->solve(b);
    MultiVector x(b.row_range(), b.n_columns());
    for (unsigned int h = 0; h < parts.size(); ++h)
    {
      const MultiVector b_h = parts[h].space->restrict(b);
      if (largest_entry(b_h) == 0)
        continue;
      const MultiVector x_h = parts[h].space->expand(inverse_factors[h]->solve(b_h));
      for (std::size_t i = 0; i < std::size_t(x.n_local()) * x.n_columns(); ++i)
        x.data()[i] += x_h.data()[i];
    }
    return x;
  }

  void ReducedSectors::renew_inverse(const std::vector<Term> &terms)
  {
    if (!has_expansion_point() || !restrict(terms))
      return;
    const Part &part = parts.front();
    try
    {
      inverse_factors.front() = std::make_shared<const Factorization>(
          sum_of(part.reference->row_range(), part.terms, 0), Factorization::Kind::lu,
          "the position matrix (for static states)");
    }
    catch (const SingularMatrix &)
    {
    }
  }

  std::vector<double> ReducedSectors::varying_terms() const
  {
    return parts.empty() ? std::vector<double>() : parts.front().reduced.varying_terms();
  }

  void ReducedSectors::keep_apart(const std::vector<double> &varying_terms)
  {
    for (Part &part : parts)
      part.reduced.keep_apart(varying_terms);
  }

  bool ReducedSectors::has_expansion_point() const
  {
    return !parts.empty() &&
           std::all_of(parts.begin(), parts.end(),
                       [](const Part &part)
                       { return part.n_modes == 0 || part.reduced.has_expansion_point(); }) &&
           std::any_of(parts.begin(), parts.end(),
                       [](const Part &part) { return part.n_modes > 0; });
  }

  unsigned int ReducedSectors::dimension() const
  {
    unsigned int n = 0;
    for (const Part &part : parts)
      n += part.reduced.dimension();
    return n;
  }

  // Terms.

  /// The largest entry of S A S x - A x, for some scattered x, against the norms of the expansion
  /// point.
  bool ReducedSectors::are_symmetric(const std::vector<Term> &terms) const
  {
    // A hundredth of the backward error that projected modes may have
    const double rounding = 1e-3 * options.tolerance;
    const MultiVector x = symmetry->scattered(1), s_x = symmetry->reflect(x);
    for (const Term &term : terms)
    {
      const MultiVector asymmetry =
          difference(multiply(*term.matrix, x), symmetry->reflect(multiply(*term.matrix, s_x)));
      if (!(std::abs(term.coefficient) * largest_entry(asymmetry) <= rounding * norms[term.order]))
        return false;
    }
    return true;
  }

  bool ReducedSectors::restrict(const std::vector<Term> &terms)
  {
    if (parts.size() == 1)
    {
      parts.front().terms = terms;
      return true;
    }
    std::vector<Term> added;
    for (const Term &term : terms)
      if (term.matrix && *term.matrix && !parts.front().restricted.count(term.matrix))
        added.push_back(term);
    if (!are_symmetric(added))
      return false;
    // New ones at once: rows are walked through once for all.
    std::vector<std::vector<Term>> alone;
    for (const Term &term : added)
      if (std::none_of(alone.begin(), alone.end(),
                       [&](const std::vector<Term> &other)
                       { return other.front().matrix == term.matrix; }))
        alone.push_back({{term.origin, 0, 1., term.matrix}});
    for (Part &part : parts)
    {
      std::vector<Matrix> restricted = part.space->restrict(alone);
      std::map<std::shared_ptr<const Matrix>, std::shared_ptr<const Matrix>> present;
      for (unsigned int k = 0; k < alone.size(); ++k)
        present[alone[k].front().matrix] = std::make_shared<const Matrix>(std::move(restricted[k]));
      part.terms.clear();
      for (const Term &term : terms)
      {
        if (!term.matrix || !*term.matrix)
          continue;
        std::shared_ptr<const Matrix> &of_sector = present[term.matrix];
        if (!of_sector)
          of_sector = part.restricted.at(term.matrix);
        part.terms.push_back({term.origin, term.order, term.coefficient, of_sector});
      }
      part.restricted = std::move(present);
    }
    return true;
  }

  bool ReducedSectors::has_count_of_expansion_point(const std::vector<Term> &terms)
  {
    if (!restrict(terms))
      return false;
    for (Part &part : parts)
      if (part.reference->count(part.terms) != part.expansion_count)
        return false;
    return true;
  }

  // Modes.

  std::optional<EigenPairs> ReducedSectors::solve(const std::vector<Term> &terms)
  {
    if (!restrict(terms))
      return std::nullopt;
    std::vector<EigenPairs> found;
    for (Part &part : parts)
    {
      if (part.n_modes == 0)
      {
        found.emplace_back();
        continue;
      }
      std::optional<EigenPairs> modes = part.reduced.solve(part.terms);
      if (!modes)
        return std::nullopt;
      found.push_back(std::move(*modes));
    }
    if (parts.size() == 1)
      return std::move(found.front());

    struct Place
    {
      unsigned int part, mode;
    };
    std::vector<Place> order;
    for (unsigned int h = 0; h < parts.size(); ++h)
      for (unsigned int k = 0; k < found[h].lambda.size(); ++k)
        order.push_back({h, k});
    std::stable_sort(order.begin(), order.end(),
                     [&](const Place &a, const Place &b) {
                       return precedes(found[a.part].lambda[a.mode], found[b.part].lambda[b.mode]);
                     });
    EigenPairs modes;
    modes.right = modes.left         = ComplexMultiVector(small_rows(dimension()), order.size());
    std::vector<unsigned int> firsts = {0};
    for (const Part &part : parts)
      firsts.push_back(firsts.back() + part.reduced.dimension());
    for (unsigned int k = 0; k < order.size(); ++k)
    {
      const auto [h, j]           = order[k];
      const EigenPairs &of_sector = found[h];
      modes.lambda.push_back(of_sector.lambda[j]);
      // Components and norms of a sector and of the whole differ by up to sqrt(2).
      modes.backward_error.push_back(2 * of_sector.backward_error[j]);
      modes.left_backward_error.push_back(of_sector.left_backward_error[j]);
      modes.condition.push_back(of_sector.condition[j]);
      modes.parity.push_back(parts[h].parity);
      for (const auto side : both_sides)
        insert((of_sector.*side).columns({j}), firsts[h], k, modes.*side);
    }
    std::vector<unsigned int> &now = sizes[dimension()];
    now.clear();
    for (const Part &part : parts)
      now.push_back(part.reduced.dimension());
    return modes;
  }

  bool ReducedSectors::is_crowded() const
  {
    return std::any_of(parts.begin(), parts.end(),
                       [](const Part &part) { return part.reduced.is_crowded(); });
  }

  EigenPairs ReducedSectors::restart(const EigenPairs &modes)
  {
    if (parts.size() == 1)
    {
      const EigenPairs whole = parts.front().reduced.expand(modes);
      parts.front().reduced.restart();
      return parts.front().reduced.coordinates(whole);
    }
    const std::vector<unsigned int> before = sizes_of(modes);
    std::vector<EigenPairs> of_sectors;
    std::vector<unsigned int> now, firsts = {0};
    for (unsigned int h = 0; h < parts.size(); ++h)
    {
      ReducedModel &reduced = parts[h].reduced;
      of_sectors.push_back(extract(modes, h, before));
      if (reduced.is_crowded())
      {
        const EigenPairs whole = reduced.expand(of_sectors[h]);
        reduced.restart();
        of_sectors[h] = reduced.coordinates(whole);
      }
      now.push_back(reduced.dimension());
      firsts.push_back(firsts.back() + now.back());
    }
    sizes              = {};
    sizes[dimension()] = now;
    EigenPairs result  = modes;
    for (const auto side : both_sides)
    {
      result.*side = ComplexMultiVector(small_rows(dimension()), modes.size());
      for (unsigned int h = 0; h < parts.size(); ++h)
      {
        const std::vector<unsigned int> numbers = modes_of(modes, parts[h]);
        for (unsigned int k = 0; k < numbers.size(); ++k)
          insert((of_sectors[h].*side).columns({k}), firsts[h], numbers[k], result.*side);
      }
    }
    return result;
  }

  QuadraticEigenproblem ReducedSectors::problem() const
  {
    if (parts.size() == 1)
      return parts.front().reduced.problem();
    std::vector<QuadraticEigenproblem> problems;
    std::vector<unsigned int> n;
    for (const Part &part : parts)
    {
      problems.push_back(part.n_modes > 0 ? part.reduced.problem() : QuadraticEigenproblem());
      n.push_back(part.reduced.dimension());
    }
    QuadraticEigenproblem result;
    result.rows = small_rows(dimension());
    for (Matrix QuadraticEigenproblem::*matrix :
         {&QuadraticEigenproblem::M, &QuadraticEigenproblem::P, &QuadraticEigenproblem::Q})
    {
      std::vector<const Matrix *> of_parts;
      for (const QuadraticEigenproblem &part : problems)
        of_parts.push_back(&(part.*matrix));
      result.*matrix = block_diagonal(of_parts, n);
    }
    return result;
  }

  std::vector<unsigned int> ReducedSectors::modes_of(const EigenPairs &modes,
                                                     const Part &part) const
  {
    std::vector<unsigned int> numbers;
    for (unsigned int k = 0; k < modes.lambda.size(); ++k)
      if (modes.parity[k] == part.parity)
        numbers.push_back(k);
    return numbers;
  }

  const std::vector<unsigned int> &ReducedSectors::sizes_of(const EigenPairs &modes) const
  {
    return sizes.at(modes.right.row_range().size);
  }

  EigenPairs ReducedSectors::extract(const EigenPairs &modes, const unsigned int h,
                                     const std::vector<unsigned int> &n) const
  {
    const std::vector<unsigned int> numbers = modes_of(modes, parts[h]);
    const unsigned int first                = std::accumulate(n.begin(), n.begin() + h, 0u);
    EigenPairs result;
    for (const unsigned int k : numbers)
      result.lambda.push_back(modes.lambda[k]);
    for (const auto side : both_sides)
    {
      ComplexMultiVector &part = result.*side;
      part                     = ComplexMultiVector(small_rows(n[h]), numbers.size());
      for (unsigned int k = 0; k < numbers.size(); ++k)
        for (unsigned int i = 0; i < n[h]; ++i)
          part.set(i, k, (modes.*side)(first + i, numbers[k]));
    }
    return result;
  }

  ReducedModel::RayleighForms ReducedSectors::rayleigh_forms(const EigenPairs &modes) const
  {
    if (parts.size() == 1)
      return parts.front().reduced.rayleigh_forms(modes);
    ReducedModel::RayleighForms result;
    result.of_p.resize(modes.lambda.size());
    result.of_q = result.of_p;
    for (unsigned int h = 0; h < parts.size(); ++h)
    {
      const std::vector<unsigned int> numbers = modes_of(modes, parts[h]);
      if (numbers.empty())
        continue;
      const auto forms = parts[h].reduced.rayleigh_forms(extract(modes, h, sizes_of(modes)));
      for (unsigned int k = 0; k < numbers.size(); ++k)
      {
        result.of_p[numbers[k]] = forms.of_p[k];
        result.of_q[numbers[k]] = forms.of_q[k];
      }
    }
    return result;
  }

  /// z^H dA x of a mode of a sector needs V_h^T dA V_h only, whatever the symmetry of dA.
  std::vector<Term> ReducedSectors::project(const std::vector<Term> &terms) const
  {
    if (parts.size() == 1)
      return parts.front().reduced.project(terms);
    std::vector<unsigned int> n;
    for (const Part &part : parts)
      n.push_back(part.reduced.dimension());
    const Matrix empty;
    std::vector<Term> result;
    for (unsigned int h = 0; h < parts.size(); ++h)
    {
      if (parts[h].n_modes == 0)
        continue;
      std::vector<Term> restricted;
      for (const Term &term : terms)
        if (term.matrix && *term.matrix)
          restricted.push_back(
              {term.origin, term.order, term.coefficient,
               std::make_shared<const Matrix>(parts[h].space->restrict(term.matrix))});
      for (Term &term : parts[h].reduced.project(restricted))
      {
        std::vector<const Matrix *> blocks(parts.size(), &empty);
        blocks[h]   = term.matrix.get();
        term.matrix = std::make_shared<const Matrix>(block_diagonal(blocks, n));
        result.push_back(term);
      }
    }
    return result;
  }

  EigenPairs ReducedSectors::expand(const EigenPairs &modes) const
  {
    if (parts.size() == 1)
      return parts.front().reduced.expand(modes);
    EigenPairs result = modes;
    for (const auto side : both_sides)
      result.*side = ComplexMultiVector(symmetry->rows, modes.size());
    for (unsigned int h = 0; h < parts.size(); ++h)
    {
      const std::vector<unsigned int> numbers = modes_of(modes, parts[h]);
      if (numbers.empty())
        continue;
      const EigenPairs of_sector = parts[h].reduced.expand(extract(modes, h, sizes_of(modes)));
      for (const auto side : both_sides)
      {
        const ComplexMultiVector whole(parts[h].space->expand((of_sector.*side).re),
                                       parts[h].space->expand((of_sector.*side).im));
        for (unsigned int k = 0; k < numbers.size(); ++k)
          insert(whole.columns({k}), 0, numbers[k], result.*side);
      }
    }
    return result;
  }

  EigenPairs ReducedSectors::pad(const EigenPairs &modes) const
  {
    if (parts.size() == 1)
      return parts.front().reduced.pad(modes);
    EigenPairs result                    = modes;
    const std::vector<unsigned int> &old = sizes_of(modes);
    for (const auto side : both_sides)
    {
      ComplexMultiVector padded(small_rows(dimension()), modes.size());
      unsigned int from = 0, to = 0;
      for (unsigned int h = 0; h < parts.size(); ++h)
      {
        for (unsigned int k = 0; k < modes.size(); ++k)
          for (unsigned int i = 0; i < old[h]; ++i)
            padded.set(to + i, k, (modes.*side)(from + i, k));
        from += old[h];
        to += parts[h].reduced.dimension();
      }
      result.*side = std::move(padded);
    }
    return result;
  }
} // namespace squeal
