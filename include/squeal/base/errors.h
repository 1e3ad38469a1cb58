#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  /// The input is wrong: exit status 2. The message says what, where, and what is allowed.
  struct InputError : std::runtime_error
  {
    using std::runtime_error::runtime_error;
  };

  /// What kind of failure a solver reports. The driver knows the keys that help (run/advice.h).
  enum class Failure
  {
    singular_matrix,
    singular_factors,
    numbers_too_large,
    factors_too_large,
    memory_predicted,
    pairs_not_refined,
    multigrid_indefinite,
    davidson_too_large,
    davidson_stalled,
    degree_too_low,
    pep_stalled,
    window_too_wide,
    krylov_space_full,
    modes_missing,
    modes_may_come_in,
    modes_inaccurate,
    left_vectors_missing,
    interval_stalled,
    interval_left_vectors_missing,
    too_large_for_dense,
    dense_inaccurate,
    contact_lost,
    gmres_stalled,
    iterative_statics_failed
  };

  /// The input makes a steady state in which friction has nothing to act on: no run can go on from
  /// it, a study leaves the value out.
  struct NoLoad : InputError
  {
    using InputError::InputError;
  };

  /// A solver failed: exit status 3. The message says which and how far it came.
  struct SolverError : std::runtime_error
  {
    explicit SolverError(const std::string &message, std::vector<Failure> kinds = {})
        : std::runtime_error(message), kinds(std::move(kinds))
    {
    }
    std::vector<Failure> kinds;
  };

  /// A matrix that had to be factorised is singular.
  struct SingularMatrix : SolverError
  {
    using SolverError::SolverError;
  };

  /// A signal, named by the message, ended the run: exit status 1.
  struct Interrupted : std::runtime_error
  {
    using std::runtime_error::runtime_error;
  };

  /// Exit statuses of the program; the names users' scripts rely on.
  enum ExitStatus : int
  {
    exit_finished     = 0,
    exit_other        = 1,
    exit_bad_input    = 2,
    exit_solver_error = 3
  };
} // namespace squeal
