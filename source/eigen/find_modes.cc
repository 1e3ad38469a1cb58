#include <squeal/base/memory.h>
#include <squeal/base/stopwatch.h>
#include <squeal/base/subcommunicator.h>
#include <squeal/eigen/find_modes.h>
#include <squeal/eigen/inertia_count.h>
#include <squeal/eigen/nonlinear_eigensolver.h>
#include <squeal/eigen/window.h>
#include <squeal/equations/sector.h>

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>
#include <type_traits>

namespace squeal
{
  namespace
  {
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
    void share(const Sector &sector, const unsigned int root, const MPI_Comm all,
               EigenSolution &half)
    {
      EigenPairs &modes = half.modes;
      broadcast(modes.lambda, root, all);
      broadcast(modes.backward_error, root, all);
      broadcast(modes.left_backward_error, root, all);
      broadcast(modes.condition, root, all);
      broadcast(half.proof.completeness, root, all);
      broadcast(half.proof.beyond, root, all);
      broadcast(&half.proof.lacks_growing, 1, root, all);
      broadcast(&half.proof.n_reference, 1, root, all);
      broadcast(&half.proof.n_rigid_body_modes, 1, root, all);
      broadcast(&half.cost, 1, root, all);
      if (!sector.is_here())
        modes.right = modes.left = ComplexMultiVector(sector.row_range(), modes.size());
    }

    /// What both halves found, one after the other, as vectors of the whole. @p at_once is whether
    /// they were solved at the same time.
    void append(const Sector &sector, const EigenSolution &half, const bool at_once,
                EigenSolution &whole)
    {
      EigenPairs modes = half.modes;
      modes.right      = sector.expand(modes.right);
      modes.left       = sector.expand(modes.left);
      modes.parity.assign(modes.size(), sector.parity());
      whole.modes.append(modes);
      EigenSolution::Proof &proof = whole.proof;
      proof.completeness +=
          (proof.completeness.empty() ? "" : "; ") + std::string(name_of(sector.parity())) + ", " +
          std::to_string(sector.row_range().size) + " unknowns: " + half.proof.completeness;
      if (!half.proof.beyond.empty())
        proof.beyond += (proof.beyond.empty() ? "" : "; ") + std::string(name_of(sector.parity())) +
                        ": " + half.proof.beyond;
      proof.lacks_growing |= half.proof.lacks_growing;
      proof.n_reference += half.proof.n_reference;
      proof.n_rigid_body_modes += half.proof.n_rigid_body_modes;
      EigenSolution::Cost &cost = whole.cost;
      cost.n_solves += half.cost.n_solves;
      // One after the other they take their times' sum and the larger memory, at once the opposite.
      const auto add_or_max = [](const bool adds, double &all, const double more)
      { all = adds ? all + more : std::max(all, more); };
      add_or_max(at_once, cost.factor_memory_mib, half.cost.factor_memory_mib);
      add_or_max(at_once, cost.predicted_memory_mib, half.cost.predicted_memory_mib);
      using Seconds = EigenSolution::Cost::Seconds;
      for (double Seconds::*phase :
           {&Seconds::counting, &Seconds::factorization, &Seconds::right, &Seconds::left})
        add_or_max(!at_once, cost.seconds.*phase, half.cost.seconds.*phase);
    }

    /// A solver, and by its name where it counts modes of a reference problem.
    struct CountingSolver
    {
      std::unique_ptr<Eigensolver> solver;
      ModeSolver name;

      bool counts_in_disc(const EigensolverOptions &options) const
      {
        return name != ModeSolver::dense && search_region(name, options).is_disc();
      }
      /// The first shifted matrix is made along with the problem's.
      std::vector<double> frequencies(const EigensolverOptions &options,
                                      const bool may_move_rigidly) const
      {
        return name == ModeSolver::dense
                   ? std::vector<double>()
                   : ends_of(search_region(name, options), options, may_move_rigidly);
      }
    };

