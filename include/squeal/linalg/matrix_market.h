#pragma once

#include <squeal/linalg/matrix.h>

#include <string>

namespace squeal
{
  /// A sparse matrix as a list of entries, zero-based.
  struct MatrixMarketFile
  {
    unsigned int n_rows = 0, n_columns = 0;
    std::vector<PetscInt> rows, columns;
    std::vector<double> values;
  };

  /// Reads a real Matrix Market file, coordinate or array, general, symmetric or skew-symmetric.
  /// Throws InputError with file and line. @p key is the parameter that named the file.
  MatrixMarketFile read_matrix_market(const std::string &filename, const std::string &key);

  /// The rows of the file that this rank owns, as a matrix.
  Matrix distribute(const MatrixMarketFile &file, const RowRange &rows);
} // namespace squeal
