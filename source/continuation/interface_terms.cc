#include <squeal/continuation/interface_terms.h>

#include <algorithm>
#include <numeric>

namespace squeal
{
  void InterfaceTerms::Entries::gather(const MPI_Comm comm)
  {
    squeal::gather(rows, MPI_INT, comm);
    squeal::gather(columns, MPI_INT, comm);
    squeal::gather(values, MPI_DOUBLE, comm);
  }

  void InterfaceTerms::set_rows(std::vector<char> touched)
  {
    MPI_Allreduce(MPI_IN_PLACE, touched.data(), touched.size(), MPI_CHAR, MPI_MAX, whole.comm);
    std::vector<char> constrained(whole.size);
    for (unsigned int row = whole.end - n_local_constraints; row < whole.end; ++row)
      constrained[row] = 1;
    MPI_Allreduce(MPI_IN_PLACE, constrained.data(), constrained.size(), MPI_CHAR, MPI_MAX,
                  whole.comm);
    number.assign(whole.size, -1);
    rows_.clear();
    is_constraint.clear();
    for (unsigned int row = 0; row < whole.size; ++row)
      if (touched[row])
      {
        number[row] = rows_.size();
        rows_.push_back(row);
        is_constraint.push_back(constrained[row]);
      }
    for (auto &of_order : changing) // they are numbered otherwise
      of_order.clear();
    left = right = {};
  }

  std::shared_ptr<const InterfaceTerms::Sorted>
  InterfaceTerms::sorted(const std::shared_ptr<const Matrix> &matrix, int &known) const
  {
    for (const auto &of_order : changing)
      for (const Changing &term : of_order)
        if (term.sorted->matrix == matrix)
          return term.sorted;
    const auto result = std::make_shared<Sorted>();
    result->matrix    = matrix;
    for_entries(*matrix,
                [&](const PetscInt row, const PetscInt column, const double value)
                {
                  const int r = number[row], c = number[column];
                  if (r < 0 || c < 0)
                    known = false;
                  else
                    (is_constraint[r]   ? result->of_constraints
                     : is_constraint[c] ? result->of_pressures
                                        : result->of_displacements)
                        .add(r, c, value);
                });
    for (Entries *entries :
         {&result->of_displacements, &result->of_pressures, &result->of_constraints})
      entries->gather(whole.comm);
    return result;
  }

  bool InterfaceTerms::set_terms(const std::array<std::vector<Summand>, 3> &summands)
  {
    int known = true;
    std::array<std::vector<Changing>, 3> present;
    for (unsigned int order = 0; order < 3; ++order)
      for (const auto &[coefficient, matrix] : summands[order])
        present[order].push_back({coefficient, sorted(matrix, known)});
    MPI_Allreduce(MPI_IN_PLACE, &known, 1, MPI_INT, MPI_MIN, whole.comm);
    if (!known)
      return false;
    changing = std::move(present);
    if (is_constrained())
    {
      find_constraints(true, left);
      n_changes_ += find_constraints(false, right);
    }
    return true;
  }

  std::vector<unsigned int> InterfaceTerms::open_contacts() const
  {
    std::vector<char> couples(n_rows());
    for (const Changing &term : changing[0])
      for (std::size_t k = 0; k < term.sorted->of_constraints.values.size(); ++k)
        if (!is_constraint[term.sorted->of_constraints.columns[k]])
          couples[term.sorted->of_constraints.rows[k]] = 1;
    std::vector<unsigned int> open;
    for (unsigned int r = 0; r < n_rows(); ++r)
      if (is_constraint[r] && !couples[r])
        open.push_back(r);
    return open;
  }

  bool InterfaceTerms::find_constraints(const bool of_left, Constraints &constraints) const
  {
    Constraints result;
    for (const Changing &term : changing[0])
      if (!(of_left ? term.sorted->of_pressures : term.sorted->of_constraints).values.empty())
        result.terms.emplace_back(term.coefficient, term.sorted->matrix);
    if (result.terms == constraints.terms && !constraints.begins.empty())
      return false;
    const unsigned int n_rows = rows_.size();
    std::vector<int> place(n_rows, -1);
    const auto for_all = [&](const auto &visit)
    {
      for (const Changing &term : changing[0])
      {
        const Entries &entries = of_left ? term.sorted->of_pressures : term.sorted->of_constraints;
        for (std::size_t k = 0; k < entries.values.size(); ++k)
        {
          const int constraint = of_left ? entries.columns[k] : entries.rows[k],
                    row        = of_left ? entries.rows[k] : entries.columns[k];
          if (const double value = term.coefficient * entries.values[k];
              !is_constraint[row] && value != 0)
            visit(constraint, row, value);
        }
      }
    };
    result.begins.assign(n_rows + 1, 0);
    for_all(
        [&](const int constraint, const int row, double)
        {
          ++result.begins[row + 1];
          if (place[constraint] < 0)
          {
            place[constraint] = result.rows.size();
            result.rows.push_back(constraint);
          }
        });
    std::partial_sum(result.begins.begin(), result.begins.end(), result.begins.begin());
    result.entries.resize(result.begins.back());
    std::vector<unsigned int> next = result.begins;
    for_all(
        [&](const int constraint, const int row, const double value) {
          result.entries[next[row]++] = {place[constraint], value};
        });
    if (result.rows == constraints.rows && result.begins == constraints.begins &&
        result.entries == constraints.entries)
    {
      constraints.terms = std::move(result.terms);
      return false;
    }
    DenseMatrix squares(result.rows.size(), result.rows.size());
    for (unsigned int row = 0; row < n_rows; ++row)
      result.for_entries(row,
                         [&](const unsigned int k, const double value)
                         {
                           result.for_entries(row, [&](const unsigned int i, const double other)
                                              { squares(i, k) += value * other; });
                         });
    result.squares =
        PositiveFactors(std::move(squares), "the product of the contact's constraints");
    constraints = std::move(result);
    return true;
  }

