#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/linalg/linear_algebra.h>

#include <petscblaslapack.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

/// Small matrices beside blocks of long vectors: the tools of ReducedModel, of contacts that open
/// and close, and of others.
namespace squeal
{
  namespace reduced
  {
    /// Rows of a block as columns of a small matrix on all ranks.
    inline DenseMatrix gather_rows(const MultiVector &block,
                                   const std::vector<unsigned int> &wanted)
    {
      const RowRange &range = block.row_range();
      DenseMatrix result(block.n_columns(), wanted.size());
      for (unsigned int j = 0; j < block.n_columns(); ++j) // columns are what lies together
        for (unsigned int r = 0; r < wanted.size(); ++r)
          if (range.contains(wanted[r]))
            result(j, r) = block.column(j)[wanted[r] - range.begin];
      MPI_Allreduce(MPI_IN_PLACE, result.values.data(), result.values.size(), MPI_DOUBLE, MPI_SUM,
                    range.comm);
      return result;
    }

    /// The columns e_i of the given rows i.
    inline MultiVector unit_columns(const RowRange &rows, const std::vector<unsigned int> &numbers)
    {
      MultiVector block(rows, numbers.size());
      for (unsigned int j = 0; j < numbers.size(); ++j)
        if (rows.contains(numbers[j]))
          block.column(j)[numbers[j] - rows.begin] = 1;
      return block;
    }

    inline void clear_rows(MultiVector &block, const std::vector<unsigned int> &cleared)
    {
      const RowRange &range = block.row_range();
      for (unsigned int j = 0; j < block.n_columns(); ++j)
        for (const unsigned int row : cleared)
          if (range.contains(row))
            block.column(j)[row - range.begin] = 0;
    }

    /// A square matrix of which the first rows and columns are known; @p block gives rows and
    /// columns (first, number) of it.
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

    /// A^T B of blocks, the first part known.
    inline DenseMatrix grow_products(const DenseMatrix &known, const MultiVector &a,
                                     const MultiVector &b)
    {
      return grow(known, a.n_columns(),
                  [&](const unsigned int row, const unsigned int n_rows, const unsigned int column,
                      const unsigned int n_columns) {
                    return DenseMatrix(n_rows, n_columns,
                                       inner_products(a, row, n_rows, b, column, n_columns));
                  });
    }

    inline DenseMatrix some_rows(const DenseMatrix &a, const unsigned int first,
                                 const unsigned int n)
    {
      DenseMatrix result(n, a.n_columns);
      for (unsigned int j = 0; j < a.n_columns; ++j)
        std::copy_n(&a.values[first + std::size_t(j) * a.n_rows], n,
                    result.values.data() + std::size_t(j) * n);
      return result;
    }

    inline void add(const double factor, const DenseMatrix &a, DenseMatrix &sum)
    {
      if (a.values.empty() || factor == 0)
        return;
      if (sum.values.empty())
        sum = DenseMatrix(a.n_rows, a.n_columns);
      for (std::size_t k = 0; k < a.values.size(); ++k)
        sum.values[k] += factor * a.values[k];
    }

    inline RowRange small_rows(const unsigned int n)
    {
      return {MPI_COMM_SELF, 0, n, n};
    }

    inline Matrix sparse(const DenseMatrix &a)
    {
      if (a.values.empty())
        return {};
      Matrix matrix =
          make_matrix(small_rows(a.n_rows), std::vector<PetscInt>(a.n_rows, a.n_columns),
                      std::vector<PetscInt>(a.n_rows, 0));
      std::vector<PetscInt> numbers(a.n_rows);
      std::iota(numbers.begin(), numbers.end(), 0);
      const DenseMatrix by_row = transposed(a);
      SQUEAL_PETSC(MatSetValues(matrix, a.n_rows, numbers.data(), a.n_columns, numbers.data(),
                                by_row.values.data(), INSERT_VALUES));
      compress(matrix);
      return matrix;
    }

    inline MultiVector to_block(const DenseMatrix &a)
    {
      MultiVector block(small_rows(a.n_rows), a.n_columns);
      std::copy(a.values.begin(), a.values.end(), block.data());
      return block;
    }

    /// A symmetric positive definite C, factorised once by Cholesky's method for many right sides.
    class PositiveFactors
    {
    public:
      PositiveFactors() = default;
      /// Throws SolverError if C is singular to working precision.
      explicit PositiveFactors(DenseMatrix c) : factors(std::move(c))
      {
        const PetscBLASInt n = factors.n_rows;
        PetscBLASInt info    = 0;
        if (n > 0)
          LAPACKpotrf_("U", &n, factors.values.data(), &n, &info);
        if (info != 0)
          throw SolverError("The contact's constraints depend on one another (row " +
                            std::to_string(info) + " of " + std::to_string(n) + ").");
      }
      /// C^{-1} B.
      DenseMatrix solve(DenseMatrix b) const
      {
        const PetscBLASInt n = b.n_rows, n_rhs = b.n_columns;
        PetscBLASInt info = 0;
        if (n > 0 && n_rhs > 0)
          LAPACKpotrs_("U", &n, &n_rhs, factors.values.data(), &n, b.values.data(), &n, &info);
        return b;
      }

    private:
      DenseMatrix factors;
    };

    inline void scale_columns(MultiVector &block, const std::vector<double> &factors)
    {
      for (unsigned int j = 0; j < block.n_columns(); ++j)
        for (unsigned int i = 0; i < block.n_local(); ++i)
          block.column(j)[i] *= factors[j];
    }

    template <typename Function>
    void for_entries(const Matrix &matrix, const Function &function)
    {
      PetscInt begin = 0, end = 0;
      SQUEAL_PETSC(MatGetOwnershipRange(matrix, &begin, &end));
      for (PetscInt row = begin; row < end; ++row)
      {
        PetscInt n                = 0;
        const PetscInt *columns   = nullptr;
        const PetscScalar *values = nullptr;
        SQUEAL_PETSC(MatGetRow(matrix, row, &n, &columns, &values));
        for (PetscInt k = 0; k < n; ++k)
          if (values[k] != 0)
            function(row, columns[k], values[k]);
        SQUEAL_PETSC(MatRestoreRow(matrix, row, &n, &columns, &values));
      }
    }

    /// The same list on all ranks.
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

    /// How a complex vector a + i b is turned so that a is as long as can be, a and b orthogonal.
    struct MainPart
    {
      std::complex<double> turn; ///< factor of modulus 1
      double longer, shorter;    ///< |a|^2 and |b|^2 afterwards
    };
    /// Of vectors given by the local parts of a and b.
    inline std::vector<MainPart>
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

    /// The principal components of a block, heaviest first, by the inner product of a part of its
    /// rows.
    struct Components
    {
      std::vector<double> sizes;
      DenseMatrix vectors;
    };
    inline Components principal_components(const MultiVector &part)
    {
      const unsigned int n = part.n_columns();
      DenseMatrix vectors(n, n, inner_products(part, part));
      const std::vector<double> eig = symmetric_eigen(vectors);
      Components result;
      result.vectors = DenseMatrix(n, n);
      for (unsigned int j = 0; j < n; ++j)
      {
        result.sizes.push_back(std::sqrt(std::max(0., eig[n - 1 - j])));
        std::copy_n(&vectors.values[std::size_t(n - 1 - j) * n], n,
                    &result.vectors.values[std::size_t(j) * n]);
      }
      return result;
    }
  } // namespace reduced
} // namespace squeal
