#include <squeal/bodies/prestress.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/contact/contact_matrices.h>
#include <squeal/linalg/gmres.h>
#include <squeal/model/brake_derivatives.h>
#include <squeal/model/measured_damping.h>

#include <algorithm>
#include <cmath>

// Derivatives of a brake's equations by its parameters, in three steps: differentiable_parameters()
// lists what the scene uses, with d/dp of the bodies' terms; state_derivatives() finds dx_0/dp at
// fixed active set by one tangent for all parameters; derivatives() differentiates contact and
// prestress by central differences along that change of the state.

namespace squeal
{
  namespace
  {
    /// f(l) - 1.
    auto beyond_relaxed(const StiffnessFactor &factor)
    {
      return [factor](const std::complex<double> l) { return factor(l) - 1.; };
    }

    /// Gives a constant of the material of a section another value.
    auto setter(const std::string &section, double Material::*constant)
    {
      return [=](Parameters::All &all, const double value)
      { all.material(section).*constant = value; };
    }
  } // namespace

  template <int dim>
  BrakeDerivatives<dim>::BrakeDerivatives(const BrakeModel<dim> &model)
      : model(model), spaces(model.spaces()), geometry(spaces.geometry), prm(model.parameters()),
        steady(model.steady_state())
  {
  }

  template <int dim>
  void BrakeDerivatives<dim>::add_moduli(const unsigned int m, const Parameters::BodyMaterial &body,
                                         const double beta,
                                         std::vector<Parameter> &parameters) const
  {
    // The coefficients of the stiffness are not linear in the constants, central differences of
    // them cost nothing.
    auto stiffnesses = model.body(m).stiffnesses;
    if (stiffnesses.empty())
      stiffnesses = assemble_stiffnesses(spaces, geometry.bodies_of(m), body.material);
    for (const Material::Constant &constant : Material::elastic_constants())
    {
      Material material  = body.material;
      double &modulus    = material.*constant.value;
      const double value = modulus;
      Parameter parameter{body.section + "/Material/" + constant.key,
                          value,
                          {},
                          setter(body.section, constant.value)};
      const double h   = parameter.step();
      modulus          = value + h;
      const auto above = elastic_components<dim>(material);
      modulus          = value - h;
      const auto below = elastic_components<dim>(material);
      for (unsigned int k = 0; k < stiffnesses.size(); ++k)
      {
        const double slope = (above[k].coefficient - below[k].coefficient) / (2 * h);
        parameter.terms.push_back({Origin::elasticity, 0, slope, stiffnesses[k]});
        parameter.terms.push_back({Origin::material_damping, 1, beta * slope, stiffnesses[k]});
        if (prm.terms().material_damping && body.material.stiffness_factor.is_active())
          parameter.moduli.push_back(
              {slope, stiffnesses[k], beyond_relaxed(body.material.stiffness_factor)});
      }
      parameters.push_back(std::move(parameter));
    }
  }

