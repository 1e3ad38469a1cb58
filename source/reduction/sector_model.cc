#include <squeal/eigen/growth_search.h>
#include <squeal/reduction/sector_model.h>

#include <algorithm>

namespace squeal
{
  void SectorModel::set_terms(const std::vector<Term> &of_whole, const TermList &list,
                              const std::vector<std::vector<Term>> &added)
  {
    if (sector.is_whole())
    {
      own_terms = of_whole;
      return;
    }
    std::vector<Matrix> parts = sector.sums(added);
    unsigned int next         = 0;
    restricted.carry_over(list, [&](unsigned int)
                          { return std::make_shared<const Matrix>(std::move(parts[next++])); });
    own_terms.clear();
    for (const Term &term : of_whole)
      if (term.matrix && *term.matrix)
        own_terms.push_back(
            {term.origin, term.order, term.coefficient, restricted.at(term.matrix)});
  }

  void SectorModel::set_expansion_point(const QuadraticEigenproblem &whole,
                                        const EigenSolution::Reuse &found, const bool semidefinite)
  {
    QuadraticEigenproblem of_sector;
    if (!sector.is_whole())
      of_sector = expansion_problem(whole);
    const QuadraticEigenproblem &own = sector.is_whole() ? whole : of_sector;
    n_modes                          = found.disc_right.n_columns() / 2;
    expansion_count                  = found.n_reference;
    position_factors                 = found.factorization;
    // Without modes it keeps what it has learnt of the terms.
    reduced.set_expansion_point(own, own_terms, has_modes() ? found : EigenSolution::Reuse());
    if (!reference)
      reference = std::make_shared<BracketedCount>(own.rows, own.n_local_constraints,
                                                   search_radius(max_imaginary), semidefinite);
    reference->forget_box();
  }

  QuadraticEigenproblem SectorModel::expansion_problem(const QuadraticEigenproblem &whole) const
  {
    QuadraticEigenproblem result;
    result.rows                = sector.row_range();
    result.M                   = sum_of(result.rows, own_terms, 2);
    result.Q                   = sum_of(result.rows, own_terms, 0);
    result.n_constraints       = share_of(whole.n_constraints);
    result.n_local_constraints = sector.n_local_pressures(whole.n_local_constraints);
    result.compliant           = whole.compliant;
    return result;
  }

  ParameterDerivative SectorModel::project(const ParameterDerivative &derivative) const
  {
    ParameterDerivative projected = derivative;
    projected.terms.clear();
    for (const Term &term : derivative.terms)
      if (term.matrix && *term.matrix)
        projected.terms.push_back(
            {term.origin, term.order, term.coefficient, sector.restrict(term.matrix)});
    projected.terms = reduced.projected().project(projected.terms);
    return projected;
  }

  SectorModes::SectorModes(const SectorModel &model, const EigenPairs &list) : model(model)
  {
    for (unsigned int k = 0; k < list.size(); ++k)
      if (model.sector.is_whole() || list.parity[k] == model.sector.parity())
        numbers.push_back(k);
    pairs = in_coordinates(list.select(numbers), model.reduced.dimension());
  }

  void SectorModes::put(const std::vector<std::complex<double>> &values,
                        std::vector<std::complex<double>> &list) const
  {
    for (unsigned int k = 0; k < numbers.size(); ++k)
      list[numbers[k]] = values[k];
  }

  void SectorModes::put_vectors(EigenPairs &list) const
  {
    const auto put_columns = [&](const MultiVector &from, MultiVector &to)
    {
      for (unsigned int k = 0; k < numbers.size(); ++k)
        std::copy_n(from.column(k), from.n_local(), to.column(numbers[k]));
    };
    put_columns(pairs.right.re, list.right.re);
    put_columns(pairs.right.im, list.right.im);
    put_columns(pairs.left.re, list.left.re);
    put_columns(pairs.left.im, list.left.im);
  }
} // namespace squeal
