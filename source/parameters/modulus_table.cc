#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/parameters/modulus_table.h>
#include <squeal/parameters/number_table.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Over the frequency, Hz: logarithm of the storage modulus, and the loss factor.
    struct Sample
    {
      double log_modulus, loss_factor;
    };
    using Curve = std::map<double, Sample>;

    Sample between(const Sample &a, const Sample &b, const double share)
    {
      return {a.log_modulus + share * (b.log_modulus - a.log_modulus),
              a.loss_factor + share * (b.loss_factor - a.loss_factor)};
    }

    Sample at(const Curve &curve, const double frequency)
    {
      const auto above = curve.lower_bound(frequency);
      if (above->first == frequency)
        return above->second;
      const auto below = std::prev(above);
      return between(below->second, above->second,
                     std::log(frequency / below->first) / std::log(above->first / below->first));
    }

    /// By temperature; one curve of no temperature if the table has no such column.
    std::map<double, Curve> read_curves(const ModulusTableUse &use, bool &has_temperature)
    {
      const NumberTableRules rules = {
          {"frequency_hz", "storage_modulus_pa", "loss_factor"},
          {"temperature_c"},
          "Needed are frequency_hz, storage_modulus_pa and loss_factor; temperature_c may be "
          "there.",
          1e15,
          " is no property of a material; allowed are sizes up to 1e15.",
          10000,
          " lines."};
      const NumberTable table = read_number_table(use.key, use.filename, rules);
      has_temperature         = table.has_optional_column[0];
      std::map<double, Curve> curves;
      for (unsigned int i = 0; i < table.rows.size(); ++i)
      {
        const double frequency = table.rows[i][0], modulus = table.rows[i][1],
                     loss = table.rows[i][2];
        if (frequency <= 0)
          throw InputError(table.places[i] +
                           text_of("frequency_hz = ", frequency, ": it must be positive."));
        if (loss < 0)
          throw InputError(table.places[i] + text_of("loss_factor = ", loss,
                                                     ": it would feed energy into every motion; "
                                                     "allowed are 0 and positive ones."));
        if (modulus < use.relaxed_modulus * (1 - 1e-9))
          throw InputError(
              table.places[i] +
              text_of("storage_modulus_pa = ", modulus,
                      " is below Young modulus = ", use.relaxed_modulus,
                      " of the section, which is to be the relaxed modulus, at most the smallest "
                      "of the table."));
        if (!curves[table.rows[i][3]].emplace(frequency, Sample{std::log(modulus), loss}).second)
          throw InputError(table.places[i] +
                           text_of("frequency_hz = ", frequency, " is there twice."));
      }
      if (curves.empty())
        throw InputError(use.key + ": the file has no line of numbers.");
      return curves;
    }

    Curve curve_at(const ModulusTableUse &use)
    {
      bool has_temperature                 = false;
      const std::map<double, Curve> curves = read_curves(use, has_temperature);
      const auto above = has_temperature ? curves.lower_bound(use.temperature) : curves.begin();
      if (has_temperature &&
          (above == curves.end() || (above == curves.begin() && above->first != use.temperature)))
        throw InputError(text_of(use.key, ": Operation/Temperature = ", use.temperature,
                                 " lies outside of the table's temperatures, ",
                                 curves.begin()->first, " to ", curves.rbegin()->first,
                                 " degrees Celsius."));
      if (!has_temperature || above->first == use.temperature)
        return above->second;
      const auto below     = std::prev(above);
      const double share   = (use.temperature - below->first) / (above->first - below->first);
      const double lowest  = std::max(below->second.begin()->first, above->second.begin()->first),
                   highest = std::min(below->second.rbegin()->first, above->second.rbegin()->first);
      Curve curve;
      for (const Curve *one : {&below->second, &above->second})
        for (const auto &[frequency, sample] : *one)
          if (frequency >= lowest && frequency <= highest)
            curve[frequency] =
                between(at(below->second, frequency), at(above->second, frequency), share);
      if (curve.empty())
        throw InputError(text_of(use.key, ": the curves at ", below->first, " and ", above->first,
                                 " degrees Celsius have no frequencies in common."));
      return curve;
    }

    /// The x >= 0 that minimises x^T A x / 2 - b^T x, A positive semi-definite by columns, by
    /// descent along one coordinate after the other.
    std::vector<double> minimise(const std::vector<std::vector<double>> &a,
                                 const std::vector<double> &b)
    {
      const unsigned int n = b.size();
      std::vector<double> x(n), slope(n);
      for (unsigned int k = 0; k < n; ++k)
        slope[k] = -b[k];
      constexpr unsigned int most_sweeps = 50000;
      for (unsigned int sweep = 0; sweep < most_sweeps; ++sweep)
      {
        double change = 0, size = 0;
        for (unsigned int k = 0; k < n; ++k)
        {
          const double next = std::max(0., x[k] - slope[k] / a[k][k]), step = next - x[k];
          x[k]   = next;
          change = std::max(change, std::abs(step));
          size   = std::max(size, next);
          for (unsigned int i = 0; step != 0 && i < n; ++i)
            slope[i] += step * a[k][i];
        }
        if (change <= 1e-12 * size)
          break;
      }
      return x;
    }
  } // namespace

  StiffnessFactor::Fit fit_modulus_table(const ModulusTableUse &use)
  {
    const Curve curve  = curve_at(use);
    const double first = curve.begin()->first, last = curve.rbegin()->first;
    // Below the table the fit goes on to the relaxed modulus.
    constexpr double lowest_part = 0.1;
    if (last < use.highest || first > std::max(use.lowest, lowest_part * use.highest))
      throw InputError(text_of(use.key, ": the table goes from ", first, " to ", last,
                               " Hz and does not cover the window up to ", use.highest,
                               " Hz; its first frequency may be at most ",
                               std::max(use.lowest, lowest_part * use.highest), " Hz."));

    constexpr unsigned int per_decade = 4;
    const double shortest = 1 / (2 * M_PI * 10 * last), longest = 10 / (2 * M_PI * first);
    const unsigned int n_times = 1 + std::ceil(per_decade * std::log10(longest / shortest));
    std::vector<double> times;
    for (unsigned int k = 0; k < n_times; ++k)
      times.push_back(shortest * std::pow(longest / shortest, k / (n_times - 1.)));

    // The columns: i, and l tau / (1 + l tau) of each time.
    const unsigned int n = n_times + 1;
    std::vector<std::vector<double>> a(n, std::vector<double>(n));
    std::vector<double> b(n);
    for (const auto &[frequency, sample] : curve)
    {
      const Complex l(0, 2 * M_PI * frequency),
          data =
              std::exp(sample.log_modulus) / use.relaxed_modulus * Complex(1, sample.loss_factor);
      std::vector<Complex> columns = {Complex(0, 1) / std::abs(data)};
      for (const double tau : times)
        columns.push_back(l * tau / (1. + l * tau) / std::abs(data));
      const Complex rest = (data - 1.) / std::abs(data);
      for (unsigned int j = 0; j < n; ++j)
      {
        b[j] += (std::conj(columns[j]) * rest).real();
        for (unsigned int i = 0; i < n; ++i)
          a[j][i] += (std::conj(columns[j]) * columns[i]).real();
      }
    }
    const std::vector<double> x = minimise(a, b);

    StiffnessFactor::Fit fit;
    fit.filename    = use.filename;
    fit.loss_factor = x[0];
    double largest  = 0;
    for (unsigned int k = 0; k < n_times; ++k)
      largest = std::max(largest, x[k + 1]);
    for (unsigned int k = 0; k < n_times; ++k)
      if (x[k + 1] > 1e-6 * largest)
        fit.prony.push_back({x[k + 1], times[k]});
    StiffnessFactor factor;
    factor.fit = fit;
    for (const auto &[frequency, sample] : curve)
    {
      const Complex data =
          std::exp(sample.log_modulus) / use.relaxed_modulus * Complex(1, sample.loss_factor);
      fit.error = std::max(fit.error, std::abs(factor(Complex(0, 2 * M_PI * frequency)) - data) /
                                          std::abs(data));
    }
    constexpr double largest_error = 0.1;
    if (fit.error > largest_error)
      throw InputError(text_of(
          use.key, ": no passive material with the relaxed modulus ", use.relaxed_modulus,
          " Pa, the section's Young modulus, has such moduli and loss factors: the best fit is ",
          100 * fit.error,
          " % off, allowed are 10 %. A stiffness that rises with the frequency "
          "needs a loss factor, and the other way round."));
    return fit;
  }
} // namespace squeal
