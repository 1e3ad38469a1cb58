#include <squeal/base/errors.h>
#include <squeal/linalg/dense.h>

#include <deal.II/base/exceptions.h>

#include <petscsys.h>

#include <petscblaslapack.h>
#include <slepcblaslapack.h>

#include <algorithm>
#include <cmath>
#include <limits>

// From views and their products by way of factorisations to eigenvalues; every product ends in
// gemm(). PETSc's header declares the real functions of BLAS and LAPACK, the complex ones are
// declared here; Lapack<Number> gives both one name, so that templates can call them.
extern "C"
{
  void zgemm_(const char *, const char *, const int *, const int *, const int *,
              const std::complex<double> *, const std::complex<double> *, const int *,
              const std::complex<double> *, const int *, const std::complex<double> *,
              std::complex<double> *, const int *);
  void zgemv_(const char *, const int *, const int *, const std::complex<double> *,
              const std::complex<double> *, const int *, const std::complex<double> *, const int *,
              const std::complex<double> *, std::complex<double> *, const int *);
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

  namespace
  {
    static_assert(std::is_same<PetscBLASInt, int>::value, "BLAS with 32-bit numbers");

    template <typename Number>
    struct Lapack;
    template <>
    struct Lapack<double>
    {
      static constexpr auto gemm  = BLASgemm_;
      static constexpr auto gemv  = BLASgemv_;
      static constexpr auto getrf = LAPACKgetrf_;
      static constexpr auto getrs = LAPACKgetrs_;
    };
    template <>
    struct Lapack<Complex>
    {
      static constexpr auto gemm  = zgemm_;
      static constexpr auto gemv  = zgemv_;
      static constexpr auto getrf = zgetrf_;
      static constexpr auto getrs = zgetrs_;
    };

    void assert_fits([[maybe_unused]] const bool fits)
    {
      Assert(fits, dealii::StandardExceptions::ExcMessage("Matrices do not fit."));
    }
  } // namespace

  template <typename Number>
  DenseView<Number> DenseView<Number>::columns(const unsigned int from, const unsigned int n) const
  {
    assert_fits(from + n <= n_columns());
    return form_ == Form::plain
               ? DenseView(first + std::size_t(from) * stride_, height, n, stride_, form_)
               : DenseView(first + from, n, width, stride_, form_);
  }

  template <typename Number>
  DenseView<Number> DenseView<Number>::rows(const unsigned int from, const unsigned int n) const
  {
    assert_fits(from + n <= n_rows());
    return form_ == Form::plain
               ? DenseView(first + from, n, width, stride_, form_)
               : DenseView(first + std::size_t(from) * stride_, height, n, stride_, form_);
  }

  template <typename Number>
  DenseView<Number> DenseView<Number>::transpose() const
  {
    assert_fits(form_ != Form::adjoint);
    return {first, height, width, stride_, form_ == Form::plain ? Form::transposed : Form::plain};
  }

  template <typename Number>
  DenseView<Number> DenseView<Number>::adjoint() const
  {
    if (std::is_same<Number, double>::value)
      return transpose();
    assert_fits(form_ != Form::transposed);
    return {first, height, width, stride_, form_ == Form::plain ? Form::adjoint : Form::plain};
  }

  template <typename Number>
  Dense<Number>::Dense(const View &copied) : n_rows(copied.n_rows())
  {
    values.reserve(std::size_t(n_rows) * copied.n_columns());
    append(copied);
    n_columns = copied.n_columns();
  }

  template <typename Number>
  Dense<Number> Dense<Number>::identity(const unsigned int n)
  {
    Dense result(n, n);
    for (unsigned int i = 0; i < n; ++i)
      result(i, i) = 1;
    return result;
  }

  template <typename Number>
  Dense<Number> Dense<Number>::columns(const std::vector<unsigned int> &numbers) const
  {
    Dense result(n_rows, numbers.size());
    for (unsigned int k = 0; k < numbers.size(); ++k)
      std::copy_n(column(numbers[k]), n_rows, result.column(k));
    return result;
  }

  template <typename Number>
  void Dense<Number>::append(const View &columns)
  {
    if (columns.n_columns() == 0)
      return;
    n_rows = columns.n_rows();
    for (unsigned int j = 0; j < columns.n_columns(); ++j)
      if (columns.form() == View::Form::plain)
      {
        const Number *const column = columns.data() + std::size_t(j) * columns.stride();
        values.insert(values.end(), column, column + n_rows);
      }
      else
        for (unsigned int i = 0; i < n_rows; ++i)
          values.push_back(columns(i, j));
    n_columns += columns.n_columns();
  }

  template <typename Number>
  void Dense<Number>::resize_rows(const unsigned int n)
  {
    Dense result(n, n_columns);
    for (unsigned int j = 0; j < n_columns; ++j)
      std::copy_n(column(j), std::min(n, n_rows), result.column(j));
    *this = std::move(result);
  }

  template <typename Number>
  Dense<Number> &Dense<Number>::add(const Number factor, const Dense &other)
  {
    if (other.empty() || factor == 0.)
      return *this;
    if (empty())
      *this = Dense(other.n_rows, other.n_columns);
    assert_fits(n_rows == other.n_rows && n_columns == other.n_columns);
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] += factor * other.values[k];
    return *this;
  }

  template <typename Number>
  Dense<Number> &Dense<Number>::scale(const std::vector<Number> &factors)
  {
    for (unsigned int j = 0; j < n_columns; ++j)
      for (unsigned int i = 0; i < n_rows; ++i)
        (*this)(i, j) *= factors[j];
    return *this;
  }

  template <typename Number>
  Dense<Number> &Dense<Number>::normalise()
  {
    const std::vector<double> lengths = column_norms();
    for (unsigned int j = 0; j < n_columns; ++j)
      for (unsigned int i = 0; i < n_rows; ++i)
        (*this)(i, j) /= lengths[j];
    return *this;
  }

  template <typename Number>
  Dense<Number> &Dense<Number>::conjugate()
  {
    if constexpr (!std::is_same<Number, double>::value)
      for (Number &value : values)
        value = std::conj(value);
    return *this;
  }

  template <typename Number>
  std::vector<double> Dense<Number>::column_norms() const
  {
    std::vector<double> lengths(n_columns);
    for (unsigned int j = 0; j < n_columns; ++j)
    {
      for (unsigned int i = 0; i < n_rows; ++i)
        lengths[j] += std::norm((*this)(i, j));
      lengths[j] = std::sqrt(lengths[j]);
    }
    return lengths;
  }

  template <typename Number>
  double Dense<Number>::largest_entry() const
  {
    double largest = 0;
    for (const Number &value : values)
      largest = std::max(largest, std::abs(value));
    return largest;
  }

  template <typename Number>
  void gemm(const Number alpha, const DenseView<Number> &a, const DenseView<Number> &b,
            const Number beta, Number *const c)
  {
    using Form = typename DenseView<Number>::Form;
    assert_fits(a.n_columns() == b.n_rows());
    const int m = a.n_rows(), n = b.n_columns(), k = a.n_columns(), lda = std::max(1u, a.stride()),
              ldb = std::max(1u, b.stride()), one = 1;
    if (m == 0 || n == 0 || k == 0)
      return;
    const char form_a = char(a.form()), form_b = char(b.form());
    if (n == 1 && b.form() == Form::plain)
    {
      const int height = a.form() == Form::plain ? m : k, width = a.form() == Form::plain ? k : m;
      Lapack<Number>::gemv(&form_a, &height, &width, &alpha, a.data(), &lda, b.data(), &one, &beta,
                           c, &one);
    }
    else if (m == 1 && a.form() == Form::transposed && b.form() == Form::plain)
      Lapack<Number>::gemv("T", &k, &n, &alpha, b.data(), &ldb, a.data(), &one, &beta, c, &one);
    else
      Lapack<Number>::gemm(&form_a, &form_b, &m, &n, &k, &alpha, a.data(), &lda, b.data(), &ldb,
                           &beta, c, &m);
  }

  DenseMatrix operator*(const DenseView<double> &a, const DenseView<double> &b)
  {
    DenseMatrix c(a.n_rows(), b.n_columns());
    gemm(1., a, b, 0., c.values.data());
    return c;
  }

  ComplexDenseMatrix operator*(const DenseView<Complex> &a, const DenseView<Complex> &b)
  {
    ComplexDenseMatrix c(a.n_rows(), b.n_columns());
    gemm<Complex>(1, a, b, 0, c.values.data());
    return c;
  }

  ComplexDenseMatrix operator*(const DenseView<double> &a, const DenseView<Complex> &b)
  {
    return to_complex(a * real_and_imaginary(b));
  }

  void add_product(const double factor, const DenseView<double> &a, const DenseView<double> &b,
                   DenseMatrix &c)
  {
    assert_fits(c.n_rows == a.n_rows() && c.n_columns == b.n_columns());
    gemm(factor, a, b, 1., c.values.data());
  }

  std::vector<Complex> column_products(const ComplexDenseMatrix &a, const ComplexDenseMatrix &b)
  {
    std::vector<Complex> result(b.n_columns);
    for (unsigned int j = 0; j < b.n_columns; ++j)
      for (unsigned int i = 0; i < b.n_rows; ++i)
        result[j] += a(i, j) * b(i, j);
    return result;
  }

  DenseMatrix real_and_imaginary(const ComplexDenseMatrix &a)
  {
    DenseMatrix parts(a.n_rows, 2 * a.n_columns);
    for (std::size_t k = 0, n = a.values.size(); k < n; ++k)
    {
      parts.values[k]     = a.values[k].real();
      parts.values[n + k] = a.values[k].imag();
    }
    return parts;
  }

  ComplexDenseMatrix to_complex(const DenseView<double> &parts)
  {
    const unsigned int n = parts.n_columns() / 2;
    ComplexDenseMatrix result(parts.n_rows(), n);
    for (unsigned int j = 0; j < n; ++j)
      for (unsigned int i = 0; i < result.n_rows; ++i)
        result(i, j) = {parts(i, j), parts(i, n + j)};
    return result;
  }

  /// (Re Z - i Im Z)^T (Re X + i Im X)
  ComplexDenseMatrix adjoint_product(const DenseMatrix &products)
  {
    const unsigned int m = products.n_rows / 2, n = products.n_columns / 2;
    ComplexDenseMatrix result(m, n);
    for (unsigned int j = 0; j < n; ++j)
      for (unsigned int i = 0; i < m; ++i)
        result(i, j) = {products(i, j) + products(m + i, n + j),
                        products(i, n + j) - products(m + i, j)};
    return result;
  }

  void add_multiple(const double factor, const double *x, const unsigned int n, double *y)
  {
    const PetscBLASInt size = n, one = 1;
    BLASaxpy_(&size, &factor, x, &one, y, &one);
  }

  DenseMatrix symmetrised(DenseMatrix a)
  {
    for (unsigned int j = 0; j < a.n_columns; ++j)
      for (unsigned int i = 0; i < j; ++i)
        a(i, j) = a(j, i) = (a(i, j) + a(j, i)) / 2;
    return a;
  }

  template <typename Number>
  LuFactors<Number>::LuFactors(Dense<Number> a, const ZeroPivot zero)
      : factors(std::move(a)), pivots(factors.n_rows)
  {
    const int n = factors.n_rows;
    int info    = 0;
    if (n == 0)
      return;
    const double size = zero == ZeroPivot::becomes_rounding ? factors.largest_entry() : 0;
    Lapack<Number>::getrf(&n, &n, factors.values.data(), &n, pivots.data(), &info);
    if (info != 0 && zero == ZeroPivot::throws)
      throw SingularMatrix("LAPACK: a dense matrix is singular to working precision (row " +
                               std::to_string(info) + " of " + std::to_string(n) + ").",
                           {Failure::singular_matrix});
    for (int i = 0; i < n; ++i)
      if (factors(i, i) == 0.)
        factors(i, i) = std::numeric_limits<double>::epsilon() * size;
  }

  template <typename Number>
  Dense<Number> LuFactors<Number>::solve(Dense<Number> b,
                                         const typename DenseView<Number>::Form form) const
  {
    const int n = factors.n_rows, n_rhs = b.n_columns;
    const char letter = char(form);
    int info          = 0;
    if (n > 0 && n_rhs > 0)
      Lapack<Number>::getrs(&letter, &n, &n_rhs, factors.values.data(), &n, pivots.data(),
                            b.values.data(), &n, &info);
    return b;
  }

  DenseMatrix pseudo_inverse(DenseMatrix a, const double smallest)
  {
    const PetscBLASInt m = a.n_rows, n = a.n_columns, k = std::min(m, n);
    if (k == 0)
      return DenseMatrix(n, m);
    DenseMatrix u(m, k), vt(k, n);
    std::vector<double> sigma(k), work(1);
    PetscBLASInt size = -1, info = 0; // the first call asks for the size
    for (unsigned int call = 0; call < 2; ++call)
    {
      LAPACKgesvd_("S", "S", &m, &n, a.values.data(), &m, sigma.data(), u.values.data(), &m,
                   vt.values.data(), &k, work.data(), &size, &info);
      size = work[0];
      work.resize(size);
    }
    if (info != 0)
      throw SolverError("LAPACK dgesvd did not converge (info " + std::to_string(info) + ").");
    unsigned int rank = 0;
    for (; rank < sigma.size() && sigma[rank] > smallest * sigma[0]; ++rank)
      for (PetscBLASInt i = 0; i < m; ++i)
        u(i, rank) /= sigma[rank];
    return vt.rows(0, rank).transpose() * u.columns(0, rank).transpose();
  }

  PositiveFactors::PositiveFactors(DenseMatrix a, const std::string &what) : factors(std::move(a))
  {
    const PetscBLASInt n = factors.n_rows;
    PetscBLASInt info    = 0;
    if (n > 0)
      LAPACKpotrf_("U", &n, factors.values.data(), &n, &info);
    if (info != 0)
      throw SolverError("LAPACK: " + what + " is not positive definite (row " +
                        std::to_string(info) + " of " + std::to_string(n) + ").");
  }

  DenseMatrix PositiveFactors::solve(DenseMatrix b) const
  {
    const PetscBLASInt n = b.n_rows, n_rhs = b.n_columns;
    PetscBLASInt info = 0;
    if (n > 0 && n_rhs > 0)
      LAPACKpotrs_("U", &n, &n_rhs, factors.values.data(), &n, b.values.data(), &n, &info);
    return b;
  }

  std::vector<double> symmetric_eigen(DenseMatrix &a)
  {
    const PetscBLASInt n = a.n_rows;
    PetscBLASInt info = 0, n_work = std::max<PetscBLASInt>(1, 34 * n);
    std::vector<double> eigenvalues(n), work(n_work);
    LAPACKsyev_("V", "U", &n, a.values.data(), &n, eigenvalues.data(), work.data(), &n_work, &info);
    if (info != 0)
      throw SolverError("LAPACK dsyev did not converge (info " + std::to_string(info) + ").");
    return eigenvalues;
  }

  DenseMatrix principal_combinations(DenseMatrix products, const double smallest)
  {
    const unsigned int n              = products.n_rows;
    const std::vector<double> squares = symmetric_eigen(products);
    DenseMatrix result(n, 0);
    for (unsigned int k = 0; k < n; ++k)
      if (squares[k] > smallest * smallest)
      {
        for (unsigned int i = 0; i < n; ++i)
          result.values.push_back(products(i, k) / std::sqrt(squares[k]));
        ++result.n_columns;
      }
    return result;
  }

  DenseMatrix independent_combinations(DenseMatrix products, const DenseMatrix &before,
                                       const double shortest, const double dependent)
  {
    const unsigned int n = products.n_rows;
    DenseMatrix result(n, 0);
    if (n == 0)
      return result;
    std::vector<double> scales(n);
    for (unsigned int k = 0; k < n; ++k)
      if (products(k, k) > shortest * shortest * before(k, k))
        scales[k] = 1 / std::sqrt(products(k, k));
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int i = 0; i < n; ++i)
        products(i, k) *= scales[i] * scales[k];
    result = principal_combinations(std::move(products), dependent);
    for (unsigned int k = 0; k < result.n_columns; ++k)
      for (unsigned int i = 0; i < n; ++i)
        result(i, k) *= scales[i];
    return result;
  }

  namespace
  {
    /// LAPACK's columns Re v, Im v of a complex pair become v and conj(v), one a column.
    ComplexDenseMatrix unpacked(const DenseMatrix &columns, const std::vector<double> &imaginary)
    {
      ComplexDenseMatrix result(columns.n_rows, columns.n_columns);
      for (unsigned int j = 0; j < columns.n_columns; ++j)
        for (unsigned int i = 0; i < columns.n_rows; ++i)
          if (imaginary[j] == 0)
            result(i, j) = columns(i, j);
          else if (imaginary[j] > 0)
          {
            result(i, j)     = {columns(i, j), columns(i, j + 1)};
            result(i, j + 1) = std::conj(result(i, j));
          }
      return result;
    }
  } // namespace

  template <>
  DenseEigenpairs general_eigen(DenseMatrix a, const bool with_left)
  {
    const PetscBLASInt n = a.n_rows;
    std::vector<double> re(n), im(n), scale(n), reciprocal_condition(with_left ? n : 0);
    DenseMatrix right(n, n), left(with_left ? n : 0, with_left ? n : 0);
    PetscBLASInt info = 0, n_work = -1;
    double best_size = 0, norm = 0;
    for (int pass = 0; n > 0 && pass < 2; ++pass) // the first call asks for the size
    {
      std::vector<double> work(pass == 0 ? 1 : n_work);
      double *const place = pass == 0 ? &best_size : work.data();
      if (with_left)
      {
        PetscBLASInt low = 0, high = 0, unused_integers = 0;
        double unused_conditions = 0;
        LAPACKgeevx_("B", "V", "V", "E", &n, a.values.data(), &n, re.data(), im.data(),
                     left.values.data(), &n, right.values.data(), &n, &low, &high, scale.data(),
                     &norm, reciprocal_condition.data(), &unused_conditions, place, &n_work,
                     &unused_integers, &info);
      }
      else
        LAPACKgeev_("N", "V", &n, a.values.data(), &n, re.data(), im.data(), nullptr, &n,
                    right.values.data(), &n, place, &n_work, &info);
      if (info != 0)
        throw SolverError("LAPACK dgeev did not converge (info " + std::to_string(info) + ").");
      n_work = PetscBLASInt(best_size);
    }
    DenseEigenpairs result{{}, unpacked(right, im), unpacked(left, im), {}};
    for (PetscBLASInt j = 0; j < n; ++j)
      result.values.emplace_back(re[j], im[j]);
    for (const double reciprocal : reciprocal_condition)
      result.rounding.push_back(std::numeric_limits<double>::epsilon() * norm / reciprocal);
    return result;
  }

  template <>
  DenseEigenpairs general_eigen(ComplexDenseMatrix a, const bool with_left)
  {
    const int n = a.n_rows, n_work = std::max(1, 4 * n);
    DenseEigenpairs result{std::vector<Complex>(n), ComplexDenseMatrix(n, n), {}, {}};
    if (with_left)
      result.left = ComplexDenseMatrix(n, n);
    std::vector<Complex> work(n_work);
    std::vector<double> real_work(std::max(1, 2 * n));
    int info = 0;
    if (n > 0)
      zgeev_(with_left ? "V" : "N", "V", &n, a.values.data(), &n, result.values.data(),
             result.left.values.data(), &n, result.right.values.data(), &n, work.data(), &n_work,
             real_work.data(), &info);
    if (info != 0)
      throw SolverError("LAPACK zgeev did not converge (info " + std::to_string(info) + ").");
    return result;
  }

  template class DenseView<double>;
  template class DenseView<Complex>;
  template struct Dense<double>;
  template struct Dense<Complex>;
  template class LuFactors<double>;
  template class LuFactors<Complex>;
  template void gemm(double, const DenseView<double> &, const DenseView<double> &, double,
                     double *);
  template void gemm(Complex, const DenseView<Complex> &, const DenseView<Complex> &, Complex,
                     Complex *);
} // namespace squeal
