#include <squeal/left_vectors.h>
#include <squeal/reduced_model.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

// LAPACK in complex arithmetic, which PETSc's interface for real numbers does not have.
extern "C"
{
  void zgetrf_(const int *m, const int *n, std::complex<double> *a, const int *lda, int *pivots,
               int *info);
  void zgetrs_(const char *trans, const int *n, const int *n_rhs, const std::complex<double> *a,
               const int *lda, const int *pivots, std::complex<double> *b, const int *ldb,
               int *info);
}

namespace squeal
{
  namespace
  {
    /// Solves A x = b and A^T y = c in place; false if A is exactly singular.
    bool solve_both(std::vector<std::complex<double>> &a, std::vector<std::complex<double>> &b,
                    std::vector<std::complex<double>> &c, const int n)
    {
      std::vector<int> pivots(n);
      int info      = 0;
      const int one = 1;
      zgetrf_(&n, &n, a.data(), &n, pivots.data(), &info);
      if (info != 0)
        return false;
      zgetrs_("N", &n, &one, a.data(), &n, pivots.data(), b.data(), &n, &info);
      zgetrs_("T", &n, &one, a.data(), &n, pivots.data(), c.data(), &n, &info);
      return true;
    }

    constexpr double smallest = 1e-9; ///< parts of unit vectors below this are left out of the bases
    constexpr unsigned int most_corrections = 6;

    /// Rows of a block as columns of a small matrix on all ranks.
    DenseMatrix gather_rows(const Block &block, const std::vector<unsigned int> &wanted)
    {
      const RowRange &range = block.row_range();
      DenseMatrix result(block.n_columns(), wanted.size());
      for (unsigned int r = 0; r < wanted.size(); ++r)
        if (range.contains(wanted[r]))
          for (unsigned int j = 0; j < block.n_columns(); ++j)
            result(j, r) = block.column(j)[wanted[r] - range.begin];
      MPI_Allreduce(MPI_IN_PLACE, result.values.data(), result.values.size(), MPI_DOUBLE, MPI_SUM,
                    range.comm);
      return result;
    }

    void clear_rows(Block &block, const std::vector<unsigned int> &cleared)
    {
      const RowRange &range = block.row_range();
      for (const unsigned int row : cleared)
        if (range.contains(row))
          for (unsigned int j = 0; j < block.n_columns(); ++j)
            block.column(j)[row - range.begin] = 0;
    }

    /// A square matrix of which the first rows and columns are known; @p block gives rows and
    /// columns (first, number) of it.
    template <typename Function>
    DenseMatrix grow(const DenseMatrix &known, const unsigned int size, const Function &block)
    {
      const unsigned int old = known.n_rows;
      DenseMatrix result(size, size);
      const DenseMatrix right = block(0, size, old, size - old),
                        lower = block(old, size - old, 0, old);
      for (unsigned int j = 0; j < size; ++j)
        for (unsigned int i = 0; i < size; ++i)
          result(i, j) = j >= old ? right(i, j - old) : i >= old ? lower(i - old, j) : known(i, j);
      return result;
    }

    /// A^T B of blocks, the first part known.
    DenseMatrix grow_products(const DenseMatrix &known, const Block &a, const Block &b)
    {
      return grow(known, a.n_columns(),
                  [&](const unsigned int row, const unsigned int n_rows, const unsigned int column,
                      const unsigned int n_columns)
                  {
                    return DenseMatrix(n_rows, n_columns,
                                       inner_products(a, row, n_rows, b, column, n_columns));
                  });
    }

    DenseMatrix some_rows(const DenseMatrix &a, const unsigned int first, const unsigned int n)
    {
      DenseMatrix result(n, a.n_columns);
      for (unsigned int j = 0; j < a.n_columns; ++j)
        std::copy_n(&a.values[first + std::size_t(j) * a.n_rows], n,
                    result.values.data() + std::size_t(j) * n);
      return result;
    }

