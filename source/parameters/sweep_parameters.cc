#include <squeal/parameters/declare.h>
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

    namespace
    {
      /// A list or a range of a key of the section Sweep.
      std::vector<double> list_of_points(const std::string &key, const std::string &values)
      {
        const bool is_range = values.find(':') != std::string::npos;
        std::vector<double> numbers;
        for (const std::string &word :
             dealii::Utilities::split_string_list(values, is_range ? ':' : ','))
          try
          {
            numbers.push_back(dealii::Utilities::string_to_double(word));
          }
          catch (const std::exception &)
          {
            numbers.push_back(std::numeric_limits<double>::quiet_NaN());
          }
        const bool finite = std::all_of(numbers.begin(), numbers.end(),
                                        [](const double x) { return std::isfinite(x); });
        if (!finite || numbers.empty() ||
            (is_range && (numbers.size() != 3 || numbers[2] < 2 ||
                          numbers[2] != std::floor(numbers[2]) || numbers[2] > 100000)))
          throw InputError(key + " = " + values +
                           ": allowed are a list of numbers 0, 0.1, 0.2 or a range first : last : "
                           "number with a number of at least 2.");
        if (is_range)
        {
          const double first = numbers[0], last = numbers[1];
          const unsigned int n = numbers[2];
          numbers.clear();
          for (unsigned int i = 0; i < n; ++i)
            numbers.push_back(i + 1 == n ? last : first + i * (last - first) / (n - 1));
        }
        const bool up   = std::adjacent_find(numbers.begin(), numbers.end(),
                                             std::greater_equal<double>()) == numbers.end(),
                   down = std::adjacent_find(numbers.begin(), numbers.end(),
                                             std::less_equal<double>()) == numbers.end();
        if (!up && !down)
          throw InputError(key + " = " + values +
                           ": the values must rise or fall, none twice, so that branches can be "
                           "followed.");
        return numbers;
      }
    } // namespace

    bool Sweep::keeps_mesh(const std::string &parameter)
    {
      const std::vector<std::string> starts = {"Operation/",      "Contact/",       "Pads/Pressure",
                                               "Rotor/Material/", "Pads/Material/", "Mesh/Part",
                                               "Matrices/"};
      return std::any_of(starts.begin(), starts.end(),
                         [&](const std::string &start) { return parameter.rfind(start, 0) == 0; });
    }

    void Sweep::need_mesh_kept(const std::string &parameter, const std::string &where,
                               const std::string &what)
    {
      if (!keeps_mesh(parameter))
        throw InputError(where + parameter + ": " + what +
                         " the mesh. Allowed are numbers of the sections Operation, Contact, "
                         "Rotor/Material, Pads/Material, a Material of Mesh/Part, Matrices, and "
                         "Pads/Pressure.");
    }

    std::vector<double> Sweep::points() const
    {
      return list_of_points("Sweep/Values", values);
    }

    std::vector<double> Sweep::second_points() const
    {
      return list_of_points("Sweep/Second values", second_values);
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
