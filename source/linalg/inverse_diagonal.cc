#include <squeal/base/errors.h>
#include <squeal/linalg/inverse_diagonal.h>

#include <petscsys.h>

#include <petscblaslapack.h>

// PETSc does not declare it.
extern "C"
{
  void dtrtri_(const char *uplo, const char *diag, const PetscBLASInt *n, double *a,
               const PetscBLASInt *lda, PetscBLASInt *info);
}

namespace squeal
{
  std::vector<double> inverse_diagonal(DenseMatrix a)
  {
    const PetscBLASInt n = a.n_rows;
    std::vector<double> result(n);
    if (n == 0)
      return result;
    PetscBLASInt info = 0;
    LAPACKpotrf_("U", &n, a.values.data(), &n, &info);
    if (info == 0)
      dtrtri_("U", "N", &n, a.values.data(), &n, &info);
    if (info != 0)
      throw SolverError("LAPACK: a symmetric matrix is not positive definite (row " +
                        std::to_string(info) + " of " + std::to_string(n) + ").");
    // A = U^T U: (A^{-1})_ii = sum_j (U^{-1})_ij^2, j >= i
    for (PetscBLASInt j = 0; j < n; ++j)
      for (PetscBLASInt i = 0; i <= j; ++i)
        result[i] += a(i, j) * a(i, j);
    return result;
  }
} // namespace squeal
