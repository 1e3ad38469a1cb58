#pragma once

#include <squeal/linalg/multi_vector.h>

#include <complex>
#include <utility>
#include <vector>

namespace squeal
{
  /// Distributed complex vectors as their real and imaginary parts: PETSc computes in real numbers
  /// here.
  struct ComplexMultiVector
  {
    MultiVector re, im;

    ComplexMultiVector() = default;
    ComplexMultiVector(const RowRange &rows, const unsigned int n_columns)
        : re(rows, n_columns), im(rows, n_columns)
    {
    }
    ComplexMultiVector(MultiVector re, MultiVector im) : re(std::move(re)), im(std::move(im)) {}

    unsigned int n_columns() const
    {
      return re.n_columns();
    }
    unsigned int n_local() const
    {
      return re.n_local();
    }
    const RowRange &row_range() const
    {
      return re.row_range();
    }

    /// The entry in a row of this rank.
    std::complex<double> operator()(const unsigned int local_row, const unsigned int column) const
    {
      return {re.column(column)[local_row], im.column(column)[local_row]};
    }
    void set(const unsigned int local_row, const unsigned int column,
             const std::complex<double> value)
    {
      re.column(column)[local_row] = value.real();
      im.column(column)[local_row] = value.imag();
    }

    /// Appends the columns of another multi-vector.
    void append(const ComplexMultiVector &other);
    /// The columns of the given numbers, in their order.
    ComplexMultiVector columns(const std::vector<unsigned int> &numbers) const;
    /// Multiplies each column by its factor.
    void scale(const std::vector<std::complex<double>> &factors);
    void conjugate();
    /// [Re, Im]: twice as many real columns, which span the vectors.
    MultiVector real_span() const;
  };

  /// A C with real vectors A.
  ComplexMultiVector combine(const MultiVector &a, const ComplexDenseMatrix &coefficients);

  /// A small matrix as columns on small_rows().
  ComplexMultiVector to_multi_vector(const ComplexDenseMatrix &a);

  /// A X with a real matrix A; zero if A is empty.
  ComplexMultiVector multiply(const Matrix &matrix, const ComplexMultiVector &x);

  /// Z^H A X with a real matrix A, column-major, the same on all ranks.
  std::vector<std::complex<double>>
  sesquilinear_form(const ComplexMultiVector &z, const Matrix &matrix, const ComplexMultiVector &x);

  /// z_j^H A x_j of the vectors side by side, the same on all ranks.
  std::vector<std::complex<double>> diagonal_form(const ComplexMultiVector &z, const Matrix &matrix,
                                                  const ComplexMultiVector &x);

  /// How a complex vector a + i b is turned so that a is as long as can be, a and b orthogonal.
  struct MainPart
  {
    std::complex<double> turn; ///< factor of modulus 1
    double longer, shorter;    ///< |a|^2 and |b|^2 afterwards
  };
  /// Finds the turns of vectors given by the local parts of a and b. Collective.
  std::vector<MainPart>
  main_parts(const std::vector<std::pair<const double *, const double *>> &vectors,
             const RowRange &rows);
} // namespace squeal