    void solve_one_after_the_other(const CountingSolver &by, const EquationsOfMotion &equations,
                                   const EigensolverOptions &options, const Sectors &sectors,
                                   EigenSolution &whole)
    {
      const std::vector<double> counted = by.frequencies(options, equations.may_move_rigidly);
      bool can_reuse                    = true;
      for (const Sector &sector : sectors.all(equations.rows))
      {
        auto half = std::make_shared<EigenSolution>(
            by.solver->solve(sector.parity_space().restrict(equations, counted), options));
        append(sector, *half, false, whole);
        can_reuse &= !half->reuse.empty();
        if (options.keep_factors)
          whole.reuse.sectors.push_back(half);
        half.reset();
        return_freed_memory();
      }
      if (!can_reuse)
        whole.reuse = {};
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
    void solve_at_once(const CountingSolver &by, const EquationsOfMotion &equations,
                       const EigensolverOptions &options, const Sectors &sectors,
                       const unsigned int n_ranks, EigenSolution &whole)
    {
      const MPI_Comm all = equations.rows.comm;
      // The antisymmetric modes, in which the disc bends, are more.
      const std::array<unsigned int, 2> first         = {{0, n_ranks / 2}};
      const std::vector<Sector> both                  = sectors.all(equations.rows, true, first[1]);
      const std::array<const ParitySpace *, 2> spaces = {
          {&both[0].parity_space(), &both[1].parity_space()}};
      std::array<EigenSolution, 2> halves;
      // So the ranks of the symmetric half count for both, where counting needs nothing else.
      const bool counts_for_both =
          by.counts_in_disc(options) && !equations.may_move_rigidly &&
          equations.reference == EquationsOfMotion::Reference::conservative_terms &&
          !equations.of_order(1).empty();
      const Subcommunicator of_first(all, first[0], first[1]);
      const ParitySpace antisymmetric(sectors.mirror(), false, of_first);
      ParitySpace::Counting counting{
          search_radius(options.max_imaginary), {spaces[0], &antisymmetric}, {}};
      std::vector<QuadraticEigenproblem> problems = ParitySpace::restrict(
          {spaces[0], spaces[1]}, equations, counts_for_both ? &counting : nullptr);
      const auto solve = [&](const unsigned int h, const Counting &counted)
      {
        if (spaces[h]->is_here())
          halves[h] = by.solver->solve(problems[h], options, counted);
      };
      const auto count_and_solve = [&]()
      {
        NumberForOthers n_antisymmetric(all, first[1]);
        solve(1, [&]() { return n_antisymmetric.receive(); });
        if (!spaces[0]->is_here())
          return;
        Stopwatch watch;
        const auto n_reference_of = [&](const unsigned int h)
        { return count_reference_modes(problems[h], std::exchange(counting.shifted[h], {})); };
        n_antisymmetric.send(n_reference_of(1));
        const unsigned int n_symmetric = n_reference_of(0);
        const double seconds           = watch.lap();
        solve(0, [n_symmetric]() { return n_symmetric; });
        halves[0].cost.seconds.counting += seconds;
      };
      work_apart(all,
                 [&]()
                 {
                   if (counts_for_both)
                     count_and_solve();
                   else
                     for (const unsigned int h : {0u, 1u})
                       solve(h, {});
                 });
      for (unsigned int h = 0; h < 2; ++h)
      {
        share(both[h], first[h], all, halves[h]);
        append(both[h], halves[h], true, whole);
      }
      // Blocks and matrices of a group go before its communicator.
      problems.clear();
      halves = {};
      return_freed_memory();
    }
    EigenSolution solve_by_sectors(const CountingSolver &by, const EquationsOfMotion &equations,
                                   const EigensolverOptions &options, const Sectors &sectors)
    {
      if (!sectors.keep(equations))
        return by.solver->solve(sum_of(equations), options);
      EigenSolution whole;
      EigenPairs &modes = whole.modes;
      modes.right = modes.left = ComplexMultiVector(equations.rows, 0);
      int n_ranks              = 0;
      MPI_Comm_size(equations.rows.comm, &n_ranks);
      // Factors that are kept must be on all ranks.
      if (n_ranks > 1 && !options.keep_factors)
        solve_at_once(by, equations, options, sectors, n_ranks, whole);
      else
        solve_one_after_the_other(by, equations, options, sectors, whole);
      modes = modes.select(order_of_modes(modes.lambda));
      turn_to_real(modes);
      return whole;
    }
  } // namespace

  EigenSolution find_modes(const ModeSolver solver, const EquationsOfMotion &equations,
                           const EigensolverOptions &options, const Sectors &sectors)
  {
    CountingSolver by{make_eigensolver(solver), solver};
    if (equations.relaxation.empty())
      return solve_by_sectors(by, equations, options, sectors);
    by.solver = std::make_unique<NonlinearEigensolver>(std::move(by.solver));
    return solve_by_sectors(by, equations.frozen(options.max_imaginary), options, sectors);
  }
} // namespace squeal
