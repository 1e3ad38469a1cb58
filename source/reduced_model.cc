#include <squeal/left_vectors.h>
#include <squeal/reduced_model.h>
#include <squeal/reduced_tools.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

namespace squeal
{
  using namespace reduced;

  namespace
  {
    constexpr double smallest =
        1e-9; ///< parts of unit vectors below this are left out of the bases
    constexpr unsigned int most_corrections = 6;
  } // namespace

  // Bases.

  Block ReducedModel::displacements(Block block) const
  {
    for (unsigned int k = 0; k < block.n_columns(); ++k)
      std::fill_n(block.column(k) + block.n_local() - n_local_constraints, n_local_constraints, 0.);
    return block;
  }

  Block ReducedModel::violations(const Block &block, const bool of_left) const
  {
    Block sum(rows, block.n_columns());
    for (const Term &term : anchor_contact)
    {
      const Block image =
          of_left ? multiply_transposed(*term.matrix, block) : multiply(*term.matrix, block);
      for (unsigned int k = 0; k < block.n_columns(); ++k)
        for (unsigned int i = block.n_local() - n_local_constraints; i < block.n_local(); ++i)
          sum.column(k)[i] += term.coefficient * image.column(k)[i];
    }
    return sum;
  }

  Block ReducedModel::moved_by_anchor(const Block &block, const bool to_left) const
  {
    if (!has_constraints || compliant)
      return block;
    Block violation = violations(block, to_left);
    for (const unsigned int r : opened)
      if (rows.contains(interface_rows[r]))
        for (unsigned int k = 0; k < block.n_columns(); ++k)
          violation.column(k)[interface_rows[r] - rows.begin] = 0;
    Block result = block;
    const Block change =
        displacements(to_left ? factors->solve_transposed(violation) : factors->solve(violation));
    for (std::size_t i = 0; i < std::size_t(block.n_local()) * block.n_columns(); ++i)
      result.data()[i] -= change.data()[i];
    return result;
  }

  void ReducedModel::append(Block of_right, Block of_left, const double smallest)
  {
    // Both undergo what makes the right ones an orthonormal addition to V.
    const auto remove_old = [&]()
    {
      if (dimension() == 0)
        return;
      const std::vector<double> c = inner_products(right.vectors, of_right);
      subtract_combination(of_right, right.vectors, c);
      subtract_combination(of_left, left.vectors, c);
    };
    remove_old();
    for (unsigned int pass = 0; pass < 2; ++pass)
    {
      const unsigned int n = of_right.n_columns();
      if (n == 0)
        return;
      const Components components = principal_components(of_right);
      unsigned int n_kept         = 0;
      while (n_kept < n && components.sizes[n_kept] > (pass == 0 ? smallest : 0.5))
        ++n_kept;
      std::vector<double> coefficients(std::size_t(n) * n_kept);
      for (unsigned int j = 0; j < n_kept; ++j)
        for (unsigned int i = 0; i < n; ++i)
          coefficients[i + std::size_t(j) * n] = components.vectors(i, j) / components.sizes[j];
      of_right = combine(of_right, coefficients, n_kept);
      of_left  = combine(of_left, coefficients, n_kept);
      // What was small has lost its orthogonality to rounding: twice. So has it the constraints.
      remove_old();
      of_right = moved_by_anchor(of_right, false);
    }
    right.vectors.append(of_right);
    left.vectors.append(of_left);
  }

  void ReducedModel::append_pairs(Block right_ones, const Block &left_ones, const double smallest)
  {
    Block of_left = moved_by_anchor(right_ones, true);
    of_left.append(left_ones);
    right_ones.append(moved_by_anchor(left_ones, false));
    append(std::move(right_ones), std::move(of_left), smallest);
  }

