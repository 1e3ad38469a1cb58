#include <squeal/bars/locking.h>
#include <squeal/bars/yielding_bodies.h>
#include <squeal/bodies/body_operators.h>
#include <squeal/mesh/element_cells.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Cells that are longer beside their thickness bend too stiffly for local problems alone: at
    /// degree 2 these see nine tenths of what one degree more changes in cells as long as thick,
    /// six tenths at 4, three tenths at 8.
    constexpr double long_cell = 2.5;
    /// The part of a body's volume that flat cells make up where the body is one of flat cells:
    /// every mesh of tetrahedra has some.
    constexpr double flat_part = 0.1;

    /// Whether a cell is long, by the mean of its other sides, beside its shortest side, across
    /// which it reaches a surface. Where there are more layers it is the thickness of all that
    /// counts, three as a guess. A layer of cells at a clamp is no plate.
    template <int dim>
    bool is_flat(const typename Triangulation<dim>::cell_iterator &cell,
                 const std::vector<Support<dim>> &supports)
    {
      unsigned int shortest = 0;
      double area           = 1;
      for (unsigned int d = 0; d < dim; ++d)
      {
        if (cell->extent_in_direction(d) < cell->extent_in_direction(shortest))
          shortest = d;
        area *= cell->extent_in_direction(d);
      }
      double height = cell->extent_in_direction(shortest);
      area /= height;
      bool at_surface = false, in_layers = false;
      for (const unsigned int f : {2 * shortest, 2 * shortest + 1})
        if (cell->face(f)->at_boundary())
        {
          for (const Support<dim> &support : supports)
            if (support.boundary == cell->face(f)->boundary_id() &&
                std::count(support.fixed.begin(), support.fixed.end(), true) == dim)
              return false;
          at_surface = true;
        }
        else
          in_layers = true;
      if (in_layers)
        height *= 3;
      return at_surface && std::pow(area, 1. / (dim - 1)) > long_cell * height;
    }

    /// How many times an element is as long as thick: sqrt(V/h^3) with its least height h, so that
    /// a cube, a regular tetrahedron and a wedge with three square faces have 1.
    double flatness(const ElementShape shape, const ElementQuadrature &element, const double volume)
    {
      // The gradient of a coordinate that is 0 on a face and 1 opposite to it has length 1/h.
      Tensor<1, 3> gradients[3], others;
      double steepest = 0;
      for (unsigned int e = 0; e < 3; ++e)
      {
        for (unsigned int d = 0; d < 3; ++d)
          gradients[e][d] = element.inverse[0][e][d];
        steepest = std::max(steepest, gradients[e].norm());
      }
      double regular = 1;
      if (shape == ElementShape::tetrahedron)
      {
        others  = gradients[0] + gradients[1] + gradients[2];
        regular = 0.4653;
      }
      else if (shape == ElementShape::wedge)
      {
        others  = gradients[0] + gradients[1];
        regular = 0.8165;
      }
      steepest = std::max(steepest, others.norm());
      return std::sqrt(volume * steepest * steepest * steepest) / regular;
    }
  } // namespace

  template <int dim>
  YieldingBodies<dim>::YieldingBodies(const EnrichedResiduals<dim> &residuals, const double shift)
      : residuals(residuals), space(residuals.space), shift(shift)
  {
    if (space.base.fe.degree < free_of_locking)
      find_bodies();
  }

  template <int dim>
  void YieldingBodies<dim>::find_bodies()
  {
    const Geometry<dim> &geometry = space.base.geometry;
    /// What is known of a body: volumes; whether it has first sides, or nodes of other bodies.
    struct Shape
    {
      double flat = 0, whole = 0, joined = 0;
    };
    std::map<Body, Shape> shapes;
    for (const auto &named : geometry.named_bodies())
      shapes[named.second] = {};
    const auto shape_of = [&](const auto &cell)
    { return shapes.find(geometry.parts[cell->material_id()].body); };
    for (const auto &cell : space.fine.nodes.active_cell_iterators())
      if (cell->is_locally_owned())
      {
        const auto shape = shape_of(cell);
        if (shape == shapes.end())
          continue;
        if (!(cell->level() == 0 && geometry.own.has(cell->index())))
        {
          shape->second.whole += cell->measure();
          if (is_flat<dim>(cell, geometry.supports))
            shape->second.flat += cell->measure();
        }
        for (const unsigned int f : cell->face_indices())
          if (cell->at_boundary(f))
          {
            const types::boundary_id id = cell->face(f)->boundary_id();
            for (const ContactInterface &interface : geometry.interfaces)
              shape->second.joined += interface.pad_face == id;
            for (const TiedSurfaces &tie : geometry.ties)
              shape->second.joined += tie.side == id;
          }
          else
            shape->second.joined += shape_of(cell->neighbor(f)) != shape;
      }
    if constexpr (dim == 3)
      if (!geometry.own.empty())
      {
        ElementQuadrature quadrature(space.fine);
        for (const auto &element : space.map.elements)
          if (const auto shape = shape_of(element.cells.cells[0]);
              element.mine && shape != shapes.end())
          {
            quadrature.reinit(element.shape, element.nodes);
            const double volume = std::accumulate(quadrature.jxw.begin(), quadrature.jxw.end(), 0.);
            shape->second.whole += volume;
            if (flatness(element.shape, quadrature, volume) > long_cell)
              shape->second.flat += volume;
          }
      }
    for (auto &[body, shape] : shapes)
    {
      double sums[] = {shape.flat, shape.whole, shape.joined};
      MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE, MPI_SUM, space.fine.comm);
      if (sums[0] > flat_part * sums[1] && sums[2] == 0)
        bodies.insert(body);
    }
  }

  template <int dim>
  void YieldingBodies<dim>::factorise()
  {
    std::vector<Term> terms;
    for (unsigned int m = 0; m < residuals.materials.size(); ++m)
    {
      std::vector<Body> own; // by material ids, as the assembly takes them
      for (const Body id : space.base.geometry.bodies_of(m))
        if (bodies.count(space.base.geometry.parts[id].body) > 0)
          own.push_back(id);
      if (own.empty())
        continue;
      BodyMatrices matrices =
          assemble_body(space.fine, own, residuals.materials[m].material, false);
      terms.push_back({Origin::elasticity, 0, 1., std::move(matrices.K)});
      terms.push_back({Origin::elasticity, 0, shift, std::move(matrices.M)});
    }
    const Matrix sum = sum_of_terms(space.fine.rows, terms);
    terms.clear();
    std::vector<char> held(space.fine.rows.size);
    std::fill(held.begin() + space.fine.rows.begin, held.begin() + space.fine.rows.end, 1);
    for_entries(sum,
                [&](const PetscInt row, PetscInt, const double value)
                {
                  if (value != 0)
                    held[row] = 0;
                });
    factors = std::make_unique<PartialFactorization>(
        space.fine.rows, sum, std::move(held), Factorization::Kind::ldlt,
        "the stiffness of bodies with flat cells, one degree higher, for their error bars");
  }

  template <int dim>
  MultiVector YieldingBodies<dim>::answer(const MultiVector &r)
  {
    if (!factors)
      factorise();
    return factors->solve(r);
  }

  template class YieldingBodies<2>;
  template class YieldingBodies<3>;
} // namespace squeal
