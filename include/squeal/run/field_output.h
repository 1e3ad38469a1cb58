#pragma once

#include <squeal/assessment/tables.h>
#include <squeal/base/log.h>
#include <squeal/model/brake_model.h>

#include <string>
#include <vector>

namespace squeal
{
  /// Writes the fields of the present steady state and of the modes that Output/Fields asks for:
  /// all, or those that grow, that are undecided, and else the least stable one. Tells the
  /// progress. Collective. Throws std::runtime_error where a file cannot be written.
  template <int dim>
  void write_fields(const BrakeModel<dim> &model, const EigenPairs &modes,
                    const std::vector<ModeRow> &rows, const std::string &directory,
                    unsigned int cycle, Log &log);
} // namespace squeal
