#pragma once

#include <complex>
#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  /// A small dense matrix, column-major.
  struct DenseMatrix
  {
    unsigned int n_rows = 0, n_columns = 0;
    std::vector<double> values;

    DenseMatrix() = default;
    DenseMatrix(const unsigned int m, const unsigned int n)
        : n_rows(m), n_columns(n), values(std::size_t(m) * n)
    {
    }
    DenseMatrix(const unsigned int m, const unsigned int n, std::vector<double> v)
        : n_rows(m), n_columns(n), values(std::move(v))
    {
    }

    double &operator()(const unsigned int i, const unsigned int j)
    {
      return values[i + std::size_t(j) * n_rows];
    }
    double operator()(const unsigned int i, const unsigned int j) const
    {
      return values[i + std::size_t(j) * n_rows];
    }
  };

  /// C := alpha A B + beta C (with A transposed on demand). A has n_rows x n_columns; columns lie
  /// together, n of them in B and C. A single column or row by BLAS 2: gemm would first copy all of
  /// the matrix.
  void gemm(bool transpose_a, unsigned int n_rows, unsigned int n_columns, double alpha,
            const double *a, unsigned int n, const double *b, double beta, double *c);
  /// The same of matrices. C must have its size.
  void gemm(bool transpose_a, double alpha, const DenseMatrix &a, const DenseMatrix &b, double beta,
            DenseMatrix &c);

  /// y += factor x, of n numbers.
  void add_multiple(double factor, const double *x, unsigned int n, double *y);

  /// A B^T.
  DenseMatrix outer_product(const DenseMatrix &a, const DenseMatrix &b);

  /// B^T A B.
  DenseMatrix congruent(const DenseMatrix &a, const DenseMatrix &b);

  /// A^T.
  DenseMatrix transposed(const DenseMatrix &a);

  /// The first rows of A, with zeros below if it has fewer.
  DenseMatrix with_rows(const DenseMatrix &a, unsigned int n_rows);

  /// Rows first ... first + n of A.
  DenseMatrix some_rows(const DenseMatrix &a, unsigned int first, unsigned int n);
  /// Columns first ... first + n of A.
  DenseMatrix some_columns(const DenseMatrix &a, unsigned int first, unsigned int n);
  /// A becomes [A, B].
  void append(DenseMatrix &a, const DenseMatrix &b);

  /// sum += factor A; an empty matrix is zero.
  void add(double factor, const DenseMatrix &a, DenseMatrix &sum);

  /// (A + A^T) / 2.
  DenseMatrix symmetrised(DenseMatrix a);

  /// A square matrix of which the first rows and columns are known; @p block gives rows and columns
  /// (first, number) of it.
  template <typename Function>
  DenseMatrix grow(const DenseMatrix &known, const unsigned int size, const Function &block)
  {
    const unsigned int old = known.n_rows;
    DenseMatrix result(size, size);
    const DenseMatrix right = block(0, size, old, size - old),
                      lower = block(old, size - old, 0, old);
    for (unsigned int j = 0; j < size; ++j)
      for (unsigned int i = 0; i < size; ++i)
        result(i, j) = j >= old ? right(i, j - old) : i >= old ? lower(i - old, j) : known(i, j);
    return result;
  }

  /// A^{-1} B by LU with partial pivoting. Throws SolverError if A is singular.
  DenseMatrix solve(DenseMatrix a, DenseMatrix b);

  /// The inverse of A on the directions whose singular values are more than @p smallest times the
  /// largest, zero on the others. LAPACK dgesvd. Throws SolverError.
  DenseMatrix pseudo_inverse(DenseMatrix a, double smallest);

  /// A symmetric positive definite A, factorised once by Cholesky's method for many right sides.
  class PositiveFactors
  {
  public:
    PositiveFactors() = default;
    /// Throws SolverError if A is singular to working precision.
    explicit PositiveFactors(DenseMatrix a, const std::string &what = "a symmetric matrix");
    /// A^{-1} B.
    DenseMatrix solve(DenseMatrix b) const;

  private:
    DenseMatrix factors;
  };
  inline DenseMatrix solve_positive(DenseMatrix a, DenseMatrix b)
  {
    return PositiveFactors(std::move(a)).solve(std::move(b));
  }

  /// Eigenvalues (ascending) and eigenvectors of a symmetric matrix; @p a is overwritten by the
  /// vectors.
  std::vector<double> symmetric_eigen(DenseMatrix &a);

  /// Combinations of columns, whose @p products are given, that are orthonormal: the principal
  /// components longer than @p smallest, scaled to length one, as columns of coefficients.
  DenseMatrix principal_combinations(DenseMatrix products, double smallest);

  /// Of remainders of columns (their parts along others were taken off) the combinations that are
  /// orthonormal, as columns of coefficients. @p products are those of the remainders, @p before
  /// those of the columns: left out are remainders shorter than @p shortest, relatively, and
  /// combinations of remainders of unit length that are shorter than @p dependent.
  DenseMatrix independent_combinations(DenseMatrix products, const DenseMatrix &before,
                                       double shortest, double dependent);

  struct DenseEigenpairs
  {
    std::vector<double> re, im;
    DenseMatrix vectors; ///< LAPACK's packing: a complex pair as two columns, Re and Im
    DenseMatrix left;    ///< u^H A = theta u^H, packed alike; on demand
    /// To first order what rounding makes of each eigenvalue, eps |A| / |u^H v| with unit vectors
    /// and the norm of the balanced matrix; on demand, with the left vectors.
    std::vector<double> rounding;

    /// The right vector of the eigenvalue j, the first one of a complex pair.
    std::vector<std::complex<double>> vector(unsigned int j) const;
  };

  /// LAPACK dgeev, with left vectors dgeevx; of each complex pair the eigenvalue with positive
  /// imaginary part comes first.
  DenseEigenpairs general_eigen(DenseMatrix a, bool with_left = false);

  /// The roots l with Im l >= 0 that come with an eigenvalue l^2 and, if it is complex, with its
  /// conjugate: of the four +-l, +-conj(l) two. The vector of the second is the conjugate one then.
  struct SquareRoot
  {
    std::complex<double> value;
    bool conjugate;
  };
  std::vector<SquareRoot> upper_square_roots(std::complex<double> square);

  /// One eigenpair Q(l) x = 0 of a small quadratic problem; vectors have the size of the problem.
  struct DensePair
  {
    std::complex<double> lambda;
    std::vector<std::complex<double>> vector;
    std::vector<std::complex<double>> left; ///< y^T Q(l) = 0; on demand
  };

  /// All finite eigenpairs with Im l >= 0 of (l^2 M + l P + Q) x = 0, shift-inverted at the real @p
  /// shift: with l = s + c/theta, theta is an eigenvalue of the companion matrix
  ///     [ -c Q(s)^{-1} Q'(s)   -c^2 Q(s)^{-1} M ]
  ///     [         I                   0         ].
  /// The @p scale c > 0 should be of the size of the eigenvalues that matter: then theta is of size
  /// one for them, and theirs is the accuracy that dgeev gives. Without a velocity term and at
  /// shift 0 the problem is solved in l^2, so that eigenvalues come in exact
  /// +- pairs. @p p may have zero rows, which means zero. M may be singular: infinite eigenvalues,
  /// theta that are zero but for rounding, are left out. With left vectors [u; u'] of that matrix,
  /// those of the problem are
  ///     y = Q(s)^{-T} conj(u).
  /// LAPACK dgeev. Throws SolverError.
  std::vector<DensePair> quadratic_eigenpairs(const DenseMatrix &m, const DenseMatrix &p,
                                              const DenseMatrix &q, double shift, double scale,
                                              bool with_left = false);

  /// The root of a l^2 + b l + c near a given one.
  std::complex<double> nearest_root(std::complex<double> a, std::complex<double> b,
                                    std::complex<double> c, std::complex<double> given);
} // namespace squeal
