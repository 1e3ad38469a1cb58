#include <squeal/reduction/interface_terms.h>

#include <algorithm>
#include <numeric>

// First the entries of the changing matrices are gathered on all ranks, numbered within the
// interface and sorted by what they couple (set_rows(), sort(), set_terms()); a matrix that stays
// keeps them. Then the constraints are found, with the factors of C C^T. What follows are products
// with both: gaps, forces, and the pressures that satisfy the constraints by the shortest way, or
// of a compliant contact.

namespace squeal
{
  namespace
  {
    /// Entries that come in any order, of this rank at first.
    struct CoupledEntries
    {
      struct Entry
      {
        int row, column;
        double value;
      };
      std::vector<Entry> entries;

      void add(const int row, const int column, const double value)
      {
        entries.push_back({row, column, value});
      }

      /// Gathers the entries of all ranks by rows. Collective.
      CompressedRows gathered(const unsigned int n_rows, const MPI_Comm comm)
      {
        MPI_Datatype type = MPI_DATATYPE_NULL;
        MPI_Type_contiguous(sizeof(Entry), MPI_BYTE, &type);
        MPI_Type_commit(&type);
        gather(entries, type, comm);
        MPI_Type_free(&type);
        CompressedRows result;
        result.begins.assign(n_rows + 1, 0);
        for (const Entry &entry : entries)
          ++result.begins[entry.row + 1];
        std::partial_sum(result.begins.begin(), result.begins.end(), result.begins.begin());
        result.resize(entries.size());
        std::vector<PetscInt> next = result.begins;
        for (const Entry &entry : entries)
        {
          const PetscInt place  = next[entry.row]++;
          result.columns[place] = entry.column;
          result.values[place]  = entry.value;
        }
        return result;
      }
    };

