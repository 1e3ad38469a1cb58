#pragma once

#include <complex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

// Small dense matrices of real or complex numbers, DenseMatrix and ComplexDenseMatrix, after the
// notation of linear algebra: a.transpose() * b, a.columns(first, n). Views cost no copy; products,
// factors and eigenvalues are BLAS's and LAPACK's. Distributed columns are MultiVector's.
namespace squeal
{
  template <typename Number>
  struct Dense;

  /// What a product reads without a copy: rows and columns of a small matrix as they are,
  /// transposed, or conjugate-transposed. It lives as long as the matrix.
  template <typename Number>
  class DenseView
  {
  public:
    /// LAPACK's letters.
    enum class Form : char
    {
      plain      = 'N',
      transposed = 'T',
      adjoint    = 'C'
    };

    /// Sees columns that lie together, as those of a block of vectors.
    DenseView(const Number *const first, const unsigned int n_rows, const unsigned int n_columns)
        : DenseView(first, n_rows, n_columns, n_rows, Form::plain)
    {
    }
    DenseView(const Dense<Number> &matrix)
        : DenseView(matrix.values.data(), matrix.n_rows, matrix.n_columns)
    {
    }

    unsigned int n_rows() const
    {
      return form_ == Form::plain ? height : width;
    }
    unsigned int n_columns() const
    {
      return form_ == Form::plain ? width : height;
    }
    Number operator()(const unsigned int i, const unsigned int j) const
    {
      if (form_ == Form::plain)
        return first[i + std::size_t(j) * stride_];
      const Number value = first[j + std::size_t(i) * stride_];
      if constexpr (!std::is_same<Number, double>::value)
        if (form_ == Form::adjoint)
          return std::conj(value);
      return value;
    }

    DenseView columns(unsigned int first, unsigned int n) const;
    DenseView rows(unsigned int first, unsigned int n) const;
    DenseView transpose() const;
    DenseView adjoint() const;

    /// How LAPACK finds it: the first number, the distance of columns, and whether it is turned.
    const Number *data() const
    {
      return first;
    }
    unsigned int stride() const
    {
      return stride_;
    }
    Form form() const
    {
      return form_;
    }

  private:
    DenseView(const Number *const first, const unsigned int height, const unsigned int width,
              const unsigned int stride, const Form form)
        : first(first), height(height), width(width), stride_(stride), form_(form)
    {
    }

    const Number *first;
    unsigned int height, width, stride_; ///< as it is stored
    Form form_;
  };

  /// A small dense matrix, column-major. An empty one is zero where it is added.
  template <typename Number>
  struct Dense
  {
    using View = DenseView<Number>;

    unsigned int n_rows = 0, n_columns = 0;
    std::vector<Number> values;

    Dense() = default;
    /// Makes zeros.
    Dense(const unsigned int m, const unsigned int n)
        : n_rows(m), n_columns(n), values(std::size_t(m) * n)
    {
    }
    Dense(const unsigned int m, const unsigned int n, std::vector<Number> v)
        : n_rows(m), n_columns(n), values(std::move(v))
    {
    }
    Dense(const View &copied);
    static Dense identity(unsigned int n);

    Number &operator()(const unsigned int i, const unsigned int j)
    {
      return values[i + std::size_t(j) * n_rows];
    }
    const Number &operator()(const unsigned int i, const unsigned int j) const
    {
      return values[i + std::size_t(j) * n_rows];
    }
    Number *column(const unsigned int j)
    {
      return values.data() + std::size_t(j) * n_rows;
    }
    const Number *column(const unsigned int j) const
    {
      return values.data() + std::size_t(j) * n_rows;
    }
    bool empty() const
    {
      return values.empty();
    }

    View columns(const unsigned int first, const unsigned int n) const
    {
      return View(*this).columns(first, n);
    }
    View rows(const unsigned int first, const unsigned int n) const
    {
      return View(*this).rows(first, n);
    }
    View transpose() const
    {
      return View(*this).transpose();
    }
    View adjoint() const
    {
      return View(*this).adjoint();
    }

