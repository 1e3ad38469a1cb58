#include <squeal/linalg/gmres.h>
#include <squeal/linalg/petsc_vector_view.h>

#include <petscksp.h>

#include <algorithm>

namespace squeal
{
  namespace
  {
    /// What PETSc's shell objects call back to.
    struct Shell
    {
      const LinearOperator &apply;
      RowRange rows;
    };

    PetscErrorCode apply(const Shell &shell, Vec in, Vec out)
    {
      MultiVector x(shell.rows, 1);
      const PetscScalar *from = nullptr;
      PetscCall(VecGetArrayRead(in, &from));
      std::copy_n(from, x.n_local(), x.data());
      PetscCall(VecRestoreArrayRead(in, &from));
      const MultiVector y = shell.apply(x);
      PetscScalar *to     = nullptr;
      PetscCall(VecGetArrayWrite(out, &to));
      std::copy_n(y.data(), y.n_local(), to);
      PetscCall(VecRestoreArrayWrite(out, &to));
      return 0;
    }

    PetscErrorCode apply_matrix(Mat mat, Vec in, Vec out)
    {
      Shell *shell = nullptr;
      PetscCall(MatShellGetContext(mat, &shell));
      return apply(*shell, in, out);
    }

    PetscErrorCode apply_preconditioner(PC pc, Vec in, Vec out)
    {
      Shell *shell = nullptr;
      PetscCall(PCShellGetContext(pc, &shell));
      return apply(*shell, in, out);
    }

    struct Solver
    {
      explicit Solver(const MPI_Comm comm)
      {
        SQUEAL_PETSC(KSPCreate(comm, &ksp));
      }
      ~Solver()
      {
        KSPDestroy(&ksp);
      }
      Solver(const Solver &)            = delete;
      Solver &operator=(const Solver &) = delete;
      KSP ksp                           = nullptr;
    };
  } // namespace

  std::optional<unsigned int> gmres(const LinearOperator &A, const LinearOperator &B,
                                    const MultiVector &b, MultiVector &x, const double tolerance,
                                    const unsigned int max_iterations)
  {
    const RowRange &rows = b.row_range();
    Shell of_matrix{A, rows}, of_preconditioner{B, rows};
    Mat raw = nullptr;
    SQUEAL_PETSC(MatCreateShell(rows.comm, rows.n_local(), rows.n_local(), rows.size, rows.size,
                                &of_matrix, &raw));
    const Matrix matrix(raw);
    SQUEAL_PETSC(MatShellSetOperation(raw, MATOP_MULT, reinterpret_cast<void (*)()>(apply_matrix)));
    const Solver solver(rows.comm);
    KSP ksp = solver.ksp;
    PC pc   = nullptr;
    SQUEAL_PETSC(KSPSetOperators(ksp, raw, raw));
    SQUEAL_PETSC(KSPSetType(ksp, KSPGMRES));
    SQUEAL_PETSC(KSPGMRESSetRestart(ksp, max_iterations));
    SQUEAL_PETSC(KSPGMRESSetCGSRefinementType(ksp, KSP_GMRES_CGS_REFINE_IFNEEDED));
    SQUEAL_PETSC(KSPSetPCSide(ksp, PC_LEFT));
    SQUEAL_PETSC(KSPGetPC(ksp, &pc));
    SQUEAL_PETSC(PCSetType(pc, PCSHELL));
    SQUEAL_PETSC(PCShellSetContext(pc, &of_preconditioner));
    SQUEAL_PETSC(PCShellSetApply(pc, apply_preconditioner));
    SQUEAL_PETSC(KSPSetInitialGuessNonzero(ksp, PETSC_TRUE));
    SQUEAL_PETSC(KSPSetTolerances(ksp, tolerance, 0, PETSC_DEFAULT, max_iterations));
    MultiVector right = b;
    const PetscVectorView right_hand_side(rows, right.data()), solution(rows, x.data());
    SQUEAL_PETSC(KSPSolve(ksp, right_hand_side, solution));
    KSPConvergedReason reason;
    PetscInt n_iterations = 0;
    SQUEAL_PETSC(KSPGetConvergedReason(ksp, &reason));
    SQUEAL_PETSC(KSPGetIterationNumber(ksp, &n_iterations));
    if (reason <= 0)
      return std::nullopt;
    return n_iterations;
  }
} // namespace squeal
