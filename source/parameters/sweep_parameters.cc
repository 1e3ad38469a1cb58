#include <squeal/parameters/declare.h>
#include <squeal/parameters/entries.h>
#include <squeal/parameters/parameters.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace squeal
{
  namespace Parameters
  {
    void Sweep::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Sweep");
      prm.add_parameter(
          "Parameter", parameter,
          "Number to vary, for example Contact/Friction/Coefficient; none: no sweep.");
      prm.add_parameter("Values", values,
                        "List 0, 0.1, 0.2 or range 0 : 0.7 : 15 (first, last, number).");
      prm.add_parameter("Critical values", critical_values,
                        "Whether the onset of flutter (growth rate 0) and coalescence (a double "
                        "eigenvalue with one eigenvector) are located between the values.");
      prm.add_parameter("Second parameter", second_parameter,
                        "A second number to vary: the result is a stability map with its border. "
                        "none: a sweep over one parameter.");
      prm.add_parameter("Second values", second_values,
                        "Values of the second parameter, written as Values.");
    }

    bool Sweep::keeps_mesh(const std::string &parameter)
    {
      // A load's profile is made with the mesh.
      const std::vector<std::string> starts = {"Operation/",       "Contact/",  "Rotor/Material/",
                                               "Pads/Material/",   "Matrices/", "Modal damping/",
                                               Mesh::pressure_path};
      const bool is_of_part                 = parameter.rfind("Mesh/Part ", 0) == 0 &&
                              parameter.find("/Material/") != std::string::npos;
      return parameter == "Pads/Pressure" || is_of_part ||
             std::any_of(starts.begin(), starts.end(),
                         [&](const std::string &start) { return parameter.rfind(start, 0) == 0; });
    }

    void Sweep::need_mesh_kept(const std::string &parameter, const std::string &where,
                               const std::string &what)
    {
      if (!keeps_mesh(parameter))
        throw InputError(where + parameter + ": " + what +
                         " the mesh. Allowed are numbers of the sections Operation, Contact, "
                         "Rotor/Material, Pads/Material, a Material of Mesh/Part, Modal damping, "
                         "Matrices, Pads/Pressure, and Mesh/Pressures/surface.");
    }

    std::vector<double> Sweep::points() const
    {
      return list_or_range("Sweep/Values", values);
    }

    std::vector<double> Sweep::second_points() const
    {
      return list_or_range("Sweep/Second values", second_values);
    }

    void Sweep::check() const
    {
      if (active())
        points();
      else if (critical_values)
        throw InputError("Sweep/Critical values = true: a Sweep/Parameter is needed.");
      else if (is_map())
        throw InputError("Sweep/Second parameter = " + second_parameter +
                         ": a Sweep/Parameter is needed.");
      if (!is_map())
        return;
      if (second_parameter == parameter)
        throw InputError("Sweep/Second parameter = " + second_parameter +
                         ": it must be another one than Sweep/Parameter.");
      if (critical_values)
        throw InputError("Sweep/Critical values = true: a map over two parameters has a border "
                         "instead, border.csv; allowed is false.");
      if (points().size() < 2 || second_points().size() < 2)
        throw InputError("Sweep/Second parameter = " + second_parameter +
                         ": a map needs at least two values of each parameter.");
    }
  } // namespace Parameters
} // namespace squeal
