#include <squeal/parameters/declare.h>
#include <squeal/parameters/entries.h>
#include <squeal/parameters/parameters.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  namespace Parameters
  {
    void Response::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Response");
      prm.add_parameter(
          "Forces", forces,
          "Harmonic forces, N, each by itself: place : Fx Fy Fz, separated by commas. A place is "
          "three coordinates, m, before them a body's name if several bodies have the point (rotor "
          "0.1 0 0.006); a surface group (in the scenes brake and strip a boundary such as "
          "upper_pad.back), over which the force is spread evenly; or a name of Joints/Points. In "
          "the strip two coordinates and components. Empty: no frequency response.");
      prm.add_parameter("Observations", observations,
                        "Where and along which direction displacements are observed: place : nx ny "
                        "nz, as Forces; of a surface the mean. Empty: at the forces, along them.");
      prm.add_parameter("Frequencies", frequencies,
                        "Hz, a list 100, 200 or a range 100 : 6000 : 400 (first, last, number). "
                        "Empty: 400 up to Eigenproblem/Maximum frequency.");
      add_choice(prm, "Method", method,
                 "modal: by left and right vectors of the modes, and what they lack interpolated "
                 "among direct solutions; not beyond Eigenproblem/Maximum frequency. direct: a "
                 "factorisation for each frequency.");
      prm.add_parameter("Tolerance", tolerance,
                        "modal: how far interpolated values may be from direct ones, relative to "
                        "their geometric mean over the frequencies.",
                        Patterns::Double(1e-10, 0.1));
    }

    namespace
    {
      std::vector<Response::Place> places_of(const std::string &key, const std::string &text,
                                             const unsigned int n_components)
      {
        std::vector<Response::Place> result;
        for (const std::vector<std::string> &entry : entries_of(text))
        {
          Response::Place place;
          for (const std::string &word : entry)
            place.text += (place.text.empty() ? "" : " : ") + word;
          const auto refuse = [&]()
          {
            const std::string components = n_components == 2 ? "two" : "three";
            fail("Response/" + key, text,
                 "'" + place.text +
                     "' is no place : direction; allowed are, separated by commas, " + components +
                     " coordinates, with a body's name before them or not, or the "
                     "name of a surface or point, then a colon and " +
                     components + " components that are not all zero.");
          };
          if (entry.size() != 2 || entry[0].empty() || !read_numbers(entry[1], place.direction) ||
              place.direction.size() != n_components ||
              std::all_of(place.direction.begin(), place.direction.end(),
                          [](const double x) { return x == 0; }))
            refuse();
          // Coordinates are the last words, if these are numbers.
          place.name       = entry[0];
          std::size_t last = entry[0].size();
          for (unsigned int k = 0; k < n_components && last != std::string::npos; ++k)
          {
            last = entry[0].find_last_of(' ', last); // before the word
            last = last == std::string::npos ? last : entry[0].find_last_not_of(' ', last);
          }
          const std::size_t begin = last == std::string::npos ? 0 : last + 1;
          if (std::vector<double> numbers;
              read_numbers(entry[0].substr(begin), numbers) && numbers.size() == n_components)
          {
            place.point = numbers;
            place.name  = entry[0].substr(0, begin);
          }
          result.push_back(std::move(place));
        }
        return result;
      }
    } // namespace

    std::vector<Response::Place> Response::list_of_forces(const unsigned int n_components) const
    {
      return places_of("Forces", forces, n_components);
    }

    std::vector<Response::Place>
    Response::list_of_observations(const unsigned int n_components) const
    {
      std::vector<Place> places = observations.empty()
                                      ? list_of_forces(n_components)
                                      : places_of("Observations", observations, n_components);
      for (Place &place : places)
      {
        double square = 0;
        for (const double x : place.direction)
          square += x * x;
        for (double &x : place.direction)
          x /= std::sqrt(square);
      }
      return places;
    }

    std::vector<double> Response::list_of_frequencies(const double maximum) const
    {
      std::vector<double> result;
      if (frequencies.empty())
        for (unsigned int k = 1; k <= 400; ++k)
          result.push_back(k * maximum / 400);
      else
        result = list_or_range("Response/Frequencies", frequencies);
      std::sort(result.begin(), result.end());
      return result;
    }

    void Response::check(const Eigenproblem &eigenproblem, const unsigned int n_components) const
    {
      if (!active())
      {
        if (!observations.empty())
          fail("Response/Observations", observations, "allowed with Response/Forces only.");
        return;
      }
      list_of_forces(n_components);
      list_of_observations(n_components);
      const std::vector<double> list = list_of_frequencies(eigenproblem.maximum_frequency);
      if (!(list.front() > 0))
        fail("Response/Frequencies", frequencies, "allowed are frequencies above 0 Hz.");
      if (method == ResponseMethod::direct)
        return;
      if (!eigenproblem.is_solved())
        throw InputError("Response/Method = modal: there are no modes with Eigenproblem/Solver = "
                         "none; allowed is direct.");
      constexpr double rounding = 1 + 1e-12;
      if (list.back() > eigenproblem.maximum_frequency * rounding ||
          list.front() * rounding < eigenproblem.minimum_frequency)
        fail("Response/Frequencies", frequencies,
             "modes are known between Eigenproblem/Minimum frequency and Maximum frequency; "
             "allowed beyond is Response/Method = direct.");
    }
  } // namespace Parameters
} // namespace squeal
