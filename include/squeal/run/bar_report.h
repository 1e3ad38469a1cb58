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

  /// The relative change of a parameter that takes a growth rate to zero, by its derivative.
  struct VerdictMargin
  {
    std::string parameter;
    unsigned int row; ///< of the mode
    double relative_change;
  };

  /// Tells which changes of single parameters turn the verdicts of flutter and undecided modes, and
  /// of the mode that grows first otherwise: a line each with the three smallest.
  std::string describe_margins(const std::vector<ModeRow> &rows,
                               std::vector<VerdictMargin> margins);
} // namespace squeal
