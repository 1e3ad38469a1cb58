#include <squeal/reduction/reduced_projection.h>

#include <algorithm>
#include <cmath>
#include <numeric>

// First the projections of constant matrices: images of new vectors are formed, multiplied with V
// and W, and dropped (add_images), or turned with the basis (turn). Then, for each set of terms,
// the interface: W is moved to its constraints, and the changing terms are added in its rows
// (project). Last what is asked of solutions: forms, residuals, and bounds of their errors by
// sketches.
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
    DenseMatrix with_rows_below(const DenseMatrix &known, const DenseView<double> &added)
    {
      DenseMatrix all(known.n_rows + added.n_rows(), added.n_columns());
      for (unsigned int j = 0; j < all.n_columns; ++j)
      {
        std::copy_n(known.column(j), known.n_rows, all.column(j));
        for (unsigned int i = 0; i < added.n_rows(); ++i)
          all(known.n_rows + i, j) = added(i, j);
      }
      return all;
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

  bool ReducedProjection::set_changing(const TermList &changing)
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
      const DenseMatrix of_right = inner_products(basis.right(), images),
                        of_left  = inner_products(basis.left, images);
      const DenseMatrix inside   = gather_rows(images, interface.rows());
      clear_rows(images, interface.rows());
      const DenseMatrix sketched = sketch->of(images);
      for (unsigned int i = 0; i < n_matrices; ++i)
      {
        by_right[i].append(of_right.columns(i * n, n));
        by_left[i].append(of_left.columns(i * n, n));
        sketches[i].append(sketched.columns(i * n, n));
        at_rows[i] = with_rows_below(at_rows[i], inside.rows(i * n, n));
        if (n_imaged > 0 && !terms.is_symmetric(i))
          by_old[i].append(
              inner_products(basis.right(), 0, n_imaged, terms.image(i, some, true), 0, n));
      }
    }

    for (unsigned int i = 0; i < n_matrices; ++i)
    {
      if (terms.is_symmetric(i))
        by_old[i] = by_right[i].rows(0, n_imaged);
      projected[of_right][i] = grow(
          projected[of_right][i], n_all,
          [&](const unsigned int first, unsigned int, unsigned int, const unsigned int n)
          { return first == 0 && n > 0 ? DenseView<double>(by_right[i]) : by_old[i].transpose(); });
      DenseMatrix top = projected[petrov][i].columns(0, n_imaged).rows(0, n_left);
      top.append(by_left[i]);
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
    const DenseMatrix of_left_alone =
        projected[of_left][i].empty()
            ? inner_products(basis.left, terms.image(i, basis.left))
            : DenseMatrix(projected[of_left][i].columns(0, n_left).rows(0, n_left));
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
    const DenseMatrix left_rows = gather_rows(basis.left, interface.rows());
    right_rows                  = c.transpose() * right_rows;
    tests.rows                  = with_top(right_rows, left_rows);
    right_change                = DenseMatrix();
    n_imaged                    = c.n_columns;
    for (unsigned int i = 0; i < terms.size(); ++i)
    {
      at_rows[i]             = c.transpose() * at_rows[i];
      sketches[i]            = sketches[i] * c;
      projected[of_right][i] = c.transpose() * (projected[of_right][i] * c);
      projected[of_left][i]  = DenseMatrix();
      set_tests(i, inner_products(terms.image(i, basis.left, true), basis.right()));
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
    tests.moved += tests.change;
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
        with_pressures += right_pressures;
      DenseMatrix &of_v     = changing_images[order];
      of_v                  = interface.forces(order, with_pressures);
      images_at_rows[order] = terms.sum(order, at_rows);
      DenseMatrix sum       = terms.sum(order, projected[petrov]);
      interface.add_products(tests.moved, of_v, sum);
      // W - V = -C^T (C C^T)^{-1} C V: by way of C A V, which has few columns
      if (!images_at_rows[order].values.empty() && !tests.balance.values.empty())
        sum += tests.balance *
               interface.left_constraints().violations(images_at_rows[order]).transpose();
      small.set_terms(order, order == 1 && !terms.has_velocity_terms() ? DenseMatrix() : sum);
      operators[petrov][order] = std::move(sum);
      images_at_rows[order] += of_v;
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
    test_change += tests.pressures;
    for (const Term &term : others)
    {
      const MultiVector image = multiply(*term.matrix, basis.right());
      DenseMatrix small =
          with_top(inner_products(basis.right(), image), inner_products(basis.left, image));
      small += test_change * gather_rows(image, interface.rows()).transpose();
      add_term(term, term.order, small);
      // On the pressures, which are those of Lambda_0 + l Lambda_1 + l^2 Lambda_2
      DenseMatrix test = tests.moved;
      test += tests.pressures;
      for (unsigned int order = 0; order < 3; ++order)
        if (!pressures[order].values.empty())
          if (const DenseMatrix forces =
                  interface.forces_of_pressures(*term.matrix, pressures[order]);
              !forces.values.empty())
            add_term(term, term.order + order, test * forces.transpose());
    }
    return result;
  }

  ReducedProjection::RayleighForms ReducedProjection::rayleigh_forms(const EigenPairs &modes) const
  {
    const unsigned int n           = modes.lambda.size();
    const MultiVector parts        = modes.right.real_span();
    const ComplexDenseMatrix x     = to_complex({parts.data(), dimension(), 2 * n});
    const ComplexDenseMatrix x_bar = ComplexDenseMatrix(x).conjugate();
    const auto forms_of            = [&](const DenseMatrix &a)
    { return a.empty() ? std::vector<Complex>(n) : column_products(x_bar, a * x); };
    RayleighForms forms{forms_of(operators[of_right][1]), forms_of(operators[of_right][0])};
    if (!interface.is_constrained())
      return forms;
    // (N + mu T) Lambda of the modes
    const DenseMatrix forces =
        interface.left_constraints().shortest_change(forces_at_interface(modes.lambda, x));
    const std::vector<Complex> work =
        column_products(right_rows.transpose() * x_bar, to_complex(forces.transpose()));
    for (unsigned int j = 0; j < n; ++j)
      forms.of_q[j] += work[j];
    return forms;
  }

  /// The interface rows of Q(l) x without the contact's pressures: a row a solution, first their
  /// real parts, then the imaginary ones.
  DenseMatrix ReducedProjection::forces_at_interface(const std::vector<Complex> &lambda,
                                                     const ComplexDenseMatrix &x) const
  {
    DenseMatrix result(2 * lambda.size(), interface.n_rows());
    for (unsigned int order = 0; order < 3; ++order)
    {
      const DenseMatrix &of_basis = images_at_rows[order];
      if (of_basis.empty())
        continue;
      std::vector<Complex> powers;
      for (const Complex l : lambda)
        powers.push_back(std::pow(l, int(order)));
      const DenseMatrix parts = real_and_imaginary(ComplexDenseMatrix(x).scale(powers));
      add_product(1, parts.transpose(), of_basis, result);
    }
    return result;
  }

  /// The interface rows of Q(l) x with the pressures that make them smallest, as above.
  DenseMatrix ReducedProjection::residuals_at_interface(const SmallPairs &solutions) const
  {
    DenseMatrix result = forces_at_interface(solutions.lambda, solutions.right);
    if (interface.is_constrained())
      result += interface.left_constraints().shortest_change(result);
    return result;
  }

  MultiVector ReducedProjection::residuals(const SmallPairs &solutions) const
  {
    const unsigned int n = solutions.size();
    const std::vector<MultiVector> images =
        terms.images(combine(basis.right(), real_and_imaginary(solutions.right)));
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
    const DenseMatrix inside = residuals_at_interface(solutions);
    for (unsigned int k = 0; k < 2 * n; ++k)
      for (unsigned int r = 0; r < interface.n_rows(); ++r)
        if (basis.rows.contains(interface.rows()[r]))
          result.column(k)[interface.rows()[r] - basis.rows.begin] = inside(k, r);
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

  /// |Q(l) x| <= longest |S^T Q(l) x| beside the interface, and what x must be moved by there.
  void ReducedProjection::certify(SmallPairs &solutions) const
  {
    const unsigned int n        = solutions.size();
    const ComplexDenseMatrix &x = solutions.right;
    ComplexDenseMatrix sketched(ResidualSketch::n_directions, n);
    for (unsigned int i = 0; i < terms.size(); ++i)
      sketched += sketches[i] * ComplexDenseMatrix(x).scale(factors_of(i, solutions.lambda));
    const std::vector<double> of_residuals = sketched.column_norms(),
                              at_interface =
                                  to_complex(residuals_at_interface(solutions).transpose())
                                      .column_norms(),
                              of_violations = (right_change.transpose() * x).column_norms(),
                              of_vectors    = x.column_norms();
    const std::array<double, 3> norms       = terms.norms();
    solutions.errors.clear();
    for (unsigned int j = 0; j < n; ++j)
    {
      const double l = std::abs(solutions.lambda[j]),
                   residual =
                       std::hypot(ResidualSketch::longest * of_residuals[j], at_interface[j]),
                   error = (residual / (l * l * norms[2] + l * norms[1] + norms[0]) +
                            of_violations[j]) /
                           of_vectors[j];
      solutions.errors.push_back(std::isfinite(error) ? error : HUGE_VAL);
    }
  }
} // namespace squeal
