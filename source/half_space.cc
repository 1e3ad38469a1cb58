#include <squeal/compressed_rows.h>
#include <squeal/half_space.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>

namespace squeal
{
  HalfSpace::HalfSpace(const MirrorSymmetry &symmetry, const bool symmetric)
      : HalfSpace(symmetry, symmetric, nullptr)
  {
  }

  HalfSpace::HalfSpace(const MirrorSymmetry &symmetry, const bool symmetric, const RankGroup &group)
      : HalfSpace(symmetry, symmetric, &group)
  {
  }

  HalfSpace::HalfSpace(const MirrorSymmetry &symmetry, const bool symmetric, const RankGroup *group)
      : whole(symmetry.rows), is_shared(group != nullptr), images(symmetry.image),
        columns(whole.size, none), entries(whole.size, 0.), is_second(whole.size, false)
  {
    const double parity = symmetric ? 1 : -1;
    // One row of each pair stands for both: the lower or the higher one in turn, since one side may
    // belong to one rank.
    const auto stands_for_pair = [&](const unsigned int row)
    {
      const unsigned int image = symmetry.image[row];
      return (row < image) == ((row + image) % 2 == 0);
    };
    std::vector<unsigned int> all; // representatives of all ranks, in the order of the columns
    rows.comm = whole.comm;
    for (unsigned int row = 0; row < whole.size; ++row)
    {
      const bool alone = symmetry.image[row] == row;
      if (alone ? symmetry.sign[row] == parity : stands_for_pair(row))
      {
        all.push_back(row);
        if (whole.contains(row))
          own_representatives.push_back(row);
        rows.begin += row < whole.begin;
        rows.end += row < whole.end;
      }
    }
    rows.size = all.size();
    if (group)
    {
      // Each rank of the group gets as many displacements as the others, and as many pressures.
      std::array<std::vector<unsigned int>, 2> kinds;
      for (const unsigned int row : all)
        kinds[symmetry.is_pressure[row]].push_back(row);
      all.clear();
      const unsigned int n = group->n_ranks();
      for (unsigned int rank = 0; rank < n; ++rank)
      {
        if (rank == group->rank())
          rows.begin = all.size();
        for (const auto &kind : kinds)
          all.insert(all.end(), kind.begin() + kind.size() * rank / n,
                     kind.begin() + kind.size() * (rank + 1) / n);
        if (rank == group->rank())
          rows.end = all.size();
      }
      rows.comm = group->comm();
      if (!group->has_this_rank())
        rows.begin = rows.end = group->rank() == 0 ? 0 : rows.size;
    }
    representatives.assign(all.begin() + rows.begin, all.begin() + rows.end);
    for (const unsigned int row : representatives)
      has_pressure.push_back(symmetry.is_pressure[row]);
    for (unsigned int n = 0; n < all.size(); ++n)
    {
      const unsigned int row = all[n], image = symmetry.image[row];
      columns[row] = n;
      entries[row] = image == row ? 1. : std::sqrt(0.5);
      if (image != row)
      {
        is_second[image] = true;
        columns[image]   = n;
        entries[image]   = parity * symmetry.sign[row] * entries[row];
      }
    }
  }

  namespace
  {
    /// Rows of a distributed matrix, own ones and some of other ranks. Collective.
    class Rows
    {
    public:
      Rows(Mat matrix, const RowRange &own, const std::vector<PetscInt> &others)
          : matrix(matrix), own(own), others(others)
      {
        int n_ranks = 0;
        MPI_Comm_size(own.comm, &n_ranks);
        if (n_ranks == 1)
          return;
        IS rows = nullptr, columns = nullptr;
        SQUEAL_PETSC(ISCreateGeneral(PETSC_COMM_SELF, others.size(), others.data(),
                                     PETSC_COPY_VALUES, &rows));
        SQUEAL_PETSC(ISCreateStride(PETSC_COMM_SELF, own.size, 0, 1, &columns));
        SQUEAL_PETSC(
            MatCreateSubMatrices(matrix, 1, &rows, &columns, MAT_INITIAL_MATRIX, &received));
        SQUEAL_PETSC(ISDestroy(&rows));
        SQUEAL_PETSC(ISDestroy(&columns));
      }
      ~Rows()
      {
        if (received)
          MatDestroySubMatrices(1, &received);
      }
      Rows(const Rows &)            = delete;
      Rows &operator=(const Rows &) = delete;

