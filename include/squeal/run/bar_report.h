#pragma once

#include <squeal/assessment/tables.h>
#include <squeal/parameters/parameters.h>

#include <string>
#include <vector>

namespace squeal
{
  /// What a run with one polynomial degree more would ask for.
  struct NextDegree
  {
    double n_unknowns, memory_mib; ///< the second is 0 where nothing is known of it
  };

  /// Has a line of bars.csv: what one cause alone may change of a mode.
  Fields bar_fields(unsigned int cycle, unsigned int mode, const BarPart &part, unsigned int j);

  /// Tells what makes up the bars of flutter and undecided growth rates, a line each for at most
  /// ten of them, and for undecided ones what would make the bars shorter.
  std::string describe_bars(const std::vector<ModeRow> &rows, const std::vector<BarPart> &parts,
                            const Parameters::All &parameters, const NextDegree &next);
} // namespace squeal
