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
      : n(0), n_rows(0), n_points(0), spaces(spaces), with_transport(with_transport),
        fe_values(spaces.mapping, spaces.fe, QGauss<dim>(spaces.fe.degree + 1),
                  update_values | update_gradients | update_quadrature_points | update_JxW_values)
  {
    set_functions(spaces.fe.n_dofs_per_cell(), fe_values.n_quadrature_points);
    if constexpr (dim == 3)
      if (!spaces.geometry.own.empty())
        elements = std::make_unique<ElementQuadrature>(spaces);
  }

  template <int dim>
  void CellIntegrals<dim>::set_functions(const unsigned int n_functions, const unsigned int points)
  {
    if (n == n_functions && n_points == points)
      return;
    n        = n_functions;
    n_points = points;
    n_rows   = (dim + 1 + with_transport) * n;
    factors.resize(std::size_t(n_rows) * n_points);
    products = DenseMatrix(n_rows, n_rows);
  }

  template <int dim>
  void CellIntegrals<dim>::reinit(const typename DoFHandler<dim>::active_cell_iterator &cell)
  {
    fe_values.reinit(cell);
    set_functions(spaces.fe.n_dofs_per_cell(), fe_values.n_quadrature_points);
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
    multiply();
  }

  template <int dim>
  void CellIntegrals<dim>::reinit(const OwnedElement &element)
  {
    if constexpr (dim == 3)
    {
      elements->reinit(element.shape, element.nodes);
      const DenseMatrix &functions = elements->reference(element.shape).functions;
      set_functions(element.nodes.size(), elements->points.size());
      for (unsigned int q = 0; q < n_points; ++q)
      {
        const double root    = std::sqrt(elements->jxw[q]);
        double *column       = factors.data() + std::size_t(q) * n_rows;
        const Tensor<1, 3> w = spaces.geometry.transport(elements->points[q]);
        for (unsigned int a = 0; a < n; ++a)
        {
          Tensor<1, 3> gradient;
          for (unsigned int e = 0; e < 3; ++e)
            for (unsigned int d = 0; d < 3; ++d)
              gradient[d] += elements->inverse[q][e][d] * functions((1 + e) * n_points + q, a);
          for (unsigned int d = 0; d < 3; ++d)
            column[d * n + a] = root * gradient[d];
          column[3 * n + a] = root * functions(q, a);
          if (with_transport)
            column[4 * n + a] = root * (w * gradient);
        }
      }
      multiply();
    }
    else
      (void)element;
  }

  template <int dim>
  void CellIntegrals<dim>::multiply()
  {
    const PetscBLASInt m = n_rows, k = n_points;
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
    local.resize(spaces.fe.n_dofs_per_cell());
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
    find_equations();
  }

  template <int dim>
  void CellNodes<dim>::reinit(const OwnedElement &element)
  {
    local = free = element.nodes;
    hanging      = false;
    find_equations();
  }

  template <int dim>
  void CellNodes<dim>::find_equations()
  {
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