      /// Calls visit(column, value) for the entries of a row.
      template <typename Visit>
      void for_entries(const PetscInt row, const Visit &visit) const
      {
        const bool is_own = own.contains(row);
        Mat mat           = is_own ? matrix : *received;
        const PetscInt place =
            is_own ? row : std::lower_bound(others.begin(), others.end(), row) - others.begin();
        PetscInt n                = 0;
        const PetscInt *columns   = nullptr;
        const PetscScalar *values = nullptr;
        SQUEAL_PETSC(MatGetRow(mat, place, &n, &columns, &values));
        for (PetscInt k = 0; k < n; ++k)
          visit(columns[k], values[k]);
        SQUEAL_PETSC(MatRestoreRow(mat, place, &n, &columns, &values));
      }

    private:
      Mat matrix;
      const RowRange own;
      const std::vector<PetscInt> others; ///< ascending
      Mat *received = nullptr;
    };
  } // namespace

  namespace
  {
    /// Sends parts of a vector, one after the other and of the given lengths, to the ranks; what
    /// comes, in their order.
    template <typename Number>
    std::vector<Number> exchange(const std::vector<Number> &sent, const std::vector<int> &lengths,
                                 const MPI_Datatype type, const MPI_Comm comm)
    {
      const unsigned int n_ranks = lengths.size();
      std::vector<int> expected(n_ranks), to(n_ranks), from(n_ranks);
      MPI_Alltoall(lengths.data(), 1, MPI_INT, expected.data(), 1, MPI_INT, comm);
      std::partial_sum(lengths.begin(), lengths.end() - 1, to.begin() + 1);
      std::partial_sum(expected.begin(), expected.end() - 1, from.begin() + 1);
      std::vector<Number> received(from.back() + expected.back());
      MPI_Alltoallv(sent.data(), lengths.data(), to.data(), type, received.data(), expected.data(),
                    from.data(), type, comm);
      return received;
    }
  } // namespace

  CompressedRows HalfSpace::hand_over(const CompressedRows &sent) const
  {
    int n_ranks = 0;
    MPI_Comm_size(whole.comm, &n_ranks);
    const PetscInt end = rows.end;
    std::vector<PetscInt> ends(n_ranks);
    MPI_Allgather(&end, 1, MPIU_INT, ends.data(), 1, MPIU_INT, whole.comm);

    // Rows by their receivers: number and length of each, then the entries.
    std::vector<std::vector<unsigned int>> rows_to(n_ranks);
    for (unsigned int n = 0; n < own_representatives.size(); ++n)
    {
      const PetscInt row = columns[own_representatives[n]];
      rows_to[std::upper_bound(ends.begin(), ends.end(), row) - ends.begin()].push_back(n);
    }
    std::vector<PetscInt> heads, all_columns;
    std::vector<PetscScalar> values;
    std::vector<int> n_heads, n_entries;
    for (const std::vector<unsigned int> &of_rank : rows_to)
    {
      const std::size_t before = all_columns.size();
      for (const unsigned int n : of_rank)
      {
        const PetscInt first = sent.begins[n], last = sent.begins[n + 1];
        heads.push_back(columns[own_representatives[n]]);
        heads.push_back(last - first);
        all_columns.insert(all_columns.end(), sent.columns.begin() + first,
                           sent.columns.begin() + last);
        values.insert(values.end(), sent.values.begin() + first, sent.values.begin() + last);
      }
      n_heads.push_back(2 * of_rank.size());
      n_entries.push_back(all_columns.size() - before);
    }
    heads       = exchange(heads, n_heads, MPIU_INT, whole.comm);
    all_columns = exchange(all_columns, n_entries, MPIU_INT, whole.comm);
    values      = exchange(values, n_entries, MPIU_SCALAR, whole.comm);

    CompressedRows result;
    result.begins.assign(rows.n_local() + 1, 0);
    for (std::size_t k = 0; k < heads.size(); k += 2)
      result.begins[heads[k] - rows.begin + 1] = heads[k + 1];
    std::partial_sum(result.begins.begin(), result.begins.end(), result.begins.begin());
    result.columns.resize(all_columns.size());
    result.values.resize(values.size());
    std::size_t first = 0;
    for (std::size_t k = 0; k < heads.size(); k += 2)
    {
      const PetscInt place = result.begins[heads[k] - rows.begin];
      std::copy_n(all_columns.begin() + first, heads[k + 1], result.columns.begin() + place);
      std::copy_n(values.begin() + first, heads[k + 1], result.values.begin() + place);
      first += heads[k + 1];
    }
    return result;
  }

