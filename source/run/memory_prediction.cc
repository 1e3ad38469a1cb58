#include <squeal/base/memory.h>
#include <squeal/run/memory_prediction.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  double expected_number_of_modes(const Parameters::All &parameters)
  {
    const Parameters::Eigenproblem &window = parameters.eigenproblem;
    const Parameters::Rotor &rotor         = parameters.rotor;
    const Material &material               = rotor.material;
    // Bending modes of a plate of area A and thickness h below f: sqrt(3) A f / (c h) (Courant and
    // Hilbert), c^2 = E / rho (1 - nu^2). In-plane modes and pads make it 1.67 times as many.
    const double area = M_PI * (std::pow(rotor.outer_radius, 2) - std::pow(rotor.inner_radius, 2)),
                 c    = std::sqrt(material.young_modulus /
                                  (material.density * (1 - std::pow(material.poisson_ratio, 2))));
    return 1.67 * std::sqrt(3.) * area * (window.maximum_frequency - window.minimum_frequency) /
           (c * rotor.thickness);
  }

  double expected_peak_mib(const RunSize &size)
  {
    constexpr double libraries = 192, mib = 1. / (1024 * 1024);
    // Functions of a cell in the space of the error bars.
    const double n_functions = 3 * std::pow(size.degree + 2, 3);
    double peak              = size.n_ranks * libraries + 8.51e-3 * size.n_unknowns +
                  23.5 * sizeof(double) * mib * size.n_unknowns * size.n_modes;
    if (size.error_bars)
      peak += 0.0787 * size.n_cells +
              2.71 * sizeof(double) * mib * size.n_cells * size.n_modes * n_functions;
    return peak;
  }

  double expected_memory_load(const RunSize &size, const MPI_Comm comm)
  {
    constexpr double largest_error = 1.25;
    const double more = expected_peak_mib(size) / largest_error - peak_memory_mib(comm);
    return memory_load(std::max(0., more) / size.n_ranks, comm);
  }
} // namespace squeal
