#include <squeal/reduced_model.h>
#include <squeal/reduced_tools.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace squeal
{
  using namespace reduced;

  // Projection.

  void ReducedModel::add_images()
  {
    const unsigned int n_all = dimension(), n_new = n_all - n_imaged, n_fixed = fixed.size();
    const Block added = right.vectors.columns(n_imaged, n_new);
    for (unsigned int i = 0; i < n_fixed; ++i)
    {
      Block image              = multiply(*fixed[i], added);
      const DenseMatrix of_new = gather_rows(image, interface_rows);
      DenseMatrix all(n_all, interface_rows.size());
      for (unsigned int r = 0; r < interface_rows.size(); ++r)
        for (unsigned int j = 0; j < n_all; ++j)
          all(j, r) = j < n_imaged ? at_rows[i](j, r) : of_new(j - n_imaged, r);
      at_rows[i] = std::move(all);
      clear_rows(image, interface_rows);
      images[i].append(image);
    }
    right.at_rows = gather_rows(right.vectors, interface_rows);
    left.at_rows  = gather_rows(left.vectors, interface_rows);
    peaks         = gather_rows(right.vectors, peak_rows);
    for (unsigned int i = 0; i < n_fixed; ++i)
    {
      for (unsigned int k = i; k < n_fixed; ++k)
      {
        DenseMatrix &g = gram[i + k * n_fixed];
        g              = grow_products(g, images[i], images[k]);
      }
      for (const unsigned int form : {petrov, of_right})
      {
        const Basis &test  = form == petrov ? left : right;
        outside[i][form]   = grow_products(outside[i][form], test.vectors, images[i]);
        inside[i][form]    = grow_outer_products(inside[i][form], test.at_rows, at_rows[i]);
        projected[form][i] = outside[i][form];
        add(1, inside[i][form], projected[form][i]);
      }
      // The left vectors' norms; M is symmetric.
      if (coefficients[2][i] != 0)
      {
        const Block image = multiply(*fixed[i], left.vectors.columns(n_imaged, n_new));
        const DenseMatrix columns(n_all, n_new, inner_products(left.vectors, image));
        DenseMatrix known = std::move(projected[of_left][i]), whole(n_all, n_all);
        for (unsigned int c = 0; c < n_all; ++c)
          for (unsigned int r = 0; r < n_all; ++r)
            whole(r, c) = c >= n_imaged   ? columns(r, c - n_imaged)
                          : r >= n_imaged ? columns(c, r - n_imaged)
                                          : known(r, c);
        projected[of_left][i] = std::move(whole);
      }
    }
    n_imaged = n_all;
  }

  ReducedModel::Constraints ReducedModel::constraints(const bool of_left) const
  {
    Constraints result;
    result.by_row.resize(interface_rows.size());
    std::vector<int> number(interface_rows.size(), -1);
    const Entries &entries = changing[0];
    for (std::size_t k = 0; k < entries.values.size(); ++k)
    {
      const int constraint = of_left ? entries.columns[k] : entries.rows[k],
                row        = of_left ? entries.rows[k] : entries.columns[k];
      if (!is_constraint[constraint] || is_constraint[row] || entries.values[k] == 0)
        continue;
      if (number[constraint] < 0)
      {
        number[constraint] = result.rows.size();
        result.rows.push_back(constraint);
      }
      result.by_row[row].emplace_back(number[constraint], entries.values[k]);
    }
    return result;
  }

  DenseMatrix ReducedModel::balancing_pressures(const Constraints &c,
                                                const DenseMatrix &at_rows) const
  {
    const unsigned int m = at_rows.n_rows, n = c.rows.size();
    DenseMatrix result(m, interface_rows.size());
    if (n == 0)
      return result;
    DenseMatrix violation(n, m), squares(n, n);
    for (unsigned int r = 0; r < interface_rows.size(); ++r)
      for (const auto &[k, value] : c.by_row[r])
      {
        for (unsigned int j = 0; j < m; ++j)
          violation(k, j) -= value * at_rows(j, r);
        for (const auto &[i, other] : c.by_row[r])
          squares(i, k) += value * other;
      }
    const DenseMatrix pressures = squeal::solve(std::move(squares), std::move(violation));
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int j = 0; j < m; ++j)
        result(j, c.rows[k]) = pressures(k, j);
    return result;
  }

  DenseMatrix ReducedModel::shortest_change(const Constraints &c, const DenseMatrix &at_rows) const
  {
    const DenseMatrix pressures = balancing_pressures(c, at_rows);
    DenseMatrix result(at_rows.n_rows, interface_rows.size());
    for (unsigned int r = 0; r < interface_rows.size(); ++r)
      for (const auto &[k, value] : c.by_row[r])
        for (unsigned int j = 0; j < at_rows.n_rows; ++j)
          result(j, r) += value * pressures(j, c.rows[k]);
    return result;
  }

  /// False if contacts have closed, which the right vectors know nothing of.
  bool ReducedModel::satisfy_constraints()
  {
    left.change = DenseMatrix(dimension(), interface_rows.size());
    if (has_constraints && !compliant)
    {
      left_constraints         = constraints(true);
      left.change              = shortest_change(left_constraints, left.at_rows);
      const DenseMatrix needed = shortest_change(constraints(false), right.at_rows);
      double largest = 0, size = 0;
      for (const double value : needed.values)
        largest = std::max(largest, std::abs(value));
      for (const double value : right.at_rows.values)
        size = std::max(size, std::abs(value));
      if (largest > 1e-5 * size)
        return false;
    }
    left.moved = left.at_rows;
    add(1, left.change, left.moved);
    return true;
  }

  /// The pressures C^{-1} N^T u of a compliant contact in the constraints' rows; with the
  /// transposed matrices for the left vectors.
  DenseMatrix ReducedModel::compliant_pressures(const DenseMatrix &basis, const bool of_left) const
  {
    DenseMatrix result(basis.n_rows, interface_rows.size());
    std::vector<int> number(interface_rows.size(), -1);
    std::vector<unsigned int> constrained;
    for (unsigned int r = 0; r < interface_rows.size(); ++r)
      if (is_constraint[r])
      {
        number[r] = constrained.size();
        constrained.push_back(r);
      }
    const unsigned int n = constrained.size(), m = basis.n_rows;
    DenseMatrix compliance(n, n), gaps(n, m);
    const Entries &entries = changing[0];
    for (std::size_t k = 0; k < entries.values.size(); ++k)
    {
      const int row    = of_left ? entries.columns[k] : entries.rows[k],
                column = of_left ? entries.rows[k] : entries.columns[k];
      if (!is_constraint[row])
        continue;
      if (is_constraint[column])
        compliance(number[row], number[column]) -= entries.values[k];
      else
        for (unsigned int j = 0; j < m; ++j)
          gaps(number[row], j) += entries.values[k] * basis(j, column);
    }
    const DenseMatrix pressures = squeal::solve(std::move(compliance), std::move(gaps));
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int j = 0; j < m; ++j)
        result(j, constrained[k]) = pressures(k, j);
    return result;
  }

  /// Entries applied to a basis' interface rows.
  DenseMatrix ReducedModel::apply(const Entries &entries, const DenseMatrix &basis) const
  {
    if (entries.values.empty())
      return {};
    const unsigned int m = basis.n_rows;
    DenseMatrix result(m, interface_rows.size());
    for (std::size_t k = 0; k < entries.values.size(); ++k)
    {
      const double a  = entries.values[k];
      const double *x = &basis.values[std::size_t(entries.columns[k]) * m];
      double *y       = &result.values[std::size_t(entries.rows[k]) * m];
      for (unsigned int j = 0; j < m; ++j)
        y[j] += a * x[j];
    }
    return result;
  }

  void ReducedModel::clear_constraints(DenseMatrix &at_rows) const
  {
    for (unsigned int r = 0; r < interface_rows.size() && !at_rows.values.empty(); ++r)
      if (is_constraint[r])
        std::fill_n(&at_rows.values[std::size_t(r) * at_rows.n_rows], at_rows.n_rows, 0.);
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
    right_pressures = {};
    if (compliant)
    {
      left_pressures     = compliant_pressures(left.at_rows, true);
      right_pressures[0] = compliant_pressures(right.at_rows, false);
    }
    for (unsigned int order = 0; order < 3; ++order)
    {
      DenseMatrix with_pressures = right.at_rows;
      if (order == 0)
        add(1, right_pressures[0], with_pressures);
      DenseMatrix &of_v = changing_images[order];
      of_v              = apply(changing[order], with_pressures);
      clear_constraints(of_v);
      images_at_rows[order] = sum_of_fixed(at_rows, order);
      DenseMatrix sum       = sum_of_fixed(projected[petrov], order);
      if (!of_v.values.empty())
        add(1, outer_product(left.moved, of_v), sum);
      if (!images_at_rows[order].values.empty())
        add(1, outer_product(left.change, images_at_rows[order]), sum);
      operators[petrov][order] = std::move(sum);
      add(1, of_v, images_at_rows[order]);
    }
  }

  /// What is to be known of a solution beyond its pairs.
  void ReducedModel::project_tests()
  {
    const bool holds_pressures = has_constraints && !compliant;
    DenseMatrix change(dimension(), interface_rows.size());
    if (holds_pressures)
      change = shortest_change(left_constraints, right.at_rows);
    for (unsigned int order = 0; order < 3; ++order)
    {
      DenseMatrix sum = sum_of_fixed(projected[of_right], order);
      if (!changing_images[order].values.empty())
        add(1, outer_product(right.at_rows, changing_images[order]), sum);
      operators[of_right][order] = sum;
      if (holds_pressures && !images_at_rows[order].values.empty())
        add(1, outer_product(change, images_at_rows[order]), sum);
      operators[tested_by_right][order] = std::move(sum);
      operators[of_left][order]         = sum_of_fixed(projected[of_left], order);
      pressure_forms[order]             = DenseMatrix();
      if (holds_pressures && !images_at_rows[order].values.empty())
      {
        // The pressures that balance l^order A_order V best: -(C C^T)^{-1} C (...), C^T = N + mu T
        right_pressures[order] = balancing_pressures(left_constraints, images_at_rows[order]);
        // x^H (N + mu T) Lambda
        DenseMatrix forces = apply(changing[0], right_pressures[order]);
        clear_constraints(forces);
        pressure_forms[order] = outer_product(right.at_rows, forces);
      }
    }
  }

  QuadraticEigenproblem ReducedModel::projected_problem(const unsigned int form) const
  {
    QuadraticEigenproblem problem;
    problem.rows = small_rows(dimension());
    problem.M    = sparse(operators[form][2]);
    if (has_velocity_terms)
      problem.P = sparse(operators[form][1]);
    problem.Q = sparse(operators[form][0]);
    return problem;
  }

  std::vector<Term> ReducedModel::project(const std::vector<Term> &terms) const
  {
    std::vector<Term> result;
    const auto add_term = [&](const Term &term, const unsigned int order, const DenseMatrix &small)
    {
      result.push_back(
          {term.origin, order, term.coefficient, std::make_shared<const Matrix>(sparse(small))});
    };
    DenseMatrix test_change = left.change;
    add(1, left_pressures, test_change);
    for (const Term &term : terms)
    {
      const auto at = std::find(fixed.begin(), fixed.end(), term.matrix);
      if (at != fixed.end())
      {
        DenseMatrix small = projected[petrov][at - fixed.begin()];
        add(1, outer_product(left.change, at_rows[at - fixed.begin()]), small);
        add_term(term, term.order, small);
        continue;
      }
      const Block image = multiply(*term.matrix, right.vectors);
      DenseMatrix small(dimension(), dimension(), inner_products(left.vectors, image));
      add(1, outer_product(test_change, gather_rows(image, interface_rows)), small);
      add_term(term, term.order, small);
      // On the pressures, which are those of Lambda_0 + l Lambda_1 + l^2 Lambda_2
      Entries entries;
      for_entries(*term.matrix,
                  [&](const PetscInt row, const PetscInt column, const double value)
                  {
                    const int r = interface_number[row], c = interface_number[column];
                    if (r < 0 || c < 0 || !is_constraint[c])
                      return;
                    entries.rows.push_back(r);
                    entries.columns.push_back(c);
                    entries.values.push_back(value);
                  });
      gather(entries.rows, MPI_INT, rows.comm);
      gather(entries.columns, MPI_INT, rows.comm);
      gather(entries.values, MPI_DOUBLE, rows.comm);
      DenseMatrix test = left.moved;
      add(1, left_pressures, test);
      for (unsigned int order = 0; order < 3 && !entries.values.empty(); ++order)
        if (!right_pressures[order].values.empty())
          add_term(term, term.order + order,
                   outer_product(test, apply(entries, right_pressures[order])));
    }
    return result;
  }

  ReducedModel::RayleighForms ReducedModel::rayleigh_forms(const Modes &modes) const
  {
    RayleighForms forms;
    for (unsigned int j = 0; j < modes.lambda.size(); ++j)
    {
      const auto form = [&](const DenseMatrix &a)
      {
        Complex sum = 0;
        for (unsigned int k = 0; k < a.n_columns; ++k)
        {
          Complex row = 0;
          for (unsigned int i = 0; i < a.n_rows; ++i)
            row += Complex(modes.re.column(j)[i], -modes.im.column(j)[i]) * a(i, k);
          sum += row * Complex(modes.re.column(j)[k], modes.im.column(j)[k]);
        }
        return sum;
      };
      forms.of_p.push_back(form(operators[of_right][1]));
      Complex of_q = form(operators[of_right][0]);
      for (unsigned int order = 0; order < 3; ++order)
        of_q += std::pow(modes.lambda[j], int(order)) * form(pressure_forms[order]);
      forms.of_q.push_back(of_q);
    }
    return forms;
  }
} // namespace squeal