  template <int dim>
  std::vector<typename BrakeDerivatives<dim>::Parameter>
  BrakeDerivatives<dim>::differentiable_parameters() const
  {
    const StageTerms stage = prm.terms();
    const double omega     = prm.operation.angular_velocity;
    const bool moves = prm.turns() && omega != 0, has_pads = !geometry.interfaces.empty();
    const std::vector<Parameters::BodyMaterial> materials = prm.materials();
    std::vector<Parameter> result;
    Parameter speed{
        "Operation/Angular velocity", omega, {}, [](Parameters::All &all, const double value) {
          all.operation.angular_velocity = value;
        }};
    for (unsigned int m = 0; m < materials.size(); ++m)
    {
      if (geometry.bodies_of(m).empty())
        continue;
      const std::string section    = materials[m].section + "/Material/";
      const Material &material     = materials[m].material;
      const BodyMatrices &matrices = model.body(m).matrices;
      const Material::Damping damping =
          stage.material_damping ? material.damping() : Material::Damping();
      const double per_rho = 1 / model.body(m).material.density, rho = material.density * per_rho;
      const auto stiffness = model.body(m).stiffness_of(material);
      const bool turns     = materials[m].of_rotor && moves && stage.transport;
      Parameter density{section + "Density",
                        material.density,
                        {{Origin::inertia, 2, per_rho, matrices.M},
                         {Origin::material_damping, 1, damping.alpha * per_rho, matrices.M}},
                        setter(materials[m].section, &Material::density)};
      if (turns)
      {
        speed.terms.push_back({Origin::transport, 1, 2 * rho, matrices.G});
        speed.terms.push_back({Origin::transport, 0, -2 * omega * rho, matrices.M_star});
        speed.terms.push_back({Origin::material_damping, 0, damping.alpha * rho, matrices.G});
        density.terms.push_back({Origin::transport, 1, 2 * omega * per_rho, matrices.G});
        density.terms.push_back({Origin::transport, 0, -omega * omega * per_rho, matrices.M_star});
        density.terms.push_back(
            {Origin::material_damping, 0, damping.alpha * omega * per_rho, matrices.G});
      }
      if (material.transversely_isotropic)
        add_moduli(m, materials[m], damping.beta, result);
      else
      {
        Parameter modulus{section + "Young modulus",
                          material.young_modulus,
                          {},
                          setter(materials[m].section, &Material::young_modulus)};
        for (const auto &[coefficient, matrix] : stiffness)
        {
          const double per_E = coefficient / material.young_modulus;
          modulus.terms.push_back({Origin::elasticity, 0, per_E, matrix});
          modulus.terms.push_back({Origin::material_damping, 1, damping.beta * per_E, matrix});
          if (stage.material_damping && material.stiffness_factor.is_active())
            modulus.moduli.push_back({per_E, matrix, beyond_relaxed(material.stiffness_factor)});
        }
        result.push_back(std::move(modulus));
      }
      if (stage.material_damping && material.stiffness_factor.is_active())
        for (const StiffnessFactor::Constant &constant : material.stiffness_factor.constants())
        {
          result.push_back({section + constant.name, constant.value, {}, {}});
          for (const auto &[coefficient, matrix] : stiffness)
            result.back().moduli.push_back({coefficient, matrix, constant.derivative});
        }
      result.push_back(density);
      if (stage.material_damping)
        for (const Viscosity::Constant &constant : material.viscosity.constants())
        {
          Material unit  = material;
          unit.viscosity = constant.unit;
          result.push_back({section + constant.key,
                            constant.value,
                            {{Origin::material_damping, 1, 1.,
                              assemble_body(spaces, geometry.bodies_of(m), unit,
                                            {false, false, false, false, true})
                                  .V}},
                            {}});
        }
      if (stage.material_damping)
        for (const Material::Constant &constant : material.damping_constants())
        {
          const auto &[alpha, beta] = constant.damping;
          result.push_back({section + constant.key,
                            material.*constant.value,
                            {{Origin::material_damping, 1, alpha * rho, matrices.M}},
                            {}});
          for (const auto &[coefficient, matrix] : stiffness)
            result.back().terms.push_back(
                {Origin::material_damping, 1, beta * coefficient, matrix});
          if (turns)
            result.back().terms.push_back(
                {Origin::material_damping, 0, alpha * omega * rho, matrices.G});
        }
    }
    for (const RelaxationTerm &term : model.relaxation())
      if (term.low_rank)
      {
        const ParameterDerivative by_factor = derivative_by_factor(term, prm.modal_damping.factor);
        result.push_back({by_factor.parameter, by_factor.value, {}, {}, by_factor.moduli});
      }
    if (moves)
      result.insert(result.begin(), speed);
    if (has_pads)
    {
      if (prm.contact.formulation != Formulation::mortar)
        result.push_back({"Contact/Penalty stiffness",
                          prm.contact.penalty_stiffness,
                          {},
                          [](Parameters::All &all, const double value)
                          { all.contact.penalty_stiffness = value; }});
      if (stage.friction)
        for (const auto &[key, constant] : prm.contact.friction.constants())
          result.push_back({"Contact/Friction/" + key,
                            prm.contact.friction.*constant,
                            {},
                            [constant = constant](Parameters::All &all, const double value)
                            { all.contact.friction.*constant = value; }});
      if (stage.material_damping)
      {
        using Constant = double Parameters::Contact::*;
        for (const auto &[key, constant] :
             {std::make_pair("Normal dashpot", Constant(&Parameters::Contact::normal_dashpot)),
              std::make_pair("Tangential dashpot",
                             Constant(&Parameters::Contact::tangential_dashpot))})
          if (prm.contact.*constant > 0)
            result.push_back({std::string("Contact/") + key,
                              prm.contact.*constant,
                              {},
                              [constant = constant](Parameters::All &all, const double value)
                              { all.contact.*constant = value; }});
      }
      result.push_back(
          {"Pads/Pressure", prm.pads.pressure, {}, [](Parameters::All &all, const double value) {
             all.pads.pressure = value;
           }});
    }
    return result;
  }

