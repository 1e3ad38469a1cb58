#include <squeal/linalg/compressed_rows.h>

#include <algorithm>
#include <stdexcept>

// PETSc's rows are lent and given back; blocks are added to entries whose places were looked up
// once; lists of entries are handed over to the ranks that own their rows and summed; matrices are
// added, in place where the pattern allows it. Last, entries that repeat: sorted the first time,
// afterwards summed without any search.
namespace squeal
{
  SequentialRows::SequentialRows(Mat matrix) : matrix(matrix)
  {
    PetscBool done = PETSC_FALSE;
    SQUEAL_PETSC(
        MatGetRowIJ(matrix, 0, PETSC_FALSE, PETSC_FALSE, &n_rows, &begins, &columns, &done));
    SQUEAL_PETSC(MatSeqAIJGetArrayRead(matrix, &values));
  }

  SequentialRows::~SequentialRows()
  {
    PetscBool done = PETSC_FALSE;
    MatSeqAIJRestoreArrayRead(matrix, &values);
    MatRestoreRowIJ(matrix, 0, PETSC_FALSE, PETSC_FALSE, &n_rows, &begins, &columns, &done);
  }

  namespace
  {
    /// What PETSc stores of this rank's rows: the columns of this rank and, if there are ranks,
    /// those of others, which have numbers of their own.
    struct Parts
    {
      Mat own = nullptr, coupled = nullptr;
      const PetscInt *coupled_columns = nullptr;
    };

    Parts parts_of(const Mat matrix)
    {
      PetscBool is_parallel = PETSC_FALSE;
      SQUEAL_PETSC(
          PetscObjectTypeCompare(reinterpret_cast<PetscObject>(matrix), MATMPIAIJ, &is_parallel));
      Parts parts{matrix};
      if (is_parallel)
        SQUEAL_PETSC(
            MatMPIAIJGetSeqAIJ(matrix, &parts.own, &parts.coupled, &parts.coupled_columns));
      return parts;
    }
  } // namespace

  LocalRows::LocalRows(Mat matrix, const RowRange &range) : begin(range.begin)
  {
    const Parts parts = parts_of(matrix);
    own               = std::make_unique<const SequentialRows>(parts.own);
    if (parts.coupled)
      coupled = std::make_unique<const SequentialRows>(parts.coupled);
    coupled_columns = parts.coupled_columns;
  }

  BlockAdder::BlockAdder(const Matrix &matrix, const RowRange &range)
      : matrix(matrix), begin(range.begin), end(range.end), own(parts_of(matrix).own), rows(own)
  {
    SQUEAL_PETSC(MatSeqAIJGetArray(own, &values));
  }

  BlockAdder::~BlockAdder()
  {
    MatSeqAIJRestoreArray(own, &values);
  }

  std::vector<PetscInt> BlockAdder::places(const std::vector<PetscInt> &unknowns) const
  {
    const unsigned int n = unknowns.size();
    std::vector<std::pair<PetscInt, unsigned int>> own_columns;
    for (unsigned int i = 0; i < n; ++i)
      if (begin <= unknowns[i] && unknowns[i] < end)
        own_columns.emplace_back(unknowns[i] - begin, i);
    std::sort(own_columns.begin(), own_columns.end());
    std::vector<PetscInt> result(std::size_t(n) * n, -1);
    for (const auto &[row, i] : own_columns)
    {
      // Both are ascending.
      PetscInt place        = rows.begins[row];
      const PetscInt beyond = rows.begins[row + 1];
      for (const auto &[column, j] : own_columns)
      {
        while (place < beyond && rows.columns[place] < column)
          ++place;
        if (place == beyond || rows.columns[place] != column)
          throw std::logic_error("A block is added where the matrix has no place.");
        result[std::size_t(i) * n + j] = place;
      }
    }
    return result;
  }

  void BlockAdder::add(const std::vector<PetscInt> &unknowns, const std::vector<PetscInt> &places,
                       const unsigned int first_row, const unsigned int first_column,
                       const unsigned int n, const PetscScalar *const block)
  {
    std::vector<PetscInt> elsewhere;
    std::vector<PetscScalar> of_others;
    for (unsigned int i = 0; i < n; ++i)
    {
      if (unknowns[first_row + i] < 0)
        continue;
      const PetscInt *const place =
          &places[(first_row + i) * std::size_t(unknowns.size()) + first_column];
      const PetscScalar *const row = block + std::size_t(i) * n;
      elsewhere.clear();
      of_others.clear();
      for (unsigned int j = 0; j < n; ++j)
        if (place[j] >= 0)
          values[place[j]] += row[j];
        else if (unknowns[first_column + j] >= 0)
        {
          elsewhere.push_back(unknowns[first_column + j]);
          of_others.push_back(row[j]);
        }
      if (!elsewhere.empty())
        SQUEAL_PETSC(MatSetValues(matrix, 1, &unknowns[first_row + i], elsewhere.size(),
                                  elsewhere.data(), of_others.data(), ADD_VALUES));
    }
  }

