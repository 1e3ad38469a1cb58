#pragma once

#include <squeal/parameters/parameter_file.h>
#include <squeal/run/run_directory.h>

#include <mpi.h>

#include <string>

namespace squeal
{
  /// Runs what the parameter file asks for; log, tables and fields go to the directory. Throws
  /// InputError, SolverError, Interrupted. Collective.
  void run(ParameterFile &file, const std::string &directory, MPI_Comm comm,
           const RunDirectory::Options &options);
} // namespace squeal
