#include <squeal/equations/parity_space.h>
#include <squeal/equations/term_list.h>
#include <squeal/linalg/compressed_rows.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <stdexcept>

// A half is restricted in three steps. The constructor numbers the columns of V by the rows that
// stand for pairs. restrict_own_rows() walks through the rows of all matrices once and makes those
// of V^T A V that stand for rows of this rank, of all sums that are wanted. hand_over() sends them
// to the group of ranks that has the half, if one has. The functions restrict() put together what a
// quadratic problem needs from it: M, P, Q, what relaxes, and the reference problem.

namespace squeal
{
  ParitySpace::ParitySpace(const MirrorSymmetry &symmetry, const bool symmetric)
      : ParitySpace(symmetry, symmetric, nullptr)
  {
  }

  ParitySpace::ParitySpace(const MirrorSymmetry &symmetry, const bool symmetric,
                           const Subcommunicator &group)
      : ParitySpace(symmetry, symmetric, &group)
  {
  }

  ParitySpace::ParitySpace(const MirrorSymmetry &symmetry, const bool symmetric,
                           const Subcommunicator *group)
      : whole(symmetry.rows), is_shared(group != nullptr), images(symmetry.image),
        places(whole.size)
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
      places[row] = {n, false, image == row ? 1. : std::sqrt(0.5)};
      if (image != row)
        places[image] = {n, true, parity * symmetry.sign[row] * places[row].entry};
    }
  }

  namespace
  {
    /// Rows of a distributed matrix, own ones and some of other ranks. Collective.
    class Rows
    {
    public:
      Rows(Mat matrix, const RowRange &own, const std::vector<PetscInt> &others)
          : own(own), own_rows(matrix, own), others(others)
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
        received_rows = std::make_unique<const SequentialRows>(*received);
      }
      ~Rows()
      {
        received_rows.reset();
        if (received)
          MatDestroySubMatrices(1, &received);
      }
      Rows(const Rows &)            = delete;
      Rows &operator=(const Rows &) = delete;

      /// Calls visit(column, value) for the entries of a row.
      template <typename Visit>
      void for_entries(const PetscInt row, const Visit &visit) const
      {
        if (own.contains(row))
          own_rows.for_entries(row, visit);
        else
          received_rows->for_entries(
              std::lower_bound(others.begin(), others.end(), row) - others.begin(), visit);
      }
      std::size_t n_own_entries() const
      {
        return own_rows.n_entries();
      }

    private:
      const RowRange own;
      const LocalRows own_rows;
      const std::vector<PetscInt> others; ///< ascending
      Mat *received = nullptr;
      std::unique_ptr<const SequentialRows> received_rows;
    };

    /// Entries that are sent to a rank or come from it, by places in the arrays.
    struct Runs
    {
      std::vector<int> begins, lengths;

      void add(const int begin, const int length)
      {
        if (length == 0)
          return;
        if (!begins.empty() && begins.back() + lengths.back() == begin)
          lengths.back() += length;
        else
        {
          begins.push_back(begin);
          lengths.push_back(length);
        }
      }
      /// Calls start(type) with numbers at the places as a type of MPI.
      template <typename Start>
      void with_type(const MPI_Datatype number, const Start &start) const
      {
        MPI_Datatype type = MPI_DATATYPE_NULL;
        MPI_Type_indexed(begins.size(), lengths.data(), begins.data(), number, &type);
        MPI_Type_commit(&type);
        start(type);
        MPI_Type_free(&type);
      }
    };

    /// From where they are to where they shall be. Runs are by rank; @p meanwhile is done while
    /// they are on the way.
    void transfer(const CompressedRows &sent, const std::vector<Runs> &outgoing,
                  CompressedRows &received, const std::vector<Runs> &incoming, const MPI_Comm comm,
                  const std::function<void()> &meanwhile)
    {
      constexpr int of_columns = 1, of_values = 2;
      std::vector<MPI_Request> requests;
      for (unsigned int rank = 0; rank < incoming.size(); ++rank)
        if (const Runs &runs = incoming[rank]; !runs.begins.empty())
        {
          const auto receive = [&](void *data, const MPI_Datatype number, const int tag)
          {
            requests.emplace_back();
            runs.with_type(number, [&](const MPI_Datatype type)
                           { MPI_Irecv(data, 1, type, rank, tag, comm, &requests.back()); });
          };
          receive(received.columns.data(), MPIU_INT, of_columns);
          receive(received.values.data(), MPIU_SCALAR, of_values);
        }
      for (unsigned int rank = 0; rank < outgoing.size(); ++rank)
        if (const Runs &runs = outgoing[rank]; !runs.begins.empty())
        {
          const auto send = [&](const void *data, const MPI_Datatype number, const int tag)
          {
            requests.emplace_back();
            runs.with_type(number, [&](const MPI_Datatype type)
                           { MPI_Isend(data, 1, type, rank, tag, comm, &requests.back()); });
          };
          send(sent.columns.data(), MPIU_INT, of_columns);
          send(sent.values.data(), MPIU_SCALAR, of_values);
        }
      meanwhile();
      MPI_Waitall(requests.size(), requests.data(), MPI_STATUSES_IGNORE);
    }
  } // namespace

  CompressedRows ParitySpace::hand_over(const CompressedRows &sent) const
  {
    int n_ranks = 0, this_rank = 0;
    MPI_Comm_size(whole.comm, &n_ranks);
    MPI_Comm_rank(whole.comm, &this_rank);
    const PetscInt end = rows.end;
    std::vector<PetscInt> ends(n_ranks);
    MPI_Allgather(&end, 1, MPIU_INT, ends.data(), 1, MPIU_INT, whole.comm);

    // Row by row the number and the length, by receivers
    std::vector<Runs> outgoing(n_ranks), incoming(n_ranks);
    std::vector<std::vector<PetscInt>> heads_to(n_ranks);
    std::vector<unsigned int> staying;
    CompressedRows result;
    result.begins.assign(rows.n_local() + 1, 0);
    for (unsigned int n = 0; n < own_representatives.size(); ++n)
    {
      const PetscInt row = places[own_representatives[n]].column, first = sent.begins[n],
                     length = sent.begins[n + 1] - first;
      const int receiver    = std::upper_bound(ends.begin(), ends.end(), row) - ends.begin();
      if (receiver == this_rank)
      {
        staying.push_back(n);
        result.begins[row - rows.begin + 1] = length;
      }
      else
      {
        heads_to[receiver].insert(heads_to[receiver].end(), {row, length});
        outgoing[receiver].add(first, length);
      }
    }
    std::vector<PetscInt> heads;
    std::vector<int> n_heads, n_expected;
    for (const std::vector<PetscInt> &of_rank : heads_to)
    {
      heads.insert(heads.end(), of_rank.begin(), of_rank.end());
      n_heads.push_back(of_rank.size());
    }
    heads = exchange(heads, n_heads, n_expected, whole.comm);
    for (std::size_t k = 0; k < heads.size(); k += 2)
      result.begins[heads[k] - rows.begin + 1] = heads[k + 1];
    std::partial_sum(result.begins.begin(), result.begins.end(), result.begins.begin());
    result.resize(result.begins.back());
    std::size_t k = 0;
    for (int rank = 0; rank < n_ranks; ++rank)
      for (const std::size_t last = k + n_expected[rank]; k < last; k += 2)
        incoming[rank].add(result.begins[heads[k] - rows.begin], heads[k + 1]);

    transfer(
        sent, outgoing, result, incoming, whole.comm,
        [&]()
        {
          for (const unsigned int n : staying)
          {
            const PetscInt first = sent.begins[n], length = sent.begins[n + 1] - first,
                           place =
                               result.begins[places[own_representatives[n]].column - rows.begin];
            std::copy_n(sent.columns.data() + first, length, result.columns.data() + place);
            std::copy_n(sent.values.data() + first, length, result.values.data() + place);
          }
        });
    return result;
  }

  /// With a pair of rows i, i' and one of columns k, k', an entry of V^T A V is
  ///     (v_i v_k a_ik + v_i' v_k' a_i'k') + (v_i v_k' a_ik' + v_i' v_k a_i'k).
  /// Summed like this a symmetric matrix stays symmetric, and a skew one skew, to the last digit:
  /// otherwise rounding would damp or feed the vibration.
  std::vector<CompressedRows>
  ParitySpace::restrict_own_rows(const std::vector<std::vector<Term>> &sums) const
  {
    std::vector<PetscInt> others;
    for (const unsigned int i : own_representatives)
      if (!whole.contains(images[i]))
        others.push_back(images[i]);
    std::sort(others.begin(), others.end());
    const TermList terms = TermList::of_sums(sums);
    struct Factors ///< of a matrix in the sums that have it
    {
      std::unique_ptr<const Rows> rows;
      std::vector<std::pair<unsigned int, double>> of_sums;
    };
    std::vector<Factors> matrices;
    std::vector<std::size_t> n_entries(sums.size(), 0);
    for (unsigned int k = 0; k < terms.n_matrices(); ++k)
    {
      matrices.push_back({std::make_unique<const Rows>(*terms.matrix(k), whole, others), {}});
      for (const Term &term : terms.terms_of(k))
      {
        matrices[k].of_sums.emplace_back(term.order, term.coefficient);
        n_entries[term.order] += matrices[k].rows->n_own_entries();
      }
    }

    // Of each column and sum the two brackets above.
    RowSums row_sums(rows.size, 2 * sums.size());
    std::vector<CompressedRows> results(sums.size());
    // Half of the rows, of twice the columns; pages that are not written to take no memory.
    for (unsigned int s = 0; s < sums.size(); ++s)
      results[s].reserve(n_entries[s] / 2);
    const auto add_row = [&](const unsigned int row, const bool is_image)
    {
      const double of_row = places[row].entry;
      for (const Factors &matrix : matrices)
      {
        // Nearly all matrices belong to one sum.
        const auto &of_sums      = matrix.of_sums;
        const unsigned int first = 2 * of_sums.front().first;
        const double factor      = of_sums.front().second;
        RowSums::Adder adder(row_sums);
        matrix.rows->for_entries(row,
                                 [&, first, factor](const PetscInt k, const PetscScalar a)
                                 {
                                   const Place &place = places[k];
                                   if (place.column == none)
                                     return;
                                   const double value = (of_row * place.entry) * a;
                                   double *const parts =
                                       adder.at(place.column) + (is_image != place.is_second);
                                   parts[first] += factor * value;
                                   for (unsigned int i = 1; i < of_sums.size(); ++i)
                                     parts[2 * of_sums[i].first] += of_sums[i].second * value;
                                 });
      }
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
    return results;
  }

  std::vector<Matrix> ParitySpace::restrict(const std::vector<std::vector<Term>> &sums) const
  {
    const std::vector<Wanted> wanted = {{this, sums}};
    return std::move(restrict(wanted).front());
  }

  std::vector<std::vector<Matrix>> ParitySpace::restrict(const std::vector<Wanted> &all)
  {
    std::vector<std::vector<CompressedRows>> all_rows;
    for (const Wanted &wanted : all)
    {
      std::vector<CompressedRows> rows = wanted.space->restrict_own_rows(wanted.sums);
      for (unsigned int s = 0; s < rows.size() && wanted.space->is_shared; ++s)
        if (!wanted.sums[s].empty())
          rows[s] = wanted.space->hand_over(std::exchange(rows[s], {}));
      all_rows.push_back(std::move(rows));
    }
    // Once all have been handed over: groups of ranks do this at the same time.
    std::vector<std::vector<Matrix>> matrices(all.size());
    for (unsigned int h = 0; h < all.size(); ++h)
      for (unsigned int s = 0; s < all[h].sums.size(); ++s)
      {
        const ParitySpace &space = *all[h].space;
        matrices[h].push_back(all[h].sums[s].empty() || !space.is_here()
                                  ? Matrix()
                                  : make_matrix(space.rows, std::move(all_rows[h][s])));
      }
    return matrices;
  }

  QuadraticEigenproblem ParitySpace::restrict(const EquationsOfMotion &equations,
                                              const std::vector<double> &counted) const
  {
    if (counted.empty() || equations.reference_terms().empty() ||
        equations.reference != EquationsOfMotion::Reference::conservative_terms)
      return std::move(restrict(std::vector<const ParitySpace *>{this}, equations).front());
    Counting counting{counted.front(), {this}, {}};
    QuadraticEigenproblem half = std::move(restrict({this}, equations, &counting).front());
    const auto along           = std::make_shared<Matrix>(std::move(counting.shifted.front()));
    half.make_shifted_reference =
        [equations, space = *this, along, first = counted.front()](const double omega)
    {
      return omega == first && *along ? std::exchange(*along, {})
                                      : space.shifted_reference(equations, omega);
    };
    return half;
  }

  Matrix ParitySpace::shifted_reference(const EquationsOfMotion &equations,
                                        const double omega) const
  {
    const std::vector<std::vector<Term>> sums = {equations.shifted_reference_terms(omega)};
    return std::move(restrict(sums).front());
  }

  std::vector<QuadraticEigenproblem>
      ParitySpace::restrict(const std::vector<const ParitySpace *> &spaces,
                            const EquationsOfMotion &equations, Counting *const counting)
  {
    std::vector<std::vector<Term>> sums = sums_of(equations);
    const unsigned int first_relaxing   = sums.size();
    for (const RelaxationTerm &term : equations.relaxation)
      sums.push_back(term.low_rank ? std::vector<Term>()
                                   : std::vector<Term>{{term.origin, 0, 1., term.matrix}});
    const unsigned int number_of_reference = sums.size();
    const bool reference_is_symmetric_part =
        equations.reference == EquationsOfMotion::Reference::symmetric_part;
    // A group cannot make it when it wants it: the other ranks do something else then.
    const bool with_reference =
        spaces.front()->is_shared && !reference_is_symmetric_part && !counting;
    if (with_reference)
      sums.push_back(equations.reference_terms());
    std::vector<Wanted> wanted;
    for (const ParitySpace *space : spaces)
      wanted.push_back({space, sums});
    std::vector<unsigned int> counted_by; // number of what is wanted; its last sum
    for (unsigned int h = 0; counting && h < spaces.size(); ++h)
    {
      const bool apart = counting->spaces[h] != spaces[h];
      if (apart)
        wanted.push_back({counting->spaces[h], {}});
      counted_by.push_back(apart ? wanted.size() - 1 : h);
      wanted[counted_by[h]].sums.push_back(equations.shifted_reference_terms(counting->omega));
    }
    std::vector<std::vector<Matrix>> matrices = restrict(wanted);
    for (const unsigned int number : counted_by)
      counting->shifted.push_back(std::move(matrices[number].back()));
    std::vector<QuadraticEigenproblem> halves;
    for (unsigned int h = 0; h < spaces.size(); ++h)
    {
      const ParitySpace &space   = *spaces[h];
      QuadraticEigenproblem half = equations.without_matrices();
      half.rows                  = space.rows;
      half.M                     = std::move(matrices[h][0]);
      half.P                     = std::move(matrices[h][1]);
      half.Q                     = std::move(matrices[h][2]);
      for (unsigned int k = 0; k < equations.relaxation.size(); ++k)
      {
        const RelaxationTerm &term = equations.relaxation[k];
        half.frozen.push_back({term.coefficient,
                               term.low_rank ? space.restrict(*term.low_rank)
                                             : std::move(matrices[h][first_relaxing + k]),
                               term.factor, equations.frozen_at});
      }
      if (reference_is_symmetric_part && space.is_here())
        half.reference = symmetric_part(space.rows, half.Q);
      else if (with_reference)
        half.reference = std::move(matrices[h][number_of_reference]);
      else if (counting)
        half.make_shifted_reference = [](double) -> Matrix
        { throw std::logic_error("The reference problem is elsewhere."); };
      else if (!reference_is_symmetric_part && !equations.reference_terms().empty())
        half.make_shifted_reference = [equations, space](const double omega)
        { return space.shifted_reference(equations, omega); };
      // In parallel the whole is symmetric to rounding only, which would turn double eigenvalues of
      // a conservative problem into complex pairs.
      if (!half.has_reference() && space.is_here())
      {
        half.M = symmetric_part(space.rows, half.M);
        half.Q = symmetric_part(space.rows, half.Q);
      }
      // Pressures come in pairs, both in contact or both released.
      half.n_constraints       = equations.n_constraints / 2;
      half.n_local_constraints = space.n_local_pressures();
      halves.push_back(std::move(half));
    }
    return halves;
  }

  unsigned int ParitySpace::n_local_pressures() const
  {
    return std::count(has_pressure.begin(), has_pressure.end(), true);
  }

  Matrix ParitySpace::restrict(const std::shared_ptr<const Matrix> &matrix) const
  {
    const std::vector<Term> alone = {{Origin::elasticity, 0, 1., matrix}};
    return std::move(restrict(std::vector<std::vector<Term>>{alone})[0]);
  }

  MultiVector ParitySpace::restrict(const MultiVector &x) const
  {
    MultiVector y(rows, x.n_columns());
    for (unsigned int k = 0; k < x.n_columns(); ++k)
    {
      const std::vector<double> all = replicate(x.columns(k, 1));
      for (unsigned int j = 0; j < representatives.size(); ++j)
      {
        const unsigned int i = representatives[j], image = images[i];
        y.column(k)[j] =
            places[i].entry * all[i] + (image == i ? 0. : places[image].entry * all[image]);
      }
    }
    return y;
  }

  Matrix ParitySpace::restrict(const LowRank &low_rank) const
  {
    MultiVector vectors = restrict(low_rank.vectors);
    if (!is_here())
      return {};
    return make_matrix(
        std::make_shared<const LowRank>(LowRank{std::move(vectors), low_rank.weights, {}}));
  }

  std::vector<unsigned int>
      ParitySpace::restrict(const std::vector<unsigned int> &rows_of_whole) const
  {
    std::vector<unsigned int> result;
    for (const unsigned int row : rows_of_whole)
      if (places[row].column != none)
        result.push_back(places[row].column);
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
  }

  std::vector<double> ParitySpace::replicate_half(const double *const column) const
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

  MultiVector ParitySpace::expand(const MultiVector &y) const
  {
    MultiVector x(whole, y.n_columns());
    for (unsigned int k = 0; k < y.n_columns(); ++k)
    {
      const std::vector<double> all = replicate_half(y.column(k));
      for (unsigned int row = whole.begin; row < whole.end; ++row)
        if (const Place &place = places[row]; place.column != none)
          x.column(k)[row - whole.begin] = place.entry * all[place.column];
    }
    return x;
  }
} // namespace squeal
