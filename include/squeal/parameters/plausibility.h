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

  /// The window of frequencies, as "up to 6000 Hz" or "from 10000 to 12000 Hz".
  std::string window_of(const Parameters::Eigenproblem &parameters);

  /// Says in a line that a window without modes is no verdict; @p where none were found, such as
  /// "at 3 of 10 values", or nothing.
  std::string no_modes(const Parameters::Eigenproblem &parameters, const std::string &where = "");

  /// A doubt about the window where cells of edge length @p cell_size (m) of the initial mesh are
  /// too long for waves of its upper end in @p body; empty if there is none.
  std::string doubt_about_window(const Parameters::All &parameters,
                                 const Parameters::BodyMaterial &body, double cell_size);
} // namespace squeal
