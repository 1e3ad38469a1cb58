#include <squeal/reduction/reduced_projection.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace squeal
{
  namespace
  {
    /// A with its first rows replaced.
    DenseMatrix with_top(DenseMatrix a, const DenseMatrix &top)
    {
      for (unsigned int j = 0; j < a.n_columns; ++j)
        for (unsigned int i = 0; i < top.n_rows; ++i)
          a(i, j) = top(i, j);
      return a;
    }

    /// What is known of a block's rows, a column a row, with that of further columns below.
    DenseMatrix with_rows_below(const DenseMatrix &known, const DenseMatrix &added)
    {
      DenseMatrix all(known.n_rows + added.n_rows, added.n_columns);
      for (unsigned int j = 0; j < added.n_columns; ++j)
      {
        double *const to = all.values.data() + std::size_t(j) * all.n_rows;
        std::copy_n(known.values.data() + std::size_t(j) * known.n_rows, known.n_rows, to);
        std::copy_n(added.values.data() + std::size_t(j) * added.n_rows, added.n_rows,
                    to + known.n_rows);
      }
      return all;
    }

    std::vector<double> top_corner(const DenseMatrix &a, const unsigned int n)
    {
      std::vector<double> result;
      for (unsigned int j = 0; j < n; ++j)
        for (unsigned int i = 0; i < n; ++i)
          result.push_back(a(i, j));
      return result;
    }
  } // namespace

  ReducedProjection::ReducedProjection(const QuadraticEigenproblem &problem)
      : basis(problem.rows, problem.n_local_constraints),
        interface(problem.rows, problem.n_local_constraints, problem.n_constraints > 0,
                  problem.compliant)
  {
  }

  bool ReducedProjection::split(const std::vector<Term> &all_terms)
  {
    std::vector<char> touched = terms.split(basis.rows, all_terms);
    for (const unsigned int row : interface.rows())
      touched[row] = 1;
    interface.set_rows(std::move(touched));
    forget_images();
    return terms.size() > 0 && 2 * interface.n_rows() < basis.rows.size;
  }

  bool ReducedProjection::set_changing(const AffineTerms::Summands &changing)
  {
    const unsigned int n_changes = interface.n_changes();
    if (!interface.set_terms(changing))
      return false;
    if (interface.n_changes() != n_changes)
      right_change = DenseMatrix();
    return true;
  }

  void ReducedProjection::forget_images()
  {
    n_imaged   = 0;
    right_rows = DenseMatrix();
    at_rows.assign(terms.size(), {});
    sketches.assign(terms.size(), DenseMatrix(ResidualSketch::n_directions, 0));
    for (auto &of_form : projected)
      of_form.assign(terms.size(), {});
    projected[petrov].assign(terms.size(), DenseMatrix(basis.left.n_columns(), 0));
    right_change = DenseMatrix();
  }

  /// Small vectors scaled to unit length have lost a little of the constraints to rounding.
  void ReducedProjection::clean(MultiVector &added) const
  {
    if (!interface.is_constrained())
      return;
    const DenseMatrix change =
        interface.right_constraints().shortest_change(gather_rows(added, interface.rows()));
    constexpr double rounding = 1e-3; // more is a gap
    for (unsigned int j = 0; j < added.n_columns(); ++j)
    {
      double largest = 0;
      for (unsigned int r = 0; r < interface.n_rows(); ++r)
        largest = std::max(largest, std::abs(change(j, r)));
      for (unsigned int r = 0; r < interface.n_rows() && largest <= rounding; ++r)
        if (basis.rows.contains(interface.rows()[r]))
          added.column(j)[interface.rows()[r] - basis.rows.begin] += change(j, r);
    }
  }

  /// Images are long, one for each matrix and vector: what is to be known of them is kept instead.
  void ReducedProjection::add_images()
  {
    const unsigned int n_all = dimension(), n_new = n_all - n_imaged, n_matrices = terms.size(),
                       n_left = basis.left.n_columns();
    MultiVector added         = basis.right().columns(n_imaged, n_new);
    clean(added);
    basis.space.replace(n_imaged, added);
    if (!sketch)
      sketch.emplace(basis.rows);
    right_rows = with_rows_below(right_rows, gather_rows(added, interface.rows()));
    tests.rows = with_top(right_rows, gather_rows(basis.left, interface.rows()));

    // V^T A V_new, W^T A V_new and V_old^T A^T V_new
    std::vector<DenseMatrix> by_right(n_matrices, DenseMatrix(n_all, 0)),
        by_left(n_matrices, DenseMatrix(n_left, 0)), by_old(n_matrices, DenseMatrix(n_imaged, 0));
    constexpr unsigned int most_columns = 32;
    for (unsigned int first = 0; first < n_new; first += most_columns)
    {
      const unsigned int n   = std::min(n_new - first, most_columns);
      const MultiVector some = added.columns(first, n);
      MultiVector images(basis.rows, 0);
      for (const MultiVector &of_matrix : terms.images(some))
        images.append(of_matrix);
      // V is long: one product with it for all matrices.
      const DenseMatrix of_right(n_all, images.n_columns(), inner_products(basis.right(), images)),
          of_left(n_left, images.n_columns(), inner_products(basis.left, images));
      const DenseMatrix inside = gather_rows(images, interface.rows());
      clear_rows(images, interface.rows());
      const DenseMatrix sketched = sketch->of(images);
      for (unsigned int i = 0; i < n_matrices; ++i)
      {
        append(by_right[i], some_columns(of_right, i * n, n));
        append(by_left[i], some_columns(of_left, i * n, n));
        append(sketches[i], some_columns(sketched, i * n, n));
        at_rows[i] = with_rows_below(at_rows[i], some_rows(inside, i * n, n));
        if (n_imaged > 0 && !terms.is_symmetric(i))
          append(by_old[i], DenseMatrix(n_imaged, n,
                                        inner_products(basis.right(), 0, n_imaged,
                                                       terms.transposed_image(i, some), 0, n)));
      }
    }

    for (unsigned int i = 0; i < n_matrices; ++i)
    {
      if (terms.is_symmetric(i))
        by_old[i] = some_rows(by_right[i], 0, n_imaged);
      projected[of_right][i] =
          grow(projected[of_right][i], n_all,
               [&](const unsigned int first, unsigned int, unsigned int, const unsigned int n)
               { return first == 0 && n > 0 ? by_right[i] : transposed(by_old[i]); });
      DenseMatrix top = some_rows(some_columns(projected[petrov][i], 0, n_imaged), 0, n_left);
      append(top, by_left[i]);
      set_tests(i, top);
    }
    n_imaged = n_all;
  }

  void ReducedProjection::set_tests(const unsigned int i, const DenseMatrix &of_left_vectors)
  {
    projected[petrov][i]      = with_top(projected[of_right][i], of_left_vectors);
    const unsigned int n_left = of_left_vectors.n_rows, n_all = of_left_vectors.n_columns;
    // The left vectors' norms; M is symmetric.
    if (terms.coefficient(2, i) == 0)
      return;
    const DenseMatrix of_left_alone(n_left, n_left,
                                    projected[of_left][i].values.empty()
                                        ? inner_products(basis.left, terms.image(i, basis.left))
                                        : top_corner(projected[of_left][i], n_left));
    DenseMatrix whole = projected[petrov][i];
    for (unsigned int c = 0; c < n_left; ++c)
      for (unsigned int r = 0; r < n_all; ++r)
        whole(r, c) = r < n_left ? of_left_alone(r, c) : projected[petrov][i](c, r);
    projected[of_left][i] = std::move(whole);
  }

  /// V^T A V becomes C^T V^T A V C; W is another: W^T A V = (A^T W)^T V.
  void ReducedProjection::turn(const DenseMatrix &c)
  {
    if (n_imaged < c.n_rows)
    {
      forget_images();
      return;
    }
    const auto turned_rows = [&c](const DenseMatrix &a)
    {
      DenseMatrix result(c.n_columns, a.n_columns);
      gemm(true, 1, c, a, 0, result);
      return result;
    };
    const DenseMatrix left_rows = gather_rows(basis.left, interface.rows());
    right_rows                  = turned_rows(right_rows);
    tests.rows                  = with_top(right_rows, left_rows);
    right_change                = DenseMatrix();
    n_imaged                    = c.n_columns;
    for (unsigned int i = 0; i < terms.size(); ++i)
    {
      at_rows[i] = turned_rows(at_rows[i]);
      DenseMatrix sketched(ResidualSketch::n_directions, n_imaged);
      gemm(false, 1, sketches[i], c, 0, sketched);
      sketches[i]                       = std::move(sketched);
      projected[of_right][i]            = congruent(projected[of_right][i], c);
      projected[of_left][i]             = DenseMatrix();
      const MultiVector of_left_vectors = terms.transposed_image(i, basis.left);
      set_tests(i, DenseMatrix(left_rows.n_rows, n_imaged,
                               inner_products(of_left_vectors, basis.right())));
    }
  }

  void ReducedProjection::satisfy_constraints(ReducedEigenproblem &small)
  {
    const bool holds_pressures = interface.is_constrained();
    tests.balance = holds_pressures ? interface.left_constraints().balancing_pressures(tests.rows)
                                    : DenseMatrix();
    tests.change  = holds_pressures ? interface.left_constraints().forces_of(tests.balance)
                                    : DenseMatrix(dimension(), interface.n_rows());
    if (right_change.n_rows != dimension() || right_change.values.empty())
    {
      right_change = holds_pressures ? interface.right_constraints().shortest_change(right_rows)
                                     : DenseMatrix(dimension(), interface.n_rows());
      small.set_violations(right_change);
    }
    tests.moved = tests.rows;
    add(1, tests.change, tests.moved);
  }

  void ReducedProjection::project(ReducedEigenproblem &small)
  {
    if (n_imaged < dimension())
      add_images();
    satisfy_constraints(small);
    tests.pressures = DenseMatrix();
    right_pressures = DenseMatrix();
    if (interface.is_compliant())
    {
      tests.pressures = interface.compliant_pressures(tests.rows, true);
      right_pressures = interface.compliant_pressures(right_rows, false);
    }
    for (unsigned int order = 0; order < 3; ++order)
    {
      DenseMatrix with_pressures = right_rows;
      if (order == 0)
        add(1, right_pressures, with_pressures);
      DenseMatrix &of_v     = changing_images[order];
      of_v                  = interface.forces(order, with_pressures);
      images_at_rows[order] = terms.sum(order, at_rows);
      DenseMatrix sum       = terms.sum(order, projected[petrov]);
      interface.add_products(tests.moved, of_v, sum);
      // W - V = -C^T (C C^T)^{-1} C V: by way of C A V, which has few columns
      if (!images_at_rows[order].values.empty() && !tests.balance.values.empty())
        add(1,
            outer_product(tests.balance,
                          interface.left_constraints().violations(images_at_rows[order])),
            sum);
      small.set_terms(order, order == 1 && !terms.has_velocity_terms() ? DenseMatrix() : sum);
      operators[petrov][order] = std::move(sum);
      add(1, of_v, images_at_rows[order]);
    }
  }

  void ReducedProjection::project_tests()
  {
    for (unsigned int order = 0; order < 3; ++order)
    {
      DenseMatrix sum = terms.sum(order, projected[of_right]);
      interface.add_products(right_rows, changing_images[order], sum);
      operators[of_right][order] = std::move(sum);
      operators[of_left][order]  = terms.sum(order, projected[of_left]);
    }
  }

  QuadraticEigenproblem ReducedProjection::problem(const Form form) const
  {
    QuadraticEigenproblem problem;
    problem.rows = small_rows(dimension());
    problem.M    = to_matrix(operators[form][2]);
    if (terms.has_velocity_terms())
      problem.P = to_matrix(operators[form][1]);
    problem.Q = to_matrix(operators[form][0]);
    return problem;
  }

  std::vector<Term> ReducedProjection::project(const std::vector<Term> &others) const
  {
    std::vector<Term> result;
    const auto add_term = [&](const Term &term, const unsigned int order, const DenseMatrix &small)
    {
      result.push_back(
          {term.origin, order, term.coefficient, std::make_shared<const Matrix>(to_matrix(small))});
    };
    // The pressures Lambda_0 + l Lambda_1 + l^2 Lambda_2 of V in the constraints' rows; those that
    // balance l^order A_order V best are -(C C^T)^{-1} C (...), C^T = N + mu T
    std::array<DenseMatrix, 3> pressures = {{right_pressures, {}, {}}};
    if (interface.is_constrained())
      for (unsigned int order = 0; order < 3; ++order)
        if (!images_at_rows[order].values.empty())
        {
          const DenseMatrix balancing =
              interface.left_constraints().balancing_pressures(images_at_rows[order]);
          pressures[order] = DenseMatrix(dimension(), interface.n_rows());
          for (unsigned int k = 0; k < balancing.n_columns; ++k)
            for (unsigned int j = 0; j < dimension(); ++j)
              pressures[order](j, interface.left_constraints().rows[k]) = balancing(j, k);
        }
    DenseMatrix test_change = tests.change;
    add(1, tests.pressures, test_change);
    for (const Term &term : others)
    {
      const MultiVector image = multiply(*term.matrix, basis.right());
      DenseMatrix small       = with_top(
                DenseMatrix(dimension(), dimension(), inner_products(basis.right(), image)),
                DenseMatrix(basis.left.n_columns(), dimension(), inner_products(basis.left, image)));
      add(1, outer_product(test_change, gather_rows(image, interface.rows())), small);
      add_term(term, term.order, small);
      // On the pressures, which are those of Lambda_0 + l Lambda_1 + l^2 Lambda_2
      DenseMatrix test = tests.moved;
      add(1, tests.pressures, test);
      for (unsigned int order = 0; order < 3; ++order)
        if (!pressures[order].values.empty())
          if (const DenseMatrix forces =
                  interface.forces_of_pressures(*term.matrix, pressures[order]);
              !forces.values.empty())
            add_term(term, term.order + order, outer_product(test, forces));
    }
    return result;
  }

  namespace
  {
    /// x^H A x of each column of x.
    std::vector<std::complex<double>> forms_of(const DenseMatrix &a, const DenseMatrix &re,
                                               const DenseMatrix &im)
    {
      DenseMatrix a_re(a.n_rows, re.n_columns), a_im = a_re;
      gemm(false, 1, a, re, 0, a_re);
      gemm(false, 1, a, im, 0, a_im);
      std::vector<std::complex<double>> sums(re.n_columns);
      for (unsigned int j = 0; j < re.n_columns; ++j)
        for (unsigned int i = 0; i < a.n_rows; ++i)
          sums[j] += std::complex<double>(re(i, j), -im(i, j)) *
                     std::complex<double>(a_re(i, j), a_im(i, j));
      return sums;
    }
  } // namespace

  ReducedProjection::RayleighForms ReducedProjection::rayleigh_forms(const EigenPairs &modes) const
  {
    const unsigned int n = modes.lambda.size();
    const auto small     = [&](const MultiVector &block) {
      return DenseMatrix(dimension(), n, {block.data(), block.data() + dimension() * n});
    };
    const DenseMatrix x_re = small(modes.right.re), x_im = small(modes.right.im);
    RayleighForms forms;
    forms.of_p = operators[of_right][1].values.empty()
                     ? std::vector<Complex>(n)
                     : forms_of(operators[of_right][1], x_re, x_im);
    forms.of_q = forms_of(operators[of_right][0], x_re, x_im);
    if (!interface.is_constrained())
      return forms;
    // (N + mu T) Lambda of the modes
    DenseMatrix at_rows_re(n, interface.n_rows()), at_rows_im = at_rows_re;
    gemm(true, 1, x_re, right_rows, 0, at_rows_re);
    gemm(true, 1, x_im, right_rows, 0, at_rows_im);
    std::array<DenseMatrix, 2> forces = forces_at_interface(modes.lambda, x_re, x_im);
    for (DenseMatrix &part : forces)
      part = interface.left_constraints().shortest_change(part);
    for (unsigned int r = 0; r < interface.n_rows(); ++r)
      for (unsigned int j = 0; j < n; ++j)
        forms.of_q[j] += Complex(at_rows_re(j, r), -at_rows_im(j, r)) *
                         Complex(forces[0](j, r), forces[1](j, r));
    return forms;
  }

  namespace
  {
    /// Columns of a complex matrix times factors.
    void scale_columns(const DenseMatrix &re, const DenseMatrix &im,
                       const std::vector<std::complex<double>> &factors, DenseMatrix &to_re,
                       DenseMatrix &to_im)
    {
      to_re = to_im = DenseMatrix(re.n_rows, re.n_columns);
      for (unsigned int j = 0; j < re.n_columns; ++j)
        for (unsigned int i = 0; i < re.n_rows; ++i)
        {
          const std::complex<double> x = factors[j] * std::complex<double>(re(i, j), im(i, j));
          to_re(i, j)                  = x.real();
          to_im(i, j)                  = x.imag();
        }
    }
  } // namespace

  /// The interface rows of Q(l) x without the contact's pressures: Re and Im, a row a solution.
  std::array<DenseMatrix, 2>
  ReducedProjection::forces_at_interface(const std::vector<Complex> &lambda,
                                         const DenseMatrix &x_re, const DenseMatrix &x_im) const
  {
    std::array<DenseMatrix, 2> result;
    result.fill(DenseMatrix(lambda.size(), interface.n_rows()));
    for (unsigned int order = 0; order < 3; ++order)
    {
      const DenseMatrix &of_basis = images_at_rows[order];
      if (of_basis.values.empty())
        continue;
      std::vector<Complex> powers;
      for (const Complex l : lambda)
        powers.push_back(std::pow(l, int(order)));
      DenseMatrix re, im;
      scale_columns(x_re, x_im, powers, re, im);
      gemm(true, 1, re, of_basis, 1, result[0]);
      gemm(true, 1, im, of_basis, 1, result[1]);
    }
    return result;
  }

  /// The interface rows of Q(l) x with the pressures that make them smallest: Re and Im, a row a
  /// solution.
  std::array<DenseMatrix, 2>
  ReducedProjection::residuals_at_interface(const ReducedPairs &solutions) const
  {
    std::array<DenseMatrix, 2> result =
        forces_at_interface(solutions.lambda, solutions.re, solutions.im);
    if (interface.is_constrained())
      for (DenseMatrix &part : result)
        add(1, interface.left_constraints().shortest_change(part), part);
    return result;
  }

  MultiVector ReducedProjection::residuals(const ReducedPairs &solutions) const
  {
    const unsigned int n  = solutions.lambda.size();
    std::vector<double> c = solutions.re.values;
    c.insert(c.end(), solutions.im.values.begin(), solutions.im.values.end());
    const std::vector<MultiVector> images = terms.images(combine(basis.right(), c, 2 * n));
    MultiVector result(basis.rows, 2 * n);
    for (unsigned int i = 0; i < terms.size(); ++i)
      for (unsigned int j = 0; j < n; ++j)
      {
        const Complex factor   = terms.factor(i, solutions.lambda[j]);
        const double *const re = images[i].column(j), *const im = images[i].column(j + n);
        for (unsigned int row = 0; row < basis.rows.n_local(); ++row)
        {
          const Complex x = factor * Complex(re[row], im[row]);
          result.column(j)[row] += x.real();
          result.column(j + n)[row] += x.imag();
        }
      }
    const auto inside = residuals_at_interface(solutions);
    for (unsigned int k = 0; k < 2 * n; ++k)
      for (unsigned int r = 0; r < interface.n_rows(); ++r)
        if (basis.rows.contains(interface.rows()[r]))
          result.column(k)[interface.rows()[r] - basis.rows.begin] = inside[k / n](k % n, r);
    return result;
  }

  std::vector<std::complex<double>>
  ReducedProjection::factors_of(const unsigned int i, const std::vector<Complex> &lambda) const
  {
    std::vector<Complex> factors;
    for (const Complex l : lambda)
      factors.push_back(terms.factor(i, l));
    return factors;
  }

  namespace
  {
    /// += the squared lengths of the columns or, for a block of a row each, of the rows.
    void add_squares(const DenseMatrix &block, const bool by_row, std::vector<double> &squares)
    {
      for (unsigned int j = 0; j < block.n_columns; ++j)
        for (unsigned int i = 0; i < block.n_rows; ++i)
          squares[by_row ? i : j] += block(i, j) * block(i, j);
    }
  } // namespace

  /// |Q(l) x| <= longest |S^T Q(l) x| beside the interface, and what x must be moved by there.
  void ReducedProjection::certify(ReducedPairs &solutions) const
  {
    const unsigned int n = solutions.lambda.size();
    std::array<DenseMatrix, 2> sketched;
    sketched.fill(DenseMatrix(ResidualSketch::n_directions, n));
    for (unsigned int i = 0; i < terms.size(); ++i)
    {
      DenseMatrix re, im;
      scale_columns(solutions.re, solutions.im, factors_of(i, solutions.lambda), re, im);
      gemm(false, 1, sketches[i], re, 1, sketched[0]);
      gemm(false, 1, sketches[i], im, 1, sketched[1]);
    }
    std::vector<double> of_residuals(n), at_interface(n), of_violations(n), of_vectors(n);
    const std::array<DenseMatrix, 2> inside = residuals_at_interface(solutions);
    for (unsigned int part = 0; part < 2; ++part)
    {
      const DenseMatrix &x = part == 0 ? solutions.re : solutions.im;
      DenseMatrix violations(n, interface.n_rows());
      gemm(true, 1, x, right_change, 0, violations);
      add_squares(sketched[part], false, of_residuals);
      add_squares(inside[part], true, at_interface);
      add_squares(violations, true, of_violations);
      add_squares(x, false, of_vectors);
    }
    const std::array<double, 3> norms = terms.norms();
    solutions.errors.clear();
    for (unsigned int j = 0; j < n; ++j)
    {
      const double l        = std::abs(solutions.lambda[j]),
                   residual = std::hypot(ResidualSketch::longest * std::sqrt(of_residuals[j]),
                                         std::sqrt(at_interface[j])),
                   error    = (residual / (l * l * norms[2] + l * norms[1] + norms[0]) +
                            std::sqrt(of_violations[j])) /
                           std::sqrt(of_vectors[j]);
      solutions.errors.push_back(std::isfinite(error) ? error : HUGE_VAL);
    }
  }
} // namespace squeal
