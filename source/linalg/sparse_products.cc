#include <squeal/linalg/compressed_rows.h>
#include <squeal/linalg/petsc_vector_view.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <type_traits>

// A sparse matrix times a block of vectors, eight columns at a time: they are gathered row by row
// into chunks, all entries of the matrix pass over them once, and the results are scattered back.
// Columns of other ranks come by one exchange per block. PETSc's MatMatMult takes 2.5 times as long
// for 44 columns.
namespace squeal
{
  namespace
  {
    /// So many columns share one pass over the matrix, which is what limits the speed.
    constexpr unsigned int width = 8;
    using Chunk                  = std::array<double, width>;

    /// Written before it is read: zeros at first would cost as much as a pass over a sparse matrix.
    using Chunks = std::vector<Chunk, Unfilled<Chunk>>;

    /// Columns first ... first + width of a block, row by row; zeros beyond the last. Row by row
    /// because a pass for each column would touch all of the chunks each time.
    void gather(const MultiVector &block, const unsigned int first, Chunks &rows)
    {
      const unsigned int n_rows = block.n_local(), n = std::min(width, block.n_columns() - first);
      const double *const data = block.column(first);
      const auto copy          = [&](const auto n_copied)
      {
        for (unsigned int i = 0; i < n_rows; ++i)
          for (unsigned int c = 0; c < n_copied; ++c)
            rows[i][c] = data[std::size_t(c) * n_rows + i];
      };
      if (n == width)
        copy(std::integral_constant<unsigned int, width>()); // unrolled
      else
      {
        std::fill(rows.begin(), rows.end(), Chunk{});
        copy(n);
      }
    }

    /// The way back.
    void scatter(const Chunks &rows, const unsigned int first, MultiVector &block)
    {
      const unsigned int n_rows = block.n_local(), n = std::min(width, block.n_columns() - first);
      double *const data = block.column(first);
      for (unsigned int i = 0; i < n_rows; ++i)
        for (unsigned int c = 0; c < n; ++c)
          data[std::size_t(c) * n_rows + i] = rows[i][c];
    }

    /// Rows one after the other, which somebody else keeps.
    class Csr
    {
    public:
      explicit Csr(const SequentialRows &rows)
          : n_rows(rows.n_rows), begins(rows.begins), columns(rows.columns), values(rows.values)
      {
      }
      explicit Csr(const CompressedRows &rows)
          : n_rows(rows.begins.size() - 1), begins(rows.begins.data()),
            columns(rows.columns.data()), values(rows.values.data())
      {
      }

      void add_product(const Chunk *x, Chunk *y) const
      {
        add_product(n_rows, begins, columns, values, x, y);
      }

      void add_transposed_product(const Chunk *x, Chunk *y) const
      {
        add_transposed_product(n_rows, begins, columns, values, x, y);
      }

    private:
      /// y += A x. Compiled for wider registers too; the loader takes what the processor has.
      /// (Levels and not names of processors: these are of one maker.)
      __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4"))) static void
      add_product(PetscInt n_rows, const PetscInt *begins, const PetscInt *columns,
                  const PetscScalar *values, const Chunk *x, Chunk *y);
      /// y += A^T x.
      __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4"))) static void
      add_transposed_product(PetscInt n_rows, const PetscInt *begins, const PetscInt *columns,
                             const PetscScalar *values, const Chunk *x, Chunk *y);

      const PetscInt n_rows, *const begins, *const columns;
      const PetscScalar *const values;
    };

    void Csr::add_product(const PetscInt n_rows, const PetscInt *begins, const PetscInt *columns,
                          const PetscScalar *values, const Chunk *x, Chunk *y)
    {
      for (PetscInt i = 0; i < n_rows; ++i)
      {
        // Two sums, neither of which waits for the other: measured 1.7 times as fast as one.
        Chunk sum = y[i], other = {};
        const PetscInt end = begins[i + 1];
        PetscInt k         = begins[i];
        for (; k + 1 < end; k += 2)
        {
          const double a = values[k], b = values[k + 1];
          const Chunk &of_x = x[columns[k]], &next_of_x = x[columns[k + 1]];
          for (unsigned int c = 0; c < width; ++c)
          {
            sum[c] += a * of_x[c];
            other[c] += b * next_of_x[c];
          }
        }
        for (unsigned int c = 0; k < end && c < width; ++c)
          sum[c] += values[k] * x[columns[k]][c];
        for (unsigned int c = 0; c < width; ++c)
          y[i][c] = sum[c] + other[c];
      }
    }

