#include <squeal/base/errors.h>
#include <squeal/base/subcommunicator.h>

#include <algorithm>
#include <new>
#include <string>

namespace squeal
{
  Subcommunicator::Subcommunicator(const MPI_Comm all, const unsigned int first,
                                   const unsigned int n)
      : n(n)
  {
    int rank = 0;
    MPI_Comm_rank(all, &rank);
    const bool is_member = first <= unsigned(rank) && unsigned(rank) < first + n;
    rank_                = unsigned(rank) < first ? 0 : std::min(rank - first, n);
    MPI_Comm_split(all, is_member ? 0 : MPI_UNDEFINED, rank, &comm_);
  }

  Subcommunicator::~Subcommunicator()
  {
    int is_over = 0;
    MPI_Finalized(&is_over);
    if (comm_ != MPI_COMM_NULL && !is_over)
      MPI_Comm_free(&comm_);
  }

  void work_apart(const MPI_Comm all, const std::function<void()> &work)
  {
    enum Outcome : int
    {
      done,
      interrupted,
      wrong_input,
      singular,
      solver_failed,
      without_memory,
      failed
    };
    int outcome = done;
    std::string message;
    std::vector<Failure> kinds;
    const auto note = [&](const Outcome how, const std::exception &error)
    {
      outcome = how;
      message = error.what();
    };
    try
    {
      work();
    }
    catch (const Interrupted &error)
    {
      note(interrupted, error);
    }
    catch (const InputError &error)
    {
      note(wrong_input, error);
    }
    catch (const SingularMatrix &error)
    {
      note(singular, error);
      kinds = error.kinds;
    }
    catch (const SolverError &error)
    {
      note(solver_failed, error);
      kinds = error.kinds;
    }
    catch (const std::bad_alloc &error)
    {
      note(without_memory, error);
    }
    catch (const std::exception &error)
    {
      note(failed, error);
    }

    int rank = 0, n_ranks = 0;
    MPI_Comm_rank(all, &rank);
    MPI_Comm_size(all, &n_ranks);
    int first = outcome == done ? n_ranks : rank;
    MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, all);
    if (first == n_ranks)
      return;
    MPI_Bcast(&outcome, 1, MPI_INT, first, all);
    const auto broadcast = [&](auto &list)
    {
      unsigned int length = list.size();
      MPI_Bcast(&length, 1, MPI_UNSIGNED, first, all);
      list.resize(length);
      MPI_Bcast(list.data(), length * sizeof(list[0]), MPI_BYTE, first, all);
    };
    broadcast(message);
    broadcast(kinds);
    switch (outcome)
    {
    case interrupted:
      throw Interrupted(message);
    case wrong_input:
      throw InputError(message);
    case singular:
      throw SingularMatrix(message, kinds);
    case solver_failed:
      throw SolverError(message, kinds);
    case without_memory:
      throw std::bad_alloc();
    default:
      throw std::runtime_error(message);
    }
  }
} // namespace squeal
