#pragma once

#include <squeal/model/brake_model.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace squeal
{
  /// The derivatives of a brake's equations of motion with respect to the parameters that its scene
  /// uses. Terms of the bodies are differentiated by formula, contact and prestress by central
  /// differences along the derivative of the static state at fixed active set.
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
    struct Parameter
    {
      std::string path;
      double value;
      std::vector<Term> terms; ///< d/dp of the bodies' terms
      /// Gives it another value, if contact, loads or prestress depend on it.
      std::function<void(Parameters::All &, double)> set;
      std::vector<ParameterDerivative::OfModulus> moduli = {}; ///< d/dp of what relaxes

      /// The step of central differences; what is differentiated is linear or nearly so.
      double step() const
      {
        return 1e-4 * (value != 0 ? std::abs(value) : 1.);
      }
    };
    std::vector<Parameter> differentiable_parameters() const;
    /// The elastic constants of a transversely isotropic material: the stiffness is not linear in
    /// them.
    void add_moduli(unsigned int m, const Parameters::BodyMaterial &body, double beta,
                    std::vector<Parameter> &parameters) const;
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
