#pragma once

#include <squeal/linalg/matrix.h>

#include <complex>
#include <string>
#include <vector>

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

  /// A number with as many digits as it takes to read it back exactly.
  std::string exact_text(double value);

  /// Writes a sparse matrix of which each rank has entries, in a form that is read back to the last
  /// bit: coordinate real general. @p comments are lines of the header. Collective; rank 0 writes.
  /// Throws as write_file().
  void write_matrix_market(const std::string &filename, const MatrixMarketFile &own,
                           const std::vector<std::string> &comments, MPI_Comm comm);

  /// Writes a dense complex matrix whose columns all have the same length: array complex general.
  /// Rank 0 has the columns and writes; other ranks may call it. Throws as write_file().
  void write_matrix_market(const std::string &filename,
                           const std::vector<std::vector<std::complex<double>>> &columns,
                           const std::vector<std::string> &comments, MPI_Comm comm);
} // namespace squeal
