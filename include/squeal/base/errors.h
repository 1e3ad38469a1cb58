#pragma once

#include <stdexcept>
#include <string>

namespace squeal
{
  /// The input is wrong: exit status 2. The message says what, where, and what is allowed.
  struct InputError : std::runtime_error
  {
    using std::runtime_error::runtime_error;
  };

  /// A solver failed: exit status 3. The message says which, how far it came, and what to try.
  struct SolverError : std::runtime_error
  {
    using std::runtime_error::runtime_error;
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
