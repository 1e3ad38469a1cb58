#include <squeal/eigen/find_modes.h>
#include <squeal/linalg/real_modes.h>
#include <squeal/model/measured_damping.h>
#include <squeal/projection/shift_invert.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace squeal
{
  namespace
  {
    /// (l^2 M + Q_ref) x = 0.
    EquationsOfMotion conservative_part(const EquationsOfMotion &equations)
    {
      EquationsOfMotion result = equations;
      result.relaxation.clear();
      result.terms.clear();
      std::copy_if(equations.terms.begin(), equations.terms.end(), std::back_inserter(result.terms),
                   [](const Term &term)
                   { return term.order != 1 && is_conservative(term.origin); });
      return result;
    }
  } // namespace

  RelaxationTerm measured_damping(const EquationsOfMotion &equations, const Sectors &sectors,
                                  const Parameters::All &parameters)
  {
    const EquationsOfMotion conservative = conservative_part(equations);
    const Parameters::Eigenproblem &prm  = parameters.eigenproblem;
    EigensolverOptions options;
    options.max_imaginary  = search_radius(2 * M_PI * prm.maximum_frequency);
    options.tolerance      = prm.tolerance;
    const EigenPairs found = find_modes(prm.solver, conservative, options, sectors).modes;

    MultiVector span = found.right.real_span();
    clear_pressures(equations.n_local_constraints, span);
    const unsigned int n = span.n_columns();
    DenseMatrix m(n, n), k(n, n);
    for (const unsigned int order : {0u, 2u})
      for (const Term &term : conservative.of_order(order))
        (order == 2 ? m : k)
            .add(term.coefficient, inner_products(span, multiply(*term.matrix, span)));
    const RealModes modes = real_modes(symmetrised(m), symmetrised(k), found.size());

    const auto low_rank = std::make_shared<LowRank>();
    low_rank->vectors   = MultiVector(equations.rows, modes.squares.size());
    low_rank->preimages = combine(span, modes.coordinates);
    for (const Term &term : conservative.of_order(2))
      low_rank->vectors.add(term.coefficient, multiply(*term.matrix, low_rank->preimages));
    for (const double square : modes.squares)
    {
      const double omega = std::sqrt(std::max(0., square));
      low_rank->weights.push_back(2 * parameters.modal_damping.at(omega / (2 * M_PI)) * omega);
    }
    StiffnessFactor dashpot;
    dashpot.viscosity = 1;
    return {Origin::material_damping, 1., std::make_shared<const Matrix>(make_matrix(low_rank)),
            dashpot, low_rank};
  }

  ParameterDerivative derivative_by_factor(const RelaxationTerm &damping, const double factor)
  {
    return {"Modal damping/Factor",
            factor,
            {},
            {{1 / factor, damping.matrix, [](const std::complex<double> l) { return l; }}}};
  }
} // namespace squeal
