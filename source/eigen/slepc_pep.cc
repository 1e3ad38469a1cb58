#include <squeal/eigen/slepc_pep.h>

#include <slepcpep.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Lets PEP's linear solver use a factorisation that exists already.
    PetscErrorCode apply_factorization(PC pc, Vec x, Vec y)
    {
      void *context = nullptr;
      PetscCall(PCShellGetContext(pc, &context));
      PetscCall(MatSolve(static_cast<const Factorization *>(context)->factor(), x, y));
      return 0;
    }

    PetscErrorCode monitor(PEP, PetscInt, PetscInt n_converged, PetscScalar *, PetscScalar *,
                           PetscReal *, PetscInt n, void *context)
    {
      const auto &progress =
          *static_cast<const std::function<void(const std::string &)> *>(context);
      progress("  krylov: " + std::to_string(n_converged) + " eigenvalues converged, subspace of " +
               std::to_string(n));
      return 0;
    }

    /// A_0, A_1, A_2 with l = shift + scale m: m^2 scale^2 M + m scale (P + 2 shift M) + Q(shift).
    /// A_0 is empty without a shift: it is Q then.
    std::array<Matrix, 3> shifted_matrices(const QuadraticEigenproblem &problem, const double shift,
                                           const double scale)
    {
      const RowRange &rows = problem.rows;
      std::array<Matrix, 3> a;
      if (shift != 0)
        a[0] = sum_of(rows, {{1., problem.Q}, {shift, problem.P}, {shift * shift, problem.M}});
      a[1] = sum_of(rows, {{scale, problem.P}, {2 * shift * scale, problem.M}});
      a[2] = sum_of(rows, {{scale * scale, problem.M}});
      if (!a[1]) // PEP wants a matrix
      {
        const std::vector<PetscInt> nothing(rows.n_local(), 0);
        a[1] = make_matrix(rows, nothing, nothing);
        compress(a[1]);
      }
      return a;
    }

    /// Asks for the eigenvalues nearest to zero.
    void set_up_search(const PEP pep, const unsigned int n_wanted,
                       const EigensolverOptions &options)
    {
      SQUEAL_PETSC(PEPSetProblemType(pep, PEP_GENERAL));
      SQUEAL_PETSC(PEPSetType(pep, PEPTOAR));
      SQUEAL_PETSC(PEPSetTarget(pep, 0.));
      SQUEAL_PETSC(PEPSetWhichEigenpairs(pep, PEP_TARGET_MAGNITUDE));
      SQUEAL_PETSC(PEPSetTolerances(pep, 1e-9, 1000));
      SQUEAL_PETSC(PEPSetConvergenceTest(pep, PEP_CONV_REL));
      SQUEAL_PETSC(PEPSetDimensions(pep, n_wanted, PETSC_DEFAULT, PETSC_DEFAULT));
      SQUEAL_PETSC(PEPMonitorSet(
          pep, monitor, const_cast<std::function<void(const std::string &)> *>(&options.progress),
          nullptr));
    }

    /// Lets PEP invert by known factors of A_0.
    void set_up_inverse(const PEP pep, const Factorization &factorization)
    {
      ST st   = nullptr;
      KSP ksp = nullptr;
      PC pc   = nullptr;
      SQUEAL_PETSC(PEPGetST(pep, &st));
      SQUEAL_PETSC(STSetType(st, STSINVERT));
      SQUEAL_PETSC(STSetTransform(st, PETSC_TRUE));
      SQUEAL_PETSC(STGetKSP(st, &ksp));
      SQUEAL_PETSC(KSPSetType(ksp, KSPPREONLY));
      SQUEAL_PETSC(KSPGetPC(ksp, &pc));
      SQUEAL_PETSC(PCSetType(pc, PCSHELL));
      SQUEAL_PETSC(PCShellSetContext(pc, const_cast<Factorization *>(&factorization)));
      SQUEAL_PETSC(PCShellSetApply(pc, apply_factorization));
    }

    /// Fixes the start vector, which does not depend on the number of ranks then: two runs give the
    /// same digits.
    void set_start_vector(const PEP pep, const unsigned int seed)
    {
      BV bv              = nullptr;
      PetscRandom random = nullptr;
      SQUEAL_PETSC(PEPGetBV(pep, &bv));
      SQUEAL_PETSC(BVGetRandomContext(bv, &random));
      SQUEAL_PETSC(PetscRandomSetSeed(random, 0x5eed + seed));
      SQUEAL_PETSC(PetscRandomSeed(random));
    }

    /// Returns how many eigenvalues have converged.
    PetscInt solve(const PEP pep, const unsigned int n_wanted)
    {
      SQUEAL_PETSC(PEPSolve(pep));
      PetscInt n_converged = 0, n_iterations = 0;
      PEPConvergedReason reason;
      SQUEAL_PETSC(PEPGetConverged(pep, &n_converged));
      SQUEAL_PETSC(PEPGetIterationNumber(pep, &n_iterations));
      SQUEAL_PETSC(PEPGetConvergedReason(pep, &reason));
      if (reason < 0)
        throw SolverError("SLEPc's PEP (TOAR) stopped after " + std::to_string(n_iterations) +
                              " restarts with " + std::to_string(n_converged) + " of " +
                              std::to_string(n_wanted) + " eigenvalues (reason " +
                              std::to_string(reason) + ").",
                          {Failure::pep_stalled});
      return n_converged;
    }

    void copy(const Vec vector, MultiVector &to)
    {
      const PetscScalar *values = nullptr;
      SQUEAL_PETSC(VecGetArrayRead(vector, &values));
      std::copy_n(values, to.n_local(), to.data());
      SQUEAL_PETSC(VecRestoreArrayRead(vector, &values));
    }

    /// At least n_wanted eigenvalues, the nearest to the shift: every one nearer than @p reached.
    EigenPairs search(const QuadraticEigenproblem &problem, const Factorization &factorization,
                      const double shift, const double scale, const unsigned int n_wanted,
                      const unsigned int seed, const EigensolverOptions &options, double &reached)
    {
      const RowRange &rows          = problem.rows;
      const std::array<Matrix, 3> a = shifted_matrices(problem, shift, scale);
      PEP pep                       = nullptr;
      SQUEAL_PETSC(PEPCreate(rows.comm, &pep));
      const std::unique_ptr<_p_PEP, void (*)(PEP)> owner(pep, [](PEP p) { PEPDestroy(&p); });
      std::array<Mat, 3> matrices = {{shift == 0 ? problem.Q : a[0], a[1], a[2]}};
      SQUEAL_PETSC(PEPSetOperators(pep, 3, matrices.data()));
      set_up_search(pep, n_wanted, options);
      set_up_inverse(pep, factorization);
      // PETSC_OPTIONS="-pep_type linear" and the like, for comparisons.
      SQUEAL_PETSC(PEPSetFromOptions(pep));
      set_start_vector(pep, seed);
      const PetscInt n_converged = solve(pep, n_wanted);

      EigenPairs result;
      result.right = ComplexMultiVector(rows, 0);
      reached      = 0;
      Vec re = nullptr, im = nullptr;
      SQUEAL_PETSC(MatCreateVecs(matrices[0], &re, nullptr));
      SQUEAL_PETSC(VecDuplicate(re, &im));
      for (PetscInt j = 0; j < n_converged; ++j)
      {
        PetscScalar value_re = 0, value_im = 0;
        SQUEAL_PETSC(PEPGetEigenpair(pep, j, &value_re, &value_im, re, im));
        reached = std::max(reached, scale * std::hypot(value_re, value_im));
        if (value_im < 0)
          continue; // the conjugate spans the same real subspace
        result.lambda.emplace_back(shift + scale * value_re, scale * value_im);
        ComplexMultiVector column(rows, 1);
        copy(re, column.re);
        if (value_im != 0)
          copy(im, column.im);
        result.right.append(column);
      }
      SQUEAL_PETSC(VecDestroy(&re));
      SQUEAL_PETSC(VecDestroy(&im));
      return result;
    }
  } // namespace

  EigenPairs pep_search(const QuadraticEigenproblem &problem, const Factorization &factorization,
                        const double shift, const double reach, unsigned int n_wanted,
                        const unsigned int seed, const EigensolverOptions &options)
  {
    // Modes come nearest first, so all of the disc are found once one outside of it is.
    const unsigned int n_all = 2 * (problem.rows.size - problem.n_constraints);
    n_wanted                 = std::min(n_wanted, n_all);
    for (unsigned int attempt = 0; attempt <= 8; ++attempt)
    {
      double reached   = 0;
      EigenPairs found = search(problem, factorization, shift, options.max_imaginary, n_wanted,
                                seed, options, reached);
      if (reached > reach || n_wanted >= n_all)
        return found;
      n_wanted = std::min(n_all, n_wanted + n_wanted / 2 + 8);
    }
    throw SolverError("The Krylov search did not reach the end of the window after " +
                          std::to_string(n_wanted) + " eigenvalues.",
                      {Failure::window_too_wide});
  }
} // namespace squeal
