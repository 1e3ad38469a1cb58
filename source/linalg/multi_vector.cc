#include <squeal/linalg/multi_vector.h>

#include <petscblaslapack.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  void MultiVector::append(const MultiVector &other)
  {
    // A vector would double its room.
    if (const std::size_t needed = data_.size() + other.data_.size(); data_.capacity() < needed)
      data_.reserve(std::max(needed, data_.size() + data_.size() / 4));
    data_.insert(data_.end(), other.data_.begin(), other.data_.end());
    n_columns_ += other.n_columns_;
  }

  MultiVector &MultiVector::operator*=(const double factor)
  {
    for (double &value : data_)
      value *= factor;
    return *this;
  }

  MultiVector &MultiVector::add(const double factor, const MultiVector &other)
  {
    for (std::size_t k = 0; k < data_.size(); ++k)
      data_[k] += factor * other.data_[k];
    return *this;
  }

  MultiVector MultiVector::columns(const unsigned int first, const unsigned int n) const
  {
    MultiVector result(rows, n);
    std::copy_n(column(first), std::size_t(n_local()) * n, result.data());
    return result;
  }

  namespace
  {
    void sum_over_ranks(const MPI_Comm comm, std::vector<double> &values)
    {
      MPI_Allreduce(MPI_IN_PLACE, values.data(), values.size(), MPI_DOUBLE, MPI_SUM, comm);
    }
  } // namespace

  MultiVector sum_entries(const RowRange &rows, const std::vector<PetscInt> &entry_rows,
                          const std::vector<PetscScalar> &values)
  {
    Vec vector = nullptr;
    SQUEAL_PETSC(VecCreateMPI(rows.comm, rows.n_local(), rows.size, &vector));
    SQUEAL_PETSC(VecSetOption(vector, VEC_IGNORE_NEGATIVE_INDICES, PETSC_TRUE));
    SQUEAL_PETSC(VecSetValues(vector, values.size(), entry_rows.data(), values.data(), ADD_VALUES));
    SQUEAL_PETSC(VecAssemblyBegin(vector));
    SQUEAL_PETSC(VecAssemblyEnd(vector));
    MultiVector result(rows, 1);
    const PetscScalar *array = nullptr;
    SQUEAL_PETSC(VecGetArrayRead(vector, &array));
    std::copy(array, array + rows.n_local(), result.data());
    SQUEAL_PETSC(VecRestoreArrayRead(vector, &array));
    SQUEAL_PETSC(VecDestroy(&vector));
    return result;
  }

  std::vector<double> replicate(const MultiVector &column)
  {
    const RowRange &range = column.row_range();
    int n_ranks = 0, n_local = range.n_local(), begin = range.begin;
    MPI_Comm_size(range.comm, &n_ranks);
    std::vector<int> counts(n_ranks), offsets(n_ranks);
    MPI_Allgather(&n_local, 1, MPI_INT, counts.data(), 1, MPI_INT, range.comm);
    MPI_Allgather(&begin, 1, MPI_INT, offsets.data(), 1, MPI_INT, range.comm);
    std::vector<double> all(range.size);
    MPI_Allgatherv(column.data(), n_local, MPI_DOUBLE, all.data(), counts.data(), offsets.data(),
                   MPI_DOUBLE, range.comm);
    return all;
  }

  MultiVector difference(MultiVector a, const MultiVector &b)
  {
    a -= b;
    return a;
  }

  double length_of(const MultiVector &column)
  {
    return std::sqrt(inner_product(column, column));
  }

  double largest_entry(const MultiVector &block)
  {
    double largest = 0;
    for (std::size_t k = 0; k < std::size_t(block.n_local()) * block.n_columns(); ++k)
      largest = std::max(largest, std::abs(block.data()[k]));
    MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, block.row_range().comm);
    return largest;
  }

  namespace
  {
    DenseView<double> columns_of(const MultiVector &block, const unsigned int first,
                                 const unsigned int n)
    {
      return {block.column(first), block.n_local(), n};
    }
    DenseView<double> all_of(const MultiVector &block)
    {
      return columns_of(block, 0, block.n_columns());
    }
  } // namespace

  DenseMatrix inner_products(const MultiVector &a, const MultiVector &b)
  {
    return inner_products(a, 0, a.n_columns(), b, 0, b.n_columns());
  }

  DenseMatrix inner_products(const MultiVector &a, const unsigned int first_a,
                             const unsigned int n_a, const MultiVector &b,
                             const unsigned int first_b, const unsigned int n_b)
  {
    DenseMatrix result = columns_of(a, first_a, n_a).transpose() * columns_of(b, first_b, n_b);
    sum_over_ranks(a.row_range().comm, result.values);
    return result;
  }

  double inner_product(const MultiVector &a, const MultiVector &b)
  {
    return inner_products(a, b)(0, 0);
  }

  MultiVector combine(const MultiVector &a, const DenseView<double> &coefficients)
  {
    MultiVector result(a.row_range(), coefficients.n_columns());
    gemm(1., all_of(a), coefficients, 0., result.data());
    return result;
  }

  void subtract_combination(MultiVector &b, const MultiVector &a,
                            const DenseView<double> &coefficients)
  {
    gemm(-1., all_of(a), coefficients, 1., b.data());
  }

  namespace
  {
    /// Scales the columns to unit length and leaves out those that are zero.
    MultiVector normalized_columns(const MultiVector &block)
    {
      const DenseMatrix gram = inner_products(block, block);
      std::vector<double> coefficients;
      unsigned int n_kept = 0;
      for (unsigned int j = 0; j < block.n_columns(); ++j)
        if (const double length = std::sqrt(gram(j, j)); length > 0)
        {
          coefficients.resize(std::size_t(block.n_columns()) * ++n_kept);
          coefficients[std::size_t(block.n_columns()) * (n_kept - 1) + j] = 1 / length;
        }
      return combine(block, coefficients, n_kept);
    }

    /// block -= basis basis^T block
    void project_out(const MultiVector &basis, MultiVector &block)
    {
      if (basis.n_columns() == 0)
        return;
      subtract_combination(block, basis, inner_products(basis, block));
    }
  } // namespace

  MultiVector orthonormalize(MultiVector block)
  {
    // Gram eigenvalues below this hold directions of length 1e-4, whose relative rounding error is
    // 1e-12.
    constexpr double resolved = 1e-8;
    constexpr double rounding = 1e-14;

    // Long directions first: what is left is short, and known to rounding of the original columns.
    // It must not be scaled before longer ones, which it contains by accident, are taken out.
    MultiVector basis(block.row_range(), 0);
    block = normalized_columns(block);
    while (block.n_columns() > 0)
    {
      project_out(basis, block);
      project_out(basis, block);
      const unsigned int n                  = block.n_columns();
      DenseMatrix vectors                   = inner_products(block, block);
      const std::vector<double> eigenvalues = symmetric_eigen(vectors);
      if (!(eigenvalues.back() > rounding * rounding))
        break;
      std::vector<double> kept, left;
      for (unsigned int j = 0; j < n; ++j)
      {
        const bool keep = eigenvalues[j] > resolved * eigenvalues.back();
        const double c  = keep ? 1 / std::sqrt(eigenvalues[j]) : 1;
        for (unsigned int i = 0; i < n; ++i)
          (keep ? kept : left).push_back(c * vectors(i, j));
      }
      MultiVector next = combine(block, kept, kept.size() / n);
      project_out(basis, next);
      basis.append(next);
      block = combine(block, left, left.size() / n);
    }

    // Loss of orthogonality by rounding is small by now: one more pass removes it.
    if (basis.n_columns() == 0)
      return basis;
    DenseMatrix vectors                   = inner_products(basis, basis);
    const std::vector<double> eigenvalues = symmetric_eigen(vectors);
    for (unsigned int j = 0; j < basis.n_columns(); ++j)
      for (unsigned int i = 0; i < basis.n_columns(); ++i)
        vectors(i, j) /= std::sqrt(eigenvalues[j]);
    return combine(basis, vectors);
  }

  void scale_columns(MultiVector &block, const std::vector<double> &factors)
  {
    for (unsigned int j = 0; j < block.n_columns(); ++j)
      for (unsigned int i = 0; i < block.n_local(); ++i)
        block.column(j)[i] *= factors[j];
  }

  DenseMatrix gather_rows(const MultiVector &block, const std::vector<unsigned int> &wanted)
  {
    const RowRange &range = block.row_range();
    DenseMatrix result(block.n_columns(), wanted.size());
    for (unsigned int j = 0; j < block.n_columns(); ++j) // columns are what lies together
      for (unsigned int r = 0; r < wanted.size(); ++r)
        if (range.contains(wanted[r]))
          result(j, r) = block.column(j)[wanted[r] - range.begin];
    sum_over_ranks(range.comm, result.values);
    return result;
  }

  MultiVector unit_columns(const RowRange &rows, const std::vector<unsigned int> &numbers)
  {
    MultiVector block(rows, numbers.size());
    for (unsigned int j = 0; j < numbers.size(); ++j)
      if (rows.contains(numbers[j]))
        block.column(j)[numbers[j] - rows.begin] = 1;
    return block;
  }

  void clear_rows(MultiVector &block, const std::vector<unsigned int> &cleared)
  {
    const RowRange &range = block.row_range();
    for (unsigned int j = 0; j < block.n_columns(); ++j)
      for (const unsigned int row : cleared)
        if (range.contains(row))
          block.column(j)[row - range.begin] = 0;
  }

  DenseMatrix grow_products(const DenseMatrix &known, const MultiVector &a, const MultiVector &b)
  {
    return grow(known, a.n_columns(),
                [&](const unsigned int row, const unsigned int n_rows, const unsigned int column,
                    const unsigned int n_columns)
                { return inner_products(a, row, n_rows, b, column, n_columns); });
  }

  MultiVector to_multi_vector(const DenseMatrix &a)
  {
    MultiVector block(small_rows(a.n_rows), a.n_columns);
    std::copy(a.values.begin(), a.values.end(), block.data());
    return block;
  }
} // namespace squeal
