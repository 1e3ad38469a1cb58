#include <squeal/run/advice.h>

namespace squeal
{
  namespace
  {
    const char *advice(const Failure kind)
    {
      switch (kind)
      {
      case Failure::singular_matrix:
        return " If a body is free to move, set Eigenproblem/Shift, for example to 0.1.";
      case Failure::singular_factors:
        return ": if a body is free to move, set Eigenproblem/Shift, for example to 0.1.";
      case Failure::numbers_too_large:
        return " Check the orders of magnitude of lengths, materials, matrices, Operation/Angular "
               "velocity and Eigenproblem/Maximum frequency.";
      case Failure::factors_too_large:
        return " Use a coarser mesh, a lower degree, or more machines; Refinement/Maximum memory "
               "ends a refinement in time. The static equilibrium alone needs no factors: Static "
               "equilibrium/Linear solver = iterative, Eigenproblem/Solver = none.";
      case Failure::memory_predicted:
        return " What is expected is a fit; where it is known to be too much, "
               "Refinement/Check memory = false begins all the same.";
      case Failure::pairs_not_refined:
        return " Try a larger Eigenproblem/Tolerance, or the solver dense for a small problem.";
      case Failure::multigrid_indefinite:
        return " Try another Static equilibrium/Multigrid, or Eigenproblem/Solver = block_krylov.";
      case Failure::davidson_too_large:
        return " Try a smaller Eigenproblem/Maximum frequency, or more machines.";
      case Failure::davidson_stalled:
        return " Try another Static equilibrium/Multigrid, cells that are less long, or "
               "Eigenproblem/Solver = block_krylov where its factors fit.";
      case Failure::degree_too_low:
        return " Try a finer mesh, or Eigenproblem/Solver = block_krylov.";
      case Failure::pep_stalled:
        return " Try a smaller Eigenproblem/Maximum frequency, or another Eigenproblem/Shift.";
      case Failure::window_too_wide:
        return " Try a smaller Eigenproblem/Maximum frequency.";
      case Failure::krylov_space_full:
        return " Try a smaller Eigenproblem/Maximum frequency, or another Eigenproblem/Solver.";
      case Failure::modes_missing:
        return " Try a smaller Eigenproblem/Tolerance, or Eigenproblem/Solver = dense for a small "
               "problem.";
      case Failure::modes_may_come_in:
        return " Set a larger Eigenproblem/Maximum frequency.";
      case Failure::modes_inaccurate:
        return " Try a larger Eigenproblem/Tolerance, or Eigenproblem/Solver = krylov.";
      case Failure::left_vectors_missing:
        return " Try another Eigenproblem/Maximum frequency.";
      case Failure::interval_stalled:
        return " Try a narrower window (Eigenproblem/Minimum frequency), a larger "
               "Eigenproblem/Tolerance, or Eigenproblem/Solver = krylov.";
      case Failure::interval_left_vectors_missing:
        return " Try Eigenproblem/Solver = krylov.";
      case Failure::too_large_for_dense:
        return " Use Eigenproblem/Solver = block_krylov.";
      case Failure::dense_inaccurate:
        return " Try a larger Eigenproblem/Tolerance.";
      case Failure::contact_lost:
        return " Check Pads/Pressure and Contact/Initial gap.";
      case Failure::gmres_stalled:
        return " (Static equilibrium/Maximum iterations).";
      case Failure::iterative_statics_failed:
        return " Static equilibrium/Linear solver = direct tells more, for example whether "
               "friction is self-locking, where its factors fit; on a coarse mesh they do.";
      }
      return "";
    }
  } // namespace

  std::string advice(const SolverError &error)
  {
    std::string text;
    for (const Failure kind : error.kinds)
      text += advice(kind);
    return text;
  }
} // namespace squeal
