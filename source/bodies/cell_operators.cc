#include <squeal/bodies/cell_operators.h>

#include <deal.II/base/quadrature_lib.h>

#include <petscblaslapack.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  template <int dim>
  CellIntegrals<dim>::CellIntegrals(const FiniteElementSpace<dim> &spaces,
                                    const bool with_transport)
      : n(spaces.fe.n_dofs_per_cell()), n_rows((dim + 1 + with_transport) * n), spaces(spaces),
        with_transport(with_transport),
        fe_values(spaces.mapping, spaces.fe, QGauss<dim>(spaces.fe.degree + 1),
                  update_values | update_gradients | update_quadrature_points | update_JxW_values),
        factors(std::size_t(n_rows) * fe_values.n_quadrature_points), products(n_rows, n_rows)
  {
  }

  template <int dim>
  void CellIntegrals<dim>::reinit(const typename DoFHandler<dim>::active_cell_iterator &cell)
  {
    fe_values.reinit(cell);
    for (const unsigned int q : fe_values.quadrature_point_indices())
    {
      const double root      = std::sqrt(fe_values.JxW(q));
      double *column         = factors.data() + std::size_t(q) * n_rows;
      const Tensor<1, dim> w = spaces.geometry.transport(fe_values.quadrature_point(q));
      for (unsigned int a = 0; a < n; ++a)
      {
        const Tensor<1, dim> &gradient = fe_values.shape_grad(a, q);
        for (unsigned int d = 0; d < dim; ++d)
          column[d * n + a] = root * gradient[d];
        column[dim * n + a] = root * fe_values.shape_value(a, q);
        if (with_transport)
          column[(dim + 1) * n + a] = root * (w * gradient);
      }
    }
    const PetscBLASInt m = n_rows, k = fe_values.n_quadrature_points;
    const double one = 1, zero = 0;
    BLASsyrk_("U", "N", &m, &k, &one, factors.data(), &m, &zero, products.values.data(), &m);
    for (unsigned int j = 0; j < n_rows; ++j)
      for (unsigned int i = 0; i < j; ++i)
        products(j, i) = products(i, j);
  }

  template <int dim>
  void stiffness_block(const CellIntegrals<dim> &integrals,
                       const std::array<double, dim * dim * dim * dim> &C, const unsigned int i,
                       const unsigned int k, DenseMatrix &block)
  {
    const unsigned int n = integrals.n;
    std::fill(block.values.begin(), block.values.end(), 0.);
    for (unsigned int j = 0; j < dim; ++j)
      for (unsigned int l = 0; l < dim; ++l)
      {
        const double c = C[((i * dim + k) * dim + j) * dim + l];
        if (c == 0)
          continue;
        for (unsigned int a = 0; a < n; ++a)
          for (unsigned int b = 0; b < n; ++b)
            block(b, a) += c * integrals.derivatives(j, l, a, b);
      }
    if (i == k) // rounding: the order of summation differs between (a, b) and (b, a)
      for (unsigned int a = 0; a < n; ++a)
        for (unsigned int b = 0; b < a; ++b)
          block(b, a) = block(a, b);
  }

  template <int dim>
  void CellNodes<dim>::reinit(const typename DoFHandler<dim>::active_cell_iterator &cell)
  {
    cell->get_dof_indices(local);
    hanging = std::any_of(local.begin(), local.end(),
                          [&](const auto node) { return spaces.hanging.is_constrained(node); });
    free    = local;
    if (hanging)
    {
      free.clear();
      std::vector<std::vector<WeightedNode>> expansions;
      for (const auto node : local)
      {
        expansions.push_back(spaces.expand(node));
        for (const WeightedNode &w : expansions.back())
          free.push_back(w.node);
      }
      std::sort(free.begin(), free.end());
      free.erase(std::unique(free.begin(), free.end()), free.end());
      interpolation = DenseMatrix(local.size(), free.size());
      for (unsigned int a = 0; a < local.size(); ++a)
        for (const WeightedNode &w : expansions[a])
          interpolation(a, std::lower_bound(free.begin(), free.end(), w.node) - free.begin()) +=
              w.weight;
    }
    equations.resize(dim);
    for (unsigned int c = 0; c < dim; ++c)
    {
      equations[c].clear();
      for (const auto node : free)
        equations[c].push_back(static_cast<PetscInt>(static_cast<int>(spaces.equation(node, c))));
    }
  }

  template <int dim>
  const DenseMatrix &CellNodes<dim>::condense(const DenseMatrix &a)
  {
    if (!hanging)
      return a;
    condensed = interpolation.transpose() * (a * interpolation);
    return condensed;
  }

  template class CellIntegrals<2>;
  template class CellIntegrals<3>;
  template class CellNodes<2>;
  template class CellNodes<3>;
  template void stiffness_block<2>(const CellIntegrals<2> &, const std::array<double, 16> &,
                                   unsigned int, unsigned int, DenseMatrix &);
  template void stiffness_block<3>(const CellIntegrals<3> &, const std::array<double, 81> &,
                                   unsigned int, unsigned int, DenseMatrix &);
} // namespace squeal
