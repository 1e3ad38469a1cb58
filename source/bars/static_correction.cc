#include <squeal/bars/static_correction.h>
#include <squeal/bars/surface_vectors.h>

#include <algorithm>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// A+ x
    template <int dim>
    MultiVector tangent_product(const EnrichedResiduals<dim> &residuals, const MultiVector &x)
    {
      const EnrichedSpace<dim> &space   = residuals.space;
      const std::vector<Column> columns = space.map.import(x);
      std::vector<Column> forces        = space.map.zeros(1);
      CellResiduals<dim> cells(space.fine, space.fine);
      // Re X, Im X, Re Z, Im Z, of which only the first is there
      DenseMatrix fields(space.n_fields * space.n, 1), u(space.n, 4 * dim), r(space.n, 4 * dim);
      unsigned int number = 0;
      for (const auto &cell : space.fine.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          if (space.map.is_part_of_element(number))
          {
            ++number;
            continue;
          }
          cells.reinit(cell);
          space.map.gather(number, columns, fields);
          std::copy_n(fields.values.begin(), dim * space.n, u.values.begin());
          const unsigned int material = residuals.material_of(cell);
          cells.apply(residuals.materials[material].material, {residuals.factors[material].back()},
                      u, r);
          for (const auto &entry : space.map.cells[number])
            if (entry.unknown < dim * space.n)
              forces[0].local_element(entry.index) += entry.weight * r.values[entry.unknown];
          ++number;
        }
      for (const auto &element : space.map.elements)
      {
        if (!element.mine)
          continue;
        const DenseMatrix own = space.map.gather(element, element.nodes.size(), 0, dim, columns);
        DenseMatrix of_element(element.nodes.size(), 4 * dim), result(own.n_rows, 4 * dim);
        std::copy(own.values.begin(), own.values.end(), of_element.values.begin());
        cells.reinit(element);
        const unsigned int material = residuals.material_of(element.cells.cells[0]);
        cells.apply(residuals.materials[material].material, {residuals.factors[material].back()},
                    of_element, result);
        for (const auto &unknown : element.unknowns)
          if (unknown.field < dim)
            forces[0].local_element(unknown.index) += result(unknown.node, unknown.field);
      }
      forces[0].compress(VectorOperation::add);

      SurfaceVectors<dim> surface(*residuals.contact, x, 0, 1);
      const ContactPressure slopes = residuals.friction_gradient();
      residuals.contact->for_each_pair(
          [&](const unsigned int i, const ContactKinematics<dim> &k)
          {
            for (const ContactProduct &product : residuals.static_products(i, k, slopes))
              for (const bool transpose : {false, true})
              {
                if (transpose && !product.transposed_too)
                  continue;
                DenseMatrix at_points = surface.traces(transpose ? product.left : product.right, k);
                for (unsigned int q = 0; q < k.n_points; ++q)
                  at_points(0, q) *= product.c[q];
                surface.add(transpose ? product.right : product.left, k, at_points);
              }
          });
      surface.add_to(forces);

      MultiVector result(space.fine.rows, 1);
      std::copy_n(forces[0].begin(), result.n_local(), result.data());
      for (const Term &term : residuals.joint_terms())
        if (term.order == 0)
          result.add(term.coefficient, multiply(*term.matrix, x));
      return result;
    }

    /// v of -A v = P^T f, but for the rows of open contacts.
    template <int dim>
    MultiVector answer_of_base(const BrakeModel<dim> &model, const EnrichedSpace<dim> &space,
                               const MultiVector &forces)
    {
      MultiVector of_base = space.restrict_forces(forces);
      of_base *= -1;
      clear_rows(of_base, model.contact()->released_multipliers());
      return model.static_response(of_base);
    }
  } // namespace

  template <int dim>
  MultiVector static_correction(const BrakeModel<dim> &model,
                                const EnrichedResiduals<dim> &residuals, MultiVector local)
  {
    const EnrichedSpace<dim> &space = residuals.space;
    local += space.interpolate(answer_of_base(model, space, tangent_product(residuals, local)));
    return local;
  }

  template MultiVector static_correction(const BrakeModel<2> &, const EnrichedResiduals<2> &,
                                         MultiVector);
  template MultiVector static_correction(const BrakeModel<3> &, const EnrichedResiduals<3> &,
                                         MultiVector);
} // namespace squeal