  template <int dim>
  Parameters::All BrakeDerivatives<dim>::varied(const Parameter &parameter,
                                                const double value) const
  {
    Parameters::All result = prm;
    if (parameter.set)
      parameter.set(result, value);
    return result;
  }

  template <int dim>
  MultiVector BrakeDerivatives<dim>::static_residual(const Parameters::All &parameters,
                                                     const Contact<dim> &contact) const
  {
    const MultiVector &x = steady.equilibrium->state;
    const bool slides    = parameters.terms().friction;
    MultiVector residual = multiply(normal_matrix(contact), x);
    if (slides)
      residual += multiply(friction_matrix(contact, steady.pressure), x);
    residual -= contact_load(contact, steady.pressure, slides);
    residual -= model.static_load(parameters, spaces);
    return residual;
  }

  template <int dim>
  MultiVector BrakeDerivatives<dim>::state_derivatives(const std::vector<Parameter> &parameters,
                                                       const LinearOperator &nearby) const
  {
    // A x' = -(d/dp) r(x_0; p) at fixed active set, r the static residual, A = dr/dx.
    const RowRange &rows = spaces.rows;
    MultiVector right(rows, parameters.size());
    for (unsigned int k = 0; k < parameters.size(); ++k)
    {
      const Parameter &parameter = parameters[k];
      const double h             = parameter.step();
      const auto residual        = [&](const double value)
      {
        const Parameters::All p = varied(parameter, value);
        Contact<dim> contact    = *steady.contact;
        contact.set_model(BrakeModel<dim>::contact_model(p));
        return static_residual(p, contact);
      };
      const MultiVector plus = residual(parameter.value + h), minus = residual(parameter.value - h);
      for (unsigned int i = 0; i < rows.n_local(); ++i)
        right.column(k)[i] = -(plus.data()[i] - minus.data()[i]) / (2 * h);
      for (const Term &term : parameter.terms)
        if (term.order == 0 && term.matrix && term.coefficient != 0)
        {
          const MultiVector product = multiply(*term.matrix, steady.equilibrium->state);
          for (unsigned int i = 0; i < rows.n_local(); ++i)
            right.column(k)[i] -= term.coefficient * product.data()[i];
        }
    }
    ContactMatrices<dim> matrices = steady.contact_matrices;
    const Matrix A =
        sum_of_terms(rows, static_terms(steady.body_terms, *steady.contact, steady.pressure,
                                        prm.terms().friction, matrices));
    if (nearby)
    {
      MultiVector result(rows, 0);
      for (unsigned int k = 0; k < parameters.size(); ++k)
      {
        const MultiVector right_hand_side = right.columns(k, 1);
        MultiVector column                = nearby(right_hand_side);
        if (!gmres([&](const MultiVector &x) { return multiply(A, x); }, nearby, right_hand_side,
                   column, 1e-12, 60))
          break;
        result.append(column);
      }
      if (result.n_columns() == parameters.size())
        return result;
    }
    return Factorization(A, Factorization::Kind::lu, "the tangent of the static equilibrium")
        .solve(right);
  }