  /// With a pair of rows i, i' and one of columns k, k', an entry of V^T A V is
  ///     (v_i v_k a_ik + v_i' v_k' a_i'k') + (v_i v_k' a_ik' + v_i' v_k a_i'k).
  /// Summed like this a symmetric matrix stays symmetric, and a skew one skew, to the last digit:
  /// otherwise rounding would damp or feed the vibration.
  std::vector<Matrix> HalfSpace::restrict(const std::vector<std::vector<Term>> &sums) const
  {
    std::vector<PetscInt> others;
    for (const unsigned int i : own_representatives)
      if (!whole.contains(images[i]))
        others.push_back(images[i]);
    std::sort(others.begin(), others.end());
    const std::vector<MatrixFactors> all_factors = factors_of(sums);
    std::vector<std::unique_ptr<const Rows>> all_rows;
    for (const MatrixFactors &factors : all_factors)
      all_rows.push_back(std::make_unique<const Rows>(*factors.matrix, whole, others));

    struct Place
    {
      unsigned int column;
      bool is_second;
      double entry;
    };
    std::vector<Place> places(whole.size); // side by side: they are wanted together
    for (unsigned int k = 0; k < whole.size; ++k)
      places[k] = {columns[k], is_second[k], entries[k]};

    // Of each column and sum the two brackets above.
    RowSums row_sums(rows.size, 2 * sums.size());
    std::vector<CompressedRows> results(sums.size());
    const auto add_row = [&](const unsigned int row, const bool is_image)
    {
      for (unsigned int f = 0; f < all_factors.size(); ++f)
        all_rows[f]->for_entries(row,
                                 [&](const PetscInt k, const PetscScalar a)
                                 {
                                   const Place &place = places[k];
                                   if (place.column == none)
                                     return;
                                   const double value = (entries[row] * place.entry) * a;
                                   double *const parts =
                                       row_sums.at(place.column) + (is_image != place.is_second);
                                   for (const auto &[s, factor] : all_factors[f].of_sums)
                                     parts[2 * s] += factor * value;
                                 });
    };
    for (const unsigned int i : own_representatives)
    {
      add_row(i, false);
      if (images[i] != i)
        add_row(images[i], true);
      row_sums.take(
          [&](const unsigned int column, const double *parts)
          {
            for (unsigned int s = 0; s < sums.size(); ++s)
              results[s].add(column, parts[2 * s] + parts[2 * s + 1]);
          });
      for (CompressedRows &result : results)
        result.end_row();
    }
    std::vector<Matrix> matrices;
    for (unsigned int s = 0; s < sums.size(); ++s)
    {
      if (!sums[s].empty() && is_shared)
        results[s] = hand_over(results[s]);
      matrices.push_back(sums[s].empty() || !is_here() ? Matrix() : make_matrix(rows, results[s]));
      results[s] = {};
    }
    return matrices;
  }

