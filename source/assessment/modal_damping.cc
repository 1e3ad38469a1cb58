#include <squeal/assessment/modal_damping.h>
#include <squeal/linalg/real_modes.h>
#include <squeal/projection/shift_invert.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace squeal
{
  namespace
  {
    /// Whether a term of the velocities damps, in contrast to transport and friction.
    bool is_damping(const Term &term)
    {
      return term.origin == Origin::material_damping || term.origin == Origin::joint ||
             term.origin == Origin::contact_damping || term.origin == Origin::velocity;
    }
  } // namespace

  std::optional<double> non_modal_damping(const Model &model, const EigenPairs &modes)
  {
    const std::vector<Term> of_velocity = terms_of_order(model.terms(), 1);
    const bool is_damped                = !model.relaxation().empty() ||
                           std::any_of(of_velocity.begin(), of_velocity.end(), is_damping);
    if (modes.size() < 2 || !is_damped)
      return std::nullopt;
    MultiVector u = modes.right.real_span();
    clear_pressures(model.equations().n_local_constraints, u); // no part of real modes
    const unsigned int n = u.n_columns();

    // Stiffness and damping may be multiples of one matrix.
    std::map<const Matrix *, DenseMatrix> forms;
    const auto form_of = [&](const Matrix &matrix) -> const DenseMatrix &
    {
      auto known = forms.find(&matrix);
      if (known == forms.end())
        known = forms.emplace(&matrix, inner_products(u, multiply(matrix, u))).first;
      return known->second;
    };
    DenseMatrix m(n, n), k(n, n), c(n, n);
    for (const unsigned int order : {0, 1, 2})
      for (const Term &term : terms_of_order(model.terms(), order))
        if (order == 1 ? is_damping(term) : is_conservative(term.origin))
          (order == 2 ? m : order == 1 ? c : k).add(term.coefficient, form_of(*term.matrix));
    for (DenseMatrix *matrix : {&m, &k, &c})
      *matrix = symmetrised(std::move(*matrix));

    const auto [phi, squares]  = real_modes(m, k, modes.size());
    const unsigned int n_modes = squares.size();

    DenseMatrix d = phi.transpose() * (c * phi);
    for (const RelaxationTerm &term : model.relaxation())
    {
      const DenseMatrix a = phi.transpose() * (form_of(*term.matrix) * phi);
      for (unsigned int j = 0; j < n_modes; ++j)
        for (unsigned int i = 0; i < n_modes; ++i)
        {
          const double w = std::pow(std::abs(squares[i] * squares[j]), 0.25);
          if (w > 0)
            d(i, j) += term.coefficient * term.factor({0, w}).imag() / w * a(i, j);
        }
    }
    double off = 0, all = 0;
    for (unsigned int j = 0; j < n_modes; ++j)
      for (unsigned int i = 0; i < n_modes; ++i)
      {
        all += d(i, j) * d(i, j);
        off += i == j ? 0 : d(i, j) * d(i, j);
      }
    if (all == 0)
      return std::nullopt;
    return std::sqrt(off / all);
  }
} // namespace squeal
