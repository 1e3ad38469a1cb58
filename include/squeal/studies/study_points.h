#pragma once

#include <squeal/parameters/parameter_file.h>

#include <string>
#include <vector>

namespace squeal
{
  /// What a study varies, and to which values.
  struct StudyPoints
  {
    std::string name; ///< of one of them: "Value", "Point" or "Sample"
    std::vector<std::string> parameters;
    std::vector<std::vector<double>> points; ///< none: there is no study
    /// Samples without those that sensitivity indices need besides.
    unsigned int n_base = 0;
  };

  /// Lists the points of a sweep, a map row by row, or samples. Throws InputError.
  StudyPoints points_of_study(const Parameters::All &parameters);

  /// Throws InputError if the equations of motion do not depend on a parameter of a sweep. What
  /// changes the mesh is allowed where the scene can be made anew.
  void need_effect(const std::string &parameter, bool makes_scenes);

  /// Passes every point of a study through the checks of a run of its own. Returns doubts() of
  /// them, each kind once with the first point that has it. The parameters keep their values.
  /// Throws InputError with the point's number.
  std::vector<std::string> check_study(ParameterFile &file);
} // namespace squeal
