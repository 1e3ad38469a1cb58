#include <squeal/bars/locking.h>

#include <algorithm>
#include <limits>

namespace squeal
{
  bool may_lock(const Material &material, const unsigned int degree)
  {
    constexpr double nearly_incompressible = 0.49;
    return degree < free_of_locking && material.poisson_ratio > nearly_incompressible;
  }

  double too_long_cells(const Parameters::Rotor &rotor, const Parameters::Discretization &mesh)
  {
    constexpr double long_cell = 20;
    const double length        = (rotor.outer_radius - rotor.inner_radius) / mesh.rotor_cells[0],
                 thickness     = rotor.thickness / mesh.rotor_cells[2];
    return length > long_cell * thickness ? length / thickness : 0;
  }

  template <int dim>
  bool is_long_at_support(const typename dealii::Triangulation<dim>::cell_iterator &cell,
                          const std::vector<Support<dim>> &supports)
  {
    constexpr double long_cell = 4;
    double shortest = std::numeric_limits<double>::max(), longest = 0;
    for (unsigned int d = 0; d < dim; ++d)
    {
      shortest = std::min(shortest, cell->extent_in_direction(d));
      longest  = std::max(longest, cell->extent_in_direction(d));
    }
    if (longest <= long_cell * shortest)
      return false;
    for (const unsigned int face : cell->face_indices())
      if (cell->at_boundary(face))
        for (const Support<dim> &support : supports)
          if (cell->face(face)->boundary_id() == support.boundary &&
              std::count(support.fixed.begin(), support.fixed.end(), true) == dim)
            return true;
    return false;
  }

  DenseMatrix side_by_side(const DenseMatrix &a, const DenseMatrix &b)
  {
    DenseMatrix result(a.n_rows, a.n_columns + b.n_columns, a.values);
    result.values.insert(result.values.end(), b.values.begin(), b.values.end());
    return result;
  }

  template <int dim>
  YieldingCells<dim>::YieldingCells(const DenseMatrix &complement, const DenseMatrix &lift,
                                    const CellResiduals<dim> &integrals)
      : n_complement(complement.n_columns), n_base(lift.n_columns),
        derivatives(integrals.reference_derivatives(side_by_side(complement, lift))),
        stiffness(dim * derivatives.n_columns, dim * derivatives.n_columns)
  {
  }

  template <int dim>
  DenseMatrix YieldingCells<dim>::soften(const LocalProblem &problem,
                                         const std::vector<bool> &movable, const Material &material,
                                         CellResiduals<dim> &integrals)
  {
    const unsigned int n = n_complement + n_base;
    integrals.stiffness(material, derivatives, stiffness);
    std::vector<unsigned int> moves, base;
    for (const int unknown : problem.unknowns)
      if (unknown < int(dim * n_complement))
        moves.push_back(unknown / n_complement * n + unknown % n_complement);
    for (unsigned int i = 0; i < dim * n_base; ++i)
      if (movable[i])
        base.push_back(i / n_base * n + n_complement + i % n_base);
    return give_way(stiffness, moves, base, problem.matrix);
  }

  DenseMatrix give_way(const DenseMatrix &stiffness, const std::vector<unsigned int> &moves,
                       const std::vector<unsigned int> &base, const DenseMatrix &matrix)
  {
    if (base.empty())
      return matrix;
    DenseMatrix k(base.size(), base.size()), coupling(base.size(), moves.size());
    for (unsigned int j = 0; j < base.size(); ++j)
      for (unsigned int i = 0; i < base.size(); ++i)
        k(i, j) = stiffness(base[i], base[j]);
    // Rigid motions of a free cell are orthogonal to the coupling: a little stiffness holds them.
    for (unsigned int i = 0; i < base.size(); ++i)
      k(i, i) *= 1 + 1e-9;
    for (unsigned int j = 0; j < moves.size(); ++j)
      for (unsigned int i = 0; i < base.size(); ++i)
        coupling(i, j) = stiffness(base[i], moves[j]);
    const DenseMatrix answer = solve_positive(std::move(k), coupling);
    const DenseMatrix relief = coupling.transpose() * answer;
    DenseMatrix result       = matrix;
    // Displacements come first.
    for (unsigned int j = 0; j < moves.size(); ++j)
      for (unsigned int i = 0; i < moves.size(); ++i)
        result(i, j) -= (relief(i, j) + relief(j, i)) / 2;
    return result;
  }

  template bool is_long_at_support(const dealii::Triangulation<2>::cell_iterator &,
                                   const std::vector<Support<2>> &);
  template bool is_long_at_support(const dealii::Triangulation<3>::cell_iterator &,
                                   const std::vector<Support<3>> &);
  template class YieldingCells<2>;
  template class YieldingCells<3>;
} // namespace squeal
