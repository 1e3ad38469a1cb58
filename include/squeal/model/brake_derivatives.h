#pragma once

#include <squeal/model/brake_model.h>

#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace squeal
{
  /// Differentiates a brake's equations of motion by the parameters that its scene uses, all by
  /// central differences: of the coefficients of the bodies' terms, which are at most quadratic in
  /// each parameter, so that nothing is neglected, and of the matrices of contact and prestress
  /// along the derivative of the static state at fixed active set. Exceptions are linear and given
  /// by matrices or functions of their own: viscosities and what the stiffness relaxes by.
  template <int dim>
  class BrakeDerivatives
  {
  public:
    /// @p model has been linearised and must outlive it unchanged.
    explicit BrakeDerivatives(const BrakeModel<dim> &model);

    /// As Model::derivatives().
    std::vector<ParameterDerivative> derivatives(const std::string &only,
                                                 const LinearOperator &nearby) const;

  private:
    using AssembledBody = typename BrakeModel<dim>::AssembledBody;
    struct Parameter
    {
      std::string path;
      double value;
      /// Where it stands, if terms are to be differenced.
      std::function<double &(Parameters::All &)> place   = {};
      std::vector<Term> terms                            = {}; ///< d/dp of the bodies' terms
      std::vector<ParameterDerivative::OfModulus> moduli = {}; ///< d/dp of what relaxes
      /// Matrices in place of the model's, by material, for constants in which the stiffness is not
      /// a polynomial.
      std::map<unsigned int, AssembledBody> bodies = {};

      /// The step of central differences of contact, loads and moduli, which are linear or nearly
      /// so.
      double step() const
      {
        return 1e-4 * (value != 0 ? std::abs(value) : 1.);
      }
      /// The step for polynomials of at most the second degree: a large one rounds least.
      double step_of_polynomials() const
      {
        return 0.5 * (value != 0 ? std::abs(value) : 1.);
      }
    };
    std::vector<Parameter> differentiable_parameters() const;
    /// The parameter that stands at a place.
    Parameter parameter_at(const std::string &path,
                           std::function<double &(Parameters::All &)> place) const;
    void add_material(unsigned int m, const Parameters::BodyMaterial &body,
                      std::vector<Parameter> &parameters) const;
    void add_contact(std::vector<Parameter> &parameters) const;
    /// Adds d/dp of the terms of the bodies and of what relaxes of them.
    void difference_bodies(Parameter &parameter) const;
    /// The model's parameters with another value of one.
    Parameters::All varied(const Parameter &parameter, double value) const;
    /// The contact's and the loads' part of the static residual at the static state.
    MultiVector static_residual(const Parameters::All &parameters,
                                const Contact<dim> &contact) const;
    /// dx_0/dp at fixed active set, one column for each parameter.
    MultiVector state_derivatives(const std::vector<Parameter> &parameters,
                                  const LinearOperator &nearby) const;

    const BrakeModel<dim> &model;
    const FiniteElementSpace<dim> &spaces;
    const Geometry<dim> &geometry;
    const Parameters::All &prm;
    const SteadyState<dim> &steady;
  };
} // namespace squeal
