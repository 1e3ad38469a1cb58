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
  class MultiVector;
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

    /// Gives the matrix or its transpose without a copy of the entries: for multiply() and
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

  /// A matrix without entries: what is known are its products (with true: those of its transpose).
  /// For multiply(), multiply_transposed() and infinity_norm() only.
  Matrix make_matrix_free(const RowRange &rows,
                          std::function<MultiVector(const MultiVector &, bool transposed)> product);
  /// The product of such a matrix; nothing for one with entries.
  const std::function<MultiVector(const MultiVector &, bool transposed)> *
  product_of(const Matrix &matrix);

  /// Calls function(row, column, value) for each entry of this rank's rows that is not zero.
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
} // namespace squeal