  Matrix make_matrix(const RowRange &range, CompressedRows rows)
  {
    const PetscInt n = range.n_local(), n_global = range.size;
    int n_ranks = 0;
    MPI_Comm_size(range.comm, &n_ranks);
    Mat mat = nullptr;
    if (n_ranks > 1)
    {
      SQUEAL_PETSC(MatCreate(range.comm, &mat));
      Matrix result(mat);
      SQUEAL_PETSC(MatSetSizes(mat, n, n, n_global, n_global));
      SQUEAL_PETSC(MatSetType(mat, MATAIJ));
      SQUEAL_PETSC(MatMPIAIJSetPreallocationCSR(mat, rows.begins.data(), rows.columns.data(),
                                                rows.values.data()));
      return result;
    }
    // The arrays live as long as the matrix.
    auto kept = std::make_unique<CompressedRows>(std::move(rows));
    SQUEAL_PETSC(MatCreateSeqAIJWithArrays(range.comm, n, n, kept->begins.data(),
                                           kept->columns.data(), kept->values.data(), &mat));
    Matrix result(mat);
    PetscContainer container = nullptr;
    SQUEAL_PETSC(PetscContainerCreate(range.comm, &container));
    SQUEAL_PETSC(PetscContainerSetUserDestroy(container,
                                              [](void *pointer) -> PetscErrorCode
                                              {
                                                delete static_cast<CompressedRows *>(pointer);
                                                return 0;
                                              }));
    SQUEAL_PETSC(PetscContainerSetPointer(container, kept.release()));
    SQUEAL_PETSC(PetscObjectCompose(reinterpret_cast<PetscObject>(mat), "arrays",
                                    reinterpret_cast<PetscObject>(container)));
    SQUEAL_PETSC(PetscContainerDestroy(&container));
    return result;
  }

