#include <squeal/linalg/dense.h>
#include <squeal/parameters/declare.h>
#include <squeal/parameters/entries.h>
#include <squeal/parameters/parameters.h>

#include <boost/math/distributions/normal.hpp>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace squeal
{
  namespace Parameters
  {
    void Sampling::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Sampling");
      prm.add_parameter(
          "Parameters", parameters,
          "Uncertain numbers and their distributions, separated by semicolons, for example "
          "Contact/Friction/Coefficient uniform 0.3 0.6; Pads/Pressure normal 1e6 1e5. uniform: "
          "bounds; normal: mean, standard deviation; lognormal: median, standard deviation of the "
          "logarithm; table: values with the probability of a smaller one, 0.3:0 0.4:0.5 0.6:1. "
          "Empty: no samples.");
      prm.add_parameter(
          "Samples", samples,
          "Number of quasi-random samples (Sobol's sequence); powers of two are best.",
          Patterns::Integer(2, 1 << 20));
      prm.add_parameter("Correlation", correlation,
                        "Correlation matrix of the normal scores of the numbers, rows separated by "
                        "semicolons: 1, 0.5; 0.5, 1. Empty: independent.");
      prm.add_parameter("Sensitivity indices", sensitivity_indices,
                        "Whether first-order and total indices are computed, how much of the "
                        "variance of growth rates each number makes: for n numbers Samples (n + 2) "
                        "points are solved.");
      prm.add_parameter("File", file,
                        "CSV file of samples instead: the first line names the keys, each other "
                        "one is a sample.",
                        Patterns::FileName());
    }

    double Sampling::Distribution::quantile(const double probability) const
    {
      const auto normal = [&]()
      { return boost::math::quantile(boost::math::normal(), probability); };
      switch (kind)
      {
      case Kind::uniform:
        return numbers[0] + probability * (numbers[1] - numbers[0]);
      case Kind::normal:
        return numbers[0] + numbers[1] * normal();
      case Kind::lognormal:
        return numbers[0] * std::exp(numbers[1] * normal());
      case Kind::table:
        break;
      }
      const auto above =
          std::upper_bound(probabilities.begin(), probabilities.end() - 1, probability);
      const std::size_t k = std::max<std::ptrdiff_t>(above - probabilities.begin(), 1);
      return numbers[k - 1] + (numbers[k] - numbers[k - 1]) * (probability - probabilities[k - 1]) /
                                  (probabilities[k] - probabilities[k - 1]);
    }

    namespace
    {
      double number_of(const std::string &word, const std::string &where)
      {
        if (const std::optional<double> value = to_number(word))
          return *value;
        throw InputError(where + ": '" + word + "' is not a number.");
      }

      Sampling::Distribution distribution_of(const std::string &entry)
      {
        using Kind              = Sampling::Distribution::Kind;
        const std::string where = "Sampling/Parameters: " + entry;
        std::istringstream words(entry);
        std::vector<std::string> before, after;
        std::optional<Kind> kind;
        Sampling::Distribution result;
        for (std::string word; words >> word;)
        {
          if (!kind && !before.empty())
            for (unsigned int k = 0; k < names_of(Kind()).size(); ++k)
              if (names_of(Kind())[k] == word)
                kind = Kind(k);
          if (kind && names_of(Kind())[int(*kind)] == word && after.empty())
            continue;
          (kind ? after : before).push_back(word);
        }
        if (!kind)
          throw InputError(where + ": no distribution; allowed is a key and uniform, normal, "
                                   "lognormal or table with numbers.");
        for (const std::string &word : before)
          result.parameter += (result.parameter.empty() ? "" : " ") + word;
        result.kind = *kind;
        for (const std::string &word : after)
          if (*kind == Kind::table)
          {
            const std::size_t colon = word.find(':');
            if (colon == std::string::npos)
              throw InputError(where + ": '" + word + "' is no value:probability.");
            result.numbers.push_back(number_of(word.substr(0, colon), where));
            result.probabilities.push_back(number_of(word.substr(colon + 1), where));
          }
          else
            result.numbers.push_back(number_of(word, where));
        const std::vector<double> &x = result.numbers, &p = result.probabilities;
        const auto rises = [](const std::vector<double> &v)
        { return std::adjacent_find(v.begin(), v.end(), std::greater_equal<double>()) == v.end(); };
        if (*kind == Kind::table)
        {
          if (x.size() < 2 || !rises(x) || !rises(p) || p.front() != 0 || p.back() != 1)
            throw InputError(where + ": values and probabilities must rise, these from 0 to 1.");
          return result;
        }
        if (x.size() != 2)
          throw InputError(where + ": " + std::to_string(x.size()) + " numbers; allowed are two.");
        if (*kind == Kind::uniform ? !(x[0] < x[1]) : !(x[1] > 0))
          throw InputError(where + (*kind == Kind::uniform
                                        ? ": the lower bound must be below the upper one."
                                        : ": the standard deviation must be positive."));
        if (*kind == Kind::lognormal && !(x[0] > 0))
          throw InputError(where + ": the median must be positive.");
        return result;
      }
    } // namespace

    std::vector<Sampling::Distribution> Sampling::distributions() const
    {
      std::vector<Distribution> result;
      for (const std::string &entry : dealii::Utilities::split_string_list(parameters, ';'))
      {
        Distribution distribution = distribution_of(entry);
        for (const Distribution &other : result)
          if (other.parameter == distribution.parameter)
            throw InputError("Sampling/Parameters: " + other.parameter + " is named twice.");
        result.push_back(std::move(distribution));
      }
      return result;
    }

    std::vector<std::vector<double>> Sampling::correlation_factor() const
    {
      const std::size_t n = distributions().size();
      std::vector<std::vector<double>> l(n, std::vector<double>(n, 0.));
      for (std::size_t i = 0; i < n; ++i)
        l[i][i] = 1;
      if (correlation.empty())
        return l;
      const auto refuse = [&](const std::string &why)
      { throw InputError("Sampling/Correlation = " + correlation + ": " + why); };
      std::vector<std::vector<double>> c;
      for (const std::string &row : dealii::Utilities::split_string_list(correlation, ';'))
      {
        c.emplace_back();
        for (const std::string &word : dealii::Utilities::split_string_list(row, ','))
          c.back().push_back(number_of(word, "Sampling/Correlation"));
        if (c.back().size() != n)
          refuse("each row must have " + std::to_string(n) + " numbers.");
      }
      if (c.size() != n)
        refuse("there must be " + std::to_string(n) + " rows.");
      // Cholesky
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j <= i; ++j)
        {
          if (c[i][j] != c[j][i] || (i == j && c[i][i] != 1))
            refuse("it must be symmetric with ones on the diagonal.");
          double sum = c[i][j];
          for (std::size_t k = 0; k < j; ++k)
            sum -= l[i][k] * l[j][k];
          if (i == j && !(sum > 1e-12))
            refuse("it is not positive definite.");
          l[i][j] = i == j ? std::sqrt(sum) : sum / l[j][j];
        }
      return l;
    }

    void Sampling::check() const
    {
      if (!parameters.empty() && !file.empty())
        throw InputError("Sampling/File = " + file +
                         ": allowed without Sampling/Parameters only; the file names the keys.");
      if (!correlation.empty() && (parameters.empty() || sensitivity_indices))
        throw InputError("Sampling/Correlation = " + correlation +
                         (parameters.empty()
                              ? ": there are no Sampling/Parameters."
                              : ": indices are shares of independent numbers; allowed with "
                                "Sampling/Sensitivity indices = false."));
      if (sensitivity_indices && parameters.empty())
        throw InputError("Sampling/Sensitivity indices = true: Sampling/Parameters are needed; "
                         "those of a file have no distributions.");
      correlation_factor();
      for (const Distribution &distribution : distributions())
        Sweep::need_mesh_kept(distribution.parameter, "Sampling/Parameters: ", "samples keep");
    }
  } // namespace Parameters
} // namespace squeal
