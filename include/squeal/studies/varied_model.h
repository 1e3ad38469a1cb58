#pragma once

#include <squeal/assessment/divergence.h>
#include <squeal/parameters/parameter_file.h>
#include <squeal/reduction/mode_tracker.h>

#include <optional>
#include <string>
#include <vector>

namespace squeal
{
  /// Predicts an eigenvalue on a line: from the nearest place where it is known, along its
  /// derivative there.
  class EigenvaluePredictor
  {
  public:
    struct Known
    {
      double at;
      std::complex<double> lambda, slope;
      double uncertainty = 0; ///< of lambda
    };
    /// With the slope of the chord between two places.
    EigenvaluePredictor(double low, std::complex<double> at_low, double high,
                        std::complex<double> at_high);

    std::complex<double> operator()(double at) const;
    /// A slope that is not finite is replaced by that of the chord.
    void add(Known known);
    const Known &last() const
    {
      return places.back();
    }

  private:
    const std::complex<double> chord;
    std::vector<Known> places;
  };

  /// A model whose modes are followed along one or more parameters. Eigenvalues and det Q are
  /// evaluated with their derivatives by them.
  class VariedModel
  {
  public:
    /// @p sought is what a search that loses a mode was for. The file must live longer, as must the
    /// model of set_model().
    VariedModel(ParameterFile &file, const std::vector<std::string> &parameters,
                const EigensolverOptions &options, const std::string &sought);

    /// Sets the parameters. Throws InputError.
    const Parameters::All &parameters_at(const std::vector<double> &values);

    /// Whether Re l is zero up to the accuracy of the solver.
    bool is_marginal(const std::complex<double> lambda) const
    {
      return std::abs(lambda.real()) <=
             10 * std::max(options.tolerance, smallest_tolerance) * std::abs(lambda);
    }
    /// Whether it is that of an undamped mode: a loose tolerance hides small growth rates, but does
    /// not make them zero.
    bool is_undamped(const std::complex<double> lambda) const
    {
      constexpr double rounding = 1e-8;
      return is_marginal(lambda) && std::abs(lambda.real()) <= rounding * std::abs(lambda);
    }

    /// The numbers of the modes nearest to the eigenvalues expected. Throws SolverError if there
    /// are not enough.
    std::vector<unsigned int> nearest(const EigenPairs &modes,
                                      const std::vector<std::complex<double>> &expected) const;

    /// What the solver may have done to an eigenvalue, 1/s: condition times |l| times the backward
    /// error, or that of the projection, which is at least the tolerance.
    double uncertainty(const EigenPairs &modes, unsigned int j) const;

    /// Eigenvalues and, by parameter, their derivatives; none where the terms cannot be
    /// differentiated by the parameter.
    struct Evaluation
    {
      std::vector<std::complex<double>> lambda;
      std::vector<std::vector<std::complex<double>>> derivatives;
      double uncertainty = 0;            ///< sum over the eigenvalues
      EigenPairs modes;                  ///< all that were found
      std::vector<unsigned int> numbers; ///< of the eigenvalues in them
    };
    Evaluation evaluate(const std::vector<double> &values,
                        const std::vector<std::complex<double>> &expected);

    /// The function that vanishes where the first divergent mode of a point begins to grow.
    StaticInstability instability_of(const std::vector<double> &values, const EigenPairs &modes);
    /// It and its derivatives by the parameters; not a number where the terms cannot be
    /// differentiated.
    StaticInstability::Result evaluate(const StaticInstability &instability,
                                       const std::vector<double> &values);

    /// Gives the parameters the values that they had at first.
    void restore();

    ParameterFile &file;
    const std::vector<std::string> parameters;
    const EigensolverOptions options;
    ModeTracker tracker;

  private:
    const std::string sought;
    std::vector<double> original;
  };
} // namespace squeal