  DenseMatrix InterfaceTerms::Constraints::violations(const DenseMatrix &at_rows) const
  {
    const unsigned int m = at_rows.n_rows;
    DenseMatrix result(m, rows.size());
    for (unsigned int r = 0; r < begins.size() - 1; ++r)
      for_entries(r,
                  [&](const unsigned int k, const double value)
                  {
                    add_multiple(value, &at_rows.values[std::size_t(r) * m], m,
                                 &result.values[std::size_t(k) * m]);
                  });
    return result;
  }

  DenseMatrix InterfaceTerms::Constraints::balancing_pressures(const DenseMatrix &at_rows) const
  {
    DenseMatrix violation = violations(at_rows);
    for (double &value : violation.values)
      value *= -1;
    return transposed(squares.solve(transposed(violation)));
  }

  DenseMatrix InterfaceTerms::Constraints::forces_of(const DenseMatrix &pressures) const
  {
    const unsigned int m = pressures.n_rows;
    DenseMatrix result(m, begins.size() - 1);
    for (unsigned int r = 0; r < begins.size() - 1; ++r)
      for_entries(r,
                  [&](const unsigned int k, const double value)
                  {
                    add_multiple(value, &pressures.values[std::size_t(k) * m], m,
                                 &result.values[std::size_t(r) * m]);
                  });
    return result;
  }

  DenseMatrix InterfaceTerms::compliant_pressures(const DenseMatrix &at_rows,
                                                  const bool of_left) const
  {
    DenseMatrix result(at_rows.n_rows, n_rows());
    std::vector<int> place(n_rows(), -1);
    std::vector<unsigned int> constrained;
    for (unsigned int r = 0; r < n_rows(); ++r)
      if (is_constraint[r])
      {
        place[r] = constrained.size();
        constrained.push_back(r);
      }
    const unsigned int n = constrained.size(), m = at_rows.n_rows;
    DenseMatrix compliance(n, n), gaps(n, m);
    for (const Changing &term : changing[0])
      for (const Entries *entries : {&term.sorted->of_constraints, &term.sorted->of_pressures})
        for (std::size_t k = 0; k < entries->values.size(); ++k)
        {
          const int row      = of_left ? entries->columns[k] : entries->rows[k],
                    column   = of_left ? entries->rows[k] : entries->columns[k];
          const double value = term.coefficient * entries->values[k];
          if (!is_constraint[row])
            continue;
          if (is_constraint[column])
            compliance(place[row], place[column]) -= value;
          else
            for (unsigned int j = 0; j < m; ++j)
              gaps(place[row], j) += value * at_rows(j, column);
        }
    const DenseMatrix pressures = squeal::solve(std::move(compliance), std::move(gaps));
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int j = 0; j < m; ++j)
        result(j, constrained[k]) = pressures(k, j);
    return result;
  }

  void InterfaceTerms::apply(const double factor, const Entries &entries,
                             const DenseMatrix &at_rows, DenseMatrix &result)
  {
    const unsigned int m = at_rows.n_rows;
    if (result.values.empty())
      result = DenseMatrix(m, at_rows.n_columns);
    for (std::size_t k = 0; k < entries.values.size(); ++k)
      add_multiple(factor * entries.values[k], &at_rows.values[std::size_t(entries.columns[k]) * m],
                   m, &result.values[std::size_t(entries.rows[k]) * m]);
  }

  DenseMatrix InterfaceTerms::forces(const unsigned int order, const DenseMatrix &at_rows) const
  {
    DenseMatrix result;
    for (const Changing &term : changing[order])
    {
      if (!term.sorted->of_displacements.values.empty())
        apply(term.coefficient, term.sorted->of_displacements, at_rows, result);
      if (compliant && !term.sorted->of_pressures.values.empty())
        apply(term.coefficient, term.sorted->of_pressures, at_rows, result);
    }
    return result;
  }

  DenseMatrix InterfaceTerms::forces_of_pressures(const Matrix &matrix,
                                                  const DenseMatrix &pressures) const
  {
    Entries entries;
    for_entries(matrix,
                [&](const PetscInt row, const PetscInt column, const double value)
                {
                  const int r = number[row], c = number[column];
                  if (r >= 0 && c >= 0 && is_constraint[c])
                    entries.add(r, c, value);
                });
    entries.gather(whole.comm);
    DenseMatrix result;
    if (!entries.values.empty())
      apply(1, entries, pressures, result);
    return result;
  }

  /// Few forces are not zero.
  void InterfaceTerms::add_products(const DenseMatrix &a, const DenseMatrix &b,
                                    DenseMatrix &sum) const
  {
    DenseMatrix of_a(a.n_rows, 0), of_b(b.n_rows, 0);
    for (unsigned int r = 0; r < n_rows() && !b.values.empty(); ++r)
    {
      const auto at_row = [r](const DenseMatrix &matrix)
      { return matrix.values.begin() + std::size_t(r) * matrix.n_rows; };
      if (is_constraint[r] ||
          std::all_of(at_row(b), at_row(b) + b.n_rows, [](const double x) { return x == 0; }))
        continue;
      of_a.values.insert(of_a.values.end(), at_row(a), at_row(a) + a.n_rows);
      of_b.values.insert(of_b.values.end(), at_row(b), at_row(b) + b.n_rows);
      ++of_a.n_columns;
      ++of_b.n_columns;
    }
    if (of_a.n_columns > 0)
      add(1, outer_product(of_a, of_b), sum);
  }
} // namespace squeal