    void Csr::add_transposed_product(const PetscInt n_rows, const PetscInt *begins,
                                     const PetscInt *columns, const PetscScalar *values,
                                     const Chunk *x, Chunk *y)
    {
      for (PetscInt i = 0; i < n_rows; ++i)
      {
        const Chunk of_x = x[i];
        for (PetscInt k = begins[i]; k < begins[i + 1]; ++k)
        {
          const double a = values[k];
          Chunk &of_y    = y[columns[k]];
          for (unsigned int c = 0; c < width; ++c)
            of_y[c] += a * of_x[c];
        }
      }
    }

    /// Rows of a block that other ranks own.
    class GhostRows
    {
    public:
      /// @p wanted are ascending global numbers. Collective.
      GhostRows(const RowRange &rows, const PetscInt *wanted, const PetscInt n_wanted) : rows(rows)
      {
        int n_ranks = 0;
        MPI_Comm_size(rows.comm, &n_ranks);
        std::vector<unsigned int> ends(n_ranks);
        MPI_Allgather(&rows.end, 1, MPI_UNSIGNED, ends.data(), 1, MPI_UNSIGNED, rows.comm);
        n_received.assign(n_ranks, 0);
        n_sent.assign(n_ranks, 0);
        for (PetscInt i = 0; i < n_wanted; ++i)
          ++n_received[std::upper_bound(ends.begin(), ends.end(), (unsigned int)(wanted[i])) -
                       ends.begin()];
        MPI_Alltoall(n_received.data(), 1, MPI_INT, n_sent.data(), 1, MPI_INT, rows.comm);
        sent.resize(std::accumulate(n_sent.begin(), n_sent.end(), 0));
        MPI_Alltoallv(wanted, n_received.data(), offsets(n_received).data(), MPIU_INT, sent.data(),
                      n_sent.data(), offsets(n_sent).data(), MPIU_INT, rows.comm);
      }

      std::vector<Chunk> operator()(const Chunks &own) const
      {
        std::vector<Chunk> outgoing,
            incoming(std::accumulate(n_received.begin(), n_received.end(), 0));
        for (const PetscInt row : sent)
          outgoing.push_back(own[row - rows.begin]);
        const std::vector<int> send = numbers(n_sent), receive = numbers(n_received);
        MPI_Alltoallv(outgoing.data(), send.data(), offsets(send).data(), MPI_DOUBLE,
                      incoming.data(), receive.data(), offsets(receive).data(), MPI_DOUBLE,
                      rows.comm);
        return incoming;
      }

      /// The way back: adds to the owners' rows.
      void add_back(const std::vector<Chunk> &ghosts, Chunks &own) const
      {
        std::vector<Chunk> incoming(sent.size());
        const std::vector<int> send = numbers(n_received), receive = numbers(n_sent);
        MPI_Alltoallv(ghosts.data(), send.data(), offsets(send).data(), MPI_DOUBLE, incoming.data(),
                      receive.data(), offsets(receive).data(), MPI_DOUBLE, rows.comm);
        for (std::size_t k = 0; k < sent.size(); ++k)
          for (unsigned int c = 0; c < width; ++c)
            own[sent[k] - rows.begin][c] += incoming[k][c];
      }

    private:
      static std::vector<int> numbers(std::vector<int> counts)
      {
        for (int &count : counts)
          count *= width;
        return counts;
      }
      static std::vector<int> offsets(const std::vector<int> &counts)
      {
        std::vector<int> result(counts.size(), 0);
        std::partial_sum(counts.begin(), counts.end() - 1, result.begin() + 1);
        return result;
      }

      const RowRange rows;
      std::vector<int> n_received, n_sent;
      std::vector<PetscInt> sent;
    };