    /// A B^T, the first part known.
    DenseMatrix grow_outer_products(const DenseMatrix &known, const DenseMatrix &a,
                                    const DenseMatrix &b)
    {
      return grow(known, a.n_rows,
                  [&](const unsigned int row, const unsigned int n_rows, const unsigned int column,
                      const unsigned int n_columns) {
                    return outer_product(some_rows(a, row, n_rows),
                                         some_rows(b, column, n_columns));
                  });
    }

    void add(const double factor, const DenseMatrix &a, DenseMatrix &sum)
    {
      if (a.values.empty() || factor == 0)
        return;
      if (sum.values.empty())
        sum = DenseMatrix(a.n_rows, a.n_columns);
      for (std::size_t k = 0; k < a.values.size(); ++k)
        sum.values[k] += factor * a.values[k];
    }

    DenseMatrix transposed(const DenseMatrix &a)
    {
      DenseMatrix result(a.n_columns, a.n_rows);
      for (unsigned int j = 0; j < a.n_columns; ++j)
        for (unsigned int i = 0; i < a.n_rows; ++i)
          result(j, i) = a(i, j);
      return result;
    }

    RowRange small_rows(const unsigned int n)
    {
      return {MPI_COMM_SELF, 0, n, n};
    }

    Matrix sparse(const DenseMatrix &a)
    {
      if (a.values.empty())
        return {};
      EntryList entries;
      for (unsigned int j = 0; j < a.n_columns; ++j)
        for (unsigned int i = 0; i < a.n_rows; ++i)
          entries.add(i, j, a(i, j));
      return entries.make_matrix(small_rows(a.n_rows));
    }

    Block to_block(const DenseMatrix &a)
    {
      Block block(small_rows(a.n_rows), a.n_columns);
      std::copy(a.values.begin(), a.values.end(), block.data());
      return block;
    }

    void scale_columns(Block &block, const std::vector<double> &factors)
    {
      for (unsigned int j = 0; j < block.n_columns(); ++j)
        for (unsigned int i = 0; i < block.n_local(); ++i)
          block.column(j)[i] *= factors[j];
    }

    std::vector<std::shared_ptr<const Matrix>> matrices_of(const std::vector<Term> &terms)
    {
      std::vector<std::shared_ptr<const Matrix>> matrices;
      for (const Term &term : terms)
        if (term.matrix && *term.matrix)
          matrices.push_back(term.matrix);
      return matrices;
    }

    template <typename Function>
    void for_entries(const Matrix &matrix, const Function &function)
    {
      PetscInt begin = 0, end = 0;
      SQUEAL_PETSC(MatGetOwnershipRange(matrix, &begin, &end));
      for (PetscInt row = begin; row < end; ++row)
      {
        PetscInt n                = 0;
        const PetscInt *columns   = nullptr;
        const PetscScalar *values = nullptr;
        SQUEAL_PETSC(MatGetRow(matrix, row, &n, &columns, &values));
        for (PetscInt k = 0; k < n; ++k)
          function(row, columns[k], values[k]);
        SQUEAL_PETSC(MatRestoreRow(matrix, row, &n, &columns, &values));
      }
    }

    /// The same list on all ranks.
    template <typename Number>
    void gather(std::vector<Number> &list, const MPI_Datatype type, const MPI_Comm comm)
    {
      int n_ranks = 0, n = list.size();
      MPI_Comm_size(comm, &n_ranks);
      if (n_ranks == 1)
        return;
      std::vector<int> counts(n_ranks), offsets(n_ranks);
      MPI_Allgather(&n, 1, MPI_INT, counts.data(), 1, MPI_INT, comm);
      std::partial_sum(counts.begin(), counts.end() - 1, offsets.begin() + 1);
      std::vector<Number> all(offsets.back() + counts.back());
      MPI_Allgatherv(list.data(), n, type, all.data(), counts.data(), offsets.data(), type, comm);
      list = std::move(all);
    }