  template <int dim>
  std::vector<ParameterDerivative>
  BrakeDerivatives<dim>::derivatives(const std::string &only, const LinearOperator &nearby) const
  {
    std::vector<Parameter> parameters = differentiable_parameters();
    parameters.erase(std::remove_if(parameters.begin(), parameters.end(),
                                    [&](const Parameter &parameter)
                                    { return !only.empty() && parameter.path != only; }),
                     parameters.end());
    if (parameters.empty())
      return {};
    const StageTerms stage = prm.terms();
    // Only friction and prestress depend on the steady state.
    const bool state_matters =
        steady.equilibrium &&
        (stage.friction || prm.prestress.needs_state() || prm.prestress.turning_contact);
    const MultiVector x_p =
        state_matters ? state_derivatives(parameters, nearby) : MultiVector(spaces.rows, 0);
    const bool has_pads = !geometry.interfaces.empty();

    std::vector<ParameterDerivative> result;
    for (unsigned int k = 0; k < parameters.size(); ++k)
    {
      const Parameter &parameter = parameters[k];
      ParameterDerivative derivative{parameter.path, parameter.value, {}};
      for (const Term &term : parameter.terms)
        if (term.matrix && term.coefficient != 0)
          derivative.terms.push_back(term);
      derivative.moduli = parameter.moduli;

      // Contact and prestress: central differences of their matrices, state and parameter together.
      const double h = parameter.step();
      for (const double sign : {1., -1.})
      {
        const Parameters::All p = varied(parameter, parameter.value + sign * h);
        MultiVector state;
        if (state_matters)
        {
          state = steady.equilibrium->state;
          state.add(sign * h, x_p.columns(k, 1));
        }
        const auto add = [&](Term term)
        {
          term.coefficient *= sign / (2 * h);
          derivative.terms.push_back(std::move(term));
        };
        if (has_pads)
        {
          Contact<dim> contact = *steady.contact;
          contact.set_model(BrakeModel<dim>::contact_model(p));
          ContactMatrices<dim> matrices = steady.contact_matrices;
          const auto pressure           = state_matters        ? contact.pressure_of(state)
                                          : steady.equilibrium ? steady.pressure
                                                               : contact.uniform_pressure(p.pads.pressure);
          for (Term &term : BrakeModel<dim>::contact_terms(contact, pressure, p, matrices))
            if (term.origin != Origin::contact || prm.contact.formulation != Formulation::mortar)
              add(std::move(term));
        }
        if (prm.prestress.needs_state())
          for (Matrix &matrix : model.stress_stiffnesses(p, state))
            add({Origin::prestress, 0, 1., std::make_shared<const Matrix>(std::move(matrix))});
      }
      result.push_back(std::move(derivative));
    }
    return result;
  }

  template <int dim>
  std::vector<ParameterDerivative> BrakeModel<dim>::derivatives(const std::string &only,
                                                                const LinearOperator &nearby) const
  {
    return BrakeDerivatives<dim>(*this).derivatives(only, nearby);
  }

  template class BrakeDerivatives<2>;
  template class BrakeDerivatives<3>;
  template std::vector<ParameterDerivative>
  BrakeModel<2>::derivatives(const std::string &, const LinearOperator &) const;
  template std::vector<ParameterDerivative>
  BrakeModel<3>::derivatives(const std::string &, const LinearOperator &) const;
} // namespace squeal