    MultiVector product(const Matrix &matrix, const MultiVector &block, const bool of_transpose)
    {
      const bool transposed     = of_transpose != matrix.is_transposed();
      const unsigned int n_rows = block.n_local(), n_columns = block.n_columns();
      MultiVector result(block.row_range(), n_columns);
      if (!matrix || n_columns == 0)
        return result;
      if (const auto *of_matrix = product_of(matrix))
        return (*of_matrix)(block, transposed);
      if (n_columns == 1)
      {
        const PetscVectorView x(block), y(result);
        SQUEAL_PETSC((transposed ? MatMultTranspose : MatMult)(matrix.stored(), x, y));
        return result;
      }
      PetscBool is_parallel = PETSC_FALSE;
      SQUEAL_PETSC(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(matrix.stored()), MATMPIAIJ,
                                          &is_parallel));
      Mat own = matrix.stored(), coupling = nullptr;
      const PetscInt *ghosts = nullptr;
      PetscInt n_ghosts      = 0;
      if (is_parallel)
      {
        SQUEAL_PETSC(MatMPIAIJGetSeqAIJ(matrix.stored(), &own, &coupling, &ghosts));
        SQUEAL_PETSC(MatGetSize(coupling, nullptr, &n_ghosts));
      }
      const SequentialRows of_own(own);
      const auto of_coupling = coupling ? std::make_unique<SequentialRows>(coupling) : nullptr;
      const Csr own_rows(of_own);
      const auto coupled = coupling ? std::make_unique<Csr>(*of_coupling) : nullptr;
      const std::unique_ptr<GhostRows> ghost_rows =
          coupling ? std::make_unique<GhostRows>(block.row_range(), ghosts, n_ghosts) : nullptr;
      Chunks x(n_rows), y(n_rows);
      for (unsigned int first = 0; first < n_columns; first += width)
      {
        gather(block, first, x);
        std::fill(y.begin(), y.end(), Chunk{});
        if (transposed)
        {
          own_rows.add_transposed_product(x.data(), y.data());
          if (coupled)
          {
            std::vector<Chunk> of_ghosts(n_ghosts, Chunk{});
            coupled->add_transposed_product(x.data(), of_ghosts.data());
            ghost_rows->add_back(of_ghosts, y);
          }
        }
        else
        {
          own_rows.add_product(x.data(), y.data());
          if (coupled)
            coupled->add_product((*ghost_rows)(x).data(), y.data());
        }
        scatter(y, first, result);
      }
      return result;
    }

    void add_product_of_rows(const double c, const CompressedRows &a, const bool transposed,
                             const DenseMatrix &x, DenseMatrix &y)
    {
      const unsigned int m = x.n_rows;
      const Csr rows(a);
      Chunks of_x(x.n_columns), of_y(y.n_columns);
      for (unsigned int first = 0; first < m; first += width)
      {
        const unsigned int n = std::min(width, m - first);
        if (n < width)
          std::fill(of_x.begin(), of_x.end(), Chunk{});
        for (unsigned int k = 0; k < x.n_columns; ++k)
          std::copy_n(&x.values[first + std::size_t(k) * m], n, of_x[k].begin());
        std::fill(of_y.begin(), of_y.end(), Chunk{});
        if (transposed)
          rows.add_transposed_product(of_x.data(), of_y.data());
        else
          rows.add_product(of_x.data(), of_y.data());
        for (unsigned int k = 0; k < y.n_columns; ++k)
          for (unsigned int i = 0; i < n; ++i)
            y.values[first + i + std::size_t(k) * m] += c * of_y[k][i];
      }
    }
  } // namespace

  void add_product(const double c, const CompressedRows &a, const DenseMatrix &x, DenseMatrix &y)
  {
    add_product_of_rows(c, a, false, x, y);
  }

  void add_transposed_product(const double c, const CompressedRows &a, const DenseMatrix &x,
                              DenseMatrix &y)
  {
    add_product_of_rows(c, a, true, x, y);
  }

  MultiVector multiply(const Matrix &matrix, const MultiVector &block)
  {
    return product(matrix, block, false);
  }

  MultiVector multiply_transposed(const Matrix &matrix, const MultiVector &block)
  {
    return product(matrix, block, true);
  }
} // namespace squeal
