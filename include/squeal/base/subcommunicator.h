#pragma once

#include <mpi.h>

#include <functional>

namespace squeal
{
  /// Consecutive ranks of all, which do a part of the work by themselves.
  class Subcommunicator
  {
  public:
    /// Ranks first, ..., first + n - 1 of all. Collective.
    Subcommunicator(MPI_Comm all, unsigned int first, unsigned int n);
    ~Subcommunicator();
    Subcommunicator(const Subcommunicator &)            = delete;
    Subcommunicator &operator=(const Subcommunicator &) = delete;

    /// MPI_COMM_NULL on other ranks.
    MPI_Comm comm() const
    {
      return comm_;
    }
    bool has_this_rank() const
    {
      return comm_ != MPI_COMM_NULL;
    }
    /// The place of this rank in the group; on ranks that are not in it, one past the last for
    /// later ones and 0 for earlier ones.
    unsigned int rank() const
    {
      return rank_;
    }
    unsigned int n_ranks() const
    {
      return n;
    }

  private:
    MPI_Comm comm_ = MPI_COMM_NULL;
    unsigned int n, rank_ = 0;
  };

  /// Does what each rank has to do; groups that work apart may only wait for what others send in
  /// any case. If that fails on some ranks, all throw the error of the first of them. Collective.
  void work_apart(MPI_Comm all, const std::function<void()> &work);
} // namespace squeal
