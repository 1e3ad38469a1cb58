#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh/element_cells.h>

#include <deal.II/base/quadrature_lib.h>

#include <algorithm>

namespace squeal
{
  using namespace dealii;

  std::vector<ElementCells> group_by_elements(const DoFHandler<3> &nodes, const OwnElements &own)
  {
    using Cell = DoFHandler<3>::active_cell_iterator;
    std::vector<std::pair<unsigned int, Cell>> cells;
    for (const auto &cell : nodes.active_cell_iterators())
      if (!cell->is_artificial() && cell->level() == 0 && own.has(cell->index()))
        cells.emplace_back(own.cells[cell->index()].element, cell);
    std::stable_sort(cells.begin(), cells.end(),
                     [](const auto &a, const auto &b) { return a.first < b.first; });
    std::vector<ElementCells> result;
    for (const auto &[element, cell] : cells)
    {
      if (result.empty() || result.back().element != element)
        result.push_back({element, {}});
      result.back().cells.push_back(cell);
    }
    return result;
  }

  std::vector<types::global_dof_index> nodes_of_element(const ElementCells &element,
                                                        const OwnElements &own,
                                                        ElementInterpolation &interpolation)
  {
    std::vector<types::global_dof_index> result, local;
    for (const auto &cell : element.cells)
    {
      const ElementInterpolation::Table &table =
          interpolation.of(own.shapes[element.element], own.cells[cell->index()].between);
      local.resize(table.own.size());
      cell->get_dof_indices(local);
      result.resize(table.own_places.size(), numbers::invalid_dof_index);
      for (unsigned int a = 0; a < local.size(); ++a)
        if (table.own[a] >= 0)
          result[table.own[a]] = local[a];
    }
    return result;
  }

  std::vector<OwnedElement> owned_elements(const FiniteElementSpace<3> &spaces)
  {
    const OwnElements &own = spaces.geometry.own;
    std::vector<OwnedElement> result;
    if (own.empty())
      return result;
    ElementInterpolation interpolation = interpolation_of(spaces, 0);
    for (const ElementCells &element : group_by_elements(spaces.nodes, own))
    {
      const auto first = first_cell(element);
      if (first->is_locally_owned())
        result.push_back({own.shapes[element.element], first->material_id(),
                          nodes_of_element(element, own, interpolation)});
    }
    return result;
  }

  ElementQuadrature::ElementQuadrature(const FiniteElementSpace<3> &spaces)
      : interpolation(interpolation_of(spaces, 0)), spaces(spaces)
  {
  }

  const ElementQuadrature::Reference &ElementQuadrature::reference(const ElementShape shape)
  {
    const auto [found, is_new] = references.try_emplace(shape);
    if (is_new)
    {
      constexpr unsigned int most_of_simplices = 5;
      const unsigned int n                     = std::min(spaces.fe.degree + 2, most_of_simplices);
      Quadrature<3> quadrature;
      if (shape == ElementShape::tetrahedron)
        quadrature = QWitherdenVincentSimplex<3>(n);
      else if (shape == ElementShape::hexahedron)
        quadrature = QGauss<3>(n);
      else
      {
        const QWitherdenVincentSimplex<2> triangle(n);
        const QGauss<1> line(n);
        std::vector<Point<3>> places;
        std::vector<double> weights;
        for (unsigned int k = 0; k < line.size(); ++k)
          for (unsigned int q = 0; q < triangle.size(); ++q)
          {
            places.emplace_back(triangle.point(q)[0], triangle.point(q)[1], line.point(k)[0]);
            weights.push_back(triangle.weight(q) * line.weight(k));
          }
        quadrature = Quadrature<3>(places, weights);
      }
      found->second = {quadrature.get_points(), quadrature.get_weights(),
                       interpolation.nodal_functions(shape, quadrature.get_points())};
    }
    return found->second;
  }

  void ElementQuadrature::reinit(const ElementShape shape,
                                 const std::vector<types::global_dof_index> &nodes)
  {
    const Reference &of  = reference(shape);
    const unsigned int n = of.points.size();
    DenseMatrix places(nodes.size(), 3);
    for (unsigned int k = 0; k < nodes.size(); ++k)
    {
      const Point<3> x = spaces.position(nodes[k]);
      for (unsigned int d = 0; d < 3; ++d)
        places(k, d) = x[d];
    }
    const DenseMatrix at = of.functions * places;
    points.resize(n);
    inverse.resize(n);
    jxw.resize(n);
    double sign = 0; // files may count the corners the other way round
    for (unsigned int q = 0; q < n; ++q)
    {
      Tensor<2, 3> jacobian; // (d, e): d x_d / d xi_e
      for (unsigned int d = 0; d < 3; ++d)
      {
        points[q][d] = at(q, d);
        for (unsigned int e = 0; e < 3; ++e)
          jacobian[d][e] = at((1 + e) * n + q, d);
      }
      const double measure = determinant(jacobian);
      if (q == 0)
        sign = measure < 0 ? -1 : 1;
      if (!(sign * measure > 0))
        throw InputError(text_of("Mesh/File: an element at ", points[q],
                                 " is turned inside out where its edges follow its middle nodes. "
                                 "These must be nearer to the middles."));
      inverse[q] = invert(jacobian);
      jxw[q]     = of.weights[q] * sign * measure;
    }
  }
} // namespace squeal