    /// Calls visit(row, column, value).
    template <typename Visit>
    void for_entries(const CompressedRows &rows, const Visit &visit)
    {
      for (unsigned int row = 0; row + 1 < rows.begins.size(); ++row)
        for (PetscInt k = rows.begins[row]; k < rows.begins[row + 1]; ++k)
          visit(row, rows.columns[k], rows.values[k]);
    }
  } // namespace

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
    terms  = {}; // they are numbered otherwise
    sorted = {};
    left = right = {};
  }

  std::vector<InterfaceTerms::Changing> InterfaceTerms::of_order(const unsigned int order) const
  {
    std::vector<Changing> result;
    for (unsigned int k = 0; k < terms.n_matrices(); ++k)
      if (const double c = terms.coefficient(k, order); c != 0)
        result.push_back({c, sorted[k]});
    return result;
  }

  std::shared_ptr<const InterfaceTerms::Sorted> InterfaceTerms::sort(const Matrix &matrix,
                                                                     int &known) const
  {
    CoupledEntries of_displacements, of_pressures, of_constraints;
    squeal::for_entries(matrix,
                        [&](const PetscInt row, const PetscInt column, const double value)
                        {
                          const int r = number[row], c = number[column];
                          if (r < 0 || c < 0)
                            known = false;
                          else
                            (is_constraint[r]   ? of_constraints
                             : is_constraint[c] ? of_pressures
                                                : of_displacements)
                                .add(r, c, value);
                        });
    const auto gathered = [&](CoupledEntries &entries)
    { return entries.gathered(n_rows(), whole.comm); };
    return std::make_shared<Sorted>(
        Sorted{gathered(of_displacements), gathered(of_pressures), gathered(of_constraints)});
  }

  bool InterfaceTerms::set_terms(const TermList &given)
  {
    int known    = true;
    auto present = sorted; // a matrix that stays keeps its entries
    present.carry_over(given, [&](const unsigned int k) { return sort(*given.matrix(k), known); });
    MPI_Allreduce(MPI_IN_PLACE, &known, 1, MPI_INT, MPI_MIN, whole.comm);
    if (!known)
      return false;
    terms  = given;
    sorted = std::move(present);
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
    for (const Changing &term : of_order(0))
      for_entries(term.sorted->of_constraints,
                  [&](const unsigned int row, const unsigned int column, double)
                  {
                    if (!is_constraint[column])
                      couples[row] = 1;
                  });
    std::vector<unsigned int> open;
    for (unsigned int r = 0; r < n_rows(); ++r)
      if (is_constraint[r] && !couples[r])
        open.push_back(r);
    return open;
  }

  bool InterfaceTerms::find_constraints(const bool of_left, Constraints &constraints) const
  {
    Constraints result;
    const auto entries_of = [of_left](const Sorted &of_matrix) -> const CompressedRows &
    { return of_left ? of_matrix.of_pressures : of_matrix.of_constraints; };
    std::vector<Term> of_constraints;
    for (unsigned int k = 0; k < terms.n_matrices(); ++k)
      for (const Term &term : terms.terms_of(k))
        if (term.order == 0 && !entries_of(*sorted[k]).values.empty())
          of_constraints.push_back(term);
    if (constraints.terms.are(of_constraints) && !constraints.rows.empty())
      return false;
    result.terms = KnownTerms(of_constraints);
    std::vector<int> place(n_rows(), -1);
    CoupledEntries entries;
    for (const Changing &term : of_order(0))
      for_entries(entries_of(*term.sorted),
                  [&](const unsigned int row, const unsigned int column, const double value)
                  {
                    const unsigned int constraint   = of_left ? column : row,
                                       displacement = of_left ? row : column;
                    if (is_constraint[displacement] || term.coefficient * value == 0)
                      return;
                    if (place[constraint] < 0)
                    {
                      place[constraint] = result.rows.size();
                      result.rows.push_back(constraint);
                    }
                    entries.add(displacement, place[constraint], term.coefficient * value);
                  });
    result.transposed       = entries.gathered(n_rows(), MPI_COMM_SELF); // all ranks have all
    const CompressedRows &c = result.transposed;
    if (result.rows == constraints.rows && c.begins == constraints.transposed.begins &&
        c.columns == constraints.transposed.columns && c.values == constraints.transposed.values)
    {
      constraints.terms = std::move(result.terms);
      return false;
    }
    DenseMatrix squares(result.rows.size(), result.rows.size()); // the upper half
    for (unsigned int row = 0; row < n_rows(); ++row)
      for (PetscInt i = c.begins[row]; i < c.begins[row + 1]; ++i)
        for (PetscInt k = i; k < c.begins[row + 1]; ++k)
        {
          const auto [first, last] = std::minmax(c.columns[i], c.columns[k]);
          squares(first, last) += (first == last && i != k ? 2 : 1) * c.values[i] * c.values[k];
        }
    result.squares =
        PositiveFactors(std::move(squares), "the product of the contact's constraints");
    constraints = std::move(result);
    return true;
  }

  DenseMatrix InterfaceTerms::Constraints::violations(const DenseMatrix &at_rows) const
  {
    DenseMatrix result(at_rows.n_rows, rows.size());
    add_transposed_product(1, transposed, at_rows, result);
    return result;
  }

  DenseMatrix InterfaceTerms::Constraints::balancing_pressures(const DenseMatrix &at_rows) const
  {
    DenseMatrix violation = violations(at_rows);
    for (double &value : violation.values)
      value *= -1;
    return squares.solve(violation.transpose()).transpose();
  }

  DenseMatrix InterfaceTerms::Constraints::forces_of(const DenseMatrix &pressures) const
  {
    DenseMatrix result(pressures.n_rows, transposed.begins.size() - 1);
    add_product(1, transposed, pressures, result);
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
    for (const Changing &term : of_order(0))
      for (const CompressedRows *entries :
           {&term.sorted->of_constraints, &term.sorted->of_pressures})
        for_entries(*entries,
                    [&](const unsigned int i, const unsigned int k, const double of_matrix)
                    {
                      const unsigned int row = of_left ? k : i, column = of_left ? i : k;
                      const double value = term.coefficient * of_matrix;
                      if (!is_constraint[row])
                        return;
                      if (is_constraint[column])
                        compliance(place[row], place[column]) -= value;
                      else
                        for (unsigned int j = 0; j < m; ++j)
                          gaps(place[row], j) += value * at_rows(j, column);
                    });
    const DenseMatrix pressures = squeal::solve(std::move(compliance), std::move(gaps));
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int j = 0; j < m; ++j)
        result(j, constrained[k]) = pressures(k, j);
    return result;
  }

  void InterfaceTerms::apply(const double factor, const CompressedRows &entries,
                             const DenseMatrix &at_rows, DenseMatrix &result) const
  {
    if (result.values.empty())
      result = DenseMatrix(at_rows.n_rows, n_rows());
    add_product(factor, entries, at_rows, result);
  }

  DenseMatrix InterfaceTerms::forces(const unsigned int order, const DenseMatrix &at_rows) const
  {
    DenseMatrix result;
    for (const Changing &term : of_order(order))
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
    CoupledEntries entries;
    squeal::for_entries(matrix,
                        [&](const PetscInt row, const PetscInt column, const double value)
                        {
                          const int r = number[row], c = number[column];
                          if (r >= 0 && c >= 0 && is_constraint[c])
                            entries.add(r, c, value);
                        });
    const CompressedRows gathered = entries.gathered(n_rows(), whole.comm);
    DenseMatrix result;
    if (!gathered.values.empty())
      apply(1, gathered, pressures, result);
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
      sum += of_a * of_b.transpose();
  }
} // namespace squeal