    /// The principal components of a block, heaviest first, by the inner product of a part of its
    /// rows.
    struct Components
    {
      std::vector<double> sizes;
      DenseMatrix vectors;
    };
    Components principal_components(const Block &part)
    {
      const unsigned int n = part.n_columns();
      DenseMatrix vectors(n, n, inner_products(part, part));
      const std::vector<double> eig = symmetric_eigen(vectors);
      Components result;
      result.vectors = DenseMatrix(n, n);
      for (unsigned int j = 0; j < n; ++j)
      {
        result.sizes.push_back(std::sqrt(std::max(0., eig[n - 1 - j])));
        std::copy_n(&vectors.values[std::size_t(n - 1 - j) * n], n,
                    &result.vectors.values[std::size_t(j) * n]);
      }
      return result;
    }
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
      const Block image = of_left ? multiply_transposed(*term.matrix, block)
                                  : multiply(*term.matrix, block);
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
      const unsigned int n        = of_right.n_columns();
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

  void ReducedModel::append_pairs(Block right_ones, const Block &left_ones,
                                  const double smallest)
  {
    Block of_left = moved_by_anchor(right_ones, true);
    of_left.append(left_ones);
    right_ones.append(moved_by_anchor(left_ones, false));
    append(std::move(right_ones), std::move(of_left), smallest);
  }

