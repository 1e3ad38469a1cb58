#include <squeal/base/memory.h>
#include <squeal/base/stopwatch.h>
#include <squeal/base/subcommunicator.h>
#include <squeal/eigen/inertia_count.h>
#include <squeal/symmetry/parity_space.h>
#include <squeal/symmetry/sectors.h>

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>
#include <type_traits>

namespace squeal
{
  namespace
  {
    constexpr std::array<const char *, 2> names           = {{"symmetric", "antisymmetric"}};
    constexpr std::array<MultiVector Modes::*, 4> vectors = {
        {&Modes::re, &Modes::im, &Modes::left_re, &Modes::left_im}};

    template <typename Number>
    void broadcast(Number *data, const std::size_t n, const unsigned int root, const MPI_Comm comm)
    {
      static_assert(std::is_trivially_copyable_v<Number>);
      MPI_Bcast(data, n * sizeof(Number), MPI_BYTE, root, comm);
    }

    /// std::vector or std::string.
    template <typename Container>
    void broadcast(Container &values, const unsigned int root, const MPI_Comm comm)
    {
      std::size_t n = values.size();
      broadcast(&n, 1, root, comm);
      values.resize(n);
      broadcast(values.data(), n, root, comm);
    }

    /// What a group of ranks has found, on all ranks: of the vectors those outside of the group get
    /// blocks without rows. @p root is one of the group.
    void share(const ParitySpace &space, const unsigned int root, const MPI_Comm all, Modes &half)
    {
      broadcast(half.lambda, root, all);
      broadcast(half.disc_lambda, root, all);
      broadcast(half.backward_error, root, all);
      broadcast(half.left_backward_error, root, all);
      broadcast(half.condition, root, all);
      broadcast(half.completeness, root, all);
      for (unsigned int *number : {&half.n_reference, &half.n_rigid_body_modes, &half.n_solves})
        broadcast(number, 1, root, all);
      for (double *number : {&half.factor_memory_mib, &half.predicted_memory_mib})
        broadcast(number, 1, root, all);
      broadcast(&half.seconds, 1, root, all);
      for (MultiVector Modes::*block : vectors)
      {
        unsigned int n = (half.*block).n_columns();
        broadcast(&n, 1, root, all);
        if (!space.is_here())
          half.*block = MultiVector(space.row_range(), n);
      }
    }

    /// What both halves found, one after the other, as vectors of the whole. @p at_once is whether
    /// they were solved at the same time.
    void append(const ParitySpace &space, const Modes &half, const std::string &name,
                const bool at_once, Modes &modes)
    {
      const auto join = [](auto &all, const auto &more)
      { all.insert(all.end(), more.begin(), more.end()); };
      join(modes.lambda, half.lambda);
      join(modes.disc_lambda, half.disc_lambda);
      join(modes.backward_error, half.backward_error);
      join(modes.left_backward_error, half.left_backward_error);
      join(modes.condition, half.condition);
      modes.mirror.insert(modes.mirror.end(), half.lambda.size(), name);
      for (MultiVector Modes::*block : vectors)
        (modes.*block).append(space.expand(half.*block));
      modes.completeness += (modes.completeness.empty() ? "" : "; ") + name + ", " +
                            std::to_string(space.row_range().size) +
                            " unknowns: " + half.completeness;
      modes.n_reference += half.n_reference;
      modes.n_rigid_body_modes += half.n_rigid_body_modes;
      modes.n_solves += half.n_solves;
      // One after the other they take their times' sum and the larger memory, at once the opposite.
      const auto both_memories = [&](double &all, const double more)
      { all = at_once ? all + more : std::max(all, more); };
      both_memories(modes.factor_memory_mib, half.factor_memory_mib);
      both_memories(modes.predicted_memory_mib, half.predicted_memory_mib);
      const auto both_times = [&](double &all, const double more)
      { all = at_once ? std::max(all, more) : all + more; };
      both_times(modes.seconds.counting, half.seconds.counting);
      both_times(modes.seconds.factorization, half.seconds.factorization);
      both_times(modes.seconds.right, half.seconds.right);
      both_times(modes.seconds.left, half.seconds.left);
    }

    void sort_by_frequency(Modes &modes)
    {
      std::vector<unsigned int> order(modes.lambda.size());
      std::iota(order.begin(), order.end(), 0u);
      std::stable_sort(order.begin(), order.end(),
                       [&](const unsigned int a, const unsigned int b)
                       { return precedes(modes.lambda[a], modes.lambda[b]); });
      const Pairs right = select({modes.lambda, modes.re, modes.im}, order),
                  left  = select({modes.lambda, modes.left_re, modes.left_im}, order);
      modes.lambda      = right.lambda;
      modes.re          = right.re;
      modes.im          = right.im;
      modes.left_re     = left.re;
      modes.left_im     = left.im;
      const auto sort   = [&](auto &values)
      {
        const auto all = values;
        for (unsigned int k = 0; k < order.size(); ++k)
          values[k] = all[order[k]];
      };
      sort(modes.mirror);
      sort(modes.backward_error);
      sort(modes.left_backward_error);
      sort(modes.condition);
    }

    void solve_one_after_the_other(const Eigensolver &solver, const EquationsOfMotion &equations,
                                   const EigensolverOptions &options,
                                   const MirrorSymmetry &symmetry, Modes &modes)
    {
      const std::vector<double> counted =
          solver.counted_frequencies(options, equations.may_move_rigidly);
      for (const std::string name : names)
      {
        const ParitySpace space(symmetry, name == names[0]);
        auto half =
            std::make_shared<Modes>(solver.solve(space.restrict(equations, counted), options));
        append(space, *half, name, false, modes);
        if (options.keep_factors)
          modes.halves.push_back(half);
        half.reset();
        return_freed_memory();
      }
    }

