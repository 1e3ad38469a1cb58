#include <squeal/bodies/prestress.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/contact/contact_matrices.h>
#include <squeal/equations/term_list.h>
#include <squeal/linalg/gmres.h>
#include <squeal/model/brake_derivatives.h>
#include <squeal/model/measured_damping.h>

#include <algorithm>
#include <utility>

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
  } // namespace

  template <int dim>
  BrakeDerivatives<dim>::BrakeDerivatives(const BrakeModel<dim> &model)
      : model(model), spaces(model.spaces()), geometry(spaces.geometry), prm(model.parameters()),
        steady(model.steady_state())
  {
  }

  template <int dim>
  typename BrakeDerivatives<dim>::Parameter
  BrakeDerivatives<dim>::parameter_at(const std::string &path,
                                      std::function<double &(Parameters::All &)> place) const
  {
    Parameters::All all = prm;
    const double value  = place(all);
    return {path, value, std::move(place)};
  }

  template <int dim>
  void BrakeDerivatives<dim>::add_material(const unsigned int m,
                                           const Parameters::BodyMaterial &body,
                                           std::vector<Parameter> &parameters) const
  {
    const Material &material = body.material;
    const bool is_damped     = prm.terms().material_damping;
    const auto path = [&](const std::string &key) { return body.section + "/Material/" + key; };
    const auto add  = [&](const std::string &key, double Material::*constant)
    {
      parameters.push_back(
          parameter_at(path(key),
                       [section = body.section, constant](Parameters::All &all) -> double &
                       { return all.material(section).*constant; }));
    };
    if (material.transversely_isotropic)
    {
      AssembledBody by_components = model.body(m);
      if (by_components.stiffnesses.empty())
        by_components.stiffnesses = assemble_stiffnesses(spaces, geometry.bodies_of(m), material);
      for (const Material::Constant &constant : Material::elastic_constants())
      {
        add(constant.key, constant.value);
        parameters.back().bodies.emplace(m, by_components);
      }
    }
    else
      add("Young modulus", &Material::young_modulus);
    if (is_damped && material.stiffness_factor.is_active())
      for (const StiffnessFactor::Constant &constant : material.stiffness_factor.constants())
      {
        parameters.push_back({path(constant.name), constant.value});
        for (const auto &[coefficient, matrix] : model.body(m).stiffness_of(material))
          parameters.back().moduli.push_back({coefficient, matrix, constant.derivative});
      }
    add("Density", &Material::density);
    if (!is_damped)
      return;
    for (const Viscosity::Constant &constant : material.viscosity.constants())
    {
      Material unit  = material;
      unit.viscosity = constant.unit;
      parameters.push_back({path(constant.key), constant.value});
      parameters.back().terms.push_back(
          {Origin::material_damping, 1, 1.,
           assemble_body(spaces, geometry.bodies_of(m), unit, {false, false, false, false, true})
               .V});
    }
    for (const Material::Constant &constant : material.damping_constants())
      add(constant.key, constant.value);
  }

  template <int dim>
  void BrakeDerivatives<dim>::add_contact(std::vector<Parameter> &parameters) const
  {
    const StageTerms stage = prm.terms();
    const auto add         = [&](const std::string &key, double Parameters::Contact::*constant)
    {
      parameters.push_back(parameter_at("Contact/" + key,
                                        [constant](Parameters::All &all) -> double &
                                        { return all.contact.*constant; }));
    };
    if (prm.contact.formulation != Formulation::mortar)
      add("Penalty stiffness", &Parameters::Contact::penalty_stiffness);
    if (stage.friction)
      for (const auto &[key, constant] : prm.contact.friction.constants())
        parameters.push_back(parameter_at("Contact/Friction/" + key,
                                          [constant = constant](Parameters::All &all) -> double &
                                          { return all.contact.friction.*constant; }));
    if (stage.material_damping && prm.contact.normal_dashpot > 0)
      add("Normal dashpot", &Parameters::Contact::normal_dashpot);
    if (stage.material_damping && prm.contact.tangential_dashpot > 0)
      add("Tangential dashpot", &Parameters::Contact::tangential_dashpot);
    if (prm.contact.is_fully_worn())
      for (const auto &[key, constant] :
           {std::make_pair("Pressure exponent", &Parameters::Wear::pressure_exponent),
            std::make_pair("Speed exponent", &Parameters::Wear::speed_exponent)})
        parameters.push_back(parameter_at(std::string("Contact/Wear/") + key,
                                          [constant = constant](Parameters::All &all) -> double &
                                          { return all.contact.wear.*constant; }));
    parameters.push_back(parameter_at(
        "Pads/Pressure", [](Parameters::All &all) -> double & { return all.pads.pressure; }));
    if (prm.scene == Scene::mesh)
      for (unsigned int k = 0; k < prm.mesh.surface_pressures.size(); ++k)
        parameters.push_back(
            parameter_at(Parameters::Mesh::pressure_path + prm.mesh.surface_pressures[k].first,
                         [k](Parameters::All &all) -> double &
                         { return all.mesh.surface_pressures[k].second; }));
  }

  template <int dim>
  std::vector<typename BrakeDerivatives<dim>::Parameter>
  BrakeDerivatives<dim>::differentiable_parameters() const
  {
    std::vector<Parameter> result;
    // What pads have lost depends on everything that bedded them in.
    if (steady.contact && steady.contact->worn())
      return result;
    if (prm.turns() && prm.operation.angular_velocity != 0)
      result.push_back(parameter_at("Operation/Angular velocity",
                                    [](Parameters::All &all) -> double &
                                    { return all.operation.angular_velocity; }));
    const std::vector<Parameters::BodyMaterial> materials = prm.materials();
    for (unsigned int m = 0; m < materials.size(); ++m)
      if (!geometry.bodies_of(m).empty())
        add_material(m, materials[m], result);
    for (const RelaxationTerm &term : model.relaxation())
      if (term.low_rank)
      {
        const ParameterDerivative by_factor = derivative_by_factor(term, prm.modal_damping.factor);
        result.push_back({by_factor.parameter, by_factor.value});
        result.back().moduli = by_factor.moduli;
      }
    if (!geometry.interfaces.empty())
      add_contact(result);
    return result;
  }

  template <int dim>
  void BrakeDerivatives<dim>::difference_bodies(Parameter &parameter) const
  {
    if (!parameter.place)
      return;
    const double h = parameter.bodies.empty() ? parameter.step_of_polynomials() : parameter.step();
    const std::vector<Parameters::BodyMaterial> materials = prm.materials();
    for (unsigned int m = 0; m < materials.size(); ++m)
    {
      if (geometry.bodies_of(m).empty())
        continue;
      const auto own            = parameter.bodies.find(m);
      const AssembledBody &body = own != parameter.bodies.end() ? own->second : model.body(m);
      TermList changes;
      for (const double sign : {1., -1.})
      {
        const Parameters::All p = varied(parameter, parameter.value + sign * h);
        for (Term &term : body.terms(body_terms(p, p.materials()[m]), p.materials()[m].material))
        {
          term.coefficient *= sign / (2 * h);
          changes.add(term);
        }
      }
      const StiffnessFactor &factor = materials[m].material.stiffness_factor;
      for (Term &term : changes.terms())
      {
        if (term.origin == Origin::elasticity && prm.terms().material_damping && factor.is_active())
          parameter.moduli.push_back({term.coefficient, term.matrix, beyond_relaxed(factor)});
        parameter.terms.push_back(std::move(term));
      }
    }
  }

  template <int dim>
  Parameters::All BrakeDerivatives<dim>::varied(const Parameter &parameter,
                                                const double value) const
  {
    Parameters::All result = prm;
    if (parameter.place)
      parameter.place(result) = value;
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
        if (term.order == 0)
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
    for (Parameter &parameter : parameters)
      difference_bodies(parameter);
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
      ParameterDerivative derivative{parameter.path, parameter.value, parameter.terms,
                                     parameter.moduli};

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
          const auto pressure =
              state_matters ? contact.pressure_of(state)
              : steady.equilibrium
                  ? steady.pressure
                  : BrakeModel<dim>::known_pressure(p, model.worn_pressure(p, contact), contact);
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