  void ReducedModel::anchor(const QuadraticEigenproblem &problem, const std::vector<Term> &terms,
                            const Modes &modes)
  {
    *this               = ReducedModel(options);
    if (!modes.factorization || modes.disc_right.n_columns() == 0)
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
        factors[j] =
            1 / std::sqrt(squares[re * (2 * n_disc + 1)] + squares[im * (2 * n_disc + 1)]);
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
    const auto present     = matrices_of(terms);
    const auto is_in       = [](const auto &list, const auto &matrix)
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

  // Projection.

  void ReducedModel::add_images()
  {
    const unsigned int n_all = dimension(), n_new = n_all - n_imaged, n_fixed = fixed.size();
    const Block added        = right.vectors.columns(n_imaged, n_new);
    for (unsigned int i = 0; i < n_fixed; ++i)
    {
      Block image               = multiply(*fixed[i], added);
      const DenseMatrix of_new  = gather_rows(image, interface_rows);
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
        const Basis &test = form == petrov ? left : right;
        outside[i][form]  = grow_products(outside[i][form], test.vectors, images[i]);
        inside[i][form]   = grow_outer_products(inside[i][form], test.at_rows, at_rows[i]);
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

  DenseMatrix ReducedModel::balancing_pressures(const Constraints &c, const DenseMatrix &at_rows) const
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
    problem.Q    = sparse(operators[form][0]);
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

  // Solutions.

  void ReducedModel::solve_densely(Solutions &x, Solutions &y) const
  {
    const auto pairs_of = [&](const bool of_left)
    {
      const auto operator_of = [&](const unsigned int order)
      {
        const DenseMatrix &a = operators[petrov][order];
        return of_left ? transposed(a) : a;
      };
      std::vector<DensePair> pairs = quadratic_eigenpairs(
          operator_of(2), has_velocity_terms ? operator_of(1) : DenseMatrix(), operator_of(0), 0,
          radius());
      pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                                 [&](const DensePair &pair)
                                 {
                                   const double size = std::abs(pair.lambda);
                                   return size > radius() ||
                                          size <= rigid_body_limit(options.max_imaginary);
                                 }),
                  pairs.end());
      return pairs;
    };
    const auto solutions_of =
        [&](const std::vector<DensePair> &pairs, const std::vector<unsigned int> &which)
    {
      Solutions result;
      result.re = result.im = DenseMatrix(dimension(), which.size());
      for (unsigned int k = 0; k < which.size(); ++k)
      {
        result.lambda.push_back(pairs[which[k]].lambda);
        set_column(result, k, pairs[which[k]].vector);
      }
      return result;
    };
    const std::vector<DensePair> right_pairs = pairs_of(false), left_pairs = pairs_of(true);
    std::vector<Complex> lambda, left_lambda;
    for (const DensePair &pair : right_pairs)
      lambda.push_back(pair.lambda);
    for (const DensePair &pair : left_pairs)
      left_lambda.push_back(pair.lambda);
    const std::vector<unsigned int> partners = nearest_partners(lambda, left_lambda);
    std::vector<unsigned int> all(partners.size());
    std::iota(all.begin(), all.end(), 0u);
    x = solutions_of(right_pairs, all);
    y = solutions_of(left_pairs, partners);
  }

  void ReducedModel::set_column(Solutions &solutions, const unsigned int k,
                                const std::vector<Complex> &vector)
  {
    double square = 0;
    for (const Complex c : vector)
      square += std::norm(c);
    for (unsigned int i = 0; i < vector.size(); ++i)
    {
      solutions.re(i, k) = vector[i].real() / std::sqrt(square);
      solutions.im(i, k) = vector[i].imag() / std::sqrt(square);
    }
  }

  bool ReducedModel::improve(Solutions &x, Solutions &y) const
  {
    const unsigned int m = dimension(), n = x.lambda.size();
    for (Solutions *solutions : {&x, &y})
      for (DenseMatrix *part : {&solutions->re, &solutions->im})
      {
        DenseMatrix padded(m, n);
        for (unsigned int k = 0; k < n; ++k)
          std::copy_n(&part->values[std::size_t(k) * part->n_rows], part->n_rows,
                      &padded.values[std::size_t(k) * m]);
        *part = std::move(padded);
      }
    const DenseMatrix &q = operators[petrov][0], &p = operators[petrov][1],
                      &mass = operators[petrov][2];
    std::vector<Complex> at(std::size_t(m) * m), slope(at.size());
    constexpr unsigned int max_iterations = 5;
    for (unsigned int k = 0; k < n; ++k)
    {
      std::vector<Complex> right_vector(m), left_vector(m);
      for (unsigned int i = 0; i < m; ++i)
      {
        right_vector[i] = {x.re(i, k), x.im(i, k)};
        left_vector[i]  = {y.re(i, k), y.im(i, k)};
      }
      Complex l      = x.lambda[k];
      bool converged = false;
      for (unsigned int iteration = 0; iteration < max_iterations && !converged; ++iteration)
      {
        const bool damped = has_velocity_terms && !p.values.empty();
        for (std::size_t e = 0; e < at.size(); ++e)
        {
          const double p_e = damped ? p.values[e] : 0.;
          at[e]            = q.values[e] + l * (p_e + l * mass.values[e]);
          slope[e]         = p_e + 2. * l * mass.values[e];
        }
        // x := Q(l)^{-1} Q'(l) x, y := Q(l)^{-T} Q'(l)^T y, dl = - y^T Q x / (y^T Q' x)
        std::vector<Complex> of_right(m), of_left(m);
        for (unsigned int j = 0; j < m; ++j)
          for (unsigned int i = 0; i < m; ++i)
          {
            of_right[i] += slope[i + std::size_t(j) * m] * right_vector[j];
            of_left[j] += slope[i + std::size_t(j) * m] * left_vector[i];
          }
        const std::vector<Complex> matrix = at;
        if (!solve_both(at, of_right, of_left, m))
          return false;
        right_vector = std::move(of_right);
        left_vector  = std::move(of_left);
        Complex residual = 0, denominator = 0;
        double size = 0, left_size = 0;
        for (unsigned int j = 0; j < m; ++j)
        {
          size += std::norm(right_vector[j]);
          left_size += std::norm(left_vector[j]);
          Complex y_q = 0, y_s = 0;
          for (unsigned int i = 0; i < m; ++i)
          {
            y_q += left_vector[i] * matrix[i + std::size_t(j) * m];
            y_s += left_vector[i] * slope[i + std::size_t(j) * m];
          }
          residual += y_q * right_vector[j];
          denominator += y_s * right_vector[j];
        }
        for (unsigned int j = 0; j < m; ++j)
        {
          right_vector[j] /= std::sqrt(size);
          left_vector[j] /= std::sqrt(left_size);
        }
        const Complex change = -residual / denominator;
        l += change;
        converged = std::abs(change) <= 1e-11 * std::abs(l); // the next is its cube
      }
      if (!converged || std::abs(l) > radius())
        return false;
      x.lambda[k] = y.lambda[k] = l;
      set_column(x, k, right_vector);
      set_column(y, k, left_vector);
    }
    // Two that have become one?
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int j = 0; j < k; ++j)
        if (std::abs(x.lambda[k] - x.lambda[j]) <= 1e-9 * std::abs(x.lambda[k]))
          return false;
    return true;
  }