  void ReducedModel::anchor(const QuadraticEigenproblem &problem, const std::vector<Term> &terms,
                            const Modes &modes)
  {
    *this = ReducedModel(options);
    // A small problem is solved as fast as projected.
    if (!modes.factorization || problem.rows.size <= 2 * modes.disc_right.n_columns())
      return;
    rows                = problem.rows;
    n_local_constraints = problem.n_local_constraints;
    factors             = modes.factorization;
    n_disc              = modes.disc_right.n_columns() / 2;
    right.vectors = left.vectors = Block(rows, 0);
    compliant                    = problem.compliant;
    has_constraints              = problem.n_constraints > 0;
    anchor_contact               = terms;
    candidates                   = matrices_of(terms);

    // Modes of unit displacements, and the row where each is largest
    pending = {{displacements(modes.disc_right), displacements(modes.disc_left)}};
    for (Block &block : pending)
    {
      const Block &of_displacements     = block;
      const std::vector<double> squares = inner_products(of_displacements, of_displacements);
      std::vector<double> factors(2 * n_disc);
      for (unsigned int j = 0; j < 2 * n_disc; ++j)
      {
        const unsigned int re = j % n_disc, im = re + n_disc;
        factors[j] = 1 / std::sqrt(squares[re * (2 * n_disc + 1)] + squares[im * (2 * n_disc + 1)]);
        struct
        {
          double value = 0;
          int row      = 0;
        } largest;
        for (unsigned int i = 0; i < of_displacements.n_local(); ++i)
          if (const double value = std::abs(of_displacements.column(j)[i]); value > largest.value)
          {
            largest.value = value;
            largest.row   = rows.begin + i;
          }
        MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE_INT, MPI_MAXLOC, rows.comm);
        peak_rows.push_back(largest.row);
      }
      scale_columns(block, factors);
    }
    // The left vectors were given as Q^T y = 0, y = conj(z): the same span.
  }

  // Terms.

  bool ReducedModel::find_fixed(const std::vector<Term> &terms)
  {
    const auto present = matrices_of(terms);
    const auto is_in   = [](const auto &list, const auto &matrix)
    { return std::find(list.begin(), list.end(), matrix) != list.end(); };
    for (const auto &matrix : present)
      if (is_in(candidates, matrix) && !is_in(fixed, matrix))
        fixed.push_back(matrix);
    for (const auto &matrix : fixed)
      fixed_norms.push_back(matrix->infinity_norm());
    std::vector<char> touched(rows.size);
    for (const auto &list : {candidates, present})
      for (const auto &matrix : list)
        if (!is_in(fixed, matrix))
          for_entries(*matrix, [&](const PetscInt row, const PetscInt column, double)
                      { touched[row] = touched[column] = 1; });
    candidates.clear();
    MPI_Allreduce(MPI_IN_PLACE, touched.data(), touched.size(), MPI_CHAR, MPI_MAX, rows.comm);
    interface_number.assign(rows.size, -1);
    for (unsigned int row = 0; row < rows.size; ++row)
      if (touched[row])
      {
        interface_number[row] = interface_rows.size();
        interface_rows.push_back(row);
      }
    std::vector<char> constrained(rows.size);
    for (unsigned int row = rows.end - n_local_constraints; row < rows.end; ++row)
      constrained[row] = 1;
    MPI_Allreduce(MPI_IN_PLACE, constrained.data(), constrained.size(), MPI_CHAR, MPI_MAX,
                  rows.comm);
    for (const unsigned int row : interface_rows)
      is_constraint.push_back(constrained[row]);
    images.assign(fixed.size(), Block(rows, 0));
    gram.assign(fixed.size() * fixed.size(), DenseMatrix());
    at_rows.resize(fixed.size());
    outside.assign(fixed.size(), {});
    inside.assign(fixed.size(), {});
    for (auto &of_form : projected)
      of_form.resize(fixed.size());
    anchor_contact.erase(std::remove_if(anchor_contact.begin(), anchor_contact.end(),
                                        [&](const Term &term) {
                                          return term.order != 0 || !term.matrix || !*term.matrix ||
                                                 is_in(fixed, term.matrix);
                                        }),
                         anchor_contact.end());
    append_pairs(std::move(pending[0]), pending[1], smallest);
    pending = {};
    return !fixed.empty() && 2 * interface_rows.size() < rows.size;
  }

  bool ReducedModel::gather_changing(const std::vector<Term> &terms)
  {
    has_velocity_terms = false;
    int known          = true;
    for (unsigned int order = 0; order < 3; ++order)
    {
      Entries &entries = changing[order];
      entries          = {};
      coefficients[order].assign(fixed.size(), 0.);
      for (const Term &term : terms)
      {
        if (term.order != order || !term.matrix || !*term.matrix)
          continue;
        has_velocity_terms |= order == 1;
        const auto at = std::find(fixed.begin(), fixed.end(), term.matrix);
        if (at != fixed.end())
          coefficients[order][at - fixed.begin()] += term.coefficient;
        else
          for_entries(*term.matrix,
                      [&](const PetscInt row, const PetscInt column, const double value)
                      {
                        entries.rows.push_back(interface_number[row]);
                        entries.columns.push_back(interface_number[column]);
                        entries.values.push_back(term.coefficient * value);
                        known &= entries.rows.back() >= 0 && entries.columns.back() >= 0;
                      });
      }
      gather(entries.rows, MPI_INT, rows.comm);
      gather(entries.columns, MPI_INT, rows.comm);
      gather(entries.values, MPI_DOUBLE, rows.comm);
    }
    MPI_Allreduce(MPI_IN_PLACE, &known, 1, MPI_INT, MPI_MIN, rows.comm);
    return known;
  }

  /// The responses of the anchor to a gap where contacts have opened since.
  void ReducedModel::add_openings()
  {
    std::vector<unsigned int> added;
    std::vector<char> couples(interface_rows.size());
    const Entries &entries = changing[0];
    for (std::size_t k = 0; k < entries.values.size(); ++k)
      if (is_constraint[entries.rows[k]] && !is_constraint[entries.columns[k]])
        couples[entries.rows[k]] = 1;
    for (unsigned int r = 0; r < interface_rows.size(); ++r)
      if (is_constraint[r] && !couples[r] && !std::count(opened.begin(), opened.end(), r))
        added.push_back(r);
    if (added.empty() || compliant || !has_constraints)
      return;
    opened.insert(opened.end(), added.begin(), added.end());
    Block units(rows, added.size());
    for (unsigned int k = 0; k < added.size(); ++k)
      if (rows.contains(interface_rows[added[k]]))
        units.column(k)[interface_rows[added[k]] - rows.begin] = 1;
    Block of_right                    = displacements(factors->solve(units)),
          of_left                     = displacements(factors->solve_transposed(units));
    const std::vector<double> squares = inner_products(of_right, of_right);
    std::vector<double> lengths;
    for (unsigned int k = 0; k < added.size(); ++k)
      lengths.push_back(1 / std::sqrt(std::max(squares[k * (added.size() + 1)], 1e-300)));
    scale_columns(of_right, lengths);
    scale_columns(of_left, lengths);
    append(std::move(of_right), std::move(of_left), smallest);
  }

  std::optional<Modes> ReducedModel::solve(const std::vector<Term> &terms)
  {
    if (!is_anchored())
      return std::nullopt;
    if (fixed.empty() && !find_fixed(terms))
    {
      factors.reset();
      return std::nullopt;
    }
    if (!gather_changing(terms))
      return std::nullopt;
    add_openings();
    for (unsigned int n_corrections = 0;; ++n_corrections)
    {
      if (n_imaged < dimension())
        add_images();
      if (!satisfy_constraints())
        return std::nullopt;
      project_terms();
      Solutions x = last_right, y = last_left;
      if (x.lambda.empty() || !improve(x, y))
        solve_densely(x, y);
      certify(x);
      // Of the pairs in the disc those with the smallest residuals: others are no modes of the
      // whole problem.
      std::vector<unsigned int> best(x.lambda.size()), failing;
      std::iota(best.begin(), best.end(), 0u);
      std::stable_sort(best.begin(), best.end(),
                       [&](const unsigned int a, const unsigned int b)
                       { return x.errors[a] < x.errors[b]; });
      best.resize(std::min<std::size_t>(best.size(), n_disc));
      const auto in_window = [&](const unsigned int i)
      { return x.lambda[i].imag() <= options.max_imaginary; };
      double worst = 0, largest_change = 0;
      for (const unsigned int i : best)
      {
        if (in_window(i))
          worst = std::max(worst, x.errors[i]);
        if (x.errors[i] > (in_window(i) ? accepted_error() : 1e-6))
          failing.push_back(i);
      }
      if (failing.empty())
      {
        project_tests();
        const std::vector<double> change = changes(x);
        for (const unsigned int i : best)
          if (in_window(i))
          {
            largest_change = std::max(largest_change, change[i]);
            if (change[i] > accepted_change())
              failing.push_back(i);
          }
      }
      std::ostringstream text;
      text << "  projected on " << dimension() << " vectors: " << best.size() << " of " << n_disc
           << " modes, backward errors " << worst << ", changes " << largest_change;
      options.progress(text.str());
      if (best.size() == n_disc && x.lambda.size() == n_disc)
      {
        last_right = x;
        last_left  = y;
      }
      if (best.size() == n_disc && failing.empty())
        return make_modes(x, y, best);
      // On a small mesh a full solution is cheaper than corrections of a bad start.
      if (n_corrections == 0 && rows.size < 20000 && worst > 1e-7)
        return std::nullopt;
      if (n_corrections == most_corrections || failing.empty() || dimension() > 100 + 16 * n_disc)
        return std::nullopt;
      const unsigned int before = dimension();
      const Block of_right      = right_corrections(x, failing),
                  of_left       = left_corrections(terms, y, failing);
      double largest            = 0;
      for (const Block *block : {&of_right, &of_left})
        largest = std::max(largest, principal_components(*block).sizes.front());
      append_pairs(of_right, of_left, std::max(smallest, 1e-6 * largest));
      if (dimension() == before)
        return std::nullopt;
    }
  }

  Modes ReducedModel::make_modes(const Solutions &x, const Solutions &y,
                                 const std::vector<unsigned int> &which) const
  {
    const unsigned int m = dimension();
    std::vector<unsigned int> order;
    Modes modes;
    for (unsigned int k = 0; k < which.size(); ++k)
    {
      const Complex l = x.lambda[which[k]];
      modes.disc_lambda.push_back(l);
      if (l.imag() <= options.max_imaginary && (l.imag() > 0 || l.real() > 0))
        order.push_back(k);
    }
    std::sort(order.begin(), order.end(),
              [&](const unsigned int a, const unsigned int b)
              {
                const Complex l = x.lambda[which[a]], k = x.lambda[which[b]];
                return std::make_pair(l.imag(), l.real()) < std::make_pair(k.imag(), k.real());
              });
    DenseMatrix re(m, order.size()), im = re, left_re = re, left_im = re;
    Pairs of_left;
    const std::vector<double> left_errors(order.size(), std::nan("")); // not computed
    for (unsigned int k = 0; k < order.size(); ++k)
    {
      const unsigned int i = which[order[k]];
      modes.lambda.push_back(x.lambda[i]);
      modes.backward_error.push_back(x.errors[i]);
      of_left.lambda.push_back(y.lambda[i]);
      for (unsigned int r = 0; r < m; ++r)
      {
        re(r, k)      = x.re(r, i);
        im(r, k)      = x.im(r, i);
        left_re(r, k) = y.re(r, i);
        left_im(r, k) = y.im(r, i);
      }
    }
    modes.re           = to_block(re);
    modes.im           = to_block(im);
    of_left.re         = to_block(left_re);
    of_left.im         = to_block(left_im);
    modes.completeness = "followed by projection on " + std::to_string(m) + " vectors";
    attach_left_vectors(problem(), std::move(of_left), left_errors, modes);
    normalise(modes);
    return modes;
  }

  /// x^H V^T M V x = 1, z^H W^T Q'(l) V x = 2 l, and the condition numbers.
  void ReducedModel::normalise(Modes &modes) const
  {
    const unsigned int n = modes.lambda.size();
    const Matrix m_right = sparse(operators[of_right][2]), m_left = sparse(operators[of_left][2]);
    const auto of_x = sesquilinear_form(modes.re, modes.im, m_right, modes.re, modes.im),
               of_z = sesquilinear_form(modes.left_re, modes.left_im, m_left, modes.left_re,
                                        modes.left_im),
               both = biorthogonality(problem(), modes.lambda, modes.left_re, modes.left_im,
                                      modes.lambda, modes.re, modes.im);
    modes.condition.clear();
    for (unsigned int k = 0; k < n; ++k)
    {
      const std::size_t at = k + std::size_t(k) * n;
      const double x_norm = std::sqrt(of_x[at].real()), z_norm = std::sqrt(of_z[at].real());
      modes.condition.push_back(z_norm * x_norm * std::abs(2. * modes.lambda[k]) /
                                std::abs(both[at]));
      const Complex factor = std::conj(2. * modes.lambda[k] / (both[at] / x_norm));
      for (unsigned int i = 0; i < modes.re.n_local(); ++i)
      {
        modes.re.column(k)[i] /= x_norm;
        modes.im.column(k)[i] /= x_norm;
        const Complex z = factor * Complex(modes.left_re.column(k)[i], modes.left_im.column(k)[i]);
        modes.left_re.column(k)[i] = z.real();
        modes.left_im.column(k)[i] = z.imag();
      }
    }
  }

  // Coordinates.

  Modes ReducedModel::expand(const Modes &modes) const
  {
    Modes result        = pad(modes);
    const auto expanded = [&](const Block &basis, const Block &c)
    {
      return combine(basis, {c.data(), c.data() + std::size_t(c.n_local()) * c.n_columns()},
                     c.n_columns());
    };
    result.re      = expanded(right.vectors, result.re);
    result.im      = expanded(right.vectors, result.im);
    result.left_re = expanded(left.vectors, result.left_re);
    result.left_im = expanded(left.vectors, result.left_im);
    return result;
  }

  Modes ReducedModel::pad(const Modes &modes) const
  {
    Modes result = modes;
    for (Block Modes::*block : {&Modes::re, &Modes::im, &Modes::left_re, &Modes::left_im})
    {
      const Block &old = modes.*block;
      Block padded(small_rows(dimension()), old.n_columns());
      for (unsigned int k = 0; k < old.n_columns(); ++k)
        std::copy_n(old.column(k), old.n_local(), padded.column(k));
      result.*block = std::move(padded);
    }
    return result;
  }
} // namespace squeal
