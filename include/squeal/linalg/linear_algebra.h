#pragma once

#include <squeal/base/errors.h>

#include <petscmat.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  /// Throws SolverError with PETSc's own text when a PETSc or SLEPc call fails.
  void check_petsc(PetscErrorCode code, const char *call);

#define SQUEAL_PETSC(call) ::squeal::check_petsc(call, #call)

  /// Owns a PETSc matrix (real, AIJ, rows distributed). Movable, not copyable; may be empty, which
  /// everywhere means the zero matrix.
  class Matrix
  {
  public:
    Matrix() = default;
    explicit Matrix(Mat mat) : mat(mat) {}
    Matrix(Matrix &&other) noexcept
        : mat(std::exchange(other.mat, nullptr)), transposes(other.transposes)
    {
    }
    Matrix &operator=(Matrix &&other) noexcept
    {
      std::swap(mat, other.mat);
      std::swap(transposes, other.transposes);
      return *this;
    }
    Matrix(const Matrix &)            = delete;
    Matrix &operator=(const Matrix &) = delete;
    ~Matrix();

    /// The same matrix or its transpose, without a copy of the entries: for multiply() and
    /// infinity_norm() only.
    Matrix view(bool transposed) const;
    bool is_transposed() const
    {
      return transposes;
    }
    /// What PETSc stores: of a transposed view the matrix itself.
    Mat stored() const
    {
      return mat;
    }

    /// Throws std::logic_error for a transposed view.
    operator Mat() const;
    explicit operator bool() const
    {
      return mat != nullptr;
    }

    /// 0 for the empty matrix; of one without entries a lower bound, most often the norm itself.
    double infinity_norm() const;
    std::uint64_t n_nonzeros() const; ///< summed over all ranks

  private:
    Mat mat         = nullptr;
    bool transposes = false;
  };

  /// The rows of the distributed unknowns that this rank owns: [begin, end) of size in all.
  struct RowRange
  {
    MPI_Comm comm      = MPI_COMM_NULL;
    unsigned int begin = 0, end = 0, size = 0;

    unsigned int n_local() const
    {
      return end - begin;
    }
    bool contains(const unsigned int row) const
    {
      return begin <= row && row < end;
    }
  };

  /// An empty matrix with room for n_columns[i] entries in the i-th local row; only that many are
  /// stored and a further one is an error. diagonal and off_diagonal count the columns inside and
  /// outside the rank's own range.
  Matrix make_matrix(const RowRange &rows, const std::vector<PetscInt> &diagonal,
                     const std::vector<PetscInt> &off_diagonal);

  /// Completes the assembly.
  void compress(const Matrix &matrix);

  /// One summand of a sum of matrices.
  struct Summand
  {
    double coefficient;
    Mat matrix;
    bool transposed_too = false; ///< add also the transpose: used to symmetrise
  };

  /// sum_i c_i A_i on the union of the patterns; entries that cancel are not stored. Empty if every
  /// summand is.
  Matrix sum_of(const RowRange &rows, const std::vector<Summand> &summands);

  /// (A + A^T)/2.
  Matrix symmetric_part(const RowRange &rows, const Matrix &matrix);

  /// Collects entries (row, column, value), own rows or not, and makes a matrix of them, in which
  /// those in the same place are added. Zeros are not stored.
  class EntryList
  {
  public:
    /// Entries with a negative row or column are skipped.
    void add(const int row, const int column, const double value)
    {
      if (row >= 0 && column >= 0 && value != 0)
        entries.push_back({row, column, value});
    }
    /// Collective.
    Matrix make_matrix(const RowRange &range) const;

  private:
    struct Entry
    {
      PetscInt row, column;
      PetscScalar value;
    };
    /// One entry for each place, by ascending rows and columns.
    std::vector<Entry> summed(const RowRange &range) const;
    /// Entries by ascending rows become those that the ranks have of this rank's rows; returns
    /// where those of each rank begin, and the end.
    static std::vector<int> hand_over(const RowRange &range, std::vector<Entry> &sorted);

    std::vector<Entry> entries;
  };

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

  /// A matrix without entries: what is known are its products (with true: those of its transpose).
  /// For multiply(), multiply_transposed() and infinity_norm() only.
  Matrix make_matrix_free(const RowRange &rows,
                          std::function<MultiVector(const MultiVector &, bool transposed)> product);
  /// The product of such a matrix; nothing for one with entries.
  const std::function<MultiVector(const MultiVector &, bool transposed)> *
  product_of(const Matrix &matrix);

  /// A^T B as a small dense matrix, column-major, the same on all ranks.
  std::vector<double> inner_products(const MultiVector &a, const MultiVector &b);
  /// The same of n_a columns of A from first_a on, and of B likewise.
  std::vector<double> inner_products(const MultiVector &a, unsigned int first_a, unsigned int n_a,
                                     const MultiVector &b, unsigned int first_b, unsigned int n_b);

  /// A C with a small dense C, column-major, of n_columns columns.
  MultiVector combine(const MultiVector &a, const std::vector<double> &coefficients,
                      unsigned int n_columns);

  /// B := B - A C with a small dense C, column-major.
  void subtract_combination(MultiVector &b, const MultiVector &a,
                            const std::vector<double> &coefficients);

  /// An orthonormal basis of the span of the columns; only directions that are linear combinations
  /// of the others up to rounding are dropped. Level-3 operations throughout: SVQB (Stathopoulos
  /// and Wu, 2002) keeps the well-conditioned directions of the Gram matrix; the others, which the
  /// Gram matrix cannot resolve, are formed explicitly, orthogonalised against what was kept, and
  /// treated the same way.
  MultiVector orthonormalize(MultiVector block);

  /// A sparse LU or LDL^T factorisation by MUMPS.
  class Factorization
  {
  public:
    enum class Kind
    {
      lu,
      ldlt
    };
    /// Throws SolverError if the matrix is singular, and if the memory that the analysis of its
    /// pattern predicts is not there, before any of it is taken.
    Factorization(const Matrix &matrix, Kind kind, const std::string &what);
    ~Factorization();
    Factorization(const Factorization &)            = delete;
    Factorization &operator=(const Factorization &) = delete;

    /// Becomes that of another matrix with the same pattern, whose analysis serves again.
    void renew(const Matrix &matrix);

    /// A^{-1} B.
    MultiVector solve(const MultiVector &right_hand_sides) const;
    /// A^{-T} B.
    MultiVector solve_transposed(const MultiVector &right_hand_sides) const;

    struct Inertia
    {
      unsigned int negative, zero, positive;
    };
    /// Signs of the eigenvalues of a symmetric matrix (Sylvester's law). Kind ldlt only.
    Inertia inertia() const;

    double memory_mib() const; ///< used, all ranks together
    double predicted_memory_mib() const
    {
      return predicted_mib;
    }
    Mat factor() const
    {
      return mat;
    }

  private:
    /// Marks it as symmetric if that is what is factorised. Throws SolverError if there are numbers
    /// too large to compute with.
    void prepare(const Matrix &matrix) const;
    void analyse(const Matrix &matrix);
    void factorise(const Matrix &matrix);
    /// Throws SolverError if the machine lacks the memory that the analysis predicts.
    void check_memory(MPI_Comm comm);

    Mat mat = nullptr;
    MatFactorInfo info{};
    const bool lu;
    const std::string what;
    double predicted_mib = 0;
  };
} // namespace squeal
