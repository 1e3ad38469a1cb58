#include <squeal/base/memory.h>
#include <squeal/mesh/finite_element_space.h>
#include <squeal/run/memory_prediction.h>

#include <deal.II/base/numbers.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace squeal
{
  using namespace dealii;

  Plate plate_like(const double inner, const double outer, const double surface,
                   const double volume)
  {
    if (!(volume > 0))
      return {0, 1}; // there is no rotor: not known
    const double area = std::min(numbers::PI * (outer * outer - inner * inner), surface / 2);
    return {area, volume / area};
  }

  template <int dim>
  Plate plate_like_rotor(const FiniteElementSpace<dim> &spaces)
  {
    double inner = std::numeric_limits<double>::max(), outer = 0, volume = 0, surface = 0;
    if constexpr (dim == 3)
      for (const auto &cell : spaces.triangulation.active_cell_iterators())
        if (cell->is_locally_owned() &&
            spaces.geometry.parts[cell->material_id()].body == rotor_body)
        {
          volume += cell->measure();
          for (const unsigned int v : cell->vertex_indices())
          {
            const double radius = std::hypot(cell->vertex(v)[0], cell->vertex(v)[1]);
            inner               = std::min(inner, radius);
            outer               = std::max(outer, radius);
          }
          for (const auto &face : cell->face_iterators())
            if (face->at_boundary())
              surface += cross_product_3d(face->vertex(3) - face->vertex(0),
                                          face->vertex(2) - face->vertex(1))
                             .norm() /
                         2;
        }
    return plate_like(
        Utilities::MPI::min(inner, spaces.comm), Utilities::MPI::max(outer, spaces.comm),
        Utilities::MPI::sum(surface, spaces.comm), Utilities::MPI::sum(volume, spaces.comm));
  }

  double expected_number_of_modes(const Parameters::All &parameters, const Plate &rotor)
  {
    const Parameters::Eigenproblem &window = parameters.eigenproblem;
    const Material &material               = parameters.rotor.material;
    // Bending modes of a plate of area A and thickness h below f: sqrt(3) A f / (c h) (Courant and
    // Hilbert), c^2 = E / rho (1 - nu^2). In-plane modes and pads make it 1.67 times as many.
    const double c = std::sqrt(material.young_modulus /
                               (material.density * (1 - std::pow(material.poisson_ratio, 2))));
    return 1.67 * std::sqrt(3.) * rotor.area *
           (window.maximum_frequency - window.minimum_frequency) / (c * rotor.thickness);
  }

  double cells_like(const OwnElements &elements, const unsigned int degree)
  {
    const double p = degree, cell = std::pow(p + 1, 3);
    double sum = 0;
    for (const ElementShape shape : elements.shapes)
    {
      const double functions = shape == ElementShape::tetrahedron ? (p + 1) * (p + 2) * (p + 3) / 6
                               : shape == ElementShape::wedge     ? (p + 1) * (p + 1) * (p + 2) / 2
                                                                  : cell;
      sum += std::pow(functions / cell, 2);
    }
    return sum;
  }

  double expected_peak_mib(const RunSize &size)
  {
    // The mesh of divided elements, with what nodes of its cells are interpolated from
    constexpr double per_rank = 196, mib = sizeof(double) * 1e-6, per_cell_of_elements = 0.012;
    const double libraries =
        size.n_ranks * per_rank + per_cell_of_elements * size.n_cells_of_elements;
    // Functions of a cell in the space of displacements and in that of the error bars.
    const double n = 3 * std::pow(size.degree + 1, 3), n_bars = 3 * std::pow(size.degree + 2, 3),
                 of_cells = mib * size.n_cells * n * n, of_vector = mib * size.n_unknowns;
    if (size.solver == ModeSolver::none)
      return libraries + 2.48 * of_cells + 402 * of_vector;
    if (size.solver == ModeSolver::block_davidson)
      return libraries + 85 * of_vector * size.n_modes;

    double with_bars = libraries + 34.8 * of_vector * size.n_modes + 2.77 * of_cells;
    if (size.error_bars)
      with_bars += 0.038 * size.n_cells + 1.09 * mib * size.n_cells * size.n_modes * n_bars;
    // Nested dissection in three dimensions.
    const double factors = (1e-4 + 0.48e-4 * size.degree) *
                           std::pow(size.n_unknowns / (size.is_halved ? 2 : 1), 4. / 3);
    return std::max(with_bars, libraries + 2.15 * of_cells + 2.64 * factors);
  }

  double expected_memory_load(const RunSize &size, const MPI_Comm comm)
  {
    constexpr double largest_error = 1.25;
    const double more = expected_peak_mib(size) / largest_error - peak_memory_mib(comm);
    return memory_load(std::max(0., more) / size.n_ranks, comm);
  }

  template Plate plate_like_rotor(const FiniteElementSpace<2> &);
  template Plate plate_like_rotor(const FiniteElementSpace<3> &);
} // namespace squeal
