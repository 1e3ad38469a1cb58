#pragma once

#include <squeal/linalg/dense.h>

#include <complex>
#include <vector>

namespace squeal
{
  /// A small dense complex matrix, column-major.
  struct ComplexDense
  {
    unsigned int n_rows = 0, n_columns = 0;
    std::vector<std::complex<double>> values;

    ComplexDense() = default;
    ComplexDense(const unsigned int m, const unsigned int n)
        : n_rows(m), n_columns(n), values(std::size_t(m) * n)
    {
    }
    std::complex<double> &operator()(const unsigned int i, const unsigned int j)
    {
      return values[i + std::size_t(j) * n_rows];
    }
    const std::complex<double> &operator()(const unsigned int i, const unsigned int j) const
    {
      return values[i + std::size_t(j) * n_rows];
    }
  };

  /// A B, or A^H B.
  ComplexDense product(const ComplexDense &a, const ComplexDense &b, bool adjoint = false);

  /// An LU factorisation with partial pivoting. A pivot that is zero becomes rounding: for inverse
  /// iteration, which wants the matrix to be singular.
  class ComplexFactors
  {
  public:
    explicit ComplexFactors(ComplexDense a);
    /// A^{-1} B, or A^{-H} B.
    ComplexDense solve(ComplexDense b, bool adjoint = false) const;

  private:
    ComplexDense factors;
    std::vector<int> pivots;
  };

  /// Eigenvalues and right vectors of a complex matrix, LAPACK zgeev.
  struct ComplexEigenpairs
  {
    std::vector<std::complex<double>> values;
    ComplexDense right, left; ///< A x = theta x, u^H A = theta u^H
  };
  ComplexEigenpairs general_eigen(ComplexDense a);
} // namespace squeal