  /// The fixed matrices' factors sum_order c l^order of each solution.
  std::vector<std::vector<ReducedModel::Complex>>
  ReducedModel::factors_of(const std::vector<Complex> &lambda) const
  {
    std::vector<std::vector<Complex>> result(fixed.size(), std::vector<Complex>(lambda.size()));
    for (unsigned int i = 0; i < fixed.size(); ++i)
      for (unsigned int j = 0; j < lambda.size(); ++j)
        for (unsigned int order = 0; order < 3; ++order)
          result[i][j] += coefficients[order][i] * std::pow(lambda[j], int(order));
    return result;
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

  /// The interface rows of Q(l) x with the pressures that make them smallest: Re and Im, a row a
  /// solution.
  std::array<DenseMatrix, 2>
  ReducedModel::residuals_at_interface(const Solutions &solutions) const
  {
    std::array<DenseMatrix, 2> result;
    result.fill(DenseMatrix(solutions.lambda.size(), interface_rows.size()));
    for (unsigned int order = 0; order < 3; ++order)
    {
      const DenseMatrix &of_basis = images_at_rows[order];
      if (of_basis.values.empty())
        continue;
      std::vector<Complex> powers;
      for (const Complex l : solutions.lambda)
        powers.push_back(std::pow(l, int(order)));
      DenseMatrix re, im;
      scale_columns(solutions.re, solutions.im, powers, re, im);
      gemm(true, 1, re, of_basis, 1, result[0]);
      gemm(true, 1, im, of_basis, 1, result[1]);
    }
    if (has_constraints && !compliant)
      for (DenseMatrix &part : result)
        add(1, shortest_change(left_constraints, part), part);
    return result;
  }

  /// |Q(l) x|^2 in all other rows.
  std::vector<double> ReducedModel::squares_outside(const Solutions &solutions) const
  {
    const unsigned int n                            = solutions.lambda.size();
    const std::vector<std::vector<Complex>> factors = factors_of(solutions.lambda);
    std::vector<DenseMatrix> re(fixed.size()), im(fixed.size());
    for (unsigned int i = 0; i < fixed.size(); ++i)
      scale_columns(solutions.re, solutions.im, factors[i], re[i], im[i]);
    std::vector<double> result(n);
    for (unsigned int i = 0; i < fixed.size(); ++i)
      for (unsigned int k = i; k < fixed.size(); ++k)
      {
        DenseMatrix of_re(dimension(), n), of_im = of_re;
        gemm(false, 1, gram[i + k * fixed.size()], re[k], 0, of_re);
        gemm(false, 1, gram[i + k * fixed.size()], im[k], 0, of_im);
        for (unsigned int j = 0; j < n; ++j)
          for (unsigned int r = 0; r < dimension(); ++r)
            result[j] +=
                (i == k ? 1 : 2) * (re[i](r, j) * of_re(r, j) + im[i](r, j) * of_im(r, j));
      }
    for (double &square : result)
      square = std::max(0., square);
    return result;
  }

  void ReducedModel::certify(Solutions &solutions) const
  {
    const unsigned int n = solutions.lambda.size();
    std::array<double, 3> norms{};
    for (unsigned int order = 0; order < 3; ++order)
      for (unsigned int i = 0; i < fixed.size(); ++i)
        norms[order] =
            std::max(norms[order], std::abs(coefficients[order][i]) * fixed_norms[i]);
    const auto residual                = residuals_at_interface(solutions);
    const std::vector<double> elsewhere = squares_outside(solutions);
    DenseMatrix re(n, peak_rows.size()), im = re;
    gemm(true, 1, solutions.re, peaks, 0, re);
    gemm(true, 1, solutions.im, peaks, 0, im);
    solutions.errors.assign(n, 0.);
    for (unsigned int j = 0; j < n; ++j)
    {
      // In the infinity norm: |r| is at most the 2-norm of the rows outside and the largest one
      // inside, |x| at least the largest of some.
      double largest = elsewhere[j], peak = 0;
      for (unsigned int r = 0; r < interface_rows.size(); ++r)
        largest = std::max(largest, std::norm(Complex(residual[0](j, r), residual[1](j, r))));
      for (unsigned int r = 0; r < peak_rows.size(); ++r)
        peak = std::max(peak, std::hypot(re(j, r), im(j, r)));
      const double l      = std::abs(solutions.lambda[j]);
      solutions.errors[j] = std::sqrt(largest) /
                            ((l * l * norms[2] + l * norms[1] + norms[0]) * peak);
    }
  }

  std::vector<double> ReducedModel::changes(const Solutions &solutions) const
  {
    // dl = - v^H Q(l) x / (v^H Q'(l) x), v = x moved to the left constraints
    const unsigned int n = solutions.lambda.size();
    std::vector<Complex> residual(n), slope(n);
    for (unsigned int order = 0; order < 3; ++order)
    {
      const DenseMatrix &a = operators[tested_by_right][order];
      if (a.values.empty())
        continue;
      DenseMatrix re(dimension(), n), im = re;
      gemm(false, 1, a, solutions.re, 0, re);
      gemm(false, 1, a, solutions.im, 0, im);
      for (unsigned int j = 0; j < n; ++j)
      {
        Complex form = 0;
        for (unsigned int i = 0; i < dimension(); ++i)
          form += Complex(solutions.re(i, j), -solutions.im(i, j)) * Complex(re(i, j), im(i, j));
        residual[j] += std::pow(solutions.lambda[j], int(order)) * form;
        if (order > 0)
          slope[j] += double(order) * std::pow(solutions.lambda[j], int(order) - 1) * form;
      }
    }
    std::vector<double> result(n);
    for (unsigned int j = 0; j < n; ++j)
      result[j] = std::abs(residual[j] / (slope[j] * solutions.lambda[j]));
    return result;
  }

  namespace
  {
    /// Re and Im columns of some solutions side by side.
    DenseMatrix chosen_columns(const DenseMatrix &re, const DenseMatrix &im,
                               const std::vector<unsigned int> &which)
    {
      DenseMatrix result(re.n_rows, 2 * which.size());
      for (unsigned int k = 0; k < which.size(); ++k)
        for (unsigned int i = 0; i < re.n_rows; ++i)
        {
          result(i, k)                = re(i, which[k]);
          result(i, which.size() + k) = im(i, which[k]);
        }
      return result;
    }
  } // namespace

  /// Q_0^{-1} Q(l) x, Re and Im.
  Block ReducedModel::right_corrections(const Solutions &solutions,
                                        const std::vector<unsigned int> &which) const
  {
    Block residuals(rows, 2 * which.size());
    const auto factors_by_matrix = factors_of(solutions.lambda);
    for (unsigned int i = 0; i < fixed.size(); ++i)
    {
      DenseMatrix re, im;
      scale_columns(solutions.re, solutions.im, factors_by_matrix[i], re, im);
      DenseMatrix c = chosen_columns(re, im, which);
      for (double &value : c.values)
        value *= -1; // it is subtracted
      subtract_combination(residuals, images[i], c.values);
    }
    const auto inside = residuals_at_interface(solutions);
    for (unsigned int r = 0; r < interface_rows.size(); ++r)
      if (rows.contains(interface_rows[r]))
        for (unsigned int k = 0; k < 2 * which.size(); ++k)
          residuals.column(k)[interface_rows[r] - rows.begin] =
              inside[k / which.size()](which[k % which.size()], r);
    return displacements(factors->solve(residuals));
  }

  Block ReducedModel::left_changes(const DenseMatrix &coordinates) const
  {
    DenseMatrix at_rows(coordinates.n_columns, interface_rows.size());
    gemm(true, 1, coordinates, left.change, 0, at_rows);
    return scattered(at_rows);
  }

  Block ReducedModel::scattered(const DenseMatrix &at_rows) const
  {
    Block result(rows, at_rows.n_rows);
    for (unsigned int r = 0; r < interface_rows.size(); ++r)
      if (rows.contains(interface_rows[r]))
        for (unsigned int k = 0; k < at_rows.n_rows; ++k)
          result.column(k)[interface_rows[r] - rows.begin] = at_rows(k, r);
    return result;
  }

  /// What takes W d to  y - Q_0^{-T} Q(l)^T y,  y = W d moved to the constraints: Re and Im.
  Block ReducedModel::left_corrections(const std::vector<Term> &terms, const Solutions &solutions,
                                       const std::vector<unsigned int> &which) const
  {
    const unsigned int n     = which.size();
    const DenseMatrix chosen = chosen_columns(solutions.re, solutions.im, which);
    const Block changes      = left_changes(chosen);
    Block y                  = combine(left.vectors, chosen.values, 2 * n);
    DenseMatrix pressures(2 * n, interface_rows.size());
    if (compliant)
      gemm(true, 1, chosen, left_pressures, 0, pressures);
    const Block of_pressures = scattered(pressures);
    for (std::size_t i = 0; i < std::size_t(rows.n_local()) * 2 * n; ++i)
      y.data()[i] += changes.data()[i] + of_pressures.data()[i];
    Block residuals(rows, 2 * n);
    for (const Term &term : terms)
    {
      if (!term.matrix || !*term.matrix)
        continue;
      const Block image = multiply_transposed(*term.matrix, y);
      for (unsigned int k = 0; k < n; ++k)
      {
        const Complex factor =
            term.coefficient * std::pow(solutions.lambda[which[k]], int(term.order));
        for (unsigned int i = 0; i < rows.n_local(); ++i)
        {
          const Complex value = factor * Complex(image.column(k)[i], image.column(n + k)[i]);
          residuals.column(k)[i] += value.real();
          residuals.column(n + k)[i] += value.imag();
        }
      }
    }
    residuals = displacements(std::move(residuals));
    if (has_constraints && !compliant)
    {
      const Block balance =
          scattered(shortest_change(constraints(false), gather_rows(residuals, interface_rows)));
      for (std::size_t i = 0; i < std::size_t(rows.n_local()) * 2 * n; ++i)
        residuals.data()[i] += balance.data()[i];
    }
    Block result = displacements(factors->solve_transposed(residuals));
    for (std::size_t i = 0; i < std::size_t(rows.n_local()) * 2 * n; ++i)
      result.data()[i] = changes.data()[i] - result.data()[i];
    return result;
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
    Block of_right = displacements(factors->solve(units)),
          of_left  = displacements(factors->solve_transposed(units));
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
      // Of the pairs in the disc those with the smallest residuals: others are no modes of the whole
      // problem.
      // Of the pairs in the disc those with the smallest residuals: others are no modes of the whole
      // problem.
      std::vector<unsigned int> best(x.lambda.size()), failing;
      std::iota(best.begin(), best.end(), 0u);
      std::stable_sort(best.begin(), best.end(), [&](const unsigned int a, const unsigned int b)
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
      if (n_corrections == most_corrections || failing.empty() ||
          dimension() > 100 + 16 * n_disc)
        return std::nullopt;
      const unsigned int before = dimension();
      const Block of_right = right_corrections(x, failing),
                  of_left  = left_corrections(terms, y, failing);
      double largest       = 0;
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
    modes.re     = to_block(re);
    modes.im     = to_block(im);
    of_left.re   = to_block(left_re);
    of_left.im   = to_block(left_im);
    modes.completeness = "followed by projection on " + std::to_string(m) + " vectors";
    attach_left_vectors(problem(), std::move(of_left), left_errors, modes);
    normalise(modes);
    return modes;
  }

  /// x^H V^T M V x = 1, z^H W^T Q'(l) V x = 2 l, and the condition numbers.
  void ReducedModel::normalise(Modes &modes) const
  {
    const unsigned int n  = modes.lambda.size();
    const Matrix m_right  = sparse(operators[of_right][2]), m_left = sparse(operators[of_left][2]);
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
        const Complex z =
            factor * Complex(modes.left_re.column(k)[i], modes.left_im.column(k)[i]);
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
