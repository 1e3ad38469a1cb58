#pragma once

#include <squeal/bars/local_problems.h>
#include <squeal/parameters/parameters.h>

#include <deal.II/grid/tria.h>

namespace squeal
{
  /// Elements of lower degrees lock in nearly incompressible and in flat bodies.
  constexpr unsigned int free_of_locking = 4;

  /// Whether elements of the degree may lock since the material hardly changes its volume.
  bool may_lock(const Material &material, unsigned int degree);

  /// How many times the cells of the built-in brake's rotor are as long as thick, if they are too
  /// long for solid elements of a plate; otherwise 0.
  double too_long_cells(const Parameters::Rotor &rotor, const Parameters::Discretization &mesh);

  /// Whether a cell lies at a support that holds it in all directions, at whose edges stress is
  /// singular, and is long beside its shortest side. Then stress falls over a small part of its
  /// length, and functions of V_h that follow are as many as those of one degree more.
  template <int dim>
  bool is_long_at_support(const typename dealii::Triangulation<dim>::cell_iterator &cell,
                          const std::vector<Support<dim>> &supports);

  /// What functions of V_h give way to a local problem on its cell, its neighbours being free:
  ///     K_WW - K_WV K_VV^{-1} K_VW.
  /// Where elements lock V_h cannot follow, but would together with one degree more: a problem of W
  /// alone then sees a small part of the error, this one an upper bound of what it can be. In long
  /// cells at supports the problem of W alone sees half to four fifths, this one a little more than
  /// the whole.
  template <int dim>
  class YieldingCells
  {
  public:
    /// @p lift has the functions of V_h at the nodes of the space of @p integrals.
    YieldingCells(const DenseMatrix &complement, const DenseMatrix &lift,
                  const CellResiduals<dim> &integrals);

    /// The matrix of a cell, to whose shape @p integrals was set, softened in its displacements.
    /// @p movable: which functions of V_h (component times their number plus function) may move.
    DenseMatrix soften(const LocalProblem &problem, const std::vector<bool> &movable,
                       const Material &material, CellResiduals<dim> &integrals);

  private:
    const unsigned int n_complement, n_base;
    const DenseMatrix derivatives;
    DenseMatrix stiffness;
  };
} // namespace squeal
