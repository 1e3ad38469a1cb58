#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/linalg/matrix.h>

#include <numeric>
#include <utility>
#include <vector>

namespace squeal
{
  /// A block of distributed vectors, stored column by column: column j of this rank is
  /// data[j*n_local ... (j+1)*n_local).
  class MultiVector
  {
  public:
    MultiVector() = default;
    MultiVector(const RowRange &rows, unsigned int n_columns)
        : rows(rows), n_columns_(n_columns), data_(std::size_t(rows.n_local()) * n_columns)
    {
    }

    unsigned int n_columns() const
    {
      return n_columns_;
    }
    unsigned int n_local() const
    {
      return rows.n_local();
    }
    const RowRange &row_range() const
    {
      return rows;
    }

    double *column(const unsigned int j)
    {
      return data_.data() + std::size_t(j) * n_local();
    }
    const double *column(const unsigned int j) const
    {
      return data_.data() + std::size_t(j) * n_local();
    }
    double *data()
    {
      return data_.data();
    }
    const double *data() const
    {
      return data_.data();
    }

    /// [this, other].
    void append(const MultiVector &other);

    /// Entry by entry; the other multi-vector has the same size.
    MultiVector &operator+=(const MultiVector &other)
    {
      return add(1, other);
    }
    MultiVector &operator-=(const MultiVector &other)
    {
      return add(-1, other);
    }
    MultiVector &operator*=(double factor);
    /// this += factor * other.
    MultiVector &add(double factor, const MultiVector &other);

    /// n columns from the first on.
    MultiVector columns(unsigned int first, unsigned int n) const;

  private:
    RowRange rows;
    unsigned int n_columns_ = 0;
    std::vector<double> data_;
  };

  /// The distributed column with the sum of the given entries; negative rows are skipped. Any rank
  /// may give entries of any row. Collective.
  MultiVector sum_entries(const RowRange &rows, const std::vector<PetscInt> &entry_rows,
                          const std::vector<PetscScalar> &values);

  /// The values of a distributed column on every rank.
  std::vector<double> replicate(const MultiVector &column);

  /// The lists of all ranks one after the other, on all ranks. Collective.
  template <typename Number>
  void gather(std::vector<Number> &list, const MPI_Datatype type, const MPI_Comm comm)
  {
    int n_ranks = 0, n = list.size();
    MPI_Comm_size(comm, &n_ranks);
    if (n_ranks == 1)
      return;
    std::vector<int> counts(n_ranks), offsets(n_ranks);
    MPI_Allgather(&n, 1, MPI_INT, counts.data(), 1, MPI_INT, comm);
    std::partial_sum(counts.begin(), counts.end() - 1, offsets.begin() + 1);
    std::vector<Number> all(offsets.back() + counts.back());
    MPI_Allgatherv(list.data(), n, type, all.data(), counts.data(), offsets.data(), type, comm);
    list = std::move(all);
  }

  /// A - B.
  MultiVector difference(MultiVector a, const MultiVector &b);

  /// The Euclidean length of one column. Collective.
  double length_of(const MultiVector &column);
  /// max |b_ij|. Collective.
  double largest_entry(const MultiVector &block);

  /// A B; zero if A is empty.
  MultiVector multiply(const Matrix &matrix, const MultiVector &block);

  /// A^T B; zero if A is empty.
  MultiVector multiply_transposed(const Matrix &matrix, const MultiVector &block);

  /// A^T B, equal on all ranks. Collective.
  DenseMatrix inner_products(const MultiVector &a, const MultiVector &b);
  /// A^T B of n_a columns of A from first_a on, and of B likewise.
  DenseMatrix inner_products(const MultiVector &a, unsigned int first_a, unsigned int n_a,
                             const MultiVector &b, unsigned int first_b, unsigned int n_b);
  /// a^T b of two columns. Collective.
  double inner_product(const MultiVector &a, const MultiVector &b);

  /// A C.
  MultiVector combine(const MultiVector &a, const DenseView<double> &coefficients);
  /// A C of a column-major list.
  inline MultiVector combine(const MultiVector &a, const std::vector<double> &coefficients,
                             const unsigned int n_columns)
  {
    return combine(a, {coefficients.data(), a.n_columns(), n_columns});
  }

  /// B := B - A C.
  void subtract_combination(MultiVector &b, const MultiVector &a,
                            const DenseView<double> &coefficients);
  /// B := B - A C of a column-major list.
  inline void subtract_combination(MultiVector &b, const MultiVector &a,
                                   const std::vector<double> &coefficients)
  {
    subtract_combination(b, a, {coefficients.data(), a.n_columns(), b.n_columns()});
  }

  /// Multiplies each column by its factor.
  void scale_columns(MultiVector &block, const std::vector<double> &factors);

  /// An orthonormal basis of the span of the columns; only directions that are linear combinations
  /// of the others up to rounding are dropped. Level-3 operations throughout: SVQB (Stathopoulos
  /// and Wu, 2002) keeps the well-conditioned directions of the Gram matrix; the others, which the
  /// Gram matrix cannot resolve, are formed explicitly, orthogonalised against what was kept, and
  /// treated the same way.
  MultiVector orthonormalize(MultiVector block);

  /// The given rows as columns of a small matrix on all ranks. Collective.
  DenseMatrix gather_rows(const MultiVector &block, const std::vector<unsigned int> &wanted);
  /// The columns e_i of the given rows i.
  MultiVector unit_columns(const RowRange &rows, const std::vector<unsigned int> &numbers);
  void clear_rows(MultiVector &block, const std::vector<unsigned int> &cleared);

  /// A^T B, of which the products of the first columns are known. Collective.
  DenseMatrix grow_products(const DenseMatrix &known, const MultiVector &a, const MultiVector &b);

  /// Rows that one rank has by itself.
  inline RowRange small_rows(const unsigned int n)
  {
    return {MPI_COMM_SELF, 0, n, n};
  }
  /// A small matrix as columns on small_rows(), and as a sparse matrix (empty if it has no
  /// entries).
  MultiVector to_multi_vector(const DenseMatrix &a);
  Matrix to_matrix(const DenseMatrix &a);
} // namespace squeal
