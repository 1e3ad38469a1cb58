#include <squeal/base/csv_reader.h>
#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/parameters/plausibility.h>
#include <squeal/studies/sample_statistics.h>
#include <squeal/studies/study_points.h>

#include <boost/math/distributions/normal.hpp>

#include <algorithm>
#include <map>

namespace squeal
{
  namespace
  {
    using Point = std::vector<double>;

    /// The samples of a file: a first line of keys and a line of numbers for each.
    StudyPoints read_samples(const std::string &name)
    {
      const std::string what = "Sampling/File = " + name;
      CsvReader reader(what, name);
      StudyPoints result{"Sample", reader.columns(), {}};
      while (reader.next())
      {
        result.points.emplace_back();
        for (std::size_t i = 0; i < result.parameters.size(); ++i)
          result.points.back().push_back(reader.number(i));
      }
      if (result.points.empty())
        throw InputError(what +
                         ": no samples; a first line of keys and a line for each are wanted.");
      result.n_base = result.points.size();
      return result;
    }

    /// Samples of distributions: points A; with indices B follow, and A with each number from B.
    StudyPoints draw_samples(const Parameters::Sampling &settings)
    {
      const auto distributions = settings.distributions();
      const auto factor        = settings.correlation_factor();
      const unsigned int d = distributions.size(), n = settings.samples;
      const boost::math::normal standard;
      // Normal scores z = L Phi^{-1}(u) of a point of the unit cube
      const auto point_of = [&](const double *u)
      {
        Point point(d);
        for (unsigned int i = 0; i < d; ++i)
        {
          double probability = u[i];
          if (!settings.correlation.empty())
          {
            double z = 0;
            for (unsigned int j = 0; j <= i; ++j)
              z += factor[i][j] * boost::math::quantile(standard, u[j]);
            probability = std::clamp(boost::math::cdf(standard, z), 1e-12, 1 - 1e-12);
          }
          point[i] = distributions[i].quantile(probability);
        }
        return point;
      };
      StudyPoints result{"Sample", {}, {}, n};
      for (const auto &distribution : distributions)
        result.parameters.push_back(distribution.parameter);
      const bool has_indices = settings.sensitivity_indices;
      const auto unit_points = sobol_points(n, has_indices ? 2 * d : d);
      for (const Point &u : unit_points)
        result.points.push_back(point_of(u.data()));
      if (!has_indices)
        return result;
      for (const Point &u : unit_points)
        result.points.push_back(point_of(u.data() + d));
      for (unsigned int i = 0; i < d; ++i)
        for (unsigned int k = 0; k < n; ++k)
        {
          result.points.push_back(result.points[k]);
          result.points.back()[i] = result.points[n + k][i];
        }
      return result;
    }

    /// What a doubt is about, without its numbers.
    std::string kind_of(const std::string &doubt)
    {
      return doubt.substr(0, doubt.find(" = "));
    }

    /// A doubt of one kind and the points that have it.
    struct FoundDoubt
    {
      std::string text;
      unsigned int first, n = 0;
      bool is_same = true; ///< everywhere
    };
  } // namespace

  void need_effect(const std::string &parameter, const bool makes_scenes)
  {
    const std::vector<std::string> sections = {"Rotor/", "Pads/", "Strip/", "Mesh/",
                                               "Discretization/"};
    const bool makes_mesh = makes_scenes && std::any_of(sections.begin(), sections.end(),
                                                        [&](const std::string &section) {
                                                          return parameter.rfind(section, 0) == 0;
                                                        });
    if (!Parameters::Sweep::keeps_mesh(parameter) && !makes_mesh)
      throw InputError(
          "Sweep/Parameter = " + parameter +
          ": the equations of motion do not depend on it. Allowed are numbers of the sections "
          "Operation, Contact, Rotor, Pads, Strip, Mesh, Modal damping, Discretization, and of "
          "Matrices in the scene matrices.");
  }

  StudyPoints points_of_study(const Parameters::All &prm)
  {
    StudyPoints result;
    if (prm.sampling.active())
    {
      result =
          prm.sampling.file.empty() ? draw_samples(prm.sampling) : read_samples(prm.sampling.file);
      for (const std::string &parameter : result.parameters)
        Parameters::Sweep::need_mesh_kept(parameter, "Sampling/File = " + prm.sampling.file + ": ",
                                          "samples keep");
    }
    else if (prm.sweep.is_map())
    {
      result = {"Point", {prm.sweep.parameter, prm.sweep.second_parameter}, {}};
      for (unsigned int k = 0; k < 2; ++k)
        Parameters::Sweep::need_mesh_kept(
            result.parameters[k],
            k == 0 ? "Sweep/Parameter = " : "Sweep/Second parameter = ", "a stability map keeps");
      for (const double second : prm.sweep.second_points())
        for (const double first : prm.sweep.points())
          result.points.push_back({first, second});
    }
    else if (prm.sweep.active())
    {
      result = {"Value", {prm.sweep.parameter}, {}};
      need_effect(prm.sweep.parameter, prm.scene != Scene::matrices);
      for (const double value : prm.sweep.points())
        result.points.push_back({value});
    }
    return result;
  }

  std::vector<std::string> check_study(ParameterFile &file)
  {
    const StudyPoints study = points_of_study(file.parameters());
    const std::size_t n     = study.points.size();
    Point original;
    for (const std::string &parameter : study.parameters)
      original.push_back(file.value_of(parameter));
    std::vector<std::string> kinds; // in their order
    std::map<std::string, FoundDoubt> found;
    for (unsigned int k = 0; k < n; ++k)
    {
      try
      {
        file.vary(study.parameters, study.points[k]);
      }
      catch (const InputError &error)
      {
        throw InputError(text_of(study.name, " ", k + 1, " is not allowed: ", error.what()));
      }
      for (const std::string &doubt : doubts(file.parameters()))
      {
        const auto [at, is_new] = found.try_emplace(kind_of(doubt), FoundDoubt{doubt, k + 1});
        if (is_new)
          kinds.push_back(at->first);
        ++at->second.n;
        at->second.is_same = at->second.is_same && at->second.text == doubt;
      }
    }
    if (n > 0)
      file.vary(study.parameters, original);
    std::vector<std::string> all;
    for (const std::string &kind : kinds)
    {
      const FoundDoubt &doubt = found.at(kind);
      all.push_back(
          doubt.is_same && doubt.n == n
              ? doubt.text
              : text_of(doubt.text, " (", study.name, " ", doubt.first, " of ", n,
                        doubt.n > 1 ? text_of("; ", doubt.n, " of them are like this") : "", ")"));
    }
    return all;
  }
} // namespace squeal
