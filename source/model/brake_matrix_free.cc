#include <squeal/bodies/displacement_operator.h>
#include <squeal/model/brake_model.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace squeal
{
  namespace
  {
    /// The materials of the bodies that are there, without any factors, and the terms of each.
    template <int dim>
    struct MatrixFreeBodies
    {
      std::vector<MaterialOperator> parts;
      std::vector<std::vector<BodyTerm>> terms;

      MatrixFreeBodies(const Parameters::All &prm, const Geometry<dim> &geometry)
      {
        const std::vector<Parameters::BodyMaterial> materials = prm.materials();
        for (unsigned int m = 0; m < materials.size(); ++m)
        {
          if (geometry.bodies_of(m).empty())
            continue;
          MaterialOperator part{geometry.bodies_of(m), materials[m].material};
          part.k = 0;
          parts.push_back(part);
          terms.push_back(body_terms(prm, materials[m]));
        }
      }

      /// The sum of the terms of one order.
      std::vector<MaterialOperator> sum(const unsigned int order) const
      {
        std::vector<MaterialOperator> result = parts;
        for (unsigned int k = 0; k < parts.size(); ++k)
          for (const BodyTerm &term : terms[k])
            if (term.order == order)
              factor(result[k], term.matrix) += term.coefficient;
        return result;
      }

      /// One matrix of one material.
      std::vector<MaterialOperator> single(const unsigned int part, const BodyTerm::Kind kind) const
      {
        std::vector<MaterialOperator> result = parts;
        factor(result[part], kind)           = 1;
        return result;
      }

    private:
      static double &factor(MaterialOperator &part, const BodyTerm::Kind kind)
      {
        switch (kind)
        {
        case BodyTerm::Kind::M:
          return part.m;
        case BodyTerm::Kind::K:
          return part.k;
        case BodyTerm::Kind::G:
          return part.g;
        case BodyTerm::Kind::M_star:
          return part.m_star;
        default:
          throw std::logic_error("Operators without matrices have no viscosity.");
        }
      }
    };
  } // namespace

  template <int dim>
  std::shared_ptr<IterativeStatics<dim>>
  BrakeModel<dim>::make_iterative_solver(const Parameters::All &prm, const bool needs_edge) const
  {
    PhaseTimer::Scope scope(timer, "assembly");
    auto iterative = std::make_shared<IterativeStatics<dim>>(
        spaces_, MatrixFreeBodies<dim>(prm, geometry).sum(0),
        IterativeOptions{prm.static_equilibrium.multigrid,
                         prm.static_equilibrium.maximum_iterations});
    log.line("Static equilibrium by GMRES: " + iterative->description());
    if (needs_edge)
      log.line("Error bars take the border of contact for known: what moves it needs factors.");
    return iterative;
  }

  template <int dim>
  std::vector<Term> BrakeModel<dim>::matrix_free_bodies(const SteadyState<dim> &state) const
  {
    const MatrixFreeBodies<dim> bodies(state.parameters, geometry);
    std::vector<Term> terms;
    for (unsigned int k = 0; k < bodies.parts.size(); ++k)
    {
      std::array<std::shared_ptr<const Matrix>, 4> by_kind;
      for (const BodyTerm &term : bodies.terms[k])
      {
        std::shared_ptr<const Matrix> &matrix = by_kind[static_cast<unsigned int>(term.matrix)];
        if (!matrix)
        {
          const auto product = std::make_shared<const DisplacementOperator<dim>>(
              state.iterative->stiffness(), bodies.single(k, term.matrix));
          matrix = std::make_shared<const Matrix>(
              make_matrix_free(spaces_.rows, [product](const MultiVector &x, const bool transposed)
                               { return product->multiply(x, transposed); }));
        }
        terms.push_back({term.origin, term.order, term.coefficient, matrix});
      }
    }
    return terms;
  }

  template <int dim>
  Matrix BrakeModel<dim>::matrix_free_sum(const unsigned int order) const
  {
    const MatrixFreeBodies<dim> bodies(parameters(), geometry);
    const auto of_bodies = std::make_shared<const DisplacementOperator<dim>>(
        steady.iterative->stiffness(), bodies.sum(order));
    std::vector<Term> others = equations_.of_order(order);
    others.erase(std::remove_if(others.begin(), others.end(),
                                [](const Term &term) { return product_of(*term.matrix); }),
                 others.end());
    const auto of_surfaces = std::make_shared<const Matrix>(sum_of_terms(spaces_.rows, others));
    return make_matrix_free(spaces_.rows,
                            [of_bodies, of_surfaces](const MultiVector &x, const bool transposed)
                            {
                              MultiVector y           = of_bodies->multiply(x, transposed);
                              const MultiVector added = transposed
                                                            ? multiply_transposed(*of_surfaces, x)
                                                            : multiply(*of_surfaces, x);
                              y += added;
                              return y;
                            });
  }

  template <int dim>
  DavidsonProblem BrakeModel<dim>::davidson_problem() const
  {
    std::vector<Term> coupling;
    std::copy_if(terms().begin(), terms().end(), std::back_inserter(coupling),
                 [](const Term &term)
                 { return term.origin == Origin::contact || term.origin == Origin::friction; });
    const bool slides                = parameters().terms().friction && parameters().n_pads() > 0;
    IterativeStatics<dim> &iterative = *steady.iterative;
    iterative.set_up(*steady.contact, steady.pressure, slides);
    QuadraticEigenproblem problem = equations_.without_matrices();
    problem.M                     = matrix_free_sum(2);
    if (!equations_.of_order(1).empty())
      problem.P = matrix_free_sum(1);
    problem.Q                        = matrix_free_sum(0);
    const unsigned int n_multipliers = spaces_.rows.end - spaces_.first_local_multiplier;
    return {std::move(problem),
            ConstraintProjection(spaces_.rows, n_multipliers, sum_of_terms(spaces_.rows, coupling),
                                 iterative.stiffness().diagonal()),
            [solver = steady.iterative](const MultiVector &forces)
            { return solver->cycle(forces); },
            std::all_of(terms().begin(), terms().end(),
                        [](const Term &term) { return is_conservative(term.origin); })};
  }

  template std::shared_ptr<IterativeStatics<2>>
  BrakeModel<2>::make_iterative_solver(const Parameters::All &, bool) const;
  template std::shared_ptr<IterativeStatics<3>>
  BrakeModel<3>::make_iterative_solver(const Parameters::All &, bool) const;
  template std::vector<Term> BrakeModel<2>::matrix_free_bodies(const SteadyState<2> &) const;
  template std::vector<Term> BrakeModel<3>::matrix_free_bodies(const SteadyState<3> &) const;
  template DavidsonProblem BrakeModel<2>::davidson_problem() const;
  template DavidsonProblem BrakeModel<3>::davidson_problem() const;
} // namespace squeal