    /// A copy of the columns of the given numbers, in their order.
    Dense columns(const std::vector<unsigned int> &numbers) const;
    /// Becomes [A, B].
    void append(const View &columns);
    /// Drops rows at the end, or adds zeros there.
    void resize_rows(unsigned int n);
    /// += factor B, of the same size.
    Dense &add(Number factor, const Dense &other);
    Dense &operator+=(const Dense &other)
    {
      return add(1, other);
    }
    Dense &operator-=(const Dense &other)
    {
      return add(-1, other);
    }
    /// Multiplies each column by its factor.
    Dense &scale(const std::vector<Number> &factors);
    /// Makes the columns unit vectors.
    Dense &normalise();
    Dense &conjugate();

    /// Euclidean lengths.
    std::vector<double> column_norms() const;
    /// The largest modulus of an entry.
    double largest_entry() const;
  };

  using DenseMatrix        = Dense<double>;
  using ComplexDenseMatrix = Dense<std::complex<double>>;

  /// C := alpha A B + beta C by BLAS, the columns of C together. A single column or row by BLAS 2:
  /// gemm would first copy all of the matrix.
  template <typename Number>
  void gemm(Number alpha, const DenseView<Number> &a, const DenseView<Number> &b, Number beta,
            Number *c);

  DenseMatrix operator*(const DenseView<double> &a, const DenseView<double> &b);
  ComplexDenseMatrix operator*(const DenseView<std::complex<double>> &a,
                               const DenseView<std::complex<double>> &b);
  /// Real and imaginary parts by one product.
  ComplexDenseMatrix operator*(const DenseView<double> &a,
                               const DenseView<std::complex<double>> &b);
  /// C += factor A B; C has its size.
  void add_product(double factor, const DenseView<double> &a, const DenseView<double> &b,
                   DenseMatrix &c);

  /// a_j^T b_j of the columns side by side, without a conjugate.
  std::vector<std::complex<double>> column_products(const ComplexDenseMatrix &a,
                                                    const ComplexDenseMatrix &b);

  /// [Re A, Im A], and A of it.
  DenseMatrix real_and_imaginary(const ComplexDenseMatrix &a);
  ComplexDenseMatrix to_complex(const DenseView<double> &parts);
  /// Z^H X of the products [Re Z, Im Z]^T [Re X, Im X].
  ComplexDenseMatrix adjoint_product(const DenseMatrix &products);

  /// y += factor x, of n numbers.
  void add_multiple(double factor, const double *x, unsigned int n, double *y);

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

  /// A square matrix, factorised once by LU with partial pivoting for many right sides.
  template <typename Number>
  class LuFactors
  {
  public:
    /// What happens at a pivot that is zero. For inverse iteration, which wants the matrix to be
    /// singular, it becomes rounding.
    enum class ZeroPivot
    {
      throws, ///< SingularMatrix
      becomes_rounding
    };
    explicit LuFactors(Dense<Number> a, ZeroPivot zero = ZeroPivot::throws);
    /// A^{-1} B; with A^T or A^H on demand.
    Dense<Number>
    solve(Dense<Number> b,
          typename DenseView<Number>::Form form = DenseView<Number>::Form::plain) const;

  private:
    Dense<Number> factors;
    std::vector<int> pivots;
  };
  /// A^{-1} B. Throws SingularMatrix.
  inline DenseMatrix solve(DenseMatrix a, DenseMatrix b)
  {
    return LuFactors<double>(std::move(a)).solve(std::move(b));
  }

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

  /// Combinations, as columns of coefficients, that make remainders of columns (their parts along
  /// others were taken off) orthonormal. @p products are those of the remainders, @p before those
  /// of the columns: left out are remainders shorter than @p shortest, relatively, and combinations
  /// of remainders of unit length that are shorter than @p dependent.
  DenseMatrix independent_combinations(DenseMatrix products, const DenseMatrix &before,
                                       double shortest, double dependent);

  struct DenseEigenpairs
  {
    std::vector<std::complex<double>> values;
    ComplexDenseMatrix right; ///< A x = theta x, unit vectors
    ComplexDenseMatrix left;  ///< u^H A = theta u^H; on demand
    /// What rounding makes of each eigenvalue to first order, eps |A| / |u^H v| with unit vectors
    /// and the norm of the balanced matrix; of real matrices, with the left vectors.
    std::vector<double> rounding;
  };

  /// LAPACK dgeev or zgeev, of real matrices with left vectors dgeevx. Of each complex pair of a
  /// real matrix the eigenvalue with positive imaginary part comes first. Throws SolverError.
  template <typename Number>
  DenseEigenpairs general_eigen(Dense<Number> a, bool with_left = false);
} // namespace squeal