    /// A number that the ranks of one group find and those of another ask for later. It is sent in
    /// any case, so that nobody waits in vain.
    class NumberForOthers
    {
    public:
      /// The groups are those of the ranks up to @p first_asking of all, and from there on.
      NumberForOthers(const MPI_Comm all, const int first_asking)
          : all(all), first_asking(first_asking)
      {
        MPI_Comm_rank(all, &rank);
        MPI_Comm_size(all, &n_ranks);
        if (rank >= first_asking)
          MPI_Irecv(&number, 1, MPI_INT, 0, tag, all, &request);
      }
      ~NumberForOthers()
      {
        if (!is_sent)
          send(unknown);
        MPI_Wait(&request, MPI_STATUS_IGNORE);
      }
      NumberForOthers(const NumberForOthers &)            = delete;
      NumberForOthers &operator=(const NumberForOthers &) = delete;

      void send(const int found)
      {
        is_sent = true;
        for (int asking = first_asking; asking < n_ranks && rank == 0; ++asking)
          MPI_Send(&found, 1, MPI_INT, asking, tag, all);
      }
      /// Throws SolverError if it was not found.
      unsigned int receive()
      {
        MPI_Wait(&request, MPI_STATUS_IGNORE);
        if (number == unknown)
          throw SolverError("The modes of the other half's reference problem were not counted.");
        return number;
      }

    private:
      static constexpr int tag = 17, unknown = -1;
      const MPI_Comm all;
      const int first_asking;
      int rank = 0, n_ranks = 0, number = unknown;
      bool is_sent        = false;
      MPI_Request request = MPI_REQUEST_NULL;
    };

    /// Each half by half of the ranks: fewer ranks work better together.
    void solve_at_once(const Eigensolver &solver, const EquationsOfMotion &equations,
                       const EigensolverOptions &options, const MirrorSymmetry &symmetry,
                       const unsigned int n_ranks, Modes &modes)
    {
      const MPI_Comm all = equations.rows.comm;
      // The antisymmetric modes, in which the disc bends, are more.
      const std::array<unsigned int, 3> first = {{0, n_ranks / 2, n_ranks}};
      std::array<std::unique_ptr<const Subcommunicator>, 2> groups;
      std::array<std::unique_ptr<const ParitySpace>, 2> spaces;
      std::array<Modes, 2> halves;
      for (unsigned int h = 0; h < 2; ++h)
      {
        groups[h] = std::make_unique<const Subcommunicator>(all, first[h], first[h + 1] - first[h]);
        spaces[h] = std::make_unique<const ParitySpace>(symmetry, h == 0, *groups[h]);
      }
      // So the ranks of the symmetric half count for both, where counting needs nothing else.
      const bool counts_for_both =
          solver.counts_in_disc(options) && !equations.may_move_rigidly &&
          equations.reference == EquationsOfMotion::Reference::conservative_terms &&
          !equations.of_order(1).empty();
      const ParitySpace antisymmetric(symmetry, false, *groups[0]);
      ParitySpace::Counting counting{
          search_radius(options.max_imaginary), {spaces[0].get(), &antisymmetric}, {}};
      std::vector<QuadraticEigenproblem> problems = ParitySpace::restrict(
          {spaces[0].get(), spaces[1].get()}, equations, counts_for_both ? &counting : nullptr);
      const auto solve = [&](const unsigned int h, const EigensolverOptions &with)
      {
        if (spaces[h]->is_here())
          halves[h] = solver.solve(problems[h], with);
      };
      const auto count_and_solve = [&]()
      {
        NumberForOthers n_antisymmetric(all, first[1]);
        EigensolverOptions counted = options;
        counted.counted_elsewhere  = [&]() { return n_antisymmetric.receive(); };
        solve(1, counted);
        if (!spaces[0]->is_here())
          return;
        Stopwatch watch;
        const auto n_reference_of = [&](const unsigned int h)
        { return count_reference_modes(problems[h], std::exchange(counting.shifted[h], {})); };
        n_antisymmetric.send(n_reference_of(1));
        counted.counted_elsewhere = [n = n_reference_of(0)]() { return n; };
        const double seconds      = watch.lap();
        solve(0, counted);
        halves[0].seconds.counting += seconds;
      };
      work_apart(all,
                 [&]()
                 {
                   if (counts_for_both)
                     count_and_solve();
                   else
                     for (const unsigned int h : {0u, 1u})
                       solve(h, options);
                 });
      for (unsigned int h = 0; h < 2; ++h)
      {
        share(*spaces[h], first[h], all, halves[h]);
        append(*spaces[h], halves[h], names[h], true, modes);
      }
      // Blocks and matrices of a group go before its communicator.
      problems.clear();
      halves = {};
      return_freed_memory();
    }
  } // namespace

  Modes solve_by_symmetry(const Eigensolver &solver, const EquationsOfMotion &equations,
                          const EigensolverOptions &options,
                          const std::optional<MirrorSymmetry> &symmetry)
  {
    if (!symmetry || !is_symmetric(equations, *symmetry))
      return solver.solve(sum_of(equations), options);
    Modes modes;
    for (MultiVector Modes::*block : vectors)
      modes.*block = MultiVector(equations.rows, 0);
    int n_ranks = 0;
    MPI_Comm_size(equations.rows.comm, &n_ranks);
    // Factors that are kept must be on all ranks.
    if (n_ranks > 1 && !options.keep_factors)
      solve_at_once(solver, equations, options, *symmetry, n_ranks, modes);
    else
      solve_one_after_the_other(solver, equations, options, *symmetry, modes);
    sort_by_frequency(modes);
    turn_to_real(modes);
    return modes;
  }
} // namespace squeal
