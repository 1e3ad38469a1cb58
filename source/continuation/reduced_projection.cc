#include <squeal/continuation/reduced_model.h>

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

    std::vector<double> top_corner(const DenseMatrix &a, const unsigned int n)
    {
      std::vector<double> result;
      for (unsigned int j = 0; j < n; ++j)
        for (unsigned int i = 0; i < n; ++i)
          result.push_back(a(i, j));
      return result;
    }
  } // namespace

  // Projection.

  /// Small vectors scaled to unit length have lost a little of the constraints to rounding.
  void ReducedModel::clean(MultiVector &added) const
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
        if (rows.contains(interface.rows()[r]))
          added.column(j)[interface.rows()[r] - rows.begin] += change(j, r);
    }
  }

  void ReducedModel::add_images()
  {
    const unsigned int n_all = dimension(), n_new = n_all - n_imaged, n_fixed = fixed.size();
    MultiVector added = basis.right().columns(n_imaged, n_new);
    clean(added);
    basis.space.replace(n_imaged, added);
    // Rows of a block as columns, with those of new ones below
    const auto with_rows_of = [&](const DenseMatrix &known, const MultiVector &block)
    {
      const DenseMatrix of_new = gather_rows(block, interface.rows());
      DenseMatrix all(n_all, interface.n_rows());
      for (unsigned int r = 0; r < interface.n_rows(); ++r)
      {
        if (n_imaged > 0)
          std::copy_n(&known.values[std::size_t(r) * n_imaged], n_imaged,
                      &all.values[std::size_t(r) * n_all]);
        std::copy_n(&of_new.values[std::size_t(r) * n_new], n_new,
                    &all.values[std::size_t(r) * n_all + n_imaged]);
      }
      return all;
    };
    for (unsigned int i = 0; i < n_fixed; ++i)
    {
      MultiVector image = multiply(*fixed[i].matrix, added);
      at_rows[i]        = with_rows_of(at_rows[i], image);
      clear_rows(image, interface.rows());
      images[i].append(image);
    }
    right_rows                = with_rows_of(right_rows, added);
    left_rows                 = with_top(right_rows, gather_rows(basis.left, interface.rows()));
    peaks                     = gather_rows(basis.right(), basis.peak_rows);
    const unsigned int n_left = basis.left.n_columns();
    for (unsigned int i = 0; i < n_fixed; ++i)
    {
      // Rows first ... first + n of V^T A V or W^T A V, in the columns from column on
      const auto products = [&](const MultiVector &test, const DenseMatrix &test_rows,
                                const unsigned int first, const unsigned int n,
                                const unsigned int column, const unsigned int n_columns)
      {
        DenseMatrix result(n, n_columns,
                           inner_products(test, first, n, images[i], column, n_columns));
        add(1,
            outer_product(some_rows(test_rows, first, n), some_rows(at_rows[i], column, n_columns)),
            result);
        return result;
      };
      projected[of_right][i] =
          grow(projected[of_right][i], n_all,
               [&](const unsigned int first, const unsigned int n, const unsigned int column,
                   const unsigned int n_columns)
               { return products(basis.right(), right_rows, first, n, column, n_columns); });
      DenseMatrix top(n_left, n_all);
      const DenseMatrix added_top = products(basis.left, left_rows, 0, n_left, n_imaged, n_new);
      for (unsigned int c = 0; c < n_all; ++c)
        for (unsigned int r = 0; r < n_left; ++r)
          top(r, c) = c < n_imaged ? projected[petrov][i](r, c) : added_top(r, c - n_imaged);
      projected[petrov][i] = with_top(projected[of_right][i], top);
      // The left vectors' norms; M is symmetric.
      if (coefficients[2][i] != 0)
      {
        const DenseMatrix of_left_alone(
            n_left, n_left,
            n_imaged == 0 ? inner_products(basis.left, multiply(*fixed[i].matrix, basis.left))
                          : top_corner(projected[of_left][i], n_left));
        DenseMatrix whole = projected[petrov][i];
        for (unsigned int c = 0; c < n_left; ++c)
          for (unsigned int r = 0; r < n_all; ++r)
            whole(r, c) = r < n_left ? of_left_alone(r, c) : projected[petrov][i](c, r);
        projected[of_left][i] = std::move(whole);
      }
    }
    n_imaged = n_all;
  }

  void ReducedModel::satisfy_constraints()
  {
    const bool holds_pressures = interface.is_constrained();
    left_balance = holds_pressures ? interface.left_constraints().balancing_pressures(left_rows)
                                   : DenseMatrix();
    left_change  = holds_pressures ? interface.left_constraints().forces_of(left_balance)
                                   : DenseMatrix(dimension(), interface.n_rows());
    if (right_change.n_rows != dimension() || right_change.values.empty())
    {
      right_change = holds_pressures ? interface.right_constraints().shortest_change(right_rows)
                                     : DenseMatrix(dimension(), interface.n_rows());
      small.set_violations(right_change);
    }
    left_moved = left_rows;
    add(1, left_change, left_moved);
  }

  DenseMatrix ReducedModel::sum_of_fixed(const std::vector<DenseMatrix> &by_matrix,
                                         const unsigned int order) const
  {
    DenseMatrix sum;
    for (unsigned int i = 0; i < fixed.size(); ++i)
      add(coefficients[order][i], by_matrix[i], sum);
    return sum;
  }

  /// What the search for pairs needs.
  void ReducedModel::project_terms()
  {
    left_pressures  = DenseMatrix();
    right_pressures = DenseMatrix();
    if (interface.is_compliant())
    {
      left_pressures  = interface.compliant_pressures(left_rows, true);
      right_pressures = interface.compliant_pressures(right_rows, false);
    }
    for (unsigned int order = 0; order < 3; ++order)
    {
      DenseMatrix with_pressures = right_rows;
      if (order == 0)
        add(1, right_pressures, with_pressures);
      DenseMatrix &of_v     = changing_images[order];
      of_v                  = interface.forces(order, with_pressures);
      images_at_rows[order] = sum_of_fixed(at_rows, order);
      DenseMatrix sum       = sum_of_fixed(projected[petrov], order);
      interface.add_products(left_moved, of_v, sum);
      // W - V = -C^T (C C^T)^{-1} C V: by way of C A V, which has few columns
      if (!images_at_rows[order].values.empty() && !left_balance.values.empty())
        add(1,
            outer_product(left_balance,
                          interface.left_constraints().violations(images_at_rows[order])),
            sum);
      small.set_terms(order, order == 1 && !has_velocity_terms ? DenseMatrix() : sum);
      operators[petrov][order] = std::move(sum);
      add(1, of_v, images_at_rows[order]);
    }
  }

  /// What is to be known of a solution beyond its pairs.
  void ReducedModel::project_tests()
  {
    for (unsigned int order = 0; order < 3; ++order)
    {
      DenseMatrix sum = sum_of_fixed(projected[of_right], order);
      interface.add_products(right_rows, changing_images[order], sum);
      operators[of_right][order] = std::move(sum);
      operators[of_left][order]  = sum_of_fixed(projected[of_left], order);
    }
  }

  QuadraticEigenproblem ReducedModel::projected_problem(const unsigned int form) const
  {
    QuadraticEigenproblem problem;
    problem.rows = small_rows(dimension());
    problem.M    = to_matrix(operators[form][2]);
    if (has_velocity_terms)
      problem.P = to_matrix(operators[form][1]);
    problem.Q = to_matrix(operators[form][0]);
    return problem;
  }

  std::vector<Term> ReducedModel::project(const std::vector<Term> &terms) const
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
    DenseMatrix test_change = left_change;
    add(1, left_pressures, test_change);
    for (const Term &term : terms)
    {
      const MultiVector image = multiply(*term.matrix, basis.right());
      DenseMatrix small       = with_top(
                DenseMatrix(dimension(), dimension(), inner_products(basis.right(), image)),
                DenseMatrix(basis.left.n_columns(), dimension(), inner_products(basis.left, image)));
      add(1, outer_product(test_change, gather_rows(image, interface.rows())), small);
      add_term(term, term.order, small);
      // On the pressures, which are those of Lambda_0 + l Lambda_1 + l^2 Lambda_2
      DenseMatrix test = left_moved;
      add(1, left_pressures, test);
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

  ReducedModel::RayleighForms ReducedModel::rayleigh_forms(const EigenPairs &modes) const
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
} // namespace squeal
