#pragma once

#include <squeal/linalg/multi_vector.h>

namespace squeal
{
  /// A PETSc vector that borrows the numbers of a column.
  class PetscVectorView
  {
  public:
    PetscVectorView(const RowRange &rows, double *data)
    {
      SQUEAL_PETSC(VecCreateMPIWithArray(rows.comm, 1, rows.n_local(), rows.size, data, &vec));
    }
    /// Views a column that is only read.
    explicit PetscVectorView(const MultiVector &column)
        : PetscVectorView(column.row_range(), const_cast<double *>(column.data()))
    {
    }
    ~PetscVectorView()
    {
      VecDestroy(&vec);
    }
    PetscVectorView(const PetscVectorView &)            = delete;
    PetscVectorView &operator=(const PetscVectorView &) = delete;
    operator Vec() const
    {
      return vec;
    }

  private:
    Vec vec = nullptr;
  };
} // namespace squeal
