#include <squeal/linalg/complex_multi_vector.h>

#include <algorithm>

namespace squeal
{
  using Complex = std::complex<double>;

  void ComplexMultiVector::append(const ComplexMultiVector &other)
  {
    re.append(other.re);
    im.append(other.im);
  }

  ComplexMultiVector ComplexMultiVector::columns(const std::vector<unsigned int> &numbers) const
  {
    ComplexMultiVector result(row_range(), numbers.size());
    for (unsigned int k = 0; k < numbers.size(); ++k)
    {
      std::copy_n(re.column(numbers[k]), n_local(), result.re.column(k));
      std::copy_n(im.column(numbers[k]), n_local(), result.im.column(k));
    }
    return result;
  }

  void ComplexMultiVector::scale(const std::vector<Complex> &factors)
  {
    for (unsigned int k = 0; k < factors.size(); ++k)
      for (unsigned int i = 0; i < n_local(); ++i)
        set(i, k, factors[k] * (*this)(i, k));
  }

  void ComplexMultiVector::conjugate()
  {
    for (std::size_t i = 0; i < std::size_t(n_local()) * n_columns(); ++i)
      im.data()[i] *= -1;
  }

  MultiVector ComplexMultiVector::real_span() const
  {
    MultiVector result = re;
    result.append(im);
    return result;
  }

  ComplexMultiVector combine(const MultiVector &a, const ComplexDenseMatrix &coefficients)
  {
    const DenseMatrix parts = real_and_imaginary(coefficients);
    const unsigned int n    = coefficients.n_columns;
    return {combine(a, parts.columns(0, n)), combine(a, parts.columns(n, n))};
  }

  ComplexMultiVector to_multi_vector(const ComplexDenseMatrix &a)
  {
    const DenseMatrix parts = real_and_imaginary(a);
    return {to_multi_vector(DenseMatrix(parts.columns(0, a.n_columns))),
            to_multi_vector(DenseMatrix(parts.columns(a.n_columns, a.n_columns)))};
  }

  ComplexMultiVector multiply(const Matrix &matrix, const ComplexMultiVector &x)
  {
    return {multiply(matrix, x.re), multiply(matrix, x.im)};
  }

  std::vector<Complex> sesquilinear_form(const ComplexMultiVector &z, const Matrix &matrix,
                                         const ComplexMultiVector &x)
  {
    std::vector<Complex> form(std::size_t(z.n_columns()) * x.n_columns());
    if (!matrix || form.empty())
      return form;
    // (z_re - i z_im)^T (a_re + i a_im)
    const ComplexMultiVector a = multiply(matrix, x);
    const DenseMatrix rr = inner_products(z.re, a.re), ri = inner_products(z.re, a.im),
                      ir = inner_products(z.im, a.re), ii = inner_products(z.im, a.im);
    for (std::size_t k = 0; k < form.size(); ++k)
      form[k] = Complex(rr.values[k] + ii.values[k], ri.values[k] - ir.values[k]);
    return form;
  }

  std::vector<Complex> diagonal_form(const ComplexMultiVector &z, const Matrix &matrix,
                                     const ComplexMultiVector &x)
  {
    const unsigned int n       = x.n_columns();
    const ComplexMultiVector a = multiply(matrix, x);
    std::vector<Complex> form(n);
    for (unsigned int j = 0; j < n; ++j)
      for (unsigned int i = 0; i < a.n_local(); ++i)
        form[j] += std::conj(z(i, j)) * a(i, j);
    MPI_Allreduce(MPI_IN_PLACE, form.data(), 2 * n, MPI_DOUBLE, MPI_SUM, x.row_range().comm);
    return form;
  }

  std::vector<MainPart>
  main_parts(const std::vector<std::pair<const double *, const double *>> &vectors,
             const RowRange &rows)
  {
    std::vector<double> sums(3 * vectors.size()); // a a, b b, a b
    for (std::size_t j = 0; j < vectors.size(); ++j)
    {
      const auto [a, b] = vectors[j];
      for (unsigned int i = 0; i < rows.n_local(); ++i)
      {
        sums[3 * j] += a[i] * a[i];
        sums[3 * j + 1] += b[i] * b[i];
        sums[3 * j + 2] += a[i] * b[i];
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), sums.size(), MPI_DOUBLE, MPI_SUM, rows.comm);
    std::vector<MainPart> result;
    for (std::size_t j = 0; j < vectors.size(); ++j)
    {
      // (a + i b)^T (a + i b) becomes real and positive.
      const std::complex<double> square(sums[3 * j] - sums[3 * j + 1], 2 * sums[3 * j + 2]);
      const double both = sums[3 * j] + sums[3 * j + 1];
      result.push_back({std::polar(1., -std::arg(square) / 2), (both + std::abs(square)) / 2,
                        (both - std::abs(square)) / 2});
    }
    return result;
  }
} // namespace squeal
