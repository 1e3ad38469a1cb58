#pragma once

#include <vector>

namespace squeal
{
  /// Interval ends of n equal cells on [a, b], of which the first (last) is divided @p at_start (@p
  /// at_end) times, each time at @p ratio times the last cut's distance from the end. So each layer
  /// is @p ratio times as thick as the next one inwards, but the outermost one, which is not
  /// divided any more, is ratio/(1 - ratio) times as thick as its neighbour.
  std::vector<double> graded_points(double a, double b, unsigned int n, unsigned int at_start,
                                    unsigned int at_end, double ratio);

  /// Interval ends of n cells on [a, b], as equal as they can be while the ascending @p lines are
  /// among the ends; with fewer cells than intervals the lines are left out.
  std::vector<double> aligned_points(double a, double b, unsigned int n,
                                     const std::vector<double> &lines);
} // namespace squeal
