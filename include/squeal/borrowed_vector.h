#pragma once

#include <squeal/linear_algebra.h>

namespace squeal
{
  /// A PETSc vector that borrows the numbers of a column.
  class BorrowedVector
  {
  public:
    BorrowedVector(const RowRange &rows, double *data)
    {
      SQUEAL_PETSC(VecCreateMPIWithArray(rows.comm, 1, rows.n_local(), rows.size, data, &vec));
    }
    /// Of a column that is only read.
    explicit BorrowedVector(const Block &column)
        : BorrowedVector(column.row_range(), const_cast<double *>(column.data()))
    {
    }
    ~BorrowedVector()
    {
      VecDestroy(&vec);
    }
    BorrowedVector(const BorrowedVector &)            = delete;
    BorrowedVector &operator=(const BorrowedVector &) = delete;
    operator Vec() const
    {
      return vec;
    }

  private:
    Vec vec = nullptr;
  };
} // namespace squeal