  std::vector<EntryList::Entry> EntryList::summed(const RowRange &range) const
  {
    std::vector<std::size_t> next(range.size + 1);
    for (const Entry &entry : entries)
      ++next[entry.row + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    const std::vector<std::size_t> begins = next;
    std::vector<std::pair<PetscInt, PetscScalar>> by_row(entries.size());
    for (const Entry &entry : entries)
      by_row[next[entry.row]++] = {entry.column, entry.value};
    std::vector<Entry> result;
    RowSums sums(range.size, 1);
    for (unsigned int row = 0; row < range.size; ++row)
    {
      {
        RowSums::Adder adder(sums);
        for (std::size_t k = begins[row]; k < begins[row + 1]; ++k)
          *adder.at(by_row[k].first) += by_row[k].second;
      }
      sums.take(
          [&](const unsigned int column, const double *value) {
            result.push_back({PetscInt(row), PetscInt(column), *value});
          });
    }
    return result;
  }

  std::vector<int> EntryList::hand_over(const RowRange &range, std::vector<Entry> &sorted)
  {
    int n_ranks = 0;
    MPI_Comm_size(range.comm, &n_ranks);
    if (n_ranks == 1)
      return {0, int(sorted.size())};
    std::vector<unsigned int> ends(n_ranks);
    MPI_Allgather(&range.end, 1, MPI_UNSIGNED, ends.data(), 1, MPI_UNSIGNED, range.comm);
    std::vector<int> n_sent, n_received, begins(n_ranks + 1);
    auto from = sorted.begin();
    for (const unsigned int end : ends)
    {
      const auto next = std::partition_point(
          from, sorted.end(), [&](const Entry &entry) { return unsigned(entry.row) < end; });
      n_sent.push_back(next - from);
      from = next;
    }
    sorted = exchange(sorted, n_sent, n_received, range.comm);
    std::partial_sum(n_received.begin(), n_received.end(), begins.begin() + 1);
    return begins;
  }

  Matrix EntryList::make_matrix(const RowRange &range) const
  {
    // Each rank sums its own before they are sent: surfaces are often one rank's.
    std::vector<Entry> sorted = summed(range);
    std::vector<int> next     = hand_over(range, sorted);
    const std::vector<int> begins(next);
    CompressedRows result;
    result.reserve(sorted.size());
    RowSums sums(range.size, 1);
    for (PetscInt row = range.begin; row < PetscInt(range.end); ++row)
    {
      for (unsigned int rank = 0; rank + 1 < begins.size(); ++rank)
      {
        RowSums::Adder adder(sums);
        for (int &k = next[rank]; k < begins[rank + 1] && sorted[k].row == row; ++k)
          *adder.at(sorted[k].column) += sorted[k].value;
      }
      sums.take([&](const unsigned int column, const double *value)
                { result.add(column, *value); });
      result.end_row();
    }
    return squeal::make_matrix(range, std::move(result));
  }

  Matrix sum_of(const RowRange &rows, const std::vector<Summand> &given)
  {
    std::vector<Summand> summands;
    std::vector<Matrix> transposes;
    for (const Summand &s : given)
      if (s.matrix && s.coefficient != 0)
      {
        summands.push_back(s);
        if (s.transposed_too)
        {
          Mat transpose = nullptr;
          SQUEAL_PETSC(MatTranspose(s.matrix, MAT_INITIAL_MATRIX, &transpose));
          transposes.emplace_back(transpose);
          summands.push_back({s.coefficient, transpose});
        }
      }
    if (summands.empty())
      return {};

    std::vector<std::unique_ptr<const LocalRows>> stored;
    std::size_t n_entries = 0;
    for (const Summand &s : summands)
    {
      stored.push_back(std::make_unique<const LocalRows>(s.matrix, rows));
      n_entries += stored.back()->n_entries();
    }
    CompressedRows result;
    result.reserve(n_entries); // pages that are not written to take no memory
    RowSums sums(rows.size, 1);
    for (PetscInt row = rows.begin; row < PetscInt(rows.end); ++row)
    {
      for (unsigned int i = 0; i < summands.size(); ++i)
      {
        RowSums::Adder adder(sums);
        const double coefficient = summands[i].coefficient;
        stored[i]->for_entries(row, [&](const PetscInt column, const PetscScalar value)
                               { *adder.at(column) += coefficient * value; });
      }
      sums.take([&](const unsigned int column, const double *value)
                { result.add(column, *value); });
      result.end_row();
    }
    return make_matrix(rows, std::move(result));
  }

  bool add_in_place(const RowRange &range, const double c, const Matrix &a, const Matrix &to)
  {
    const LocalRows added(a, range);
    const Parts parts = parts_of(to);
    std::vector<double> row_of_a(range.size);
    std::size_t n_met = 0;
    for (const Mat part : {parts.own, parts.coupled})
    {
      if (!part)
        continue;
      const SequentialRows rows(part);
      PetscScalar *values = nullptr;
      SQUEAL_PETSC(MatSeqAIJGetArray(part, &values));
      for (PetscInt row = 0; row < rows.n_rows; ++row)
      {
        added.for_entries(range.begin + row, [&](const PetscInt column, const PetscScalar value)
                          { row_of_a[column] = c * value; });
        for (PetscInt k = rows.begins[row]; k < rows.begins[row + 1]; ++k)
        {
          const PetscInt column = part == parts.own ? range.begin + rows.columns[k]
                                                    : parts.coupled_columns[rows.columns[k]];
          n_met += row_of_a[column] != 0;
          values[k] += row_of_a[column];
        }
        added.for_entries(range.begin + row,
                          [&](const PetscInt column, PetscScalar) { row_of_a[column] = 0; });
      }
      SQUEAL_PETSC(MatSeqAIJRestoreArray(part, &values));
    }
    int has_all_places = n_met == added.n_entries();
    MPI_Allreduce(MPI_IN_PLACE, &has_all_places, 1, MPI_INT, MPI_MIN, range.comm);
    return has_all_places;
  }

  Matrix sum_in_places(const RowRange &range, const Matrix &a, const double c, const Matrix &b)
  {
    Mat copy = nullptr;
    SQUEAL_PETSC(MatDuplicate(a, MAT_COPY_VALUES, &copy));
    Matrix result(copy);
    return add_in_place(range, c, b, result) ? std::move(result) : sum_of(range, {{1., a}, {c, b}});
  }

  void RepeatedEntries::find_places()
  {
    for (const auto &[place, value] : recorded)
      keys.push_back(place);
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    keys.shrink_to_fit();
    sums.assign(keys.size(), 0.);
    places.reserve(recorded.size());
    for (const auto &[place, value] : recorded)
    {
      places.push_back(std::lower_bound(keys.begin(), keys.end(), place) - keys.begin());
      sums[places.back()] += value;
    }
    recorded = std::vector<std::pair<std::uint64_t, double>>(); // {} would keep its memory
    n_added  = places.size();
  }

  Matrix RepeatedEntries::make_matrix(const RowRange &range)
  {
    if (n_made == 1)
      find_places();
    if (n_added != places.size())
      throw std::logic_error("RepeatedEntries: not the entries of before.");
    ++n_made;
    n_added     = 0;
    int n_ranks = 0;
    MPI_Comm_size(range.comm, &n_ranks);
    Matrix matrix;
    if (n_made > 1 && n_ranks == 1)
    {
      CompressedRows rows;
      rows.reserve(keys.size());
      std::size_t k = 0;
      for (std::uint64_t row = 0; row < range.size; ++row)
      {
        for (; k < keys.size() && row_of(keys[k]) == row; ++k)
          rows.add(column_of(keys[k]), sums[k]);
        rows.end_row();
      }
      matrix = squeal::make_matrix(range, std::move(rows));
    }
    else
    {
      for (std::size_t k = 0; k < keys.size(); ++k)
        once.add(row_of(keys[k]), column_of(keys[k]), sums[k]);
      matrix = once.make_matrix(range);
      once   = {};
    }
    std::fill(sums.begin(), sums.end(), 0.);
    return matrix;
  }
} // namespace squeal
