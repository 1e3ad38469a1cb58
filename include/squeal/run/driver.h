#pragma once

#include <squeal/run/analysis.h>

namespace squeal
{
  /// The analysis that the scene of the parameter file asks for. Collective.
  std::unique_ptr<Analysis> make_analysis(ParameterFile &file, const std::string &directory,
                                          MPI_Comm comm);
} // namespace squeal
