#include <squeal/base/text.h>
#include <squeal/studies/varied_model.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace squeal
{
  using Complex = std::complex<double>;

  EigenvaluePredictor::EigenvaluePredictor(const double low, const Complex at_low,
                                           const double high, const Complex at_high)
      : chord((at_high - at_low) / (high - low)), places{{low, at_low, chord},
                                                         {high, at_high, chord}}
  {
  }

  Complex EigenvaluePredictor::operator()(const double at) const
  {
    const auto nearest = std::min_element(places.begin(), places.end(),
                                          [&](const Known &a, const Known &b)
                                          { return std::abs(a.at - at) < std::abs(b.at - at); });
    return nearest->lambda + nearest->slope * (at - nearest->at);
  }

  void EigenvaluePredictor::add(Known known)
  {
    if (!std::isfinite(known.slope.real()))
      known.slope = chord;
    places.push_back(known);
  }

  VariedModel::VariedModel(ParameterFile &file, const std::vector<std::string> &parameters,
                           const EigensolverOptions &options, const std::string &sought)
      : file(file), parameters(parameters), options(options),
        tracker(options, file.parameters().eigenproblem.solver), sought(sought)
  {
    for (const std::string &parameter : parameters)
      original.push_back(file.value_of(parameter));
  }

  const Parameters::All &VariedModel::parameters_at(const std::vector<double> &values)
  {
    file.vary(parameters, values);
    return file.parameters();
  }

  std::vector<unsigned int> VariedModel::nearest(const EigenPairs &modes,
                                                 const std::vector<Complex> &expected) const
  {
    const std::vector<unsigned int> chosen = nearest_partners(expected, modes.lambda);
    if (chosen.size() < expected.size())
      throw SolverError("A mode was lost in the search for " + sought + ".");
    return chosen;
  }

  double VariedModel::uncertainty(const EigenPairs &modes, const unsigned int j) const
  {
    const double relative =
        modes.projection_error.empty() ? modes.backward_error[j] : modes.projection_error[j];
    return modes.condition[j] * relative * std::abs(modes.lambda[j]);
  }

  VariedModel::Evaluation VariedModel::evaluate(const std::vector<double> &values,
                                                const std::vector<Complex> &expected)
  {
    Evaluation result;
    result.modes            = tracker.solve(parameters_at(values), ModeTracker::Scope::disc).modes;
    result.numbers          = nearest(result.modes, expected);
    const EigenPairs &modes = result.modes;
    const std::vector<unsigned int> &chosen = result.numbers;
    for (const unsigned int j : chosen)
    {
      result.lambda.push_back(modes.lambda[j]);
      result.uncertainty += uncertainty(modes, j);
    }
    for (const std::string &parameter : parameters)
    {
      const std::vector<Complex> of_all = tracker.sensitivities(parameter, modes);
      result.derivatives.emplace_back();
      for (const unsigned int j : chosen)
        if (!of_all.empty())
          result.derivatives.back().push_back(of_all[j]);
    }
    return result;
  }

  StaticInstability VariedModel::instability_of(const std::vector<double> &values,
                                                const EigenPairs &modes)
  {
    const QuadraticEigenproblem &problem = tracker.assemble_at_rest(parameters_at(values));
    const EigenPairs whole               = tracker.whole(modes);
    return StaticInstability(problem, whole, divergent_modes(whole).front());
  }

  StaticInstability::Result VariedModel::evaluate(const StaticInstability &instability,
                                                  const std::vector<double> &values)
  {
    const QuadraticEigenproblem &problem = tracker.assemble_at_rest(parameters_at(values));
    std::vector<ParameterDerivative> known;
    std::vector<int> number; // by parameter, or -1
    for (const std::string &parameter : parameters)
    {
      auto of_parameter = tracker.derivatives(parameter);
      number.push_back(of_parameter.empty() ? -1 : int(known.size()));
      if (!of_parameter.empty())
        known.push_back(std::move(of_parameter.front()));
    }
    StaticInstability::Result result   = instability.evaluate(problem, known);
    const std::vector<double> of_known = std::move(result.derivatives);
    result.derivatives.clear();
    for (const int k : number)
      result.derivatives.push_back(k < 0 ? std::numeric_limits<double>::quiet_NaN() : of_known[k]);
    return result;
  }

  void VariedModel::restore()
  {
    parameters_at(original);
  }
} // namespace squeal
