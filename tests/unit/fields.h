#pragma once

#include "helpers.h"

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_values.h>

#include <squeal/mesh/finite_element_space.h>
#include <squeal/scenes/make_scene.h>

/// What the tests on meshes share.
namespace squeal::tests
{
  using dealii::Point;
  using dealii::Tensor;

  inline bool is_one_of(const dealii::types::material_id body, const std::vector<Body> &bodies)
  {
    return std::find(bodies.begin(), bodies.end(), body) != bodies.end();
  }

  const std::vector<Body> all_bodies = {rotor_body, upper_pad_body, lower_pad_body};

  /// Refines the cells for which the function, given the cell's centre and body, says so.
  template <int dim, typename Function>
  void refine_where(FiniteElementSpace<dim> &spaces, const Function &wanted)
  {
    for (const auto &cell : spaces.triangulation.active_cell_iterators())
      if (cell->is_locally_owned() && wanted(cell->center(), cell->material_id()))
        cell->set_refine_flag();
    spaces.triangulation.execute_coarsening_and_refinement();
    spaces.distribute();
  }

  /// The nodal interpolant of a displacement field on some bodies, as a column: values at free
  /// nodes where the component has an equation, 0 elsewhere.
  template <int dim, typename Field>
  MultiVector interpolate(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                          const Field &field)
  {
    MultiVector column(spaces.rows, 1);
    std::vector<dealii::types::global_dof_index> cell_nodes(spaces.fe.n_dofs_per_cell());
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned() && is_one_of(cell->material_id(), bodies))
      {
        cell->get_dof_indices(cell_nodes);
        for (unsigned int a = 0; a < cell_nodes.size(); ++a)
        {
          const Point<dim> x = spaces.mapping.transform_unit_to_real_cell(
              cell, spaces.fe.get_unit_support_points()[a]);
          const Tensor<1, dim> u = field(x);
          for (unsigned int c = 0; c < dim; ++c)
          {
            const unsigned int row = spaces.equation(cell_nodes[a], c);
            if (row != FiniteElementSpace<dim>::none && spaces.rows.contains(row))
              column.column(0)[row - spaces.rows.begin] = u[c];
          }
        }
      }
    return column;
  }

  template <int dim>
  MultiVector translation(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                          const unsigned int component)
  {
    return interpolate(spaces, bodies,
                       [&](const Point<dim> &)
                       {
                         Tensor<1, dim> u;
                         u[component] = 1;
                         return u;
                       });
  }

  /// A constant contact pressure: every multiplier has this value.
  template <int dim>
  MultiVector constant_multiplier(const FiniteElementSpace<dim> &spaces, const double value)
  {
    MultiVector column(spaces.rows, 1);
    std::fill(column.column(0) + (spaces.first_local_multiplier - spaces.rows.begin),
              column.column(0) + spaces.rows.n_local(), value);
    return column;
  }

  /// The integral of a function over some bodies as they are meshed, with the quadrature of the
  /// assembly.
  template <int dim, typename Function>
  double integrate(const FiniteElementSpace<dim> &spaces, const std::vector<Body> &bodies,
                   const Function &function)
  {
    dealii::FEValues<dim> fe_values(spaces.mapping, spaces.fe,
                                    dealii::QGauss<dim>(spaces.fe.degree + 1),
                                    dealii::update_quadrature_points | dealii::update_JxW_values);
    double sum = 0;
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned() && is_one_of(cell->material_id(), bodies))
      {
        fe_values.reinit(cell);
        for (const unsigned int q : fe_values.quadrature_point_indices())
          sum += fe_values.JxW(q) * function(fe_values.quadrature_point(q));
      }
    return dealii::Utilities::MPI::sum(sum, MPI_COMM_WORLD);
  }

  /// The same over a boundary; the function gets the place and the outward normal.
  template <int dim, typename Function>
  double integrate_boundary(const FiniteElementSpace<dim> &spaces,
                            const dealii::types::boundary_id boundary, const Function &function)
  {
    dealii::FEFaceValues<dim> fe_values(
        spaces.mapping, spaces.fe, dealii::QGauss<dim - 1>(spaces.fe.degree + 2),
        dealii::update_quadrature_points | dealii::update_normal_vectors |
            dealii::update_JxW_values);
    double sum = 0;
    for (const auto &cell : spaces.nodes.active_cell_iterators())
      if (cell->is_locally_owned())
        for (const unsigned int f : cell->face_indices())
          if (cell->face(f)->at_boundary() && cell->face(f)->boundary_id() == boundary)
          {
            fe_values.reinit(cell, f);
            for (const unsigned int q : fe_values.quadrature_point_indices())
              sum += fe_values.JxW(q) *
                     function(fe_values.quadrature_point(q), fe_values.normal_vector(q));
          }
    return dealii::Utilities::MPI::sum(sum, MPI_COMM_WORLD);
  }
} // namespace squeal::tests
