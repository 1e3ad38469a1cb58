#include <squeal/base/errors.h>
#include <squeal/linalg/complex_dense.h>

#include <algorithm>
#include <cmath>
#include <limits>

// PETSc's header declares LAPACK's real functions only.
extern "C"
{
  void zgemm_(const char *, const char *, const int *, const int *, const int *,
              const std::complex<double> *, const std::complex<double> *, const int *,
              const std::complex<double> *, const int *, const std::complex<double> *,
              std::complex<double> *, const int *);
  void zgetrf_(const int *, const int *, std::complex<double> *, const int *, int *, int *);
  void zgetrs_(const char *, const int *, const int *, const std::complex<double> *, const int *,
               const int *, std::complex<double> *, const int *, int *);
  void zgeev_(const char *, const char *, const int *, std::complex<double> *, const int *,
              std::complex<double> *, std::complex<double> *, const int *, std::complex<double> *,
              const int *, std::complex<double> *, const int *, double *, int *);
}

namespace squeal
{
  using Complex = std::complex<double>;

  ComplexDense product(const ComplexDense &a, const ComplexDense &b, const bool adjoint)
  {
    const int m = adjoint ? a.n_columns : a.n_rows, n = b.n_columns, k = b.n_rows,
              lda = std::max(1u, a.n_rows), ldb = std::max(1, k), ldc = std::max(1, m);
    ComplexDense c(m, n);
    const Complex one = 1, zero = 0;
    if (m > 0 && n > 0 && k > 0)
      zgemm_(adjoint ? "C" : "N", "N", &m, &n, &k, &one, a.values.data(), &lda, b.values.data(),
             &ldb, &zero, c.values.data(), &ldc);
    return c;
  }

  ComplexFactors::ComplexFactors(ComplexDense a) : factors(std::move(a)), pivots(factors.n_rows)
  {
    double square = 0; // of the largest entry
    for (const Complex &value : factors.values)
      square = std::max(square, std::norm(value));
    const int n = factors.n_rows;
    int info    = 0;
    zgetrf_(&n, &n, factors.values.data(), &n, pivots.data(), &info);
    for (int i = 0; i < n; ++i)
      if (factors(i, i) == 0.)
        factors(i, i) = std::numeric_limits<double>::epsilon() * std::sqrt(square);
  }

  ComplexDense ComplexFactors::solve(ComplexDense b, const bool adjoint) const
  {
    const int n = factors.n_rows, n_rhs = b.n_columns;
    int info = 0;
    if (n > 0 && n_rhs > 0)
      zgetrs_(adjoint ? "C" : "N", &n, &n_rhs, factors.values.data(), &n, pivots.data(),
              b.values.data(), &n, &info);
    return b;
  }

  ComplexEigenpairs general_eigen(ComplexDense a)
  {
    const int n = a.n_rows, n_work = std::max(1, 4 * n);
    ComplexEigenpairs result;
    result.values.resize(n);
    result.right = ComplexDense(n, n);
    result.left  = ComplexDense(n, n);
    std::vector<Complex> work(n_work);
    std::vector<double> real_work(std::max(1, 2 * n));
    int info = 0;
    if (n > 0)
      zgeev_("V", "V", &n, a.values.data(), &n, result.values.data(), result.left.values.data(), &n,
             result.right.values.data(), &n, work.data(), &n_work, real_work.data(), &info);
    if (info != 0)
      throw SolverError("LAPACK's zgeev failed with info = " + std::to_string(info) + ".");
    return result;
  }
} // namespace squeal
