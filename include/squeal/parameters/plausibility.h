#pragma once

#include <squeal/parameters/parameters.h>

#include <string>
#include <vector>

/// Whether parameters are those of a brake in SI units. Nothing is refused here: each doubt is a
/// line that begins with "Warning" and says what is there, what is usual, and what may be meant.
namespace squeal
{
  struct Range
  {
    double low, high;
    bool holds(const double value) const
    {
      return value >= low && value <= high;
    }
  };
  constexpr Range usual_pressure = {1e3, 1e8}; ///< of pads, Pa

  /// Doubts that need no computing, of the parameters of a run or of one value of a study.
  std::vector<std::string> doubts(const Parameters::All &parameters);

  /// A doubt about the window where cells of edge length @p cell_size (m) of the initial mesh are
  /// too long for waves of its upper end in @p body; empty if there is none.
  std::string doubt_about_window(const Parameters::All &parameters,
                                 const Parameters::BodyMaterial &body, double cell_size);
} // namespace squeal