  QuadraticEigenproblem HalfSpace::restrict(const EquationsOfMotion &equations) const
  {
    std::vector<std::vector<Term>> sums = sums_of(equations);
    const std::vector<Term> reference   = equations.reference_terms();
    const bool reference_is_symmetric_part =
        equations.reference == EquationsOfMotion::Reference::symmetric_part;
    // A group cannot make it when it wants it: the other ranks do something else then.
    if (is_shared && !reference_is_symmetric_part)
      sums.push_back(reference);
    std::vector<Matrix> matrices = restrict(sums);
    QuadraticEigenproblem half   = equations.without_matrices();
    half.rows                    = rows;
    half.M                       = std::move(matrices[0]);
    half.P                       = std::move(matrices[1]);
    half.Q                       = std::move(matrices[2]);
    if (reference_is_symmetric_part && is_here())
      half.reference = symmetric_part(rows, half.Q);
    else if (is_shared && !reference_is_symmetric_part)
      half.reference = std::move(matrices[3]);
    else if (!reference_is_symmetric_part && !reference.empty())
      half.make_shifted_reference = [equations, space = *this](const double omega)
      { return std::move(space.restrict({equations.shifted_reference_terms(omega)})[0]); };
    // In parallel the whole is symmetric to rounding only, which would turn double eigenvalues of a
    // conservative problem into complex pairs.
    if (!half.has_reference() && is_here())
    {
      half.M = symmetric_part(rows, half.M);
      half.Q = symmetric_part(rows, half.Q);
    }
    // Pressures come in pairs, both in contact or both released.
    half.n_constraints       = equations.n_constraints / 2;
    half.n_local_constraints = n_local_pressures();
    return half;
  }

  unsigned int HalfSpace::n_local_pressures() const
  {
    return std::count(has_pressure.begin(), has_pressure.end(), true);
  }

  Matrix HalfSpace::restrict(const std::shared_ptr<const Matrix> &matrix) const
  {
    const std::vector<Term> alone = {{Origin::elasticity, 0, 1., matrix}};
    return std::move(restrict(std::vector<std::vector<Term>>{alone})[0]);
  }

  Block HalfSpace::restrict(const Block &x) const
  {
    Block y(rows, x.n_columns());
    for (unsigned int k = 0; k < x.n_columns(); ++k)
    {
      const std::vector<double> all = replicate(x.columns(k, 1));
      for (unsigned int j = 0; j < representatives.size(); ++j)
      {
        const unsigned int i = representatives[j], image = images[i];
        y.column(k)[j] = entries[i] * all[i] + (image == i ? 0. : entries[image] * all[image]);
      }
    }
    return y;
  }

  std::vector<unsigned int>
      HalfSpace::restrict(const std::vector<unsigned int> &rows_of_whole) const
  {
    std::vector<unsigned int> result;
    for (const unsigned int row : rows_of_whole)
      if (columns[row] != none)
        result.push_back(columns[row]);
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
  }

  std::vector<double> HalfSpace::replicate_half(const double *const column) const
  {
    // The rows of a group's ranks follow one another like the ranks.
    int n_ranks = 0, n_local = rows.n_local();
    MPI_Comm_size(whole.comm, &n_ranks);
    std::vector<int> counts(n_ranks), offsets(n_ranks);
    MPI_Allgather(&n_local, 1, MPI_INT, counts.data(), 1, MPI_INT, whole.comm);
    std::partial_sum(counts.begin(), counts.end() - 1, offsets.begin() + 1);
    std::vector<double> all(rows.size);
    MPI_Allgatherv(column, n_local, MPI_DOUBLE, all.data(), counts.data(), offsets.data(),
                   MPI_DOUBLE, whole.comm);
    return all;
  }

  Block HalfSpace::expand(const Block &y) const
  {
    Block x(whole, y.n_columns());
    for (unsigned int k = 0; k < y.n_columns(); ++k)
    {
      const std::vector<double> all = replicate_half(y.column(k));
      for (unsigned int row = whole.begin; row < whole.end; ++row)
        if (columns[row] != none)
          x.column(k)[row - whole.begin] = entries[row] * all[columns[row]];
    }
    return x;
  }
} // namespace squeal
